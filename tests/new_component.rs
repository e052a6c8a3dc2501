//! A user's component: created by `armor new`, built outside this workspace, copied into a folder,
//! and used without rebuilding anything else.

use std::path::Path;
use std::process::Command;

use rustix::process::Signal;

use crate::fixture::{Folder, run_to_end, send_signal, wait_for};

const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// A `cargo` command in the project. The built dependencies are kept for the next run of the test.
fn cargo(project: &Path, verb: &str) -> Command {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([verb, "--offline", "--quiet"]).current_dir(project);
    cargo.env("CARGO_TARGET_DIR", Path::new(REPOSITORY).join("target/new-component"));
    cargo
}

fn build(project: &Path) -> std::path::PathBuf {
    // The same versions as in this workspace: they are already downloaded, so `--offline` works.
    let lock = Path::new(REPOSITORY).join("Cargo.lock");
    std::fs::copy(lock, project.join("Cargo.lock")).expect("the lock file");
    assert!(cargo(project, "build").status().expect("cargo starts").success());
    Path::new(REPOSITORY).join("target/new-component/debug/odd-counter")
}

/// The tests that the project begins with pass.
fn run_own_tests(project: &Path) {
    let tested = cargo(project, "test").output().expect("cargo starts");
    let out = String::from_utf8_lossy(&tested.stdout);
    assert!(tested.status.success(), "{out}{}", String::from_utf8_lossy(&tested.stderr));
    assert!(out.contains("3 passed"), "{out}");
}

/// A fault of its ports is shown by the project's own tests, with what to do.
fn show_a_fault(project: &Path) {
    let main = project.join("src/main.rs");
    let text = std::fs::read_to_string(&main).expect("the project's code");
    let declaration = "armor.provide::<Count>(\"count\")?;";
    let twice = text.replace(declaration, &declaration.repeat(2));
    std::fs::write(&main, twice).expect("written");
    let tested = cargo(project, "test").output().expect("cargo starts");
    let out = String::from_utf8_lossy(&tested.stdout);
    let shown = "panicked at src/main.rs:";
    let fault =
        "\nthe port `count` is declared twice; inputs and outputs share their names: rename";
    assert!(out.contains(shown) && out.contains(fault), "{out}");
    std::fs::write(&main, text).expect("written");
}

#[test]
fn a_users_own_component_runs_and_is_supervised() {
    let folder = Folder::new("new");
    let (code, _, err) = run_to_end(&mut folder.armor(&["new", "odd-counter"]));
    assert_eq!(code, 0, "{err}");
    let executable = build(&folder.path().join("odd-counter"));
    crate::manifests::keeps_to_the_schema(&executable);
    run_own_tests(&folder.path().join("odd-counter"));

    folder.script("bystander", "echo here; exec sleep 600");
    let components = folder.path().join("components");
    std::fs::copy(executable, components.join("odd-counter")).expect("copied");
    show_a_fault(&folder.path().join("odd-counter"));
    let (code, out, err) = run_to_end(&mut folder.armor(&["describe", "odd-counter"]));
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("step") && out.contains("1 to 1000"), "{out}");

    let file = folder.system("counting", &["a odd-counter rate=\"20Hz\"", "b bystander"]);
    let mut run = folder.run("out", &[&file, "--set", "a.step=3"]);
    run.wait_for_log("here", 1);
    counts(&folder);
    stopped(&folder);
    counts(&folder);
    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130), "{}", run.log());
    assert_eq!(run.log().matches("here").count(), 1, "the other one never noticed");

    mission(&folder);
}

