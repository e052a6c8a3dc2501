//! How a state looks: by colour, by the border of the block, and in words, each of which alone
//! suffices to distinguish states.

use armor_inspect::{Condition, ObservedProcess, SystemPicture};
use eframe::egui::Color32;

use crate::canvas::{Mark, Outline};
use armor_picture::theme::ThemeColours;

/// How a block of this state is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tone {
    /// Its colour; none is neutral.
    pub tint: Option<Color32>,
    /// Its border.
    pub outline: Outline,
    /// Whether it is drawn less visibly.
    pub is_dim: bool,
    /// Whether something is wrong.
    pub mark: Mark,
}

impl Tone {
    /// Returns the look of a state; none is that of a component whose process has not been seen.
    pub fn of(condition: Option<Condition>, colours: &ThemeColours) -> Self {
        let plain = Self { tint: None, outline: Outline::Plain, is_dim: false, mark: Mark::None };
        let Some(condition) = condition else {
            return Self { outline: Outline::Dashed, is_dim: true, ..plain };
        };
        match condition {
            Condition::Active => {
                Self { tint: Some(colours.good), outline: Outline::Strong, ..plain }
            }
            Condition::Done => Self { tint: Some(colours.good), ..plain },
            Condition::Frozen => Self { is_dim: true, ..plain },
            Condition::Unknown => Self { tint: Some(colours.weak), ..plain },
            Condition::Starting => Self { tint: Some(colours.accent), ..plain },
            Condition::Failed => Self { tint: Some(colours.error), mark: Mark::Error, ..plain },
            Condition::Suspected => Self {
                tint: Some(colours.warning),
                outline: Outline::Strong,
                mark: Mark::Warning,
                ..plain
            },
            Condition::Restarting => Self {
                tint: Some(colours.warning),
                outline: Outline::Dashed,
                mark: Mark::Warning,
                ..plain
            },
            Condition::Dead => Self {
                tint: Some(colours.error),
                outline: Outline::Dashed,
                mark: Mark::Error,
                ..plain
            },
        }
    }

    /// Returns the look and the word of a component on a host that is cut off, whatever was last seen of
    /// it.
    pub fn cut_off(colours: &ThemeColours) -> (Self, &'static str) {
        let tone = Self {
            tint: Some(colours.error),
            outline: Outline::Dashed,
            is_dim: true,
            mark: Mark::Error,
        };
        (tone, "cut off")
    }

    /// For a process as it is seen, with its word. In a system that has ended no process counts as
    /// dead.
    pub fn seen(
        process: Option<&ObservedProcess>,
        picture: &SystemPicture,
        colours: &ThemeColours,
    ) -> (Self, &'static str) {
        match process {
            Some(_) if picture.has_ended() => (Self::of(None, colours), "ended"),
            Some(process) => (Self::of(Some(process.condition), colours), process.condition.word()),
            None => (Self::of(None, colours), "not there"),
        }
    }

    /// The colour in which the word is written.
    pub fn ink(self, colours: &ThemeColours) -> Color32 {
        self.tint.unwrap_or(if self.is_dim { colours.weak } else { colours.text })
    }
}

/// Describes a state for a reader who does not know it.
pub fn doc(condition: Condition) -> &'static str {
    match condition {
        Condition::Unknown => "It is registered and has not reported its state yet.",
        Condition::Starting => "It is waiting for its settings and parameters.",
        Condition::Frozen => "The mission has frozen it: it gets no calls and uses no CPU.",
        Condition::Active => "It is running.",
        Condition::Done => "It has reported its task done.",
        Condition::Failed => "It has reported a failure.",
        Condition::Suspected => "It is registered but has missed three heartbeats.",
        Condition::Restarting => "Its process has ended; the launcher may restart it.",
        Condition::Dead => "Its process has ended and was not replaced.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black and white, and without reading: what is left must still show what needs attention.
    #[test]
    fn states_differ_also_without_their_colours() {
        for colours in [ThemeColours::of_theme(false), ThemeColours::of_theme(true)] {
            let shape_of = |tone: Tone| {
                (
                    tone.outline == Outline::Dashed,
                    tone.outline == Outline::Strong,
                    tone.is_dim,
                    tone.mark,
                )
            };
            let shape = |condition| shape_of(Tone::of(Some(condition), colours));
            let apart = [
                Condition::Active,
                Condition::Frozen,
                Condition::Suspected,
                Condition::Dead,
                Condition::Restarting,
            ];
            let cut_off = shape_of(Tone::cut_off(colours).0);
            for (index, one) in apart.iter().enumerate() {
                assert_ne!(shape(*one), cut_off, "{one:?}");
                for other in &apart[index + 1..] {
                    assert_ne!(shape(*one), shape(*other), "{one:?} {other:?}");
                }
            }
        }
    }

    #[test]
    fn every_state_has_a_word_of_its_own() {
        let mut words: Vec<_> = Condition::ALL.map(Condition::word).to_vec();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), Condition::ALL.len());
        assert!(Condition::ALL.iter().all(|condition| !doc(*condition).is_empty()));
    }
}
