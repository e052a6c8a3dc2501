//! What a net's drawing states in words: conditions of transitions, components of places.

use armor_proof::time_in_words as time;
use armor_robotfile::mission::{Autonomy, Class, Interval, LostLink, Missed, Place, Transition};

/// What a transition waits for, a line for each condition, as in the file.
pub fn conditions(transition: &Transition) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(on) = &transition.on {
        lines.push(format!("on {}.{}", on.component.value, on.event.value));
    }
    if let Some(interval) = &transition.interval {
        lines.push(interval_words(&interval.value));
    }
    if let Some(when) = &transition.when {
        lines.push(format!("when {}", when.value));
    }
    match transition.autonomy {
        Autonomy::Auto => {}
        Autonomy::Operator => lines.push("operator".into()),
        Autonomy::Confirm { within: None, .. } => lines.push("asks the operator".into()),
        Autonomy::Confirm { within: Some(within), fire_unanswered } => {
            let then = if fire_unanswered { "then fires" } else { "then declines" };
            lines.push(format!("asks for {}, {then}", time(within)));
        }
    }
    if let Some(LostLink::Fire) = transition.lost_link.as_deref() {
        lines.push("or without a link".into());
    }
    if let Some(date) = &transition.not_before {
        lines.push(format!("not before {}", date.at.text()));
    }
    if let Some(date) = &transition.not_after {
        let missed = match transition.missed.as_deref() {
            Some(Missed::Fire) => ", then late",
            Some(Missed::Fail) => ", then fails",
            _ => "",
        };
        lines.push(format!("not after {}{missed}", date.at.text()));
    }
    for set in &transition.sets {
        lines.push(format!("sets {} = {}", set.variable.value, set.value.value));
    }
    if transition.priority != 0 {
        lines.push(format!("priority {}", transition.priority));
    }
    if transition.class == Class::Safety {
        lines.push("safety".into());
    }
    lines
}

/// When a transition fires, counted from when it is enabled.
pub fn interval_words(interval: &Interval) -> String {
    match interval.latest {
        Some(latest) if latest == interval.earliest => format!("after {}", time(latest)),
        Some(latest) => format!("{} to {}", time(interval.earliest), time(latest)),
        None => format!("after {} or later", time(interval.earliest)),
    }
}

/// The components of a place on lines of about this many characters, at most four of them.
pub fn component_lines(place: &Place, width: usize) -> Vec<String> {
    const MOST: usize = 4;
    let mut lines: Vec<String> = Vec::new();
    for component in &place.components {
        match lines.last_mut() {
            Some(line) if line.chars().count() + component.value.len() < width => {
                line.push_str(", ");
                line.push_str(&component.value);
            }
            _ => lines.push(component.value.clone()),
        }
    }
    if lines.len() > MOST {
        let shown: usize = lines[..MOST - 1].iter().map(|line| line.split(", ").count()).sum();
        lines.truncate(MOST - 1);
        lines.push(format!("and {} more", place.components.len() - shown));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_condition_is_a_line() {
        let file = r#"<armor version="1"><system/><mission><place name="a" components="b c d e f g"/>
            <transition name="t" from="a" on="b.done" interval="[2s,90s]" when="x &lt; 1"
                autonomy="confirm" answer-within="30s" lost-link="fire" priority="-2" class="safety"
                not-before="2026-01-01T00:00Z" not-after="2027-01-01T00:00Z" missed="fail"/>
            <transition name="u" from="a" after="1min" operator="true"/>
            <transition name="v" from="a" timeout="0.5s"/></mission></armor>"#;
        let mission = crate::mission::read_text(file).mission.unwrap();
        let lines: Vec<_> = mission.transitions.iter().map(conditions).collect();
        assert_eq!(
            lines[0],
            [
                "on b.done",
                "2 s to 1 min 30 s",
                "when x < 1",
                "asks for 30 s, then declines",
                "or without a link",
                "not before 2026-01-01T00:00Z",
                "not after 2027-01-01T00:00Z, then fails",
                "priority -2",
                "safety"
            ]
        );
        assert_eq!(lines[1], ["after 1 min or later", "operator"]);
        assert_eq!(lines[2], ["after 0.5 s"]);
        assert_eq!(component_lines(&mission.places[0], 1), ["b", "c", "d", "and 3 more"]);
        assert_eq!(component_lines(&mission.places[0], 100), ["b, c, d, e, f, g"]);
    }
}
