//! The progress of a route in words.

use armor_inspect::words::format_duration;
use armor_robotfile::site_map::ZoneKind;
use armor_robotfile::timing::{LimitOutlook, RouteProgress, RouteStand, ZoneNearby};

/// Less than this early or late is on time, in seconds.
const ON_TIME_S: f64 = 0.5;
/// Zones that are listed of a robot.
const MAX_ZONES: usize = 3;

/// How a route stands: `leg l1`, `to R1`, `ended`.
pub fn stand_text(progress: &RouteProgress) -> String {
    let step = progress.current.and_then(|current| progress.steps.get(current));
    let step = step.map_or("", |step| step.step.as_str());
    match &progress.stand {
        RouteStand::Waiting => "not begun".to_owned(),
        RouteStand::Underway => step.to_owned(),
        RouteStand::Detour { point, is_there: false } => format!("from {step} to {point}"),
        RouteStand::Detour { point, is_there: true } => format!("from {step}, at {point}"),
        RouteStand::Ended => "ended".to_owned(),
        RouteStand::Left => "left for another place".to_owned(),
    }
}

/// `1.5 s late`, `on time`, `2.0 s early`.
pub fn late_text(late_s: f64) -> String {
    if late_s.abs() < ON_TIME_S {
        "on time".to_owned()
    } else if late_s > 0.0 {
        format!("{} late", format_duration(late_s))
    } else {
        format!("{} early", format_duration(-late_s))
    }
}

/// When the present step and the route are expected to end: `in 12 s, all in 1 min 3 s`.
pub fn expected_text(progress: &RouteProgress, now_s: f64) -> String {
    let step = progress.current.and_then(|current| progress.steps.get(current)?.end_s);
    let within = |end_s: f64| format!("in {}", format_duration((end_s - now_s).max(0.0)));
    match (progress.stand == RouteStand::Ended, step, progress.end_s()) {
        (true, ..) => String::new(),
        (_, Some(step_s), Some(end_s)) if end_s > step_s => {
            format!("{}, all {}", within(step_s), within(end_s))
        }
        (_, Some(step_s), _) => within(step_s),
        (_, None, Some(end_s)) => format!("all {}", within(end_s)),
        (_, None, None) => "not known".to_owned(),
    }
}

/// `by 1 min: 46 s left`, or how much it is expected to be missed by.
pub fn limit_text(limit: &LimitOutlook) -> String {
    let words = &limit.words;
    match limit.left_s {
        None => words.clone(),
        Some(left_s) if left_s < 0.0 => format!("{words}: missed by {}", format_duration(-left_s)),
        Some(left_s) => format!("{words}: {} left", format_duration(left_s)),
    }
}

/// `5.0 of 20.0 m`.
pub fn done_text(progress: &RouteProgress) -> String {
    format!("{:.1} of {:.1} m", progress.done_m, progress.total_m)
}

/// `in yard, 1.2 m to pit`.
pub fn zones_text(zones: &[ZoneNearby]) -> String {
    let words = zones.iter().take(MAX_ZONES).map(|zone| {
        let name = &zone.zone;
        match (zone.kind, zone.is_inside) {
            (ZoneKind::StayIn, true) => format!("{:.1} m within {name}", zone.distance_m),
            (ZoneKind::StayIn, false) => format!("OUT OF {name}"),
            (ZoneKind::NoGo, true) => format!("WITHIN {name}"),
            (_, true) => format!("in {name}"),
            (_, false) => format!("{:.1} m to {name}", zone.distance_m),
        }
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Whether a robot is where it must not be.
pub fn is_breach(zone: &ZoneNearby) -> bool {
    match zone.kind {
        ZoneKind::NoGo => zone.is_inside,
        ZoneKind::StayIn => !zone.is_inside,
        ZoneKind::Speed | ZoneKind::Observe => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_zones_are_short() {
        assert_eq!([late_text(0.2), late_text(-0.4)], ["on time", "on time"]);
        assert!(late_text(12.0).ends_with(" late") && late_text(-90.0).ends_with(" early"));
        let zone = |name: &str, kind, distance_m, is_inside| ZoneNearby {
            zone: name.into(),
            kind,
            distance_m,
            is_inside,
        };
        let zones = [
            zone("pit", ZoneKind::NoGo, 0.0, true),
            zone("yard", ZoneKind::StayIn, 0.0, false),
            zone("slow", ZoneKind::Speed, 1.26, false),
            zone("far", ZoneKind::Observe, 9.0, false),
        ];
        assert_eq!(zones_text(&zones), "WITHIN pit, OUT OF yard, 1.3 m to slow");
        assert_eq!(zones.iter().filter(|zone| is_breach(zone)).count(), 2);
        let limit = |left_s| LimitOutlook { words: "by 9 s".into(), at_s: 9.0, left_s };
        assert_eq!(limit_text(&limit(None)), "by 9 s");
        assert!(limit_text(&limit(Some(-2.0))).starts_with("by 9 s: missed by 2"));
    }
}
