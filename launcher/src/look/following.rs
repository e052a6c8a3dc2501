//! The data of one output for as long as the system runs: when its provider is gone, the next one.

use std::time::Duration;

use anyhow::{Result, bail};
use armor_sdk::tap::{Tap, TapData, TapError};
use armor_wire::schema::Schema;

use super::Observed;

/// How long the registry is given to say whether it is still there.
const ASK_EVERY: Duration = Duration::from_secs(1);

/// A tap that links again.
pub struct Following {
    observed: Observed,
    data: String,
    tap: Tap,
}

impl Following {
    /// Links to `data`, which somebody must provide by now.
    ///
    /// # Errors
    /// If nobody does, or the provider cannot be reached.
    pub fn begin(observed: Observed, data: &str) -> Result<Self> {
        let tap = observed.tap(data)?;
        Ok(Self { observed, data: data.into(), tap })
    }

    /// Layout of the data, by whoever provides it now.
    pub fn schema(&self) -> &Schema {
        self.tap.schema()
    }

    /// The next data; `None` if none comes within `timeout`.
    ///
    /// # Errors
    /// If the system has ended.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<TapData>> {
        match self.tap.next(timeout) {
            Err(TapError::Ended(reason)) => {
                let data = &self.data;
                eprintln!("{data}: the link has ended: {reason}; waiting for its provider");
                self.tap = self.link_again()?;
                Ok(None)
            }
            other => Ok(other?),
        }
    }

    fn link_again(&self) -> Result<Tap> {
        loop {
            let data = &self.data;
            match Tap::open(self.observed.directory(), data, super::TAP_KEEP, ASK_EVERY) {
                Ok(tap) => return Ok(tap),
                // Nobody provides it yet, or the registry is gone with the system.
                Err(_) if self.observed.list().is_ok() => std::thread::sleep(ASK_EVERY / 10),
                Err(_) => bail!("the system that provided {data} has ended"),
            }
        }
    }
}
