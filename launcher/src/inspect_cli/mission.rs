//! `armor mission`: where the mission stands, from what the executive publishes; orders to it; and
//! its journal.

mod file;
mod firing;
mod journal;
mod orders;
mod replay;
mod words;

use std::time::Duration;

use anyhow::{Context, Error, Result, bail};
use armor_marking::Marking;
use armor_sdk::control::{Order, TokenMove};
use armor_sdk::directory::DirectoryError;
use armor_sdk::tap::TapError;
use armor_wire::WireType;
use armor_wire::clock::Clock;
use armor_wire::codec;
use armor_wire::schema::{Schema, to_json};

use super::{printed, say};
use crate::arguments::{Format, Mission, Running};
use crate::exit::Ending;
use armor_inspect::{FollowingTap, ObservedSystem};
use words::in_words;

/// What the executive publishes, latched, at every change.
const MARKING: &str = "executive.marking";
/// How long a latched value may take to come.
const FIRST_WITHIN: Duration = Duration::from_secs(3);
/// How often to look whether the link still is; changes come at once.
const LOOK_EVERY: Duration = Duration::from_secs(3600);

/// Does what is asked of the mission.
///
/// # Errors
/// If no mission runs, the executive does not answer, or the journal cannot be read.
pub fn run(mission: Mission, format: Format) -> Result<Ending> {
    let (by, order) = match mission {
        Mission::Show { follow, running } => return show(&running, follow, format),
        Mission::Journal { journal, running } => {
            return journal::print(journal.as_deref(), &running, format);
        }
        Mission::Replay(arguments) => return replay::run(&arguments, format),
        Mission::Operate(by) => return orders::operate(&by, format),
        Mission::Fire { transition, by } => (by, Order::Fire { transition }),
        Mission::Pause(by) => (by, Order::Pause),
        Mission::Resume(by) => (by, Order::Resume),
        Mission::Safe(by) => (by, Order::Safe),
        Mission::Move { from, to, tokens, by } => {
            (by, Order::Move { moves: vec![TokenMove { from, to, tokens }] })
        }
        Mission::Confirm { transition, by } => (by, Order::Confirm { transition }),
        Mission::Decline { transition, by } => (by, Order::Decline { transition }),
    };
    orders::give(&by, &order, format)
}

/// Prints the marking, and again at every change if it is followed.
///
/// # Errors
/// If no mission runs.
fn show(running: &Running, follow: bool, format: Format) -> Result<Ending> {
    let observed = super::find(running, "mission")?;
    let said = super::follow(super::find(running, "mission")?, MARKING);
    printed(follow_marking(&observed, said.map_err(why_nothing)?, follow, format))
}

/// Whether there is no mission, or only nobody who answers, which is another matter.
fn why_nothing(error: Error) -> Error {
    let what = match error.downcast_ref::<TapError>() {
        Some(TapError::Directory(DirectoryError::Refused(_))) => "no mission runs in this system",
        Some(TapError::Directory(_)) => "whether a mission runs is not known",
        _ => "a mission runs, but its executive does not answer",
    };
    error.context(what)
}

fn follow_marking(
    observed: &ObservedSystem,
    mut said: FollowingTap,
    follow: bool,
    format: Format,
) -> Result<()> {
    let mut shown = Shown { observed, format, before: false };
    let Some(first) = said.next(FIRST_WITHIN)? else {
        bail!("the executive has not said its marking within {} s", FIRST_WITHIN.as_secs());
    };
    shown.show(said.schema(), &first.payload)?;
    if !follow {
        return Ok(());
    }
    loop {
        if let Some(next) = said.next(LOOK_EVERY)? {
            shown.show(said.schema(), &next.payload)?;
        }
    }
}

struct Shown<'a> {
    observed: &'a ObservedSystem,
    format: Format,
    before: bool,
}

impl Shown<'_> {
    fn show(&mut self, schema: &Schema, payload: &[u8]) -> Result<()> {
        if self.format == Format::Json {
            let value = to_json(schema, payload);
            return say(value.with_context(|| format!("{MARKING} does not fit its own schema"))?);
        }
        if schema.hash() != Marking::schema().hash() {
            bail!("this executive is of another version; --format json shows what it says");
        }
        if std::mem::replace(&mut self.before, true) {
            say("")?;
        }
        let marking: Marking = codec::decode(payload)?;
        // It was said when it changed, and its clocks have run since.
        let now_s = match marking.clock.as_str() {
            "" => Some(self.observed.timestamp()),
            clock => time_of(self.observed, clock),
        };
        // The executive has not heard the time itself yet: none of it has passed.
        let stamp_s = Some(marking.stamp).filter(|stamp_s| *stamp_s > 0.0);
        let age_s = now_s.zip(stamp_s).map_or(0.0, |(now_s, stamp_s)| (now_s - stamp_s).max(0.0));
        let file = file::problem(self.observed, marking.version);
        say(in_words(&marking, age_s, file.as_deref()).trim_end())
    }
}

/// What the data that mission time follows says now, if it does.
fn time_of(observed: &ObservedSystem, clock: &str) -> Option<f64> {
    let said = observed.tap(clock).ok()?.next(FIRST_WITHIN).ok()??;
    codec::decode(&said.payload).ok().map(|said: Clock| said.clock)
}
