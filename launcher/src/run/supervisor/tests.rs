use super::*;

mod ends;
mod hangs;
mod orders;

use StopRequest::{Interrupt, TimeUp};
use SupervisorAction::{Kill, Spawn, Terminate};

const REGISTRY: ChildId = 0;
const CONFIGD: ChildId = 1;
const LASER: ChildId = 2;
const SLAM: ChildId = 3;
const EXECUTIVE: ChildId = 4;

fn s(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

fn duty(name: &str, role: ChildRole, restart: Restart) -> Duty {
    Duty {
        name: name.into(),
        role,
        restart,
        watchdog: None,
        kind: None,
        ends_run: false,
        host: None,
    }
}

fn system(restart: Restart) -> Vec<Duty> {
    vec![
        duty("registry", ChildRole::Registry, Restart::Always),
        duty("configd", ChildRole::Configd, Restart::Always),
        duty("laser", ChildRole::Component, restart),
        duty("slam", ChildRole::Component, restart),
        duty("executive", ChildRole::Executive, Restart::Always),
    ]
}

/// A supervisor with its clock, which drops messages.
struct Bench {
    supervisor: Supervisor,
    now: Duration,
    logged: Vec<String>,
}

impl Bench {
    fn new(duties: Vec<Duty>) -> Self {
        Self { supervisor: Supervisor::new(duties), now: Duration::ZERO, logged: Vec::new() }
    }

    /// All processes run and have sent their first beat.
    fn running(restart: Restart) -> Self {
        Self::started(system(restart))
    }

    fn started(duties: Vec<Duty>) -> Self {
        let mut bench = Self::new(duties);
        assert_eq!(bench.on(SupervisorEvent::Tick), [Spawn(REGISTRY)]);
        assert_eq!(bench.on(SupervisorEvent::Ready(REGISTRY)), [Spawn(CONFIGD)]);
        assert_eq!(
            bench.on(SupervisorEvent::Ready(CONFIGD)),
            [Spawn(LASER), Spawn(SLAM), Spawn(EXECUTIVE)]
        );
        bench.beats();
        bench
    }

    fn on(&mut self, event: SupervisorEvent) -> Vec<SupervisorAction> {
        let (logged, done): (Vec<_>, Vec<_>) = self
            .supervisor
            .handle(event, self.now)
            .into_iter()
            .partition(|action| matches!(action, SupervisorAction::Log(..)));
        self.logged.extend(logged.into_iter().map(|action| match action {
            SupervisorAction::Log(_, _, text) => text,
            other => panic!("{other:?} is not a report"),
        }));
        done
    }

    fn beats(&mut self) {
        for id in [LASER, SLAM] {
            assert_eq!(self.on(SupervisorEvent::Ready(id)), []);
            assert_eq!(self.on(SupervisorEvent::Heard(id, None)), []);
        }
    }

    /// Lets time pass in steps of 0.1 s, with beats of `alive`.
    fn pass(&mut self, seconds: f64, alive: &[ChildId]) -> Vec<SupervisorAction> {
        let mut done = Vec::new();
        for _ in 0..(seconds * 10.0).round() as u32 {
            self.now += s(0.1);
            for id in alive {
                done.extend(self.on(SupervisorEvent::Heard(*id, None)));
            }
            done.extend(self.on(SupervisorEvent::Tick));
        }
        done
    }

    /// Lets time pass until a process is started, and returns how long that took.
    fn wait_for_start(&mut self) -> Duration {
        let begin = self.now;
        while self.pass(0.1, &[LASER, SLAM]).is_empty() {
            assert!(self.now - begin < s(60.0), "nothing is started: {:?}", self.logged);
        }
        self.now - begin
    }

    fn killed(id: ChildId) -> SupervisorEvent {
        SupervisorEvent::Exited(id, ChildExit::Signal(9))
    }
}

#[test]
fn all_processes_wait_for_the_daemons() {
    let mut bench = Bench::new(system(Restart::OnFailure));
    assert_eq!(bench.on(SupervisorEvent::Tick), [Spawn(REGISTRY)]);
    assert_eq!(bench.pass(5.0, &[]), []);
    assert_eq!(bench.on(SupervisorEvent::Ready(REGISTRY)), [Spawn(CONFIGD)]);
    assert_eq!(bench.pass(5.0, &[]), []);
    assert_eq!(
        bench.on(SupervisorEvent::Ready(CONFIGD)),
        [Spawn(LASER), Spawn(SLAM), Spawn(EXECUTIVE)]
    );
}

#[test]
fn a_daemon_that_never_gets_ready_is_killed_and_given_up() {
    let mut bench = Bench::new(system(Restart::OnFailure));
    bench.on(SupervisorEvent::Tick);
    let mut kills = 0;
    while kills < 20 {
        let done = bench.pass(0.1, &[]);
        if done.contains(&Kill(REGISTRY)) {
            kills += 1;
            bench.on(Bench::killed(REGISTRY));
        }
        if bench.now > s(600.0) {
            break;
        }
    }
    assert_eq!(kills, 20, "one death in 20 s is slow enough to keep trying");
    let failed = SupervisorEvent::SpawnFailed(REGISTRY, "no such file".into());
    let ends = (0..5).any(|_| {
        let done = bench.on(failed.clone());
        bench.now += s(0.01);
        done.contains(&SupervisorAction::End(RunVerdict::Essential("registry".into())))
    });
    assert!(ends, "{:?}", bench.logged);
}

#[test]
fn a_killed_component_comes_back_with_growing_delays_and_is_given_up() {
    let mut bench = Bench::running(Restart::OnFailure);
    let start = bench.now;
    for delay in [0.1, 0.2, 0.4, 0.8] {
        assert_eq!(bench.on(Bench::killed(LASER)), []);
        assert_eq!(bench.pass(delay - 0.1, &[SLAM]), [], "before {delay} s");
        assert_eq!(bench.pass(0.1, &[SLAM]), [Spawn(LASER)], "after {delay} s");
    }
    let why = "laser was given up after 5 starts in 1.5 s: ended by signal 9 (SIGKILL)";
    let report = SupervisorAction::ReportGivenUp(LASER, why.into());
    assert_eq!(bench.on(Bench::killed(LASER)), [report]);
    assert_eq!(bench.pass(120.0, &[SLAM]), [], "the others continue");
    let absent = bench.supervisor.list_absent();
    assert_eq!((absent.len(), absent[0].starts, absent[0].ends.len()), (1, 5, 3), "{absent:?}");
    assert!(
        bench.logged.last().is_some_and(|logged| logged.contains("given up")),
        "{:?}",
        bench.logged
    );
    assert!(start < bench.now);
}

#[test]
fn a_minute_of_life_clears_the_record() {
    let mut bench = Bench::running(Restart::OnFailure);
    for _ in 0..20 {
        bench.on(Bench::killed(LASER));
        assert_eq!(bench.pass(0.1, &[SLAM]), [Spawn(LASER)]);
        bench.beats();
        assert_eq!(bench.pass(61.0, &[LASER, SLAM]), []);
    }
}

#[test]
fn after_ten_seconds_of_health_the_first_delay_counts_again() {
    let wait_after = |bench: &mut Bench, seconds: f64| {
        bench.pass(seconds, &[LASER, SLAM]);
        bench.on(Bench::killed(LASER));
        let waited = bench.wait_for_start();
        bench.beats();
        (waited.as_secs_f64() * 10.0).round() / 10.0
    };
    let mut bench = Bench::running(Restart::OnFailure);
    assert_eq!([9.0, 9.0, 10.1].map(|lived| wait_after(&mut bench, lived)), [0.1, 0.2, 0.1]);
    let mut bench = Bench::running(Restart::OnFailure);
    assert_eq!([15.1; 12].map(|lived| wait_after(&mut bench, lived)), [0.1; 12]);
}

#[test]
fn a_daemon_is_away_for_a_second_at_most_and_tried_again_for_half_a_minute() {
    for daemon in [REGISTRY, CONFIGD, EXECUTIVE] {
        let mut bench = Bench::running(Restart::OnFailure);
        let mut first = None;
        // Its cause, such as a full disk, passes after 29 s.
        while first.is_none_or(|first| bench.now < first + s(29.0)) {
            bench.on(SupervisorEvent::Exited(daemon, ChildExit::Code(1)));
            first.get_or_insert(bench.now);
            let waited = bench.wait_for_start();
            assert!(waited <= s(1.05), "{daemon}: {waited:?}");
        }
        bench.on(SupervisorEvent::Ready(daemon));
        bench.pass(5.0, &[LASER, SLAM]);
        // Often killed later: it was ready for long enough each time.
        for _ in 0..60 {
            bench.on(Bench::killed(daemon));
            bench.wait_for_start();
            bench.on(SupervisorEvent::Ready(daemon));
            assert_eq!(bench.pass(4.0, &[LASER, SLAM]), []);
        }
    }
}

#[test]
fn a_stopped_daemon_is_killed_immediately_and_once() {
    let mut bench = Bench::running(Restart::OnFailure);
    assert_eq!(bench.on(SupervisorEvent::Suspended(CONFIGD)), [Kill(CONFIGD)]);
    assert_eq!(bench.on(SupervisorEvent::Suspended(CONFIGD)), []);
    bench.on(Bench::killed(CONFIGD));
    assert_eq!(bench.pass(0.1, &[LASER, SLAM]), [Spawn(CONFIGD)]);
}

#[test]
fn what_the_launcher_lacks_is_no_fault_of_a_component() {
    let mut bench = Bench::running(Restart::OnFailure);
    for _ in 0..20 {
        bench.on(SupervisorEvent::Unheard(LASER));
        assert_eq!(bench.pass(5.0, &[SLAM]), [], "it is not taken for hanging");
    }
    bench.on(Bench::killed(LASER));
    let failed = SupervisorEvent::SpawnFailed(LASER, "too many open files".into());
    for _ in 0..20 {
        assert_eq!(bench.pass(10.0, &[SLAM]), [Spawn(LASER)]);
        bench.on(failed.clone());
    }
    assert!(bench.logged.iter().all(|text| !text.contains("given up")), "{:?}", bench.logged);
    assert_eq!(bench.pass(10.0, &[SLAM]), [Spawn(LASER)], "with the next descriptor it starts");
}

#[test]
fn the_policy_decides_who_comes_back() {
    let check = |restart, exit, comes_back: bool| {
        let mut bench = Bench::running(restart);
        bench.on(SupervisorEvent::Exited(LASER, exit));
        let spawned = bench.pass(1.0, &[SLAM]) == [Spawn(LASER)];
        assert_eq!(spawned, comes_back, "{restart:?} after {exit:?}");
    };
    check(Restart::Always, ChildExit::Code(0), true);
    check(Restart::Always, ChildExit::Code(1), true);
    check(Restart::OnFailure, ChildExit::Code(0), false);
    check(Restart::OnFailure, ChildExit::Code(101), true);
    check(Restart::OnFailure, ChildExit::Signal(9), true);
    check(Restart::Never, ChildExit::Code(0), false);
    check(Restart::Never, ChildExit::Signal(11), false);
}

#[test]
fn a_component_that_misses_three_beats_is_killed_and_started_again() {
    let mut bench = Bench::running(Restart::OnFailure);
    assert_eq!(bench.pass(1.6, &[SLAM]), []);
    assert_eq!(bench.pass(0.2, &[SLAM]), [Kill(LASER)]);
    assert_eq!(bench.pass(1.0, &[SLAM]), [], "it is killed once");
    bench.on(Bench::killed(LASER));
    assert_eq!(bench.pass(0.1, &[SLAM]), [Spawn(LASER)]);
}

#[test]
fn a_component_that_registers_and_never_answers_is_killed() {
    let mut bench = Bench::running(Restart::OnFailure);
    bench.on(Bench::killed(LASER));
    bench.pass(0.1, &[SLAM]);
    assert_eq!(bench.pass(60.0, &[SLAM]), [], "a constructor may take its time");
    bench.on(SupervisorEvent::Ready(LASER));
    assert_eq!(bench.pass(9.8, &[SLAM]), []);
    assert_eq!(bench.pass(0.3, &[SLAM]), [Kill(LASER)]);
}

#[test]
fn a_launcher_that_slept_blames_no_process() {
    let mut bench = Bench::running(Restart::OnFailure);
    bench.now += s(3600.0);
    assert_eq!(bench.on(SupervisorEvent::Tick), []);
    assert_eq!(bench.pass(1.6, &[]), []);
    let mut killed = bench.pass(0.2, &[]);
    killed.sort_by_key(|action| matches!(action, Kill(SLAM)));
    assert_eq!(killed, [Kill(LASER), Kill(SLAM)]);
}

#[test]
fn a_daemon_that_hangs_is_killed_and_one_that_is_back_in_time_is_not() {
    let mut bench = Bench::running(Restart::OnFailure);
    bench.on(SupervisorEvent::Vanished(CONFIGD));
    assert_eq!(bench.pass(2.5, &[LASER, SLAM]), []);
    bench.on(SupervisorEvent::Ready(CONFIGD));
    assert_eq!(bench.pass(60.0, &[LASER, SLAM]), []);
    bench.on(SupervisorEvent::Vanished(REGISTRY));
    assert_eq!(bench.pass(3.1, &[LASER, SLAM]), [Kill(REGISTRY)]);
    bench.on(Bench::killed(REGISTRY));
    assert_eq!(bench.pass(0.1, &[LASER, SLAM]), [Spawn(REGISTRY)]);
}

#[test]
fn a_killed_registry_comes_back_and_the_rest_stays() {
    let mut bench = Bench::running(Restart::OnFailure);
    bench.on(Bench::killed(REGISTRY));
    assert_eq!(bench.pass(0.1, &[LASER, SLAM]), [Spawn(REGISTRY)]);
    assert_eq!(bench.on(SupervisorEvent::Ready(REGISTRY)), []);
    assert_eq!(bench.pass(60.0, &[LASER, SLAM]), []);
}

#[test]
fn a_daemon_given_up_ends_the_run() {
    let mut bench = Bench::running(Restart::OnFailure);
    for _ in 0..33 {
        bench.on(SupervisorEvent::Exited(CONFIGD, ChildExit::Code(1)));
        bench.pass(1.0, &[LASER, SLAM]);
    }
    assert!(bench.pass(0.1, &[LASER, SLAM]).is_empty(), "it waits for the executive to end");
    assert_eq!(
        bench.on(SupervisorEvent::Exited(EXECUTIVE, ChildExit::Code(0))),
        [Terminate(LASER), Terminate(SLAM)]
    );
    bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(0)));
    assert_eq!(bench.on(SupervisorEvent::Exited(SLAM, ChildExit::Code(0))), [Terminate(REGISTRY)]);
    let end = SupervisorAction::End(RunVerdict::Essential("configd".into()));
    assert_eq!(bench.on(SupervisorEvent::Exited(REGISTRY, ChildExit::Code(0))), [end]);
}

