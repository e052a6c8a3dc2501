//! What the view of the mission keeps from frame to frame.

use std::collections::BTreeSet;
use std::sync::Arc;

use armor_robotfile::mission::{ArcKind, Mission};

use super::choices::MissionPicker;
use super::simulator::MissionSimulator;
use crate::canvas::Diagram;
use crate::diagram_pane::DiagramPane;
use crate::item::Item;
use crate::layout::{self, Layout};
use crate::mission::changes::Change;
use crate::mission::drawing::{NetRules, Scene};
use crate::mission::form::{Form, Made};
use crate::mission::marks::Marks;
use crate::project::Project;
use crate::view::View;
use crate::workspace::Workspace;
use armor_picture::theme::ThemeColours;

/// The view of the mission.
pub struct MissionView {
    pub(super) pane: DiagramPane,
    pub(super) diagram: Diagram<Item>,
    /// Nodes without a position in the file.
    pub(super) unplaced: Vec<Item>,
    drawn: Option<DrawnState>,
    /// What was found.
    pub(super) marks: Marks,
    pub(super) form: Form,
    pub(super) simulator: Option<MissionSimulator>,
    /// What an arc from a place to a transition does when it is drawn.
    pub(super) kind: ArcKind,
    pub(super) picker: Option<MissionPicker>,
    /// The steps of routes that are open; of a large net the others are one block each.
    pub(super) opened: BTreeSet<Item>,
    /// The time of the last frame, in seconds of the window.
    pub(super) canvas_time: f64,
}

/// What a drawing was made of.
#[derive(Clone, Debug, PartialEq)]
struct DrawnState {
    revision: u64,
    checked: (u64, bool),
    /// Counts what happens in the simulation.
    moment: Option<u64>,
    is_dark: bool,
    opened: BTreeSet<Item>,
}

impl MissionView {
    /// A view that shows the whole mission at first.
    pub fn new() -> Self {
        Self {
            pane: DiagramPane::new("drawing of the mission", View::Mission),
            diagram: Diagram::default(),
            unplaced: Vec::new(),
            drawn: None,
            marks: Marks::default(),
            form: Form::default(),
            simulator: None,
            kind: ArcKind::Take,
            picker: None,
            opened: BTreeSet::new(),
            canvas_time: 0.0,
        }
    }

    /// Draws the mission again if it, its status, or its tokens have changed.
    pub(super) fn update(&mut self, workspace: &Workspace, is_dark: bool) {
        let revision = workspace.project.revision();
        if let Some(simulator) = &mut self.simulator {
            simulator.keep_up(workspace);
        }
        let checked = workspace.project.checked();
        let now = DrawnState {
            revision,
            checked: (checked.revision, checked.is_complete),
            moment: self.simulator.as_ref().map(MissionSimulator::moment),
            is_dark,
            opened: self.opened.clone(),
        };
        let is_same_file = self.drawn.as_ref().is_some_and(|drawn| drawn.revision == revision);
        // New findings do not end a drag.
        if self.drawn.as_ref() == Some(&now) || (is_same_file && self.pane.canvas.is_busy()) {
            return;
        }
        let is_known = self
            .drawn
            .as_ref()
            .is_some_and(|drawn| (drawn.revision, drawn.checked) == (now.revision, now.checked));
        if !is_known {
            self.marks = marks_of(workspace);
        }
        self.draw(workspace, is_dark);
        self.pane.set_drawing(&self.diagram);
        self.drawn = Some(now);
    }

    fn draw(&mut self, workspace: &Workspace, is_dark: bool) {
        let Some(mission) = mission_of(workspace) else {
            self.diagram = Diagram::default();
            return;
        };
        let colours = ThemeColours::of_theme(!is_dark);
        let layout = layout_of(&workspace.project);
        let scene = Scene {
            mission,
            marks: &self.marks,
            layout: &layout,
            play: self.simulator.as_ref().map(MissionSimulator::play),
            in_flight: self.simulator.as_ref().map_or(&[], MissionSimulator::in_flight),
            colours,
            opened: Some(&self.opened),
        };
        (self.diagram, self.unplaced) = scene.draw();
    }

    pub(super) fn rules<'a>(
        &self,
        mission: &'a Mission,
        diagram: &'a Diagram<Item>,
    ) -> NetRules<'a> {
        NetRules { mission, diagram, kind: self.kind }
    }

    pub(super) fn was_dark(&self) -> bool {
        self.drawn.as_ref().is_none_or(|drawn| drawn.is_dark)
    }

    /// Makes changes, each a step of the history, and keeps what was renamed selected. Returns
    /// whether all were made; why one is not is a message.
    pub(super) fn make(&mut self, changes: Vec<Made>, workspace: &mut Workspace) -> bool {
        let mut are_made = true;
        for change in changes {
            let change = match change {
                Ok(change) => change,
                Err(why) => {
                    workspace.messages.warn(why);
                    are_made = false;
                    continue;
                }
            };
            let name = mission_of(workspace).and_then(|mission| mission.name.as_ref());
            let renamed = change.name_change(name.map(|name| name.value.as_str()));
            let is_made = workspace.edit(change.what(), |documents| change.apply(documents));
            are_made &= is_made;
            if is_made && let Some(change) = renamed {
                workspace.ask_elsewhere(change);
            }
            match &change {
                Change::Rename(Item::Place(_), name) if is_made => {
                    self.pane.select_when_drawn([Item::place(name)]);
                }
                Change::Rename(Item::Transition(_), name) if is_made => {
                    self.pane.select_when_drawn([Item::transition(name)]);
                }
                Change::ArcKind(Item::Arc { transition, place, .. }, kind) if is_made => {
                    self.pane.select_when_drawn([Item::arc(transition, place, *kind)]);
                }
                _ => {}
            }
        }
        are_made
    }
}

impl Default for MissionView {
    fn default() -> Self {
        Self::new()
    }
}

pub(super) fn configuration_of(
    workspace: &Workspace,
) -> Option<(&armor_robotfile::Configuration, &Mission)> {
    let configuration = workspace.project.configuration()?;
    Some((configuration, configuration.mission.as_ref()?))
}

pub(super) fn mission_of(workspace: &Workspace) -> Option<&Mission> {
    configuration_of(workspace).map(|(_, mission)| mission)
}

/// The net of files, without findings and without a simulation.
pub fn net(project: &Project, colours: &ThemeColours) -> Diagram<Item> {
    let mission = project.configuration().and_then(|it| it.mission.as_ref());
    let Some(mission) = mission else { return Diagram::default() };
    let (marks, layout) = (Marks::default(), layout_of(project));
    let (marks, layout) = (&marks, &layout);
    let scene = Scene { mission, marks, layout, play: None, in_flight: &[], colours, opened: None };
    scene.draw().0
}

fn layout_of(project: &Project) -> Layout {
    let document = project.document_with(armor_robotfile::Item::Mission);
    document.map(|document| layout::read(document, View::Mission)).unwrap_or_default()
}

/// What was found of the current files; of older ones the places would be wrong.
fn marks_of(workspace: &Workspace) -> Marks {
    let checked = workspace.project.checked();
    if checked.revision != workspace.project.revision() {
        return Marks::default();
    }
    Marks::of(Arc::clone(&checked.findings), &|at| workspace.project.item_at(at))
}
