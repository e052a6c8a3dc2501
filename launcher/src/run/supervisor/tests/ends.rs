//! How a run ends.

use super::*;

#[test]
fn a_stop_goes_in_order_and_kills_what_does_not_end() {
    let mut bench = Bench::running(Restart::Always);
    assert_eq!(bench.on(SupervisorEvent::Stop(Interrupt)), [Terminate(EXECUTIVE)]);
    assert_eq!(bench.pass(4.9, &[LASER, SLAM]), [], "silence is no fault while stopping");
    assert_eq!(bench.pass(0.2, &[]), [Kill(EXECUTIVE)]);
    assert_eq!(bench.on(Bench::killed(EXECUTIVE)), [Terminate(LASER), Terminate(SLAM)]);
    assert_eq!(
        bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(0))),
        [],
        "no process comes back"
    );
    assert_eq!(bench.pass(5.1, &[]), [Kill(SLAM)]);
    assert_eq!(bench.on(Bench::killed(SLAM)), [Terminate(CONFIGD)]);
    assert_eq!(
        bench.on(SupervisorEvent::Exited(CONFIGD, ChildExit::Code(0))),
        [Terminate(REGISTRY)]
    );
    let end = SupervisorAction::End(RunVerdict::Interrupted);
    assert_eq!(bench.on(SupervisorEvent::Exited(REGISTRY, ChildExit::Signal(15))), [end]);
    assert_eq!(bench.pass(60.0, &[]), [], "nothing follows the end");
}

#[test]
fn the_second_interrupt_kills_immediately() {
    let mut bench = Bench::running(Restart::OnFailure);
    bench.on(Bench::killed(LASER));
    bench.on(SupervisorEvent::Stop(Interrupt));
    let killed = bench.on(SupervisorEvent::Stop(Interrupt));
    assert_eq!(killed, [Kill(REGISTRY), Kill(CONFIGD), Kill(SLAM), Kill(EXECUTIVE)]);
    for id in [REGISTRY, CONFIGD, SLAM] {
        assert_eq!(bench.on(Bench::killed(id)), []);
    }
    assert_eq!(
        bench.on(Bench::killed(EXECUTIVE)),
        [SupervisorAction::End(RunVerdict::Interrupted)]
    );
}

#[test]
fn a_hang_that_is_being_mended_when_the_stop_comes_is_not_started_again() {
    let mut bench = Bench::running(Restart::OnFailure);
    assert_eq!(bench.pass(1.8, &[SLAM]), [Kill(LASER)]);
    assert_eq!(bench.on(SupervisorEvent::Stop(TimeUp)), [Terminate(EXECUTIVE)]);
    bench.on(Bench::killed(LASER));
    assert_eq!(bench.on(SupervisorEvent::Exited(EXECUTIVE, ChildExit::Code(0))), [Terminate(SLAM)]);
}

#[test]
fn without_a_mission_the_run_ends_when_its_components_have() {
    let mut duties = system(Restart::OnFailure);
    duties.pop();
    let mut bench = Bench::new(duties);
    bench.on(SupervisorEvent::Tick);
    bench.on(SupervisorEvent::Ready(REGISTRY));
    assert_eq!(bench.on(SupervisorEvent::Ready(CONFIGD)), [Spawn(LASER), Spawn(SLAM)]);
    bench.beats();
    let report = |id, name: &str| {
        SupervisorAction::ReportGivenUp(id, format!("{name} ended, and is not started again"))
    };
    let done = bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(0)));
    assert_eq!(done, [report(LASER, "laser")], "a mission that needs it fails now");
    let done = bench.on(SupervisorEvent::Exited(SLAM, ChildExit::Code(0)));
    assert_eq!(done, [report(SLAM, "slam"), Terminate(CONFIGD)]);
    bench.on(SupervisorEvent::Exited(CONFIGD, ChildExit::Code(0)));
    let end = SupervisorAction::End(RunVerdict::AllEnded { failed: vec![] });
    assert_eq!(bench.on(SupervisorEvent::Exited(REGISTRY, ChildExit::Code(0))), [end]);
}

