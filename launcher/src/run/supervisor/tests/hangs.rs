//! Why a process was killed, in the words that the log, `armor ps` and a mission show.

use super::*;

fn last_logged(bench: &Bench) -> &str {
    bench.logged.last().map_or("", String::as_str)
}

#[test]
fn a_component_whose_call_takes_too_long_is_killed_once_and_started_again() {
    let mut duties = system(Restart::OnFailure);
    duties[LASER].watchdog = Some(s(2.0));
    let mut bench = Bench::started(duties);
    assert_eq!(bench.on(SupervisorEvent::Stuck(LASER, s(2.5))), [Kill(LASER)]);
    let why = "one call has taken 2.5 s, longer than its watchdog of 2 s allows: killed";
    assert_eq!(last_logged(&bench), why);
    assert_eq!(bench.on(SupervisorEvent::Stuck(LASER, s(3.0))), [], "it is being killed");
    bench.on(Bench::killed(LASER));
    let end = "was killed by its watchdog (one call took 2.5 s, longer than 2 s)";
    assert_eq!(last_logged(&bench), format!("{end}; it starts again in 0.1 s"));
    assert_eq!(bench.pass(0.2, &[SLAM]), [Spawn(LASER)]);
    let mut report = None;
    while report.is_none() {
        bench.on(SupervisorEvent::Stuck(LASER, s(2.5)));
        report = bench.on(Bench::killed(LASER)).pop();
        bench.pass(10.0, &[SLAM]);
    }
    let SupervisorAction::ReportGivenUp(LASER, why) = report.expect("a report") else {
        panic!("nothing else is done");
    };
    assert!(why.starts_with("laser was given up after 5 starts in "), "{why}");
    assert!(why.ends_with(end), "{why}");
}

#[test]
fn a_component_that_a_signal_has_stopped_is_named_so() {
    let mut bench = Bench::running(Restart::OnFailure);
    assert!(bench.supervisor.list_overdue(bench.now).is_empty());
    bench.pass(1.7, &[SLAM]);
    bench.now += s(0.1);
    assert_eq!(bench.supervisor.list_overdue(bench.now), [LASER]);
    assert_eq!(bench.on(SupervisorEvent::Suspended(LASER)), [Kill(LASER)]);
    let stopped = "stopped (SIGSTOP or a debugger)";
    assert_eq!(last_logged(&bench), format!("{stopped}: suspected of hanging and killed"));
    assert!(bench.supervisor.list_overdue(bench.now).is_empty(), "it is being killed");
    bench.on(Bench::killed(LASER));
    let end = format!("was killed while {stopped}; it starts again in 0.1 s");
    assert_eq!(last_logged(&bench), end);
    let history = bench.supervisor.describe_history(LASER);
    assert_eq!((history.starts, history.ended, history.last_end), (1, 1, end));
}

#[test]
fn a_silent_component_is_named_so_and_none_is_overdue_while_the_launcher_slept() {
    let mut bench = Bench::running(Restart::OnFailure);
    assert_eq!(bench.pass(1.8, &[SLAM]), [Kill(LASER)]);
    bench.on(Bench::killed(LASER));
    let end = "was killed as hanging (silent for 1.75 s); it starts again in 0.1 s";
    assert_eq!(last_logged(&bench), end);
    bench.now += s(3600.0);
    assert!(bench.supervisor.list_overdue(bench.now).is_empty());
}

#[test]
fn a_component_on_another_host_is_not_taken_for_hanging_while_that_is_cut_off() {
    let mut duties = system(Restart::OnFailure);
    duties[SLAM].host = Some("arm".into());
    let mut bench = Bench::started(duties);
    bench.beats();
    // Longer than a component of this host may be silent; the cut is noticed only now.
    assert_eq!(bench.pass(2.0, &[LASER]), []);
    for _ in 0..60 {
        assert_eq!(bench.on(SupervisorEvent::Unheard(SLAM)), []);
        assert_eq!(bench.pass(0.5, &[LASER]), []);
    }
    // It is back, and hangs.
    assert_eq!(bench.pass(1.0, &[LASER, SLAM]), []);
    assert_eq!(bench.pass(5.0, &[LASER]), []);
    assert_eq!(bench.pass(0.5, &[LASER]), [Kill(SLAM)]);
    assert_eq!(bench.logged, ["silent for 5.25 s: suspected of hanging and killed"]);
    // Its agent ended it while it was cut off, which is no end of its own.
    assert_eq!(bench.on(SupervisorEvent::Exited(SLAM, ChildExit::CutOff)), []);
    assert_eq!(bench.pass(0.2, &[LASER]), [Spawn(SLAM)]);
}
