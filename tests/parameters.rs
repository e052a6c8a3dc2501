//! Parameters of a running system: listed, set, compared and delivered, also while the file is
//! invalid and after configd was killed.

use std::net::SocketAddr;
use std::process::{Child, Stdio};

use armor_registry::{BackgroundRegistry, RegistryOptions};
use serde_json::Value;

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::resilience::system::{Draft, System, probe};
use crate::resilience::trace::Trace;

/// Runs `armor param` on a system; returns its exit code, stdout and stderr.
fn param(system: &System, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["param"]);
    run_to_end(command.args(arguments).args(["--registry", &registry]))
}

/// As [`param`], for a command that must succeed; returns its stdout.
fn param_ok(system: &System, arguments: &[&str]) -> String {
    let (code, out, err) = param(system, arguments);
    assert_eq!(code, 0, "{arguments:?}: {out}{err}");
    out
}

fn file(system: &System) -> String {
    std::fs::read_to_string(system.folder.path().join("probes.xml")).expect("readable")
}

fn save(system: &System, text: &str) {
    system.folder.write("probes.xml", text);
}

/// Returns the published state of the configuration.
fn state(system: &System) -> Value {
    let published = || system.read_json(&["echo", "configuration.state", "-n", "1"]).pop();
    wait_for("the state of the configuration", published)["value"].take()
}

/// Waits until the configuration has the wanted state, which is published a moment after it
/// applies.
fn stands(system: &System, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    wait_for(what, || Some(state(system)).filter(&is_so))
}

fn marked(system: &System, mark: &str) {
    let note = format!("mark {mark}");
    system.traced("lamp", &note, |trace| (trace.count(&note) > 0).then_some(()));
}

fn lamp(name: &str) -> System {
    let draft = Draft::default().probe("lamp", "rate='20Hz'", "mark=one burst=1");
    let system = draft.run(Folder::new(name));
    marked(&system, "one");
    system
}

#[test]
fn a_live_value_reaches_the_component_also_after_a_restart_of_configd() {
    let system = lamp("param-live");
    let out = param_ok(&system, &["set", "lamp.mark", "two"]);
    assert_eq!(out, "version 2: parameter lamp.mark: one → two; it reaches lamp immediately\n");
    marked(&system, "two");
    let out = param_ok(&system, &["set", "lamp.burst", "2"]);
    assert!(out.ends_with("; it takes effect when lamp is started again\n"), "{out}");
    assert!(file(&system).contains("<parameter name='burst' value='2'/>"), "{}", file(&system));

    system.replace("configd");
    wait_for("the new configd", || (param(&system, &["list"]).0 == 0).then_some(()));
    save(&system, &file(&system).replace("value='two'", "value='three'"));
    marked(&system, "three");
    let trace = system.trace("lamp");
    assert_eq!(trace.count("started"), 1, "it ran on all the time");
    assert_eq!(trace.count("mark two"), 1, "what it had was not delivered again");
    stands(&system, "version 4: they are counted on", |state| state["version"] == 4);
    let out = param_ok(&system, &["diff", "1"]);
    assert!(out.starts_with("from version 1 to version 4:\n"), "{out}");
    assert!(
        out.contains("parameter lamp.mark: one → three; it reaches lamp immediately\n"),
        "{out}"
    );
}

