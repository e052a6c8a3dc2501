//! What the processes say, by component, gravity and words.

use std::collections::BTreeSet;
use std::sync::Arc;

use armor_look::log::{Line, Log};
use eframe::egui::{self, ComboBox, Label, RichText, ScrollArea, TextEdit};

use crate::theme::Colours;

/// How grave a line must be to be shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Least {
    #[default]
    Anything,
    Info,
    Warning,
    Error,
}

impl Least {
    const ALL: [Self; 4] = [Self::Anything, Self::Info, Self::Warning, Self::Error];

    fn name(self) -> &'static str {
        match self {
            Self::Anything => "everything",
            Self::Info => "INFO and graver",
            Self::Warning => "WARN and graver",
            Self::Error => "only ERROR",
        }
    }

    /// A line that does not say how grave it is is as good as INFO.
    fn lets(self, level: &str) -> bool {
        match self {
            Self::Anything => true,
            Self::Info => !matches!(level, "DEBUG" | "TRACE"),
            Self::Warning => matches!(level, "WARN" | "ERROR"),
            Self::Error => level == "ERROR",
        }
    }
}

/// Which lines are shown.
#[derive(Clone, Debug, Default, PartialEq)]
struct Filter {
    /// Of this component; none: of all.
    of: Option<String>,
    least: Least,
    words: String,
}

impl Filter {
    fn lets(&self, line: &Line) -> bool {
        self.of.as_ref().is_none_or(|of| line.name == *of)
            && self.least.lets(&line.level)
            && self
                .words
                .split_whitespace()
                .all(|word| holds(&line.text, word) || holds(&line.name, word))
    }
}

fn holds(text: &str, word: &str) -> bool {
    text.to_lowercase().contains(&word.to_lowercase())
}

/// The log, and which of it is shown.
#[derive(Default)]
pub struct Panel {
    filter: Filter,
    /// What the lines below were chosen by.
    chosen_by: Filter,
    chosen: Vec<Arc<Line>>,
    names: BTreeSet<String>,
    /// The number of the next line of the log.
    next: u64,
}

impl Panel {
    /// Shows only the lines of one component, or of all again.
    pub fn only(&mut self, name: Option<&str>) {
        self.filter.of = name.map(Into::into);
    }

    /// Takes in what is new.
    fn take(&mut self, log: &Log) {
        if self.filter != self.chosen_by || log.count() < self.next {
            if log.count() < self.next {
                // Another log.
                self.names.clear();
            }
            self.chosen.clear();
            (self.chosen_by, self.next) = (self.filter.clone(), 0);
        }
        if log.count() == self.next {
            return;
        }
        let (first, lines) = log.since(self.next);
        self.next = first + lines.len() as u64;
        for line in lines {
            if !self.names.contains(&line.name) {
                self.names.insert(line.name.clone());
            }
            if self.filter.lets(&line) {
                self.chosen.push(line);
            }
        }
    }

    /// Shows it.
    pub fn show(&mut self, ui: &mut egui::Ui, log: &Log) {
        self.choices(ui);
        self.take(log);
        if self.chosen.is_empty() {
            ui.weak(if log.count() == 0 {
                "Nothing has been said."
            } else {
                "No line is like that."
            });
        }
        let row = ui.text_style_height(&egui::TextStyle::Monospace);
        let colours = Colours::of(ui.visuals());
        let count = self.chosen.len();
        let area = ScrollArea::both().auto_shrink(false).stick_to_bottom(true);
        area.show_rows(ui, row, count, |ui, rows| {
            for line in &self.chosen[rows] {
                show_line(ui, line, &colours);
            }
        });
    }

