//! The fields of the mission's panels. What is typed takes effect when the field is left, with
//! Enter or by doing something else; Escape restores the value of the file. What is wrong with a text
//! stands beneath it while it is typed. A text that would be malformed in the file is refused: it
//! stays in its field, with the reason, and the file keeps its value.

use std::collections::{BTreeMap, BTreeSet};

use eframe::egui::{self, Key, RichText};

use super::changes::Change;
use crate::panels::fields::{self, Drafts};
use armor_picture::theme::ThemeColours;

/// The fields of one panel.
#[derive(Default)]
pub struct Form {
    drafts: Drafts<Field>,
    /// What the texts that are being written will change, or why one cannot change anything.
    pending: BTreeMap<Field, Pending>,
    /// Texts that were refused and stay in their fields.
    refused: BTreeMap<Field, RefusedText>,
    /// The fields of this frame.
    shown: BTreeSet<Field>,
    changes: Vec<Made>,
    /// What the fields are of, so that the same field of another thing is another field.
    of: String,
    /// Whether the next field is to get the focus.
    wants_focus: bool,
    /// The file's text of the next field, if that is not understood.
    unread: Option<String>,
}

/// A field: of what, and which.
type Field = (String, String);

/// What a text that is being written will change.
struct Pending {
    made: Made,
    /// The field's value in the file.
    value: String,
}

/// A text that cannot be in the file.
struct RefusedText {
    text: String,
    why: String,
    /// The field's value in the file; once it has changed, the text is out of date.
    value: String,
}

/// Tries a change without making it: why the file would be malformed with it.
pub type Trial<'a> = &'a mut dyn FnMut(&Change) -> Result<(), String>;

/// A change, or why what was written makes none.
pub type Made = Result<Change, String>;

/// Whether a text would do, and if not, why.
pub type Judge<'a> = &'a dyn Fn(&str) -> Result<(), String>;

impl Form {
    /// What the fields from here on are of.
    pub fn of(&mut self, what: impl ToString) -> &mut Self {
        self.of = what.to_string();
        self
    }

    /// Gives the next field the focus.
    pub fn take_focus(&mut self) {
        self.wants_focus = true;
    }

    /// The file's text of the next field, if it could not be read: shown as it stands, to be
    /// fixed.
    pub fn unread(&mut self, text: Option<&str>) -> &mut Self {
        self.unread = text.map(str::to_owned);
        self
    }

    /// Something that was chosen rather than typed.
    pub fn change(&mut self, change: Change) {
        self.changes.push(Ok(change));
    }

    /// The changes of this frame, once all fields were shown. What `trial` refuses is not among
    /// them: the reason is beneath its field, or is returned where that is no longer shown.
    pub fn finish(&mut self, trial: Trial<'_>) -> Vec<Made> {
        let shown = std::mem::take(&mut self.shown);
        self.finish_fields(trial, &shown)
    }

    fn finish_fields(&mut self, trial: Trial<'_>, shown: &BTreeSet<Field>) -> Vec<Made> {
        for (field, text) in self.drafts.finish() {
            self.refused.remove(&field);
            let Some(Pending { made, value }) = self.pending.remove(&field) else { continue };
            match made.and_then(|change| trial(&change).map(|()| change)) {
                Ok(change) => self.changes.push(Ok(change)),
                Err(why) => {
                    let why = without_attribute(why);
                    if !shown.contains(&field) {
                        self.changes.push(Err(format!("{} not changed: {why}", field.1)));
                    }
                    self.refused.insert(field, RefusedText { text, why, value });
                }
            }
        }
        std::mem::take(&mut self.changes)
    }

    /// Ends the editing of a field, as if it were left.
    pub fn end(&mut self, trial: Trial<'_>) -> Vec<Made> {
        self.drafts.end();
        self.finish_fields(trial, &BTreeSet::new())
    }

    /// The name of the field that has the focus.
    pub fn focused(&self, ctx: &egui::Context) -> Option<&str> {
        self.drafts.focused(ctx).map(|(_, name)| name.as_str())
    }

    /// The change by the field that is being edited, with a number that changes with each letter.
    pub fn draft(&self) -> Option<(u64, Change)> {
        let (field, _, revision) = self.drafts.current()?;
        let change = self.pending.get(field)?.made.as_ref().ok()?;
        Some((revision, change.clone()))
    }