#[test]
fn the_executive_decides_how_the_mission_ended() {
    for (code, verdict) in [(0, RunVerdict::Goal), (3, RunVerdict::Safe), (4, RunVerdict::Failed)] {
        let mut bench = Bench::running(Restart::OnFailure);
        let exit = SupervisorEvent::Exited(EXECUTIVE, ChildExit::Code(code));
        assert_eq!(bench.on(exit), [Terminate(LASER), Terminate(SLAM)]);
        assert!(!bench.supervisor.has_executive(), "code {code}");
        bench.on(SupervisorEvent::Exited(SLAM, ChildExit::Code(0)));
        assert_eq!(
            bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(0))),
            [Terminate(CONFIGD)]
        );
        assert_eq!(
            bench.on(SupervisorEvent::Exited(CONFIGD, ChildExit::Code(0))),
            [Terminate(REGISTRY)]
        );
        assert_eq!(
            bench.on(SupervisorEvent::Exited(REGISTRY, ChildExit::Code(0))),
            [SupervisorAction::End(verdict)],
            "code {code}"
        );
    }
}

#[test]
fn an_executive_that_crashed_is_started_again() {
    for exit in [ChildExit::Signal(9), ChildExit::Code(101), ChildExit::Code(1)] {
        let mut bench = Bench::running(Restart::OnFailure);
        bench.on(SupervisorEvent::Exited(EXECUTIVE, exit));
        assert!(bench.supervisor.has_executive(), "orders wait for the next one");
        assert_eq!(bench.pass(0.1, &[LASER, SLAM]), [Spawn(EXECUTIVE)], "{exit:?}");
    }
}

#[test]
fn an_executive_is_expected_from_the_begin_of_a_run_with_a_mission() {
    let mut bench = Bench::new(system(Restart::OnFailure));
    assert!(bench.supervisor.has_executive());
    bench.on(SupervisorEvent::Tick);
    assert!(bench.supervisor.has_executive(), "the daemons start first");
    let mut duties = system(Restart::OnFailure);
    duties.truncate(EXECUTIVE);
    assert!(!Bench::new(duties).supervisor.has_executive());
}

#[test]
fn an_idle_system_asks_for_no_look_before_something_can_be_due() {
    let mut bench = Bench::new(system(Restart::OnFailure));
    bench.on(SupervisorEvent::Tick);
    assert_eq!(bench.supervisor.next_deadline(), Some(s(20.0)), "the registry is not ready");
    let mut bench = Bench::running(Restart::OnFailure);
    assert_eq!(bench.supervisor.next_deadline(), Some(bench.now + s(1.75)), "the next beat");
    bench.on(Bench::killed(LASER));
    assert_eq!(bench.supervisor.next_deadline(), Some(bench.now + s(0.1)), "the restart");
}
