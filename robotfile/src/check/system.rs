//! The requirements on a system that need no manifests: unique names, links between components that
//! exist, every input fed at most once.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use crate::check::names::KnownNames;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Component, Link, System};
use crate::source::Spanned;

/// The names that no component may have: those under which Armor's own programs register and log, and the name of the combined log.
pub const RESERVED_NAMES: [&str; 6] =
    ["registry", "configd", "configuration", "executive", "launcher", "all"];

/// The highest rate that a component keeps: a period of 100 µs, about twice the time in which a
/// thread is woken.
const HIGHEST_RATE_HZ: f64 = 10_000.0;
/// The interval at which a process reports the duration of its current call.
const WATCHDOG_MEASURED: Duration = Duration::from_millis(500);

/// Keeps the first of several components with one name, so that nothing is checked against the
/// others.
pub(super) fn keep_first(system: &mut System, findings: &mut Findings) {
    let names = system.components.iter().map(|component| &component.name);
    KnownNames::collect("component", Code::DuplicateComponent, names, findings);
    let mut seen = BTreeSet::new();
    system.components.retain(|component| seen.insert(component.name.value.clone()));
}

pub(super) fn check(system: &System, manifests: Option<&Manifests>, findings: &mut Findings) {
    let names = system.components.iter().map(|component| &component.name);
    let names = KnownNames::collect("component", Code::DuplicateComponent, names, findings);
    let names = names.including(&system.unreadable).of_kinds(&system.components);
    for component in &system.components {
        parameters_once(component, findings);
        possible_times(component, findings);
        report_nice_in_real_time(component, findings);
        report_cpu_without_effect(component, findings);
        if RESERVED_NAMES.contains(&component.name.value.as_str()) {
            let message = format!("{} is a reserved name", component.name.value);
            let finding = Finding::new(Code::ReservedName, &component.name.at, message);
            findings.push(finding.remedy("give the component another name"));
        }
    }
    similar_names(system, findings);
    check_hosts(system, findings);
    for link in &system.links {
        names.expect(&link.from.component, Code::UnknownComponent, findings);
        names.expect(&link.to.component, Code::UnknownComponent, findings);
    }
    if let Some(clock) = &system.clock {
        names.expect(&clock.source.component, Code::UnknownComponent, findings);
    }
    inputs_fed_once(system, manifests, findings);
}

/// Each host once, each component on one that there is, each host with a component.
fn check_hosts(system: &System, findings: &mut Findings) {
    let names = system.hosts.iter().map(|host| &host.name);
    let hosts = KnownNames::collect("host", Code::DuplicateHost, names, findings);
    let hosts = hosts.including(&system.unreadable);
    let mut used = BTreeSet::new();
    for host in system.components.iter().filter_map(|component| component.host.as_ref()) {
        if !hosts.expect(host, Code::UnknownHost, findings) {
            // It may stand for one that looks unused.
            used.extend(hosts.known.keys());
        }
        used.insert(host.value.as_str());
    }
    for host in system.hosts.iter().filter(|host| !used.contains(host.name.value.as_str())) {
        let message = format!("no component runs on the host {}", host.name.value);
        let finding = Finding::new(Code::UnusedHost, &host.name.at, message);
        let name = &host.name.value;
        let remedy = format!("write host=\"{name}\" at a component, or remove the host");
        findings.push(finding.remedy(remedy));
    }
}

/// A system of a file without errors, in which every component was read.
pub(super) fn expect_components(system: &System, findings: &mut Findings) {
    if let Some(at) = system.at.as_ref().filter(|_| system.components.is_empty()) {
        let finding = Finding::new(Code::NoComponents, at, "the system has no components");
        findings.push(finding.remedy("add a <component name=\"…\" kind=\"…\"/>"));
    }
}

/// The rate and the watchdog against what a process can do and the launcher can measure.
fn possible_times(component: &Component, findings: &mut Findings) {
    let name = &component.name.value;
    if let Some(rate) = component.rate_hz.as_ref().filter(|rate| rate.value > HIGHEST_RATE_HZ) {
        let message = format!(
            "`{}` is too high: {name} will be called less often than {} times per second",
            rate.at.text(),
            rate.value
        );
        let finding = Finding::new(Code::RateTooHigh, &rate.at, message);
        findings.push(finding.remedy("write at most 10kHz; or publish several values in one call"));
    }
    let is_short = |watchdog: &&Spanned<Duration>| watchdog.value < WATCHDOG_MEASURED;
    if let Some(watchdog) = component.watchdog.as_ref().filter(is_short) {
        let message = format!(
            "`{}` is too short: the duration of a call is measured only every 0.5 s",
            watchdog.at.text()
        );
        let finding = Finding::new(Code::WatchdogTooShort, &watchdog.at, message);
        findings.push(finding.remedy("write 0.5s or more"));
    }
}

