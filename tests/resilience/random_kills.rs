//! Twenty rounds of killing random processes. After each round the system is complete again, and
//! two exclusive components are never active at the same time.

use std::collections::HashMap;
use std::time::Instant;

use rustix::process::Signal;

use super::system::{Draft, System};
use super::trace::{Trace, check_apart, check_nothing_lost};
use crate::dice::{Dice, seed};
use crate::fixture::{Folder, send_signal, wait_for};

const ROUNDS: usize = 20;
/// The launcher gives a process up at the fifth death within a minute.
const MOST_DEATHS: usize = 4;

/// `ping` and `pong` work in turn, forever; all other components are always active.
const MISSION: &str = "
<mission name='table-tennis' goal='over' safe='over'>
  <place name='left' initial='true' components='ping'/>
  <place name='right' components='pong'/>
  <place name='over'/>
  <exclusive components='ping pong'/>
  <transition name='over-the-net' from='left' to='right' on='ping.done'/>
  <transition name='and-back' from='right' to='left' on='pong.done'/>
  <transition name='tired' from='left' to='over' timeout='1h'/>
</mission>";

const VICTIMS: [&str; 8] =
    ["registry", "configd", "executive", "source", "relay", "sink", "ping", "pong"];

fn table_tennis() -> System {
    let draft = Draft::default()
        .probe("source", "rate='200Hz'", "burst=2")
        .probe("relay", "rate='100Hz'", "")
        .probe("sink", "", "")
        .probe("ping", "rate='100Hz'", "done=10 alone=table")
        .probe("pong", "rate='100Hz'", "done=10 alone=table")
        .link("source", "relay.a", "all")
        .link("relay", "sink.a", "all")
        .link("source", "sink.b", "all")
        .link("ping", "sink.c", "20")
        .link("pong", "sink.d", "20")
        .link("source", "ping.a", "latest")
        .mission(MISSION);
    draft.run(Folder::new("kill-rounds"))
}

/// Whether every component has worked since `since`, and every link of the sink connects current
/// process starts.
fn is_whole(system: &System, since: &Progress) -> bool {
    let now = Progress::of(system);
    now.ping > since.ping
        && now.pong > since.pong
        && now.flow.iter().zip(&since.flow).all(|(now, since)| now > since)
        && is_linked(system)
}

fn is_linked(system: &System) -> bool {
    let entries = system.entries();
    let instance = |name: &str| {
        let entry = entries.iter().find(|entry| entry.name == name)?;
        Some(format!("{:016x}", entry.instance))
    };
    let sink = system.trace("sink");
    let links = [("a", "relay"), ("b", "source"), ("c", "ping"), ("d", "pong")];
    links.into_iter().all(|(input, from)| {
        let last = sink.got(input).pop();
        last.is_some_and(|last| {
            Some(last.from) == instance(from)
                && entries.iter().any(|e| e.name == "sink" && e.pid.cast_signed() == last.pid)
        })
    })
}

/// Numbers of starts and of messages received so far.
struct Progress {
    ping: usize,
    pong: usize,
    flow: [usize; 5],
}

impl Progress {
    fn of(system: &System) -> Self {
        let [ping, pong] = ["ping", "pong"].map(|name| system.trace(name).count("started"));
        let sink = system.trace("sink");
        let [a, b, c, d] = ["a", "b", "c", "d"].map(|input| sink.got(input).len());
        Self { ping, pong, flow: [a, b, c, d, system.trace("relay").got("a").len()] }
    }
}

/// Chooses a process that has not died [`MOST_DEATHS`] times, and counts its death.
fn choose(dice: &mut Dice, deaths: &mut HashMap<&str, usize>) -> &'static str {
    let may: Vec<_> =
        VICTIMS.into_iter().filter(|name| deaths.get(name) < Some(&MOST_DEATHS)).collect();
    let victim = may[dice.throw(may.len())];
    *deaths.entry(victim).or_default() += 1;
    victim
}

// Slow (about half a minute): twenty rounds, each until everything is connected again.
#[test]
fn twenty_rounds_of_killing_at_random() {
    let seed = seed(u64::from(std::process::id()));
    let mut dice = Dice::of(seed);
    let mut deaths: HashMap<&str, usize> = HashMap::new();
    let mut system = table_tennis();
    let begin = Progress { ping: 0, pong: 0, flow: [0; 5] };
    wait_for("the start", || is_whole(&system, &begin).then_some(()));
    for round in 1..=ROUNDS {
        let mut victims = vec![choose(&mut dice, &mut deaths)];
        // In one round of four, two processes are killed together. If both choices are the same,
        // one kill is enough.
        if dice.throw(4) == 0 {
            victims.push(choose(&mut dice, &mut deaths));
            victims.dedup();
        }
        let (since, start) = (Progress::of(&system), Instant::now());
        let dead: Vec<_> = victims.iter().map(|name| (*name, system.pid(name))).collect();
        dead.iter().for_each(|(_, pid)| send_signal(*pid, Signal::KILL));
        for (name, dead) in dead {
            wait_for(name, || Some(system.pid(name)).filter(|pid| *pid != dead));
        }
        let what = format!("round {round} of seed {seed}, {victims:?} killed: the whole");
        wait_for(&what, || is_whole(&system, &since).then_some(()));
        println!("round {round}: {victims:?} killed, whole after {:.2?}", start.elapsed());
    }
    system.run.signal(Signal::INT);
    assert_eq!(system.run.code(), Some(130), "{}", system.run.log());
    check(&system);
}

fn check(system: &System) {
    let [ping, pong] = ["ping", "pong"].map(|name| system.trace(name));
    for trace in [&ping, &pong] {
        assert_eq!(trace.count("clash"), 0, "active at once: {trace:?}");
    }
    check_apart(&ping.activations(), &pong.activations());
    check_nothing_lost("relay.a", &system.trace("relay").got("a"));
    let sink = system.trace("sink");
    check_nothing_lost("sink.a", &sink.got("a"));
    check_nothing_lost("sink.b", &sink.got("b"));
    for name in ["source", "relay", "sink"] {
        let Trace(notes) = system.trace(name);
        let last = notes.last().map(|note| note.words.join(" "));
        assert_eq!(last.as_deref(), Some("stopping"), "`{name}`");
    }
}
