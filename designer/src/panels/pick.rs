//! A list that is searched by typing words in any order.

use eframe::egui::text::{LayoutJob, TextFormat};
use eframe::egui::{
    self, Area, Button, Frame, Id, Key, Modifiers, Order, Pos2, ScrollArea, TextEdit,
};

use crate::panels::fuzzy::{Fit, fit};

/// Greatest height of the lines of a list.
const HEIGHT: f32 = 320.0;

/// Returns the entries that match, the best first; equal ones keep their order.
pub fn sorted<'a, T>(
    typed: &str,
    entries: &'a [T],
    words: impl Fn(&T) -> (&str, &str),
) -> Vec<(Fit, &'a T)> {
    let fitting = entries.iter().filter_map(|entry| {
        let (name, about) = words(entry);
        Some((fit(typed, name, about)?, entry))
    });
    let mut fitting: Vec<_> = fitting.collect();
    if !typed.trim().is_empty() {
        fitting.sort_by_key(|(fit, _)| std::cmp::Reverse(fit.score));
    }
    fitting
}

/// One line of a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry<T> {
    /// What it is called; searched first.
    pub name: String,
    /// More about it.
    pub about: String,
    /// What it stands for.
    pub value: T,
}

/// A list with a field to type in, used with the keyboard alone or with the mouse.
#[derive(Clone, Debug, Default)]
pub struct Picker {
    typed: String,
    at: usize,
    /// Whether the field had the focus once.
    is_open: bool,
}

/// The result of a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Picked<T> {
    /// Nothing yet.
    Open,
    /// It was left without a choice.
    Left,
    /// This one.
    One(T),
}

impl Picker {
    /// Shows the list over everything at a point of the window, until one is picked or the pointer
    /// pressed elsewhere.
    pub fn show_at<T: Clone>(
        &mut self,
        ui: &egui::Ui,
        name: &str,
        at: Pos2,
        entries: &[Entry<T>],
    ) -> Picked<T> {
        let area = Area::new(Id::unique("list at the pointer")).order(Order::Foreground);
        let area = area.fixed_pos(at).constrain_to(ui.ctx().content_rect());
        let shown = area.show(ui.ctx(), |ui| {
            let list = Frame::popup(ui.style()).show(ui, |ui| {
                ui.set_width(280.0);
                self.show(ui, name, entries)
            });
            list.inner
        });
        let own = shown.response.rect;
        let is_elsewhere = ui.input(|i| {
            let at = i.pointer.interact_pos().filter(|_| i.pointer.any_pressed());
            at.is_some_and(|at| !own.contains(at))
        });
        match shown.inner {
            Picked::Open if is_elsewhere => Picked::Left,
            picked => picked,
        }
    }

    /// Shows the list; `name` is what screen readers and tests call its field.
    pub fn show<T: Clone>(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        entries: &[Entry<T>],
    ) -> Picked<T> {
        self.show_with(ui, name, entries, |_| String::new())
    }

    /// The same with something at the end of each line, such as the keys of a command.
    pub fn show_with<T: Clone>(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        entries: &[Entry<T>],
        side: impl Fn(&T) -> String,
    ) -> Picked<T> {
        let field = TextEdit::singleline(&mut self.typed).hint_text(name);
        let field = ui.add(field.desired_width(f32::INFINITY)).accessible_name(name);
        if !self.is_open {
            field.request_focus();
            self.is_open = true;
        }
        if field.changed() {
            self.at = 0;
        }
        let fitting = sorted(&self.typed, entries, |entry| (&entry.name, &entry.about));
        let (down, up, enter, escape) = ui.input_mut(|i| {
            let mut pressed = |key| i.count_and_consume_key(Modifiers::NONE, key);
            let (down, up) = (pressed(Key::ArrowDown), pressed(Key::ArrowUp));
            (down, up, i.key_pressed(Key::Enter), i.key_pressed(Key::Escape))
        });
        let last = fitting.len().saturating_sub(1);
        self.at = (self.at + down).saturating_sub(up).min(last);
        if escape {
            return Picked::Left;
        }
        if enter && let Some((_, entry)) = fitting.get(self.at) {
            return Picked::One(entry.value.clone());
        }
        if fitting.is_empty() {
            ui.weak("no match");
        }
        let mut picked = Picked::Open;
        let list = ScrollArea::vertical().max_height(HEIGHT).min_scrolled_height(HEIGHT);
        list.auto_shrink([false, true]).show(ui, |ui| {
            for (n, (fit, entry)) in fitting.iter().enumerate() {
                let button = Button::selectable(n == self.at, lit(ui, &entry.name, fit));
                let line = match side(&entry.value) {
                    side if side.is_empty() => ui.add(button),
                    side => ui.add(button.shortcut_text(side)),
                };
                let line = if entry.about.is_empty() {
                    line
                } else {
                    line.on_hover_text(entry.about.as_str())
                };
                if n == self.at && (down > 0 || up > 0) {
                    line.scroll_to_me(None);
                }
                if line.clicked() {
                    picked = Picked::One(entry.value.clone());
                }
            }
        });
        picked
    }
}

/// The name with the letters that were found in another colour.
fn lit(ui: &egui::Ui, name: &str, fit: &Fit) -> LayoutJob {
    let font = egui::TextStyle::Button.resolve(ui.style());
    let (plain, found) = (ui.visuals().text_color(), ui.visuals().hyperlink_color);
    let mut job = LayoutJob::default();
    for (n, letter) in crate::text::paintable(ui.ctx(), name).chars().enumerate() {
        let colour = if fit.places.binary_search(&n).is_ok() { found } else { plain };
        job.append(letter.encode_utf8(&mut [0; 4]), 0.0, TextFormat::simple(font.clone(), colour));
    }
    job
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_in_any_order_and_the_beginning_counts_most() {
        let entries = [("grid-mapper", "Maps."), ("map-writer", "Writes maps."), ("driver", "")];
        let found = |typed: &str| {
            let sorted = sorted(typed, &entries, |entry| (entry.0, entry.1));
            sorted.into_iter().map(|(_, entry)| entry.0).collect::<Vec<_>>()
        };
        assert_eq!(found("map"), ["map-writer", "grid-mapper"]);
        assert_eq!(found("writer MAP"), ["map-writer"]);
        assert_eq!(found("writes"), ["map-writer"]);
        assert_eq!(found(""), ["grid-mapper", "map-writer", "driver"]);
        assert_eq!(found("x"), [""; 0]);
    }
}
