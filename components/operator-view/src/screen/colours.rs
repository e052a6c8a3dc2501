//! What the screen adds to the theme of all windows: the ink of a freshness, and which theme is shown.
//! No information is in a colour alone: a word or a shape repeats it.

use armor_picture::theme::{self, Pointing, ThemeColours};
use eframe::egui::{Color32, Context, ThemePreference, Ui};

use crate::links::Freshness;

/// Returns the colours of the theme in which `ui` is shown.
pub(crate) fn colours_of(ui: &Ui) -> &'static ThemeColours {
    ThemeColours::of(ui.visuals())
}

/// Returns the colour of a freshness.
pub(crate) fn freshness_ink(colours: &ThemeColours, freshness: Freshness) -> Color32 {
    match freshness {
        Freshness::Nothing => colours.weak,
        Freshness::Fresh => colours.good,
        Freshness::Late => colours.warning,
        Freshness::Gone => colours.error,
    }
}

/// Gives a window its look, in both themes.
pub(crate) fn apply_theme(context: &Context) {
    context.set_theme(ThemePreference::Dark);
    theme::apply(context, Pointing::Finger);
    // A picture shows one moment: no animations.
    context.all_styles_mut(|style| style.animation_time = 0.0);
}

/// Changes to a theme.
pub(super) fn choose_theme(context: &Context, is_light: bool) {
    let wanted = if is_light { ThemePreference::Light } else { ThemePreference::Dark };
    if context.options(|options| options.theme_preference) != wanted {
        context.set_theme(wanted);
    }
}
