//! Two operators of one running mission, with real processes; the executive is killed meanwhile.

use serde_json::Value;

use crate::fixture::{Dialogue, Folder, run_to_end, wait_for};
use crate::resilience::system::{Draft, System};

/// `north` and `south` are never active together. An operator decides between them; `leave` ends
/// the mission if the operator's link is lost.
const WATCH: &str = "
<mission name='watch' goal='over' safe='hold'>
  <place name='up' initial='true' components='north'/>
  <place name='down' components='south'/>
  <place name='over'/>
  <place name='hold'/>
  <exclusive components='north south'/>
  <transition name='descend' from='up' to='down' operator='true'/>
  <transition name='climb' from='down' to='up' autonomy='confirm' answer-within='10min'/>
  <transition name='leave' from='up' to='over' operator='true' after='1s' lost-link='fire'/>
</mission>";

fn system(name: &str) -> System {
    let draft = Draft::default()
        .probe("north", "rate='50Hz'", "alone=alone")
        .probe("south", "rate='50Hz'", "alone=alone")
        .probe("watcher", "", "")
        .link("north", "watcher.a", "latest")
        .link("south", "watcher.b", "latest")
        .mission(WATCH);
    let system = draft.run(Folder::new(name));
    system.traced("north", "a tick", |trace| (trace.count("tick") > 5).then_some(()));
    system
}

/// Sends an order; returns the exit code, stdout and stderr.
fn order(system: &System, author: &str, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["mission"]);
    command.args(arguments).args(["--as", author, "--registry", &registry, "--within", "60s"]);
    run_to_end(&mut command)
}

fn accepted(system: &System, author: &str, arguments: &[&str]) {
    let (code, out, err) = order(system, author, arguments);
    assert_eq!(code, 0, "{arguments:?} {out} {err}\n{}", system.run.log());
}

fn refused(system: &System, author: &str, arguments: &[&str], why: &str) {
    let (code, out, err) = order(system, author, arguments);
    assert_eq!((code, out.as_str()), (1, ""), "{arguments:?} {err}");
    assert!(err.contains(why), "{err}");
}

/// Waits until the marking satisfies `is_so`; returns it.
fn shows(system: &System, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    wait_for(&format!("{what}\n{}", system.run.log()), || {
        system.read_json(&["mission", "show"]).pop().filter(|marking| is_so(marking))
    })
}

fn is_marked(marking: &Value, place: &str) -> bool {
    let is_it = |marked: &Value| marked["place"] == place && marked["active"] == true;
    marking["places"].as_array().is_some_and(|places| places.iter().any(is_it))
}

/// Starts a client that holds the command.
fn holder(system: &System, author: &str) -> Dialogue {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["mission", "operate", "--within", "60s"]);
    let holder = Dialogue::start(command.args(["--as", author, "--registry", &registry]));
    assert_eq!(holder.read_line(), "the command is yours");
    holder
}

/// Sends an order as the holder of the command, and checks the answer.
fn orders(holder: &mut Dialogue, order: &str, answer: &str) {
    holder.write_line(order);
    assert_eq!(holder.read_line(), answer);
}

