//! Recordings played in place of components, and to the tools.

use std::process::{Child, Stdio};

use armor_recording::{REPORTS, Recording};
use serde_json::Value;

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::resilience::system::{Draft, probe};

/// `north` counts at 50 Hz; after 60 ticks it reports what the mission waits for. `south` takes the
/// numbers, and is busy for half of the time.
fn draft() -> Draft {
    Draft::default()
        .probe("north", "rate='50Hz'", "event=60")
        .probe("south", "rate='25Hz'", "work=20ms")
        .link("north", "south.a", "latest")
        .mission(
            "<mission name='count' goal='end' safe='hold'>
               <place name='go' initial='true' components='north south'/>
               <place name='end'/> <place name='hold'/>
               <transition name='ticked' from='go' to='end' on='north.ticked'/>
               <transition name='late' from='go' to='hold' timeout='1min'/>
             </mission>",
        )
}

/// Records the system from its beginning to its end, as `all.mcap`. Returns its folder.
fn record(name: &str) -> Folder {
    let folder = Folder::new(name);
    let mut recorder = folder.armor(&["record", "--wait", "-o", "all.mcap"]);
    let mut recorder: Child =
        recorder.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let system = draft().run(folder);
    let crate::resilience::system::System { mut run, folder, .. } = system;
    assert_eq!(run.code(), Some(0), "{}", run.log());
    let ended = wait_for("the end of the recorder", || recorder.try_wait().expect("ours"));
    assert_eq!(ended.code(), Some(0));
    folder
}

fn play(folder: &Folder, arguments: &[&str]) -> (i32, String) {
    let arguments: Vec<_> = [&["play", "all.mcap"], arguments].concat();
    let (code, out, err) = run_to_end(&mut folder.armor(&arguments));
    (code, out + &err)
}

/// The numbers in the recording, of those that `south` was awake for, and how many there were when a
/// component reported to the mission. On a busy host more are published until that has acted on it.
fn recorded_numbers(folder: &Folder) -> (Vec<u64>, usize) {
    let mut recording = Recording::open(&folder.path().join("all.mcap")).expect("a recording");
    let messages = std::iter::from_fn(|| recording.next_message().expect("whole"));
    let (mut numbers, mut reported_s) = (Vec::new(), f64::INFINITY);
    for message in messages {
        let stamp_s = message.head.stamp_s;
        if message.data == REPORTS {
            reported_s = stamp_s;
        } else if message.data == "north.numbers" {
            let bytes = message.payload.expect("readable");
            let count = u64::from_le_bytes(*bytes.first_chunk().expect("a number"));
            numbers.push((stamp_s, count));
        }
    }
    let before = numbers.iter().filter(|(stamp_s, _)| *stamp_s <= reported_s).count();
    (numbers.into_iter().map(|(_, count)| count).collect(), before)
}

#[test]
fn a_component_and_its_mission_cannot_tell_a_recording_from_the_robot() {
    let folder = record("played");
    let (recorded, before_report) = recorded_numbers(&folder);
    assert!(recorded.len() >= 50, "{recorded:?}");
    let recording = Recording::open(&folder.path().join("all.mcap")).expect("a recording");
    let reports = recording.summary().outputs.iter().find(|output| output.data == REPORTS);
    assert_eq!(reports.map(|output| output.messages), Some(1));
    for speed in ["max", "5", "1"] {
        std::fs::remove_file(folder.path().join("south.trace")).expect("there was one");
        let out = format!("played-{speed}");
        let replaced = ["probes.xml", "--replace", "north", "--speed", speed, "--out", &out];
        let (code, printed) = play(&folder, &replaced);
        assert!(code == 0 && printed.contains("the mission reached its goal"), "{code} {printed}");
        let trace = crate::resilience::trace::Trace::read(&folder.path().join("south.trace"));
        let got: Vec<u64> = trace.got("a").iter().map(|got| got.count).collect();
        // The last message and the report come at the same time; the mission may end first.
        let played = &recorded[..got.len().min(recorded.len())];
        assert!(got.len() + 2 >= before_report, "{speed}: {} of {before_report}", got.len());
        assert_eq!(got, played, "{speed}: nothing is lost, and all is in order");
    }
}

