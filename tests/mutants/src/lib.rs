//! The mutation study of `armor check`: seeded mutations of the example files are checked as
//! `armor check --strict` does; those that pass are run in the simulator and compared with their
//! example. `docs/mutations.md` has the figures.
//!
//! Open `mutation.rs` first: the kinds of mutations and the generator. `verdict.rs` checks a
//! mutant, `trial.rs` runs one, `study.rs` has the table.

mod edits;
mod example;
mod mutation;
mod study;
mod trial;
mod verdict;

use std::path::{Path, PathBuf};

pub use example::Example;
pub use mutation::{Mutant, MutationKind, generate_mutants};
pub use study::{RowCounts, StudiedMutant, TrialResult, count_all, count_kinds, format_table};
pub use trial::{Outcome, TrialGround};
pub use verdict::{
    CheckVerdict, check_text, check_with_program, collect_manifests, compare_meaning,
    judge_findings,
};

/// The folder of the examples.
pub fn missions_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions")
}
