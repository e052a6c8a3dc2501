//! Components that are used in several places and are not declared: probably their `<component>` is
//! missing, not each of the names misspelt.

use armor_wire::manifest::Manifest;

use crate::check::kinds::find_meant_kind;
use crate::check::uses::ComponentUses;
use crate::code::Code;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Configuration, System};

/// Other mentions of a name from which on it is not a misspelt one.
const MIN_FURTHER_MENTIONS: usize = 2;

/// Replaces the guess in the findings about such names. A component of a similar name is meant only if
/// nothing names that one.
pub(super) fn explain(
    configuration: &Configuration,
    manifests: Option<&Manifests>,
    findings: &mut Findings,
) {
    let is_undeclared = |code, more| code == Code::UnknownComponent && more >= MIN_FURTHER_MENTIONS;
    if !findings.iter().any(|it| is_undeclared(it.code, it.more)) {
        return;
    }
    let uses = ComponentUses::collect(configuration);
    for finding in findings.iter_mut().filter(|it| is_undeclared(it.code, it.more)) {
        let guessed = finding.remedy.strip_prefix("did you mean ");
        let guessed = guessed.and_then(|it| it.split('?').next()).map(str::to_owned);
        let Some(name) = finding.at.as_ref().map(|at| at.text().to_owned()) else { continue };
        let Some(guessed) = guessed else { continue };
        if !is_linked(&configuration.system, &guessed) {
            continue;
        }
        let kind = manifests.zip(uses.get(&name));
        let kind = kind.and_then(|(manifests, uses)| find_meant_kind(&name, uses, manifests));
        let kind = kind.map_or("…", |kind: &Manifest| kind.kind.as_str());
        finding.remedy = format!(
            "declare it: <component name=\"{name}\" kind=\"{kind}\"/>; or is {guessed} meant in all \
             these places?"
        );
    }
}

/// Returns whether a link names the component.
fn is_linked(system: &System, name: &str) -> bool {
    let mut ends = system.links.iter().flat_map(|link| [&link.from, &link.to]);
    ends.any(|end| end.component.value == name)
}
