//! `<check>`: `armor check` proves it or prints a counterexample, whose firings `armor mission
//! replay` replays.

use std::path::Path;

use serde_json::Value;

use crate::fixture::{Folder, run_to_end};

const LATE: &str = r#"<armor version="1">
  <system>
    <component name="arm" kind="arm"/>
  </system>
  <mission goal="full" safe="stopped">
    <place name="filling" initial="true"/>
    <place name="full"/>
    <place name="stopped"/>
    <transition name="enough" from="filling" to="full" interval="[10s,20min]"/>
    <transition name="late" from="filling" to="stopped" timeout="5min"/>
    <check>CHECK</check>
  </mission>
</armor>
"#;

fn folder(name: &str, check: &str) -> Folder {
    let folder = Folder::new(name);
    folder.script("arm", "exit");
    folder.write("late.xml", &LATE.replace("CHECK", check));
    folder
}

#[test]
fn a_file_that_is_not_there_is_answered_with_the_one_that_was_meant() {
    let folder = folder("check-similar", "always reachable(full)");
    for named in ["late", "lat.xml", "late.xmll"] {
        let (code, _, err) = run_to_end(&mut folder.armor(&["check", named]));
        assert!(code == 1 && err.contains("did you mean late.xml?"), "{named}: {err}");
    }
    let (_, _, err) = run_to_end(&mut folder.armor(&["check", "robot.xml"]));
    assert!(err.contains("check the path and its permissions"), "{err}");
}

#[test]
fn a_satisfied_check_is_silent_and_the_mission_duration_is_reported() {
    let folder = folder("check-holds", "duration(full or stopped) &lt;= 5min");
    let (code, out, err) = run_to_end(&mut folder.armor(&["check", "late.xml", "--strict"]));
    let wanted = "late.xml: full comes after 10 s at the earliest, and the mission is over after \
                  5 min at the latest\n";
    assert_eq!(code, 0, "{out}{err}");
    assert!(out.ends_with(wanted), "{out}{err}");
    let (_, out, _) = run_to_end(&mut folder.armor(&["check", "late.xml", "--format", "json"]));
    let notes = out.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON Lines"));
    let takes = notes.into_iter().find(|note| note["code"] == "N0247").expect("a note");
    assert_eq!(takes["takes"]["longest_s"], 300.0, "{takes}");
    assert_eq!(takes["takes"]["longest_trace"], serde_json::json!(["late"]), "{takes}");
}

#[test]
fn the_example_missions_have_no_findings() {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let folder = Folder::new("check-examples");
    let log = folder.write("drive.log", "");
    let player = format!("player.file={}", log.display());
    let files =
        std::fs::read_dir(&missions).expect("a folder").map(|it| it.expect("a file").path());
    let files: Vec<_> = files.filter(|it| it.extension().is_some_and(|it| it == "xml")).collect();
    assert!(files.len() > 8, "{files:?}");
    for file in files {
        let name = file.to_str().expect("a path in UTF-8");
        let given = if name.ends_with("map-from-log.xml") { &["--set", &player][..] } else { &[] };
        let arguments = [&["check", "--strict", name], given].concat();
        let (code, out, err) = run_to_end(&mut folder.armor(&arguments));
        assert!(code == 0 && !err.contains("warning["), "{name}: {out}{err}");
    }
}

