//! The simulation's panel beneath the drawing: what continues, what can be done, what happened.

use std::time::Duration;

use armor_petri::TransitionId;
use armor_proof::time_in_words as time;
use armor_robotfile::FiringTrace;
use eframe::egui::{self, Button, Panel, RichText, ScrollArea};

use super::simulator::MissionSimulator;
use super::state::MissionView;
use crate::commands::{Command, about};
use crate::mission::play::world::World;
use crate::mission::play::{Happened, Play, Standing, act_words};
use crate::panels::fields::{is_entered, show_edit};
use crate::workspace::Workspace;
use armor_picture::theme::ThemeColours;

/// Most steps of the history that are shown.
const MAX_STORY: usize = 200;

impl MissionView {
    pub(super) fn toggle_simulation(&mut self, workspace: &mut Workspace) {
        if self.simulator.take().is_some() {
            return;
        }
        self.pane.canvas.cancel();
        match MissionSimulator::of(workspace) {
            Ok(simulator) => self.simulator = Some(simulator),
            Err(why) => workspace.messages.warn(why),
        }
    }

    /// Does something with the simulation, if there is one.
    pub(super) fn simulate(
        &mut self,
        ctx: &egui::Context,
        act: impl FnOnce(&mut MissionSimulator, f64),
    ) {
        let now = ctx.input(|i| i.time);
        if let Some(simulator) = &mut self.simulator {
            act(simulator, now);
        }
        ctx.request_repaint();
    }

    /// Plays the firings of a finding from the start.
    pub(super) fn play_trace(&mut self, trace: &FiringTrace, workspace: &mut Workspace) {
        if self.simulator.is_none() {
            self.toggle_simulation(workspace);
        }
        if let Some(simulator) = &mut self.simulator
            && let Err(why) = simulator.follow(trace)
        {
            workspace.messages.warn(why);
        }
    }

    /// Fires a transition by hand.
    pub(super) fn fire(&mut self, name: &str, workspace: &mut Workspace) {
        let Some(simulator) = &mut self.simulator else { return };
        let Some(id) = simulator.play().stage().transition(name) else { return };
        self.fire_by_id(id, workspace);
    }

    fn fire_by_id(&mut self, id: TransitionId, workspace: &mut Workspace) {
        let now = self.canvas_time;
        if let Some(simulator) = &mut self.simulator
            && let Err(why) = simulator.fire(id, now)
        {
            workspace.messages.warn(why.to_string());
        }
    }

