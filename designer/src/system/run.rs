//! The commands and gestures of the view, as edits of the files.

use eframe::egui::{self, Pos2, Rect, Vec2, vec2};

use crate::canvas::{Alignment, PortAt, align, snapped};
use crate::commands::Command;
use crate::desk::{Desk, View};
use crate::item::Item;
use crate::layout;
use crate::system::edits;
use crate::system::properties::Focus;
use crate::system::quick::Quick;
use crate::system::{SystemView, fragment};

/// Copies are put down so far from what they are copies of.
const BESIDE: Vec2 = vec2(30.0, 30.0);
/// A new block needs about so much.
const ROOM: Vec2 = vec2(190.0, 200.0);
/// Left free around what a group is drawn around.
const AROUND: f32 = 25.0;

impl SystemView {
    pub(super) fn may_run(&self, command: Command, desk: &Desk) -> Option<bool> {
        use Command as C;
        let selected = self.canvas.selection.len();
        let components = self.selected_components().len();
        Some(match command {
            C::Cut | C::Copy | C::Duplicate | C::Delete | C::ZoomSelected => selected > 0,
            C::SelectAll | C::ZoomFit | C::Arrange => desk.project.configuration().is_some(),
            C::Rename | C::Link => components == 1 && selected == 1,
            C::Properties => selected == 1,
            C::AlignLeft | C::AlignRight | C::AlignTop | C::AlignBottom => selected > 1,
            C::SpaceAcross | C::SpaceDown => selected > 2,
            C::Group => selected > 0,
            C::Add | C::Note => desk.project.configuration().is_some(),
            C::SelectNone | C::ZoomIn | C::ZoomOut | C::ZoomActual => true,
            C::Paste => true,
            _ => return None,
        })
    }

    pub(super) fn run_command(&mut self, command: Command, ctx: &egui::Context, desk: &mut Desk) {
        use Command as C;
        match command {
            C::Cut => {
                let is_copied = self.copy(ctx, desk);
                if is_copied {
                    self.delete(desk);
                }
            }
            C::Copy => {
                self.copy(ctx, desk);
            }
            C::Paste => ctx.send_viewport_cmd(egui::ViewportCommand::RequestPaste),
            C::Duplicate => self.duplicate(desk),
            C::Delete => self.delete(desk),
            C::Rename | C::Properties => {
                desk.settings.properties = true;
                let is_name = command == C::Rename;
                self.wants_focus = if is_name { Focus::Name } else { Focus::Value };
            }
            C::Add => {
                let middle = self.canvas.spot() + ROOM / 2.0;
                let at = self.drawing.diagram.free_spot(middle, ROOM) - ROOM / 2.0;
                self.quick = Some(Quick::to_add(desk, at));
            }
            C::Link => self.link_by_keyboard(),
            C::Group | C::Note => self.decorate(command == C::Note, desk),
            C::Arrange => self.arrange(desk),
            _ => match Alignment::of(command) {
                Some(how) => self.align(how, desk),
                None => self.canvas.run(command, &self.drawing.diagram),
            },
        }
    }

    /// Adds a component of a kind, and selects it.
    pub(super) fn add(&mut self, kind: &str, at: Pos2, desk: &mut Desk) -> Option<String> {
        let mut added = None;
        let shown = self.unplaced();
        desk.edit(format!("add {kind}"), |documents| {
            edits::place(documents, &shown)?;
            added = Some(edits::add_component(documents, kind, at)?);
            Ok(())
        });
        let name = added?;
        self.select_next = vec![Item::Component(name.clone())];
        desk.settings.properties = true;
        Some(name)
    }

    pub(super) fn join(&mut self, from: PortAt, to: PortAt, desk: &mut Desk) {
        match self.drawing.joints.ends(from, to) {
            Ok((output, input)) => {
                let (output, input) = (output.data(), input.data());
                self.join_named(&output, &input, desk);
            }
            Err(why) => desk.messages.warn(format!("not linked: {why}")),
        }
    }

    pub(super) fn join_named(&mut self, output: &str, input: &str, desk: &mut Desk) {
        let what = format!("link {output} to {input}");
        if desk.edit(what, |documents| edits::join(documents, output, input)) {
            self.select_next = vec![Item::Link { from: output.into(), to: input.into() }];
        }
    }

    pub(super) fn rewire(
        &mut self,
        wire: usize,
        stays: PortAt,
        to: Option<PortAt>,
        desk: &mut Desk,
    ) {
        let Some(Item::Link { from, to: input }) =
            self.drawing.diagram.wires.get(wire).map(|wire| wire.item.clone())
        else {
            return;
        };
        let Some(target) = to else {
            let item = Item::Link { from, to: input };
            desk.edit(format!("remove {item}"), |documents| edits::remove(documents, [&item]));
            return;
        };
        match self.drawing.joints.ends_without(Some(wire), stays, target) {
            Ok((output, new)) => {
                let (output, new) = (output.data(), new.data());
                desk.edit(format!("lead {output} to {new}"), |documents| {
                    edits::rewire(documents, (&from, &input), (&output, &new))
                });
                self.select_next = vec![Item::Link { from: output, to: new }];
            }
            Err(why) => desk.messages.warn(format!("not linked: {why}")),
        }
    }

    /// What is selected was dragged. What had no place in the file gets one with the first drag, so
    /// that nothing else moves.
    pub(super) fn moved(&mut self, by: Vec2, desk: &mut Desk) {
        let mut places: Vec<_> =
            self.selected_areas().into_iter().map(|(item, area)| (item, area.min + by)).collect();
        let count = places.len();
        let rest = self.unplaced().into_iter();
        places.extend(rest.filter(|(item, _)| !self.canvas.selection.contains(item)));
        let what = match self.canvas.only() {
            Some(item) => format!("move {item}"),
            None => format!("move {count} things"),
        };
        desk.edit(what, |documents| edits::place(documents, &places));
    }

