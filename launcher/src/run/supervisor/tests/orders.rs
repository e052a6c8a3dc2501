//! What an operator orders: restart and stop of a component.

use super::*;

#[test]
fn an_operator_restarts_a_component_that_runs_has_ended_or_was_given_up() {
    use ChildOrder::Restart as Again;
    let mut bench = Bench::running(Restart::Never);
    assert_eq!(bench.on(SupervisorEvent::Order(LASER, Again)), [Terminate(LASER)]);
    assert_eq!(bench.on(SupervisorEvent::Order(LASER, Again)), [], "it is ending already");
    let ended = SupervisorEvent::Exited(LASER, ChildExit::Code(0));
    assert_eq!(bench.on(ended.clone()), [Spawn(LASER)]);
    assert!(bench.logged.last().is_some_and(|text| text.contains("restarted")));
    let report =
        SupervisorAction::ReportGivenUp(LASER, "laser ended, and is not started again".into());
    assert_eq!(bench.on(ended), [report], "its policy is valid again");
    assert_eq!(bench.on(SupervisorEvent::Order(LASER, Again)), [Spawn(LASER)]);
    let mut bench = Bench::running(Restart::Always);
    for _ in 0..child::MAX_DEATHS {
        bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(1)));
        bench.pass(10.5, &[SLAM]);
    }
    assert!(bench.logged.last().is_some_and(|text| text.contains("given up")));
    assert_eq!(bench.on(SupervisorEvent::Order(LASER, Again)), [Spawn(LASER)]);
    bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(1)));
    assert_eq!(bench.pass(0.2, &[SLAM]), [Spawn(LASER)], "its record of deaths is cleared");
}

#[test]
fn a_component_that_was_stopped_stays_down_and_the_run_goes_on_without_it() {
    let mut duties = system(Restart::Always);
    duties.remove(EXECUTIVE);
    duties.remove(SLAM);
    let mut bench = Bench::new(duties);
    bench.on(SupervisorEvent::Tick);
    bench.on(SupervisorEvent::Ready(REGISTRY));
    bench.on(SupervisorEvent::Ready(CONFIGD));
    let stop = SupervisorEvent::Order(LASER, ChildOrder::Stop);
    assert_eq!(bench.on(stop.clone()), [Terminate(LASER)]);
    assert_eq!(bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(0))), []);
    assert_eq!(bench.pass(20.0, &[]), [], "neither started again nor the end of the run");
    assert_eq!(bench.on(stop), []);
    let restart = SupervisorEvent::Order(LASER, ChildOrder::Restart);
    assert_eq!(bench.on(restart), [Spawn(LASER)]);
}

#[test]
fn an_order_does_not_delay_the_end_of_the_system() {
    let mut bench = Bench::running(Restart::Always);
    bench.on(SupervisorEvent::Order(LASER, ChildOrder::Restart));
    bench.on(SupervisorEvent::Stop(Interrupt));
    assert_eq!(bench.on(SupervisorEvent::Exited(LASER, ChildExit::Code(0))), []);
    assert_eq!(bench.on(SupervisorEvent::Order(LASER, ChildOrder::Restart)), []);
}