    pub(super) fn simulation_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.canvas_time = ui.input(|i| i.time);
        if self.simulator.is_none() {
            return;
        }
        let panel = Panel::bottom("simulation").resizable(true).default_size(190.0).min_size(110.0);
        panel.show(ui, |ui| {
            self.transport(ui, workspace);
            ui.separator();
            let height = ui.available_height();
            ui.horizontal_top(|ui| {
                let width = ui.available_width() / 3.0 - 10.0;
                for part in
                    [Self::show_course_or_choices, Self::show_environment, Self::show_history]
                {
                    ui.allocate_ui(egui::vec2(width, height), |ui| {
                        ui.set_width(width);
                        ui.vertical(|ui| part(self, ui, workspace));
                    });
                    ui.separator();
                }
            });
        });
    }

    /// Shows the buttons and the state of the simulation.
    fn transport(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let Some(simulator) = &mut self.simulator else { return };
        let colours = ThemeColours::of(ui.visuals());
        ui.horizontal_wrapped(|ui| {
            ui.strong("Simulation");
            let run = if simulator.is_running { "Pause" } else { "Play" };
            let buttons = [
                (Command::SimulationRestart, "Restart", true),
                (Command::SimulationBack, "Back", simulator.play().can_go_back()),
                (Command::SimulationStep, "Step", true),
                (Command::SimulationRun, run, true),
            ];
            for (command, name, may) in buttons {
                let entry = about(command);
                let keys = entry.keys.map(|keys| ui.ctx().format_shortcut(&keys));
                let doc = format!("{} {}", entry.doc, keys.unwrap_or_default());
                if ui.add_enabled(may, Button::new(name)).on_hover_text(doc).clicked() {
                    workspace.order_command(command);
                }
            }
            if ui.button("End").on_hover_text("Ends the simulation").clicked() {
                workspace.order_command(Command::Simulate);
            }
            let speed = egui::Slider::new(&mut simulator.speed, 0.2..=10.0).logarithmic(true);
            ui.add(speed.text("firings/s").show_value(false)).accessible_name("speed");
            let now = ui.input(|i| i.time);
            for (name, wait) in [("+1 s", 1), ("+10 s", 10), ("+1 min", 60)] {
                let button = ui.button(name).on_hover_text("Advances mission time");
                if button.clicked() {
                    simulator.wait(Duration::from_secs(wait), now);
                }
            }
            ui.label(RichText::new(time(simulator.play().time())).strong())
                .on_hover_text("The mission's time");
            show_status(ui, simulator, colours);
        });
    }

    /// Shows the trace that is followed, or what can happen now.
    fn show_course_or_choices(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let Some(simulator) = &mut self.simulator else { return };
        if simulator.play().course().is_some() {
            return show_course(ui, simulator);
        }
        ui.strong("Possible now");
        let chosen = ScrollArea::vertical()
            .id_salt("choices")
            .auto_shrink(false)
            .show(ui, |ui| show_choices(ui, simulator.play()))
            .inner;
        if let Some(id) = chosen {
            self.fire_by_id(id, workspace);
        }
    }

    /// Shows the values that guards read, and what may happen at random.
    fn show_environment(&mut self, ui: &mut egui::Ui, _: &mut Workspace) {
        let Some(simulator) = &mut self.simulator else { return };
        ui.strong("Environment");
        ScrollArea::vertical().id_salt("senses").auto_shrink(false).show(ui, |ui| {
            show_values(ui, simulator);
            ui.weak("While it runs, also simulate:");
            let chance = simulator.chance();
            ui.checkbox(&mut chance.people, "operators")
                .on_hover_text("Operators fire their transitions and answer questions at random.");
            ui.checkbox(&mut chance.faults, "failures")
                .on_hover_text("Components fail, or fail to stop or start, at random.");
            ui.horizontal(|ui| {
                let drag = egui::DragValue::new(&mut simulator.seed);
                ui.label("seed").on_hover_text("The same seed gives the same run.");
                if ui.add(drag).accessible_name("seed").changed() {
                    simulator.restart();
                }
            });
        });
    }

    fn show_history(&mut self, ui: &mut egui::Ui, _: &mut Workspace) {
        let Some(simulator) = &mut self.simulator else { return };
        ui.strong("History");
        let play = simulator.play();
        ScrollArea::vertical().id_salt("story").auto_shrink(false).show(ui, |ui| {
            for (at, happened) in play.story().take(MAX_STORY) {
                let what = match happened {
                    Happened::Fired { transition, late } if late.is_zero() => {
                        act_words(play.stage(), *transition)
                    }
                    Happened::Fired { transition, late } => {
                        let name = act_words(play.stage(), *transition);
                        format!("{name}, {} late", time(*late))
                    }
                    Happened::Sensed(what) => what.clone(),
                    Happened::Waited(waited) => format!("{} passed", time(*waited)),
                };
                ui.label(RichText::new(format!("{}: {what}", time(at))).small());
            }
        });
    }
}

/// Shows the state of the mission, in words and a colour.
fn show_status(ui: &mut egui::Ui, simulator: &MissionSimulator, colours: &ThemeColours) {
    let play = simulator.play();
    let stage = play.stage();
    let marked = |place: Option<armor_petri::PlaceId>| {
        place.is_some_and(|place| play.marking()[place.index()] > 0)
    };
    for (one, other) in stage.breaches(play.marking()) {
        let text = format!("x {one} and {other} would both be active, but exclude each other");
        ui.label(RichText::new(text).color(colours.error));
    }
    if marked(stage.goal) {
        ui.label(RichText::new("= goal reached").color(colours.good));
    } else if marked(stage.safe) {
        ui.label(RichText::new("! in the safe place").color(colours.warning));
    } else if play.stands_still() {
        ui.label(RichText::new("x deadlock: nothing can fire").color(colours.error));
    }
    ui.weak(describe_active(&stage.active(play.marking())));
    if !simulator.status.is_empty() {
        ui.label(&simulator.status);
    }
}

