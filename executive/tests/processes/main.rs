//! An executive and its components as real processes that are killed repeatedly: the mission
//! continues with the same marking, reaches its goal, and two exclusive components are never active
//! together.

mod worker;

use armor_executive::journal::{self, Journal};
use armor_executive::{
    ExecutiveOptions, GivenUpComponents, JournalEntry, MissionOutcome, replay_records, run,
};
use armor_plan::Plan;
use armor_registry::BackgroundRegistry;
use armor_sdk::wire::registry::ComponentEntry;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Forty rounds between two places whose workers exclude each other, then the goal. That is three
/// times the rounds that the kills take on an idle machine, as a busy machine polls less
/// frequently.
const MISSION: &str = r#"<armor version="1">
  <system>
    <component name="left" kind="worker" rate="100Hz"><parameter name="diary" value="diary"/></component>
    <component name="right" kind="worker" rate="100Hz"><parameter name="diary" value="diary"/></component>
  </system>
  <mission name="swing" goal="home" safe="hold">
    <place name="l" initial="true" components="left"/>
    <place name="r" components="right"/>
    <place name="rounds"/><place name="home"/><place name="hold"/>
    <exclusive components="left right"/>
    <transition name="swing" from="l" to="r" on="left.done"/>
    <transition name="back" from="r" on="right.done">
      <arc to="l"/><arc to="rounds"/>
    </transition>
    <transition name="enough" from="l" to="home" priority="9">
      <arc from="rounds" weight="40"/>
    </transition>
  </mission>
</armor>"#;

/// So short that the journal is cut many times, and the executive is killed during some of the
/// cuts.
const CUT_AT: u64 = 4096;

/// Generous: the mission takes six seconds on an idle machine.
const LIMIT: Duration = Duration::from_secs(300);

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let role = arguments.next().unwrap_or_default();
    match role.to_str() {
        Some("worker") => return worker::main(arguments),
        Some("executive") => return executive(arguments),
        Some("configd") => return configd(arguments),
        // What test runners ask first.
        Some("--list") => println!("a_mission_outlives_its_executive: test"),
        _ => a_mission_outlives_its_executive(),
    }
    ExitCode::SUCCESS
}

fn plan() -> Plan {
    let read = armor_robotfile::read("swing.xml".as_ref(), &mut |_| Ok(MISSION.into()));
    let read = read.configuration.filter(|_| !read.findings.has_errors()).expect("it reads");
    Plan::of(&read).expect("it compiles").expect("a mission")
}

