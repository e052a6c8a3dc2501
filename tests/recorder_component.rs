//! The recorder as a component of a mission: activated, frozen, killed, on a disk that is full; and
//! what its files have besides data.

use std::path::{Path, PathBuf};

use armor_recording::trail::{JOURNAL, LOGS, PARAMETERS, RecordedDecision, RecordedParameter};
use armor_recording::{RecordedMessage, Recording};
use armor_sdk::messages::{ConfigurationState, Log};
use armor_wire::codec;

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::resilience::system::{Draft, System};

/// The recorder is active in `work` alone; an operator moves the token.
const MISSION: &str = "
<mission name='shifts' goal='over' safe='hold'>
  <place name='idle' initial='true'/>
  <place name='work' components='recorder'/>
  <place name='full'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='begin' from='idle' to='work' operator='true'/>
  <transition name='pause' from='work' to='idle' operator='true'/>
  <transition name='no-room' from='work' to='full' on='recorder.disk_full'/>
  <transition name='end' from='full' to='over' operator='true'/>
</mission>";

fn recorded_system(name: &str, parameters: &str) -> System {
    let recorder = format!(
        "<component name='recorder' kind='recorder' rate='20Hz'>
           <parameter name='output' value='shift.mcap'/>{parameters}
         </component>"
    );
    let draft =
        Draft::default().probe("north", "rate='50Hz'", "").component(&recorder).mission(MISSION);
    draft.run(Folder::new(name))
}

fn fire(system: &System, transition: &str) {
    wait_for(&format!("{transition} to fire"), || {
        let (code, _, _) = order(system, &["mission", "fire", transition]);
        (code == 0).then_some(())
    });
}

fn order(system: &System, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    run_to_end(system.folder.armor(arguments).args(["--registry", &registry]))
}

fn file(system: &System, name: &str) -> PathBuf {
    system.run.out().join(name)
}

/// Waits until the file has so many messages of the probe.
fn await_messages(path: &Path, least: u64) {
    wait_for(&format!("{least} messages in {}", path.display()), || {
        let recording = Recording::open(path).ok()?;
        let mut outputs = recording.summary().outputs.iter();
        outputs.any(|it| it.data == "north.numbers" && it.messages >= least).then_some(())
    });
}

fn await_complete(path: &Path) -> Vec<RecordedMessage> {
    wait_for(&format!("{} to be complete", path.display()), || {
        Recording::open(path).ok().filter(|it| it.summary().is_complete).map(drop)
    });
    read(path)
}

fn read(path: &Path) -> Vec<RecordedMessage> {
    let mut recording = Recording::open(path).expect("a recording");
    std::iter::from_fn(|| recording.next_message().expect("whole")).collect()
}

fn decode_all<T: armor_wire::message::Message>(messages: &[RecordedMessage], data: &str) -> Vec<T> {
    let of_it = messages.iter().filter(|message| message.data == data);
    of_it
        .map(|message| codec::decode(message.payload.as_ref().expect("whole")).expect("T"))
        .collect()
}

#[test]
fn each_activation_of_a_recorder_has_a_complete_file_of_its_own() {
    let system = recorded_system("recorder-shifts", "");
    fire(&system, "begin");
    await_messages(&file(&system, "shift.mcap"), 30);
    fire(&system, "pause");
    let first = await_complete(&file(&system, "shift.mcap"));
    let numbers: Vec<_> = first.iter().filter(|it| it.data == "north.numbers").collect();
    for pair in numbers.windows(2) {
        assert_eq!(pair[1].head.sequence, pair[0].head.sequence + 1, "without a gap");
    }
    fire(&system, "begin");
    await_messages(&file(&system, "shift-2.mcap"), 5);
    // After a kill, what was flushed stays, and the next process records into another file.
    system.kill("recorder");
    await_messages(&file(&system, "shift-3.mcap"), 5);
    let second = read(&file(&system, "shift-2.mcap"));
    assert!(
        !Recording::open(&file(&system, "shift-2.mcap")).expect("it opens").summary().is_complete
    );
    let last = |messages: &[RecordedMessage]| {
        let numbers = messages.iter().filter(|it| it.data == "north.numbers");
        numbers.map(|it| it.head.sequence).max().expect("some")
    };
    assert!(last(&second) > last(&first), "what is published while it is frozen is missing");
    fire(&system, "pause");
    let third = await_complete(&file(&system, "shift-3.mcap"));
    assert!(last(&third) > last(&second));
}

