//! What a mission continues from: its journal, or the safe place if that is lost or damaged.

use crate::journal::{self, Journal, JournalError, Story};
use crate::ledger::Ledger;
use crate::ledger::applying::replay_records;
use crate::run::{ExecutiveOptions, RunError};
use armor_plan::Plan;
use std::path::Path;
use std::sync::Arc;

/// Replays a journal over the version of the file that it holds, or else over `first`.
pub(crate) fn read_again(
    story: &Story,
    first: impl FnOnce() -> Result<Plan, String>,
    options: &ExecutiveOptions,
) -> Result<Ledger, RunError> {
    let began = match journal::began_with(&story.records) {
        Some(version) => version.plan(),
        None => first(),
    };
    let journal = &options.journal;
    let began = Arc::new(set_clock(began.map_err(RunError::Mission)?, options));
    let refused = |error| RunError::Resume { path: journal.clone(), error };
    replay_records(began, &story.records).map_err(refused)
}

/// The plan in the time that the options name, whatever its file specifies.
fn set_clock(plan: Plan, options: &ExecutiveOptions) -> Plan {
    match &options.clock {
        Some(clock) => plan.with_clock(clock.clone()),
        None => plan,
    }
}

/// The journal at the start of an executive.
pub(crate) struct OpenedJournal {
    pub(crate) journal: Journal,
    /// What the mission continues from.
    pub(crate) story: Story,
    /// Why it is not known where the mission stood.
    pub(crate) loss: Option<String>,
    /// What is readable of a damaged journal: not enough to continue from.
    pub(crate) readable: Story,
}

/// Opens the journal. A damaged one is kept under another name, and a new one takes its place.
pub(crate) fn open_journal(path: &Path, is_laid_out: bool) -> Result<OpenedJournal, RunError> {
    let at = path.display();
    let unknown = "it is not known where the mission stood, and it does not begin again";
    let (journal, story, loss, readable) = match Journal::open(path) {
        Ok((journal, story)) => {
            let is_lost = is_laid_out && story.is_blank();
            let why = || format!("the journal of the mission, {at}, is gone: {unknown}");
            (journal, story, is_lost.then(why), Story::default())
        }
        Err(JournalError::Damaged(damage)) => {
            let (journal, kept) = Journal::replace_damaged(&damage)?;
            let kept = kept.map(|kept| format!("; it is kept as {}", kept.display()));
            let why = format!("{damage}{}; {unknown}", kept.unwrap_or_default());
            (journal, Story::default(), Some(why), damage.story)
        }
        Err(error) => return Err(error.into()),
    };
    Ok(OpenedJournal { journal, story, loss, readable })
}

/// Returns the last plan that is readable in a damaged journal, or else `first`.
pub(crate) fn newest_plan(
    readable: &Story,
    first: impl FnOnce() -> Result<Plan, String>,
    options: &ExecutiveOptions,
) -> Result<Arc<Plan>, RunError> {
    let plan = match journal::plan_of(readable) {
        Ok(plan) => Arc::unwrap_or_clone(plan),
        Err(_) => first().map_err(RunError::Mission)?,
    };
    Ok(Arc::new(set_clock(plan, options)))
}
