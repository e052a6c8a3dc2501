//! Fields of a form that change the file when they are left, so that one change of a field is one
//! step of the history. What is being written belongs to its field also when another is shown.

use std::fmt::Debug;
use std::hash::Hash;

use eframe::egui::{self, Key, Modifiers, Response, TextBuffer, TextEdit, TextStyle};

/// The text that is being edited in a form whose fields are distinguished by `F`.
#[derive(Debug)]
pub struct Drafts<F> {
    /// The field, its text, and whether it was shown in this frame.
    current: Option<(F, String, bool)>,
    /// Fields that were left, to be applied.
    finished: Vec<(F, String)>,
    /// Counts the letters that were typed.
    revision: u64,
    /// The field that had the focus last, and its widget.
    focus: Option<(F, egui::Id)>,
}

impl<F> Default for Drafts<F> {
    fn default() -> Self {
        Self { current: None, finished: Vec::new(), revision: 0, focus: None }
    }
}

/// How a field looks.
#[derive(Clone, Copy, Debug)]
pub struct Form<'a> {
    /// Its name for screen readers and tests.
    pub name: &'a str,
    /// Shown while it is empty.
    pub hint: &'a str,
    /// Its width; 0 takes the available width.
    pub width: f32,
    /// Rows; more than 1 is a text with line breaks.
    pub rows: usize,
}

impl<F: Clone + Debug + Hash + PartialEq> Drafts<F> {
    /// A field with a text, whose current value is `value`. `check` states what is wrong with a
    /// text.
    pub fn text(
        &mut self,
        ui: &mut egui::Ui,
        field: &F,
        value: &str,
        form: Form<'_>,
        check: &dyn Fn(&str) -> Result<(), String>,
    ) -> Response {
        let mut text = match &mut self.current {
            Some((own, text, is_shown)) if own == field => {
                *is_shown = true;
                text.clone()
            }
            _ => value.to_owned(),
        };
        let verdict = check(&text);
        let width = if form.width > 0.0 { form.width } else { ui.available_width() };
        let hint = egui::RichText::new(form.hint).weak();
        let edit = if form.rows > 1 {
            TextEdit::multiline(&mut text).desired_rows(form.rows)
        } else {
            TextEdit::singleline(&mut text)
        };
        let visuals = ui.visuals();
        let ink = if verdict.is_err() { visuals.error_fg_color } else { visuals.text_color() };
        // A character that no font has is shown as `?`.
        let mut layouter = |ui: &egui::Ui, text: &dyn TextBuffer, width: f32| {
            let shown = crate::text::paintable(ui.ctx(), text.as_str()).into_owned();
            let font = TextStyle::Body.resolve(ui.style());
            let width = if form.rows > 1 { width } else { f32::INFINITY };
            ui.painter().layout(shown, font, ink, width)
        };
        let edit = edit.hint_text(hint).desired_width(width).layouter(&mut layouter);
        let mut response = show_edit(ui, field, edit).accessible_name(form.name);
        if response.has_focus() {
            self.focus = Some((field.clone(), response.id));
        }
        if response.changed() {
            self.begin(field.clone(), text);
        }
        if response.lost_focus() {
            if ui.input(|i| i.key_pressed(Key::Escape)) {
                self.current = None;
            } else {
                self.end();
            }
            consume_return(ui);
        }
        if let Err(why) = verdict {
            response = response.on_hover_text(why);
        }
        response
    }

    /// Shows a field that is not being edited.
    pub fn set(&mut self, field: F, value: impl Into<String>) {
        self.finished.push((field, value.into()));
    }

    /// Stores a value that is not final yet, such as that of a slider that is being dragged.
    pub fn begin(&mut self, field: F, text: String) {
        if self.current.as_ref().is_some_and(|(own, ..)| *own != field) {
            self.end();
        }
        self.current = Some((field, text, true));
        self.revision += 1;
    }

    /// What is being written, into which field, and a number that is another with each letter.
    pub fn current(&self) -> Option<(&F, &str, u64)> {
        self.current.as_ref().map(|(field, text, _)| (field, text.as_str(), self.revision))
    }

    /// What is being written into a field, also if it was ended in this frame and is not taken yet:
    /// a fast hand writes and leaves immediately.
    pub fn writing(&self, field: &F) -> Option<&str> {
        let current = self.current.as_ref().map(|(own, text, _)| (own, text));
        let ended = self.finished.iter().rev().map(|(own, text)| (own, text));
        let mut all = current.into_iter().chain(ended);
        all.find(|(own, _)| *own == field).map(|(_, text)| text.as_str())
    }

    /// Ends the editing of the field, so that its text is applied.
    pub fn end(&mut self) {
        if let Some((field, text, _)) = self.current.take() {
            self.finished.push((field, text));
        }
    }

    /// The field that has the focus.
    pub fn focused(&self, ctx: &egui::Context) -> Option<&F> {
        let (field, widget) = self.focus.as_ref()?;
        (ctx.memory(|memory| memory.focused()) == Some(*widget)).then_some(field)
    }

    /// What was finished in this frame: to be called once, after the form was shown. A field that
    /// is not shown any longer was left.
    pub fn finish(&mut self) -> Vec<(F, String)> {
        match &mut self.current {
            Some((_, _, is_shown)) if *is_shown => *is_shown = false,
            Some(_) => self.end(),
            None => {}
        }
        std::mem::take(&mut self.finished)
    }
}

/// Shows a field of a text of `what`. Its history is that of `what`, and begins when the field gets the
/// focus: undo never brings the text of another thing, or one from before other changes of the file.
pub fn show_edit(ui: &mut egui::Ui, what: &(impl Hash + Debug), edit: TextEdit<'_>) -> Response {
    let id = ui.make_persistent_id(("edit", what));
    let response = ui.add(edit.id(id));
    if response.gained_focus()
        && let Some(mut state) = TextEdit::load_state(ui.ctx(), id)
    {
        state.clear_undoer();
        state.store(ui.ctx(), id);
    }
    response
}

/// Returns whether a field was left with Return, which then reaches nothing else in this frame.
pub fn is_entered(ui: &egui::Ui, field: &Response) -> bool {
    field.lost_focus() && consume_return(ui)
}

fn consume_return(ui: &egui::Ui) -> bool {
    ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Enter))
}

/// Accepts any text.
pub fn anything(_: &str) -> Result<(), String> {
    Ok(())
}
