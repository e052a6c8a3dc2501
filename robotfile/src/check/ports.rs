//! Links against the ports of the kinds that they join: the ports exist, the direction is right,
//! the types match, and every required input is fed.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::clock::Clock;
use armor_wire::manifest::{Manifest, PortManifest};
use armor_wire::name::is_name;
use armor_wire::schema::difference;
use armor_wire::{Message, WireType};

use crate::check::any_type;
use crate::check::manifests::unknown;
use crate::check::names::listed;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Component, Link, Port, System};
use crate::typed_manifests::TypedManifests;
use crate::unreadable::UnreadableParts;

pub(super) fn check_link(
    link: &Link,
    kinds: &BTreeMap<&str, &Manifest>,
    typed: &TypedManifests<'_>,
    system: &System,
    findings: &mut Findings,
) {
    if is_exchanged(link, kinds) {
        let (from, to) = (link.from.data(), link.to.data());
        let message = format!("this link leads from an input, {from}, to an output, {to}");
        let finding = Finding::new(Code::WrongDirection, &link.from.at, message);
        findings.push(
            finding
                .remedy(format!("swap them: from=\"{to}\" to=\"{from}\""))
                .related(&link.to.at, "the output"),
        );
        return;
    }
    let output = find_output(&link.from, kinds, findings);
    let input = find_input(&link.to, kinds, findings);
    if let (Some(output), None) = (output, input) {
        advise_input(link, output, kinds, system, findings);
    }
    let (Some(output), Some(input)) = (output, input) else { return };
    if is_same_type(output, input) {
        return;
    }
    if let Some(first) = typed.first_link(&link.to) {
        findings.extend(any_type::report_writer((link, first), output, input, kinds, system));
    } else if !any_type::follows_from_writers(link, input, kinds, typed, system) {
        let meant = kinds.get(link.to.component.value.as_str()).and_then(|kind| {
            kind.inputs.iter().find(|other| other.required && is_same_type(output, other))
        });
        let finding = report_mismatch(link, output, input, meant);
        findings.push(any_type::explain_origin(finding, link, typed, system));
    }
}

/// Names the only input of the component that takes the data and is not fed, in the place of an
/// output at which the link ends.
fn advise_input(
    link: &Link,
    output: &PortManifest,
    kinds: &BTreeMap<&str, &Manifest>,
    system: &System,
    findings: &mut Findings,
) {
    let component = &link.to.component.value;
    let is_fed = |input: &PortManifest| {
        let mut links = system.links.iter();
        links.any(|it| it.to.component.value == *component && it.to.port.value == input.id)
    };
    let inputs = kinds.get(component.as_str()).into_iter().flat_map(|kind| &kind.inputs);
    let mut fits = inputs.filter(|it| is_same_type(output, it) && !it.is_any() && !is_fed(it));
    let (Some(meant), None) = (fits.next(), fits.next()) else { return };
    let is_it = |it: &&mut Finding| {
        let is_there = it.at.as_ref().is_some_and(|at| at.is_at(&link.to.at));
        it.code == Code::WrongDirection && is_there
    };
    for finding in findings.iter_mut().filter(is_it) {
        finding.remedy =
            format!("did you mean to=\"{component}.{}\"? Otherwise {}", meant.id, finding.remedy);
    }
}

/// Whether an output may feed an input. A type that is not known is no mismatch.
fn is_same_type(output: &PortManifest, input: &PortManifest) -> bool {
    output.is_any()
        || input.is_any()
        || (&output.type_name, output.schema_hash) == (&input.type_name, input.schema_hash)
}

