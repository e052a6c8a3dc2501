//! What a value of a parameter causes that its range allows, for the manifest.

use armor_wire::manifest::{EffectKind, ValueEffect};

/// The effect of a parameter's value; see
/// [`Component::VALUE_EFFECTS`](crate::Component::VALUE_EFFECTS).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterEffect {
    /// With this value, written as in a file, the component does nothing.
    Idle(&'static str),
    /// With this value the component never reports that it is done.
    NeverDone(&'static str),
    /// The component is done after this time at the earliest.
    DelaysDone,
    /// The same, times the numbers that these parameters are, or the numbers of their entries:
    /// `&["laps", "route"]`.
    DelaysDoneTimes(&'static [&'static str]),
    /// This output is sent after this time, each time.
    Paces(&'static str),
    /// The component gives up a part of its task after this time.
    GivesUp,
}

impl ParameterEffect {
    pub(crate) fn manifest(self, parameter: &str) -> ValueEffect {
        let (effect, value, output) = match self {
            Self::Idle(value) => (EffectKind::Idle, value, ""),
            Self::NeverDone(value) => (EffectKind::NeverDone, value, ""),
            Self::DelaysDone | Self::DelaysDoneTimes(_) => (EffectKind::DelaysDone, "", ""),
            Self::Paces(output) => (EffectKind::Paces, "", output),
            Self::GivesUp => (EffectKind::GivesUp, "", ""),
        };
        let times = match self {
            Self::DelaysDoneTimes(times) => times,
            _ => &[],
        };
        let times = times.iter().map(|name| (*name).to_owned()).collect();
        let (value, output) = (value.to_owned(), output.to_owned());
        ValueEffect { parameter: parameter.to_owned(), effect, value, output, times }
    }
}
