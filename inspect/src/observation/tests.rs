use armor_sdk::control::{CurrentCall, LinkStatus, OutputStatus, RunState, Status};

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
        skipped_ticks: 0,
        skipped_share: 0.0,
        clock_offset_s: 0.0,
        clock_error_s: None,
        last_error: String::new(),
        untaken_events: 0,
        time_s: 0.0,
        busy: false,
        call: None,
        outputs: Vec::new(),
        inputs: Vec::new(),
    }
}

/// A picture whose time the test sets.
#[derive(Default)]
struct Scene {
    picture: SystemPicture,
    now: Duration,
}

impl Scene {
    fn handle(&mut self, event: SystemEvent) -> Vec<ObserverAction> {
        self.picture.handle_event(event, self.now).1
    }

    fn pass_time(&mut self, time: Duration) -> Vec<ObserverAction> {
        self.now += time;
        self.handle(SystemEvent::Tick)
    }

    fn answer(&mut self, name: &str, instance: u64, answer: Answer) -> bool {
        self.picture.handle_event(SystemEvent::Answered(name.into(), instance, answer), self.now).0
    }

    fn register(&mut self, name: &str, instance: u64) -> Vec<ObserverAction> {
        self.handle(SystemEvent::Registry(DirectoryChange::Appeared(entry(name, instance))))
    }

    fn condition(&self, name: &str) -> Condition {
        self.picture.processes[name].condition
    }

    /// A process that is connected and in this state.
    fn with_process(name: &str, state: RunState) -> Self {
        let mut scene = Self::default();
        assert_eq!(scene.register(name, 1), [ObserverAction::Connect(entry(name, 1))]);
        scene.handle(SystemEvent::Connected(name.into(), 1));
        scene.answer(name, 1, Answer::State { state, activation: 1, controllable: true });
        scene
    }
}

#[test]
fn a_process_has_the_condition_that_it_reports() {
    for state in
        [RunState::Starting, RunState::Frozen, RunState::Active, RunState::Done, RunState::Failed]
    {
        assert_eq!(Scene::with_process("laser", state).condition("laser"), state.into());
    }
}

#[test]
fn a_silent_process_is_suspected_and_retried_until_it_answers() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    scene.handle(SystemEvent::Closed("laser".into(), 1, "it fell silent".into()));
    assert_eq!(scene.condition("laser"), Condition::Suspected);
    assert_eq!(scene.picture.processes["laser"].problem, "it fell silent");
    assert_eq!(scene.pass_time(RETRY), [ObserverAction::Connect(entry("laser", 1))]);
    assert_eq!(scene.pass_time(RETRY * 3), [], "one attempt at a time");
    scene.handle(SystemEvent::Connected("laser".into(), 1));
    let state = Answer::State { state: RunState::Frozen, activation: 1, controllable: true };
    scene.answer("laser", 1, state);
    assert_eq!(scene.condition("laser"), Condition::Frozen);
    assert_eq!(scene.picture.processes["laser"].problem, "");
}

#[test]
fn an_ended_process_counts_as_restarting_for_a_while_and_then_as_dead() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    let gone = scene.handle(SystemEvent::Registry(DirectoryChange::Gone(entry("laser", 1))));
    assert_eq!(gone, [ObserverAction::Drop("laser".into(), 1)]);
    scene.handle(SystemEvent::Closed("laser".into(), 1, "it closed the connection".into()));
    assert_eq!(scene.condition("laser"), Condition::Restarting);
    scene.pass_time(DEAD_AFTER - Duration::from_millis(1));
    assert_eq!(scene.condition("laser"), Condition::Restarting);
    scene.pass_time(Duration::from_millis(1));
    assert_eq!(scene.condition("laser"), Condition::Dead);
    scene.register("laser", 2);
    assert_eq!(
        (scene.condition("laser"), scene.picture.processes["laser"].starts),
        (Condition::Unknown, 2)
    );
}

#[test]
fn events_of_an_earlier_start_change_nothing() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    let actions = scene.register("laser", 2);
    assert_eq!(
        actions,
        [ObserverAction::Drop("laser".into(), 1), ObserverAction::Connect(entry("laser", 2))]
    );
    scene.handle(SystemEvent::Registry(DirectoryChange::Gone(entry("laser", 1))));
    scene.handle(SystemEvent::Closed("laser".into(), 1, "it closed the connection".into()));
    let state = Answer::State { state: RunState::Failed, activation: 1, controllable: true };
    assert!(!scene.answer("laser", 1, state));
    assert_eq!(scene.condition("laser"), Condition::Unknown);
}

#[test]
fn every_process_with_a_control_port_is_asked_once_a_second() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    scene.register(CONFIGD, 3);
    assert_eq!(
        scene.condition(CONFIGD),
        Condition::Active,
        "it is registered, and reports no state"
    );
    let ask = [ObserverAction::Ask("laser".into(), 1)];
    assert_eq!(scene.pass_time(Duration::ZERO), ask);
    assert_eq!(scene.pass_time(ASK_EVERY / 2), []);
    assert_eq!(scene.picture.next_tick(), ASK_EVERY);
    assert_eq!(scene.pass_time(ASK_EVERY / 2), ask);
}

