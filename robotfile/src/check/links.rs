//! The interplay of links: components that are never called, components that may wait for each
//! other, queues that may be too short. Only what the file alone makes certain is a warning.

use std::collections::BTreeMap;

use armor_wire::datagram::MAX_RESENT;
use armor_wire::keep::Keep;

use crate::check::graph::CheckGraph;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Component, Link, LinkMode, System, Transport};

/// Links of a circle that are shown in addition to its last one.
const MAX_SHOWN: usize = 8;
/// Circles that are reported. When these are broken, the next ones are.
const MAX_CIRCLES: usize = 8;

pub(super) fn check(system: &System, findings: &mut Findings) {
    let components: BTreeMap<&str, &Component> =
        system.components.iter().map(|c| (c.name.value.as_str(), c)).collect();
    never_called(system, findings);
    for link in &system.links {
        short_queue(link, &components, findings);
        report_apart(link, &components, findings);
        check_datagrams(link, findings);
    }
}

/// Without a rate a component is called after data; a link that pulls brings it some only then.
fn never_called(system: &System, findings: &mut Findings) {
    let mut pushed: BTreeMap<&str, bool> = BTreeMap::new();
    for link in &system.links {
        *pushed.entry(&link.to.component.value).or_default() |= link.mode == LinkMode::Push;
    }
    for component in system.components.iter().filter(|component| component.rate_hz.is_none()) {
        let name = component.name.value.as_str();
        if pushed.get(name) == Some(&false) && !system.unreadable.is_half_read(name) {
            let message = format!(
                "{name} is never called: it has no rate, and all its links pull, which fetches data only when it is called"
            );
            let finding = Finding::new(Code::NeverCalled, &component.name.at, message);
            findings.push(
                finding.remedy("give it a rate, such as rate=\"10Hz\", or make one link push"),
            );
        }
    }
}

/// From this multiple of a queue's length on, the rates are doubted.
const FAR_TOO_SHORT: f64 = 5.0;
/// The label of a rate that a queue is too short for.
const RATE: &str = "this rate";

/// Merges the queues of one reader that are too short: its rate is one value.
pub(super) fn merge_short_queues(findings: &mut Findings) {
    let rate = |finding: &Finding| finding.related.get(1).map(|(at, _)| at.span);
    findings.merge_same(|first, other| {
        [first.code, other.code] == [Code::ShortQueue; 2]
            && rate(first).is_some()
            && rate(first) == rate(other)
    });
}

/// While its reader works, for one period at most, data wait in the queue.
fn short_queue(link: &Link, components: &BTreeMap<&str, &Component>, findings: &mut Findings) {
    let rate_hz = |name: &str| Some(components.get(name)?.rate_hz.as_ref()?.value);
    let (Keep::Last { count }, LinkMode::Push, Some(at)) =
        (link.find_policy(), link.mode, &link.keep_at)
    else {
        return;
    };
    let (from, to) = (&link.from.component.value, &link.to.component.value);
    let (Some(from_hz), Some(to_hz)) = (rate_hz(from), rate_hz(to)) else { return };
    let may_come = (from_hz / to_hz - 1e-9).ceil();
    if f64::from(count) < may_come {
        let message = format!(
            "{may_come} of {} may arrive in one period of {to}, and this queue has room for {count}",
            link.from.data()
        );
        let finding = Finding::new(Code::ShortQueue, at, message);
        let mut remedy =
            format!("write keep=\"{may_come}\", or keep=\"latest\" if only the newest is needed");
        if may_come > FAR_TOO_SHORT * f64::from(count) {
            remedy = format!(
                "are the rates right? {from} works at {from_hz} Hz, and {to} at {to_hz} Hz. If they \
                 are, {remedy}"
            );
        }
        let rates = [from, to].map(|name| components.get(name.as_str())?.rate_hz.as_ref());
        let rates = rates.into_iter().flatten();
        findings.push(rates.fold(finding.remedy(remedy), |it, rate| it.related(&rate.at, RATE)));
    }
}

/// Two hosts share no memory; between them a link uses TCP.
fn report_apart(link: &Link, components: &BTreeMap<&str, &Component>, findings: &mut Findings) {
    let (Transport::Shm, Some(at)) = (link.transport, &link.transport_at) else { return };
    let (from, to) = (&link.from.component.value, &link.to.component.value);
    let component = |name: &str| components.get(name).copied();
    let (Some(sender), Some(receiver)) = (component(from), component(to)) else { return };
    let host = |of: &Component| of.host.as_ref().map(|host| host.value.clone());
    if host(sender) == host(receiver) {
        return;
    }
    let name = |of: &Component| match host(of) {
        Some(host) => format!("on host {host}"),
        None => "on the host of armor run".to_owned(),
    };
    let finding = Finding::new(Code::NoEffect, at, "transport has no effect here");
    findings.push(finding.remedy(format!(
        "{from} is {} and {to} {}, and hosts share no memory: remove transport",
        name(sender),
        name(receiver)
    )));
}

/// Datagrams that are lost are sent again while they may be of use, and not for ever.
fn check_datagrams(link: &Link, findings: &mut Findings) {
    let (Transport::Udp, LinkMode::Push, Some(at)) = (link.transport, link.mode, &link.keep_at)
    else {
        return;
    };
    let (message, remedy) = match link.keep {
        Keep::All { .. } => (
            "datagrams (transport=\"udp\") cannot keep all data".to_owned(),
            format!(
                "write transport=\"tcp\", or keep=\"3\" to send the newest 3 again until they have \
                 arrived, at most {MAX_RESENT}"
            ),
        ),
        Keep::Last { count } if count > MAX_RESENT => (
            format!(
                "datagrams (transport=\"udp\") keep at most {MAX_RESENT} messages, not {count}"
            ),
            format!("write keep=\"{MAX_RESENT}\" or less, or transport=\"tcp\""),
        ),
        _ => return,
    };
    findings.push(Finding::new(Code::DatagramsKeep, at, message).remedy(remedy));
}

/// Links that drop nothing make their sender wait. In a circle of them, each component may wait for
/// the next one. A link from a component to itself is probably meant for another component, and so
/// may be a link that is an error.
pub(super) fn check_circles(system: &System, findings: &mut Findings) {
    let names = system.components.iter().map(|component| component.name.value.as_str());
    let waiting =
        system.links.iter().filter(|link| link.keep.is_all() && link.mode == LinkMode::Push);
    let edges = waiting
        .map(|link| (link.from.component.value.as_str(), link.to.component.value.as_str(), link));
    for circle in CheckGraph::new(names, edges).find_circles(MAX_CIRCLES) {
        if let Some((last, others)) = circle.split_last() {
            report_circle(last, others, findings);
        }
    }
    for link in &system.links {
        let (from, to) = (&link.from.component, &link.to.component);
        if from.value == to.value && !(link.keep.is_all() && link.mode == LinkMode::Push) {
            let message = format!("{} receives what it publishes itself", from.value);
            let finding = Finding::new(Code::LinkToItself, &link.from.at, message);
            let remedy = "link an output of another component here, or remove the link";
            findings.push(finding.remedy(remedy));
        }
    }
}

fn report_circle(last: &Link, others: &[&Link], findings: &mut Findings) {
    let message = "these links drop nothing and form a circle: when all queues are full, each component waits for the next";
    let mut finding = Finding::new(Code::KeepAllCircle, &last.from.at, message)
        .remedy("write keep=\"latest\" or a number on one of them");
    for link in others.iter().take(MAX_SHOWN) {
        finding = finding.related(&link.from.at, "and from here");
    }
    findings.push(finding);
}
