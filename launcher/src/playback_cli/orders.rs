//! `armor playback`: orders to the player of a recording that runs.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_recording::playback::{PLAYBACK, PlaybackSpeed, PlaybackState};
use armor_sdk::control::{Command, PlaybackOrder};
use armor_wire::codec;
use clap::{Subcommand, ValueEnum};
use serde_json::json;

use crate::arguments::{OutputFormat, RunningSystem, parse_duration};
use crate::component_orders::answer::{ANSWER_WITHIN, REQUEST, send_command};
use crate::exit::CommandEnding;
use crate::inspect_cli::select_system;
use crate::print::{end_printing, print_line};
use crate::verb::Verb;

/// Control a recording that is played: pause, step, seek, speed, loop.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  armor playback pause
  armor playback step            to the next message
  armor playback step 0.5s
  armor playback seek 90s        from the beginning
  armor playback speed max")]
pub enum PlaybackCommand {
    /// Show how far it has come.
    Show {
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Let time stand still.
    Pause {
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Let time pass again.
    Resume {
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Let some time pass, and pause again.
    Step {
        /// How much. Default: up to the next message.
        #[arg(value_name = "TIME", value_parser = parse_duration)]
        time: Option<Duration>,
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Continue at another moment.
    Seek {
        /// Counted from the beginning of what is played.
        #[arg(value_name = "TIME", value_parser = parse_duration)]
        to: Duration,
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Change the speed.
    Speed {
        /// How many times as fast as recorded, or max.
        #[arg(value_name = "TIMES", allow_negative_numbers = true)]
        times: PlaybackSpeed,
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Begin again at the end, or not.
    Loop {
        /// Whether it does.
        #[arg(value_enum)]
        switch: LoopSwitch,
        #[command(flatten)]
        running: RunningSystem,
    },
}

/// Whether what is played begins again at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LoopSwitch {
    On,
    Off,
}

impl Verb for PlaybackCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let ending = match self {
            Self::Show { running } => show_state(&running, format)?,
            Self::Pause { running } => give_order(&running, PlaybackOrder::Pause, format)?,
            Self::Resume { running } => give_order(&running, PlaybackOrder::Resume, format)?,
            Self::Step { time, running } => {
                let time_s = time.map_or(0.0, |time| time.as_secs_f64());
                give_order(&running, PlaybackOrder::Step { time_s }, format)?
            }
            Self::Seek { to, running } => {
                give_order(&running, PlaybackOrder::Seek { at_s: to.as_secs_f64() }, format)?
            }
            Self::Speed { times, running } => {
                give_order(&running, PlaybackOrder::Speed { factor: times.factor() }, format)?
            }
            Self::Loop { switch, running } => {
                let on = switch == LoopSwitch::On;
                give_order(&running, PlaybackOrder::Loop { on }, format)?
            }
        };
        Ok(ending.into())
    }
}

fn give_order(
    running: &RunningSystem,
    order: PlaybackOrder,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let observed = select_system(running, "playback")?;
    let entry = observed
        .directory()
        .find_process(PLAYBACK, ANSWER_WITHIN)
        .context("no recording is played in this system (`armor play` plays one)")?;
    let command = Command::Playback { request: REQUEST, order };
    send_command(&entry, "armor playback", &command)?.print("", format)
}

fn show_state(running: &RunningSystem, format: OutputFormat) -> Result<CommandEnding> {
    let observed = select_system(running, "playback")?;
    let mut tap = observed
        .tap_within(&format!("{PLAYBACK}.state"), ANSWER_WITHIN)
        .context("no recording is played in this system (`armor play` plays one)")?;
    let Some(message) = tap.next(ANSWER_WITHIN)? else {
        bail!("the player has not answered within {} s", ANSWER_WITHIN.as_secs());
    };
    let state: PlaybackState = codec::decode(&message.payload)?;
    end_printing(if format == OutputFormat::Json {
        print_line(json!({
            "at_s": state.at, "from_s": state.from, "to_s": state.to, "speed": state.speed,
            "paused": state.paused, "over": state.over, "loops": state.loops,
            "waits_for": state.waits_for, "recording": state.recording,
            "components": state.components,
        }))
    } else {
        print_line(format_state(&state))
    })
}

/// The state in one line.
pub fn format_state(state: &PlaybackState) -> String {
    let speed = PlaybackSpeed::of_factor(state.speed).unwrap_or_default();
    let how = match (state.over, state.paused, state.waits_for.as_str()) {
        (true, ..) => "over".into(),
        (_, true, _) => "paused".into(),
        (_, _, "") => format!("speed {speed}"),
        (_, _, waits_for) => format!("speed {speed}, time waits: {waits_for}"),
    };
    format!("{:.1} of {:.1} s, {how}", state.at, state.to - state.from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_is_one_line() {
        let state =
            PlaybackState { from: 100.0, to: 160.0, at: 12.34, speed: 1.0, ..Default::default() };
        assert_eq!(format_state(&state), "12.3 of 60.0 s, speed 1");
        let paused = PlaybackState { paused: true, ..state.clone() };
        assert_eq!(format_state(&paused), "12.3 of 60.0 s, paused");
        let fast = PlaybackState { speed: 0.0, waits_for: "slam is busy".into(), ..state };
        assert_eq!(format_state(&fast), "12.3 of 60.0 s, speed max, time waits: slam is busy");
    }
}
