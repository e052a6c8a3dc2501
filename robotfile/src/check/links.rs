//! Links as they work together: who is never called, who may wait for whom, which queue may be too
//! short. Only what the file by itself makes certain is a warning.

use std::collections::BTreeMap;

use armor_wire::keep::Keep;

use crate::code::Code;
use crate::finding::{Finding, Findings};
use crate::model::{Component, Link, LinkMode, System};

/// Links of a circle that are shown beside its last one.
const MAX_SHOWN: usize = 8;
/// Circles that are reported: whoever breaks these sees the next ones.
const MAX_CIRCLES: usize = 8;

pub(super) fn check(system: &System, findings: &mut Findings) {
    let components: BTreeMap<&str, &Component> =
        system.components.iter().map(|c| (c.name.value.as_str(), c)).collect();
    never_called(system, findings);
    for link in &system.links {
        short_queue(link, &components, findings);
    }
    Circles::of(system).report(findings);
}

/// Without a rate a component is called after data; a link that pulls brings it some only then.
fn never_called(system: &System, findings: &mut Findings) {
    let mut pushed: BTreeMap<&str, bool> = BTreeMap::new();
    for link in &system.links {
        *pushed.entry(&link.to.component.value).or_default() |= link.mode == LinkMode::Push;
    }
    for component in system.components.iter().filter(|component| component.rate_hz.is_none()) {
        let name = component.name.value.as_str();
        if pushed.get(name) == Some(&false) && !system.doubts.is_half_read(name) {
            let message = format!(
                "{name} is never called: it has no rate, and its links pull, which they do when it is called"
            );
            let finding = Finding::new(Code::NeverCalled, &component.name.at, message);
            findings.push(
                finding.remedy("give it a rate, such as rate=\"10Hz\", or let one link push"),
            );
        }
    }
}

/// While its reader works, for one period at most, data wait in the queue.
fn short_queue(link: &Link, components: &BTreeMap<&str, &Component>, findings: &mut Findings) {
    let rate_hz = |name: &str| Some(components.get(name)?.rate_hz.as_ref()?.value);
    let (Keep::Last { count }, LinkMode::Push, Some(at)) = (link.keep, link.mode, &link.keep_at)
    else {
        return;
    };
    let (from, to) = (&link.from.component.value, &link.to.component.value);
    let (Some(from_hz), Some(to_hz)) = (rate_hz(from), rate_hz(to)) else { return };
    let may_come = (from_hz / to_hz - 1e-9).ceil();
    if f64::from(count) < may_come {
        let message = format!(
            "{may_come} of {} may come while {to} works for one period, and this queue holds {count}",
            link.from.data()
        );
        let finding = Finding::new(Code::ShortQueue, at, message);
        let remedy =
            format!("write keep=\"{may_come}\", or keep=\"latest\" if only the newest counts");
        findings.push(finding.remedy(remedy));
    }
}

/// The links with `keep="all"`, by the number of the component they start from.
struct Circles<'a> {
    links: Vec<Vec<(usize, &'a Link)>>,
}

impl<'a> Circles<'a> {
    fn of(system: &'a System) -> Self {
        let numbers: BTreeMap<&str, usize> =
            system.components.iter().zip(0..).map(|(c, n)| (c.name.value.as_str(), n)).collect();
        let number = |name: &str| numbers.get(name).copied();
        let mut links = vec![Vec::new(); system.components.len()];
        for link in &system.links {
            let ends = (number(&link.from.component.value), number(&link.to.component.value));
            if let ((Some(from), Some(to)), Keep::All, LinkMode::Push) =
                (ends, link.keep, link.mode)
            {
                links[from].push((to, link));
            }
        }
        Self { links }
    }

    /// Walks in depth; a link back to where the walk came from closes a circle.
    fn report(&self, findings: &mut Findings) {
        let mut is_done = vec![false; self.links.len()];
        let mut on_way = vec![None; self.links.len()];
        let mut circles = 0;
        for start in 0..self.links.len() {
            // Each step: a component, how many of its links were followed, and the one led here.
            let mut way: Vec<(usize, usize, Option<&Link>)> = Vec::new();
            if !is_done[start] {
                on_way[start] = Some(0);
                way.push((start, 0, None));
            }
            while let Some((here, followed, _)) = way.last_mut() {
                let here = *here;
                let Some(&(next, link)) = self.links[here].get(*followed) else {
                    is_done[here] = true;
                    on_way[here] = None;
                    way.pop();
                    continue;
                };
                *followed += 1;
                if let Some(since) = on_way[next] {
                    let others = way[since + 1..].iter().filter_map(|(_, _, link)| *link);
                    report_circle(link, others, findings);
                    circles += 1;
                    if circles == MAX_CIRCLES {
                        return;
                    }
                } else if !is_done[next] {
                    on_way[next] = Some(way.len());
                    way.push((next, 0, Some(link)));
                }
            }
        }
    }
}

fn report_circle<'a>(last: &Link, others: impl Iterator<Item = &'a Link>, findings: &mut Findings) {
    let message = "these links drop nothing and go in a circle: when all are full, everybody waits for everybody";
    let mut finding = Finding::new(Code::KeepAllCircle, &last.from.at, message)
        .remedy("write keep=\"latest\" or a number on one of them");
    for link in others.take(MAX_SHOWN) {
        finding = finding.related(&link.from.at, "and from here");
    }
    findings.push(finding);
}
