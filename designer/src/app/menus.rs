//! The menu bar, the tool bar and the bar at the bottom, all made from the table of commands.

use armor_picture::icons::Icon;
use armor_picture::theme::{self, ThemeColours};
use eframe::egui::{self, Button, Key, Popup};

use crate::app::Designer;
use crate::commands::{COMMANDS, Command, Menu, about};
use crate::view::View;

/// The commands that are one click away, the most important ones first.
const TOOLS: &[&[Command]] = &[
    &[Command::Run, Command::Stop],
    &[Command::Save, Command::Undo, Command::Redo],
    &[Command::Add, Command::Arrange, Command::Group, Command::Note],
    &[Command::ZoomFit, Command::Find],
];

/// Approximate width of the widest tool, and of one that is only its icon.
const A_TOOL: f32 = 90.0;
const AN_ICON: f32 = 30.0;
/// Room for the tabs with their names, and for all tools as icons.
const NAMED_TABS: f32 = 640.0;

impl Designer {
    /// Runs the commands whose keys are pressed, unless a text is being written.
    pub(super) fn handle_shortcuts(&mut self, ctx: &egui::Context) {
        let is_asked = self.dialog.is_some() || self.find.is_some() || self.commands.is_some();
        if is_asked || self.pane().0.is_asking() || self.shortcuts || self.keeper.is_asking() {
            return;
        }
        self.menu_keys.read(ctx);
        if self.first_page && !Popup::is_any_open(ctx) && ctx.input(|i| i.key_pressed(Key::Escape))
        {
            self.first_page = false;
        }
        let writes = self.writes;
        for about in COMMANDS {
            let Some(keys) = about.keys else { continue };
            if keys.logical_key == Key::Enter && ctx.memory(|m| m.focused()).is_some() {
                // Enter presses the button that has the focus; on a drawing the pane asks itself.
                continue;
            }
            let is_written = keys.modifiers.is_none()
                && !matches!(
                    keys.logical_key,
                    Key::F1 | Key::F2 | Key::F4 | Key::F6 | Key::F7 | Key::F8
                );
            let edits = is_written || is_text_editing(about.command);
            if (writes && edits) || Popup::is_any_open(ctx) && is_written {
                continue;
            }
            if ctx.input_mut(|i| consume_shortcut(i, keys)) {
                self.workspace.order_command(about.command);
            }
        }
        let also = egui::KeyboardShortcut::new(egui::Modifiers::COMMAND, Key::Y);
        if !writes && ctx.input_mut(|i| consume_shortcut(i, also)) {
            self.workspace.order_command(Command::Redo);
        }
        self.clipboard_keys(ctx, writes);
    }

    /// Copying and pasting come as events of their own.
    fn clipboard_keys(&mut self, ctx: &egui::Context, writes: bool) {
        if writes {
            return;
        }
        let mut pasted = None;
        ctx.input(|i| {
            for event in &i.events {
                match event {
                    egui::Event::Copy => self.workspace.commands.push(Command::Copy),
                    egui::Event::Cut => self.workspace.commands.push(Command::Cut),
                    egui::Event::Paste(text) => pasted = Some(text.clone()),
                    _ => {}
                }
            }
        });
        if let Some(text) = pasted {
            let (pane, workspace) = self.pane();
            pane.paste_text(&text, workspace);
        }
    }

    pub(super) fn menu_bar(&mut self, ui: &mut egui::Ui) {
        egui::Panel::top("menus").show(ui, |ui| {
            egui::MenuBar::new().ui(ui, |ui| {
                let mut buttons = Vec::new();
                for menu in Menu::ALL {
                    let shown = ui.menu_button(menu.name(), |ui| {
                        ui.set_min_width(210.0);
                        for entry in COMMANDS.iter().filter(|entry| entry.menu == menu) {
                            self.menu_entry(ui, entry.command);
                            match entry.command {
                                Command::Open => self.recent_menu(ui),
                                Command::Help => self.documents_menu(ui),
                                _ => {}
                            }
                        }
                    });
                    buttons.push(shown.response);
                }
                self.menu_keys.open(ui.ctx(), &buttons);
                ui.separator();
                // Narrower still, the tabs have only theirs, so that the first tools have room.
                let has_names = ui.available_width() > NAMED_TABS;
                self.view_tabs(ui, has_names);
                // A window in which not all have room has their icons.
                let count = TOOLS.iter().map(|group| group.len()).sum::<usize>();
                let is_wide = ui.available_width() > count as f32 * A_TOOL;
                let width = if is_wide { A_TOOL } else { AN_ICON };
                for group in TOOLS {
                    // All of them are in the menus; a very narrow one has the first of them.
                    if ui.available_width() > width {
                        ui.separator();
                    }
                    for command in *group {
                        if ui.available_width() > width {
                            self.show_tool_button(ui, *command, is_wide);
                        }
                    }
                }
            });
        });
    }

