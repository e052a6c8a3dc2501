//! Inputs that are fed twice, or by data of another type, while another input, which is not fed, takes
//! these data: that one was probably meant.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use armor_wire::manifest::{Manifest, PortManifest};

use crate::check::ports::{find_port, is_same_type};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Link, System};
use crate::source::{Location, Span};

/// Improves the findings about inputs that are fed twice: if one of the two links carries data of
/// another type, that is the finding; if an input that needs such data is not fed, it was probably
/// meant.
pub(super) fn explain_fed_twice(
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let meant = MeantPorts::new(system, kinds);
    let wrong: BTreeSet<_> =
        findings.iter().filter(|f| f.code == Code::TypeMismatch).filter_map(place_of).collect();
    let is_wrong = |at: &Location| wrong.contains(&(at.source.path(), at.span));
    let mut dropped = BTreeSet::new();
    let mut remedies = BTreeMap::new();
    for finding in findings.iter().filter(|finding| finding.code == Code::InputFedTwice) {
        let Some(place) = place_of(finding) else { continue };
        let key = (place.0.to_path_buf(), place.1);
        let first = finding.related.first().map(|(at, _)| at);
        if wrong.contains(&place) || first.is_some_and(is_wrong) {
            dropped.insert(key);
            continue;
        }
        let link = system.links.iter().find(|link| link.to.at.span == place.1);
        if let Some(remedy) = meant.find_remedy(link, first) {
            remedies.insert(key, remedy);
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

/// The ports that a link to an input which is fed twice may have meant.
struct MeantPorts<'a> {
    system: &'a System,
    kinds: &'a BTreeMap<&'a str, &'a Manifest>,
    /// The inputs that a link feeds: component and port.
    fed: BTreeSet<(&'a str, &'a str)>,
}

impl<'a> MeantPorts<'a> {
    fn new(system: &'a System, kinds: &'a BTreeMap<&'a str, &'a Manifest>) -> Self {
        let ends = system.links.iter().map(|link| &link.to);
        let fed = ends.map(|to| (to.component.value.as_str(), to.port.value.as_str())).collect();
        Self { system, kinds, fed }
    }

    /// Returns what to ask about the second `link` to an input; the `first` one ends there.
    fn find_remedy(&self, link: Option<&'a Link>, first: Option<&Location>) -> Option<String> {
        // The same output twice: the other link may be from one that nothing uses.
        if let Some(unused) = first.and_then(|_| self.find_unused_output(link?)) {
            return Some(format!("did you mean from=\"{unused}\", which no link uses?"));
        }
        let unfed = link
            .and_then(|link| self.find_required(link).or_else(|| self.find_of_component(link)))
            .or_else(|| self.find_only_free(link, first))?;
        Some(format!("was one meant for {unfed}, which nothing feeds?"))
    }

    fn names(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.system.components.iter().map(|component| component.name.value.as_str())
    }

    /// Whether the input takes what the output gives, and nothing feeds it.
    fn is_free(&self, name: &str, input: &PortManifest, output: &PortManifest) -> bool {
        is_same_type(output, input) && !self.fed.contains(&(name, input.id.as_str()))
    }

    /// Returns the first input that needs these data.
    fn find_required(&self, link: &Link) -> Option<String> {
        let output = find_port(&link.from, self.kinds, true)?;
        self.names().find_map(|name| {
            let mut inputs = self.kinds.get(name)?.inputs.iter();
            let meant = inputs.find(|it| it.required && self.is_free(name, it, output));
            meant.map(|input| format!("{name}.{}", input.id))
        })
    }

    /// Returns an input of the same component; if the same data are linked there twice, the input of
    /// this name of another component.
    fn find_of_component(&self, link: &Link) -> Option<String> {
        let output = find_port(&link.from, self.kinds, true)?;
        let is_repeated = self.count_alike(link) > 1;
        let own = link.to.component.value.as_str();
        self.names().filter(|name| (*name == own) != is_repeated).find_map(|name| {
            let mut inputs = self.kinds.get(name)?.inputs.iter();
            let is_meant = |input: &&PortManifest| {
                self.is_free(name, input, output)
                    && (!is_repeated || input.id == link.to.port.value)
            };
            inputs.find(is_meant).map(|input| format!("{name}.{}", input.id))
        })
    }

    /// Returns the only input that takes the data of either link, of another component than the one
    /// that sends them.
    fn find_only_free(&self, link: Option<&'a Link>, first: Option<&Location>) -> Option<String> {
        let links = &self.system.links;
        let other = links.iter().find(|it| first.is_some_and(|at| it.to.at.is_at(at)));
        let mut free = BTreeSet::new();
        for link in [other, link].into_iter().flatten() {
            let Some(output) = find_port(&link.from, self.kinds, true) else { continue };
            for name in self.names().filter(|name| *name != link.from.component.value) {
                let inputs = self.kinds.get(name).into_iter().flat_map(|kind| &kind.inputs);
                let fits = inputs.filter(|it| !it.is_any() && self.is_free(name, it, output));
                free.extend(fits.map(|input| format!("{name}.{}", input.id)));
            }
        }
        let mut free = free.into_iter();
        free.next().filter(|_| free.next().is_none())
    }

    /// Returns the only output of this type that no link uses, of another component with the same port,
    /// where two links are alike.
    fn find_unused_output(&self, link: &Link) -> Option<String> {
        if self.count_alike(link) < 2 {
            return None;
        }
        let output = find_port(&link.from, self.kinds, true)?;
        let all = self.names().flat_map(|name| {
            let outputs = self.kinds.get(name).into_iter().flat_map(|kind| &kind.outputs);
            outputs.map(move |it| (name, it))
        });
        let is_used = |name: &str, port: &str| {
            let mut links = self.system.links.iter();
            links.any(|it| it.from.component.value == name && it.from.port.value == port)
        };
        let mut unused = all.filter(|(name, it)| {
            is_same_type(output, it) && it.id == output.id && !it.is_any() && !is_used(name, &it.id)
        });
        let (Some((name, port)), None) = (unused.next(), unused.next()) else { return None };
        Some(format!("{name}.{}", port.id))
    }

    /// Returns the number of links from the same output to the same input.
    fn count_alike(&self, link: &Link) -> usize {
        let is_alike =
            |it: &&Link| it.from.data() == link.from.data() && it.to.data() == link.to.data();
        self.system.links.iter().filter(is_alike).count()
    }
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
        let is_it = |(at, input): &(Location, String)| {
            finding.at.as_ref().is_some_and(|it| it.is_at(at))
                && (finding.message.contains(input) || finding.remedy.contains(input))
        };
        finding.code != Code::InputUnfed || !explained.iter().any(is_it)
    });
}

fn place_of(finding: &Finding) -> Option<(&Path, Span)> {
    finding.at.as_ref().map(|at| (at.source.path(), at.span))
}
