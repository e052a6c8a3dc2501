//! Mission time that follows data: the times of the file count in it, the time limits for real
//! processes count in host time.

use super::bench::{Bench, MS, SECOND, office};
use crate::event::ControllerEvent;
use crate::roster::Doing;
use crate::tests::simulation::draft::Way;
use crate::time::ClockReadings;
use std::time::Duration;

/// Advances both clocks and lets what is due happen.
fn passes(bench: &mut Bench, now: &mut ClockReadings, mission: Duration, host: Duration) {
    (now.mission, now.host) = (now.mission + mission, now.host + host);
    let actions = bench.controller.handle(ControllerEvent::Timer, *now);
    bench.note(actions);
}

fn with_timeout() -> (Bench, ClockReadings) {
    let office = office();
    let way = Way {
        from: vec![office.explore],
        to: vec![office.home],
        after: Some(10 * SECOND),
        ..Way::default()
    };
    (Bench::begun(office.with("late", way)), ClockReadings::default())
}

#[test]
fn a_timeout_comes_with_simulated_time_and_not_before() {
    let (mut bench, mut now) = with_timeout();
    passes(&mut bench, &mut now, Duration::ZERO, 1000 * SECOND);
    assert_eq!(bench.marked(), ["explore"], "time stands still");
    passes(&mut bench, &mut now, 10 * SECOND - MS, 1000 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    let due = bench.controller.deadlines();
    assert_eq!(due.mission, Some(10 * SECOND));
    passes(&mut bench, &mut now, MS, Duration::ZERO);
    bench.obey();
    assert_eq!(bench.marked(), ["home"]);
}

#[test]
fn a_component_that_does_not_stop_is_pushed_by_the_hosts_time() {
    let (mut bench, mut now) = with_timeout();
    passes(&mut bench, &mut now, 10 * SECOND, MS);
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze driver"]);
    passes(&mut bench, &mut now, 1000 * SECOND, MS);
    assert_eq!(bench.wanted(), [] as [&str; 0], "a fast simulator gives no component less time");
    passes(&mut bench, &mut now, Duration::ZERO, SECOND);
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze driver"], "asked again");
    passes(&mut bench, &mut now, Duration::ZERO, SECOND);
    assert_eq!(bench.wanted(), ["kill explorer", "kill driver"]);
}

#[test]
fn a_component_that_stays_away_has_failed_by_the_hosts_time() {
    let (mut bench, mut now) = with_timeout();
    let office = office();
    bench.gone(office.driver);
    passes(&mut bench, &mut now, 9 * SECOND, 14 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    bench.appears(office.driver, Doing::Frozen, 0);
    bench.obey();
    bench.gone(office.driver);
    passes(&mut bench, &mut now, Duration::ZERO, 30 * SECOND);
    assert_eq!(bench.marked(), [] as [&str; 0], "it retreats although time stands still");
}
