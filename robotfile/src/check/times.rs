//! Times of drawn routes: limits that exclude each other or may be missed, meetings that wait for each
//! other, and batteries that do not last.

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::System;
use crate::time_words::{estimate_in_words, time_in_words};
use crate::timing::{
    DriveLengths, EnduranceGap, OpenTime, StraightLengths, TimeConflict, TimeShortage, Timetable,
    find_endurance_gap,
};

/// Most parts of a conflict that a message names; all are marked.
const MAX_PARTS: usize = 6;

/// Checks the times of a mission whose drives are straight.
pub(super) fn check(mission: &Mission, system: &System, findings: &mut Findings) {
    check_mission(mission, system, &StraightLengths, findings);
}

/// Checks the times of a mission with drives of these lengths. The check of a file assumes straight ones.
pub fn check_times(mission: &Mission, system: &System, lengths: &dyn DriveLengths) -> Findings {
    let mut findings = Findings::default();
    check_mission(mission, system, lengths, &mut findings);
    findings
}

fn check_mission(
    mission: &Mission,
    system: &System,
    lengths: &dyn DriveLengths,
    findings: &mut Findings,
) {
    if mission.routes.is_empty() {
        return;
    }
    let table = Timetable::of_mission(mission, system, lengths, None);
    if let Some(first) = table.circle.first() {
        let names: Vec<_> = table.circle.iter().map(|(name, _)| name.as_str()).collect();
        let message = format!("these meetings wait for each other: {}", names.join("; "));
        let finding = Finding::new(Code::MeetingsInCircle, &first.1, message);
        let finding = finding.remedy("bring the meetings into one order in all routes");
        let others = table.circle.iter().skip(1);
        findings.push(others.fold(finding, |finding, (_, at)| finding.related(at, "and this one")));
    }
    if let Some(conflict) = &table.conflict {
        findings.push(report_conflict(conflict));
    }
    for shortage in &table.shortages {
        findings.push(report_shortage(shortage));
    }
    for route in &mission.routes {
        if let Some(gap) = find_endurance_gap(mission, route, system, lengths) {
            let endurance = route.endurance.as_ref();
            let of = endurance.map(|it| time_in_words(it.value)).unwrap_or_default();
            let finding = report_gap(&gap, &of);
            findings.push(match endurance {
                Some(endurance) => finding.related(&endurance.at, "this endurance"),
                None => finding,
            });
        }
    }
}

fn report_conflict(conflict: &TimeConflict) -> Finding {
    let words = conflict.parts.iter().map(|(words, _)| words.as_str());
    let named: Vec<_> = words.take(MAX_PARTS).collect();
    let more = conflict.parts.len().saturating_sub(MAX_PARTS);
    let rest = if more > 0 { format!("; and {more} more") } else { String::new() };
    let lacking = estimate_in_words(conflict.excess_ns);
    let message = format!("{lacking} are missing: {}{rest}", named.join("; "));
    let at = &conflict.parts[conflict.limit].1;
    let finding = Finding::new(Code::TimesConflict, at, message);
    let finding = finding.remedy("allow more time, or drive faster or less between");
    let others = conflict.parts.iter().enumerate().filter(|(number, _)| *number != conflict.limit);
    others.fold(finding, |finding, (_, (words, at))| finding.related(at, words.clone()))
}

fn report_shortage(shortage: &TimeShortage) -> Finding {
    let lacking = estimate_in_words(shortage.lacking_ns);
    let message = format!(
        "{} may be {lacking} late at the slowest: it has {}",
        shortage.step, shortage.words
    );
    Finding::new(Code::TimeMayLack, &shortage.at, message)
        .remedy("allow more time, drive faster, or state a smaller tolerance at the <route>")
        .related(&shortage.step_at, "this step")
}

fn report_gap(gap: &EnduranceGap, endurance: &str) -> Finding {
    match gap {
        EnduranceGap::Empty { step, used_ns, exit: Some((to, drive_ns)), at } => {
            let (used, drive) = (estimate_in_words(*used_ns), estimate_in_words(*drive_ns));
            let message = format!(
                "at the end of {step} the robot has driven up to {used}, and {to} is up to {drive} \
                 away: its battery lasts {endurance}"
            );
            Finding::new(Code::BatteryEmpty, at, message)
                .remedy(format!("draw a rally point nearer to {step}, or shorten the route"))
        }
        EnduranceGap::Empty { step, used_ns, exit: None, at } => {
            let used = estimate_in_words(*used_ns);
            let message = format!("{step} may end after {used}, and the battery lasts {endurance}");
            Finding::new(Code::BatteryEmpty, at, message)
                .remedy("shorten the route, or the times that its steps may take")
        }
        EnduranceGap::Open { step, what, at } => {
            let (what, remedy) = match what {
                OpenTime::Leg => {
                    ("the speed is not known", "write by=\"1min\" or speed=\"0.5m/s\" at the leg")
                }
                OpenTime::Date => ("it waits for a date", "leave endurance out"),
                OpenTime::Stay => ("only a report ends it", "write for=\"1min\" as well"),
                OpenTime::Meeting => ("it may wait without end", "write patience=\"1min\""),
                OpenTime::Drive(to) => {
                    let message = format!(
                        "whether the battery lasts from {step} to {to} is not known: that drive has \
                         no longest time"
                    );
                    return Finding::new(Code::BatteryOpen, at, message)
                        .remedy("write rally-by=\"1min\" at the <route>");
                }
            };
            let message = format!("whether the battery lasts beyond {step} is not known: {what}");
            Finding::new(Code::BatteryOpen, at, message).remedy(remedy)
        }
    }
}