/// Improves the findings about inputs that are fed twice: if one of the two links carries data of
/// another type, that is the finding; if an input that needs such data is not fed, it was probably
/// meant.
pub(super) fn explain_fed_twice(
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let fed: BTreeSet<_> = system
        .links
        .iter()
        .map(|link| (link.to.component.value.as_str(), link.to.port.value.as_str()))
        .collect();
    let wrong: BTreeSet<_> =
        findings.iter().filter(|f| f.code == Code::TypeMismatch).filter_map(place_of).collect();
    let is_wrong = |at: &crate::source::Location| wrong.contains(&(at.source.path(), at.span));
    let mut dropped = BTreeSet::new();
    let mut remedies = BTreeMap::new();
    for finding in findings.iter().filter(|finding| finding.code == Code::InputFedTwice) {
        let Some(place) = place_of(finding) else { continue };
        let first = finding.related.first().map(|(at, _)| at);
        if wrong.contains(&place) || first.is_some_and(is_wrong) {
            dropped.insert((place.0.to_path_buf(), place.1));
            continue;
        }
        let link = system.links.iter().find(|link| link.to.at.span == place.1);
        let output = link.and_then(|link| find_port(&link.from, kinds, true));
        let unfed = output.and_then(|output| {
            system.components.iter().find_map(|component| {
                let name = component.name.value.as_str();
                let mut inputs = kinds.get(name)?.inputs.iter().filter(|input| input.required);
                let is_meant = |input: &&PortManifest| {
                    is_same_type(output, input) && !fed.contains(&(name, input.id.as_str()))
                };
                inputs.find(is_meant).map(|input| format!("{name}.{}", input.id))
            })
        });
        let unfed = unfed.or_else(|| {
            // Of the same component, or where the same data were linked twice, of any other one.
            let (link, output) = (link?, output?);
            let is_repeated = system
                .links
                .iter()
                .filter(|it| it.to.data() == link.to.data() && it.from.data() == link.from.data())
                .count()
                > 1;
            let own = link.to.component.value.as_str();
            let names = system.components.iter().map(|it| it.name.value.as_str());
            names.filter(|name| (*name == own) != is_repeated).find_map(|name| {
                let mut inputs = kinds.get(name)?.inputs.iter();
                let is_meant = |input: &&PortManifest| {
                    is_same_type(output, input)
                        && !fed.contains(&(name, input.id.as_str()))
                        && (!is_repeated || input.id == link.to.port.value)
                };
                inputs.find(is_meant).map(|input| format!("{name}.{}", input.id))
            })
        });
        let unfed = unfed.or_else(|| {
            // Or of another component than the one that sends the data, if it is the only one.
            let other = system.links.iter().find(|it| first.is_some_and(|at| it.to.at.is_at(at)));
            let free = [other, link].into_iter().flatten().flat_map(|link| {
                let output = find_port(&link.from, kinds, true);
                let fed = &fed;
                let names = system.components.iter().map(|it| it.name.value.as_str());
                let names = names.filter(move |name| *name != link.from.component.value);
                names.flat_map(move |name| {
                    let inputs = kinds.get(name).into_iter().flat_map(|it| &it.inputs);
                    let fits = inputs.filter(move |input| {
                        output.is_some_and(|output| is_same_type(output, input))
                            && !input.is_any()
                            && !fed.contains(&(name, input.id.as_str()))
                    });
                    fits.map(move |input| format!("{name}.{}", input.id))
                })
            });
            let mut free = free.collect::<BTreeSet<_>>().into_iter();
            free.next().filter(|_| free.next().is_none())
        });
        // The same output twice: the other link may be from one that nothing uses.
        let unused = first.and_then(|_| find_unused_output(link?, system, kinds));
        if let Some(unused) = unused {
            let remedy = format!("did you mean from=\"{unused}\", which no link uses?");
            remedies.insert((place.0.to_path_buf(), place.1), remedy);
        } else if let Some(unfed) = unfed {
            let remedy = format!("was one meant for {unfed}, which nothing feeds?");
            remedies.insert((place.0.to_path_buf(), place.1), remedy);
        }
    }
    let key = |finding: &Finding| {
        let place = place_of(finding).filter(|_| finding.code == Code::InputFedTwice);
        place.map(|(path, span)| (path.to_path_buf(), span))
    };
    findings.retain(|finding| key(finding).is_none_or(|place| !dropped.contains(&place)));
    for finding in findings.iter_mut() {
        if let Some(remedy) = key(finding).and_then(|place| remedies.remove(&place)) {
            finding.remedy = format!("{remedy} Otherwise {}", finding.remedy);
        }
    }
}