#[test]
fn the_last_good_version_outlives_configd_and_a_broken_file() {
    let system = lamp("param-broken");
    param_ok(&system, &["set", "lamp.mark", "two"]);
    let good = file(&system);
    let broken = good.replace("burst' value='1'", "burst' value='-1'");
    save(&system, &broken);
    system
        .run
        .wait_for_log("the file is not valid; version 2, the last good one, stays in force", 1);
    system.replace("configd");
    system
        .run
        .wait_for_log("the file is not valid; version 2, the last good one, stays in force", 2);
    let state_now = stands(&system, "a refused state", |state| state["refused"] == true);
    assert_eq!(state_now["version"], 2);
    let finding = &state_now["findings"][0];
    assert_eq!((&finding["code"], &finding["text"]), (&"E0113".into(), &"-1".into()), "{finding}");

    // A component that starts now receives the last good version.
    system.replace("lamp");
    system.traced("lamp", "another start", |trace| (trace.count("mark two") == 2).then_some(()));
    assert_eq!(param_ok(&system, &["get", "lamp.burst"]), "1\n");
    let (code, _, err) = param(&system, &["set", "lamp.burst", "3"]);
    assert!(code == 1 && err.contains("error[E0113]") && err.contains("fix it"), "{err}");
    assert_eq!(file(&system), broken, "nothing was written");

    save(&system, &good);
    system.run.wait_for_log("the file is again that of version 2", 1);
    stands(&system, "a state that is not refused", |state| state["refused"] == false);
}

#[test]
fn values_that_check_refuses_or_that_set_overrides_are_not_written() {
    let draft = Draft::default().probe("lamp", "rate='20Hz'", "mark=one burst=1");
    let system = draft.run_with(Folder::new("param-refused"), &["--set", "lamp.limit=7"]);
    marked(&system, "one");
    let before = file(&system);
    for (name, value, reason) in [
        ("lamp.burst", "-1", "error[E0113]"),
        ("lamp.burst", "many", "error[E0112]"),
        ("lamp.brust", "1", "error[E0110]"),
        ("lump.burst", "1", "no component called `lump`"),
        ("lamp.limit", "8", "--set"),
    ] {
        let (code, out, err) = param(&system, &["set", name, value]);
        assert!(code == 1 && out.is_empty() && err.contains(reason), "{name}={value}: {err}");
    }
    assert_eq!(file(&system), before);
    let (code, _, err) = param(&system, &["get", "lamp.brust"]);
    assert!(code == 1 && err.contains("burst"), "{err}");
    let list = || Some(system.read_json(&["param", "list", "lamp"])).filter(|all| !all.is_empty());
    let listed = wait_for("the list", list);
    let of = |name: &str| listed.iter().find(|one| one["name"] == name).expect("listed").clone();
    assert_eq!((&of("limit")["value"], &of("limit")["origin"]), (&"7".into(), &"--set".into()));
    assert_eq!((&of("done")["origin"], &of("done")["live"]), (&"default".into(), &false.into()));
    assert_eq!(
        (&of("mark")["live"], &of("burst")["range"]),
        (&true.into(), &"0 to 1000000".into())
    );
    let origin = of("mark")["origin"].as_str().expect("a place").to_owned();
    assert!(origin.contains("probes.xml:4:"), "{origin}");
}

#[test]
fn a_parameter_that_the_kind_lacks_is_refused_with_the_reason() {
    let draft = Draft::default().probe("lamp", "rate='20Hz'", "ask=brust");
    let system = draft.run(Folder::new("param-unknown"));
    system.run.wait_for_log(
        "that has no parameter called `brust`; did you mean burst? It has: trace, alone",
        1,
    );
    system.traced("lamp", "that it runs on", |trace| (trace.count("started") > 0).then_some(()));
}

