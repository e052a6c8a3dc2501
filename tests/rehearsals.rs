//! `armor mission rehearse`: real components in the simulator, and what is printed of their times.

use std::os::unix::fs::PermissionsExt;
use std::process::Command;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::missions::root;

/// Rehearses a file and returns the exit code, the records on stdout, and stderr.
fn rehearse(folder: &Folder, arguments: &[&str]) -> (i32, Vec<Value>, String) {
    let all = [&["mission", "rehearse", "--format", "json"], arguments].concat();
    let (code, out, err) = run_to_end(&mut folder.armor(&all));
    let lines = out.lines().map(|line| serde_json::from_str(line).expect("a line of JSON"));
    (code, lines.collect(), err)
}

fn records<'a>(records: &'a [Value], key: &'a str) -> impl Iterator<Item = &'a Value> {
    records.iter().filter(move |record| record.get(key).is_some())
}

/// `missions/drawn.xml` in the folder, with some of its text replaced.
fn write_drawn(folder: &Folder, replaced: &[(&str, &str)]) -> String {
    let mut text = std::fs::read_to_string(root().join("missions/drawn.xml")).expect("the file");
    let office = root().join("missions/worlds/office.svg").display().to_string();
    for (old, new) in [("worlds/office.svg", office.as_str())].iter().chain(replaced) {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    folder.write("drawn.xml", &text).display().to_string()
}

// Slow (about ten seconds): the whole mission at five times real time.
#[test]
fn a_drawn_mission_is_rehearsed_within_its_bounds() {
    let folder = Folder::new("rehearsal");
    let file = root().join("missions/drawn.xml");
    let before = std::fs::read(&file).expect("the file");
    let (code, printed, err) = rehearse(&folder, &[&file.display().to_string(), "--speed", "5"]);
    assert_eq!(code, 0, "{printed:#?}\n{err}");
    let steps: Vec<_> = records(&printed, "step").collect();
    assert_eq!(steps.len(), 6, "{printed:#?}");
    for step in &steps {
        let time = |key: &str| step[key].as_f64().unwrap_or_else(|| panic!("{key} in {step}"));
        assert!(time("driven_s") > time("earliest_s") && step["bounds"] == "kept", "{step}");
    }
    let stay = steps.iter().find(|step| step["step"] == "s1").expect("the stay");
    assert!(stay["length_s"].as_f64().is_some_and(|s| (1.9..3.0).contains(&s)), "{stay}");
    let zone = &records(&printed, "zone").next().expect("the kitchen")["zone"];
    assert_eq!((&zone["zone"], &zone["entered"]), (&"kitchen".into(), &false.into()));
    let end = &printed.last().expect("a record")["end"];
    // Its proof has no latest end: an operator may resume a leg again and again.
    assert_eq!((&end["outcome"], &end["within_proven"]), (&"goal".into(), &Value::Null));
    // The true positions are printed meanwhile.
    let positions: Vec<_> = records(&printed, "position").map(|it| &it["position"]).collect();
    let is_at_end = |it: &&&Value| it["at"][0].as_f64().is_some_and(|x_m| x_m > 5.0);
    assert!(positions.iter().any(|it| is_at_end(&it)), "{positions:?}");
    assert_eq!(std::fs::read(&file).expect("the file"), before, "the file was changed");
    assert!(!folder.path().join("out").exists(), "only --out keeps what a rehearsal produces");
}

// Slow (about ten seconds).
#[test]
fn a_leg_that_is_late_ends_the_rehearsal_with_its_exit() {
    let folder = Folder::new("late-rehearsal");
    // 8.6 s at the speed of the file; never less than 3.5 s.
    let leg = "<leg name=\"l2\" to=\"door\" speed=\"0.9m/s\" by=\"1min\"/>";
    let late = leg.replace("1min", "6s");
    let exit = "<otherwise on=\"lost-link blocked late recall\" do=\"rally\"/>";
    let file = write_drawn(&folder, &[(leg, &late), (exit, &exit.replace("rally", "hold"))]);
    let out = folder.path().join("kept").display().to_string();
    let (code, printed, err) = rehearse(&folder, &[&file, "--speed", "5", "--out", &out]);
    assert_eq!(code, 1, "{printed:#?}\n{err}");
    let bounds: Vec<_> = records(&printed, "step").map(|step| step["bounds"].clone()).collect();
    let open = "not reached";
    assert_eq!(bounds, ["kept", "left by red.l2.late", open, open, open, open]);
    let end = &printed.last().expect("a record")["end"];
    assert_eq!((&end["outcome"], &end["as_predicted"]), (&"safe".into(), &false.into()));
    assert!(folder.path().join("kept/executive.journal").exists());
}

/// A program that describes itself as the simulator, but is called `base`: it stands for hardware.
fn write_base(folder: &Folder) {
    let (code, manifest, _) =
        run_to_end(&mut folder.armor(&["describe", "simulator", "--format", "json"]));
    assert_eq!(code, 0);
    let mut manifest: Value = serde_json::from_str(&manifest).expect("a manifest");
    manifest.as_object_mut().expect("an object").remove("origin");
    manifest["kind"] = "base".into();
    manifest["parameters"] = Value::Array(Vec::new());
    manifest["value_effects"] = Value::Array(Vec::new());
    manifest["frames"] = Value::Array(Vec::new());
    for port in manifest["inputs"].as_array_mut().into_iter().flatten() {
        port["stale_after"] = "".into();
    }
    std::fs::create_dir_all(folder.path().join("components")).expect("a folder");
    let text = format!("#!/bin/sh\ncat <<'END'\n{manifest}\nEND\n");
    let program = folder.write("components/base", &text);
    std::fs::set_permissions(program, PermissionsExt::from_mode(0o755)).expect("executable");
}

// Slow (about ten seconds).
#[test]
fn the_simulator_stands_in_for_a_base_that_needs_hardware() {
    let folder = Folder::new("stand-in");
    write_base(&folder);
    let simulator = "<component name=\"simulator\" kind=\"simulator\" rate=\"100Hz\">";
    let parameters = [
        ("<clock source=\"simulator.clock\"/>", ""),
        (simulator, "<component name=\"simulator\" kind=\"base\" rate=\"100Hz\">"),
        ("      <parameter name=\"speed\" value=\"5\"/>\n", ""),
        ("      <parameter name=\"world\" value=\"OFFICE\"/>\n", ""),
    ];
    let office = root().join("missions/worlds/office.svg").display().to_string();
    let world = format!("      <parameter name=\"world\" value=\"{office}\"/>\n");
    let mut parameters: Vec<_> = parameters.into();
    parameters[3].0 = &world;
    let file = write_drawn(&folder, &parameters);
    let (code, _, err) = rehearse(&folder, &[&file]);
    let advice = "those whose outputs the simulator provides are simulator";
    assert!(code == 1 && err.contains("has no simulator") && err.contains(advice), "{err}");
    let replaced = ["--replace", "simulator", "--world", &office, "--speed", "5"];
    let (code, printed, err) = rehearse(&folder, &[&[file.as_str()][..], &replaced].concat());
    assert_eq!(code, 0, "{printed:#?}\n{err}");
    assert_eq!(records(&printed, "step").filter(|step| step["bounds"] == "kept").count(), 6);
}

#[test]
fn ctrl_c_ends_a_rehearsal_and_its_processes() {
    let folder = Folder::new("ended-rehearsal");
    let file = write_drawn(&folder, &[]);
    let arguments = ["mission", "rehearse", &file, "--speed", "1"];
    let mut child = folder.armor(&arguments).spawn().expect("it starts");
    let runs = || -> Vec<Value> {
        let (_, out, _) = run_to_end(&mut folder.armor(&["ps", "--format", "json"]));
        out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    };
    wait_for("its processes", || (runs().len() > 5).then_some(()));
    let pid = Pid::from_raw(child.id().try_into().expect("a process id")).expect("one");
    kill_process(pid, Signal::INT).expect("it runs");
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(130));
    let left = Command::new("pgrep").args(["-f", &folder.path().display().to_string()]).output();
    let left = left.expect("pgrep").stdout;
    assert!(left.is_empty(), "{}", String::from_utf8_lossy(&left));
}