/// Returns the only output of this type that no link uses, of another component with the same port,
/// where two links are alike.
fn find_unused_output(
    link: &Link,
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
) -> Option<String> {
    let is_alike =
        |it: &&Link| it.from.data() == link.from.data() && it.to.data() == link.to.data();
    if system.links.iter().filter(is_alike).count() < 2 {
        return None;
    }
    let output = find_port(&link.from, kinds, true)?;
    let all = system.components.iter().flat_map(|component| {
        let name = component.name.value.as_str();
        let outputs = kinds.get(name).into_iter().flat_map(|kind| &kind.outputs);
        outputs.map(move |it| (name, it))
    });
    let is_used = |name: &str, port: &str| {
        let mut links = system.links.iter();
        links.any(|it| it.from.component.value == name && it.from.port.value == port)
    };
    let mut unused = all.filter(|(name, it)| {
        is_same_type(output, it) && it.id == output.id && !it.is_any() && !is_used(name, &it.id)
    });
    let (Some((name, port)), None) = (unused.next(), unused.next()) else { return None };
    Some(format!("{name}.{}", port.id))
}

/// Merges a link to an input of another type with the input that takes its data and that nothing
/// feeds, if there is one: it is meant.
pub(super) fn explain_unfed(
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let mut explained = Vec::new();
    for finding in findings.iter_mut().filter(|it| it.code == Code::TypeMismatch) {
        let is_its = |link: &&Link| finding.at.as_ref().is_some_and(|at| link.to.at.is_at(at));
        let Some(link) = system.links.iter().find(is_its) else { continue };
        let Some(output) = find_port(&link.from, kinds, true) else { continue };
        let is_fed = |name: &str, id: &str| {
            let mut links = system.links.iter();
            links.any(|it| it.to.component.value == name && it.to.port.value == id)
        };
        let mut meant = system.components.iter().flat_map(|component| {
            let kind = kinds.get(component.name.value.as_str());
            let inputs = kind.into_iter().flat_map(|kind| {
                kind.inputs.iter().filter(|input| {
                    let mut groups = kind.needs_one_of.iter();
                    input.required || groups.any(|it| it.contains(&input.id))
                })
            });
            let name = component.name.value.as_str();
            inputs
                .filter(move |it| is_same_type(output, it) && !it.is_any() && !is_fed(name, &it.id))
                .map(move |input| (component, input))
        });
        let Some((component, input)) = meant.next().filter(|_| meant.next().is_none()) else {
            continue;
        };
        let name = &component.name;
        finding.remedy = format!(
            "did you mean to=\"{}.{}\"? It takes {}, and nothing feeds it",
            name.value, input.id, output.type_name
        );
        explained.push((name.at.clone(), format!("{}.{}", name.value, input.id)));
    }
    findings.retain(|finding| {
        let is_it = |(at, input): &(crate::source::Location, String)| {
            finding.at.as_ref().is_some_and(|it| it.is_at(at))
                && (finding.message.contains(input) || finding.remedy.contains(input))
        };
        finding.code != Code::InputUnfed || !explained.iter().any(is_it)
    });
}

fn place_of(finding: &Finding) -> Option<(&std::path::Path, crate::source::Span)> {
    finding.at.as_ref().map(|at| (at.source.path(), at.span))
}

/// Returns whether the link starts at an input and ends at an output.
fn is_exchanged(link: &Link, kinds: &BTreeMap<&str, &Manifest>) -> bool {
    let is_among =
        |ports: &[PortManifest], port: &Port| ports.iter().any(|p| p.id == port.port.value);
    let kind = |port: &Port| kinds.get(port.component.value.as_str());
    let (Some(from), Some(to)) = (kind(&link.from), kind(&link.to)) else { return false };
    let only_input = is_among(&from.inputs, &link.from) && !is_among(&from.outputs, &link.from);
    let only_output = is_among(&to.outputs, &link.to) && !is_among(&to.inputs, &link.to);
    only_input && only_output
}

