//! Many components and links on one machine: all come up. Prints the time, memory and CPU they use.

use std::time::{Duration, Instant};

use armor_sdk::control::{ControlConnection, Role};
use armor_wire::registry::ComponentEntry;

use super::system::{Draft, System, cpu_s, proc_number};
use crate::fixture::{DEADLINE, Folder, wait_for};

/// Inputs of each component; each has one link.
const INPUTS: [&str; 5] = ["a", "b", "c", "d", "e"];
/// Distance in the ring between a component and the provider of each input.
const STEPS: [usize; 5] = [1, 7, 13, 29, 41];
/// Number of components.
const SIZE: usize = 200;
/// Time over which the CPU load is measured.
const WINDOW: Duration = Duration::from_secs(3);
/// Number of components that are asked in parallel.
const AT_ONCE: usize = 16;

fn ring() -> System {
    let mut draft = Draft::default();
    for index in 0..SIZE {
        draft = draft.quiet_probe(&format!("c{index}"), "rate='1Hz'");
    }
    for index in 0..SIZE {
        for (input, step) in INPUTS.iter().zip(STEPS) {
            let from = format!("c{}", (index + step) % SIZE);
            draft = draft.link(&from, &format!("c{index}.{input}"), "10");
        }
    }
    draft.run(Folder::new("crowd"))
}

/// Whether a component has received something on every link.
fn is_up(entry: &ComponentEntry) -> bool {
    let connection = ControlConnection::connect(entry, Role::Observer, "test", |_| {}).ok();
    let status = connection.and_then(|it| it.status(Duration::from_secs(2)).ok());
    status.is_some_and(|status| {
        let fed = status.inputs.iter().filter(|input| input.connected && input.received > 0);
        fed.count() == INPUTS.len()
    })
}

/// Waits until all components are up. One that is up is not asked again.
fn all_up(system: &System) {
    let start = Instant::now();
    let mut up: Vec<u64> = Vec::new();
    while up.len() < SIZE {
        assert!(start.elapsed() < DEADLINE, "{} of {SIZE} are up\n{}", up.len(), system.run.log());
        let entries = system.entries();
        let missing: Vec<_> = entries
            .iter()
            .filter(|entry| entry.kind == "probe" && !up.contains(&entry.instance))
            .collect();
        for some in missing.chunks(AT_ONCE) {
            std::thread::scope(|scope| {
                let asked: Vec<_> = some.iter().map(|entry| scope.spawn(|| is_up(entry))).collect();
                for (entry, answer) in some.iter().zip(asked) {
                    if answer.join().expect("an answer") {
                        up.push(entry.instance);
                    }
                }
            });
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_crowd_of_components_comes_up_on_one_machine() {
    let start = Instant::now();
    let system = ring();
    all_up(&system);
    let took = start.elapsed();
    println!("{SIZE} components, {} links: all up after {took:.1?}", SIZE * INPUTS.len());

    let entries = wait_for("the registry's list", || {
        Some(system.entries()).filter(|entries| !entries.is_empty())
    });
    let probes: Vec<_> = entries.iter().filter(|entry| entry.kind == "probe").collect();
    assert_eq!(probes.len(), SIZE, "each once");
    let pids: Vec<_> = probes.iter().map(|entry| entry.pid.cast_signed()).collect();
    let numbers = |file: &str, field: &str| {
        let mut numbers: Vec<_> = pids.iter().map(|pid| proc_number(*pid, file, field)).collect();
        numbers.sort_unstable();
        (numbers[SIZE / 2], numbers.iter().sum::<u64>())
    };
    let (rss, all_rss) = numbers("status", "VmRSS");
    let (pss, all_pss) = numbers("smaps_rollup", "Pss");
    let (threads, _) = numbers("status", "Threads");
    println!("a component: {rss} KiB resident, {pss} KiB its own share, {threads} threads");
    println!("all components: {} MiB resident, {} MiB in fact", all_rss >> 10, all_pss >> 10);
    let daemons = [
        ("launcher", system.run.pid()),
        ("registry", system.pid("registry")),
        ("configd", system.pid("configd")),
    ];
    for (name, pid) in daemons {
        println!("{name}: {} KiB resident", proc_number(pid, "status", "VmRSS"));
    }
    let everybody: Vec<_> = pids.iter().copied().chain(daemons.map(|daemon| daemon.1)).collect();
    let used_s = || everybody.iter().map(|pid| cpu_s(*pid)).sum::<f64>();
    let (before_s, since) = (used_s(), Instant::now());
    std::thread::sleep(WINDOW);
    let cores = (used_s() - before_s) / since.elapsed().as_secs_f64();
    println!("{cores:.2} cores for all of it, every link at 1 Hz");
    // `armor graph` omits a component that does not answer in time, so the test repeats it.
    let looked = wait_for("every link in the graph", || {
        let since = Instant::now();
        let edges = system.read_json(&["graph"]);
        let connected = edges.iter().filter(|edge| edge["connected"] == true).count();
        (connected == SIZE * INPUTS.len()).then(|| since.elapsed())
    });
    println!("`armor graph` took {looked:.1?}");
    assert!(!system.run.log().contains("killed"), "{}", system.run.log());
}
