//! What a drawn mission does when something fails at a random moment: the executive's state machine plays it
//! over components that are simulated here, without processes and without a clock. Robots drive straight to
//! the point that their mover is given; reports and confirmations take a random time.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use armor_executive::order::{Giver, MissionOrder};
use armor_executive::{
    ComponentReport, Controller, ControllerAction, ControllerEvent, Doing, IncomingOrder,
    MissionOutcome,
};
use armor_geo::{Clearance, MapPoint, MapSegment};
use armor_plan::{ComponentId, Plan, WatchId};
use armor_robotfile::guard::Scalar;
use armor_robotfile::site_map::{SiteMap, ZoneKind};

use crate::dice::{Dice, seed};

/// Two robots meet; before that the crane of the first works, after it the crane of the second, and the two
/// exclude each other. A pit lies between the routes, and a pond next to the second one.
const DRAWN: &str = r#"<armor version="1">
  <system name="two-carts">
    <component name="red-way" kind="patrol"/>
    <component name="red-crane" kind="patrol"/>
    <component name="red-battery" kind="patrol"/>
    <component name="blue-way" kind="patrol"/>
    <component name="blue-crane" kind="patrol"/>
    <component name="blue-battery" kind="patrol"/>
  </system>
  <mission name="cranes" goal="over" safe="hold">
    <map>
      <point name="A" at="0 0"/>
      <point name="B" at="12 0"/>
      <point name="C" at="12 8"/>
      <point name="D" at="0 20"/>
      <point name="E" at="12 20"/>
      <zone name="pit" kind="no-go" margin="0.5m" shape="2,4 8,4 8,10 2,10"/>
      <zone name="pond" kind="no-go" margin="0.5m" shape="circle 6,25 2m"/>
      <rally name="R1" at="6 -4"/>
      <rally name="R2" at="16 4"/>
      <rally name="R3" at="6 16"/>
    </map>
    <variable name="red-charge" source="red-battery.percentage" min="0" max="1"/>
    <variable name="blue-charge" source="blue-battery.percentage" min="0" max="1"/>
    <route name="red" mover="red-way.route" start="A" out="over" radius="0.4m" patience="40s" rally-by="1min">
      <leg name="l1" to="B" by="30s" components="red-crane"/>
      <leg name="l2" to="C" by="25s"/>
      <meet name="m1" with="blue" patience="50s"/>
      <stay name="s1" for="5s"/>
      <leg name="l3" to="B" by="25s"/>
      <otherwise on="lost-link blocked late recall" do="rally"/>
      <otherwise name="weak" when="red-charge &lt; 30%" do="rally"/>
    </route>
    <route name="blue" mover="blue-way.route" start="D" out="over" radius="0.4m" patience="40s" rally-by="1min">
      <leg name="b1" to="E" by="30s"/>
      <meet name="m1" with="red" patience="50s"/>
      <leg name="b2" to="D" by="30s" components="blue-crane"/>
      <otherwise on="lost-link blocked late recall" do="rally"/>
      <otherwise name="weak" when="blue-charge &lt; 30%" do="rally"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
    <exclusive components="red-crane blue-crane"/>
    <check>never active(red-crane) and active(blue-crane)</check>
  </mission>
</armor>
"#;

/// Time between two looks at the robots.
const STEP: Duration = Duration::from_millis(20);
/// A mission that is not over within this time hangs.
const LATEST: Duration = Duration::from_secs(600);
/// The speed that a robot keeps, in metres per second, and how much it differs from run to run.
const SPEED_MPS: f64 = 0.8;
/// Without a fault the mission takes a little longer than this.
const FAULTS_WITHIN_MS: usize = 40_000;
const RADIUS_M: f64 = 0.4;
/// How near to a rally point a robot is that reports to be there.
const ARRIVED_M: f64 = 0.05;

/// What fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    Link,
    Battery,
    Path,
    /// The robot stands still for a time, so that it is late.
    Time,
    /// The robot is suddenly elsewhere: not one that is drawn, but shows that what must be true is looked at.
    Strays,
}

const FAULTS: [Fault; 4] = [Fault::Link, Fault::Battery, Fault::Path, Fault::Time];

/// A component as it truly is.
#[derive(Clone, Copy, Debug, Default)]
struct Simulated {
    is_active: bool,
    activation: u64,
    serial: u64,
}

struct Robot {
    name: &'static str,
    mover: ComponentId,
    at: MapPoint,
    to: Option<MapPoint>,
    speed_mps: f64,
    stands_until: Duration,
    fails_path: bool,
}