#[test]
fn beats_change_nothing_except_for_a_long_call() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    let call = |call_s| Some(CurrentCall { function: "exec".into(), call_s });
    let beat = |call| Answer::Beat { call };
    assert!(!scene.answer("laser", 1, beat(None)));
    assert!(!scene.answer("laser", 1, beat(call(LONG_CALL_S / 2.0))));
    assert!(scene.answer("laser", 1, beat(call(2.0))));
    assert_eq!(scene.picture.processes["laser"].call, call(2.0));
    assert!(scene.answer("laser", 1, beat(None)));
    assert_eq!(scene.picture.processes["laser"].call, None);
}

#[test]
fn a_connection_that_ended_before_it_was_reported_is_retried() {
    let mut scene = Scene::default();
    scene.register("laser", 1);
    scene.handle(SystemEvent::Closed("laser".into(), 1, "it closed the connection".into()));
    let dropped = scene.handle(SystemEvent::Connected("laser".into(), 1));
    assert_eq!(dropped, [ObserverAction::Drop("laser".into(), 1)]);
    assert_eq!(scene.condition("laser"), Condition::Suspected);
    assert!(scene.pass_time(RETRY).contains(&ObserverAction::Connect(entry("laser", 1))));
}

#[test]
fn processes_that_a_restarted_registry_reports_again_are_not_new() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    scene.handle(SystemEvent::Registry(DirectoryChange::RegistryLost));
    assert!(!scene.picture.is_found && !scene.picture.has_ended(), "links live on");
    scene.handle(SystemEvent::Registry(DirectoryChange::RegistryFound));
    assert_eq!(scene.register("laser", 1), []);
    assert_eq!((scene.condition("laser"), scene.picture.is_found), (Condition::Active, true));
}

#[test]
fn a_system_has_ended_when_no_process_answers_and_the_registry_is_gone() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    scene.register(CONFIGD, 3);
    scene.handle(SystemEvent::Registry(DirectoryChange::RegistryLost));
    assert!(!scene.picture.has_ended());
    scene.handle(SystemEvent::Closed("laser".into(), 1, "it closed the connection".into()));
    assert!(scene.picture.has_ended());
    assert_eq!(scene.pass_time(RETRY), [ObserverAction::Connect(entry("laser", 1))]);
    assert_eq!(scene.condition(CONFIGD), Condition::Dead);
    scene.handle(SystemEvent::Closed("laser".into(), 1, "connection refused".into()));
    while scene.condition("laser") == Condition::Suspected {
        for action in scene.pass_time(RETRY) {
            assert_eq!(action, ObserverAction::Connect(entry("laser", 1)));
            scene.handle(SystemEvent::Closed("laser".into(), 1, "connection refused".into()));
        }
        assert!(scene.now < DEAD_AFTER * 2);
    }
    assert_eq!(scene.condition("laser"), Condition::Dead);
    assert_eq!(scene.pass_time(RETRY), [], "no process is retried any more");
}

#[test]
fn links_of_an_ended_process_are_not_shown() {
    let mut scene = Scene::with_process("laser", RunState::Active);
    let mut reported = status("laser", RunState::Active, 1.0);
    reported.inputs.push(armor_sdk::control::InputStatus {
        id: "in".into(),
        data: "sim.out".into(),
        connected: true,
        received: 1,
        waiting: 0,
        lost: 0,
        dropped: 0,
        skipped: 0,
        history_dropped: 0,
        connections: 1,
        problem: String::new(),
    });
    scene.answer("laser", 1, Answer::Status { request: 1, status: reported });
    scene.picture.rebuild_links();
    assert_eq!(scene.picture.links.len(), 1);
    scene.handle(SystemEvent::Registry(DirectoryChange::Gone(entry("laser", 1))));
    scene.picture.rebuild_links();
    assert_eq!(scene.picture.links, []);
}

#[test]
fn an_ended_system_keeps_the_links_that_it_had() {
    let mut scene = Scene::default();
    let link = LinkStatus {
        to: "map".into(),
        keep: armor_wire::keep::Keep::Last { count: 10 },
        sent: 7,
        dropped: 0,
        queued: 0,
        paused: false,
        transport: "unix".into(),
    };
    let output = OutputStatus {
        id: "scan".into(),
        data: "laser.scan".into(),
        type_name: "LaserScan".into(),
        published: 7,
        published_bytes: 0,
        links: vec![link],
    };
    scene.register("laser", 1);
    scene.handle(SystemEvent::Connected("laser".into(), 1));
    let status = Status { outputs: vec![output], ..status("laser", RunState::Active, 1.0) };
    scene.answer("laser", 1, Answer::Status { request: 1, status });
    scene.picture.rebuild_links();
    assert_eq!(scene.picture.links.len(), 1);
    scene.handle(SystemEvent::Registry(DirectoryChange::Gone(entry("laser", 1))));
    scene.picture.rebuild_links();
    assert_eq!(scene.picture.links.len(), 0, "it may come back and link again");
    scene.handle(SystemEvent::Registry(DirectoryChange::RegistryLost));
    scene.picture.rebuild_links();
    assert!(scene.picture.has_ended());
    assert_eq!(scene.picture.links[0].sent, 7);
}

#[test]
fn configd_is_one_process_under_two_names() {
    let mut scene = Scene::default();
    scene.register(CONFIGURATION, 1);
    assert!(!scene.picture.is_second_name(CONFIGURATION), "configd is not registered yet");
    scene.register(CONFIGD, 2);
    scene.register("laser", 3);
    assert!(scene.picture.is_second_name(CONFIGURATION));
    assert!(!scene.picture.is_second_name(CONFIGD) && !scene.picture.is_second_name("laser"));
}
