//! A registry, components in threads, and functions to observe them.

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{LazyLock, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use armor_registry::{BackgroundRegistry, RegistryOptions};
use armor_sdk::control::{Command, ControlConnection, ControlEvent, Role, Status};
use armor_sdk::directory::Directory;
use armor_sdk::prelude::*;
use armor_sdk::wire::registry::ComponentEntry;

/// Only a hang takes this long.
pub const DEADLINE: Duration = Duration::from_secs(20);
/// Between two looks at a process.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// What a probe subscribes to, at least; the last of the ports that it declares.
const INPUTS: usize = 4;

/// What happens to a probe, as the test sees it.
#[derive(Debug, PartialEq)]
pub enum ProbeEvent {
    Call(Call),
    Data {
        id: String,
        source: String,
        value: u64,
        lost: u64,
        len: usize,
    },
    Parameter(String, f64),
    /// The values of the input's history, newest first, after each data.
    History(Vec<u64>),
}

type Script = Box<dyn FnMut(&Armor, Call) -> Result<Outcome, Fault> + Send>;

/// What a probe does. Found by its name: the component's type cannot carry it.
pub struct Plan {
    pub events: Sender<ProbeEvent>,
    pub script: Script,
    /// Makes `data_received` wait until the test sends something or hangs up.
    pub gate: Option<Receiver<()>>,
}

static PLANS: LazyLock<Mutex<HashMap<String, Plan>>> = LazyLock::new(Mutex::default);

/// A component that carries out its plan and reports what happens to it.
pub struct Probe {
    armor: Armor,
    plan: Plan,
}

#[derive(Clone, Debug, PartialEq, Message)]
pub struct Sample {
    pub value: u64,
    pub bulk: Array<u8>,
}

impl Component for Probe {
    const KIND: &'static str = "probe";
    const SUMMARY: &'static str = "Carries out the plan of a test.";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::number("speed", "m/s").default("2m/s").range(0.0, 10.0)];
    const EVENTS: &'static [DeclaredEvent] = &[DeclaredEvent::new("half")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Sample>("out")?;
        armor.provide::<Latched<Sample>>("state")?;
        armor.provide::<Latched<Clock>>("clock")?;
        armor.subscribe::<Optional<Sample>>("in")?;
        armor.subscribe::<Optional<Sample>>("in2")?;
        armor.subscribe::<Optional<Text>>("words")?;
        armor.subscribe::<Optional<Many<Sample>>>("all")?;
        armor.get_parameter("speed")?;
        armor.synchronize()?;
        let name = armor.provided_data("out").unwrap_or_default().replace(".out", "");
        let plan = PLANS.lock().unwrap().remove(&name).ok_or("no plan")?;
        Ok(Self { armor, plan })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let _ = self.plan.events.send(ProbeEvent::Parameter(name.into(), value.number()?));
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let sample: Sample = data.decode()?;
        let events = ProbeEvent::Data {
            id: header.id().into(),
            source: header.data().into(),
            value: sample.value,
            lost: header.lost,
            len: sample.bulk.len(),
        };
        let _ = self.plan.events.send(events);
        if let Ok(history) = data.history(header.id()) {
            let values = history.iter().map(|past| {
                assert!(past.data.history("in").is_err(), "a past message has none of its own");
                past.data.decode::<Sample>().map(|sample| sample.value)
            });
            let values = values.collect::<Result<Vec<_>, _>>()?;
            let _ = self.plan.events.send(ProbeEvent::History(values));
        }
        if let Some(gate) = &self.plan.gate {
            let _ = gate.recv();
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call != Call::Tick && call != Call::Data {
            let _ = self.plan.events.send(ProbeEvent::Call(call));
        }
        (self.plan.script)(&self.armor, call)
    }
}

pub struct System {
    pub registry: BackgroundRegistry,
    pub directory: Directory,
    threads: Vec<(String, JoinHandle<()>)>,
}

impl System {
    pub fn start() -> Self {
        let listen = "127.0.0.1:0".parse().unwrap();
        let registry =
            BackgroundRegistry::start(RegistryOptions { listen, ..RegistryOptions::default() })
                .unwrap();
        let directory = Directory::observer(&registry.address().to_string(), "test");
        Self { registry, directory, threads: Vec::new() }
    }

    /// Runs a probe with `arguments` in addition to its name and registry.
    pub fn run(
        &mut self,
        name: &str,
        arguments: &[&str],
        gate: Option<Receiver<()>>,
        script: impl FnMut(&Armor, Call) -> Result<Outcome, Fault> + Send + 'static,
    ) -> Receiver<ProbeEvent> {
        // One process, many systems: names are made unique by the registry's port.
        let full = self.name(name);
        let (events, receiver) = channel();
        let plan = Plan { events, script: Box::new(script), gate };
        PLANS.lock().unwrap().insert(full, plan);
        self.run_kind::<Probe>(name, arguments);
        receiver
    }

    /// Runs a component of another kind with `arguments` in addition to its name and registry.
    pub fn run_kind<C: Component>(&mut self, name: &str, arguments: &[&str]) {
        let full = self.name(name);
        let address = self.registry.address().to_string();
        let mut all =
            vec!["--alone".to_owned(), "--name".into(), full.clone(), "--registry".into(), address];
        all.extend(arguments.iter().map(|argument| (*argument).into()));
        let thread = std::thread::spawn(move || {
            armor_sdk::run_with::<C>(all.into_iter().map(Into::into));
        });
        self.threads.push((full, thread));
    }

    pub fn name(&self, name: &str) -> String {
        format!("{name}-{}", self.registry.address().port())
    }

    /// `--link` argument from `data` (of another probe) to `input`.
    pub fn link(&self, input: &str, from: &str, output: &str, keep: &str) -> String {
        format!("--link={input}={}.{output},keep={keep}", self.name(from))
    }

    pub fn entry(&self, name: &str) -> ComponentEntry {
        self.directory.find_process(&self.name(name), DEADLINE).unwrap()
    }

    pub fn control(&self, name: &str, role: Role) -> (ControlConnection, Receiver<ControlEvent>) {
        let start = Instant::now();
        loop {
            let (sender, receiver) = channel();
            let sink = move |event| {
                let _ = sender.send(event);
            };
            match ControlConnection::connect(&self.entry(name), role, "test", sink) {
                Ok(control) => return (control, receiver),
                // The entry of a process start that has just ended.
                Err(_) if start.elapsed() < DEADLINE => std::thread::sleep(LOOK_PERIOD),
                Err(error) => panic!("{name}: {error}"),
            }
        }
    }

    pub fn status(&self, name: &str) -> Status {
        self.control(name, Role::Observer).0.status(DEADLINE).unwrap()
    }

    /// Waits until the status of `name` fulfils `wanted`.
    pub fn until(&self, name: &str, wanted: impl Fn(&Status) -> bool) -> Status {
        let (control, _events) = self.control(name, Role::Observer);
        let start = Instant::now();
        loop {
            let status = control.status(DEADLINE).unwrap();
            // Ports are declared one by one, a moment after the name is registered.
            if status.inputs.len() >= INPUTS && wanted(&status) {
                return status;
            }
            assert!(start.elapsed() < DEADLINE, "never in the wanted state: {status:#?}");
            std::thread::sleep(LOOK_PERIOD);
        }
    }

    /// Waits until `publisher` sends what it publishes to `subscriber`.
    pub fn until_linked(&self, publisher: &str, subscriber: &str) {
        self.until(publisher, is_linked_to(self.name(subscriber)));
    }

    pub fn terminate(&mut self, name: &str) {
        let full = self.name(name);
        let (control, _events) = self.control(name, Role::Launcher);
        control.send(&Command::Terminate).unwrap();
        let at = self.threads.iter().position(|(thread, _)| *thread == full).unwrap();
        self.threads.remove(at).1.join().unwrap();
    }
}

impl Drop for System {
    fn drop(&mut self) {
        // What cannot be asked to end ends with the process.
        for (name, thread) in std::mem::take(&mut self.threads) {
            let Ok(entry) = self.directory.find_process(&name, Duration::from_secs(1)) else {
                continue;
            };
            let control = ControlConnection::connect(&entry, Role::Launcher, "test", |_| {});
            let asked = control.is_ok_and(|control| {
                let asked = control.send(&Command::Terminate).is_ok();
                let start = Instant::now();
                while asked && !thread.is_finished() && start.elapsed() < DEADLINE {
                    std::thread::sleep(Duration::from_millis(1));
                }
                asked
            });
            assert!(
                !asked || thread.is_finished() || std::thread::panicking(),
                "{name} does not end"
            );
        }
    }
}

/// Whether a publisher sends what it publishes to `subscriber`. The link of a subscriber that was still
/// starting is paused at first, though the subscriber reports that it is connected.
pub fn is_linked_to(subscriber: String) -> impl Fn(&Status) -> bool {
    move |status| {
        let mut links = status.outputs.iter().flat_map(|output| &output.links);
        links.any(|link| link.to == subscriber && !link.paused)
    }
}

/// The next data that a probe receives.
#[track_caller]
pub fn data(probe: &Receiver<ProbeEvent>) -> (String, u64, u64) {
    loop {
        let received = probe.recv_timeout(DEADLINE);
        match received.expect("data in time") {
            ProbeEvent::Data { id, value, lost, .. } => return (id, value, lost),
            ProbeEvent::Call(_) | ProbeEvent::Parameter(..) | ProbeEvent::History(_) => {}
        }
    }
}

pub fn sample(value: u64, len: usize) -> Sample {
    Sample { value, bulk: Array::from(vec![value as u8; len]) }
}
