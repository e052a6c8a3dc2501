//! The true state of the simulated components, which may differ from what the executive knows:
//! processes that start, work, report, hang and die, on a network with delays.

use super::dice::Dice;
use crate::event::ControllerEvent;
use crate::roster::Doing;
use crate::terms::ComponentReport;
use armor_plan::{ComponentId, GivenValue, Plan};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// How many faults occur, and which.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trouble {
    /// Each fault occurs once in this many cases; 0 means never.
    pub(crate) one_in: usize,
    /// Whether the executive may not learn that a killed process has ended.
    pub(crate) blind: bool,
}

#[derive(Clone, Debug)]
pub(crate) enum Command {
    Activate(u64, Vec<GivenValue>),
    Freeze(u64),
    Acknowledge(u64),
}

#[derive(Clone, Debug)]
enum Happening {
    /// A process starts.
    Boot(ComponentId),
    /// A process has received its settings.
    Ready(ComponentId, u64),
    /// The executive connects to a process.
    Connect(ComponentId, u64),
    Arrives {
        component: ComponentId,
        connection: u64,
        command: Command,
    },
    Event {
        connection: u64,
        event: ControllerEvent,
    },
    /// A process that was frozen has finished its last call.
    Rested {
        component: ComponentId,
        instance: u64,
        activation: u64,
    },
    Reports {
        component: ComponentId,
        instance: u64,
        activation: u64,
        report: ComponentReport,
    },
    Dies(ComponentId, u64),
    Cut(ComponentId, u64),
    /// The connection breaks because the process died; the executive is not informed of the death.
    Severed(ComponentId, u64),
    KnownDead(ComponentId, u64),
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Process {
    pub(crate) instance: u64,
    pub(crate) alive: bool,
    ready: bool,
    pub(crate) active: bool,
    pub(crate) done: bool,
    pub(crate) activation: u64,
    /// The parameter values of that activation.
    pub(crate) values: Vec<GivenValue>,
    hung: bool,
    /// The process is never started again.
    buried: bool,
    connection: u64,
    connected: bool,
    unacknowledged: BTreeMap<u64, (u64, ComponentReport)>,
    reports: u64,
    /// When the last message in each direction arrives; a later message must not overtake it.
    down: Duration,
    up: Duration,
}

pub(crate) struct World {
    plan: Arc<Plan>,
    pub(crate) dice: Dice,
    pub(crate) now: Duration,
    pub(crate) trouble: Trouble,
    pub(crate) processes: Vec<Process>,
    queue: BTreeMap<(Duration, u64), Happening>,
    counter: u64,
    /// The number of the executive's current start; 0 while it is dead.
    life: u64,
    lives: u64,
}

impl World {
    pub(crate) fn new(plan: Arc<Plan>, dice: Dice, trouble: Trouble) -> Self {
        let mut world = Self {
            processes: vec![Process::default(); plan.components().len()],
            plan,
            dice,
            now: Duration::ZERO,
            trouble,
            queue: BTreeMap::new(),
            counter: 0,
            life: 0,
            lives: 0,
        };
        for component in world.plan.component_ids() {
            if world.unlucky(30) {
                world.processes[component.index()].buried = true;
            } else {
                world.later(500, Happening::Boot(component));
            }
        }
        world
    }

    /// The executive starts or restarts, and connects to all processes.
    pub(crate) fn executive_starts(&mut self) {
        self.lives += 1;
        self.life = self.lives;
        for component in self.plan.component_ids() {
            let process = &self.processes[component.index()];
            let instance = process.instance;
            if process.alive {
                self.later(50, Happening::Connect(component, instance));
            } else if instance > 0 {
                self.later(50, Happening::KnownDead(component, instance));
            }
        }
    }

    pub(crate) fn executive_dies(&mut self) {
        self.life = 0;
        // Commands that were already sent still arrive, until another connection is made. Reports
        // to the dead executive are lost.
        for process in &mut self.processes {
            process.connected = false;
        }
        self.queue.retain(|_, happening| !matches!(happening, Happening::Event { .. }));
    }

    pub(crate) fn send(&mut self, component: ComponentId, command: Command) {
        let process = &self.processes[component.index()];
        let (connection, down) = (process.connection, process.down);
        let at = (self.now + self.dice.up_to_ms(20)).max(down);
        self.processes[component.index()].down = at;
        self.at(at, Happening::Arrives { component, connection, command });
    }

