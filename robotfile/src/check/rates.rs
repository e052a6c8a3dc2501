//! Time in the system: rates that are too low for what reads the data, circles that no rate starts, and
//! time that runs faster in one component than in all others.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::Message;
use armor_wire::clock::Clock;
use armor_wire::manifest::ParameterValue;

use crate::check::graph::CheckGraph;
use crate::check::names::{joined, listed};
use crate::check::starved::is_about;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Component, Link, LinkMode, Parameter, Port, System};
use crate::typed_manifests::TypedManifests;

/// The parameter with which a kind that publishes a clock states how fast its time runs.
const CLOCK_SPEED: &str = "speed";

/// The rate of a component that is surely a mistake, as a multiple of that with which time moves, if
/// nothing states how fast the time of its source runs.
const MOST_PER_STEP: f64 = 10.0;
/// The same where the file states it: a component is called once per step at most.
const MOST_AT_SPEED: f64 = 1.5;

/// Circles that are reported. When these are broken, the next ones are.
const MAX_CIRCLES: usize = 8;

/// Checks the rates of the system against its manifests.
pub(super) fn check(system: &System, manifests: &Manifests, findings: &mut Findings) {
    let typed = TypedManifests::of(system, manifests);
    for link in &system.links {
        match typed.passed_input(&link.from) {
            None => findings.extend(find_slow_producer(&link.from, link, system, manifests)),
            // What it passes on comes when its writers publish, whatever its own rate.
            Some(input) => {
                let is_writer = |it: &&Link| {
                    it.to.component.value == link.from.component.value && it.to.port.value == input
                };
                let writers = system.links.iter().filter(is_writer).map(|writer| &writer.from);
                let direct = writers.filter(|from| typed.passed_input(from).is_none());
                findings.extend(
                    direct.filter_map(|from| find_slow_producer(from, link, system, manifests)),
                );
            }
        }
    }
    for component in system.components.iter().filter(|component| component.rate_hz.is_none()) {
        let name = &component.name;
        let needs_rate = manifests.get(&component.kind.value).is_some_and(|kind| kind.needs_rate);
        let is_known = findings.iter().any(|it| is_about(it, Code::NeverCalled, &name.at));
        // One without a connected input is called at 10 Hz.
        let is_fed = system.links.iter().any(|it| it.to.component.value == name.value);
        if needs_rate && is_fed && !is_known && !system.unreadable.is_half_read(&name.value) {
            let message = format!(
                "{} has no rate: a {} works at its rate, and not when data arrive",
                name.value, component.kind.value
            );
            let finding = Finding::new(Code::NeverCalled, &name.at, message);
            findings.push(finding.remedy("give it a rate, such as rate=\"20Hz\""));
        }
    }
    // One rate is one mistake, however many components take the data.
    let place = |finding: &Finding| finding.at.as_ref().map(|at| at.span);
    findings.merge_same(|first, other| {
        [first.code, other.code] == [Code::RateTooLow; 2] && place(first) == place(other)
    });
    // And so is one time that a consumer states for several.
    findings.merge_same(|first, other| {
        let time = |finding: &Finding| finding.related.get(1).map(|(at, _)| at.span);
        [first.code, other.code] == [Code::RateTooLow; 2]
            && time(first).is_some()
            && time(first) == time(other)
    });
    check_waiting_circles(system, manifests, findings);
    match &system.clock {
        Some(clock) => check_steps(&clock.source, system, findings),
        None => check_speeds(system, manifests, findings),
    }
}

/// Components without a rate are called by data. In a circle of them in which each requires data of the
/// one before, none is ever called.
fn check_waiting_circles(system: &System, manifests: &Manifests, findings: &mut Findings) {
    let has_rate =
        |name: &str| system.component(name).is_none_or(|component| component.rate_hz.is_some());
    let is_required = |link: &&Link| {
        let kind = system.component(&link.to.component.value);
        let kind = kind.and_then(|component| manifests.get(&component.kind.value));
        kind.is_some_and(|kind| {
            kind.inputs.iter().any(|input| input.id == link.to.port.value && input.required)
        })
    };
    let mut required: BTreeMap<_, Vec<&str>> = BTreeMap::new();
    for link in system.links.iter().filter(is_required) {
        let input = (link.to.component.value.as_str(), link.to.port.value.as_str());
        required.entry(input).or_default().push(&link.from.component.value);
    }
    let all = system.components.iter().map(|component| component.name.value.as_str());
    let mut waiting: BTreeSet<&str> = all.filter(|name| !has_rate(name)).collect();
    // One all of whose inputs have a source that is called is called too.
    loop {
        let waits = |name: &str| {
            let inputs = required.iter().filter(|(input, _)| input.0 == name);
            inputs.into_iter().any(|(_, from)| from.iter().all(|source| waiting.contains(source)))
        };
        let still: BTreeSet<_> = waiting.iter().copied().filter(|name| waits(name)).collect();
        if still.len() == waiting.len() {
            break;
        }
        waiting = still;
    }
    let links = system.links.iter().filter(is_required).filter(|link| link.mode == LinkMode::Push);
    let edges = links
        .map(|link| (link.from.component.value.as_str(), link.to.component.value.as_str(), link));
    let circles = CheckGraph::new(waiting.iter().copied(), edges).find_circles(MAX_CIRCLES);
    for circle in circles {
        // A link from a component to itself is a finding of its own.
        let [first, _, ..] = circle.as_slice() else { continue };
        let names = listed(circle.iter().map(|link| link.from.component.value.as_str()));
        let Some(component) = system.component(&first.from.component.value) else { continue };
        let message = format!(
            "nothing calls {names}: they have no rate, and each requires data of another of them"
        );
        let finding = Finding::new(Code::NeverCalled, &component.name.at, message);
        let finding = circle.iter().fold(finding, |it, link| it.related(&link.to.at, "this input"));
        let remedy = "give the one that can begin without data a rate, such as rate=\"10Hz\"";
        findings.push(finding.remedy(remedy));
    }
}

