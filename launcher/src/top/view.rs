//! What `armor top` shows on a terminal, and what keys change in it. Pure: it knows no system and no
//! terminal.

use armor_inspect::run_control::RunRequest;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::snapshot::{ProcessRow, SortKey, TopSnapshot};

/// Rows that a page key moves by.
const PAGE: usize = 10;

/// The state of the display.
#[derive(Debug, Default)]
pub struct TopView {
    pub snapshot: TopSnapshot,
    pub sort: SortKey,
    pub is_reversed: bool,
    /// Only components and links with this in their name are shown.
    pub filter: String,
    pub shows: ShownTable,
    pub mode: KeyMode,
    /// The selected component, by name, so that it stays selected when the order changes.
    selected: Option<String>,
    /// The first link that is shown.
    pub first_link: usize,
    /// The result of the last request; empty if there is none.
    pub message: String,
}

/// Which table is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShownTable {
    #[default]
    Components,
    Links,
}

/// What keys mean now.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum KeyMode {
    #[default]
    Commands,
    /// They are the filter.
    Filter,
    /// `y` sends the request.
    Confirm { question: String, request: RunRequest },
}

/// What a key asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum KeyResult {
    /// Nothing beyond the display.
    Shown,
    /// To end; whether by Ctrl-C.
    Quit { is_interrupted: bool },
    /// To ask the launcher.
    Send(RunRequest),
}

impl TopView {
    /// Shows nothing yet.
    pub fn sorted_by(sort: SortKey) -> Self {
        Self { sort, ..Self::default() }
    }

    /// Shows a new look at the system.
    pub fn set_snapshot(&mut self, mut snapshot: TopSnapshot) {
        snapshot.sort_by(self.sort, self.is_reversed);
        self.snapshot = snapshot;
    }

    /// Returns the components that the filter leaves, in order.
    pub fn rows(&self) -> Vec<&ProcessRow> {
        let rows = self.snapshot.components.iter();
        rows.filter(|row| row.name.contains(&self.filter)).collect()
    }

    /// Returns the place of the selected component among [`rows`](Self::rows).
    pub fn selected(&self) -> Option<usize> {
        let name = self.selected.as_ref()?;
        self.rows().iter().position(|row| row.name == *name)
    }

