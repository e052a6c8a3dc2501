//! Texts about a running mission, shared by the command line and the designer.

use armor_marking::{EnabledTransition, FiringDecider, Marking};
use armor_sdk::control::CurrentCall;

/// Returns a duration as text, such as `3.2 s` or `1 min 15 s`; a negative one counts as zero.
pub fn format_duration(seconds: f64) -> String {
    match seconds.max(0.0) {
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor()),
        s => format!("{:.0} h {:02.0} min", (s / 3600.0).floor(), (s % 3600.0 / 60.0).floor()),
    }
}

/// Returns which function of user code runs and how long it has, such as `in exec for 12.0 s`.
pub fn describe_call(call: &CurrentCall) -> String {
    format!("in {} for {}", call.function, format_duration(call.call_s))
}

/// Returns a short time as text, in microseconds, milliseconds or seconds.
pub fn format_short_time(seconds: f64) -> String {
    match seconds.abs() {
        s if s < 1e-3 => format!("{:.0} us", seconds * 1e6),
        s if s < 1.0 => format!("{:.1} ms", seconds * 1e3),
        _ => format!("{seconds:.2} s"),
    }
}

/// Returns a number of bytes as text, in B, kB, MB or GB of powers of 1000.
pub fn format_bytes(bytes: f64) -> String {
    // From where three digits would be rounded up to the next unit.
    match bytes.abs() {
        b if b < 999.5 => format!("{bytes:.0} B"),
        b if b < 999.5e3 => format!("{} kB", format_three_digits(bytes / 1e3)),
        b if b < 999.5e6 => format!("{} MB", format_three_digits(bytes / 1e6)),
        _ => format!("{} GB", format_three_digits(bytes / 1e9)),
    }
}

fn format_three_digits(number: f64) -> String {
    match number.abs() {
        n if n < 9.995 => format!("{number:.2}"),
        n if n < 99.95 => format!("{number:.1}"),
        _ => format!("{number:.0}"),
    }
}

/// Returns a function from "is this clock held?" to the time it shows, in seconds of mission time:
/// `now_s`, or the beginning of the pause for a held clock.
pub fn transition_clock(marking: &Marking, now_s: f64) -> impl Fn(bool) -> f64 {
    let stopped_s = marking.pause.as_ref().map_or(now_s, |pause| pause.since_at_s);
    move |held| if held { stopped_s } else { now_s }
}

/// Returns when a transition may fire and who decides it; `now_s` is the time its clock shows.
pub fn describe_enabled(enabled: &EnabledTransition, now_s: f64) -> String {
    let in_s = |at_s: f64| match at_s - now_s {
        left_s if left_s <= 0.0 => "now".to_owned(),
        left_s => format!("in {}", format_duration(left_s)),
    };
    let name = &enabled.transition;
    let who = match enabled.by {
        FiringDecider::Mission => "",
        FiringDecider::Operator => ", by the operator",
        FiringDecider::Confirmation => ", if the operator confirms it",
        FiringDecider::Declined => {
            return format!("{name} was declined; it asks again the next time it is enabled");
        }
    };
    let (first, last) = (enabled.earliest_at_s, enabled.latest_at_s);
    let until = match last {
        Some(last) if last > first => format!(", at the latest {}", in_s(last)),
        _ => String::new(),
    };
    let held = if enabled.held { ", once the mission resumes" } else { "" };
    format!("{name} {}{until}{who}{held}", in_s(first))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn enabled(
        by: FiringDecider,
        at_s: f64,
        until_s: Option<f64>,
        held: bool,
    ) -> EnabledTransition {
        EnabledTransition {
            transition: "late".into(),
            enabled_at_s: 0.0,
            earliest_at_s: at_s,
            latest_at_s: until_s,
            by,
            held,
        }
    }

    #[test]
    fn durations_are_written_in_a_suitable_unit() {
        let written = [-1.0, 3.21, 75.0, 7384.0].map(format_duration);
        assert_eq!(written, ["0.0 s", "3.2 s", "1 min 15 s", "2 h 03 min"]);
    }

    #[test]
    fn short_times_are_written_in_a_suitable_unit() {
        assert_eq!([2.5e-5, 0.0123, 1.5].map(format_short_time), ["25 us", "12.3 ms", "1.50 s"]);
    }

    #[test]
    fn bytes_are_written_with_three_digits() {
        let written = [0.0, 999.4, 999.6, 12_345.0, 999_600.0, 2.5e9].map(format_bytes);
        assert_eq!(written, ["0 B", "999 B", "1.00 kB", "12.3 kB", "1.00 MB", "2.50 GB"]);
    }

    #[test]
    fn the_time_of_a_firing_is_given_by_the_transitions_own_clock() {
        let check = |enabled: EnabledTransition, now_s, expected: &str| {
            assert_eq!(describe_enabled(&enabled, now_s), expected);
        };
        check(
            enabled(FiringDecider::Mission, 150.0, Some(150.0), false),
            30.0,
            "late in 2 min 00 s",
        );
        check(
            enabled(FiringDecider::Mission, 10.0, Some(90.0), false),
            30.0,
            "late now, at the latest in 1 min 00 s",
        );
        check(
            enabled(FiringDecider::Operator, 0.0, None, false),
            30.0,
            "late now, by the operator",
        );
        let held = "late in 20.0 s, if the operator confirms it, once the mission resumes";
        check(enabled(FiringDecider::Confirmation, 50.0, None, true), 30.0, held);
        let declined = "late was declined; it asks again the next time it is enabled";
        check(enabled(FiringDecider::Declined, 0.0, None, false), 30.0, declined);
    }
}