    /// Where blocks are drawn that have no place in the file. The first edit that gives one of them
    /// a place gives it to all, so that the others stay where they are.
    pub(super) fn unplaced(&self) -> Vec<(Item, Pos2)> {
        let nodes = self.drawing.unplaced.iter().map(|n| &self.drawing.diagram.nodes[*n]);
        nodes.map(|node| (node.item.clone(), node.rect.min)).collect()
    }

    pub(super) fn resized(&mut self, item: &Item, rect: Rect, desk: &mut Desk) {
        if let Item::Decoration { view, number } = item {
            desk.edit("change a size", |documents| {
                layout::place_decoration(documents.system()?, *view, *number, rect)
            });
        }
    }

    /// Where what is selected is drawn; wires have no place of their own.
    fn selected_areas(&self) -> Vec<(Item, Rect)> {
        let items = self.canvas.selection.iter().filter(|item| !matches!(item, Item::Link { .. }));
        items.filter_map(|item| Some((item.clone(), self.drawing.diagram.rect(item)?))).collect()
    }

    fn copy(&self, ctx: &egui::Context, desk: &mut Desk) -> bool {
        match fragment::copied(&desk.project, &self.drawing, &self.canvas.selection) {
            Some(text) => {
                ctx.copy_text(text);
                true
            }
            None => {
                desk.messages.warn("nothing copied: select components, groups or notes");
                false
            }
        }
    }

    pub(super) fn paste_text(&mut self, text: &str, desk: &mut Desk) {
        let middle = self.canvas.spot();
        self.put(text, "paste", move |whole: Rect| snapped(middle - whole.size() / 2.0), desk);
    }

    fn duplicate(&mut self, desk: &mut Desk) {
        let text = fragment::copied(&desk.project, &self.drawing, &self.canvas.selection);
        match text {
            Some(text) => self.put(&text, "duplicate", |whole: Rect| whole.min + BESIDE, desk),
            None => desk.messages.warn("nothing duplicated: select components, groups or notes"),
        }
    }

    fn put(&mut self, text: &str, what: &str, at: impl FnOnce(Rect) -> Pos2, desk: &mut Desk) {
        let mut added = Vec::new();
        let shown = self.unplaced();
        desk.edit(what, |documents| {
            edits::place(documents, &shown)?;
            added = fragment::paste(documents, text, at)?;
            Ok(())
        });
        self.select_next = added;
    }

    fn delete(&mut self, desk: &mut Desk) {
        let items = self.canvas.selection.clone();
        let what = match self.canvas.only() {
            Some(item) => format!("remove {item}"),
            None => format!("remove {} things", items.len()),
        };
        if desk.edit(what, |documents| edits::remove(documents, &items)) {
            self.canvas.selection.clear();
        }
    }

    fn decorate(&mut self, is_note: bool, desk: &mut Desk) {
        let areas = self.selected_areas();
        let selected = areas.iter().map(|(_, area)| *area).reduce(Rect::union);
        let (rect, text) = if is_note {
            let at = selected.map_or(self.canvas.spot(), |area| area.left_bottom() + BESIDE);
            (Rect::from_min_size(at, vec2(220.0, 90.0)), "Note")
        } else {
            let Some(area) = selected else { return };
            let mut area = area.expand(AROUND);
            area.min.y -= AROUND;
            (area, "Group")
        };
        let number = self.drawing.diagram.decorations.len();
        let what = if is_note { "add a note" } else { "draw a group" };
        let added = desk.edit(what, |documents| {
            layout::add_decoration(documents.system()?, View::System, is_note, rect, text)
        });
        if added {
            self.select_next = vec![Item::Decoration { view: View::System, number }];
            desk.settings.properties = true;
            self.wants_focus = Focus::Name;
        }
    }

    fn arrange(&mut self, desk: &mut Desk) {
        let diagram = &self.drawing.diagram;
        let only: Vec<_> =
            self.canvas.selection.iter().filter_map(|item| diagram.node(item)).collect();
        let places = edits::arrange_all(diagram, &only);
        desk.edit("arrange", |documents| edits::place(documents, &places));
        if only.len() < 2 {
            self.canvas.fit_everything();
        }
    }

    fn align(&mut self, how: Alignment, desk: &mut Desk) {
        let places = align(&self.selected_areas(), how);
        desk.edit("bring into line", |documents| edits::place(documents, &places));
    }

    fn link_by_keyboard(&mut self) {
        if let Some(node) = self.canvas.only().and_then(|item| self.drawing.diagram.node(item)) {
            self.quick = Some(Quick::to_link(&self.drawing, node));
        }
    }
}

/// Every component and link, with its kind, ports, parameters and values.
pub(super) fn findable(desk: &Desk) -> Vec<(Item, String)> {
    let Some(configuration) = desk.project.configuration() else { return Vec::new() };
    let components = configuration.system.components.iter().map(|component| {
        let mut words = component.kind.value.clone();
        for parameter in &component.parameters {
            words += &format!(" {}={}", parameter.name.value, parameter.value.value);
        }
        if let Some(kind) = desk.project.kinds().find(&component.kind.value) {
            for port in kind.inputs.iter().chain(&kind.outputs) {
                words += &format!(" {} {}", port.id, port.type_name);
            }
        }
        (Item::Component(component.name.value.clone()), words)
    });
    let links = configuration.system.links.iter().map(|link| {
        let item = Item::Link { from: link.from.data(), to: link.to.data() };
        (item, format!("keep {}", link.keep))
    });
    components.chain(links).collect()
}