/// A component with a rate publishes once per period, as far as the file can show. One without a rate
/// publishes when it is called by data.
///
/// `from` is the output from which the data of the link come, perhaps through a component that passes
/// them on.
fn find_slow_producer(
    from: &Port,
    link: &Link,
    system: &System,
    manifests: &Manifests,
) -> Option<Finding> {
    let producer = system.component(&from.component.value)?;
    let consumer = system.component(&link.to.component.value)?;
    let rate = producer.rate_hz.as_ref()?;
    let kind = manifests.get(&consumer.kind.value)?;
    let input = kind.inputs.iter().find(|input| input.id == link.to.port.value)?;
    let assigned = |name: &str| Some(consumer.parameter(name)?.value.value.as_str());
    let age_s = kind.stale_after_s(input, assigned)?;
    let speed = find_speed(producer, system);
    let period_s = speed / rate.value;
    if period_s < age_s {
        return None;
    }
    let passed = match from.at.is_at(&link.from.at) {
        true => String::new(),
        false => format!(", which {} passes on,", link.from.component.value),
    };
    let from = from.data();
    let time = if speed == 1.0 { "s" } else { "s of the system's time" };
    let message = format!(
        "{} is called every {} {time}, but {} takes {from}{passed} for missing after {} s",
        producer.name.value,
        shorten(period_s),
        consumer.name.value,
        shorten(age_s)
    );
    let is_parameter = kind.parameters.iter().any(|parameter| parameter.name == input.stale_after);
    let mut remedy = format!("give {} a higher rate", producer.name.value);
    if is_parameter {
        remedy += &format!(", or {} a longer {}", consumer.name.value, input.stale_after);
    }
    let finding = Finding::new(Code::RateTooLow, &rate.at, message);
    let finding = finding.remedy(remedy).related(&link.to.at, "this input");
    Some(match consumer.parameter(&input.stale_after) {
        Some(given) => finding.related(&given.value.at, "this time"),
        None => finding,
    })
}

/// Returns how fast the system's time runs for its source, which is called by the host's clock; 1 for
/// any other component.
fn find_speed(producer: &Component, system: &System) -> f64 {
    let is_source =
        system.clock.as_ref().is_some_and(|it| it.source.component.value == producer.name.value);
    let given = producer.parameter(CLOCK_SPEED).filter(|_| is_source);
    let speed = given.and_then(|given| given.value.value.trim().parse::<f64>().ok());
    speed.filter(|speed| *speed > 0.0).unwrap_or(1.0)
}

fn shorten(seconds: f64) -> f64 {
    (seconds * 1000.0).round() / 1000.0
}

