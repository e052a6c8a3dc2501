//! A name that is declared and never used, next to a similar one that is used and never declared: the
//! declaration is misspelt, not each of the uses.

use crate::code::Code;
use crate::edit::{Item, mentions};
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::Configuration;
use crate::source::{Location, Source};
use crate::suggestion::suggest_similar;
use crate::xml::parse_tree;

/// Most names of which the uses are counted: each reads the files again.
const MAX_NAMES: usize = 16;

/// Moves the findings about such names to the declaration.
pub(super) fn blame(configuration: &Configuration, findings: &mut Findings) {
    let folded = findings.iter_mut().filter(|it| it.is_about_name() && it.more > 0);
    for finding in folded.take(MAX_NAMES) {
        let Some(used) = finding.at.clone() else { continue };
        let Some(declared) = find_declared(finding, &used, configuration) else { continue };
        if is_used(finding.code, declared.text(), &used, configuration) {
            continue;
        }
        let (noun, of_use) = (noun_of(finding.code), used.text());
        finding.message = format!(
            "nothing names the {noun} {}, and there is no {noun} called {of_use}, which is named in \
             {} places",
            declared.text(),
            finding.more + 1,
        );
        finding.remedy = format!("did you mean {of_use}?");
        finding.related.insert(0, (used.clone(), "named here".to_owned()));
        finding.at = Some(declared);
    }
}

fn noun_of(code: Code) -> &'static str {
    match code {
        Code::UnknownComponent => "component",
        Code::UnknownPlace => "place",
        Code::UnknownHost => "host",
        _ => "variable",
    }
}

/// Returns where the name is declared that the finding suggests.
fn find_declared(
    finding: &Finding,
    used: &Location,
    configuration: &Configuration,
) -> Option<Location> {
    let (_, guess) = finding.remedy.split_once("did you mean ")?;
    let guess = guess.strip_suffix('?')?;
    // A kind that is written in place of a component's name need not resemble it.
    suggest_similar(used.text(), [guess].into_iter())?;
    let system = &configuration.system;
    let of_mission = || {
        let mut missions = configuration.missions();
        missions.find(|it| it.at.source.path() == used.source.path())
    };
    let name = match finding.code {
        Code::UnknownComponent => &system.component(guess)?.name,
        Code::UnknownHost => &system.hosts.iter().find(|it| it.name.value == guess)?.name,
        Code::UnknownPlace => &of_mission()?.place(guess)?.name,
        Code::UnknownVariable => {
            &of_mission()?.variables.iter().find(|it| it.name.value == guess)?.name
        }
        _ => return None,
    };
    Some(name.at.clone())
}

/// Returns whether anything but its declaration, and its block in the layout, names it.
fn is_used(code: Code, name: &str, used: &Location, configuration: &Configuration) -> bool {
    let item = match code {
        Code::UnknownComponent => Item::Component(name),
        Code::UnknownPlace => Item::Place(name),
        Code::UnknownVariable => Item::Variable(name),
        _ => {
            let mut hosts =
                configuration.system.components.iter().filter_map(|it| it.host.as_ref());
            return hosts.any(|host| host.value == name);
        }
    };
    // The names of components are those of the whole system, others those of one mission.
    let is_in_scope =
        |it: &Source| code == Code::UnknownComponent || it.path() == used.source.path();
    configuration.sources.iter().filter(|it| is_in_scope(it)).any(|source| {
        // What cannot be read may name it.
        parse_tree(source.path(), source.text().as_bytes()).map_or(true, |tree| {
            mentions(&tree, item).iter().any(|it| !it.is_definition_or_layout())
        })
    })
}
