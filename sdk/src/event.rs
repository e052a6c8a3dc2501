//! Events as a component declares them: a mission waits for one as `on="component.event"`.

use armor_wire::manifest::{EventManifest, EventValue};

/// An event of a component: a `const` with its name, its meaning and the type of its value.
#[derive(Clone, Copy, Debug)]
pub struct DeclaredEvent {
    name: &'static str,
    doc: &'static str,
    value: Option<EventValue>,
    unit: &'static str,
    named_by: &'static str,
}

impl DeclaredEvent {
    /// An event whose value has no meaning.
    pub const fn new(name: &'static str) -> Self {
        Self { name, doc: "", value: None, unit: "", named_by: "" }
    }

    /// When it is reported, in one line.
    #[must_use]
    pub const fn doc(mut self, doc: &'static str) -> Self {
        self.doc = doc;
        self
    }

    /// Its value is a number, in a unit if that is not empty.
    #[must_use]
    pub const fn number(mut self, unit: &'static str) -> Self {
        (self.value, self.unit) = (Some(EventValue::Number), unit);
        self
    }

    /// Its value is a whole number.
    #[must_use]
    pub const fn integer(mut self) -> Self {
        self.value = Some(EventValue::Integer);
        self
    }

    /// The words of the text parameter `parameter` are the names of such events.
    #[must_use]
    pub const fn named_by(mut self, parameter: &'static str) -> Self {
        self.named_by = parameter;
        self
    }

    /// Its entry in the manifest.
    pub fn manifest(&self) -> EventManifest {
        EventManifest {
            name: self.name.into(),
            doc: self.doc.into(),
            value: self.value,
            unit: self.unit.into(),
            named_by: self.named_by.into(),
        }
    }
}

/// The events of a component, each a variant of an enum; derived. The variant's name in snake case is
/// the event's, its doc comment the documentation, and its field, if it has one, the value.
/// `#[event(name = "…", unit = "…")]` gives another name, and the unit of the value.
///
/// ```
/// use armor_sdk::prelude::*;
///
/// #[derive(Events)]
/// enum HeaterEvent {
///     /// the water has its temperature
///     #[event(unit = "degC")]
///     Finished(f64),
///     /// the lid was opened
///     LidOpen,
/// }
///
/// struct Heater;
///
/// impl Component for Heater {
///     const KIND: &'static str = "heater";
///     const SUMMARY: &'static str = "Heats water.";
///     const EVENTS: &'static [DeclaredEvent] = HeaterEvent::DECLARED;
///
///     fn new(_: Armor) -> Result<Self, Fault> {
///         Ok(Self)
///     }
///
///     fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
///         Ok(HeaterEvent::Finished(61.5).into())
///     }
/// }
/// # let manifest = armor_sdk::manifest_of::<Heater>().unwrap();
/// # let events = manifest.listed_events();
/// # assert_eq!((&*events[0].name, &*events[1].name), ("finished", "lid_open"));
/// ```
pub trait Events: Sized {
    /// The table for [`Component::EVENTS`](crate::Component::EVENTS), in the order of the variants.
    const DECLARED: &'static [DeclaredEvent];

    /// The name of this event.
    fn event_name(&self) -> &'static str;

    /// The value of this event; 1 if it has none.
    fn event_value(&self) -> f64;
}

#[cfg(test)]
mod tests {
    use armor_sdk_derive::Events;

    use super::*;
    use crate::call::Outcome;

    #[derive(Events)]
    enum Everything {
        /// a lap
        /// is over
        Lap(u32),
        #[event(unit = "degC")]
        TooHot(f64),
        #[event(name = "lid-open")]
        Opened,
    }

    #[test]
    fn an_event_has_a_name_a_meaning_and_a_value() {
        let manifest = |index: usize| Everything::DECLARED[index].manifest();
        let event = |name: &str, doc: &str, value, unit: &str| EventManifest {
            name: name.into(),
            doc: doc.into(),
            value,
            unit: unit.into(),
            named_by: String::new(),
        };
        assert_eq!(manifest(0), event("lap", "a lap is over", Some(EventValue::Integer), ""));
        assert_eq!(manifest(1), event("too_hot", "", Some(EventValue::Number), "degC"));
        assert_eq!(manifest(2), event("lid-open", "", None, ""));
        assert_eq!(Outcome::from(Everything::Lap(3)), Outcome::event("lap", 3.0));
        assert_eq!(Outcome::from(Everything::TooHot(99.5)), Outcome::event("too_hot", 99.5));
        assert_eq!(Outcome::from(Everything::Opened), Outcome::event("lid-open", 1.0));
    }
}
