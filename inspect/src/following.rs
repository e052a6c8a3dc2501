//! The data of one output for as long as the system runs: when its provider is gone, the next one.

use std::time::Duration;

use armor_sdk::tap::{Tap, TapData, TapError};
use armor_wire::schema::Schema;
use thiserror::Error;

use crate::observed::{Observed, TAP_KEEP};

/// How long the registry is given to say whether it is still there.
const ASK_EVERY: Duration = Duration::from_secs(1);

/// Why there is no more data.
#[derive(Debug, Error)]
pub enum FollowError {
    /// Nobody has provided it, or its provider cannot be reached.
    #[error(transparent)]
    Tap(#[from] TapError),
    /// Its provider has gone, and the system with it.
    #[error("the system that provided {0} has ended")]
    Ended(String),
}

/// A tap that links again.
pub struct Following {
    observed: Observed,
    data: String,
    tap: Tap,
    told: Box<dyn Fn(&str)>,
}

impl Following {
    /// Links to `data`, which somebody must provide by now; `told` is told why a link has ended,
    /// before its provider is waited for.
    ///
    /// # Errors
    /// If nobody does, or the provider cannot be reached.
    pub fn begin(
        observed: Observed,
        data: &str,
        told: impl Fn(&str) + 'static,
    ) -> Result<Self, TapError> {
        let tap = observed.tap(data)?;
        Ok(Self { observed, data: data.into(), tap, told: Box::new(told) })
    }

    /// Layout of the data, by whoever provides it now.
    pub fn schema(&self) -> &Schema {
        self.tap.schema()
    }

    /// The next data; `None` if none comes within `timeout`.
    ///
    /// # Errors
    /// If the system has ended.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<TapData>, FollowError> {
        match self.tap.next(timeout) {
            Err(TapError::Ended(reason)) => {
                (self.told)(&reason);
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
                // Nobody provides it yet, or the registry is gone with the system.
                Err(_) if self.observed.list().is_ok() => std::thread::sleep(ASK_EVERY / 10),
                Err(_) => return Err(FollowError::Ended(data.clone())),
            }
        }
    }
}