/// What happens later.
enum Coming {
    Event(ControllerEvent),
    /// The component carries out a command, and then confirms it.
    Starts(ComponentId, u64, Option<MapPoint>),
    Stops(ComponentId, u64),
    Fails(Fault, usize),
}

struct World {
    controller: Controller,
    plan: Arc<Plan>,
    now: Duration,
    dice: Dice,
    components: BTreeMap<ComponentId, Simulated>,
    coming: Vec<(Duration, Coming)>,
    robots: [Robot; 2],
    outcome: Option<MissionOutcome>,
}

fn plan() -> (Plan, SiteMap) {
    let read = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(DRAWN.as_bytes().to_vec()));
    let checked = armor_robotfile::check(read, &[], None);
    assert!(checked.is_valid(), "{}", checked.findings.render(armor_robotfile::Colours::No));
    let configuration = checked.configuration.expect("a configuration");
    let plan = Plan::of(&configuration).expect("a plan").expect("a mission");
    let proven = armor_proof::prove(&configuration, &plan, &|| false);
    let errors: Vec<_> = proven
        .into_iter()
        .filter(|finding| finding.severity() == armor_robotfile::Severity::Error)
        .map(|finding| finding.message)
        .collect();
    assert!(errors.is_empty(), "{errors:?}");
    let map = configuration.mission.and_then(|mission| mission.map).expect("a map");
    (plan, map)
}