    /// Handles a key.
    pub fn handle_key(&mut self, key: KeyEvent) -> KeyResult {
        if key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL) {
            return KeyResult::Quit { is_interrupted: true };
        }
        match std::mem::take(&mut self.mode) {
            KeyMode::Commands => self.handle_command(key.code),
            KeyMode::Filter => {
                self.edit_filter(key.code);
                KeyResult::Shown
            }
            KeyMode::Confirm { request, .. } => match key.code {
                KeyCode::Char('y' | 'Y') => {
                    self.message = "…".into();
                    KeyResult::Send(request)
                }
                _ => {
                    self.message = "nothing was done".into();
                    KeyResult::Shown
                }
            },
        }
    }

    fn handle_command(&mut self, code: KeyCode) -> KeyResult {
        match code {
            KeyCode::Char('q') => return KeyResult::Quit { is_interrupted: false },
            KeyCode::Char('s') => self.sort = self.sort.next(),
            KeyCode::Char('d') => self.is_reversed = !self.is_reversed,
            KeyCode::Char('/') => self.mode = KeyMode::Filter,
            KeyCode::Char('l') => {
                self.shows = match self.shows {
                    ShownTable::Components => ShownTable::Links,
                    ShownTable::Links => ShownTable::Components,
                }
            }
            KeyCode::Esc => {
                self.filter.clear();
                self.message.clear();
            }
            KeyCode::Char('k') => {
                self.ask("stop", |component| RunRequest::Stop { component });
            }
            KeyCode::Char('r') => {
                self.ask("restart", |component| RunRequest::Restart { component });
            }
            KeyCode::Up => self.move_by(-1),
            KeyCode::Down => self.move_by(1),
            KeyCode::PageUp => self.move_by(-(PAGE as isize)),
            KeyCode::PageDown => self.move_by(PAGE as isize),
            KeyCode::Home => self.move_by(isize::MIN / 2),
            KeyCode::End => self.move_by(isize::MAX / 2),
            _ => {}
        }
        self.snapshot.sort_by(self.sort, self.is_reversed);
        KeyResult::Shown
    }

    fn edit_filter(&mut self, code: KeyCode) {
        match code {
            KeyCode::Enter => return,
            KeyCode::Esc => {
                self.filter.clear();
                return;
            }
            KeyCode::Backspace => {
                self.filter.pop();
            }
            KeyCode::Char(letter) => self.filter.push(letter),
            _ => {}
        }
        self.mode = KeyMode::Filter;
    }

    /// Asks whether the selected component is to be stopped or restarted.
    fn ask(&mut self, verb: &str, request: impl Fn(String) -> RunRequest) {
        if self.shows == ShownTable::Links {
            self.message = format!("select a component to {verb} (l shows them)");
            return;
        }
        let Some(name) = self.selected().and(self.selected.clone()) else {
            self.message = format!("select a component to {verb}, with the arrows");
            return;
        };
        let question = format!("{verb} {name}? y: yes, any other key: no");
        self.mode = KeyMode::Confirm { question, request: request(name) };
    }

    /// Moves the selection, or the first link that is shown.
    fn move_by(&mut self, count: isize) {
        if self.shows == ShownTable::Links {
            let last = self.links().len().saturating_sub(1);
            self.first_link = self.first_link.saturating_add_signed(count).min(last);
            return;
        }
        let rows = self.rows();
        if rows.is_empty() {
            return;
        }
        let last = rows.len() - 1;
        let next = match self.selected() {
            Some(at) => at.saturating_add_signed(count).min(last),
            None if count < 0 => last,
            None => 0_usize.saturating_add_signed(count - 1).min(last),
        };
        self.selected = Some(rows[next].name.clone());
    }

    /// Returns the links that the filter leaves.
    pub fn links(&self) -> Vec<&armor_inspect::ObservedLink> {
        let has = |name: &str| name.contains(&self.filter);
        self.snapshot.links.iter().filter(|link| has(&link.from) || has(&link.to)).collect()
    }

    /// Returns the last line: a question, the filter, a result, or the keys.
    pub fn last_line(&self) -> String {
        match &self.mode {
            KeyMode::Confirm { question, .. } => return question.clone(),
            KeyMode::Filter => {
                return format!("filter: {}_   Enter keeps it, Esc clears it", self.filter);
            }
            KeyMode::Commands => {}
        }
        if !self.message.is_empty() {
            return self.message.clone();
        }
        let filter = match self.filter.as_str() {
            "" => "/ filter".into(),
            filter => format!("/ filter: {filter}"),
        };
        format!(
            "q quit  s sort: {}  d direction  {filter}  l links  r restart  k stop",
            self.sort.heading()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::snapshot::tests::snapshot;
    use super::*;

    fn view() -> TopView {
        let mut view = TopView::default();
        view.set_snapshot(snapshot());
        view
    }

    fn press(view: &mut TopView, code: KeyCode) -> KeyResult {
        view.handle_key(KeyEvent::new(code, KeyModifiers::NONE))
    }

    fn names(view: &TopView) -> Vec<&str> {
        view.rows().iter().map(|row| row.name.as_str()).collect()
    }

    #[test]
    fn the_selection_stays_with_its_component_when_the_order_changes() {
        let mut view = view();
        assert_eq!(names(&view), ["watcher", "arm", "north"]);
        press(&mut view, KeyCode::Down);
        press(&mut view, KeyCode::Down);
        assert_eq!(view.selected(), Some(1));
        press(&mut view, KeyCode::Char('d'));
        assert_eq!((names(&view), view.selected()), (vec!["arm", "north", "watcher"], Some(0)));
        press(&mut view, KeyCode::End);
        assert_eq!(view.selected(), Some(2));
        press(&mut view, KeyCode::Home);
        press(&mut view, KeyCode::Up);
        assert_eq!(view.selected(), Some(0));
    }

    #[test]
    fn a_component_is_stopped_only_after_a_yes() {
        let mut view = view();
        press(&mut view, KeyCode::Char('k'));
        assert!(view.last_line().contains("with the arrows"), "{}", view.last_line());
        press(&mut view, KeyCode::Down);
        press(&mut view, KeyCode::Char('k'));
        assert_eq!(view.last_line(), "stop watcher? y: yes, any other key: no");
        assert_eq!(press(&mut view, KeyCode::Char('n')), KeyResult::Shown);
        assert_eq!(view.last_line(), "nothing was done");
        press(&mut view, KeyCode::Char('r'));
        let request = RunRequest::Restart { component: "watcher".into() };
        assert_eq!(press(&mut view, KeyCode::Char('y')), KeyResult::Send(request));
        assert_eq!(view.mode, KeyMode::Commands);
    }

    #[test]
    fn a_filter_leaves_some_components_and_q_is_a_letter_in_it() {
        let mut view = view();
        press(&mut view, KeyCode::Char('/'));
        for letter in "orq".chars() {
            assert_eq!(press(&mut view, KeyCode::Char(letter)), KeyResult::Shown);
        }
        assert!(names(&view).is_empty() && view.last_line().starts_with("filter: orq_"));
        press(&mut view, KeyCode::Backspace);
        press(&mut view, KeyCode::Enter);
        assert_eq!(names(&view), ["north"]);
        assert!(view.last_line().contains("/ filter: or"));
        // What is filtered out is not selected, so it cannot be stopped unseen.
        press(&mut view, KeyCode::Esc);
        press(&mut view, KeyCode::Down);
        press(&mut view, KeyCode::Char('/'));
        press(&mut view, KeyCode::Char('z'));
        press(&mut view, KeyCode::Enter);
        press(&mut view, KeyCode::Char('k'));
        assert_eq!(view.mode, KeyMode::Commands);
    }

    #[test]
    fn q_and_ctrl_c_end_it() {
        let mut view = view();
        let quit = KeyResult::Quit { is_interrupted: false };
        assert_eq!(press(&mut view, KeyCode::Char('q')), quit);
        press(&mut view, KeyCode::Char('/'));
        let key = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(view.handle_key(key), KeyResult::Quit { is_interrupted: true });
    }
}