    fn choices(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_wrapped(|ui| {
            let of = self.filter.of.clone();
            let chosen = of.as_deref().unwrap_or("all components");
            let names = ComboBox::from_id_salt("log of").selected_text(chosen).show_ui(ui, |ui| {
                ui.selectable_value(&mut self.filter.of, None, "all components");
                for name in &self.names {
                    ui.selectable_value(&mut self.filter.of, Some(name.clone()), name);
                }
            });
            names.response.accessible_name("lines of");
            let least = self.filter.least;
            let levels =
                ComboBox::from_id_salt("log level").selected_text(least.name()).show_ui(ui, |ui| {
                    for least in Least::ALL {
                        ui.selectable_value(&mut self.filter.least, least, least.name());
                    }
                });
            levels.response.accessible_name("how grave");
            let words = TextEdit::singleline(&mut self.filter.words);
            ui.add(words.hint_text("words").desired_width(160.0)).accessible_name("words in lines");
            ui.weak(format!("{} lines", self.chosen.len()));
        });
    }
}

fn show_line(ui: &mut egui::Ui, line: &Line, colours: &Colours) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 8.0;
        let time = line.time_s.map_or(String::new(), |time_s| format!("{time_s:.3}"));
        let time = format!("{time:>9}");
        ui.label(RichText::new(time).monospace().color(colours.weak));
        // The same name has the same colour in every run; its low bits are as good as any.
        let hue = (armor_wire::schema::hash_text(&line.name) & 0xff) as usize;
        let name = RichText::new(format!("{:12}", line.name)).monospace();
        ui.label(name.color(colours.of_type(hue)));
        let ink = match line.level.as_str() {
            "ERROR" => colours.error,
            "WARN" => colours.warning,
            "DEBUG" | "TRACE" => colours.weak,
            _ => colours.text,
        };
        ui.label(RichText::new(format!("{:5}", line.level)).monospace().color(ink));
        let text = crate::text::paintable(ui.ctx(), &line.text).into_owned();
        ui.add(Label::new(RichText::new(text).monospace().color(ink)).extend());
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(name: &str, level: &str, text: &str) -> Line {
        Line { time_s: None, name: name.into(), level: level.into(), text: text.into() }
    }

    fn chosen(filter: &Filter) -> Vec<String> {
        let log = Log::default();
        log.push(line("laser", "INFO", "ready"));
        log.push(line("laser", "WARN", "slow disk"));
        log.push(line("mapper", "ERROR", "no disk"));
        log.push(line("mapper", "", "plain words"));
        log.push(line("mapper", "DEBUG", "chatter"));
        let mut panel = Panel { filter: filter.clone(), ..Panel::default() };
        panel.take(&log);
        panel.chosen.iter().map(|line| line.text.clone()).collect()
    }

    #[test]
    fn lines_are_chosen_by_component_gravity_and_words() {
        let all = Filter::default();
        assert_eq!(chosen(&all).len(), 5);
        let laser = Filter { of: Some("laser".into()), ..all.clone() };
        assert_eq!(chosen(&laser), ["ready", "slow disk"]);
        let grave = Filter { least: Least::Warning, ..all.clone() };
        assert_eq!(chosen(&grave), ["slow disk", "no disk"]);
        let told = Filter { least: Least::Info, ..all.clone() };
        assert_eq!(chosen(&told), ["ready", "slow disk", "no disk", "plain words"]);
        let disk = Filter { words: "DISK mapper".into(), ..all };
        assert_eq!(chosen(&disk), ["no disk"]);
    }

    #[test]
    fn new_lines_are_added_and_another_log_begins_anew() {
        let mut panel = Panel::default();
        let log = Log::default();
        log.push(line("laser", "", "one"));
        panel.take(&log);
        log.push(line("laser", "", "two"));
        panel.take(&log);
        panel.take(&log);
        assert_eq!(panel.chosen.len(), 2);
        let other = Log::default();
        other.push(line("mapper", "", "three"));
        panel.take(&other);
        assert_eq!(panel.chosen.iter().map(|line| &*line.text).collect::<Vec<_>>(), ["three"]);
        assert_eq!(panel.names.iter().collect::<Vec<_>>(), ["mapper"]);
    }
}