#[test]
fn a_component_that_has_died_and_is_not_back_when_the_time_is_over_has_failed() {
    let failed_at_the_end = |is_back: bool| {
        let mut duties = system(Restart::OnFailure);
        duties.pop();
        let mut bench = Bench::new(duties);
        bench.on(SupervisorEvent::Tick);
        bench.on(SupervisorEvent::Ready(REGISTRY));
        bench.on(SupervisorEvent::Ready(CONFIGD));
        bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(1)));
        bench.wait_for_start();
        if is_back {
            bench.beats();
        }
        let mut actions = bench.on(SupervisorEvent::Stop(TimeUp));
        loop {
            match actions.pop() {
                Some(Terminate(id)) => {
                    actions.extend(bench.on(SupervisorEvent::Exited(id, ChildExit::Code(0))));
                }
                Some(SupervisorAction::End(RunVerdict::TimeUp { failed })) => return failed,
                other => panic!("{other:?} ends no run"),
            }
        }
    };
    assert_eq!(failed_at_the_end(false), ["laser"]);
    assert_eq!(failed_at_the_end(true), [""; 0]);
}

#[test]
fn a_run_that_an_operator_stops_has_a_verdict_of_its_own() {
    let verdict_of = |duties: Vec<Duty>| {
        let mut bench = Bench::new(duties);
        bench.on(SupervisorEvent::Tick);
        bench.on(SupervisorEvent::Ready(REGISTRY));
        bench.on(SupervisorEvent::Ready(CONFIGD));
        let mut actions = bench.on(SupervisorEvent::Stop(StopRequest::Ordered));
        loop {
            match actions.pop() {
                Some(Terminate(id)) => {
                    actions.extend(bench.on(SupervisorEvent::Exited(id, ChildExit::Code(0))));
                }
                Some(SupervisorAction::End(verdict)) => return verdict,
                other => panic!("{other:?} ends no run"),
            }
        }
    };
    let mut duties = system(Restart::OnFailure);
    let stopped = |is_unfinished| RunVerdict::Stopped { is_unfinished, failed: vec![] };
    assert_eq!(verdict_of(duties.clone()), stopped(true), "its mission was not over");
    duties.pop();
    assert_eq!(verdict_of(duties), stopped(false));
}

#[test]
fn a_system_runs_without_its_gate_which_is_tried_for_ever() {
    const GATE: ChildId = 5;
    let mut duties = system(Restart::OnFailure);
    duties.push(duty("gate", ChildRole::Gate, Restart::Always));
    let mut bench = Bench::new(duties);
    assert_eq!(bench.on(SupervisorEvent::Tick), [Spawn(REGISTRY)]);
    assert_eq!(bench.on(SupervisorEvent::Ready(REGISTRY)), [Spawn(CONFIGD), Spawn(GATE)]);
    let started = [Spawn(LASER), Spawn(SLAM), Spawn(EXECUTIVE)];
    assert_eq!(bench.on(SupervisorEvent::Ready(CONFIGD)), started);
    bench.beats();
    for _ in 0..200 {
        bench.on(SupervisorEvent::Exited(GATE, ChildExit::Code(1)));
        assert!(bench.wait_for_start() <= s(1.05));
    }
    bench.pass(11.0, &[LASER, SLAM]);
    bench.on(Bench::killed(GATE));
    assert!(bench.wait_for_start() <= s(0.15), "it was healthy for ten seconds");
}

#[test]
fn the_panic_of_a_process_is_why_it_ended() {
    let mut bench = Bench::running(Restart::OnFailure);
    let panic = "panicked at src/main.rs:12: no power".to_owned();
    assert_eq!(bench.on(SupervisorEvent::Panicked(LASER, panic)), []);
    bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(1)));
    let expected = "panicked at src/main.rs:12: no power; it starts again in 0.1 s";
    assert_eq!(bench.logged.last().map(String::as_str), Some(expected));
    // The next one ends for another reason.
    bench.wait_for_start();
    bench.on(Bench::killed(LASER));
    assert!(bench.logged.last().is_some_and(|text| text.starts_with("ended by signal 9")));
}
