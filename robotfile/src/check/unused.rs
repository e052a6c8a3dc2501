//! Unused parts: outputs that no link uses, components that nothing refers to.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::Message;
use armor_wire::clock::Clock;
use armor_wire::manifest::{Manifest, PortManifest};

use crate::check::names::listed;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::{Guard, Name};
use crate::manifests::Manifests;
use crate::model::{Component, Configuration, Link, System};
use crate::typed_manifests::TypedManifests;

/// The type of messages that report how far a component is: for the screen of an operator, and for
/// `armor echo`. Most systems link none of them.
const FOR_PEOPLE: &str = "Progress";

pub(super) fn check(configuration: &Configuration, manifests: &Manifests, findings: &mut Findings) {
    let mut used = Used::of(configuration);
    let typed = TypedManifests::of(&configuration.system, manifests);
    for component in &configuration.system.components {
        let is_any = |it: &&PortManifest| it.is_any();
        let kind = manifests.get(&component.kind.value);
        let Some(output) = kind.and_then(|kind| kind.outputs.iter().find(is_any)) else { continue };
        let name = component.name.value.as_str();
        let resolved =
            typed.find(name).and_then(|it| it.outputs.iter().find(|o| o.id == output.id));
        used.passing.extend(resolved.filter(|it| !it.is_any()).map(|it| (name, it.clone())));
    }
    let mut free = free_inputs(&configuration.system, manifests);
    // That a component has no link at all is a finding of its own.
    free.values_mut().for_each(|inputs| inputs.retain(|it| used.components.contains(it.component)));
    let mut outputs = Vec::new();
    let mut first = None;
    for component in &configuration.system.components {
        if let Some(manifest) = manifests.get(&component.kind.value) {
            let unused = used.check_component(component, manifest, &free, findings);
            first = first.or((!unused.is_empty()).then_some(&component.name.at));
            outputs.extend(unused);
        }
    }
    // One note for the file: almost every robot leaves outputs unused.
    if let Some(at) = first {
        // What a free input would take is named first, as the list is shortened.
        outputs.sort_by_key(|(_, is_wanted)| !is_wanted);
        let message = format!("no link uses {}", listed(outputs.iter().map(|(it, _)| it.as_str())));
        let finding = Finding::new(Code::UnusedOutput, at, message);
        findings
            .push(finding.remedy("link what is needed; if nothing is missing, ignore this note"));
    }
}

/// The inputs that no link feeds, by the hash of the schema that they take.
type FreeInputs<'a> = BTreeMap<u64, Vec<FreeInput<'a>>>;

/// An input that no link feeds.
struct FreeInput<'a> {
    component: &'a str,
    input: &'a str,
}

fn free_inputs<'a>(system: &'a System, manifests: &'a Manifests) -> FreeInputs<'a> {
    let fed: BTreeSet<_> = system
        .links
        .iter()
        .map(|link| (link.to.component.value.as_str(), link.to.port.value.as_str()))
        .collect();
    let mut free: FreeInputs<'a> = BTreeMap::new();
    for component in &system.components {
        let name = component.name.value.as_str();
        let inputs = manifests.get(&component.kind.value).into_iter().flat_map(|it| &it.inputs);
        for input in inputs.filter(|input| !fed.contains(&(name, input.id.as_str()))) {
            let of_schema = free.entry(input.schema_hash).or_default();
            of_schema.push(FreeInput { component: name, input: &input.id });
        }
    }
    free
}

/// Returns one of the outputs, and an input of another component that takes its data.
fn fitting_input(
    component: &str,
    outputs: &[&PortManifest],
    free: &FreeInputs<'_>,
) -> Option<(String, String)> {
    outputs.iter().find_map(|output| {
        let mut inputs = free.get(&output.schema_hash)?.iter();
        let input = inputs.find(|input| input.component != component)?;
        Some((output.id.clone(), format!("{}.{}", input.component, input.input)))
    })
}