fn report_mismatch(
    link: &Link,
    output: &PortManifest,
    input: &PortManifest,
    meant: Option<&PortManifest>,
) -> Finding {
    let (from, to) = (link.from.data(), link.to.data());
    let (message, remedy) = if output.type_name == input.type_name {
        // Two versions of one type: the reader needs to see the fields that differ.
        let differ = difference((&from, &output.schema), (&to, &input.schema));
        (
            format!(
                "{from} cannot feed {to}: both use the name {} for different messages",
                output.type_name
            ),
            format!(
                "build both components with the same message; {}",
                differ.lines().collect::<Vec<_>>().join("; ")
            ),
        )
    } else {
        (
            format!(
                "{from} cannot feed {to}: it publishes {}, and {to} takes {}",
                output.type_name, input.type_name
            ),
            match meant {
                Some(meant) => format!(
                    "{}.{} takes {}; or link an output of {} here",
                    link.to.component.value,
                    meant.id,
                    output.type_name,
                    describe_type(input)
                ),
                None => format!(
                    "link an output of {} here; `armor describe` lists them",
                    describe_type(input)
                ),
            },
        )
    };
    let finding = Finding::new(Code::TypeMismatch, &link.to.at, message);
    finding.remedy(remedy).related(&link.from.at, "from here")
}

/// `type Scan`, or `any type`.
fn describe_type(input: &PortManifest) -> String {
    match input.is_any() {
        true => "any type".to_owned(),
        false => format!("type {}", input.type_name),
    }
}

/// The source of the system's time: an output of type `Clock`.
pub(super) fn check_clock(
    source: &Port,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let Some(output) = find_output(source, kinds, findings) else { return };
    let (data, name, schema) = (source.data(), &output.type_name, Clock::schema().to_string());
    let is_clock = |it: &&PortManifest| it.type_name == Clock::NAME && it.schema == schema;
    if is_clock(&output) {
        return;
    }
    let message = if name == Clock::NAME {
        let differ = difference((&data, &output.schema), ("a clock", &schema));
        format!("{data} cannot be the clock: {}", differ.lines().collect::<Vec<_>>().join("; "))
    } else {
        format!(
            "{data} cannot be the clock: it publishes {name}, and a clock publishes {}",
            Clock::NAME
        )
    };
    let finding = Finding::new(Code::TypeMismatch, &source.at, message);
    let clocks = kinds.iter().flat_map(|(component, manifest)| {
        let clocks = manifest.outputs.iter().filter(is_clock);
        clocks.map(move |output| format!("{component}.{}", output.id))
    });
    let clocks: Vec<_> = clocks.collect();
    let remedy = match clocks.as_slice() {
        [] => "no component here publishes a clock; without <clock> the time is the host's".into(),
        clocks => format!("these publish a clock: {}", listed(clocks.iter().map(String::as_str))),
    };
    findings.push(finding.remedy(remedy));
}

pub(super) fn find_output<'a>(
    port: &Port,
    kinds: &BTreeMap<&str, &'a Manifest>,
    findings: &mut Findings,
) -> Option<&'a PortManifest> {
    let manifest = kinds.get(port.component.value.as_str())?;
    let found = manifest.outputs.iter().find(|output| output.id == port.port.value);
    if found.is_none() {
        missing_port(
            port,
            manifest,
            &manifest.inputs,
            &manifest.outputs,
            ["output", "input"],
            findings,
        );
    }
    found
}

fn find_input<'a>(
    port: &Port,
    kinds: &BTreeMap<&str, &'a Manifest>,
    findings: &mut Findings,
) -> Option<&'a PortManifest> {
    let manifest = kinds.get(port.component.value.as_str())?;
    let found = manifest.inputs.iter().find(|input| input.id == port.port.value);
    if found.is_none() {
        missing_port(
            port,
            manifest,
            &manifest.outputs,
            &manifest.inputs,
            ["input", "output"],
            findings,
        );
    }
    found
}

fn missing_port(
    port: &Port,
    manifest: &Manifest,
    others: &[PortManifest],
    wanted: &[PortManifest],
    [noun, other_noun]: [&str; 2],
    findings: &mut Findings,
) {
    if others.iter().any(|other| other.id == port.port.value) {
        let message = format!("{} is an {other_noun}", port.data());
        let finding = Finding::new(Code::WrongDirection, &port.at, message);
        findings.push(finding.remedy("a link goes from=\"an output\" to=\"an input\""));
    } else {
        let noun = format!("{noun} of {}", manifest.kind);
        unknown(
            Code::UnknownPort,
            &port.port,
            &noun,
            wanted.iter().map(|port| port.id.as_str()),
            findings,
        );
    }
}

