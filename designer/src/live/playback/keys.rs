//! The keys of the time line. They act while it has the focus, or nothing has: in a drawing the arrow
//! keys go from block to block, and in a field they move the cursor.

use eframe::egui::{self, Id, Key, Modifiers, Popup};

use super::PlaybackWish;

/// How far an arrow key goes, and how far with shift, in seconds.
const ARROW_S: f64 = 1.0;
const SHIFT_ARROW_S: f64 = 10.0;

/// The keys, and what they do.
const KEYS: [(Modifiers, Key, PlaybackWish); 9] = [
    (Modifiers::NONE, Key::Space, PlaybackWish::PlayOrPause),
    (Modifiers::NONE, Key::Home, PlaybackWish::GoTo(0.0)),
    (Modifiers::NONE, Key::End, PlaybackWish::End),
    // With shift first: a key without it also matches one with it.
    (Modifiers::SHIFT, Key::ArrowLeft, PlaybackWish::GoBy(-SHIFT_ARROW_S)),
    (Modifiers::SHIFT, Key::ArrowRight, PlaybackWish::GoBy(SHIFT_ARROW_S)),
    (Modifiers::NONE, Key::ArrowLeft, PlaybackWish::GoBy(-ARROW_S)),
    (Modifiers::NONE, Key::ArrowRight, PlaybackWish::GoBy(ARROW_S)),
    (Modifiers::NONE, Key::PageUp, PlaybackWish::PreviousFiring),
    (Modifiers::NONE, Key::PageDown, PlaybackWish::NextFiring),
];

/// The keys and what they do, for the page of the keys.
pub const TIME_LINE_KEYS: [(&str, &str); 5] = [
    ("Click, or drag", "goes to that moment; on a mark to the mark"),
    ("Space", "plays or pauses"),
    ("Left, Right", "go by 1 s, with Shift by 10 s"),
    ("Home, End", "go to the beginning, to the end"),
    ("Page Up, Page Down", "go to the firing before, to the next one"),
];

/// Takes what was pressed, if the keys are the time line's now; `track` is its track.
pub fn read(ctx: &egui::Context, track: Id) -> Vec<PlaybackWish> {
    let (focused, is_asked) = ctx.memory(|memory| (memory.focused(), memory.top_modal_layer()));
    let is_free = focused.is_none_or(|focused| focused == track);
    if !is_free || is_asked.is_some() || Popup::is_any_open(ctx) {
        return Vec::new();
    }
    let pressed = KEYS
        .iter()
        .filter(|(modifiers, key, _)| ctx.input_mut(|input| input.consume_key(*modifiers, *key)));
    pressed.map(|(.., wish)| *wish).collect()
}