impl World {
    fn new(plan: Plan, map: &SiteMap, mut dice: Dice) -> Self {
        let plan = Arc::new(plan);
        let (controller, actions) = Controller::new(Arc::clone(&plan), Duration::ZERO);
        let robot = |name: &'static str, start: &str, speed_mps| Robot {
            name,
            mover: component_named(&plan, &format!("{name}-way")),
            at: map.find_point(start).expect("the start").position.value.point,
            to: None,
            speed_mps,
            stands_until: Duration::ZERO,
            fails_path: false,
        };
        let mut speed = || SPEED_MPS * (0.9 + 0.2 * dice.throw(1_000) as f64 / 1_000.0);
        let robots = [robot("red", "A", speed()), robot("blue", "D", speed())];
        let components = plan.component_ids().map(|id| (id, Simulated::default())).collect();
        let mut world = Self {
            controller,
            plan,
            now: Duration::ZERO,
            dice,
            components,
            coming: Vec::new(),
            robots,
            outcome: None,
        };
        world.take(actions);
        for component in world.plan.component_ids() {
            world.tell(ControllerEvent::Appeared { component, instance: 1 });
            world.confirm(component);
        }
        for number in 0..world.plan.watches().len() {
            world.charge(number, 0.9);
        }
        world.order(MissionOrder::Lease);
        world
    }

    fn charge(&mut self, watch: usize, value: f64) {
        let watch = WatchId(u32::try_from(watch).expect("few watches"));
        self.tell(ControllerEvent::Sensed { watch, value: Some(Scalar::Number(value)) });
    }

    fn order(&mut self, order: MissionOrder) {
        let by = Giver { author: "ruth".into(), from: "tool-ruth".into(), instance: 7 };
        let (connection, request) = (7, 1);
        self.tell(ControllerEvent::Ordered(IncomingOrder {
            connection,
            request,
            by,
            take: false,
            order,
        }));
    }

    fn tell(&mut self, event: ControllerEvent) {
        let actions = self.controller.handle(event, self.now);
        self.take(actions);
    }

    fn confirm(&mut self, component: ComponentId) {
        let Simulated { is_active, activation, .. } = self.components[&component];
        self.tell(ControllerEvent::StateReported {
            component,
            instance: 1,
            doing: if is_active { Doing::Active } else { Doing::Frozen },
            activation,
            controllable: true,
        });
    }

    /// After a random time, as of a process on a busy host.
    fn later(&mut self, what: Coming) {
        let delay = Duration::from_millis(5 + self.dice.throw(300) as u64);
        self.coming.push((self.now + delay, what));
    }

    fn take(&mut self, actions: Vec<ControllerAction>) {
        for action in actions {
            match action {
                ControllerAction::Activate { component, activation, values } => {
                    let route = values.iter().find(|value| value.parameter == "route");
                    let to = route.map(|route| {
                        let (x, y) = route.text.split_once(',').expect("a point");
                        let number = |text: &str| text.parse().expect("a number");
                        MapPoint::new(number(x), number(y)).expect("a point")
                    });
                    self.later(Coming::Starts(component, activation, to));
                }
                ControllerAction::Freeze { component, activation } => {
                    self.later(Coming::Stops(component, activation));
                }
                ControllerAction::Kill { component } => {
                    panic!("{} is killed", self.plan.component(component).name)
                }
                ControllerAction::Finished(outcome) => self.outcome = Some(outcome),
                _ => {}
            }
        }
    }

    fn happen(&mut self, what: Coming) {
        match what {
            Coming::Event(event) => self.tell(event),
            Coming::Starts(component, activation, to) => {
                if let Some(state) = self.components.get_mut(&component) {
                    (state.is_active, state.activation) = (true, activation);
                }
                for robot in self.robots.iter_mut().filter(|robot| robot.mover == component) {
                    robot.to = to;
                }
                self.confirm(component);
            }
            Coming::Stops(component, activation) => {
                if let Some(state) = self.components.get_mut(&component) {
                    (state.is_active, state.activation) = (false, activation);
                }
                for robot in self.robots.iter_mut().filter(|robot| robot.mover == component) {
                    robot.to = None;
                }
                self.confirm(component);
            }
            Coming::Fails(fault, number) => match fault {
                Fault::Link => self.tell(ControllerEvent::OperatorLeft { connection: 7 }),
                Fault::Battery => self.charge(number, 0.2),
                Fault::Path => self.robots[number].fails_path = true,
                Fault::Strays => {
                    self.robots[number].at = MapPoint::new(5.0, 7.0).expect("a point in the pit");
                }
                Fault::Time => {
                    let stands = Duration::from_millis(5_000 + self.dice.throw(80_000) as u64);
                    self.robots[number].stands_until = self.now + stands;
                }
            },
        }
    }

    /// Lets time pass by one step.
    fn pass(&mut self) {
        self.now += STEP;
        let due: Vec<usize> =
            (0..self.coming.len()).filter(|number| self.coming[*number].0 <= self.now).collect();
        let mut due: Vec<_> = due.into_iter().rev().map(|it| self.coming.remove(it)).collect();
        due.sort_by_key(|(at, _)| *at);
        for (_, what) in due {
            self.happen(what);
        }
        for number in 0..self.robots.len() {
            self.drive(number);
        }
        if self.controller.next_deadline().is_some_and(|due| due <= self.now) {
            self.tell(ControllerEvent::Timer);
        }
    }

    fn drive(&mut self, number: usize) {
        let now = self.now;
        let robot = &mut self.robots[number];
        let Some(to) = robot.to.filter(|_| robot.stands_until <= now) else { return };
        let report = if robot.fails_path {
            robot.fails_path = false;
            ComponentReport::Failed { reason: "no path".into() }
        } else {
            let left_m = robot.at.distance_m(to);
            let step_m = robot.speed_mps * STEP.as_secs_f64();
            if left_m > step_m {
                let share = step_m / left_m;
                let mix = |from: f64, to: f64| from + (to - from) * share;
                let (x_m, y_m) = (mix(robot.at.x_m(), to.x_m()), mix(robot.at.y_m(), to.y_m()));
                robot.at = MapPoint::new(x_m, y_m).expect("a point");
                return;
            }
            robot.at = to;
            ComponentReport::Done
        };
        robot.to = None;
        let component = robot.mover;
        let Some(state) = self.components.get_mut(&component) else { return };
        state.serial += 1;
        let (serial, activation) = (state.serial, state.activation);
        self.later(Coming::Event(ControllerEvent::Reported {
            component,
            instance: 1,
            serial,
            activation,
            report,
        }));
    }

    fn is_marked(&self, name: &str) -> bool {
        let place = self.plan.place_named(name);
        place.is_some_and(|place| self.controller.ledger().marking()[place.index()] > 0)
    }

    /// The rally point at which the route waits, if it does.
    fn waits_at<'a>(&self, robot: &Robot, map: &'a SiteMap) -> Option<(&'a str, MapPoint)> {
        map.rallies.iter().find_map(|rally| {
            let name = &rally.name.value;
            let ending = format!(".at-{name}");
            let is_here = self.plan.place_ids().any(|id| {
                let place = self.plan.net().place(id);
                place.starts_with(&format!("{}.", robot.name))
                    && place.ends_with(&ending)
                    && self.controller.ledger().marking()[id.index()] > 0
            });
            is_here.then_some((name.as_str(), rally.position.value.point))
        })
    }
}