/// Time that follows data moves in steps, so nothing is called much more often than these come. Up to
/// ten times the rate of its source is no finding: with `speed` below 1 the steps are shorter.
fn check_steps(source: &Port, system: &System, findings: &mut Findings) {
    let Some(clock) = system.component(&source.component.value) else { return };
    let Some(steps) = &clock.rate_hz else { return };
    // That it is too low for what takes the data is the finding then.
    if findings.iter().any(|it| is_about(it, Code::RateTooLow, &steps.at)) {
        return;
    }
    let speed = find_speed(clock, system);
    let most = if clock.parameter(CLOCK_SPEED).is_some() { MOST_AT_SPEED } else { MOST_PER_STEP };
    // In the system's time, which is that of the rates.
    let steps_hz = steps.value / speed;
    let highest = most * steps_hz;
    if let Some(speed) = clock.parameter(CLOCK_SPEED)
        && let Some(finding) = find_coarse_steps(clock, speed, source, steps_hz, system)
    {
        return findings.push(finding.related(&steps.at, "the rate of these steps"));
    }
    for component in system.components.iter().filter(|it| it.name.value != clock.name.value) {
        let Some(rate) = component.rate_hz.as_ref().filter(|rate| rate.value > highest) else {
            continue;
        };
        if findings.iter().any(|it| is_about(it, Code::RateTooHigh, &rate.at)) {
            continue;
        }
        let name = &component.name.value;
        let message = format!(
            "`{}` is too high: time follows {}, which moves it {} times per second, and {name} is \
             called at these steps",
            rate.at.text(),
            source.data(),
            shorten(steps_hz)
        );
        let finding = Finding::new(Code::RateTooHigh, &rate.at, message);
        findings.push(
            finding
                .remedy(format!("write a lower rate, or a higher one for {}", clock.name.value))
                .related(&steps.at, "the rate of these steps"),
        );
    }
    // A queue that is too short for a rate which is too high is long enough for the right one.
    let too_high: Vec<_> = findings
        .iter()
        .filter(|finding| finding.code == Code::RateTooHigh)
        .filter_map(|finding| finding.at.clone())
        .collect();
    findings.retain(|finding| {
        let mut rates = finding.related.iter().map(|(at, _)| at);
        finding.code != Code::ShortQueue || !rates.any(|at| too_high.iter().any(|it| it.is_at(at)))
    });
    let step = |finding: &Finding| finding.related.first().map(|(at, _)| at.span);
    findings.merge_same(|first, other| {
        [first.code, other.code] == [Code::RateTooHigh; 2]
            && step(first).is_some()
            && step(first) == step(other)
    });
}

/// Of several components that are called less often than their rates, because the speed of time makes its
/// steps long, the speed is the one mistake; at its usual speed they would not be.
fn find_coarse_steps(
    clock: &Component,
    speed: &Parameter,
    source: &Port,
    steps_hz: f64,
    system: &System,
) -> Option<Finding> {
    let others = system.components.iter().filter(|it| it.name.value != clock.name.value);
    let rates: Vec<_> =
        others.filter_map(|it| Some((it.rate_hz.as_ref()?, it.name.value.as_str()))).collect();
    let is_above = |highest: f64| rates.iter().filter(move |it| it.0.value > highest);
    let factor = find_speed(clock, system);
    let names: Vec<_> = is_above(MOST_AT_SPEED * steps_hz).map(|it| it.1).collect();
    if names.len() < 2 || is_above(MOST_AT_SPEED * steps_hz * factor).next().is_some() {
        return None;
    }
    let fastest = rates.iter().map(|it| it.0.value).fold(0.0, f64::max);
    let most = (MOST_AT_SPEED * steps_hz * factor / fastest * 10.0).floor() / 10.0;
    let message = format!(
        "{CLOCK_SPEED}: with {} time follows {} in steps of {} s, {} per second, and {} are called at \
         these steps, not at their rates",
        speed.value.value,
        source.data(),
        shorten(1.0 / steps_hz),
        shorten(steps_hz),
        joined(names.iter().copied())
    );
    let finding = Finding::new(Code::RateTooHigh, &speed.value.at, message);
    Some(finding.remedy(format!(
        "write a lower speed, {most} at most, or a higher rate for {}",
        clock.name.value
    )))
}

/// Without `<clock>` all components are on the host's clock, so one whose time runs at another speed
/// is alone with it.
fn check_speeds(system: &System, manifests: &Manifests, findings: &mut Findings) {
    for component in &system.components {
        let Some(kind) = manifests.get(&component.kind.value) else { continue };
        let clock = kind.outputs.iter().find(|output| output.type_name == Clock::NAME);
        let speed = kind.parameters.iter().find(|it| it.name == CLOCK_SPEED && it.unit.is_empty());
        let (Some(clock), Some(speed), Some(given)) =
            (clock, speed, component.parameter(CLOCK_SPEED))
        else {
            continue;
        };
        let Ok(ParameterValue::Number(number)) = speed.parse(&given.value.value) else { continue };
        // That it does nothing at all is the finding then.
        let mut effects = kind.value_effects.iter();
        let is_idle = number == 0.0 && effects.any(|it| it.parameter == CLOCK_SPEED);
        if (number - 1.0).abs() < 1e-9 || is_idle {
            continue;
        }
        let name = &component.name.value;
        let message = format!(
            "the time of {name} runs {number} times as fast as that of all other components, which \
             follow the host's clock"
        );
        let finding = Finding::new(Code::SpeedUnfollowed, &given.value.at, message);
        findings.push(finding.remedy(format!(
            "add <clock source=\"{name}.{}\"/> to the system, or remove this parameter",
            clock.id
        )));
    }
}
