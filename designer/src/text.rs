//! Text of files as the fonts can show it.

use std::borrow::Cow;
use std::path::Path;

use eframe::egui;

/// The text with `?` for every character that no font has and with spaces for control characters.
/// What a file says may be anything; a box for each unknown character tells nobody more.
pub fn paintable<'a>(ctx: &egui::Context, text: &'a str) -> Cow<'a, str> {
    if text.bytes().all(|b| (b' '..=b'~').contains(&b)) {
        return Cow::Borrowed(text);
    }
    let font = egui::FontId::proportional(14.0);
    let shown = |c: char| match c {
        '\n' => c,
        c if c.is_control() => ' ',
        c if ctx.fonts_mut(|fonts| fonts.has_glyph(&font, c)) => c,
        _ => '?',
    };
    Cow::Owned(text.chars().map(shown).collect())
}

/// At most `most` characters, the last of them dots if there are more.
pub fn short(text: &str, most: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most) {
        None => Cow::Borrowed(text),
        Some(_) => {
            let kept: String = text.chars().take(most.saturating_sub(2)).collect();
            Cow::Owned(format!("{kept}.."))
        }
    }
}

/// A path as one says it: what lies in the home folder begins with `~`.
pub fn path(path: &Path) -> String {
    let home = std::env::var_os("HOME").filter(|home| !home.is_empty());
    match home.and_then(|home| path.strip_prefix(home).ok()) {
        Some(rest) => Path::new("~").join(rest).display().to_string(),
        None => path.display().to_string(),
    }
}