#[test]
fn a_copied_program_with_a_copy_of_the_sdk_creates_a_component_that_builds() {
    let folder = Folder::new("copied-program");
    let bin = folder.path().join("bin");
    std::fs::create_dir_all(&bin).expect("writable");
    let (code, out, err) = run_to_end(&mut folder.armor(&["sdk", "bin/sdk"]));
    assert!(code == 0 && out.contains("a part of Armor's sources"), "{out}{err}");
    let program = bin.join("armor");
    std::fs::copy(env!("CARGO_BIN_EXE_armor"), &program).expect("copied");
    let mut new = Command::new(&program);
    let (code, out, err) = run_to_end(new.args(["new", "odd-counter"]).current_dir(folder.path()));
    assert!(code == 0 && out.contains("a copy made by `armor sdk`"), "{out}{err}");
    // Neither the program nor its copy of the SDK is needed any more.
    std::fs::remove_dir_all(&bin).expect("removable");
    let executable = build(&folder.path().join("odd-counter"));
    crate::manifests::keeps_to_the_schema(&executable);
}

/// A mission with it resumes at the same marking after a kill of the executive, and exits with 0.
fn mission(folder: &Folder) {
    let places = r#"
  <mission name="tour" goal="home" safe="hold">
    <place name="one" initial="true" components="a"/>
    <place name="two" components="b"/>
    <place name="home"/>
    <place name="hold"/>
    <exclusive components="a b"/>
    <transition name="next" from="one" to="two" operator="true"/>
    <transition name="end" from="two" to="home" timeout="1s"/>
  </mission>
</armor>"#;
    let file = folder.system("tour", &["a odd-counter", "b odd-counter"]);
    let text = std::fs::read_to_string(folder.path().join(&file)).expect("readable");
    folder.write(&file, &text.replace("</armor>", places));
    let mut run = folder.run("tour", &[&file]);
    let shown = wait_for("the first place", || {
        let (_, out, _) = run_to_end(&mut folder.armor(&["mission", "show"]));
        out.contains("a active").then_some(out)
    });
    assert!(shown.contains("marked      one"), "{shown}");
    let executive = pid(folder, "executive").expect("it is registered");
    send_signal(executive, Signal::KILL);
    run.wait_for_log("continues where it stopped", 1);
    let fire = &mut folder.armor(&["mission", "fire", "next", "--within", "60s"]);
    let (code, _, err) = run_to_end(fire);
    assert_eq!(code, 0, "{err}\n{}", run.log());
    assert_eq!(run.code(), Some(0), "{}", run.log());
    let log = run.log();
    assert_eq!(log.matches("one -> two").count(), 1, "{log}");
    assert!(log.contains("reached its goal"), "{log}");
}

/// The published counts are multiples of the step that was set.
fn counts(folder: &Folder) {
    // The component may not provide its output yet.
    let out = wait_for("three counts", || {
        let (code, out, _) = run_to_end(&mut folder.armor(&["echo", "a.count", "--count", "3"]));
        (code == 0).then_some(out)
    });
    let values: Vec<serde_json::Value> =
        out.lines().map(|line| serde_json::from_str(line).expect("JSON Lines")).collect();
    let counts: Vec<u64> =
        values.iter().filter_map(|value| value["value"]["count"].as_u64()).collect();
    assert_eq!(counts.len(), 3, "{out}");
    assert!(counts.iter().all(|count| count % 3 == 0), "{counts:?}");
    assert!(counts.windows(2).all(|pair| pair[0] < pair[1]), "{counts:?}");
}

/// A component that hangs is found, killed and started again.
fn stopped(folder: &Folder) {
    let before = wait_for("the component is listed", || pid(folder, "a"));
    send_signal(before, Signal::STOP);
    wait_for("another start of it", || pid(folder, "a").filter(|after| *after != before));
}

/// Returns the process id of a registered process.
fn pid(folder: &Folder, name: &str) -> Option<i32> {
    let (_, out, _) = run_to_end(&mut folder.armor(&["ps", "--format", "json"]));
    let mut rows = out.lines().map(|line| serde_json::from_str(line).expect("JSON Lines"));
    let row = rows.find(|row: &serde_json::Value| row["name"] == name)?;
    i32::try_from(row["pid"].as_i64()?).ok()
}