/// A process that ends with the test.
struct Started(Child);

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_component_may_start_before_configd() {
    let folder = Folder::new("param-before");
    let listen = SocketAddr::from(([127, 0, 0, 1], 0));
    let registry =
        BackgroundRegistry::start(RegistryOptions { listen, ..RegistryOptions::default() })
            .expect("it listens");
    let at = registry.address().to_string();
    let file = "<armor version='1'><system><component name='lamp' kind='probe' rate='20Hz'>\
                <parameter name='trace' value='lamp.trace'/><parameter name='mark' value='one'/>\
                </component></system></armor>";
    folder.write("lamp.xml", file);
    std::fs::create_dir(folder.path().join("components")).expect("writable");
    std::os::unix::fs::symlink(probe(), folder.path().join("components/probe")).expect("a link");
    let start = |command: &mut std::process::Command| {
        let quiet = command.stdout(Stdio::null()).stderr(Stdio::null());
        Started(quiet.spawn().expect("it starts"))
    };
    let mut lamp = std::process::Command::new(probe());
    let _lamp = start(lamp.args(["--name", "lamp", "--registry", &at]).current_dir(folder.path()));
    wait_for("the lamp in the registry", || {
        let (_, out, _) = run_to_end(&mut folder.armor(&["ps", "--registry", &at]));
        out.contains("lamp").then_some(())
    });
    let marks = |mark: &str| Trace::read(&folder.path().join("lamp.trace")).count(mark);
    assert_eq!(marks("started"), 0, "its parameter is not assigned");
    let configd = start(&mut folder.armor(&["configd", "lamp.xml", "--registry", &at]));
    wait_for("its parameters", || (marks("mark one") == 1).then_some(()));
    // A live parameter changes in the file while configd is down; the next configd delivers it.
    drop(configd);
    folder.write("lamp.xml", &file.replace("'one'", "'two'"));
    let _configd = start(&mut folder.armor(&["configd", "lamp.xml", "--registry", &at]));
    wait_for("the other value", || (marks("mark two") == 1).then_some(()));
    assert_eq!(marks("mark one"), 1);
}