    pub(crate) fn kill(&mut self, component: ComponentId) {
        let process = &self.processes[component.index()];
        let instance = process.instance;
        if process.alive {
            self.later(100, Happening::Dies(component, instance));
        } else if !self.trouble.blind {
            self.later(100, Happening::KnownDead(component, instance));
        }
    }

    pub(crate) fn next_at(&self) -> Option<Duration> {
        self.queue.keys().next().map(|key| key.0)
    }

    /// Lets the next event happen; returns what the executive observes of it.
    pub(crate) fn happen(&mut self) -> Option<ControllerEvent> {
        let ((at, _), happening) = self.queue.pop_first()?;
        self.now = self.now.max(at);
        match happening {
            Happening::Boot(component) => self.boot(component),
            Happening::Ready(component, instance) => {
                if self.is(component, instance) {
                    self.ready(component, instance);
                }
            }
            Happening::Connect(component, instance) => self.connect(component, instance),
            Happening::Arrives { component, connection, command } => {
                let process = &self.processes[component.index()];
                if process.alive && process.connection == connection && !process.hung {
                    self.obey(component, command);
                }
            }
            Happening::Event { connection, event } => {
                return self.knows(connection).then_some(event);
            }
            Happening::Rested { component, instance, activation } => {
                let process = &mut self.processes[component.index()];
                if process.instance == instance && process.alive && process.activation == activation
                {
                    (process.active, process.done) = (false, false);
                    self.say(component);
                }
            }
            Happening::Reports { component, instance, activation, report } => {
                self.report(component, instance, activation, report);
            }
            Happening::Dies(component, instance) => self.die(component, instance),
            Happening::Cut(component, instance) => return self.cut(component, instance),
            Happening::Severed(component, instance) => {
                return (self.life != 0).then_some(ControllerEvent::Lost { component, instance });
            }
            Happening::KnownDead(component, instance) => {
                let known = self.life != 0;
                return known
                    .then_some(ControllerEvent::Gone { component, instance: Some(instance) });
            }
        }
        None
    }

    fn boot(&mut self, component: ComponentId) {
        self.counter += 1;
        let instance = self.counter;
        let old = &self.processes[component.index()];
        if old.buried || old.alive {
            return;
        }
        self.processes[component.index()] = Process { instance, alive: true, ..Process::default() };
        self.later(200, Happening::Ready(component, instance));
        self.later(100, Happening::Connect(component, instance));
        if self.unlucky(3) {
            self.later(20_000, Happening::Dies(component, instance));
        }
        if self.unlucky(4) {
            self.later(20_000, Happening::Cut(component, instance));
        }
    }

    fn ready(&mut self, component: ComponentId, instance: u64) {
        self.processes[component.index()].ready = true;
        if !self.plan.component(component).is_controlled() {
            // A component that no mission commands is always active, and may send a report.
            self.processes[component.index()].active = true;
            let report = self.random_report();
            self.later(9000, Happening::Reports { component, instance, activation: 0, report });
        }
        self.say(component);
    }

    fn connect(&mut self, component: ComponentId, instance: u64) {
        let (life, now) = (self.life, self.now);
        if life == 0 || !self.is(component, instance) {
            return;
        }
        self.counter += 1;
        let connection = self.counter;
        let process = &mut self.processes[component.index()];
        if process.connected {
            return;
        }
        (process.connection, process.connected) = (connection, true);
        (process.down, process.up) = (now, now);
        let unacknowledged = process.unacknowledged.clone();
        self.tell(component, ControllerEvent::Appeared { component, instance });
        self.say(component);
        for (serial, (activation, report)) in unacknowledged {
            self.tell(
                component,
                ControllerEvent::Reported { component, instance, serial, activation, report },
            );
        }
    }

