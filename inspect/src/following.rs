//! The data of one output for as long as the system runs. When a provider ends, it links to the
//! next.

use std::time::Duration;

use armor_sdk::tap::{Tap, TapData, TapError};
use armor_wire::schema::Schema;
use thiserror::Error;

use crate::observed::{ObservedSystem, TAP_KEEP};

/// Time within which the registry must answer before the system counts as ended.
const ASK_EVERY: Duration = Duration::from_secs(1);

/// Why there is no more data.
#[derive(Debug, Error)]
pub enum FollowError {
    /// No component provides it, or its provider cannot be reached.
    #[error(transparent)]
    Tap(#[from] TapError),
    /// Its provider has ended for good; the reason.
    #[error("{0}")]
    GoneForGood(String),
    /// Its provider and the whole system have ended.
    #[error("the system that provided {0} has ended")]
    Ended(String),
}

/// What a tool knows about the provider of data that it follows.
pub trait ProviderWatcher {
    /// The link has ended, for this reason; the next provider is waited for.
    fn report_end(&self, reason: &str);

    /// Called about once per second while no process provides the data.
    ///
    /// # Errors
    /// In words, if the provider has ended for good.
    fn check_return(&self) -> Result<(), String>;
}

/// A tap that links again.
pub struct FollowingTap {
    observed: ObservedSystem,
    data: String,
    tap: Tap,
    watcher: Box<dyn ProviderWatcher>,
}

impl FollowingTap {
    /// Links to `data`; waits until `timeout` for a provider.
    ///
    /// # Errors
    /// If no component provides it, or the provider cannot be reached.
    pub fn begin(
        observed: ObservedSystem,
        data: &str,
        timeout: Duration,
        watcher: impl ProviderWatcher + 'static,
    ) -> Result<Self, TapError> {
        let tap = observed.tap_within(data, timeout)?;
        Ok(Self { observed, data: data.into(), tap, watcher: Box::new(watcher) })
    }

    /// Returns the layout of the data, as the present provider declares it.
    pub fn schema(&self) -> &Schema {
        self.tap.schema()
    }

    /// Returns the name of the data.
    pub fn data(&self) -> &str {
        &self.data
    }

    /// Returns the system that is observed.
    pub fn observed(&self) -> &ObservedSystem {
        &self.observed
    }

    /// Returns the next data; `None` if none comes within `timeout`.
    ///
    /// # Errors
    /// If the system has ended, or the provider for good.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<TapData>, FollowError> {
        match self.tap.next(timeout) {
            Err(TapError::Ended(reason)) => {
                self.watcher.report_end(&reason);
                self.tap = self.link_again()?;
                Ok(None)
            }
            other => Ok(other?),
        }
    }

    fn link_again(&self) -> Result<Tap, FollowError> {
        loop {
            let data = &self.data;
            match Tap::open(self.observed.directory(), data, TAP_KEEP, ASK_EVERY) {
                Ok(tap) => return Ok(tap),
                // No provider yet, or the registry ended with the system.
                Err(_) if self.observed.list().is_ok() => {
                    self.watcher.check_return().map_err(FollowError::GoneForGood)?;
                    std::thread::sleep(ASK_EVERY / 10);
                }
                // A system on another host may be cut off, and is waited for.
                Err(_) if self.observed.directory().is_remote() => {
                    std::thread::sleep(ASK_EVERY / 10);
                }
                Err(_) => return Err(FollowError::Ended(data.clone())),
            }
        }
    }
}
