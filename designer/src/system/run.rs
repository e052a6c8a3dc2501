//! The commands and gestures of the view, as edits of the files.

use armor_robotfile::TypedManifests;
use eframe::egui::{self, Pos2, Rect, Vec2, vec2};

use super::choices::SystemPicker;
use super::properties::field::Focus;
use super::robot::{self, ROBOT};
use super::state::SystemView;
use super::{draw, edits, fragment};
use crate::canvas::PortAt;
use crate::commands::Command;
use crate::item::Item;
use crate::project::elsewhere::NameChange;
use crate::workspace::Workspace;

/// The space that a new block needs.
const NODE_SPACE: Vec2 = vec2(190.0, 200.0);
/// Between the blocks of one robot and those of the next.
const ROBOT_GAP: f32 = 60.0;

impl SystemView {
    pub(super) fn can_run(&self, command: Command, workspace: &Workspace) -> Option<bool> {
        match command {
            Command::Rename => Some(matches!(self.pane.only(), Some(Item::Component(_)))),
            Command::Link => {
                Some(self.pane.only().is_some_and(|it| self.drawing.diagram.node(it).is_some()))
            }
            Command::Fold => Some(self.selected_group().is_some()),
            _ => self.pane.can_run(command, workspace, true),
        }
    }

    pub(super) fn run_command(
        &mut self,
        command: Command,
        ctx: &egui::Context,
        workspace: &mut Workspace,
    ) {
        use Command as C;
        match command {
            C::Cut => {
                if self.copy(ctx, workspace) {
                    self.delete(workspace);
                }
            }
            C::Copy => {
                self.copy(ctx, workspace);
            }
            C::Duplicate => self.duplicate(workspace),
            C::Delete => self.delete(workspace),
            C::Rename | C::Properties => {
                workspace.settings.properties = true;
                let is_name = command == C::Rename;
                self.wants_focus = if is_name { Focus::Name } else { Focus::Value };
            }
            C::Add => {
                let middle = self.pane.canvas.spot() + NODE_SPACE / 2.0;
                let at = self.drawing.diagram.free_spot(middle, NODE_SPACE) - NODE_SPACE / 2.0;
                self.picker = Some(SystemPicker::to_add(workspace, at));
            }
            C::Link => self.link_by_keyboard(),
            C::Group | C::Note => {
                if self.pane.decorate(command == C::Note, &self.drawing.diagram, workspace) {
                    self.wants_focus = Focus::Name;
                }
            }
            C::Fold => self.toggle_fold(workspace),
            C::Arrange => self.arrange(workspace),
            _ => self.pane.run(command, ctx, &self.drawing.diagram, workspace),
        }
    }

    /// Adds a component of a kind, and selects it.
    pub(super) fn add(
        &mut self,
        kind: &str,
        at: Pos2,
        workspace: &mut Workspace,
    ) -> Option<String> {
        if kind == ROBOT {
            self.add_robot(at, workspace);
            return None;
        }
        let mut added = None;
        let shown = self.unplaced();
        workspace.edit(format!("add {kind}"), |documents| {
            edits::place(documents, &shown)?;
            added = Some(edits::add_component(documents, kind, at)?);
            Ok(())
        });
        let name = added?;
        self.pane.select_when_drawn([Item::component(&name)]);
        workspace.settings.properties = true;
        Some(name)
    }

    /// Adds a whole robot, beneath what is drawn, and selects its simulator, which needs a world.
    fn add_robot(&mut self, at: Pos2, workspace: &mut Workspace) {
        let drawn = self.drawing.diagram.nodes.iter().map(|node| node.rect);
        let at = match drawn.reduce(Rect::union) {
            Some(drawn) => Pos2::new(drawn.left(), drawn.bottom() + ROBOT_GAP),
            None => at,
        };
        let (shown, mut added) = (self.unplaced(), Vec::new());
        workspace.edit("add a simulated robot", |documents| {
            edits::place(documents, &shown)?;
            added = robot::add_robot(documents, at)?;
            Ok(())
        });
        self.pane.select_when_drawn(added.into_iter().take(1));
        workspace.settings.properties = true;
        workspace.order_command(Command::ZoomFit);
    }

    pub(super) fn join(&mut self, from: PortAt, to: PortAt, workspace: &mut Workspace) {
        match self.drawing.joints.ends(from, to) {
            Ok((output, input)) => {
                let (output, input) = (output.data(), input.data());
                self.join_named(&output, &input, workspace);
            }
            Err(why) => workspace.messages.warn(format!("Not linked: {why}")),
        }
    }

    pub(super) fn join_named(&mut self, output: &str, input: &str, workspace: &mut Workspace) {
        let what = format!("link {output} to {input}");
        if workspace.edit(what, |documents| edits::join(documents, output, input)) {
            self.pane.select_when_drawn([Item::link(output, input)]);
        }
    }