/// Niceness is only for processes that are not in real time.
fn report_nice_in_real_time(component: &Component, findings: &mut Findings) {
    let limits = &component.resources;
    if let (Some(nice), Some(_)) = (&limits.nice, &limits.realtime) {
        let message = "nice has no effect on a process in real time";
        let finding = Finding::new(Code::NoEffect, &nice.at, message);
        findings.push(finding.remedy("remove it, or remove realtime"));
    }
}

/// The kernel limits the time of processes that are not in real time, and no process uses more than all
/// of the processors on which it may run.
fn report_cpu_without_effect(component: &Component, findings: &mut Findings) {
    let limits = &component.resources;
    let Some(cpu) = &limits.cpu else { return };
    if limits.realtime.is_some() {
        let message = "cpu does not limit a process in real time";
        let finding = Finding::new(Code::NoEffect, &cpu.at, message);
        findings.push(finding.remedy("remove it, or remove realtime"));
        return;
    }
    let Some(cpus) = &limits.cpus else { return };
    let count = cpus.value.len();
    if cpu.value.permille as usize >= count * 1000 {
        let message = format!(
            "`{}` is no limit: cpus names {count} processor{}, which are {count}00% together",
            cpu.at.text(),
            if count == 1 { "" } else { "s" }
        );
        let finding = Finding::new(Code::NoEffect, &cpu.at, message);
        findings.push(finding.remedy(format!("write less than {count}00%, or remove it")));
    }
}

/// `Laser` and `laser` are easy to confuse, and on some file systems they share a log file.
fn similar_names(system: &System, findings: &mut Findings) {
    let mut known: BTreeMap<String, &Spanned<String>> = BTreeMap::new();
    for name in system.components.iter().map(|component| &component.name) {
        let first = *known.entry(name.value.to_ascii_lowercase()).or_insert(name);
        if first.value != name.value {
            let message =
                format!("{} and {} differ only in upper and lower case", first.value, name.value);
            let finding = Finding::new(Code::SimilarNames, &name.at, message);
            findings.push(
                finding.remedy("give one of them another name").related(&first.at, "the other one"),
            );
        }
    }
}

fn parameters_once(component: &Component, findings: &mut Findings) {
    let names = component.parameters.iter().map(|parameter| &parameter.name);
    KnownNames::collect("parameter", Code::DuplicateParameter, names, findings);
}

/// An input has one link, unless its kind declares that it takes many; then each of its links has
/// another source. Which inputs take many is not known without manifests.
fn inputs_fed_once(system: &System, manifests: Option<&Manifests>, findings: &mut Findings) {
    let mut fed: BTreeMap<_, Vec<&Link>> = BTreeMap::new();
    for link in &system.links {
        let input = (link.to.component.value.as_str(), link.to.port.value.as_str());
        let others = fed.entry(input).or_default();
        let is_same = |other: &&&Link| other.from.data() == link.from.data();
        let (first, message) = if let Some(first) = others.iter().find(is_same) {
            let (input, data) = (link.to.data(), link.from.data());
            (Some(first), format!("the input {input} is fed twice by {data}"))
        } else {
            let takes_one = takes_many(system, manifests, input) == Some(false);
            let first = others.last().filter(|_| takes_one);
            (first, format!("the input {} is fed twice", link.to.data()))
        };
        if let Some(first) = first {
            let finding = Finding::new(Code::InputFedTwice, &link.to.at, message);
            findings.push(
                finding.remedy("remove one of the two links").related(&first.to.at, "first here"),
            );
        }
        others.push(link);
    }
}

/// Whether any number of links may feed the input; none if its kind is not known.
fn takes_many(
    system: &System,
    manifests: Option<&Manifests>,
    (component, input): (&str, &str),
) -> Option<bool> {
    let kind = manifests?.get(&system.component(component)?.kind.value)?;
    Some(kind.inputs.iter().any(|it| it.id == input && it.many))
}
