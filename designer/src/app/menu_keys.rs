//! The menus by keyboard: Alt alone opens the first one, Alt with a letter the one that begins
//! with it; the arrow keys lead through it and to its neighbours.

use eframe::egui::{self, Event, Key, Modifiers, Popup};

use crate::commands::Menu;

/// What is known of the keys and of the menus of the last frame.
#[derive(Debug, Default)]
pub(super) struct MenuKeys {
    /// Alt is down, and nothing else was pressed with it yet.
    is_armed: bool,
    /// Alt is down.
    is_down: bool,
    /// The menu that is to be opened.
    wanted: Option<usize>,
}

/// The key of a menu's first letter.
fn letter(menu: Menu) -> Option<Key> {
    Key::from_name(menu.name().get(..1)?)
}

impl MenuKeys {
    /// Reads the keys of this frame; to be called while nothing else has the keyboard.
    pub(super) fn read(&mut self, ctx: &egui::Context) {
        ctx.input_mut(|input| {
            for event in &input.events {
                self.read_event(event);
            }
            for (number, menu) in Menu::ALL.into_iter().enumerate() {
                if letter(menu).is_some_and(|key| input.consume_key(Modifiers::ALT, key)) {
                    self.wanted = Some(number);
                }
            }
        });
    }

    fn read_event(&mut self, event: &Event) {
        match event {
            Event::ModifiersChanged(modifiers) => {
                if modifiers.alt && !self.is_down {
                    self.is_armed = modifiers.matches_exact(Modifiers::ALT);
                } else if !modifiers.alt && self.is_down && std::mem::take(&mut self.is_armed) {
                    self.wanted = Some(0);
                }
                self.is_down = modifiers.alt;
            }
            // Alt itself is a key, too.
            Event::Key { key: Key::AltLeft | Key::AltRight, .. } => {}
            // Alt was for another key, or for another window.
            Event::Key { .. }
            | Event::Text(_)
            | Event::PointerButton { .. }
            | Event::WindowFocused(_) => self.is_armed = false,
            _ => {}
        }
    }

    /// Opens the menu that was asked for, or the neighbour of the open one; `buttons` are those of all
    /// menus.
    pub(super) fn open(&mut self, ctx: &egui::Context, buttons: &[egui::Response]) {
        let is_open =
            |button: &egui::Response| Popup::is_id_open(ctx, Popup::default_response_id(button));
        let reached = buttons.iter().position(egui::Response::has_focus);
        let open = buttons.iter().position(is_open);
        let neighbour = open.filter(|_| reached == open).and_then(|open| {
            let count = buttons.len();
            let pressed = |key| ctx.input(|input| input.key_pressed(key));
            match (pressed(Key::ArrowLeft), pressed(Key::ArrowRight)) {
                (true, false) => Some((open + count - 1) % count),
                (false, true) => Some((open + 1) % count),
                _ => None,
            }
        });
        if let Some(button) = self.wanted.take().or(neighbour).and_then(|n| buttons.get(n)) {
            Popup::open_id(ctx, Popup::default_response_id(button));
            button.request_focus();
            ctx.request_repaint();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_menu_has_a_letter_of_its_own() {
        let mut letters: Vec<_> = Menu::ALL.map(|menu| letter(menu).expect("a letter")).to_vec();
        letters.sort_unstable();
        letters.dedup();
        assert_eq!(letters.len(), Menu::ALL.len());
    }
}