/// With one component forgotten, there are two edits after which nothing is wrong: to activate it
/// here too, or to take it out of the other place. The forgotten one has to be offered.
#[test]
fn a_component_that_was_forgotten_in_a_place_is_offered_there() {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let folder = Folder::new("check-forgotten");
    folder.write("office.svg", &read(&missions.join("worlds/office.svg")));
    let office = read(&missions.join("office.xml")).replace("worlds/office.svg", "office.svg");
    for (place, all, left) in
        [("return", "homing driver", "homing"), ("explore", "explorer driver", "explorer")]
    {
        let listed = |components| format!(r#"components="{components}""#);
        let at = office.find(&format!(r#"<place name="{place}""#)).expect("the place");
        let (before, after) = office.split_at(at);
        let changed = format!("{before}{}", after.replacen(&listed(all), &listed(left), 1));
        assert_ne!(changed, office, "{place} has other components than {all}");
        folder.write("forgotten.xml", &changed);
        let (_, out, err) = run_to_end(&mut folder.armor(&["check", "forgotten.xml"]));
        let remedy = format!("{} in {place}", listed(all));
        assert!(err.contains(&remedy) || out.contains(&remedy), "no {remedy}: {out}{err}");
    }
}

fn read(file: &Path) -> String {
    std::fs::read_to_string(file).expect("a file of the examples")
}

#[test]
fn a_violated_check_shows_firings_that_can_be_replayed() {
    let folder = folder("check-fails", "always reachable(full)");
    let (code, out, _) = run_to_end(&mut folder.armor(&["check", "late.xml", "--format", "json"]));
    assert_eq!(code, 1, "{out}");
    let found = out.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON Lines"));
    let found = found.into_iter().find(|finding| finding["code"] == "E0252").expect("an error");
    assert_eq!((&found["line"], &found["text"]), (&11.into(), &"always reachable(full)".into()));
    let trace: Vec<_> = found["trace"].as_array().expect("a trace").iter().collect();
    let fire: Vec<_> = trace.iter().map(|name| name.as_str().expect("a name")).collect();
    let (code, out, err) = run_to_end(&mut folder.armor(&[
        "mission",
        "replay",
        "late.xml",
        "--fire",
        &fire.join(" "),
    ]));
    assert_eq!(code, 0, "{err}");
    assert_eq!(out, "at the start         = filling\nlate                 = stopped\n");
    let replay = |fire: &str| {
        run_to_end(&mut folder.armor(&["mission", "replay", "late.xml", "--fire", fire]))
    };
    let (code, out, err) = replay("late, enough");
    assert!(out.ends_with("= stopped\n") && code == 1, "{out}");
    assert!(
        err.contains("firing 2 of 2: enough does not fire: the mission is over in stopped"),
        "{err}"
    );
    let (code, _, err) = replay("soon");
    assert_eq!(code, 1);
    assert!(err.contains("no transition called soon (it has: enough, late)"), "{err}");
}

#[test]
fn an_unreadable_check_is_refused_with_its_position() {
    for (check, code, column) in [
        ("always reachable(ful)", "E0203", 29),
        ("fires(lade)", "E0251", 18),
        ("full", "E0250", 12),
    ] {
        let folder = folder("check-refused", check);
        let (_, out, _) = run_to_end(&mut folder.armor(&["check", "late.xml", "--format", "json"]));
        let found = out.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        let found = found.into_iter().find(|finding| finding["code"] == code);
        let found = found.unwrap_or_else(|| panic!("{check}: {out}"));
        assert_eq!((&found["line"], &found["column"]), (&11.into(), &column.into()), "{found}");
    }
}

#[test]
fn a_goal_in_the_middle_is_one_finding_and_failing_checks_stay_errors() {
    let goal = |check: &str| {
        let folder = folder("goal-in-the-middle", check);
        let text = LATE.replace("CHECK", check).replace(
            "<transition name=\"late\"",
            "<transition name=\"emptied\" from=\"full\" to=\"stopped\" timeout=\"9s\"/>\n    \
             <transition name=\"late\"",
        );
        folder.write("late.xml", &text);
        let (code, out, err) = run_to_end(&mut folder.armor(&["check", "late.xml"]));
        let findings = out.matches("error[").count()
            + out.matches("warning[").count()
            + err.matches("error[").count()
            + err.matches("warning[").count();
        assert_eq!(findings, 1, "{out}{err}");
        (code, out + &err)
    };
    let (code, text) = goal("never stopped and filling");
    assert!(code == 0 && text.contains("W0217"), "{text}");
    assert!(text.contains("emptied never fires: it leads on from full, the goal"), "{text}");
    let (code, text) = goal("full leads to stopped");
    assert!(code == 1 && text.contains("E0252") && text.contains("emptied never fires"), "{text}");
}
