use armor_sdk::control::{LinkStatus, OutputStatus, RunState, Status};

use super::*;

fn entry(name: &str, instance: u64) -> ComponentEntry {
    ComponentEntry {
        name: name.into(),
        kind: if name == CONFIGD { CONFIGD } else { "probe" }.into(),
        instance,
        pid: 7,
        host: "here".into(),
        endpoint: "127.0.0.1:1".into(),
    }
}

fn status(name: &str, state: RunState, uptime_s: f64) -> Status {
    Status {
        name: name.into(),
        kind: "probe".into(),
        state,
        activation: 1,
        controllable: true,
        uptime_s,
        exec_calls: 0,
        clock_offset_s: 0.0,
        clock_error_s: None,
        last_error: String::new(),
        outputs: Vec::new(),
        inputs: Vec::new(),
    }
}

/// A picture and its time, moved by hand.
#[derive(Default)]
struct Scene {
    picture: Picture,
    now: Duration,
}

impl Scene {
    fn tell(&mut self, event: Event) -> Vec<Action> {
        self.picture.handle(event, self.now).1
    }

    fn after(&mut self, time: Duration) -> Vec<Action> {
        self.now += time;
        self.tell(Event::Tick)
    }

    fn said(&mut self, name: &str, instance: u64, answer: Answer) -> bool {
        self.picture.handle(Event::Said(name.into(), instance, answer), self.now).0
    }

    fn appears(&mut self, name: &str, instance: u64) -> Vec<Action> {
        self.tell(Event::Registry(Change::Appeared(entry(name, instance))))
    }

    fn is(&self, name: &str) -> Condition {
        self.picture.processes[name].condition
    }

    /// A process that is connected and in this state.
    fn with(name: &str, state: RunState) -> Self {
        let mut scene = Self::default();
        assert_eq!(scene.appears(name, 1), [Action::Connect(entry(name, 1))]);
        scene.tell(Event::Connected(name.into(), 1));
        scene.said(name, 1, Answer::State { state, activation: 1, controllable: true });
        scene
    }
}

#[test]
fn a_process_shows_what_it_says_of_itself() {
    for state in
        [RunState::Starting, RunState::Frozen, RunState::Active, RunState::Done, RunState::Failed]
    {
        assert_eq!(Scene::with("laser", state).is("laser"), state.into());
    }
}

#[test]
fn who_is_silent_is_suspected_and_looked_for_until_it_answers_again() {
    let mut scene = Scene::with("laser", RunState::Active);
    scene.tell(Event::Closed("laser".into(), 1, "it fell silent".into()));
    assert_eq!(scene.is("laser"), Condition::Suspected);
    assert_eq!(scene.picture.processes["laser"].problem, "it fell silent");
    assert_eq!(scene.after(RETRY), [Action::Connect(entry("laser", 1))]);
    assert_eq!(scene.after(RETRY * 3), [], "one attempt at a time");
    scene.tell(Event::Connected("laser".into(), 1));
    let state = Answer::State { state: RunState::Frozen, activation: 1, controllable: true };
    scene.said("laser", 1, state);
    assert_eq!(scene.is("laser"), Condition::Frozen);
    assert_eq!(scene.picture.processes["laser"].problem, "");
}

#[test]
fn who_has_gone_is_expected_back_for_a_while_and_then_dead() {
    let mut scene = Scene::with("laser", RunState::Active);
    let gone = scene.tell(Event::Registry(Change::Gone(entry("laser", 1))));
    assert_eq!(gone, [Action::Drop("laser".into(), 1)]);
    scene.tell(Event::Closed("laser".into(), 1, "it closed the connection".into()));
    assert_eq!(scene.is("laser"), Condition::Restarting);
    scene.after(DEAD_AFTER - Duration::from_millis(1));
    assert_eq!(scene.is("laser"), Condition::Restarting);
    scene.after(Duration::from_millis(1));
    assert_eq!(scene.is("laser"), Condition::Dead);
    scene.appears("laser", 2);
    assert_eq!(
        (scene.is("laser"), scene.picture.processes["laser"].starts),
        (Condition::Unknown, 2)
    );
}

#[test]
fn what_is_told_of_an_earlier_start_changes_nothing() {
    let mut scene = Scene::with("laser", RunState::Active);
    let actions = scene.appears("laser", 2);
    assert_eq!(actions, [Action::Drop("laser".into(), 1), Action::Connect(entry("laser", 2))]);
    scene.tell(Event::Registry(Change::Gone(entry("laser", 1))));
    scene.tell(Event::Closed("laser".into(), 1, "it closed the connection".into()));
    let state = Answer::State { state: RunState::Failed, activation: 1, controllable: true };
    assert!(!scene.said("laser", 1, state));
    assert_eq!(scene.is("laser"), Condition::Unknown);
}

#[test]
fn everybody_that_can_be_asked_is_asked_once_a_second() {
    let mut scene = Scene::with("laser", RunState::Active);
    scene.appears(CONFIGD, 3);
    assert_eq!(scene.is(CONFIGD), Condition::Active, "it is there, and says no more");
    let ask = [Action::Ask("laser".into(), 1)];
    assert_eq!(scene.after(Duration::ZERO), ask);
    assert_eq!(scene.after(ASK_EVERY / 2), []);
    assert_eq!(scene.picture.next_tick(), ASK_EVERY);
    assert_eq!(scene.after(ASK_EVERY / 2), ask);
}

