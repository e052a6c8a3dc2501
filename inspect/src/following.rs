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
    /// Its provider and the whole system have ended.
    #[error("the system that provided {0} has ended")]
    Ended(String),
}

/// A tap that links again.
pub struct FollowingTap {
    observed: ObservedSystem,
    data: String,
    tap: Tap,
    report_end: Box<dyn Fn(&str)>,
}

impl FollowingTap {
    /// Links to `data`; waits until `timeout` for a provider. `report_end` is called with the
    /// reason whenever a link ends, before waiting for the next provider.
    ///
    /// # Errors
    /// If no component provides it, or the provider cannot be reached.
    pub fn begin(
        observed: ObservedSystem,
        data: &str,
        timeout: Duration,
        report_end: impl Fn(&str) + 'static,
    ) -> Result<Self, TapError> {
        let tap = observed.tap_within(data, timeout)?;
        Ok(Self { observed, data: data.into(), tap, report_end: Box::new(report_end) })
    }

    /// Returns the layout of the data, as the present provider declares it.
    pub fn schema(&self) -> &Schema {
        self.tap.schema()
    }

    /// Returns the next data; `None` if none comes within `timeout`.
    ///
    /// # Errors
    /// If the system has ended.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<TapData>, FollowError> {
        match self.tap.next(timeout) {
            Err(TapError::Ended(reason)) => {
                (self.report_end)(&reason);
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
                Err(_) if self.observed.list().is_ok() => std::thread::sleep(ASK_EVERY / 10),
                Err(_) => return Err(FollowError::Ended(data.clone())),
            }
        }
    }
}