/// The components that the mission has activated. Those that no mission controls run all the time.
fn describe_active(active: &[&str]) -> String {
    match active {
        [] => "the marked places activate no component".to_owned(),
        active => format!("activated by the mission: {}", active.join(", ")),
    }
}

/// Shows the firings that are followed, with their times.
fn show_course(ui: &mut egui::Ui, simulator: &mut MissionSimulator) {
    let mut leaves = false;
    if let Some(course) = simulator.play().course() {
        ui.horizontal(|ui| {
            ui.strong("Run being shown");
            leaves = ui.button("leave it").on_hover_text("Continues by hand from here").clicked();
        });
        if !course.is_timed {
            ui.weak("this order respects tokens; times were not considered");
        }
        ScrollArea::vertical().id_salt("course").auto_shrink(false).show(ui, |ui| {
            for (number, leg) in course.legs().iter().enumerate() {
                if number == course.circle() {
                    ui.weak("repeats:");
                }
                let at = leg.at.map_or_else(String::new, |at| format!(" at {}", time(at)));
                let name = act_words(simulator.play().stage(), leg.transition);
                let text = RichText::new(format!("{}. {name}{at}", number + 1));
                let line = match () {
                    () if number < course.done() => ui.weak(text),
                    () if number == course.done() => ui.strong(format!("> {}", text.text())),
                    () => ui.label(text),
                };
                if number == course.done() && course.done() > 3 {
                    line.scroll_to_me(Some(egui::Align::Center));
                }
            }
        });
    }
    if leaves {
        simulator.leave_course();
    }
}

/// A button for each transition that has its tokens; returns the one that was clicked.
fn show_choices(ui: &mut egui::Ui, play: &Play) -> Option<TransitionId> {
    let mut clicked = None;
    let mut is_empty = true;
    for id in play.stage().net.transition_ids() {
        let standing = play.standing(id);
        let how = match standing {
            Standing::Disabled => continue,
            Standing::Ready => "now".to_owned(),
            Standing::Waits(at) => format!("at {}", time(at)),
            Standing::Expects => "when what it waits for arrives".to_owned(),
        };
        is_empty = false;
        ui.horizontal(|ui| {
            let name = act_words(play.stage(), id);
            let button = Button::new(&name);
            if ui.add(button).accessible_name(format!("Fire {name}")).clicked() {
                clicked = Some(id);
            }
            ui.weak(how);
            if let Some(progress) = play.progress(id) {
                let bar = egui::ProgressBar::new(progress).desired_width(60.0).desired_height(6.0);
                ui.add(bar).on_hover_text("Elapsed share of its time");
            }
        });
    }
    if is_empty {
        ui.weak(if play.is_over() { "The mission is over." } else { "Nothing can fire." });
    }
    clicked
}

/// A field for each value that guards look at.
fn show_values(ui: &mut egui::Ui, simulator: &mut MissionSimulator) {
    let senses = World::senses(simulator.play().stage());
    for sense in senses {
        let mut set = None;
        ui.horizontal(|ui| {
            let label = ui.label(&sense.name);
            label.on_hover_text(format!("read by {}", sense.transitions.join(", ")));
            let text = simulator.typed.entry(sense.name.clone()).or_default();
            let field = egui::TextEdit::singleline(text).hint_text("unknown").desired_width(90.0);
            let field = show_edit(ui, &sense.name, field);
            let field = field.accessible_name(format!("value of {}", sense.name));
            if field.lost_focus() {
                set = Some(text.clone());
                is_entered(ui, &field);
            }
        });
        if let Some(text) = set {
            simulator.set_value(&sense.name, &text);
        }
    }
}