    fn menu_entry(&mut self, ui: &mut egui::Ui, command: Command) {
        let entry = about(command);
        let may = self.may(command);
        let mut text = entry.name.to_owned();
        match command {
            Command::Undo => text = with(text, self.workspace.project.undoable()),
            Command::Redo => text = with(text, self.workspace.project.redoable()),
            _ => {}
        }
        let mut button = Button::new(text);
        if let Some(keys) = entry.keys {
            button = button.shortcut_text(ui.ctx().format_shortcut(&keys));
        }
        if let Some(is_on) = self.is_on(command) {
            button = button.selected(is_on);
        }
        if ui.add_enabled(may, button).on_hover_text(entry.doc).clicked() {
            self.workspace.order_command(command);
            ui.close();
        }
    }

    fn show_tool_button(&mut self, ui: &mut egui::Ui, command: Command, is_wide: bool) {
        let entry = about(command);
        let keys = entry.keys.map(|keys| ui.ctx().format_shortcut(&keys)).unwrap_or_default();
        let may = self.may(command);
        let name = entry.name.trim_end_matches('…');
        let button = match icon_of(command) {
            Some(icon) if command == Command::Run && may => {
                let colours = ThemeColours::of(ui.visuals());
                let text = egui::RichText::new(name).strong().color(colours.on_accent);
                let icon = icon.to_coloured_atom(colours.on_accent);
                Button::new((icon, text)).fill(colours.accent)
            }
            Some(icon) if is_wide => Button::new((icon.to_atom(), name)).frame_when_inactive(false),
            Some(icon) => Button::new(icon.to_atom()).frame_when_inactive(false),
            None => Button::new(name).frame_when_inactive(false),
        };
        let button = ui.add_enabled(may, button.gap(theme::NEAR));
        let button = button.on_hover_text(format!("{} ({keys})", entry.doc));
        // The menu has an entry of the same name.
        let button = button.accessible_name(format!("tool: {}", entry.name));
        if button.clicked() {
            self.workspace.order_command(command);
        }
    }

    fn view_tabs(&mut self, ui: &mut egui::Ui, has_names: bool) {
        let views: Vec<View> = self.panes.iter().map(|(view, _)| *view).collect();
        for view in views {
            let command = match view {
                View::System => Command::ShowSystem,
                View::Mission => Command::ShowMission,
                View::Map => Command::ShowMap,
                View::Live => Command::ShowLive,
            };
            let entry = about(command);
            let icon = icon_of(command).map(Icon::to_atom);
            let tab = match icon {
                Some(icon) if !has_names => Button::selectable(self.view == view, icon),
                Some(icon) => Button::selectable(self.view == view, (icon, entry.name)),
                None => Button::selectable(self.view == view, entry.name),
            };
            let tab = ui
                .add(tab.gap(theme::NEAR))
                .on_hover_text(format!("{}: {}", entry.name, entry.doc));
            if tab.accessible_name(format!("view: {}", entry.name)).clicked() {
                self.workspace.order_command(command);
            }
        }
    }

    /// Whether a command that is on or off is on.
    fn is_on(&self, command: Command) -> Option<bool> {
        let settings = &self.workspace.settings;
        Some(match command {
            Command::TogglePalette => self.is_palette_open(),
            Command::ToggleProperties => settings.properties,
            Command::ToggleProblems => settings.problems,
            Command::ToggleMinimap => settings.minimap,
            Command::ToggleSnap => settings.snap,
            Command::ShowSystem => self.view == View::System,
            Command::ShowMission => self.view == View::Mission,
            Command::ShowMap => self.view == View::Map,
            Command::ShowLive => self.view == View::Live,
            _ => return None,
        })
    }

