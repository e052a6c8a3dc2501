//! The blocks of layouts: whether what they show exists, and their coordinates are numbers. A block
//! that shows nothing has no effect on the robot, so it is a note.

use std::collections::BTreeSet;

use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::{LayoutBlock, System};
use crate::source::Spanned;
use crate::suggestion::suggest_similar;

/// Checks the layout of the system.
pub(super) fn check_system(system: &System, findings: &mut Findings) {
    let components = system.components.iter().map(|component| &component.name);
    let components = KnownBlocks::of("component", components);
    for block in &system.layout {
        components.expect(block.of.as_ref(), findings);
        check_numbers(block, findings);
    }
}

/// Checks the layout of a mission.
pub(super) fn check_mission(mission: &Mission, findings: &mut Findings) {
    let places = KnownBlocks::of("place", mission.places.iter().map(|place| &place.name));
    let transitions = mission.transitions.iter().map(|transition| &transition.name);
    let transitions = KnownBlocks::of("transition", transitions);
    for block in &mission.layout {
        places.expect(block.of.as_ref(), findings);
        transitions.expect(block.transition.as_ref(), findings);
        check_numbers(block, findings);
    }
}

/// What a block may show.
struct KnownBlocks<'a> {
    noun: &'static str,
    names: BTreeSet<&'a str>,
}

impl<'a> KnownBlocks<'a> {
    fn of(noun: &'static str, names: impl Iterator<Item = &'a Spanned<String>>) -> Self {
        Self { noun, names: names.map(|name| name.value.as_str()).collect() }
    }

    fn expect(&self, shown: Option<&Spanned<String>>, findings: &mut Findings) {
        let Some(shown) = shown.filter(|shown| !self.names.contains(shown.value.as_str())) else {
            return;
        };
        let noun = self.noun;
        let message =
            format!("this block is of a {noun} that does not exist: {}", short(&shown.value));
        let finding = Finding::new(Code::BadBlock, &shown.at, message);
        let guess = suggest_similar(&shown.value, self.names.iter().copied());
        findings.push(finding.remedy(guess.unwrap_or_else(|| "remove the block".into())));
    }
}

fn check_numbers(block: &LayoutBlock, findings: &mut Findings) {
    if block.of.is_none() && block.transition.is_none() {
        return;
    }
    for (name, value) in &block.not_numbers {
        let message = format!("{name}: `{}` is not a number", short(&value.value));
        let finding = Finding::new(Code::BadBlock, &value.at, message);
        findings
            .push(finding.remedy("write a number without unit, such as 120; or remove the block"));
    }
}
