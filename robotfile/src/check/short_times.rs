//! Timeouts that end before a component of their place was called even once.

use std::time::Duration;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{Autonomy, Mission, Place, Transition};
use crate::model::System;

/// Checks the transitions that leave a place with components after a time.
pub(super) fn check(mission: &Mission, system: &System, findings: &mut Findings) {
    for transition in &mission.transitions {
        let Some(interval) = &transition.interval else { continue };
        let Some(latest) = interval.value.latest.filter(|latest| !latest.is_zero()) else {
            continue;
        };
        let [from] = transition.inputs().collect::<Vec<_>>()[..] else { continue };
        let Some(place) = mission.place(&from.place.value).filter(|_| is_timeout(transition))
        else {
            continue;
        };
        // One that is shorter still is a finding already.
        let is_known = findings.iter().any(|finding| {
            finding.code == Code::TimeTooShort
                && finding.at.as_ref().is_some_and(|at| at.is_at(&interval.at))
        });
        let Some((component, period)) = find_slowest(place, system).filter(|_| !is_known) else {
            continue;
        };
        if latest < period {
            let (name, text) = (&transition.name.value, interval.at.text());
            let message = format!(
                "`{text}` is too short: {name} leaves {} before {component} is called, every {:?}",
                place.name.value, period
            );
            let finding = Finding::new(Code::TimeTooShort, &interval.at, message);
            findings.push(finding.remedy("write a longer time: is the unit right?"));
        }
    }
}

fn is_timeout(transition: &Transition) -> bool {
    transition.on.is_none() && transition.when.is_none() && transition.autonomy == Autonomy::Auto
}

/// The component of the place that is called least often, and its period.
fn find_slowest<'a>(place: &'a Place, system: &System) -> Option<(&'a str, Duration)> {
    let periods = place.components.iter().filter_map(|name| {
        let rate = system.component(&name.value)?.rate_hz.as_ref()?;
        let period = Duration::try_from_secs_f64(1.0 / rate.value).ok()?;
        Some((name.value.as_str(), period))
    });
    periods.max_by_key(|(_, period)| *period)
}
