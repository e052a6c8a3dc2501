//! The complete system that ArMoR was evaluated with (Godin, figure 4): simulator, camera, SLAM and
//! the operator's screen. The test checks the rate and the losses of every link, then kills three
//! of the processes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rustix::process::Signal;
use serde_json::Value;

use crate::fixture::{Folder, Run, run_to_end, send_signal, wait_for};

/// Ports that carry no data until an operator acts or the robot returns home.
const QUIET: [&str; 5] = ["view.goal", "view.velocity", "view.stop", "homing.goal", "homing.pose"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("in the workspace").into()
}

/// Whether the operator's screen is built. It is a separate program, which `cargo test --workspace`
/// builds next to `armor`.
fn is_there() -> bool {
    let there =
        Path::new(env!("CARGO_BIN_EXE_armor")).with_file_name("armor-operator-view").exists();
    assert!(there || std::env::var_os("CI").is_none(), "armor-operator-view is not built");
    if !there {
        println!("skipped: no armor-operator-view; cargo build -p armor-operator-view");
    }
    there
}

/// Runs a tool on the system; returns its output, one JSON object per line.
fn lines(folder: &Folder, run: &Run, tool: &str) -> Vec<Value> {
    let registry = run.registry().to_string();
    let (_, out, _) =
        run_to_end(&mut folder.armor(&[tool, "--registry", &registry, "--format", "json"]));
    out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

/// Returns the links by name, `FROM -> TO`.
fn links(folder: &Folder, run: &Run) -> BTreeMap<String, Value> {
    // The screen observes the mission, as other tools do.
    let is_drawn = |link: &Value| !link["to"].as_str().is_some_and(|to| to.starts_with("tool-"));
    let all = lines(folder, run, "graph").into_iter().filter(is_drawn);
    let named = |link: Value| {
        let (from, to) = (link["from"].as_str()?, link["to"].as_str()?);
        Some((format!("{from} -> {to}"), link))
    };
    all.filter_map(named).collect()
}

fn is_quiet(link: &str) -> bool {
    QUIET.iter().any(|port| link.starts_with(port) || link.ends_with(port))
}

fn count(link: &Value, what: &str) -> u64 {
    link[what].as_u64().unwrap_or_else(|| panic!("no {what} in {link}"))
}

/// Waits until every link that is not quiet has received more than in `since`; returns all links.
fn all_flow(
    folder: &Folder,
    run: &Run,
    since: &BTreeMap<String, Value>,
) -> BTreeMap<String, Value> {
    let file = std::fs::read_to_string(root().join("missions/operator.xml")).expect("the mission");
    let drawn = file.matches("<link ").count();
    wait_for(&format!("data on all links\n{}", run.log()), || {
        let links = links(folder, run);
        let flows = |(name, link): (&String, &Value)| {
            let before = since.get(name).filter(|_| !is_quiet(name));
            let before = before.map_or(0, |before| count(before, "received"));
            link["connected"] == true && (is_quiet(name) || count(link, "received") > before)
        };
        (links.len() == drawn && links.iter().all(flows)).then_some(links)
    })
}

// Slow (about half a minute): three processes are killed one after the other, and data must flow on
// every link again after each.
#[test]
fn figure_four_runs_completely_and_killed_processes_return() {
    if !is_there() {
        return;
    }
    let folder = Folder::new("operated");
    let file = root().join("missions/operator.xml").display().to_string();
    let mut run = folder.run("out", &[&file, "--headless", "--set", "view.picture=view.png"]);
    let links = all_flow(&folder, &run, &BTreeMap::new());
    for (name, link) in &links {
        println!(
            "{name:40} {:>5.1} Hz, {} sent, {} received, {} dropped, {} lost",
            link["rate_hz"].as_f64().unwrap_or_default(),
            count(link, "sent"),
            count(link, "received"),
            count(link, "dropped"),
            count(link, "lost")
        );
        // Every message sent is received or counted as dropped or lost. Messages in transit are not
        // counted yet, so the numbers may differ a little.
        let known = count(link, "received") + count(link, "dropped") + count(link, "lost");
        assert!(count(link, "sent").abs_diff(known) <= 50, "{name}: {link}");
    }

    let pid = |name: &str| {
        let all = lines(&folder, &run, "ps");
        let one = all.iter().find(|one| one["name"] == name)?;
        i32::try_from(one["pid"].as_i64()?).ok()
    };
    for name in ["camera", "mapper", "view"] {
        let before = pid(name).expect("it runs");
        send_signal(before, Signal::KILL);
        wait_for(&format!("another {name}"), || pid(name).filter(|now| *now != before));
        // A restarted subscriber counts its received messages from 0, so the old counts are no
        // baseline.
        let mut since = self::links(&folder, &run);
        since.retain(|link, _| !link.contains(&format!("-> {name}.")));
        all_flow(&folder, &run, &since);
    }

    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130), "{}", run.log());
    let picture = folder.path().join("out/view.png");
    let size = std::fs::metadata(&picture).expect("what the operator saw").len();
    assert!(size > 20_000, "{} is {size} bytes", picture.display());
}