/// Which inputs are fed, also those that a mistaken link was probably meant for.
pub(super) struct Fed<'a> {
    /// Component and port at either end of a link: the ends may be exchanged.
    ends: BTreeSet<(&'a str, &'a str)>,
    /// Ends that are not there, in the component or in the port.
    mistaken: Vec<(&'a str, &'a str)>,
    /// The components and data types of links to an input of another type: they may be meant for
    /// another input of the component.
    misdirected: BTreeSet<(&'a str, u64)>,
    /// The data types of links to an input that another link feeds too: one of them may be meant for
    /// an input of another component.
    doubled: BTreeSet<u64>,
    /// What could not be read.
    unreadable: &'a UnreadableParts,
}

impl<'a> Fed<'a> {
    pub(super) fn of(system: &'a System, kinds: &BTreeMap<&str, &Manifest>) -> Self {
        let links = &system.links;
        let components: BTreeSet<_> =
            system.components.iter().map(|c| c.name.value.as_str()).collect();
        let name = |port: &'a Port| (port.component.value.as_str(), port.port.value.as_str());
        let ends = links.iter().flat_map(|link| [&link.from, &link.to]).map(name).collect();
        let is_there = |(component, port): &(&str, &str)| match kinds.get(component) {
            Some(kind) => kind.inputs.iter().chain(&kind.outputs).any(|known| known.id == *port),
            // Of an unknown kind any port may be there.
            None => components.contains(component) || system.unreadable.may_contain(component),
        };
        let is_output = |(component, port): &(&str, &str)| {
            let kind = kinds.get(component);
            kind.is_some_and(|kind| kind.outputs.iter().any(|known| known.id == *port))
        };
        let to = links.iter().map(|link| name(&link.to));
        let mut fed = Self {
            ends,
            mistaken: to.filter(|end| !is_there(end) || is_output(end)).collect(),
            misdirected: BTreeSet::new(),
            doubled: BTreeSet::new(),
            unreadable: &system.unreadable,
        };
        let mut seen = BTreeSet::new();
        for link in links {
            let is_second = !seen.insert(name(&link.to));
            let ends = (find_port(&link.from, kinds, true), find_port(&link.to, kinds, false));
            let (Some(output), Some(input)) = ends else { continue };
            if !is_same_type(output, input) {
                fed.misdirected.insert((&link.to.component.value, output.schema_hash));
            } else if is_second && !input.many {
                fed.doubled.insert(output.schema_hash);
            }
        }
        fed
    }

    /// Whether a link ends at a port of the component that is no input.
    pub(super) fn has_mistaken(&self, component: &str) -> bool {
        self.mistaken.iter().any(|(other, _)| *other == component)
    }

    fn is_fed(&self, component: &str, input: &PortManifest) -> bool {
        let name = input.id.as_str();
        self.unreadable.may_feed(component, name)
            || self.ends.contains(&(component, name))
            || self.misdirected.contains(&(component, input.schema_hash))
            || self.doubled.contains(&input.schema_hash)
            || self.mistaken.iter().any(|(other, port)| *other == component || *port == name)
    }
}

pub(super) fn find_port<'a>(
    port: &Port,
    kinds: &BTreeMap<&str, &'a Manifest>,
    is_output: bool,
) -> Option<&'a PortManifest> {
    let manifest = kinds.get(port.component.value.as_str())?;
    let ports = if is_output { &manifest.outputs } else { &manifest.inputs };
    ports.iter().find(|known| known.id == port.port.value)
}

pub(super) fn required_inputs(
    component: &Component,
    manifest: &Manifest,
    fed: &Fed<'_>,
    findings: &mut Findings,
) {
    let name = &component.name;
    if !is_name(&name.value) {
        // Links may name it as it was meant; that it is malformed is a finding already.
        return;
    }
    let inputs = manifest.inputs.iter().filter(|input| input.required);
    for input in inputs.filter(|input| !fed.is_fed(&name.value, input)) {
        let message =
            format!("nothing feeds {}.{}, which {} needs", name.value, input.id, manifest.kind);
        let finding = Finding::new(Code::InputUnfed, &name.at, message);
        let remedy = format!(
            "add <link from=\"…\" to=\"{}.{}\"/>, from an output of {}",
            name.value,
            input.id,
            describe_type(input)
        );
        findings.push(finding.remedy(remedy));
    }
}
