//! How long links take to come back after a process has died, from when it is ready again.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use rustix::process::Signal;

use super::system::Draft;
use super::trace::Trace;
use crate::fixture::{Folder, send, wait_for};

const SINKS: [&str; 8] = ["s0", "s1", "s2", "s3", "s4", "s5", "s6", "s7"];
/// One more within a minute, and they are given up.
const DEATHS: usize = 4;

/// Sorted times in seconds, as one line.
fn summary(mut times_s: Vec<f64>) -> String {
    times_s.sort_by(f64::total_cmp);
    let (count, half) = (times_s.len(), times_s[times_s.len() / 2]);
    format!(
        "{count} links back: p50 {:.0} ms, longest {:.0} ms",
        half * 1e3,
        times_s[count - 1] * 1e3
    )
}

/// When the last process of a trace started to work.
fn last_start_ns(trace: &Trace) -> Option<u64> {
    Some(trace.all("started").last()?.at_ns)
}

#[test]
fn who_looks_at_data_sees_those_of_the_next_process_too() {
    let system = Draft::default().probe("source", "rate='100Hz'", "").run(Folder::new("echo"));
    let mut echo = system.folder.armor(&["echo", "source.numbers", "--format", "json"]);
    let registry = system.registry.to_string();
    let mut echo = echo
        .args(["--registry", &registry])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("armor starts");
    let lines = BufReader::new(echo.stdout.take().expect("it prints")).lines();
    let mut counts = lines.map(|line| {
        let line: serde_json::Value = serde_json::from_str(&line.expect("text")).expect("JSON");
        line["value"]["count"].as_u64().expect("a number")
    });
    let before = counts.by_ref().find(|count| *count > 20).expect("data");
    system.replace("source");
    let after = counts.find(|count| *count < before).expect("data of the next process");
    assert!(after < before);
    // It would end with the system, unless another test's takes over the registry's port.
    echo.kill().expect("it runs");
    echo.wait().expect("it was killed");
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
        dead.iter().for_each(|pid| send(*pid, Signal::KILL));
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
