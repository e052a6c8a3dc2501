//! Dates that have passed. The caller supplies the current time.

use crate::code::Code;
use crate::date::Date;
use crate::finding::Finding;
use crate::mission::Missed;
use crate::model::Configuration;

/// A finding for each transition whose last date has passed at `now`, in sub-missions too.
pub fn passed_dates(configuration: &Configuration, now: Date) -> Vec<Finding> {
    let transitions = configuration.missions().flat_map(|mission| &mission.transitions);
    let passed = transitions.filter_map(|transition| {
        let last = transition.not_after.as_ref().filter(|last| last.value <= now)?;
        // Dates in the wrong order are a finding of their own.
        if transition.not_before.as_ref().is_some_and(|first| first.value >= last.value) {
            return None;
        }
        let name = &transition.name.value;
        let missed = transition.missed.as_deref().copied().unwrap_or_default();
        let so = match missed {
            Missed::Fire => format!("{name} fires once, late"),
            Missed::Skip => format!("{name} never fires"),
            Missed::Fail => {
                format!("the mission goes to its safe place as soon as tokens wait for {name}")
            }
        };
        let message = format!("{} has passed: {so}", last.at.text());
        let finding = Finding::new(Code::DatePassed, &last.at, message);
        let finding = finding.remedy("write a date in the future");
        Some(if missed == Missed::Skip { finding.stops_transition() } else { finding })
    });
    passed.collect()
}