#[test]
fn two_operators_command_one_mission_through_the_death_of_its_executive() {
    let mut system = system("operators");
    refused(&system, "ruth", &["fire", "climb"], "`climb` is not enabled: `down` holds 0 of the 1");
    accepted(&system, "ruth", &["fire", "descend"]);
    shows(&system, "the question", |marking| {
        is_marked(marking, "down") && marking["confirmations"][0]["transition"] == "climb"
    });

    // While ruth holds the command, sam may pause the mission and do nothing else.
    let mut ruth = holder(&system, "ruth");
    refused(&system, "sam", &["confirm", "climb"], "ruth commands this mission");
    accepted(&system, "sam", &["pause"]);
    shows(&system, "rest", |marking| marking["pause"]["at_rest"] == true);
    let before = system.trace("south").0.len();
    refused(&system, "sam", &["resume"], "ruth commands this mission");

    // The executive is killed during the pause, with a question open and a holder connected.
    let dead = system.kill("executive");
    wait_for("another executive", || Some(system.pid("executive")).filter(|pid| *pid != dead));
    let marking = shows(&system, "the holder's return", |marking| {
        marking["holder"]["author"] == "ruth" && marking["holder"]["connected"] == true
    });
    assert_eq!((&marking["stage"], &marking["pause"]["by"]), (&"paused".into(), &"sam".into()));
    assert_eq!(marking["confirmations"][0]["put_off"], true, "its time stands still");
    let trace = system.trace("south");
    assert_eq!(trace.0.len(), before, "it stood still all the time: {:?}", trace.0.last());
    assert_eq!(trace.0[before - 1].words, ["stopping"]);

    orders(&mut ruth, "resume", "the mission continues");
    system.traced("south", "another tick", |trace| {
        trace.0.last().filter(|note| trace.0.len() > before && note.words == ["tick"]).map(|_| ())
    });
    orders(&mut ruth, "confirm climb", "`climb` fires");
    shows(&system, "the place above", |marking| is_marked(marking, "up"));

    // Returning the command is not a lost link; killing the holder's process is one.
    ruth.close_input();
    assert_eq!(ruth.read_line(), "the command is given back");
    ruth.wait_for_end();
    accepted(&system, "sam", &["fire", "descend"]);
    shows(&system, "the question", |marking| marking["confirmations"][0]["put_off"] == false);
    let tim = holder(&system, "tim");
    accepted(&system, "sam", &["confirm", "climb", "--take"]);
    tim.kill();
    shows(&system, "the place above", |marking| is_marked(marking, "up"));
    holder(&system, "tim").kill();
    assert_eq!(system.run.code(), Some(0), "left by itself:\n{}", system.run.log());

    for name in ["north", "south"] {
        assert_eq!(system.trace(name).count("clash"), 0, "{name}");
    }
    played_again(&system);
}

/// The journal records everything, and its replay ends in the mission's final marking.
fn played_again(system: &System) {
    let journal = system.run.out().join("executive.journal");
    let journal = journal.to_str().expect("a path in UTF-8");
    let arguments = ["mission", "replay", journal, "probes.xml", "--format", "json"];
    let (code, out, err) = run_to_end(&mut system.folder.armor(&arguments));
    assert_eq!(code, 0, "{err}");
    let steps: Vec<Value> =
        out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let last = steps.last().expect("it has steps");
    assert_eq!(
        (&last["marking"]["over"], &last["stage"]),
        (&1.into(), &"ended at its goal".into())
    );
    let given: Vec<_> = steps
        .iter()
        .map(|step| &step["record"])
        .filter(|record| record["entry"] == "ordered" && record["accepted"] == true)
        .map(|record| format!("{} {}", record["by"]["author"], record["order"]))
        .collect();
    assert_eq!(
        given
            .iter()
            .map(|it| it.replace('"', ""))
            .filter(|it| !it.ends_with(" lease") && !it.ends_with(" rejoin"))
            .collect::<Vec<_>>(),
        [
            "ruth {fire:descend}",
            "sam pause",
            "ruth resume",
            "ruth {confirm:climb}",
            "ruth release",
            "sam {fire:descend}",
            "sam {confirm:climb}",
        ]
    );
    let lost = steps.iter().filter(|step| step["record"]["entry"] == "link-lost").count();
    assert_eq!(lost, 1, "the second time tim was gone; the first time sam had taken over");
    let other = system.folder.write("other.xml", &WATCH.replace("after='1s'", "after='2s'"));
    let text = std::fs::read_to_string(&other).expect("it is there");
    let whole = std::fs::read_to_string(system.folder.path().join("probes.xml")).expect("the file");
    std::fs::write(&other, whole.replace(WATCH, &text)).expect("writable");
    let (code, _, err) =
        run_to_end(&mut system.folder.armor(&["mission", "replay", journal, "other.xml"]));
    assert!(code == 1 && err.contains("is not a journal of other.xml as it is now"), "{err}");
}