#[test]
fn a_recording_is_played_to_the_tools_and_obeys_orders() {
    let folder = record("played-alone");
    let mut playing = folder.armor(&["play", "all.mcap", "--paused", "--stay", "--out", "alone"]);
    let mut playing: Child =
        playing.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let json = |arguments: &[&str]| -> Option<Value> {
        let arguments: Vec<_> = [arguments, &["--format", "json"]].concat();
        let (_, out, _) = run_to_end(&mut folder.armor(&arguments));
        serde_json::from_str(out.lines().next()?).ok()
    };
    let show = || json(&["playback", "show"]);
    let begin = wait_for("the player", show);
    assert_eq!((&begin["paused"], &begin["over"]), (&true.into(), &false.into()), "{begin}");
    assert!(begin["at_s"].as_f64().expect("seconds") < 0.5, "{begin}");
    let length_s = begin["to_s"].as_f64().expect("s") - begin["from_s"].as_f64().expect("s");
    let order = |arguments: &[&str]| {
        let answer = json(&[&["playback"], arguments].concat()).expect("an answer");
        assert_eq!(answer["accepted"], true, "{arguments:?}: {answer}");
    };
    order(&["seek", "600ms"]);
    let at_s = |state: Value| state["at_s"].as_f64().expect("seconds");
    let sought = wait_for("the moment", || show().map(at_s).filter(|at_s| *at_s > 0.5));
    assert!((sought - 0.6).abs() < 1e-6, "{sought}");
    order(&["step", "100ms"]);
    let stepped = wait_for("the step", || {
        show().filter(|state| state["paused"] == true).map(at_s).filter(|at_s| *at_s > 0.65)
    });
    assert!((stepped - 0.7).abs() < 1e-6, "{stepped}");
    order(&["speed", "max"]);
    order(&["resume"]);
    let over = wait_for("the end", || show().filter(|state| state["over"] == true));
    assert!((at_s(over) - length_s).abs() < 1e-6);
    // The last values are kept, and the mission is the one that was recorded.
    let mission = wait_for("the mission", || json(&["mission", "show"]));
    assert_eq!(mission["mission"], "count", "{mission}");
    order(&["pause"]);
    order(&["seek", "0s"]);
    assert_eq!(wait_for("the state", show)["over"], false, "it goes on after its end");
    run_to_end(&mut folder.armor(&["stop", "--all"]));
    let ended = wait_for("the end of the run", || playing.try_wait().expect("ours"));
    assert_eq!(ended.code(), Some(0));
}

#[test]
fn a_recording_begins_again_at_its_end_as_long_as_it_is_asked_to() {
    let folder = record("played-in-a-loop");
    let mut playing = folder.armor(&["play", "all.mcap", "--loop", "--out", "loop"]);
    let mut playing: Child =
        playing.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let json = |arguments: &[&str]| -> Option<Value> {
        let arguments: Vec<_> = [&["playback"], arguments, &["--format", "json"]].concat();
        let (_, out, _) = run_to_end(&mut folder.armor(&arguments));
        serde_json::from_str(out.lines().next()?).ok()
    };
    let begun = wait_for("the player", || json(&["show"]));
    assert_eq!((&begun["loops"], &begun["over"]), (&true.into(), &false.into()), "{begun}");
    let mut times = 0;
    let mut before = 0.0;
    wait_for("three beginnings", || {
        let state = json(&["show"])?;
        assert_eq!(state["over"], false, "{state}");
        let at_s = state["at_s"].as_f64()?;
        times += u32::from(at_s < std::mem::replace(&mut before, at_s));
        (times == 3).then_some(())
    });
    let order = |arguments: &[&str]| {
        let answer = json(arguments).expect("an answer");
        assert_eq!(answer["accepted"], true, "{arguments:?}: {answer}");
        let state = wait_for("the state", || json(&["show"]));
        (state["loops"].as_bool(), state["paused"].as_bool())
    };
    // Paused, so that it cannot end before it is asked to go on for ever again.
    assert_eq!(order(&["pause"]), (Some(true), Some(true)));
    assert_eq!(order(&["loop", "off"]), (Some(false), Some(true)));
    assert_eq!(order(&["loop", "on"]), (Some(true), Some(true)));
    assert_eq!(order(&["loop", "off"]), (Some(false), Some(true)));
    json(&["resume"]).expect("an answer");
    let ended = wait_for("the end of the run", || playing.try_wait().expect("ours"));
    // The mission of the recording is played, and is no mission of this run.
    assert_eq!(ended.code(), Some(0));
    let (code, _, err) = run_to_end(&mut folder.armor(&["playback", "loop", "maybe"]));
    assert!(code == 2 && err.contains("maybe"), "{err}");
}