    /// A line of text. `make` states what the new text changes; nothing if it is to stay as it was.
    pub fn line(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        value: &str,
        judge: Judge<'_>,
        make: impl Fn(&str) -> Option<Change>,
    ) -> egui::Response {
        self.hinted(ui, name, "", value, judge, make)
    }

    /// The same with something that is shown while it is empty.
    pub fn hinted(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        hint: &str,
        value: &str,
        judge: Judge<'_>,
        make: impl Fn(&str) -> Option<Change>,
    ) -> egui::Response {
        let field = (self.of.clone(), name.to_owned());
        self.shown.insert(field.clone());
        let unread = self.unread.take();
        let value = unread.as_deref().unwrap_or(value);
        let form = fields::Form { name, hint, width: 0.0, rows: 1 };
        self.refused.retain(|of, refused| *of != field || refused.value == value);
        let refused = self.refused.get(&field).map(|refused| refused.text.clone());
        let shown = refused.as_deref().unwrap_or(value);
        let response = self.drafts.text(ui, &field, shown, form, judge);
        if std::mem::take(&mut self.wants_focus) {
            response.request_focus();
        }
        if let Some(text) = refused.filter(|_| response.gained_focus()) {
            // Leaving the field tries the text again: another field may have been fixed.
            self.drafts.begin(field.clone(), text);
        } else if response.lost_focus() && ui.input(|input| input.key_pressed(Key::Escape)) {
            self.refused.remove(&field);
        }
        let written = self.drafts.writing(&field).map(str::to_owned);
        let refused = self.refused.get(&field);
        let standing = refused.map_or(value, |refused| refused.text.as_str());
        let text = written.as_deref().unwrap_or(standing);
        let verdict = judge(text);
        let refusal = refused.filter(|refused| refused.text == text).map(|refused| &refused.why);
        if let Some(why) = verdict.as_ref().err().or(refusal) {
            wrong(ui, why);
        }
        if let Some(text) = written {
            self.pending.remove(&field);
            let made = match verdict {
                _ if text == value => None,
                Ok(()) => make(&text).map(Ok),
                Err(why) => Some(Err(why)),
            };
            let value = value.to_owned();
            self.pending.extend(made.map(|made| (field, Pending { made, value })));
        }
        response
    }

    /// A choice among values, of which `None` is one.
    pub fn choice<T: PartialEq + Clone>(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        value: &T,
        choices: &[(T, String)],
        make: impl Fn(&T) -> Change,
    ) -> egui::Response {
        let unread = self.unread.take();
        let is_it = |choice: &T| choice == value && unread.is_none();
        let shown = choices.iter().find(|(choice, _)| is_it(choice));
        let shown = shown.map_or("..", |(_, text)| text.as_str());
        let shown = unread.as_deref().unwrap_or(shown);
        let combo = egui::ComboBox::from_id_salt(("mission choice", &self.of, name));
        let combo = combo.selected_text(shown).width(ui.available_width().min(240.0));
        let shown = combo.show_ui(ui, |ui| {
            for (choice, text) in choices {
                if ui.selectable_label(is_it(choice), text).clicked() && !is_it(choice) {
                    self.change(make(choice));
                }
            }
        });
        if let Some(text) = &unread {
            not_understood(ui, text);
        }
        shown.response.accessible_name(name)
    }

    /// Yes or no.
    pub fn flag(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        value: bool,
        make: impl Fn(bool) -> Change,
    ) -> egui::Response {
        let mut is_set = value;
        let response = ui.checkbox(&mut is_set, name);
        if is_set != value {
            self.change(make(is_set));
        }
        if let Some(text) = self.unread.take() {
            not_understood(ui, &text);
        }
        response
    }

    /// A whole number, typed.
    pub fn number(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        value: i64,
        range: std::ops::RangeInclusive<i64>,
        make: impl Fn(i64) -> Change,
    ) -> egui::Response {
        let judge = |text: &str| match text.trim().parse::<i64>() {
            Ok(number) if range.contains(&number) => Ok(()),
            _ => Err(format!("a whole number from {} to {}", range.start(), range.end())),
        };
        let make = |text: &str| {
            let number = text.trim().parse::<i64>().ok();
            number.filter(|number| range.contains(number)).map(&make)
        };
        self.line(ui, name, &value.to_string(), &judge, make)
    }
}

/// A reason without the attribute that it begins with: the field has its own name.
fn without_attribute(why: String) -> String {
    let is_attribute = |word: &str| word.bytes().all(|b| b.is_ascii_lowercase() || b == b'-');
    match why.split_once(": ") {
        Some((attribute, rest)) if is_attribute(attribute) => rest.to_owned(),
        _ => why,
    }
}

