//! Buttons that appear while the operator is about to click something else: for a moment they do
//! nothing.

use std::collections::BTreeMap;

use eframe::egui::{Event, PointerButton, Ui};

/// A click that was begun sooner than this after the button had appeared does nothing, in seconds.
const DEAD_S: f64 = 0.5;

/// The buttons that come and go, each with the time since which it is shown.
#[derive(Debug, Default)]
pub(super) struct NewButtons {
    shown_s: BTreeMap<String, f64>,
    pressed_s: f64,
    is_clicking: bool,
}

impl NewButtons {
    /// Takes what the pointer does in this frame, and which buttons are shown. Returns whether one is
    /// new.
    pub(super) fn begin_frame(
        &mut self,
        ui: &Ui,
        shown: impl IntoIterator<Item = String>,
        now_s: f64,
    ) -> bool {
        let is_primary = |event: &Event, wanted| {
            matches!(event, Event::PointerButton { button: PointerButton::Primary, pressed, .. }
                if *pressed == wanted)
        };
        let happens =
            |wanted| ui.input(|input| input.events.iter().any(|event| is_primary(event, wanted)));
        let before = self.shown_s.clone();
        self.take_frame(shown, happens(true), happens(false), now_s);
        self.shown_s.keys().any(|name| !before.contains_key(name))
    }

    /// Returns for how long a button is shown, in seconds.
    pub(super) fn shown_for_s(&self, name: &str, now_s: f64) -> Option<f64> {
        self.shown_s.get(name).map(|since_s| now_s - since_s)
    }

    fn take_frame(
        &mut self,
        shown: impl IntoIterator<Item = String>,
        is_pressed: bool,
        is_released: bool,
        now_s: f64,
    ) {
        let before = std::mem::take(&mut self.shown_s);
        let with_time = |name: String| {
            let since_s = before.get(&name).copied().unwrap_or(now_s);
            (name, since_s)
        };
        self.shown_s = shown.into_iter().map(with_time).collect();
        if is_pressed {
            self.pressed_s = now_s;
        }
        self.is_clicking = is_released;
    }

    /// Returns whether a click at a button in this frame is meant for it.
    pub(super) fn accepts(&self, name: &str, now_s: f64) -> bool {
        let begun_s = if self.is_clicking { self.pressed_s } else { now_s };
        self.shown_s.get(name).is_some_and(|since_s| begun_s - since_s >= DEAD_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_click_that_was_begun_before_a_button_could_be_read_does_nothing() {
        let mut buttons = NewButtons::default();
        let mut frame = |name: Option<&str>, is_pressed, is_released, now_s| {
            buttons.take_frame(name.map(str::to_owned), is_pressed, is_released, now_s);
            buttons.accepts("turn-back", now_s)
        };
        frame(None, true, false, 9.9);
        assert!(!frame(Some("turn-back"), false, false, 10.0));
        assert!(!frame(Some("turn-back"), false, true, 10.7), "it was begun before");
        frame(Some("turn-back"), true, false, 10.8);
        assert!(frame(Some("turn-back"), false, true, 10.9));
        frame(None, false, false, 11.0);
        assert!(!frame(Some("turn-back"), true, true, 11.1), "it is asked again");
    }
}
