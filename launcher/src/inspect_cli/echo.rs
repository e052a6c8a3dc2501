//! `armor echo DATA`: data as it is published, as JSON whatever its type.

use std::time::Duration;

use anyhow::{Context, Result};
use armor_wire::schema::to_json;
use serde_json::json;

use super::{printed, say};
use crate::arguments::Echo;
use crate::exit::Ending;

/// How often to look whether the link still is; data come at once.
const LOOK_EVERY: Duration = Duration::from_secs(3600);

/// Prints until enough was seen, or interrupted.
///
/// # Errors
/// If nobody provides the data, or the system ends.
pub fn run(arguments: &Echo) -> Result<Ending> {
    let data = &arguments.data;
    let observed = super::find(&arguments.running, "echo")?;
    let mut following = super::follow(observed, data)?;
    let mut left = arguments.count.unwrap_or(u64::MAX);
    let mut print = || -> Result<()> {
        while left > 0 {
            let Some(item) = following.next(LOOK_EVERY)? else { continue };
            let value = to_json(following.schema(), &item.payload)
                .with_context(|| format!("{data} does not fit its own schema"))?;
            say(json!({
                "data": data,
                "sequence": item.header.sequence,
                "stamp_s": item.header.stamp_s,
                "lost": item.lost,
                "value": value,
            }))?;
            left -= 1;
        }
        Ok(())
    };
    printed(print())
}