fn component_named(plan: &Plan, name: &str) -> ComponentId {
    let mut ids = plan.component_ids();
    ids.find(|id| plan.component(*id).name == name).expect("the component")
}

/// How the runs ended.
#[derive(Debug, Default)]
struct Tally {
    goals: usize,
    safe: usize,
    at_rally: usize,
    nearest_m: f64,
}

/// One run with random faults.
fn run(seed: u64, tally: &mut Tally) {
    let mut dice = Dice::of(seed);
    let mut faults = vec![FAULTS[dice.throw(4)]];
    if dice.throw(4) == 0 {
        faults.push(FAULTS[dice.throw(4)]);
    }
    let drawn: Vec<_> = faults
        .iter()
        .map(|fault| {
            (Duration::from_millis(dice.throw(FAULTS_WITHIN_MS) as u64), *fault, dice.throw(2))
        })
        .collect();
    run_with(seed, dice, &drawn, tally);
}

/// Everything that must be true is asserted in every step.
fn run_with(seed: u64, dice: Dice, drawn: &[(Duration, Fault, usize)], tally: &mut Tally) {
    let (plan, map) = plan();
    let cranes = ["red-crane", "blue-crane"].map(|name| component_named(&plan, name));
    let mut world = World::new(plan, &map, dice);
    for (at, fault, robot) in drawn {
        world.coming.push((*at, Coming::Fails(*fault, *robot)));
    }
    let radius = Clearance::new(RADIUS_M - 1e-6).expect("a length");
    let mut has_rallied = [false; 2];
    while world.outcome.is_none() {
        assert!(world.now < LATEST, "seed {seed}: the mission hangs after {drawn:?}");
        world.pass();
        let both = cranes.map(|crane| world.components[&crane].is_active);
        assert_ne!(both, [true, true], "seed {seed}: both cranes work after {drawn:?}");
        for (number, robot) in world.robots.iter().enumerate() {
            let here = MapSegment::new(robot.at, robot.at);
            for zone in map.zones.iter().filter(|zone| zone.kind == ZoneKind::NoGo) {
                let (name, robot_name) = (&zone.name.value, robot.name);
                assert!(
                    here.compare_distance(&zone.area.value, radius).is_gt(),
                    "seed {seed}: {robot_name} at {:?} is in {name} after {drawn:?}",
                    robot.at
                );
            }
            if let Some((name, at)) = world.waits_at(robot, &map) {
                has_rallied[number] = true;
                let away_m = robot.at.distance_m(at);
                tally.nearest_m = tally.nearest_m.max(away_m);
                assert!(
                    away_m <= ARRIVED_M,
                    "seed {seed}: {} waits {away_m} m from {name} after {drawn:?}",
                    robot.name
                );
            }
        }
    }
    // Over: all is frozen, in the goal or in the safe place, and no robot moves any more.
    let is_over = [MissionOutcome::Goal, MissionOutcome::Safe];
    assert!(is_over.contains(&world.outcome.expect("an outcome")), "seed {seed}: {drawn:?}");
    for robot in &world.robots {
        assert!(!world.components[&robot.mover].is_active, "seed {seed}: {} drives", robot.name);
    }
    match world.outcome {
        Some(MissionOutcome::Goal) => {
            assert!(world.is_marked("over"), "seed {seed}");
            tally.goals += 1;
        }
        _ => {
            assert!(world.is_marked("hold"), "seed {seed}: {drawn:?}");
            tally.safe += 1;
        }
    }
    tally.at_rally += has_rallied.iter().filter(|it| **it).count();
}

fn run_all(count: u64) {
    let first = seed(1);
    let mut tally = Tally::default();
    for number in 0..count {
        run(first + number, &mut tally);
    }
    let Tally { goals, safe, at_rally, nearest_m } = tally;
    println!(
        "faults: of {count} runs {goals} at the goal, {safe} in hold; {at_rally} robots reached their rally \
         point, at most {nearest_m:.3} m from it"
    );
    assert_eq!(goals + safe, count as usize);
    assert!(at_rally > 0);
}

#[test]
fn whatever_fails_a_robot_gets_to_its_rally_point_or_holds() {
    run_all(40);
}

#[test]
#[ignore = "the long form of the test above: 400 runs"]
fn four_hundred_random_faults() {
    run_all(400);
}

#[test]
#[should_panic(expected = "is in pit")]
fn a_robot_in_a_zone_is_found() {
    let strays = [(Duration::from_secs(9), Fault::Strays, 0)];
    run_with(1, Dice::of(1), &strays, &mut Tally::default());
}
