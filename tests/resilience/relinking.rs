//! The time until links are restored after a process has died, from the moment it is ready again.

use rustix::process::Signal;
use serde_json::Value;

use super::system::Draft;
use super::trace::Trace;
use crate::fixture::{Dialogue, Folder, run_to_end, send_signal, wait_for};

const SINKS: [&str; 8] = ["s0", "s1", "s2", "s3", "s4", "s5", "s6", "s7"];
/// Deaths of each process; the launcher gives a process up at the fifth within a minute.
const DEATHS: usize = 4;

/// Summarises times in seconds: their count, median and maximum.
fn summary(mut times_s: Vec<f64>) -> String {
    times_s.sort_by(f64::total_cmp);
    let (count, half) = (times_s.len(), times_s[times_s.len() / 2]);
    format!(
        "{count} links back: p50 {:.0} ms, longest {:.0} ms",
        half * 1e3,
        times_s[count - 1] * 1e3
    )
}

/// Returns the time at which the last process of a trace became active.
fn last_start_ns(trace: &Trace) -> Option<u64> {
    Some(trace.all("started").last()?.at_ns)
}

#[test]
fn an_observer_of_an_output_follows_the_next_process() {
    let system = Draft::default().probe("source", "rate='100Hz'", "").run(Folder::new("echo"));
    let registry = system.registry.to_string();
    let mut echo = system.folder.armor(&["echo", "source.numbers", "--format", "json"]);
    let echo = Dialogue::start(echo.args(["--registry", &registry]));
    let next = || {
        let line: Value = serde_json::from_str(&echo.read_line()).expect("JSON");
        line["value"]["bulk"].clone()
    };
    let before = next();
    // Only the next process reads the new value, so its data differs from this one's.
    let mut set = system.folder.armor(&["param", "set", "source.bulk", "3"]);
    let (code, _, err) = run_to_end(set.args(["--registry", &registry]));
    assert_eq!(code, 0, "{err}");
    system.replace("source");
    wait_for("data of the next process", || (next() != before).then_some(()));
}

#[test]
fn links_come_back_with_the_process_at_either_end() {
    let mut draft = Draft::default().probe("source", "rate='200Hz'", "");
    for sink in SINKS {
        draft = draft.probe(sink, "", "").link("source", &format!("{sink}.a"), "latest");
    }
    let system = draft.run(Folder::new("relinking"));
    for sink in SINKS {
        system.traced(sink, "data", |trace| (!trace.got("a").is_empty()).then_some(()));
    }
    let (mut subscribers_s, mut publishers_s) = (Vec::new(), Vec::new());
    for _ in 0..DEATHS {
        let dead = SINKS.map(|sink| system.pid(sink));
        dead.iter().for_each(|pid| send_signal(*pid, Signal::KILL));
        for (sink, dead) in SINKS.into_iter().zip(dead) {
            subscribers_s.push(system.traced(sink, "data of its successor", |trace| {
                let got = trace.got("a").into_iter().rev().take_while(|got| got.pid != dead).last();
                Some((got?.at_ns - last_start_ns(trace)?) as f64 / 1e9)
            }));
        }
        let before = system.replace("source");
        let from = wait_for("its instance", || {
            let entry = system.entry("source");
            (entry.pid.cast_signed() == before).then(|| format!("{:016x}", entry.instance))
        });
        for sink in SINKS {
            publishers_s.push(system.traced(sink, "data of the new source", |trace| {
                let got = trace.got("a").into_iter().find(|got| got.from == from)?;
                let start_ns = last_start_ns(&system.trace("source"))?;
                Some(got.at_ns.saturating_sub(start_ns) as f64 / 1e9)
            }));
        }
    }
    println!("after the death of a subscriber, {}", summary(subscribers_s));
    println!("after the death of the publisher, {}", summary(publishers_s));
}