#[test]
fn a_file_without_a_run_is_listed_set_and_compared_too() {
    let folder = Folder::new("param-file");
    folder.write("world.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>");
    let text = "<armor version=\"1\">\n  <system>\n    <!-- ours -->\n    \
                <component name=\"sim\" kind=\"simulator\">\n      \
                <parameter name=\"world\" value=\"world.svg\"/>\n    </component>\n  </system>\n</armor>\n";
    folder.write("old.xml", text);
    folder.write("new.xml", text);
    let param = |arguments: &[&str]| run_to_end(folder.armor(&["param"]).args(arguments));
    let (code, out, err) = param(&["set", "--file", "new.xml", "sim.seed", "7"]);
    assert_eq!((code, out.as_str()), (0, "parameter sim.seed added: 7\n"), "{err}");
    let seed = "      <parameter name=\"seed\" value=\"7\"/>\n";
    let set = text.replace("world.svg\"/>\n", &format!("world.svg\"/>\n{seed}"));
    let now = || std::fs::read_to_string(folder.path().join("new.xml")).expect("readable");
    assert_eq!(now(), set, "its own line, and no other");
    let (code, out, _) = param(&["diff", "--file", "old.xml", "--file", "new.xml"]);
    assert_eq!((code, out.as_str()), (0, "parameter sim.seed added: 7\n"));
    assert_eq!(param(&["get", "--file", "new.xml", "sim.seed"]).1, "7\n");
    assert_eq!(param(&["get", "--file", "old.xml", "sim.seed"]).1, "1\n");
    let (code, _, err) = param(&["set", "--file", "new.xml", "sim.seed", "-7"]);
    assert!(code == 1 && err.contains("error[E0113]"), "{err}");
    assert_eq!(now(), set);
    let (code, _, err) = param(&["set", "--file", "new.xml", "sim.world", "hall.svg"]);
    assert!(code == 0 && err.contains("warning[W0118]: sim.world names hall.svg"), "{err}");
    let (code, _, err) = param(&["set", "--file", "new.xml", "sim.world", "world.svg"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(param(&["set", "--file", "new.xml", "sim.seed", "--default"]).0, 0);
    assert_eq!(now(), text);
    let (code, out, _) = param(&["list", "--file", "new.xml", "sim"]);
    assert!(code == 0 && out.contains("sim.world") && out.contains("new.xml:5:38"), "{out}");
    folder.write("new.xml", "<armor");
    let (code, _, err) = param(&["list", "--file", "new.xml"]);
    assert!(code == 1 && err.contains("new.xml is not valid"), "{err}");
}

#[test]
fn an_executable_that_is_replaced_by_one_that_does_not_fit_is_reported() {
    let system = lamp("param-replaced");
    let executable = system.folder.path().join("components/probe");
    // It is a link, through which the script would be written.
    std::fs::remove_file(&executable).expect("a link");
    system.folder.script("probe", "exec sleep 1000");
    let outdated = "the file is not valid with the components' executables as they are now; \
                    version 1 stays in force";
    system.run.wait_for_log(outdated, 1);
    let state = stands(&system, "a refused state", |state| state["refused"] == true);
    assert_eq!((&state["version"], &state["findings"][0]["code"]), (&1.into(), &"E0110".into()));
    let registry = system.registry.to_string();
    let ps = || run_to_end(system.folder.armor(&["ps"]).args(["--registry", &registry])).1;
    assert!(ps().contains("the file on the disk is not valid (E0110 at"), "{}", ps());
    // The running component and its configuration are untouched.
    assert_eq!(param_ok(&system, &["get", "lamp.mark"]), "one\n");
    system.traced("lamp", "its only start", |trace| (trace.count("mark one") == 1).then_some(()));
    std::fs::remove_file(&executable).expect("a script");
    std::os::unix::fs::symlink(probe(), &executable).expect("a link");
    system.run.wait_for_log("the file is again that of version 1", 1);
    assert!(!ps().contains("not valid"), "{}", ps());
}

#[test]
fn a_kind_added_after_the_start_is_known() {
    let system = lamp("param-kinds");
    let describe = |parameters: &str| {
        let manifest = r#""armor_manifest":1,"kind":"arm","summary":"x","inputs":[],"outputs":[]"#;
        format!("#!/bin/sh\necho '{{{manifest},\"parameters\":[{parameters}]}}'\n")
    };
    let taken = |version: u64| {
        stands(&system, "the version", |state| {
            state["version"] == version && state["refused"] == false
        });
    };
    system.folder.executable("components/arm", &describe(""));
    let with = |arm: &str| file(&system).replace("</system>", &format!("{arm}</system>"));
    save(&system, &with("<component name='arm' kind='arm'/>"));
    taken(2);
    // The file names the parameter before the component is rebuilt with it.
    let reach = "<parameter name='reach' value='1'/>";
    let text = file(&system);
    let text = text.replace("kind='arm'/>", &format!("kind='arm'>{reach}</component>"));
    save(&system, &text);
    stands(&system, "the refusal", |state| state["refused"] == true);
    system.folder.executable("components/arm", &describe(r#"{"name":"reach","type":"text"}"#));
    taken(3);
}

#[test]
fn a_parameter_that_is_declared_and_never_requested_is_a_warning_at_the_start_and_of_an_edit() {
    let folder = Folder::new("param-unrequested");
    std::fs::create_dir_all(folder.path().join("components")).expect("writable");
    std::fs::create_dir_all(folder.path().join("hidden")).expect("writable");
    // A link in `components` would run under the name of the probe.
    let quirk = folder.path().join("hidden/quirk");
    std::os::unix::fs::symlink(probe(), &quirk).expect("a link");
    let script = format!("#!/bin/sh\nexec '{}' \"$@\"\n", quirk.display());
    folder.executable("components/quirk", &script);
    let draft = Draft::default().component("<component name='odd' kind='quirk' rate='5Hz'/>\n");
    let system = draft.run(folder);
    let warning = "quirk declares the parameter `speed` but has not requested it: its value reaches \
                   the component only when it does; call get_parameter(\"speed\") in `new`";
    let log = system.run.out().join("logs/odd.log");
    let logged = || std::fs::read_to_string(&log).ok().filter(|text| text.contains(warning));
    let text = wait_for("the warning", logged);
    let line = text.lines().find(|line| line.contains(warning)).expect("a line");
    assert!(line.contains("WARN"), "{line}");
    system.entry("odd");
    let out = param_ok(&system, &["set", "odd.speed", "2m/s"]);
    let ending =
        "it reaches odd only when odd requests speed, which it declares but has not requested\n";
    assert!(out.contains("odd.speed") && out.ends_with(ending), "{out}");
}