    pub(super) fn status_bar(&mut self, ui: &mut egui::Ui) {
        egui::Panel::bottom("status").show(ui, |ui| {
            ui.horizontal(|ui| {
                let name =
                    crate::text::paintable(ui.ctx(), &self.workspace.project.name()).into_owned();
                let star = if self.is_unsaved() { " (not saved)" } else { "" };
                let draft = if self.workspace.project.is_draft() { " (draft)" } else { "" };
                ui.label(format!("{name}{draft}{star}"));
                // Of an empty file, a list of what it lacks helps no one.
                if !self.first_page || self.has_drawing() {
                    ui.separator();
                    self.show_verdict(ui);
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let kinds = self.workspace.project.kinds();
                    match kinds.manifests() {
                        Some(manifests) => ui.weak(format!("{} component kinds", manifests.len())),
                        None => ui.weak("component kinds not loaded yet"),
                    };
                });
            });
        });
    }

    /// Shows the number of problems; a click shows the list.
    fn show_verdict(&mut self, ui: &mut egui::Ui) {
        use armor_robotfile::Severity;
        let checked = self.workspace.project.checked();
        let counted = |severity| checked.findings.counted(severity);
        let (text, colour) = match (counted(Severity::Error), counted(Severity::Warning)) {
            (None, None) => ("No problems".to_owned(), ui.visuals().weak_text_color()),
            (None, Some(warnings)) => (warnings, ui.visuals().warn_fg_color),
            (Some(errors), None) => (errors, ui.visuals().error_fg_color),
            (Some(errors), Some(warnings)) => {
                (format!("{errors}, {warnings}"), ui.visuals().error_fg_color)
            }
        };
        let button = Button::new(egui::RichText::new(text).color(colour)).frame(false);
        let doc = about(Command::ToggleProblems).doc;
        if ui.add(button).on_hover_text(doc).clicked() {
            self.workspace.order_command(Command::ToggleProblems);
        }
        if self.workspace.project.is_saving() {
            ui.weak("checking, then saving");
        } else if self.workspace.project.is_checking() {
            ui.weak("checking");
        }
    }
}

/// Returns the sign of a command that is one click away.
fn icon_of(command: Command) -> Option<Icon> {
    Some(match command {
        Command::Save => Icon::Save,
        Command::Undo => Icon::Undo,
        Command::Redo => Icon::Redo,
        Command::Add => Icon::Add,
        Command::Arrange => Icon::Arrange,
        Command::Group => Icon::Group,
        Command::Note => Icon::Note,
        Command::ZoomFit => Icon::Fit,
        Command::Find => Icon::Find,
        Command::Run => Icon::Run,
        Command::Stop => Icon::Stop,
        Command::ShowSystem => Icon::System,
        Command::ShowMission => Icon::Mission,
        Command::ShowMap => Icon::Map,
        Command::ShowLive => Icon::Live,
        _ => return None,
    })
}

/// Removes a press of exactly these keys from the input. Some keyboards need shift for a plus.
fn consume_shortcut(input: &mut egui::InputState, keys: egui::KeyboardShortcut) -> bool {
    let is_it = |event: &egui::Event| {
        let egui::Event::Key { key, pressed: true, modifiers, .. } = event else { return false };
        let fits = match keys.logical_key {
            Key::Plus => modifiers.matches_logically(keys.modifiers),
            _ => modifiers.matches_exact(keys.modifiers),
        };
        *key == keys.logical_key && fits
    };
    let found = input.events.iter().position(is_it);
    found.inspect(|at| drop(input.events.remove(*at))).is_some()
}

/// Returns whether a text field uses these keys itself.
fn is_text_editing(command: Command) -> bool {
    matches!(
        command,
        Command::Undo
            | Command::Redo
            | Command::Cut
            | Command::Copy
            | Command::Paste
            | Command::SelectAll
            | Command::Delete
            | Command::AlignLeft
            | Command::AlignRight
            | Command::AlignTop
            | Command::AlignBottom
    )
}

fn with(name: String, what: Option<&str>) -> String {
    match what {
        Some(what) => format!("{name}: {}", crate::text::short(what, 40)),
        None => name,
    }
}
