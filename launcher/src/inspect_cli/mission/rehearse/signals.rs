//! Ctrl-C and other requests to end, while a rehearsal is played.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// The signals that end a rehearsal.
pub struct ReceivedSignals {
    is_interrupted: Arc<AtomicBool>,
    is_ended: Arc<AtomicBool>,
}

impl ReceivedSignals {
    pub fn register() -> Result<Self> {
        let signals = Self { is_interrupted: Arc::default(), is_ended: Arc::default() };
        let register = |signal, flag: &Arc<AtomicBool>| {
            signal_hook::flag::register(signal, Arc::clone(flag))
                .context("the end of the rehearsal by a signal cannot be prepared")
        };
        register(SIGINT, &signals.is_interrupted)?;
        register(SIGTERM, &signals.is_ended)?;
        register(SIGHUP, &signals.is_ended)?;
        Ok(signals)
    }

    /// Returns whether one has come.
    pub fn has_come(&self) -> bool {
        self.is_interrupted.load(Ordering::Relaxed) || self.is_ended.load(Ordering::Relaxed)
    }
}