/// The parts of the system that the file refers to.
#[derive(Default)]
struct Used<'a> {
    components: BTreeSet<&'a str>,
    /// Component and output.
    outputs: BTreeSet<(&'a str, &'a str)>,
    /// The same of those that are linked to their own component.
    own_outputs: BTreeSet<(&'a str, &'a str)>,
    /// The outputs that guards and variables use, as `component.output`.
    watched: BTreeSet<String>,
    /// The components that the mission activates.
    activated: BTreeSet<&'a str>,
    /// The components whose reports the mission waits for.
    reporting: BTreeSet<&'a str>,
    /// The first output of each component that passes messages on, with the type of what it passes.
    passing: BTreeMap<&'a str, PortManifest>,
    /// Whether the system has one component only.
    is_alone: bool,
    links: &'a [Link],
}

impl<'a> Used<'a> {
    fn of(configuration: &'a Configuration) -> Self {
        let system = &configuration.system;
        let mut used =
            Self { is_alone: system.components.len() < 2, links: &system.links, ..Self::default() };
        let clock = system.clock.iter().map(|clock| &clock.source);
        used.outputs.extend(clock.map(|from| (&*from.component.value, &*from.port.value)));
        for link in &system.links {
            let (from, to) = (link.from.component.value.as_str(), &link.to.component.value);
            // What a component links to itself is of no use to any other one.
            let outputs = if from == to { &mut used.own_outputs } else { &mut used.outputs };
            outputs.insert((from, &link.from.port.value));
            used.components.insert(from);
        }
        used.components.extend(system.clock.iter().map(|clock| &*clock.source.component.value));
        used.components.extend(system.links.iter().map(|link| link.to.component.value.as_str()));
        for mission in configuration.missions() {
            let sources = mission.variables.iter().filter_map(|variable| variable.source.as_ref());
            let guards = mission.transitions.iter().filter_map(|t| t.when.as_ref());
            for text in sources.chain(guards) {
                let guard = Guard::parse(&text.value);
                let data = guard.iter().flat_map(Guard::names).filter_map(Name::data);
                used.watched.extend(data.map(str::to_owned));
            }
            let in_places = mission.places.iter().flat_map(|place| &place.components);
            used.activated.extend(in_places.map(|name| name.value.as_str()));
            let reporters = mission.transitions.iter().filter_map(|t| t.on.as_ref());
            used.reporting.extend(reporters.map(|on| on.component.value.as_str()));
        }
        used.components.extend(&used.activated);
        used.components.extend(&used.reporting);
        used
    }

    /// The finding for a component that the mission activates and of which no output leads anywhere,
    /// although an output of the same name of another component feeds two inputs: one of the two links
    /// was copied.
    fn find_copied_link(
        &self,
        component: &Component,
        unused: &[&PortManifest],
        manifest: &Manifest,
    ) -> Option<Finding> {
        let name = component.name.value.as_str();
        let is_work = |output: &&PortManifest| {
            output.type_name != FOR_PEOPLE && output.type_name != Clock::NAME
        };
        let work = || manifest.outputs.iter().filter(is_work);
        let unused = || unused.iter().copied().filter(is_work);
        if !self.activated.contains(name) || unused().count() < work().count() {
            return None;
        }
        let links = unused().find_map(|output| {
            let of_name = |link: &&Link| link.from.port.value == output.id;
            let mut by_component: BTreeMap<&str, Vec<&Link>> = BTreeMap::new();
            for link in self.links.iter().filter(of_name) {
                by_component.entry(&link.from.component.value).or_default().push(link);
            }
            by_component.into_values().find(|links| links.len() > 1)
        })?;
        let (first, others) = links.split_first()?;
        let message = format!(
            "{name} is activated by the mission, but no link leads an output of it to another \
             component; {} feeds {} inputs",
            first.from.data(),
            links.len()
        );
        let finding = Finding::new(Code::WorkUnused, &component.name.at, message).remedy(format!(
            "did you mean from=\"{name}.{}\" for one of them?",
            first.from.port.value
        ));
        let finding = finding.related(&first.from.at, "one of the links");
        Some(others.iter().fold(finding, |it, link| it.related(&link.from.at, "another one")))
    }

