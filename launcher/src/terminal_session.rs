//! The terminal while a command fills it: entered, drawn, and left as it was, also after a signal or a
//! panic.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use ratatui::crossterm::event::{self, Event, KeyEvent, KeyEventKind};
use ratatui::{DefaultTerminal, Frame};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// How long a signal may wait for a key.
const KEYS_WITHIN: Duration = Duration::from_millis(100);

/// The terminal, until it is dropped.
pub struct TerminalSession {
    terminal: DefaultTerminal,
    is_signalled: Arc<AtomicBool>,
}

/// What has happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionEvent {
    /// A key.
    Key(KeyEvent),
    /// The terminal has another size, which the next drawing has.
    Resized,
    /// A signal asks for the end.
    Signal,
    /// Nothing, for as long as was waited.
    Nothing,
}

impl TerminalSession {
    /// Fills the terminal. A panic restores it before its message is printed.
    ///
    /// # Errors
    /// If the terminal cannot be used.
    pub fn enter() -> Result<Self> {
        let is_signalled = Arc::new(AtomicBool::new(false));
        for signal in [SIGTERM, SIGHUP, SIGINT] {
            signal_hook::flag::register(signal, Arc::clone(&is_signalled))
                .context("the signals cannot be awaited")?;
        }
        let terminal = ratatui::try_init().context("the terminal cannot be used")?;
        Ok(Self { terminal, is_signalled })
    }

    /// Draws the whole.
    ///
    /// # Errors
    /// If the terminal cannot be written.
    pub fn draw(&mut self, draw: impl FnOnce(&mut Frame<'_>)) -> Result<()> {
        self.terminal.draw(draw)?;
        Ok(())
    }

    /// Waits for the next event, at most for `limit`.
    ///
    /// # Errors
    /// If the terminal cannot be read.
    pub fn next_event(&self, limit: Duration) -> Result<SessionEvent> {
        let start = Instant::now();
        loop {
            if self.is_signalled.load(Ordering::Relaxed) {
                return Ok(SessionEvent::Signal);
            }
            let left = limit.saturating_sub(start.elapsed());
            if event::poll(left.min(KEYS_WITHIN))? {
                match event::read()? {
                    Event::Key(key) if key.kind != KeyEventKind::Release => {
                        return Ok(SessionEvent::Key(key));
                    }
                    Event::Resize(..) => return Ok(SessionEvent::Resized),
                    _ => {}
                }
            } else if left.is_zero() {
                return Ok(SessionEvent::Nothing);
            }
        }
    }
}

impl Drop for TerminalSession {
    fn drop(&mut self) {
        ratatui::restore();
    }
}
