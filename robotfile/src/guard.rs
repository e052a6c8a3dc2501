//! Guards: the language of `when="…"`. A small typed language over variables and fields of data:
//! read here from its text, judged against the types of the data, and evaluated in a logic of three
//! values, since what has not arrived yet is neither true nor false. `docs/file-format.md` has the
//! grammar. Pure, in time linear in the text, and without panics whatever the text.
//!
//! ```
//! use armor_robotfile::guard::{Guard, Scalar};
//!
//! let guard = Guard::parse("battery < 30% and not charger.state.docked").unwrap();
//! assert_eq!(guard.names()[1].data(), Some("charger.state"));
//! let holds = |level, docked| guard.holds(&[level, docked]);
//! assert_eq!(holds(Some(Scalar::Number(0.2)), Some(Scalar::Flag(false))), Some(true));
//! assert_eq!(holds(Some(Scalar::Number(0.2)), None), None);
//! assert_eq!(holds(Some(Scalar::Number(0.9)), None), Some(false));
//! ```

mod alternatives;
mod bounds;
mod contradiction;
mod count;
mod evaluate;
mod exactness;
mod implication;
mod judge;
mod meaning;
mod measure;
mod name;
mod node;
mod parse;
mod print;
#[cfg(test)]
mod tests;
mod token;

pub use armor_wire::schema::Scalar;
pub(crate) use bounds::{is_never_true, range_of};
pub use count::{Count, MAX_COUNT};
pub(crate) use implication::implies;
pub(crate) use judge::judge;
pub(crate) use meaning::{Meaning, Type};
pub(crate) use measure::{Measure, dimension_noun};
pub use name::Name;
pub(crate) use node::GuardOperator;
pub use node::{Guard, GuardError};
pub use parse::{MAX_DEPTH, MAX_LEN};
pub(crate) use token::{GuardToken, find_misspelt, tokens};
