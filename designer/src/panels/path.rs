//! Choosing a file: a list to click through, and a path to type, which Tab completes. The dialogs
//! of a desktop are not used, since they hang where no desktop runs. Everything works by keyboard.

use std::path::{Path, PathBuf};

use eframe::egui::{
    self, Align, EventFilter, Key, Layout, Modifiers, RichText, ScrollArea, TextEdit, Ui,
};

use crate::disk::listing::{Entry, complete, entries, meant, parts, with_ending};

/// Rows that are visible without scrolling.
const ROWS: f32 = 13.0;

/// A file being chosen.
#[derive(Debug)]
pub struct PathChoice {
    folder: PathBuf,
    home: Option<PathBuf>,
    typed: String,
    /// Only files with this ending are listed; empty lists all.
    ending: &'static str,
    /// Whether the file may be a new one.
    is_new: bool,
    /// The folder that the typed path has reached, and its entries.
    listed: Option<(PathBuf, Result<Vec<Entry>, String>)>,
    /// The entry that was clicked, or selected by the arrow keys.
    marked: Option<usize>,
    trouble: Option<String>,
    is_open: bool,
}

/// The result of choosing.
#[derive(Debug, PartialEq, Eq)]
pub enum Chosen {
    /// Nothing yet.
    Open,
    /// The choice was cancelled.
    Left,
    /// This file.
    File(PathBuf),
}

enum Action {
    Go(PathBuf),
    Leave,
}

