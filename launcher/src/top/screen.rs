//! `armor top` on a terminal.

use std::time::{Duration, Instant};

use anyhow::Result;

use super::collector::Collector;
use super::drawing;
use super::snapshot::SortKey;
use super::view::{KeyResult, TopView};
use crate::exit::CommandEnding;
use crate::terminal_session::{SessionEvent, TerminalSession};

/// Time between two looks until all rates are known, which takes a second.
const FIRST_INTERVAL: Duration = Duration::from_millis(300);
/// Longest time until the result of a request is shown.
const RESULTS_WITHIN: Duration = Duration::from_millis(200);

/// Shows the system until the user or a signal ends it.
///
/// # Errors
/// If the terminal cannot be used.
pub fn show(mut collector: Collector, sort: SortKey, interval: Duration) -> Result<CommandEnding> {
    let mut view = TopView::sorted_by(sort);
    view.set_snapshot(collector.look());
    let mut session = TerminalSession::enter()?;
    let mut looked = Instant::now();
    let mut is_complete = false;
    loop {
        session.draw(|frame| drawing::draw(frame, &view))?;
        let wait = if is_complete { interval } else { FIRST_INTERVAL.min(interval) };
        loop {
            let left = wait.saturating_sub(looked.elapsed());
            if left.is_zero() {
                view.set_snapshot(collector.look());
                is_complete |= view.snapshot.has_all_rates();
                looked = Instant::now();
                break;
            }
            if let Some(result) = collector.take_results().pop() {
                view.message = result;
                break;
            }
            match session.next_event(left.min(RESULTS_WITHIN))? {
                SessionEvent::Nothing => continue,
                SessionEvent::Resized => {}
                SessionEvent::Signal => return Ok(CommandEnding::Interrupted),
                SessionEvent::Key(key) => match view.handle_key(key) {
                    KeyResult::Shown => {}
                    KeyResult::Quit { is_interrupted: false } => return Ok(CommandEnding::Fine),
                    KeyResult::Quit { is_interrupted: true } => {
                        return Ok(CommandEnding::Interrupted);
                    }
                    KeyResult::Send(request) => collector.send(request),
                },
            }
            break;
        }
    }
}