#[test]
fn what_cannot_be_played_is_refused_before_anything_starts() {
    let folder = record("not-played");
    folder.write("not.mcap", "this is no recording");
    let cases: [(&[&str], &str); 9] = [
        (&["probes.xml"], "Give --replace NAME; it has north, south"),
        (&["probes.xml", "--replace", "nroth"], "did you mean north?"),
        (&["--from", "1h"], "nothing is in that part"),
        (&["--map", "nroth.numbers=a.b"], "did you mean north.numbers?"),
        (&["--map", "north=a"], "write RECORDED=PLAYED"),
        (&["--speed", "-1"], "--speed"),
        (&["--speed", "0"], "stand still"),
        (&["none.xml", "--replace", "north"], "none.xml"),
        (
            &["probes.xml", "--replace", "north", "--map", "north.numbers=other.numbers"],
            "no north.numbers",
        ),
    ];
    for (arguments, expected) in cases {
        let (code, printed) = play(&folder, arguments);
        assert!(code != 0 && printed.contains(expected), "{arguments:?}: {code} {printed}");
    }
    let (code, _, err) = run_to_end(&mut folder.armor(&["play", "not.mcap"]));
    assert!(code == 1 && err.contains("not.mcap cannot be read as a recording"), "{err}");
    let (code, _, err) = run_to_end(&mut folder.armor(&["playback", "pause"]));
    assert!(code == 1 && err.contains("no system"), "{err}");
}

/// A recording of one version of a component, used with the next one, whose message has one more field.
#[test]
fn a_recording_is_read_with_its_own_types_and_what_differs_is_named() {
    let folder = record("next-version");
    let components = folder.path().join("components");
    std::fs::remove_file(components.join("probe")).expect("the link to the probe");
    // A file of its own: what a program is asked for is kept by its file.
    std::fs::copy(probe(), components.join("next-probe")).expect("a copy");
    let run = |arguments: &[&str]| run_to_end(&mut folder.armor(arguments));

    let difference = "north.numbers: Numbered has other fields in probe: load: only probe has it";
    let (code, out, err) = run(&["bag", "info", "all.mcap", "--components", "components"]);
    assert!(code == 0 && out.contains(difference), "{out}{err}");
    let (_, out, _) = run(&["bag", "info", "all.mcap", "--file", "probes.xml", "--format", "json"]);
    let info: Value = serde_json::from_str(&out).expect("one object");
    assert_eq!(info["other_types"][0]["data"], "north.numbers", "{info}");
    assert_eq!(info["other_types"][0]["difference"][0], "load: only probe has it", "{info}");
    let (_, out, _) = run(&["bag", "info", "all.mcap"]);
    assert!(!out.contains("other fields"), "the types of this program are the same: {out}");

    // No component gets a message that it would read in another way.
    let (code, printed) = play(&folder, &["probes.xml", "--replace", "north", "--out", "one"]);
    for expected in ["load: only south has it", "replace south, too", "--map"] {
        assert!(code == 1 && printed.contains(expected), "{code} {printed}");
    }
    assert!(!folder.path().join("one").exists(), "nothing was started: {printed}");
    // Nothing takes the data if both are replaced, so all of it is played.
    let both = ["probes.xml", "--replace", "north", "--replace", "south", "--speed", "max"];
    let (code, printed) = play(&folder, &[&both[..], &["--out", "both"]].concat());
    assert!(code == 0 && printed.contains("the mission reached its goal"), "{code} {printed}");

    // Every tool reads the messages by the type in the recording.
    let (recorded, _) = recorded_numbers(&folder);
    let (code, _, err) =
        run(&["bag", "convert", "all.mcap", "numbers.csv", "--data", "north.numbers"]);
    assert_eq!(code, 0, "{err}");
    let table = std::fs::read_to_string(folder.path().join("numbers.csv")).expect("a table");
    let mut rows = table.lines();
    assert_eq!(rows.next(), Some("stamp_s,sequence,bulk,count"));
    let counts: Vec<u64> = rows.filter_map(|row| row.rsplit(',').next()?.parse().ok()).collect();
    assert_eq!(counts, recorded);
    let play = ["play", "all.mcap", "--components", "components", "--loop", "--out", "alone"];
    let mut playing = folder.armor(&play);
    let mut playing: Child =
        playing.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let shown = wait_for("a message", || {
        let (code, out, _) = run(&["echo", "north.numbers", "--once", "--format", "json"]);
        (code == 0).then(|| serde_json::from_str::<Value>(out.lines().next()?).ok()).flatten()
    });
    assert!(
        shown.to_string().contains("\"count\"") && !shown.to_string().contains("load"),
        "{shown}"
    );
    run(&["stop", "--all"]);
    wait_for("the end of the run", || playing.try_wait().expect("ours"));
    let mut printed = String::new();
    let mut errors = playing.stderr.take().expect("a pipe");
    std::io::Read::read_to_string(&mut errors, &mut printed).expect("text");
    assert!(printed.contains(difference), "{printed}");
}

