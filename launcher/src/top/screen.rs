//! The terminal of `armor top`: entered, drawn, and left as it was, also after a signal or a panic.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEventKind};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::collector::Collector;
use super::drawing;
use super::snapshot::SortKey;
use super::view::{KeyResult, TopView};
use crate::exit::CommandEnding;

/// How long a signal may wait for a key.
const KEYS_WITHIN: Duration = Duration::from_millis(100);

/// Shows the system until the user or a signal ends it.
///
/// # Errors
/// If the terminal cannot be used.
pub fn show(mut collector: Collector, sort: SortKey, interval: Duration) -> Result<CommandEnding> {
    let is_signalled = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGHUP, SIGINT] {
        signal_hook::flag::register(signal, Arc::clone(&is_signalled))
            .context("the signals cannot be awaited")?;
    }
    let mut view = TopView::sorted_by(sort);
    view.set_snapshot(collector.look());
    // A panic restores the terminal before its message is printed.
    let mut terminal = ratatui::try_init().context("the terminal cannot be used")?;
    let shown = show_until_end(&mut terminal, &mut view, &mut collector, interval, &is_signalled);
    ratatui::restore();
    shown
}

fn show_until_end(
    terminal: &mut DefaultTerminal,
    view: &mut TopView,
    collector: &mut Collector,
    interval: Duration,
    is_signalled: &AtomicBool,
) -> Result<CommandEnding> {
    let mut looked = Instant::now();
    let mut is_complete = false;
    loop {
        terminal.draw(|frame| drawing::draw(frame, view))?;
        // The first looks are shorter apart: rates are known after a second.
        let wait = if is_complete { interval } else { Duration::from_millis(300).min(interval) };
        loop {
            if is_signalled.load(Ordering::Relaxed) {
                return Ok(CommandEnding::Interrupted);
            }
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
            if !event::poll(left.min(KEYS_WITHIN))? {
                continue;
            }
            match event::read()? {
                Event::Key(key) if key.kind != KeyEventKind::Release => {
                    match view.handle_key(key) {
                        KeyResult::Shown => {}
                        KeyResult::Quit { is_interrupted: false } => {
                            return Ok(CommandEnding::Fine);
                        }
                        KeyResult::Quit { is_interrupted: true } => {
                            return Ok(CommandEnding::Interrupted);
                        }
                        KeyResult::Send(request) => collector.send(request),
                    }
                }
                // The next drawing has the new size.
                Event::Resize(..) => {}
                _ => continue,
            }
            break;
        }
    }
}
