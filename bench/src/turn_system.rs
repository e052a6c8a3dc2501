//! A system of two components that take turns: its file, the component, and the roles that serve
//! the file and play the mission, each a process of its own as on any robot.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result, anyhow};
use armor_plan::Plan;
use armor_sdk::prelude::*;
use armor_socket::Registration;
use armor_wire::registry::ComponentEntry;

use crate::readings::monotonic_ns;

/// Ticks of a turn before the report.
const TICKS: u32 = 3;

/// The file: two components that take turns, each fed by the other.
pub fn write_turn_file() -> String {
    let turn = |name: &str| format!("<component name=\"{name}\" kind=\"turn\" rate=\"200Hz\"/>");
    let place = |name: &str, rest: &str| {
        format!("<place name=\"{name}-turn\" components=\"{name}\" {rest}/>")
    };
    let pass = |from: &str, to: &str, on: &str| {
        format!(
            "<transition name=\"{from}-{on}\" from=\"{from}-turn\" to=\"{to}-turn\" on=\"{from}.{on}\"/>"
        )
    };
    [
        "<armor version=\"1\"><system name=\"turns\">".to_owned(),
        turn("one"),
        turn("two"),
        "<link from=\"one.beat\" to=\"two.other\"/><link from=\"two.beat\" to=\"one.other\"/>"
            .into(),
        "</system><mission name=\"turns\" goal=\"over\" safe=\"hold\">".into(),
        place("one", "initial=\"true\""),
        place("two", ""),
        "<place name=\"over\"/><place name=\"hold\"/><exclusive components=\"one two\"/>".into(),
        pass("one", "two", "done"),
        pass("one", "two", "passed"),
        pass("two", "one", "done"),
        pass("two", "one", "passed"),
        "<transition name=\"end\" from=\"one-turn\" to=\"over\" operator=\"true\"/>".into(),
        "<transition name=\"late\" from=\"one-turn\" to=\"hold\" timeout=\"1h\"/>".into(),
        "</mission></armor>".into(),
    ]
    .join("\n")
}

/// Reports a few ticks after its activation: `done` and an event in turn.
pub struct TurnComponent {
    armor: Armor,
    turn: u64,
    ticks: u32,
    started_ns: u64,
    reported_ns: u64,
}

impl Component for TurnComponent {
    const KIND: &'static str = "turn";
    const SUMMARY: &'static str = "Takes turns and prints the times.";
    const EVENTS: &'static [DeclaredEvent] = &[DeclaredEvent::new("passed")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Flag>("beat")?;
        armor.subscribe::<Flag>("other")?;
        Ok(Self { armor, turn: 0, ticks: 0, started_ns: 0, reported_ns: 0 })
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => {
                (self.started_ns, self.ticks) = (monotonic_ns(), 0);
                self.turn += 1;
            }
            Call::Stopping if self.turn > 0 => {
                let (started, reported) = (self.started_ns, self.reported_ns);
                let (stopped, event) = (monotonic_ns(), self.turn % 2);
                println!(
                    "turn started={started} reported={reported} stopped={stopped} event={event}"
                );
            }
            Call::Stopping | Call::Data => {}
            Call::Tick => {
                self.armor.send_data("beat", &Flag { data: true })?;
                self.ticks += 1;
                if self.ticks == TICKS {
                    self.reported_ns = monotonic_ns();
                    return Ok(match self.turn % 2 {
                        0 => Outcome::Done,
                        _ => Outcome::event("passed", 1.0),
                    });
                }
            }
        }
        Ok(Outcome::CarryOn)
    }
}

/// The role that plays the mission of `file` until it is killed.
pub fn play_mission(registry: String, file: &Path, journal: PathBuf) -> Result<()> {
    let reading = armor_robotfile::check(armor_robotfile::load(file), &[], None);
    let configuration = reading.configuration.context("the file is not valid")?;
    let plan = Plan::of(&configuration).map_err(|_| anyhow!("the mission is not played"))?;
    let cut_at = armor_executive::journal::CUT_AT;
    let options = armor_executive::ExecutiveOptions {
        registry,
        journal,
        is_laid_out: false,
        newer: None,
        given_up: armor_executive::GivenUpComponents::default(),
        cut_at,
        clock: None,
        trust_clock: false,
    };
    let plan = plan.context("no mission")?;
    armor_executive::run(|| Ok(plan), &options, &AtomicBool::new(false))?;
    Ok(())
}

/// The role that serves `file` to the components until it is killed.
pub fn serve_file(registry: SocketAddr, file: &Path) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let mut registrations = Vec::new();
    let register = |notice| {
        if let armor_configd::Notice::Ready { address } = notice {
            registrations.push(Registration::keep_registered(registry, make_entry(address)));
        }
    };
    let serving = armor_configd::serve(armor_configd::ConfigdOptions::new(file), register);
    runtime.block_on(serving).map(|never| match never {}).map_err(Into::into)
}

fn make_entry(address: SocketAddr) -> ComponentEntry {
    ComponentEntry {
        name: "configd".into(),
        kind: "configd".into(),
        instance: monotonic_ns(),
        pid: std::process::id(),
        host: armor_socket::host_name(),
        endpoint: address.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mission_is_valid_and_played() {
        let reading =
            armor_robotfile::read(Path::new("a.xml"), &mut |_| Ok(write_turn_file().into_bytes()));
        let reading = armor_robotfile::check(reading, &[], None);
        let text = reading.findings.render(armor_robotfile::Colours::No);
        assert!(reading.is_valid(), "{text}");
        let plan = Plan::of(&reading.configuration.expect("a configuration"));
        assert!(matches!(plan, Ok(Some(_))), "{text}");
    }
}
