//! The log of the processes, filtered by component, severity and words.

use std::collections::BTreeSet;
use std::sync::Arc;

use armor_inspect::log::{LogLine, RunLog};
use eframe::egui::{
    self, Color32, ComboBox, Label, Rect, RichText, ScrollArea, TextEdit, TextStyle, UiBuilder,
    vec2,
};

use super::rows::Rows;
use super::session::{PastRun, Session};
use armor_picture::theme::ThemeColours;

/// The least severity that is shown.
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
            Self::Info => "INFO and above",
            Self::Warning => "WARN and above",
            Self::Error => "only ERROR",
        }
    }

    /// A line without a severity counts as INFO.
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
    /// Only lines of this component; none: of all.
    of: Option<String>,
    least: Least,
    words: String,
}

impl Filter {
    fn lets(&self, line: &LogLine) -> bool {
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

/// The log and its filter.
pub struct Panel {
    filter: Filter,
    /// The filter by which the lines below were chosen.
    chosen_by: Filter,
    chosen: Vec<Arc<LogLine>>,
    /// Their rows.
    rows: Rows,
    /// Whether the newest line is kept in sight.
    follows: bool,
    names: BTreeSet<String>,
    /// The log that the lines are of.
    log: RunLog,
    /// An earlier run whose log is shown.
    past: Option<RunLog>,
    /// The number of the next line of the log.
    next: u64,
    /// What needs attention in the log.
    grave: GraveCount,
}

/// The errors and warnings of a log.
#[derive(Default)]
struct GraveCount {
    log: RunLog,
    next: u64,
    errors: usize,
    warnings: usize,
}

impl GraveCount {
    /// Counts those of the new lines.
    fn take(&mut self, log: &RunLog) {
        if !self.log.is_same(log) {
            *self = Self { log: log.clone(), ..Self::default() };
        }
        if log.count() == self.next {
            return;
        }
        let (first, lines) = log.since(self.next);
        self.next = first + lines.len() as u64;
        for line in lines {
            match line.level.as_str() {
                "ERROR" => self.errors += 1,
                "WARN" => self.warnings += 1,
                _ => {}
            }
        }
    }

    /// Each kind that there is in words, with its level.
    fn words(&self) -> impl Iterator<Item = (String, &'static str)> {
        let counts = [(self.errors, "error", "ERROR"), (self.warnings, "warning", "WARN")];
        counts.into_iter().filter(|(count, ..)| *count > 0).map(|(count, word, level)| {
            (format!("{count} {word}{}", if count == 1 { "" } else { "s" }), level)
        })
    }
}

impl Default for Panel {
    fn default() -> Self {
        Self {
            filter: Filter::default(),
            chosen_by: Filter::default(),
            chosen: Vec::new(),
            rows: Rows::default(),
            follows: true,
            names: BTreeSet::new(),
            log: RunLog::default(),
            past: None,
            next: 0,
            grave: GraveCount::default(),
        }
    }
}

impl Panel {
    /// Shows only the lines of one component, or of all again.
    pub fn only(&mut self, name: Option<&str>) {
        self.filter.of = name.map(Into::into);
    }

    /// Adds the new lines.
    fn take(&mut self, log: &RunLog) {
        let is_other = !self.log.is_same(log);
        if self.filter != self.chosen_by || is_other {
            if is_other {
                self.names.clear();
                self.log = log.clone();
                self.follows = true;
            }
            self.chosen.clear();
            self.rows = Rows::default();
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

    /// Shows the log of what runs, or of an earlier run that was chosen.
    pub fn show(&mut self, ui: &mut egui::Ui, session: &Session) {
        self.past.take_if(|past| !session.past.iter().any(|run| run.log.is_same(past)));
        self.choices(ui, session);
        let log = self.past.clone().unwrap_or_else(|| session.log.clone());
        let log = &log;
        self.take(log);
        if self.chosen.is_empty() {
            ui.weak(if log.count() == 0 { "No log lines yet." } else { "No matching lines." });
        }
        self.lines(ui);
    }

    /// Shows the newest line of what runs, cut off where the room ends, after the number of errors
    /// and warnings.
    pub fn show_newest(&mut self, ui: &mut egui::Ui, session: &Session) {
        let log = &session.log;
        self.grave.take(log);
        let colours = ThemeColours::of(ui.visuals());
        for (words, level) in self.grave.words() {
            ui.colored_label(level_colour(level, colours), words);
        }
        let newest = log.since(log.count().saturating_sub(1)).1.pop();
        if let Some(line) = newest {
            let text = format!("{}: {}", line.name, line.text);
            let text = crate::text::paintable(ui.ctx(), &text).into_owned();
            let ink = match line.level.as_str() {
                "INFO" => colours.weak,
                level => level_colour(level, colours),
            };
            ui.add(Label::new(RichText::new(text).color(ink)).truncate());
        }
    }

    /// Shows the lines, the newest at the bottom. It stays visible until the user scrolls away from
    /// it.
    fn lines(&mut self, ui: &mut egui::Ui) {
        let font = TextStyle::Monospace.resolve(ui.style());
        let (height, letter) =
            ui.fonts_mut(|fonts| (fonts.row_height(&font), fonts.glyph_width(&font, 'm')));
        let width = ui.available_width() - ui.spacing().scroll.allocated_width();
        self.wrap((width / letter).max(0.0) as usize);
        let whole = self.rows.len() as f32 * height;
        let lowest = (whole - ui.available_height()).max(0.0);
        let mut area = ScrollArea::vertical().auto_shrink(false);
        if self.follows {
            area = area.vertical_scroll_offset(lowest);
        }
        // Otherwise egui scrolls back to the end of the previous, shorter text.
        ui.spacing_mut().scroll.kinetic.rubber_band = false;
        let colours = ThemeColours::of(ui.visuals());
        let shown = area.show_viewport(ui, |ui, seen| {
            ui.set_height(whole);
            ui.set_width(ui.available_width());
            let corner = ui.max_rect().min;
            let rows = (seen.min.y / height) as usize..(seen.max.y / height).ceil() as usize;
            for number in self.rows.within(rows) {
                let rows = self.rows.of(number);
                let size = vec2(ui.available_width(), rows.len() as f32 * height);
                let at = corner + vec2(0.0, rows.start as f32 * height);
                let place = UiBuilder::new().max_rect(Rect::from_min_size(at, size));
                let line = &self.chosen[number];
                let text = self.rows.wrap(&line.text, prefix_width(line));
                ui.scope_builder(place, |ui| show_line(ui, line, &text, colours));
            }
        });
        // Half a point: a difference by rounding is no scrolling.
        self.follows = shown.state.clamped_offset().y >= lowest - 0.5;
    }

    /// Computes where the lines stand, in rows of this number of characters.
    fn wrap(&mut self, columns: usize) {
        if !self.rows.are(columns) || self.rows.lines() > self.chosen.len() {
            self.rows.begin(columns);
        }
        for line in &self.chosen[self.rows.lines()..] {
            self.rows.push(&line.text, prefix_width(line));
        }
    }

    /// Which run the lines are of.
    fn choose_run(&mut self, ui: &mut egui::Ui, session: &Session) {
        let is_it = |past: &PastRun| self.past.as_ref().is_some_and(|log| log.is_same(&past.log));
        let chosen = session.past.iter().find(|past| is_it(past));
        let name = chosen.map_or(session.log_name.as_str(), |past| past.name.as_str()).to_owned();
        let runs = ComboBox::from_id_salt("log of run").selected_text(&name).show_ui(ui, |ui| {
            let is_now = self.past.is_none();
            if ui.selectable_label(is_now, format!("{} (newest)", session.log_name)).clicked() {
                self.past = None;
            }
            for past in &session.past {
                let is_chosen = chosen.is_some_and(|chosen| chosen.log.is_same(&past.log));
                if ui.selectable_label(is_chosen, &past.name).clicked() {
                    self.past = Some(past.log.clone());
                }
            }
        });
        runs.response.accessible_name("log of the run");
    }

    fn choices(&mut self, ui: &mut egui::Ui, session: &Session) {
        ui.horizontal_wrapped(|ui| {
            if !session.past.is_empty() {
                self.choose_run(ui, session);
            }
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
            levels.response.accessible_name("level");
            let words = TextEdit::singleline(&mut self.filter.words);
            ui.add(words.hint_text("words").desired_width(160.0)).accessible_name("words in lines");
            ui.weak(format!("{} lines", self.chosen.len()));
        });
    }
}

/// What stands before the text of a line: when, who, how grave.
fn before(line: &LogLine) -> [String; 3] {
    let time = line.time_s.map_or(String::new(), |time_s| format!("{time_s:.3}"));
    [format!("{time:>9} "), format!("{:12} ", line.name), format!("{:5} ", line.level)]
}

/// Returns the number of characters before its text.
fn prefix_width(line: &LogLine) -> usize {
    before(line).iter().map(|part| part.chars().count()).sum()
}

fn level_colour(level: &str, colours: &ThemeColours) -> Color32 {
    match level {
        "ERROR" => colours.error,
        "WARN" => colours.warning,
        "DEBUG" | "TRACE" => colours.weak,
        _ => colours.text,
    }
}

fn show_line(ui: &mut egui::Ui, line: &LogLine, text: &str, colours: &ThemeColours) {
    let ink = level_colour(&line.level, colours);
    // The same name has the same colour in every run; its low bits are as good as any.
    let hue = (armor_wire::schema::hash_text(&line.name) & 0xff) as usize;
    let [time, name, level] = before(line);
    let parts =
        [(time, colours.weak), (name, colours.of_type(hue)), (level, ink), (text.into(), ink)];
    ui.horizontal_top(|ui| {
        ui.spacing_mut().item_spacing.x = 0.0;
        for (part, ink) in parts {
            let part = crate::text::paintable(ui.ctx(), &part).into_owned();
            ui.add(Label::new(RichText::new(part).monospace().color(ink)).extend());
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(name: &str, level: &str, text: &str) -> LogLine {
        LogLine { time_s: None, name: name.into(), level: level.into(), text: text.into() }
    }

    fn chosen(filter: &Filter) -> Vec<String> {
        let log = RunLog::default();
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
        let important = Filter { least: Least::Info, ..all.clone() };
        assert_eq!(chosen(&important), ["ready", "slow disk", "no disk", "plain words"]);
        let disk = Filter { words: "DISK mapper".into(), ..all };
        assert_eq!(chosen(&disk), ["no disk"]);
    }

    #[test]
    fn new_lines_are_added_and_another_log_replaces_them() {
        let mut panel = Panel::default();
        let log = RunLog::default();
        log.push(line("laser", "", "one"));
        panel.take(&log);
        log.push(line("laser", "", "two"));
        panel.take(&log);
        panel.take(&log);
        assert_eq!(panel.chosen.len(), 2);
        let other = RunLog::default();
        for text in ["three", "four", "five"] {
            other.push(line("mapper", "", text));
        }
        panel.take(&other);
        let texts: Vec<_> = panel.chosen.iter().map(|line| &*line.text).collect();
        assert_eq!(texts, ["three", "four", "five"], "also if it has more lines already");
        assert_eq!(panel.names.iter().collect::<Vec<_>>(), ["mapper"]);
    }
}