/// What is wrong, with a sign before it that is no colour.
pub fn wrong(ui: &mut egui::Ui, why: &str) {
    let colour = ThemeColours::of(ui.visuals()).error;
    ui.label(RichText::new(format!("! {why}")).color(colour).small());
}

fn not_understood(ui: &mut egui::Ui, text: &str) {
    wrong(ui, &format!("not understood: {}", crate::text::short(text, 60)));
}

/// A row of a form: a name and what is edited.
pub fn row<R>(
    ui: &mut egui::Ui,
    name: &str,
    doc: &str,
    contents: impl FnOnce(&mut egui::Ui) -> R,
) -> R {
    const NAME_WIDTH: f32 = 92.0;
    let inner = ui.horizontal(|ui| {
        let height = ui.spacing().interact_size.y;
        let label = egui::Label::new(RichText::new(name).weak()).truncate();
        let left = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(egui::vec2(NAME_WIDTH, height), left, |ui| {
            ui.set_min_width(NAME_WIDTH);
            ui.add(label).on_hover_text(doc);
        });
        ui.vertical(contents).inner
    });
    inner.inner
}

/// Whether a text is a length of time, such as `90s`; empty is none.
pub fn is_time(text: &str) -> Result<(), String> {
    if text.trim().is_empty() {
        return Ok(());
    }
    match armor_wire::quantity::seconds(text.trim()) {
        Ok(seconds) if seconds >= 0.0 => Ok(()),
        Ok(_) => Err("a time cannot be negative".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// Whether a text is a name of the format.
pub fn is_name(text: &str) -> Result<(), String> {
    match armor_wire::name::is_name(text) {
        true => Ok(()),
        false => {
            Err("a name starts with a letter, followed by letters, digits, _ and -; at most 64 characters".into())
        }
    }
}

/// Whether a text is a date in UTC; empty is none.
pub fn is_date(text: &str) -> Result<(), String> {
    if text.trim().is_empty() {
        return Ok(());
    }
    text.trim().parse::<armor_robotfile::Date>().map(|_| ())
}

/// Whether a text is a guard; empty is none. A mistake is shown with what stands there.
pub fn is_guard(text: &str) -> Result<(), String> {
    if text.trim().is_empty() {
        return Ok(());
    }
    match armor_robotfile::guard::Guard::parse(text) {
        Ok(_) => Ok(()),
        Err(error) => {
            let place = text.get(error.at.clone()).filter(|place| !place.trim().is_empty());
            let place = place.map_or_else(|| "at its end".to_owned(), |at| format!("at {at}"));
            Err(format!("{place}: {}; {}", error.message, error.remedy))
        }
    }
}

/// Whether a text is a whole number that is worked out from variables; empty is none.
pub fn is_count(text: &str) -> Result<(), String> {
    if text.trim().is_empty() {
        return Ok(());
    }
    armor_robotfile::guard::Count::parse(text).map(|_| ()).map_err(|error| error.to_string())
}

/// Whether a text is a check.
pub fn is_check(text: &str) -> Result<(), String> {
    match armor_robotfile::claim::Claim::parse(text) {
        Ok(_) => Ok(()),
        Err(error) => Err(error.to_string()),
    }
}

/// A time as in a file: `90s`, `0.2s`, `10min`.
pub fn time_text(time: std::time::Duration) -> String {
    let seconds = time.as_secs_f64();
    match time.as_secs() {
        whole if whole >= 60 && whole % 60 == 0 && time.subsec_nanos() == 0 => {
            format!("{}min", whole / 60)
        }
        _ => format!("{seconds}s"),
    }
}

/// A text, or none if it is empty.
pub fn given(text: &str) -> Option<String> {
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_said_with_the_words_of_the_languages() {
        assert_eq!(is_time("90s"), Ok(()));
        assert!(is_time("-1s").is_err() && is_time("90").is_err() && is_time("5m").is_err());
        assert!(is_name("a b").is_err() && is_name("a-b").is_ok());
        assert!(is_date("2026-11-21T14:30Z").is_ok() && is_date("tomorrow").is_err());
        assert!(is_guard("battery < 30%").is_ok() && is_guard("").is_ok());
        let why = is_guard("battery < ) 3").unwrap_err();
        assert!(why.starts_with("at )"), "{why}");
        assert!(is_check("always home").is_ok() && is_check("often home").is_err());
    }
}
