//! The office mission, and a test bench for the controller: the test decides whether components
//! obey.

use crate::controller::Controller;
use crate::event::{ControllerAction, ControllerEvent};
use crate::incoming_order::IncomingOrder;
use crate::order::{Giver, MissionOrder};
use crate::record::JournalRecord;
use crate::roster::{Doing, ProcessPresence};
use crate::terms::ComponentReport;
use crate::tests::simulation::draft::{DraftPlan, Way};
use armor_petri::PlaceId;
use armor_plan::{ComponentId, Plan, PlanBuilder};
use std::sync::Arc;
use std::time::Duration;

pub(super) const MS: Duration = Duration::from_millis(1);
pub(super) const SECOND: Duration = Duration::from_secs(1);

/// `explore` (explorer driver) -> `return` (homing driver) -> `home`, and `hold` (brake).
pub(super) struct Office {
    pub(super) plan: PlanBuilder,
    pub(super) explorer: ComponentId,
    pub(super) driver: ComponentId,
    pub(super) homing: ComponentId,
    pub(super) brake: ComponentId,
    pub(super) explore: PlaceId,
    pub(super) back: PlaceId,
    pub(super) home: PlaceId,
}

pub(super) fn office() -> Office {
    let mut plan = PlanBuilder { mission: "office".to_owned(), ..PlanBuilder::default() };
    let [explorer, driver, homing, brake] =
        ["explorer", "driver", "homing", "brake"].map(|name| plan.component(name, true));
    let explore = plan.place("explore", 1, &[explorer, driver]);
    let back = plan.place("return", 0, &[homing, driver]);
    let home = plan.place("home", 0, &[]);
    let hold = plan.place("hold", 0, &[brake]);
    plan.exclusives.push(vec![explorer, homing, brake]);
    (plan.goal, plan.safe) = (Some(home), Some(hold));
    Office { plan, explorer, driver, homing, brake, explore, back, home }
}

impl Office {
    /// The transition from `explore` to `return` that most tests begin with.
    pub(super) fn explored(&self) -> Way {
        Way {
            from: vec![self.explore],
            to: vec![self.back],
            on: Some((self.explorer, "done")),
            ..Way::default()
        }
    }

    pub(super) fn with(mut self, name: &str, way: Way) -> Self {
        self.plan.way(name, way);
        self
    }
}

pub(super) struct Bench {
    pub(super) plan: Arc<Plan>,
    pub(super) controller: Controller,
    pub(super) now: Duration,
    wanted: Vec<String>,
    pub(super) records: Vec<JournalRecord>,
    instances: u64,
    answers: Vec<String>,
    pub(super) request: u64,
    /// Why the host's clock may be wrong; `None` if it is trusted.
    pub(super) clock_doubts: Option<String>,
}

impl Bench {
    pub(super) fn of(office: Office) -> Self {
        Self::playing(office.plan.build().unwrap())
    }

    pub(super) fn playing(plan: Plan) -> Self {
        let plan = Arc::new(plan);
        let (controller, actions) = Controller::new(Arc::clone(&plan), Duration::ZERO);
        let mut bench = Self {
            plan,
            controller,
            now: Duration::ZERO,
            wanted: Vec::new(),
            records: Vec::new(),
            instances: 0,
            answers: Vec::new(),
            request: 0,
            clock_doubts: None,
        };
        bench.note(actions);
        bench
    }

    /// Begins the mission: all components are connected, and those of the initial places are
    /// active.
    pub(super) fn begun(office: Office) -> Self {
        let mut bench = Self::of(office);
        bench.everybody_appears();
        bench.obey();
        bench.wanted.clear();
        bench
    }

    /// Answers the controller's questions about a new version of the file.
    pub(super) fn judge(&mut self) {
        while let Some(question) = self.controller.question() {
            self.tell(question.answer(&|| self.clock_doubts.clone()));
        }
    }

    pub(super) fn everybody_appears(&mut self) {
        for component in self.plan.component_ids() {
            self.appears(component, Doing::Frozen, 0);
        }
    }

    pub(super) fn appears(&mut self, component: ComponentId, doing: Doing, activation: u64) {
        self.instances += 1;
        let instance = self.instances;
        self.tell(ControllerEvent::Appeared { component, instance });
        self.report_state(component, doing, activation);
    }

    pub(super) fn report_state(&mut self, component: ComponentId, doing: Doing, activation: u64) {
        let instance = self.controller.roster().of(component).instance;
        self.tell(ControllerEvent::StateReported {
            component,
            instance,
            doing,
            activation,
            controllable: true,
        });
    }

    /// Reports that it runs and lets no mission control it.
    pub(super) fn refuses_control(&mut self, component: ComponentId, doing: Doing) {
        let instance = self.controller.roster().of(component).instance;
        self.tell(ControllerEvent::StateReported {
            component,
            instance,
            doing,
            activation: 0,
            controllable: false,
        });
    }

    pub(super) fn reports(
        &mut self,
        component: ComponentId,
        activation: u64,
        report: ComponentReport,
    ) {
        let instance = self.controller.roster().of(component).instance;
        let serial = self.records.len() as u64 + 1;
        self.tell(ControllerEvent::Reported { component, instance, serial, activation, report });
    }