#[test]
fn a_full_disk_is_an_event_and_leaves_a_complete_file() {
    let system = recorded_system("recorder-full", "<parameter name='keep_free' value='1'/>");
    fire(&system, "begin");
    let path = file(&system, "shift.mcap");
    await_messages(&path, 10);
    // More than any disk has: as if another program had filled it.
    let (code, _, err) = order(&system, &["param", "set", "recorder.keep_free", "900000000000"]);
    assert_eq!(code, 0, "{err}");
    system.run.wait_for_log("no-room: work -> full", 1);
    await_complete(&path);
    fire(&system, "end");
}

#[test]
fn a_recording_has_parameters_versions_journal_and_logs_of_its_run() {
    let system = recorded_system("recorder-trail", "<parameter name='keep_free' value='1'/>");
    fire(&system, "begin");
    let path = file(&system, "shift.mcap");
    await_messages(&path, 10);
    let (code, _, err) = order(&system, &["param", "set", "recorder.keep_free", "2"]);
    assert_eq!(code, 0, "{err}");
    wait_for("the version in the file", || {
        let recording = Recording::open(&path).ok()?;
        recording.summary().files.iter().any(|it| it.name == "versions/2/probes.xml").then_some(())
    });
    fire(&system, "pause");
    let messages = await_complete(&path);

    let parameters: Vec<RecordedParameter> = decode_all(&messages, PARAMETERS);
    let of_it = |it: &&RecordedParameter| it.component == "recorder" && it.parameter == "keep_free";
    let [first, change] = parameters.iter().filter(of_it).collect::<Vec<_>>()[..] else {
        panic!("{parameters:?}")
    };
    assert_eq!((first.value.as_str(), first.version), ("1", 1));
    assert!(first.origin.contains("probes.xml:"), "{first:?}");
    assert_eq!((change.before.as_str(), change.value.as_str(), change.version), ("1", "2", 2));
    assert!(change.set_by.starts_with("param"), "{change:?}");
    assert!(change.stamp > first.stamp);
    let states: Vec<ConfigurationState> = decode_all(&messages, "configuration.state");
    assert!(states.iter().any(|state| state.set_by == change.set_by), "{states:?}");

    let mut recording = Recording::open(&path).expect("a recording");
    let version =
        recording.read_file("versions/2/probes.xml").expect("whole").expect("it is there");
    assert!(String::from_utf8_lossy(&version).contains("value='2'"));
    let files = &recording.summary().files;
    assert!(files[0].stamp_s.is_none() && files.iter().any(|it| it.stamp_s.is_some()), "{files:?}");

    let decisions: Vec<RecordedDecision> = decode_all(&messages, JOURNAL);
    let journal = std::fs::read_to_string(file(&system, "executive.journal")).expect("a journal");
    let recorded: Vec<_> = decisions.iter().map(|decision| decision.line.as_str()).collect();
    assert!(recorded.len() > 5 && journal.lines().zip(&recorded).all(|(line, it)| line == *it));
    let logs: Vec<Log> = decode_all(&messages, LOGS);
    let begin = logs.iter().find(|log| log.msg.contains("begin: idle -> work"));
    assert_eq!(
        begin.map(|log| (log.level, log.name.as_str())),
        Some((20, "executive")),
        "{logs:?}"
    );

    let path = path.display().to_string();
    for (arguments, expected) in [
        (&["mission", "journal", &path][..], "recorder is activated"),
        (&["logs", &path, "--component", "executive"], "begin: idle -> work"),
        (&["bag", "info", &path], "versions/2/probes.xml"),
    ] {
        let (code, out, err) = run_to_end(&mut system.folder.armor(arguments));
        assert!(code == 0 && out.contains(expected), "{arguments:?}: {out}{err}");
    }
    let unknown = ["logs", &path, "--component", "excutive"];
    let (code, _, err) = run_to_end(&mut system.folder.armor(&unknown));
    assert!(code == 1 && err.contains("did you mean executive?"), "{err}");
}