    fn obey(&mut self, component: ComponentId, command: Command) {
        let process = &mut self.processes[component.index()];
        let instance = process.instance;
        match command {
            Command::Activate(activation, values) => {
                assert!(!process.active, "activated while active");
                (process.active, process.done, process.activation) = (true, false, activation);
                process.values = values;
                self.say(component);
                let reports = 1 + self.dice.roll(3);
                for _ in 0..reports {
                    let report = self.random_report();
                    self.later(
                        6000,
                        Happening::Reports { component, instance, activation, report },
                    );
                }
                if self.unlucky(8) {
                    self.processes[component.index()].hung = true;
                }
            }
            Command::Freeze(activation) => {
                let was = process.active;
                process.activation = process.activation.max(activation);
                let activation = process.activation;
                if !was {
                    return self.say(component);
                }
                let slow = if self.unlucky(6) { 5000 } else { 200 };
                self.later(slow, Happening::Rested { component, instance, activation });
            }
            Command::Acknowledge(serial) => {
                process.unacknowledged.remove(&serial);
            }
        }
    }

    fn random_report(&mut self) -> ComponentReport {
        match self.dice.roll(6) {
            0..3 => ComponentReport::Done,
            3 if self.trouble.one_in > 0 => {
                ComponentReport::Failed { reason: "for the test".to_owned() }
            }
            _ => {
                ComponentReport::Event { name: "seen".to_owned(), value: self.dice.roll(9) as f64 }
            }
        }
    }

    fn report(
        &mut self,
        component: ComponentId,
        instance: u64,
        activation: u64,
        report: ComponentReport,
    ) {
        if !self.is(component, instance) {
            return;
        }
        let process = &mut self.processes[component.index()];
        if !process.active || process.done || process.activation != activation || process.hung {
            return;
        }
        process.reports += 1;
        let serial = process.reports;
        process.unacknowledged.insert(serial, (activation, report.clone()));
        process.done = !matches!(report, ComponentReport::Event { .. });
        self.tell(
            component,
            ControllerEvent::Reported { component, instance, serial, activation, report },
        );
        self.say(component);
    }

    fn die(&mut self, component: ComponentId, instance: u64) {
        if !self.is(component, instance) {
            return;
        }
        let buried = self.unlucky(5);
        let process = &mut self.processes[component.index()];
        (process.alive, process.active, process.done) = (false, false, false);
        (process.connected, process.connection, process.buried) = (false, 0, buried);
        let blind = self.trouble.blind && self.dice.one_in(3);
        let known = if blind { Happening::Severed } else { Happening::KnownDead };
        self.later(100, known(component, instance));
        self.later(3000, Happening::Boot(component));
    }

    fn cut(&mut self, component: ComponentId, instance: u64) -> Option<ControllerEvent> {
        if !self.is(component, instance) || !self.processes[component.index()].connected {
            return None;
        }
        let process = &mut self.processes[component.index()];
        (process.connected, process.connection) = (false, 0);
        self.later(2000, Happening::Connect(component, instance));
        Some(ControllerEvent::Lost { component, instance })
    }

    /// Reports the component's state to the executive, if it is connected.
    fn say(&mut self, component: ComponentId) {
        let process = &self.processes[component.index()];
        let doing = match (process.ready, process.active) {
            (false, _) => Doing::Starting,
            (true, true) => Doing::Active,
            (true, false) => Doing::Frozen,
        };
        let (instance, activation) = (process.instance, process.activation);
        let event = ControllerEvent::StateReported {
            component,
            instance,
            doing,
            activation,
            controllable: true,
        };
        self.tell(component, event);
    }

    fn tell(&mut self, component: ComponentId, event: ControllerEvent) {
        let process = &self.processes[component.index()];
        if !process.connected {
            return;
        }
        let (connection, up) = (process.connection, process.up);
        let at = (self.now + self.dice.up_to_ms(20)).max(up);
        self.processes[component.index()].up = at;
        self.at(at, Happening::Event { connection, event });
    }

    fn knows(&self, connection: u64) -> bool {
        self.life != 0 && self.processes.iter().any(|p| p.connected && p.connection == connection)
    }

    fn is(&self, component: ComponentId, instance: u64) -> bool {
        let process = &self.processes[component.index()];
        process.alive && process.instance == instance
    }

    /// Draws whether a fault occurs that is `rarity` times rarer than the basic one.
    fn unlucky(&mut self, rarity: usize) -> bool {
        self.trouble.one_in > 0 && self.dice.one_in(self.trouble.one_in * rarity)
    }

    fn later(&mut self, most_ms: usize, happening: Happening) {
        let at = self.now + self.dice.up_to_ms(most_ms);
        self.at(at, happening);
    }

    fn at(&mut self, at: Duration, happening: Happening) {
        self.counter += 1;
        self.queue.insert((at, self.counter), happening);
    }
}