/// The keys reach the player through a terminal, which `script` makes.
#[test]
fn keys_control_what_is_played_in_a_terminal() {
    let has_script = std::process::Command::new("script").arg("--version").output().is_ok();
    if !has_script {
        eprintln!("skipped: script (Debian: bsdutils) is not installed");
        return;
    }
    let folder = record("played-by-keys");
    let armor = env!("CARGO_BIN_EXE_armor");
    let play = format!("{armor} play all.mcap --paused --out keys");
    let mut command = folder.command_of(std::path::Path::new("script"));
    command.args(["--quiet", "--flush", "--return", "--command", &play, "/dev/null"]);
    let mut playing = command
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    let mut keys = playing.stdin.take().expect("a pipe");
    let state = || -> Option<Value> {
        let (_, out, _) = run_to_end(&mut folder.armor(&["playback", "show", "--format", "json"]));
        serde_json::from_str(out.lines().next()?).ok()
    };
    wait_for("the player", || state().filter(|state| state["paused"] == true));
    let press = |keys: &mut std::process::ChildStdin,
                 key: &str,
                 what: &str,
                 is_done: &dyn Fn(&Value) -> bool| {
        // A terminal that is not read yet echoes; the key is pressed again until it has an effect.
        wait_for(what, || {
            std::io::Write::write_all(keys, key.as_bytes()).expect("it is read");
            let start = std::time::Instant::now();
            while start.elapsed() < std::time::Duration::from_secs(2) {
                if state().is_some_and(|state| is_done(&state)) {
                    return Some(());
                }
            }
            None
        });
    };
    press(&mut keys, "+", "twice the speed", &|state| state["speed"].as_f64() >= Some(2.0));
    let is_at_the_end = |state: &Value| {
        let length_s =
            state["to_s"].as_f64().zip(state["from_s"].as_f64()).map(|(to, from)| to - from);
        state["at_s"].as_f64().zip(length_s).is_some_and(|(at_s, length_s)| at_s > length_s - 1e-3)
    };
    press(&mut keys, "\x1b[A", "the end", &is_at_the_end);
    // Running, a jump beyond the end stops at the last message: what is played does not end.
    press(&mut keys, "\x1b[B", "the beginning", &|state| state["at_s"] == 0.0);
    press(&mut keys, "----", "slow", &|state| state["speed"].as_f64() <= Some(0.1));
    press(&mut keys, " ", "time passes", &|state| state["paused"] == false);
    press(&mut keys, "\x1b[A", "the end again", &|state| {
        is_at_the_end(state) && state["paused"] == true && state["over"] == false
    });
    press(&mut keys, ".", "no step beyond it", &|state| {
        is_at_the_end(state) && state["paused"] == true && state["over"] == false
    });
    assert!(playing.try_wait().expect("ours").is_none(), "it is still there");
    press(&mut keys, "\x1b[B", "the beginning", &|state| state["at_s"] == 0.0);
    press(&mut keys, ".", "a step", &|state| {
        state["at_s"].as_f64() > Some(0.0) || state["paused"] == true
    });
    let ended = wait_for("the end", || {
        // It may have ended since the last look.
        let _ = std::io::Write::write_all(&mut keys, b"q");
        playing.try_wait().expect("ours")
    });
    assert!(ended.code().is_some(), "{ended}");
}