    pub(super) fn done(&mut self, component: ComponentId) {
        let activation = self.activation(component);
        self.reports(component, activation, ComponentReport::Done);
    }

    pub(super) fn gone(&mut self, component: ComponentId) {
        self.tell(ControllerEvent::Gone { component, instance: None });
    }

    /// Sends an order of `author` and returns the answer. Each author has a process of their own.
    pub(super) fn orders(&mut self, author: &str, order: MissionOrder) -> String {
        self.request += 1;
        self.orders_as(author, self.request, false, order)
    }

    /// Sends an order that takes the lease from its holder.
    pub(super) fn takes_over(&mut self, author: &str, order: MissionOrder) -> String {
        self.request += 1;
        self.orders_as(author, self.request, true, order)
    }

    /// Sends an order with the given request number; returns the answer that the operator receives.
    pub(super) fn orders_as(
        &mut self,
        author: &str,
        request: u64,
        take: bool,
        order: MissionOrder,
    ) -> String {
        let instance = u64::from(author.as_bytes()[0]);
        let by = Giver { author: author.to_owned(), from: format!("tool-{author}"), instance };
        self.tell(ControllerEvent::Ordered(IncomingOrder {
            connection: instance,
            request,
            by,
            take,
            order,
        }));
        if let Some(question) = self.controller.move_question() {
            // A plan without a file cannot be proven.
            let answer = match self.plan.version().files.is_empty() {
                true => ControllerEvent::MoveJudged { serial: question.serial, verdict: Ok(()) },
                false => question.answer(),
            };
            self.tell(answer);
        }
        self.answers.pop().expect("every order is answered")
    }

    /// Takes the answers that operators received without having sent an order.
    pub(super) fn unasked(&mut self) -> Vec<String> {
        std::mem::take(&mut self.answers)
    }

    /// Ends the connection of `author`.
    pub(super) fn leaves(&mut self, author: &str) {
        self.tell(ControllerEvent::OperatorLeft { connection: u64::from(author.as_bytes()[0]) });
    }

    /// Restarts the executive from its journal, as after a kill.
    pub(super) fn restarts(&mut self) {
        let (plan, now) = (Arc::clone(&self.plan), self.now);
        let (controller, actions) = Controller::resume(plan, &self.records, now).unwrap();
        self.controller = controller;
        self.note(actions);
    }

    pub(super) fn tell(&mut self, event: ControllerEvent) {
        let actions = self.controller.handle(event, self.now);
        self.note(actions);
    }

    pub(super) fn pass(&mut self, time: Duration) {
        let until = self.now + time;
        while let Some(due) = self.controller.next_deadline().filter(|due| *due <= until) {
            self.now = self.now.max(due);
            self.tell(ControllerEvent::Timer);
        }
        self.now = until;
    }

    /// Confirms commands until none is open. One at a time, since each confirmation may bring new
    /// ones.
    pub(super) fn obey(&mut self) {
        for component in self.plan.component_ids() {
            let observed = self.controller.roster().of(component);
            let (order, commanded) = (observed.order, observed.commanded);
            let Some(order) = order.filter(|_| observed.presence == ProcessPresence::Here) else {
                continue;
            };
            let doing = if order.stop { Doing::Frozen } else { Doing::Active };
            self.report_state(component, doing, commanded);
            let obeyed = self.controller.roster().of(component).order != Some(order);
            if obeyed {
                self.obey();
            }
            return;
        }
    }

    pub(super) fn note(&mut self, actions: Vec<ControllerAction>) {
        for action in actions {
            let name = |c: ComponentId| self.plan.component(c).name.as_str();
            match action {
                ControllerAction::Journal(record) => self.records.push(record),
                ControllerAction::Activate { component, .. } => {
                    self.wanted.push(format!("activate {}", name(component)));
                }
                ControllerAction::Freeze { component, .. } => {
                    self.wanted.push(format!("freeze {}", name(component)));
                }
                ControllerAction::Kill { component } => {
                    self.wanted.push(format!("kill {}", name(component)));
                }
                ControllerAction::Finished(outcome) => self.wanted.push(format!("{outcome:?}")),
                ControllerAction::Answer { accepted, text, .. } => {
                    let verdict = if accepted { "accepted" } else { "refused" };
                    self.answers.push(format!("{verdict}: {text}"));
                }
                ControllerAction::Acknowledge { .. }
                | ControllerAction::Publish
                | ControllerAction::Judge
                | ControllerAction::JudgeMove
                | ControllerAction::Changed => {}
            }
        }
    }

    /// Takes the commands that the controller has given since the last call.
    pub(super) fn wanted(&mut self) -> Vec<String> {
        std::mem::take(&mut self.wanted)
    }

    pub(super) fn marked(&self) -> Vec<String> {
        self.controller.marking(0.0).places.into_iter().map(|marked| marked.place).collect()
    }

    pub(super) fn activation(&self, component: ComponentId) -> u64 {
        self.controller.ledger().activation(component).number
    }
}
