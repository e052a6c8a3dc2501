//! What a component under test cannot do either, as no process could.

use armor_wire::manifest::EventManifest;

use super::*;
use crate::Armor;

/// Ends its first call in one of these ways.
struct Ending<const HOW: u8>(Armor);

const CARRY_ON: u8 = 0;
const FAIL_SILENTLY: u8 = 1;
const RETURN_NO_WORDS: u8 = 2;
const FORBID_FREEZING: u8 = 3;

impl<const HOW: u8> Component for Ending<HOW> {
    const KIND: &'static str = "ending";
    const SUMMARY: &'static str = "Ends its first call.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        Ok(Self(armor))
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        match HOW {
            FAIL_SILENTLY => return Ok(Outcome::Failed(String::new())),
            RETURN_NO_WORDS => return Err(" ".into()),
            FORBID_FREEZING => self.0.set_non_controllable()?,
            _ => {}
        }
        Ok(Outcome::CarryOn)
    }
}

/// The reason of its failure.
fn failure<const HOW: u8>() -> String {
    let mut component = TestedComponent::build::<Ending<HOW>>(&[]).expect("it is built");
    component.start().expect_err("it fails");
    let reports = component.reports();
    let [ReportKind::Failed { reason }] = reports else { panic!("{reports:?}") };
    reason.clone()
}

/// In another language no compiler checks the name of an event.
#[test]
fn a_kind_whose_events_no_mission_can_name_is_not_built() {
    for (name, why) in [("a b", "`a b` is not a name"), ("done", "reports of their own")] {
        let (doc, unit, named_by) = Default::default();
        let event = EventManifest { name: name.into(), doc, value: None, unit, named_by };
        let mut kind = KindDeclaration::of::<Ending<CARRY_ON>>();
        kind.events = vec![event];
        let built = TestedComponent::build_kind(&kind, construct::<Ending<CARRY_ON>>, &[]);
        let Err(error) = built else { panic!("{name} is accepted") };
        assert!(error.to_string().contains(why), "{error}");
    }
}

#[test]
fn a_failure_without_words_is_reported_in_words() {
    for reason in [failure::<FAIL_SILENTLY>(), failure::<RETURN_NO_WORDS>()] {
        assert!(reason.contains("gives no reason"), "{reason}");
    }
}

#[test]
fn whether_a_component_may_be_frozen_is_decided_in_its_constructor() {
    let reason = failure::<FORBID_FREEZING>();
    assert!(reason.contains("`set_non_controllable` is called after the constructor"), "{reason}");
}
