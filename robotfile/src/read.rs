//! Tree → model, one file at a time.

mod frame;
mod layout;
mod limits;
mod mission;
mod position;
mod route;
mod site_map;
mod system;
mod transition;

use std::sync::Arc;

use crate::code::Code;
use crate::elements;
use crate::fields::ElementFields;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::System;
use crate::source::{Location, Source};
use crate::tree::Element;

pub use limits::{
    MAX_ELEMENTS, MAX_FRAMES, MAX_LINKS, MAX_MAP_CORNERS, MAX_RALLIES, MAX_ROUTE_STEPS, MAX_ROUTES,
    MAX_SHAPE_CORNERS, MAX_ZONES,
};

/// The contents of one file.
pub(crate) struct Contents {
    pub(crate) system: Option<System>,
    pub(crate) mission: Option<Mission>,
    /// The `<armor>` tag.
    pub(crate) at: Location,
}

/// Reads the root element. None if it is not ours at all.
pub(crate) fn contents(
    root: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<Contents> {
    if root.name != "armor" {
        let message = format!("the root element is <{}>", short(&root.name));
        let finding = Finding::new(Code::WrongRoot, &root.at(source), message);
        findings.push(finding.remedy("an Armor file starts with <armor version=\"1\">"));
        return None;
    }
    let Some((corrected, misspelt)) = elements::correct_names(root, source, findings) else {
        return Some(read_root(root, source, findings));
    };
    // Which attributes belong to a misspelt element is only a guess.
    let mut found = Findings::ignoring(misspelt);
    let contents = read_root(&corrected, source, &mut found);
    findings.absorb(found, |_| true);
    Some(contents)
}

fn read_root(root: &Element, source: &Arc<Source>, findings: &mut Findings) -> Contents {
    let at = root.at(source);
    crate::namespaces::check(root, source, findings);
    let mut fields = ElementFields::new(root, source, findings);
    if let Some(version) = fields.required("version").filter(|version| version.value != "1") {
        let message = format!("version {} of the format is not known", short(&version.value));
        let finding = Finding::new(Code::WrongRoot, &version.at, message);
        fields.report(finding.remedy("this program reads version=\"1\""));
    }
    if fields.flag("draft", false)
        && let Some(at) = fields.attribute_at("draft")
    {
        let finding = Finding::new(Code::Draft, &at, "this file is a draft, which is not run");
        fields.report(finding.remedy("finish it and save it in the designer, or remove draft"));
    }
    let children = fields.finish(&["system", "mission"]);
    let of = |name| children.iter().copied().filter(move |child| child.name == name);
    let system = expect_only(of("system"), source, findings);
    let mission = expect_only(of("mission"), source, findings);
    Contents {
        system: system.map(|element| system::read(element, source, findings)),
        mission: mission.map(|element| mission::read(element, source, findings)),
        at,
    }
}

/// The first; further ones are findings.
fn expect_only<'a>(
    mut elements: impl Iterator<Item = &'a Element>,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<&'a Element> {
    let first = elements.next()?;
    for other in elements {
        let message = format!("<{}> occurs twice", other.name);
        let finding = Finding::new(Code::DuplicateElement, &other.at(source), message);
        findings.push(finding.remedy("keep one of them").related(&first.at(source), "first here"));
    }
    Some(first)
}