    /// The finding for a component that passes on what others send to it, none of whose outputs leads
    /// anywhere, while an input that takes such data is free.
    fn find_lost_passage(&self, component: &Component, free: &FreeInputs<'_>) -> Option<Finding> {
        let name = component.name.value.as_str();
        let output = self.passing.get(name).filter(|_| !self.reporting.contains(name))?;
        let is_writer = |link: &&Link| link.to.component.value == name;
        let writers: Vec<_> = self.links.iter().filter(is_writer).collect();
        let writes = |input: &&FreeInput<'_>| {
            input.component == name
                || writers.iter().any(|link| link.from.component.value == input.component)
        };
        // What a writer also sends past it to another input.
        let is_past = |link: &&Link| {
            let is_from_writer = || {
                writers.iter().any(|it| {
                    it.from.component.value == link.from.component.value
                        && it.from.port.value == link.from.port.value
                })
            };
            link.to.component.value != name && is_from_writer()
        };
        let mut past = self.links.iter().filter(is_past);
        if let (Some(link), None) = (past.next(), past.next()) {
            let message = format!(
                "{} leads past {name}, which passes on what {} sends and of which no link leads \
                 anywhere",
                link.from.data(),
                link.from.component.value
            );
            let finding = Finding::new(Code::WorkUnused, &link.from.at, message);
            return Some(
                finding
                    .related(&component.name.at, "this component")
                    .remedy(format!("did you mean from=\"{name}.{}\"?", output.id)),
            );
        }
        let input = free.get(&output.schema_hash)?.iter().find(|input| !writes(input))?;
        let from = listed(writers.iter().map(|link| link.from.component.value.as_str()));
        let message = format!(
            "{name} passes on what {from} sends, but no link leads an output of it to another component"
        );
        let finding = Finding::new(Code::WorkUnused, &component.name.at, message);
        Some(finding.remedy(format!(
            "add a link, such as <link from=\"{name}.{}\" to=\"{}.{}\"/>, which nothing feeds",
            output.id, input.component, input.input
        )))
    }

    /// Returns the outputs that nothing uses, if the component itself is used; with each, whether an
    /// input of another component takes its data and is fed by nothing.
    fn check_component(
        &self,
        component: &Component,
        manifest: &Manifest,
        free: &FreeInputs<'_>,
        findings: &mut Findings,
    ) -> Vec<(String, bool)> {
        let name = component.name.value.as_str();
        let has_ports = !manifest.inputs.is_empty() || !manifest.outputs.is_empty();
        // A required input without a link is an error already.
        let is_refused = manifest.inputs.iter().any(|input| input.required);
        let is_watched =
            manifest.outputs.iter().any(|it| self.watched.contains(&format!("{name}.{}", it.id)));
        let is_idle = !is_watched && !self.components.contains(name);
        if has_ports && !is_refused && !self.is_alone && is_idle {
            let message = format!("{name} is unused: it has no link and is in no place");
            let finding = Finding::new(Code::ComponentIdle, &component.name.at, message);
            findings.push(finding.remedy("link it, or remove it"));
            return Vec::new();
        }
        let unused = |output: &str| {
            !self.outputs.contains(&(name, output))
                && !self.watched.contains(&format!("{name}.{output}"))
        };
        // A clock is used by `<clock>`, not by a link.
        let outputs = manifest.outputs.iter().filter(|output| output.type_name != Clock::NAME);
        let unused: Vec<_> = outputs.clone().filter(|it| unused(&it.id)).collect();
        if unused.len() == outputs.clone().count()
            && self.activated.contains(name)
            && let Some((output, input)) = fitting_input(name, &unused, free)
        {
            let output = format!("{name}.{output}");
            let message = format!(
                "{name} is activated by the mission, but no link leads an output of it to another component"
            );
            let finding = Finding::new(Code::WorkUnused, &component.name.at, message);
            let remedy = format!("<link from=\"{output}\" to=\"{input}\"/>, which nothing feeds");
            findings.push(finding.remedy(format!("add a link, such as {remedy}")));
            return Vec::new();
        }
        if unused.len() == outputs.count()
            && let Some(finding) = self.find_lost_passage(component, free)
        {
            findings.push(finding);
            return Vec::new();
        }
        if let Some(finding) = self.find_copied_link(component, &unused, manifest) {
            findings.push(finding);
            return Vec::new();
        }
        let is_own = |output: &str| self.own_outputs.contains(&(name, output));
        let unused = unused.iter().filter(|it| it.type_name != FOR_PEOPLE && !is_own(&it.id));
        let named = unused.map(|output| {
            let is_wanted = fitting_input(name, &[*output], free).is_some();
            (format!("{name}.{}", output.id), is_wanted)
        });
        named.collect()
    }
}
