//! Links at components that take messages of any type and pass them on: their writers have one type, and
//! what comes out has it too.

use std::collections::BTreeMap;

use armor_wire::manifest::{Manifest, PortManifest};
use armor_wire::schema::difference;

use crate::check::names::joined;
use crate::check::ports::find_port;
use crate::code::Code;
use crate::finding::Finding;
use crate::model::{Link, System};
use crate::typed_manifests::TypedManifests;

/// A further writer of another type than the first one. If all others have one type, the first one is
/// wrong, which is one finding.
pub(super) fn report_writer(
    (link, first): (&Link, &Link),
    output: &PortManifest,
    input: &PortManifest,
    kinds: &BTreeMap<&str, &Manifest>,
    system: &System,
) -> Option<Finding> {
    let (from, to, before) = (link.from.data(), link.to.data(), first.from.data());
    let is_other = |it: &&Link| it.to.data() == to && !it.from.at.is_at(&first.from.at);
    let others: Vec<_> = system.links.iter().filter(is_other).collect();
    let is_alike = |it: &&Link| {
        find_port(&it.from, kinds, true).is_some_and(|other| {
            (&other.type_name, other.schema_hash) == (&output.type_name, output.schema_hash)
        })
    };
    if others.len() > 1 && others.iter().all(is_alike) {
        let is_second = others.first().is_some_and(|it| it.from.at.is_at(&link.from.at));
        let names = joined(others.iter().map(|it| it.from.component.value.as_str()));
        let message = format!(
            "{before} gives {to} the type {}, and all other writers, {names}, publish {}",
            input.type_name, output.type_name
        );
        let finding = Finding::new(Code::WritersDiffer, &first.from.at, message);
        let finding =
            others.iter().fold(finding, |it, other| it.related(&other.from.at, "another"));
        let remedy = format!("link an output of type {} here", output.type_name);
        return is_second.then(|| finding.remedy(remedy));
    }
    let (message, remedy) = if output.type_name == input.type_name {
        let differ = difference((&from, &output.schema), (&before, &input.schema));
        (
            format!("{from} and {before} use the name {} for different messages", input.type_name),
            format!(
                "build both components with the same message; {}",
                differ.lines().collect::<Vec<_>>().join("; ")
            ),
        )
    } else {
        (
            format!(
                "{to} has the type {} of {before}, and {from} publishes {}",
                input.type_name, output.type_name
            ),
            format!(
                "link outputs of one type here, or use a second {} for {}",
                link.to.component.value, output.type_name
            ),
        )
    };
    let finding = Finding::new(Code::WritersDiffer, &link.from.at, message);
    Some(finding.remedy(remedy).related(&first.from.at, "the first link gives the type"))
}

/// Returns whether a link from a component that passes messages on would fit if another one of its
/// writers were the first: that the writers differ is a finding already.
pub(super) fn follows_from_writers(
    link: &Link,
    input: &PortManifest,
    kinds: &BTreeMap<&str, &Manifest>,
    typed: &TypedManifests<'_>,
    system: &System,
) -> bool {
    let mut writers = writers_of(link, typed, system);
    writers.any(|writer| {
        find_port(&writer.from, kinds, true).is_some_and(|output| {
            (&output.type_name, output.schema_hash) == (&input.type_name, input.schema_hash)
        })
    })
}

/// Adds where a component that passes messages on has its type from.
pub(super) fn explain_origin(
    finding: Finding,
    link: &Link,
    typed: &TypedManifests<'_>,
    system: &System,
) -> Finding {
    match writers_of(link, typed, system).next() {
        Some(first) => finding.related(&first.from.at, "it passes on what comes from here"),
        None => finding,
    }
}

/// The links whose messages the producer of a link passes on.
fn writers_of<'a>(
    link: &'a Link,
    typed: &TypedManifests<'a>,
    system: &'a System,
) -> impl Iterator<Item = &'a Link> {
    let component = link.from.component.value.as_str();
    let passed = typed.passed_input(&link.from);
    let is_writer = move |writer: &&Link| {
        writer.to.component.value == component && Some(writer.to.port.value.as_str()) == passed
    };
    system.links.iter().filter(is_writer)
}