#[test]
fn beats_are_no_news_but_for_a_long_call() {
    let mut scene = Scene::with("laser", RunState::Active);
    let beat = |call_s| Answer::Beat { call_s };
    assert!(!scene.said("laser", 1, beat(0.0)));
    assert!(!scene.said("laser", 1, beat(LONG_CALL_S / 2.0)));
    assert!(scene.said("laser", 1, beat(2.0)));
    assert_eq!(scene.picture.processes["laser"].call_s, Some(2.0));
    assert!(scene.said("laser", 1, beat(0.0)));
    assert_eq!(scene.picture.processes["laser"].call_s, None);
}

#[test]
fn a_connection_that_ended_before_it_was_told_of_is_made_again() {
    let mut scene = Scene::default();
    scene.appears("laser", 1);
    scene.tell(Event::Closed("laser".into(), 1, "it closed the connection".into()));
    let dropped = scene.tell(Event::Connected("laser".into(), 1));
    assert_eq!(dropped, [Action::Drop("laser".into(), 1)]);
    assert_eq!(scene.is("laser"), Condition::Suspected);
    assert!(scene.after(RETRY).contains(&Action::Connect(entry("laser", 1))));
}

#[test]
fn a_restarted_registry_tells_of_all_again_and_that_is_no_news() {
    let mut scene = Scene::with("laser", RunState::Active);
    scene.tell(Event::Registry(Change::RegistryLost));
    assert!(!scene.picture.is_found && !scene.picture.has_ended(), "links live on");
    scene.tell(Event::Registry(Change::RegistryFound));
    assert_eq!(scene.appears("laser", 1), []);
    assert_eq!((scene.is("laser"), scene.picture.is_found), (Condition::Active, true));
}

#[test]
fn a_system_has_ended_when_nobody_is_heard_and_nobody_says_who_is_there() {
    let mut scene = Scene::with("laser", RunState::Active);
    scene.appears(CONFIGD, 3);
    scene.tell(Event::Registry(Change::RegistryLost));
    assert!(!scene.picture.has_ended());
    scene.tell(Event::Closed("laser".into(), 1, "it closed the connection".into()));
    assert!(scene.picture.has_ended());
    assert_eq!(scene.after(RETRY), [Action::Connect(entry("laser", 1))]);
    assert_eq!(scene.is(CONFIGD), Condition::Dead);
    scene.tell(Event::Closed("laser".into(), 1, "nobody listens there".into()));
    while scene.is("laser") == Condition::Suspected {
        for action in scene.after(RETRY) {
            assert_eq!(action, Action::Connect(entry("laser", 1)));
            scene.tell(Event::Closed("laser".into(), 1, "nobody listens there".into()));
        }
        assert!(scene.now < DEAD_AFTER * 2);
    }
    assert_eq!(scene.is("laser"), Condition::Dead);
    assert_eq!(scene.after(RETRY), [], "nobody is looked for any more");
}

#[test]
fn the_links_of_who_has_gone_are_not_shown() {
    let mut scene = Scene::with("laser", RunState::Active);
    let mut said = status("laser", RunState::Active, 1.0);
    said.inputs.push(armor_sdk::control::InputStatus {
        id: "in".into(),
        data: "sim.out".into(),
        connected: true,
        received: 1,
        waiting: 0,
        lost: 0,
        dropped: 0,
        connections: 1,
        problem: String::new(),
    });
    scene.said("laser", 1, Answer::Status { request: 1, status: said });
    scene.picture.link();
    assert_eq!(scene.picture.links.len(), 1);
    scene.tell(Event::Registry(Change::Gone(entry("laser", 1))));
    scene.picture.link();
    assert_eq!(scene.picture.links, []);
}

#[test]
fn the_links_of_a_system_that_has_ended_are_those_that_it_had() {
    let mut scene = Scene::default();
    let link = LinkStatus {
        to: "map".into(),
        keep: armor_wire::keep::Keep::Last { count: 10 },
        sent: 7,
        dropped: 0,
        queued: 0,
        paused: false,
    };
    let output = OutputStatus {
        id: "scan".into(),
        data: "laser.scan".into(),
        type_name: "LaserScan".into(),
        published: 7,
        links: vec![link],
    };
    scene.appears("laser", 1);
    scene.tell(Event::Connected("laser".into(), 1));
    let status = Status { outputs: vec![output], ..status("laser", RunState::Active, 1.0) };
    scene.said("laser", 1, Answer::Status { request: 1, status });
    scene.picture.link();
    assert_eq!(scene.picture.links.len(), 1);
    scene.tell(Event::Registry(Change::Gone(entry("laser", 1))));
    scene.picture.link();
    assert_eq!(scene.picture.links.len(), 0, "it may come back and link again");
    scene.tell(Event::Registry(Change::RegistryLost));
    scene.picture.link();
    assert!(scene.picture.has_ended());
    assert_eq!(scene.picture.links[0].sent, 7);
}

#[test]
fn configd_is_one_process_under_two_names() {
    let mut scene = Scene::default();
    scene.appears(CONFIGURATION, 1);
    assert!(!scene.picture.is_second_name(CONFIGURATION), "configd is not there yet");
    scene.appears(CONFIGD, 2);
    scene.appears("laser", 3);
    assert!(scene.picture.is_second_name(CONFIGURATION));
    assert!(!scene.picture.is_second_name(CONFIGD) && !scene.picture.is_second_name("laser"));
}
