//! Ctrl-C and SIGTERM: the job ends at its next step, and what it has set up is removed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use tokio::signal::unix::{SignalKind, signal};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// Time between two looks of whatever waits.
pub const LOOK: Duration = Duration::from_millis(5);

/// Notices the signals from now on, instead of dying of them.
///
/// # Errors
/// If the event loop cannot be started.
pub fn notice_signals() -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (mut interrupt, mut terminate) = {
        let _entered = runtime.enter();
        (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?)
    };
    std::thread::spawn(move || {
        runtime.block_on(async {
            tokio::select! { _ = interrupt.recv() => {}, _ = terminate.recv() => {} }
        });
        INTERRUPTED.store(true, Ordering::Relaxed);
    });
    Ok(())
}

/// Whether one has come.
pub fn was_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Waits.
///
/// # Errors
/// If the job was interrupted.
pub fn rest(time: Duration) -> Result<()> {
    let end = Instant::now() + time;
    loop {
        if was_interrupted() {
            bail!("interrupted");
        }
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(());
        }
        std::thread::sleep(left.min(LOOK));
    }
}

/// Repeats `look` until it finds something.
///
/// # Errors
/// If it has not after `limit`, the job was interrupted, or `look` fails.
pub fn wait_until<T>(
    limit: Duration,
    what: &str,
    mut look: impl FnMut() -> Result<Option<T>>,
) -> Result<T> {
    let end = Instant::now() + limit;
    loop {
        if let Some(found) = look()? {
            return Ok(found);
        }
        if Instant::now() > end {
            bail!("after {} s still waiting for {what}", limit.as_secs());
        }
        rest(LOOK)?;
    }
}