fn executive(mut arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let mut next = || arguments.next().expect("an argument");
    let registry = next().into_string().expect("an address");
    let options = ExecutiveOptions {
        registry,
        journal: next().into(),
        is_laid_out: false,
        newer: None,
        given_up: GivenUpComponents::default(),
        cut_at: CUT_AT,
        clock: None,
        trust_clock: false,
    };
    armor_sdk::log::init();
    match run(|| Ok(plan()), &options, &AtomicBool::new(false)) {
        Ok(outcome) => ExitCode::from(outcome.exit_code()),
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn configd(mut arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let mut next = || arguments.next().expect("an argument");
    let registry = next().into_string().expect("an address").parse().expect("an address");
    let options = armor_configd::ConfigdOptions::new(next());
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let mut registrations = Vec::new();
    let tell = |notice| {
        if let armor_configd::Notice::Ready { address } = notice {
            let entry = ComponentEntry {
                name: "configd".into(),
                kind: "configd".into(),
                instance: armor_socket::random_id(),
                pid: std::process::id(),
                host: "here".into(),
                endpoint: address.to_string(),
            };
            registrations.push(armor_socket::Registration::keep_registered(registry, entry));
        }
    };
    let served = runtime.expect("a runtime").block_on(armor_configd::serve(options, tell));
    eprintln!("{}", served.expect_err("it serves for ever"));
    ExitCode::FAILURE
}

/// Everything that has been started, ended when the test ends, however it does.
struct Processes {
    registry: String,
    folder: PathBuf,
    configd: Option<Child>,
    workers: Vec<(&'static str, Child)>,
    executive: Option<Child>,
}

impl Processes {
    fn start(registry: &BackgroundRegistry, folder: &Path) -> Self {
        let registry = registry.address().to_string();
        let mut all = Self {
            registry,
            folder: folder.to_owned(),
            configd: None,
            workers: Vec::new(),
            executive: None,
        };
        let file = folder.join("swing.xml");
        std::fs::write(&file, MISSION).expect("a mission file");
        let mut configd = all.again("configd");
        all.configd = Some(configd.arg(&all.registry).arg(file).spawn().expect("a configd"));
        for name in ["left", "right"] {
            let worker = all.worker(name);
            all.workers.push((name, worker));
        }
        all.executive = Some(all.executive());
        all
    }

    fn again(&self, role: &str) -> Command {
        let mut command = Command::new(std::env::current_exe().expect("this test"));
        command.arg(role);
        command
    }

    fn worker(&self, name: &str) -> Child {
        let mut command = self.again("worker");
        command.args(["--name", name, "--registry", &self.registry]);
        command.spawn().expect("a worker")
    }

    fn executive(&self) -> Child {
        let mut command = self.again("executive");
        command.arg(&self.registry).arg(self.journal()).spawn().expect("an executive")
    }

    fn journal(&self) -> PathBuf {
        self.folder.join("journal.jsonl")
    }

    fn diary(&self) -> PathBuf {
        self.folder.join("diary")
    }

    fn kill_executive(&mut self) {
        let mut old = self.executive.take().expect("one runs");
        old.kill().expect("killed");
        old.wait().expect("reaped");
        self.executive = Some(self.executive());
    }

    fn kill_worker(&mut self, index: usize) {
        let name = self.workers[index].0;
        let old = &mut self.workers[index].1;
        old.kill().expect("killed");
        old.wait().expect("reaped");
        worker::note(&self.diary(), name, "killed");
        self.workers[index].1 = self.worker(name);
    }

    /// The exit code, if the mission is over.
    fn ended(&mut self) -> Option<Option<i32>> {
        let executive = self.executive.as_mut().expect("one runs");
        executive.try_wait().expect("waited").map(|status| status.code())
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        let workers = self.workers.iter_mut().map(|worker| &mut worker.1);
        for child in workers.chain(&mut self.executive).chain(&mut self.configd) {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn a_mission_outlives_its_executive() {
    let folder = std::env::temp_dir().join(format!("armor-executive-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let listen = armor_registry::RegistryOptions {
        listen: "127.0.0.1:0".parse().expect("an address"),
        ..Default::default()
    };
    let registry = BackgroundRegistry::start(listen).expect("a registry");
    let mut processes = Processes::start(&registry, &folder);
    let (began, mut executives, mut workers) = (Instant::now(), 0, 0);
    // Counted in records, so that they die at any stage of a firing.
    let mut next_kill = 3;
    let code = loop {
        assert!(began.elapsed() < LIMIT, "the mission has not ended");
        if let Some(code) = processes.ended() {
            break code;
        }
        let records = processes.records();
        if records >= next_kill && executives < 20 {
            next_kill = records + 3 + executives as u64 * 5 % 7;
            if executives % 4 == 3 && workers < executives / 4 + 1 {
                processes.kill_worker(workers % 2);
                workers += 1;
            } else {
                processes.kill_executive();
                executives += 1;
            }
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    assert_eq!(code, Some(i32::from(MissionOutcome::Goal.exit_code())));
    assert!(executives == 20 && workers == 5, "{executives} and {workers} kills");
    let story = Journal::open(&processes.journal()).expect("a journal").1;
    let first = &story.records.first().expect("some records").entry;
    assert!(matches!(first, JournalEntry::Snapshot(_)), "it was never cut");
    let ledger = replay_records(Arc::new(plan()), &story.records).expect("its own journal");
    assert_eq!(ledger.marking(), [0, 0, 0, 1, 0], "all tokens, and no other");
    let rounds = worker::check(&processes.diary());
    println!(
        "goal after {executives} kills of the executive and {workers} of workers, {rounds} activations"
    );
    drop(processes);
    std::fs::remove_dir_all(&folder).expect("removed");
}

impl Processes {
    /// How many have ever been written.
    fn records(&self) -> u64 {
        journal::read(&self.journal()).map_or(0, |story| story.count_records())
    }
}