impl PathChoice {
    /// Chooses a file in a folder, with a name to begin with.
    pub fn new(folder: &Path, name: &str, ending: &'static str, is_new: bool) -> Self {
        Self {
            folder: std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf()),
            home: std::env::var_os("HOME").map(PathBuf::from),
            typed: name.to_owned(),
            ending,
            is_new,
            listed: None,
            marked: None,
            trouble: None,
            is_open: false,
        }
    }

    /// Shows the choice; `verb` is the text of its button.
    pub fn show(&mut self, ui: &mut Ui, verb: &str) -> Chosen {
        self.list();
        self.show_parent_folders(ui);
        let clicked = self.rows(ui);
        let entered = self.field(ui);
        if let Some(trouble) = &self.trouble {
            ui.colored_label(ui.visuals().error_fg_color, trouble);
        }
        let pressed = self.buttons(ui, verb);
        match clicked.or(entered).or(pressed) {
            Some(Action::Go(path)) => self.choose(path),
            Some(Action::Leave) => Chosen::Left,
            None => Chosen::Open,
        }
    }

    /// Reads the folder that the typed path has reached, if it is another one.
    fn list(&mut self) {
        let folder = meant(&self.folder, self.home.as_deref(), parts(&self.typed).0);
        if self.listed.as_ref().is_none_or(|(of, _)| *of != folder) {
            let found = entries(&folder, self.ending).map_err(|error| error.to_string());
            self.listed = Some((folder, found));
        }
    }

    /// The entries that begin as typed; all of them while a whole name stands there.
    fn shown(&self) -> Vec<Entry> {
        let Some((_, Ok(all))) = &self.listed else { return Vec::new() };
        let begun = parts(&self.typed).1;
        let is_whole = all.iter().any(|entry| entry.name == begun);
        // A new name matches no entry.
        if self.is_new || self.marked.is_some() || is_whole {
            return all.clone();
        }
        complete(all, &self.typed).choices
    }

    /// The folders above, each a button.
    fn show_parent_folders(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            let mut above: Vec<PathBuf> = self.folder.ancestors().map(Into::into).collect();
            above.reverse();
            for folder in above {
                let name = folder.file_name().map_or("/".into(), |name| name.to_string_lossy());
                let name = crate::text::paintable(ui.ctx(), &name).into_owned();
                if ui.button(name).clicked() {
                    self.enter(folder);
                }
            }
        });
    }

    fn rows(&mut self, ui: &mut Ui) -> Option<Action> {
        let height = ui.spacing().interact_size.y * ROWS;
        let area = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        area.auto_shrink(false)
            .show(ui, |ui| {
                if let Some((folder, Err(reason))) = &self.listed {
                    let text = format!("{} cannot be read: {reason}", folder.display());
                    ui.colored_label(ui.visuals().error_fg_color, text);
                    return None;
                }
                let shown = self.shown();
                if shown.is_empty() {
                    ui.weak("no files here");
                }
                let mut action = None;
                ui.with_layout(Layout::top_down_justified(Align::LEFT), |ui| {
                    for (n, entry) in shown.iter().enumerate() {
                        action = action.take().or(self.row(ui, n, entry));
                    }
                });
                action
            })
            .inner
    }

    fn row(&mut self, ui: &mut Ui, n: usize, entry: &Entry) -> Option<Action> {
        let is_marked = self.marked == Some(n);
        let name = crate::text::paintable(ui.ctx(), &entry.name).into_owned();
        let text = match entry.is_folder {
            true => RichText::new(format!("{name}/")).strong(),
            false => RichText::new(name),
        };
        let row = ui.selectable_label(is_marked, text);
        if row.double_clicked() {
            return Some(Action::Go(entry.path.clone()));
        }
        if row.clicked() {
            self.mark(n, entry);
        } else if is_marked
            && ui
                .input(|input| input.key_pressed(Key::ArrowDown) || input.key_pressed(Key::ArrowUp))
        {
            row.scroll_to_me(None);
        }
        None
    }

    fn mark(&mut self, n: usize, entry: &Entry) {
        let parent = parts(&self.typed).0.to_owned();
        self.typed = parent + &entry.name;
        self.marked = Some(n);
        self.trouble = None;
    }

    fn field(&mut self, ui: &mut Ui) -> Option<Action> {
        let id = ui.scope_id().with("path");
        if ui.memory(|memory| memory.has_focus(id)) {
            self.keys(ui, id);
        }
        // Tab continues with the path, the arrows go through the list.
        let filter = EventFilter {
            tab: true,
            horizontal_arrows: true,
            vertical_arrows: true,
            escape: false,
        };
        let edit = TextEdit::singleline(&mut self.typed)
            .id(id)
            .hint_text("file name or path; Tab completes it")
            .desired_width(f32::INFINITY)
            .event_filter(filter)
            .cursor_at_end(true);
        let field = ui.add(edit).accessible_name("File name");
        if !self.is_open {
            field.request_focus();
            self.is_open = true;
        }
        if field.changed() {
            self.marked = None;
            self.trouble = None;
        }
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if is_entered {
            field.request_focus();
        }
        is_entered.then(|| Action::Go(self.meant()))
    }

    fn keys(&mut self, ui: &Ui, id: egui::Id) {
        let pressed = |key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        if pressed(Key::Tab)
            && let Some((_, Ok(all))) = &self.listed
        {
            self.typed = complete(all, &self.typed).typed;
            self.marked = None;
            put_cursor_at_end(ui, id, &self.typed);
        }
        let (down, up) = (pressed(Key::ArrowDown), pressed(Key::ArrowUp));
        let shown = self.shown();
        let Some(last) = shown.len().checked_sub(1).filter(|_| down != up) else { return };
        let n = match self.marked {
            None if down => 0,
            None => last,
            Some(n) if down => (n + 1).min(last),
            Some(n) => n.saturating_sub(1),
        };
        self.mark(n, &shown[n]);
        put_cursor_at_end(ui, id, &self.typed);
    }

    fn buttons(&self, ui: &mut Ui, verb: &str) -> Option<Action> {
        ui.horizontal(|ui| {
            let go = ui.add_enabled(!self.typed.is_empty(), egui::Button::new(verb)).clicked();
            let escaped = ui.input(|input| input.key_pressed(Key::Escape));
            let leaves = ui.button("Cancel").clicked() || escaped;
            let go = go.then(|| Action::Go(self.meant()));
            go.or(leaves.then_some(Action::Leave))
        })
        .inner
    }

    fn meant(&self) -> PathBuf {
        meant(&self.folder, self.home.as_deref(), self.typed.trim_end())
    }

    /// Enters a folder. A name to save under is kept; a typed path is cleared.
    fn enter(&mut self, folder: PathBuf) {
        if !self.is_new || self.typed.contains('/') {
            self.typed.clear();
        }
        self.folder = folder;
        self.listed = None;
        self.marked = None;
        self.trouble = None;
        self.is_open = false;
    }

    fn choose(&mut self, path: PathBuf) -> Chosen {
        if path.is_dir() {
            if path == self.meant() {
                self.typed.clear();
            }
            // Without the parts that lead back, so that the path above is the real one.
            self.enter(std::fs::canonicalize(&path).unwrap_or(path));
            return Chosen::Open;
        }
        let path = if self.is_new { with_ending(path, self.ending) } else { path };
        let folder = path.parent().unwrap_or(Path::new("/"));
        self.trouble = if !self.is_new && !path.is_file() {
            Some(format!("no file {}", path.display()))
        } else if self.is_new && !folder.is_dir() {
            Some(format!("no folder {}", folder.display()))
        } else {
            None
        };
        if self.trouble.is_some() { Chosen::Open } else { Chosen::File(path) }
    }
}

/// Sets the text as if it had been typed.
fn put_cursor_at_end(ui: &Ui, id: egui::Id, text: &str) {
    use egui::text::{CCursor, CCursorRange};
    let mut state = TextEdit::load_state(ui.ctx(), id).unwrap_or_default();
    let end = CCursor::new(text.chars().count());
    state.cursor.set_char_range(Some(CCursorRange::one(end)));
    TextEdit::store_state(ui.ctx(), id, state);
}

#[cfg(test)]
mod tests;