    pub(super) fn rewire(
        &mut self,
        wire: usize,
        stays: PortAt,
        to: Option<PortAt>,
        workspace: &mut Workspace,
    ) {
        let Some(Item::Link { from, to: input }) =
            self.drawing.diagram.wires.get(wire).map(|wire| wire.item)
        else {
            return;
        };
        let Some(target) = to else {
            let item = Item::Link { from, to: input };
            workspace.edit(format!("remove {item}"), |documents| edits::remove(documents, [&item]));
            return;
        };
        match self.drawing.joints.ends_without(Some(wire), stays, target) {
            Ok((output, new)) => {
                let (output, new) = (output.data(), new.data());
                workspace.edit(format!("connect {output} to {new}"), |documents| {
                    edits::rewire(documents, (&from, &input), (&output, &new))
                });
                self.pane.select_when_drawn([Item::link(output, new)]);
            }
            Err(why) => workspace.messages.warn(format!("Not linked: {why}")),
        }
    }

    /// Where blocks are drawn that have no place in the file. The first edit that gives one of them
    /// a place gives it to all, so that the others stay where they are.
    pub(super) fn unplaced(&self) -> Vec<(Item, Pos2)> {
        let nodes = self.drawing.unplaced.iter().map(|n| &self.drawing.diagram.nodes[*n]);
        nodes.map(|node| (node.item, node.rect.min)).collect()
    }

    fn copy_text(&self, workspace: &Workspace) -> Option<String> {
        // A copy of a folded group is unfolded.
        let selected = self.selected_with_hidden();
        fragment::copied(&workspace.project, &draw(&workspace.project), &selected)
    }

    fn copy(&self, ctx: &egui::Context, workspace: &mut Workspace) -> bool {
        let text = self.copy_text(workspace);
        self.pane.copy(text, ctx, workspace)
    }

    pub(super) fn paste_text(&mut self, text: &str, workspace: &mut Workspace) {
        let corner = self.pane.paste_corner();
        self.add_fragment(text, "paste", corner, workspace);
    }

    fn duplicate(&mut self, workspace: &mut Workspace) {
        let offset = self.pane.copy_offset();
        match self.copy_text(workspace) {
            Some(text) => {
                self.add_fragment(&text, "duplicate", |whole| whole.min + offset, workspace);
            }
            None => self.pane.warn_not_duplicated(workspace),
        }
    }

    fn add_fragment(
        &mut self,
        text: &str,
        what: &str,
        at: impl FnOnce(Rect) -> Pos2,
        workspace: &mut Workspace,
    ) {
        let mut added = Vec::new();
        let shown = self.unplaced();
        workspace.edit(what, |documents| {
            edits::place(documents, &shown)?;
            added = fragment::paste(documents, text, at)?;
            Ok(())
        });
        self.pane.select_when_drawn(added);
    }

    fn delete(&mut self, workspace: &mut Workspace) {
        let items = self.selected_with_hidden();
        if workspace.edit(self.pane.removal_name(), |documents| edits::remove(documents, &items)) {
            self.pane.canvas.selection.clear();
            if let Some(change) = NameChange::removal(&items.into_iter().collect::<Vec<_>>()) {
                workspace.ask_elsewhere(change);
            }
        }
    }

    fn arrange(&mut self, workspace: &mut Workspace) {
        let diagram = &self.drawing.diagram;
        let selected = self.pane.selected().into_iter();
        let only: Vec<_> = selected.filter_map(|item| diagram.node(item)).collect();
        let places = edits::arrange_all(diagram, &only, self.pane.canvas.shape());
        self.pane.place("arrange", &places, workspace);
        if only.len() < 2 {
            self.pane.canvas.fit_everything();
        }
    }

    fn link_by_keyboard(&mut self) {
        if let Some(node) = self.pane.only().and_then(|item| self.drawing.diagram.node(item)) {
            self.picker = Some(SystemPicker::to_link(&self.drawing, node));
        }
    }
}

/// Every component and link, with its kind, ports, parameters and values.
pub(super) fn list_findable(workspace: &Workspace) -> Vec<(Item, String)> {
    let Some(configuration) = workspace.project.configuration() else { return Vec::new() };
    let manifests = workspace.project.kinds().manifests();
    let typed = manifests.map(|it| TypedManifests::of(&configuration.system, it));
    let components = configuration.system.components.iter().map(|component| {
        let mut words = component.kind.value.clone();
        for parameter in &component.parameters {
            words += &format!(" {}={}", parameter.name.value, parameter.value.value);
        }
        if let Some(kind) = typed.as_ref().and_then(|it| it.find(&component.name.value)) {
            for port in kind.inputs.iter().chain(&kind.outputs) {
                words += &format!(" {} {}", port.id, port.type_name);
            }
        }
        (Item::component(&component.name.value), words)
    });
    let links = configuration.system.links.iter().map(|link| {
        let item = Item::link(link.from.data(), link.to.data());
        (item, format!("keep {}", link.keep))
    });
    components.chain(links).collect()
}
