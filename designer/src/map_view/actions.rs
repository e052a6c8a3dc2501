//! What gestures and commands do to the file, each as one step of the history.

use armor_geo::{MapPoint, MapPolygon};
use armor_robotfile::drawn_route::RouteStep;
use armor_robotfile::site_map::{LineKind, ZoneKind};
use eframe::egui::Pos2;

use crate::item::Item;
use crate::map_view::corner::Corner;
use crate::map_view::edits::{self, NewRoute, PathEnd};
use crate::map_view::model::{mission_of, placement_of};
use crate::map_view::movers::drivers_of_new_route;
use crate::map_view::position_text::{PositionStyle, is_geographic};
use crate::map_view::scene::{SceneShape, handles_of, word_of};
use crate::map_view::state::MapView;
use crate::map_view::tools::Tool;
use crate::name::ItemName;
use crate::workspace::Workspace;

/// Why there is no route.
pub(super) const NO_MOVER: &str =
    "A route needs a component that drives along it: add one of the kind patrol to the system";

impl MapView {
    /// Draws a point or a rally point.
    pub(super) fn add_point(&mut self, is_rally: bool, at: MapPoint, workspace: &mut Workspace) {
        let text = new_position(at, " ", workspace);
        let (mut added, what) = (None, if is_rally { "add a rally point" } else { "add a point" });
        workspace.edit(what, |documents| {
            added = Some(edits::add_point(documents.mission()?, is_rally, &text)?);
            Ok(())
        });
        let item = |name: String| if is_rally { Item::rally(name) } else { Item::map_point(name) };
        self.select_added(added.map(item), workspace);
    }

    /// Draws a symbol.
    pub(super) fn add_symbol(&mut self, at: MapPoint, workspace: &mut Workspace) {
        let text = new_position(at, " ", workspace);
        let mut added = None;
        workspace.edit("add a symbol", |documents| {
            added = Some(edits::add_symbol(documents.mission()?, &text)?);
            Ok(())
        });
        self.select_added(added.map(Item::Symbol), workspace);
    }

    /// Ends the zone or line that is being drawn, if it has enough points.
    pub(super) fn finish_draft(&mut self, workspace: &mut Workspace) {
        let Some(least) = self.tool.least_points() else { return };
        if self.draft.len() < least {
            let name = self.tool.name();
            return workspace.messages.warn(format!("{name} needs {least} points"));
        }
        let corners = self.draft.iter().map(|at| new_position(*at, ",", workspace));
        let shape = corners.collect::<Vec<_>>().join(" ");
        let (is_zone, kind) = match self.tool {
            Tool::Zone(kind) => (true, word_of(&ZoneKind::NAMED, kind)),
            Tool::Line(kind) => (false, word_of(&LineKind::NAMED, kind)),
            _ => return,
        };
        let crossing = MapPolygon::new(self.draft.clone()).err().filter(|_| is_zone);
        let (mut added, what) = (None, if is_zone { "add a zone" } else { "add a line" });
        workspace.edit(what, |documents| {
            added = Some(edits::add_area(documents.mission()?, is_zone, kind, &shape)?);
            Ok(())
        });
        if let (Some(name), Some(why)) = (&added, crossing) {
            workspace.messages.warn(format!("Zone {name}: {why}. Drag a corner of it."));
        }
        self.draft.clear();
        self.tool = Tool::Select;
        let item = |name: String| if is_zone { Item::zone(name) } else { Item::map_line(name) };
        self.select_added(added.map(item), workspace);
    }

    /// Adds a leg to the route, to the point at the pointer or to a new one.
    pub(super) fn add_leg_at(&mut self, at: Pos2, workspace: &mut Workspace) {
        let point = self.sight().point_near(at, &|_| false);
        let here = point.map_or_else(|| self.position_at(at, workspace), |(_, at)| at);
        let known = point.map(|(item, _)| item);
        match self.leg_route(workspace) {
            Some(route) => self.add_leg(route, None, known, here, workspace),
            None => self.begin_route(known, here, workspace),
        }
    }

    /// Adds a leg to the selected point, or one from it if nothing else is selected.
    pub(super) fn add_leg_to_selected(&mut self, workspace: &mut Workspace) {
        let Some(item @ (Item::MapPoint(_) | Item::Rally(_))) = self.only() else { return };
        let Some(at) = self.scene.find(item).map(|entry| entry.shape.points()[0]) else { return };
        match self.leg_route(workspace) {
            Some(route) => self.add_leg(route, None, Some(item), at, workspace),
            None => self.begin_route(Some(item), at, workspace),
        }
    }

    /// Adds a leg to a point that is there, or to a new one.
    fn add_leg(
        &mut self,
        route: ItemName,
        before: Option<ItemName>,
        known: Option<Item>,
        at: MapPoint,
        workspace: &mut Workspace,
    ) {
        let text = new_position(at, " ", workspace);
        let mut added = None;
        workspace.edit(format!("add a leg to route {route}"), |documents| {
            let document = documents.mission()?;
            let to = match known {
                Some(Item::MapPoint(name) | Item::Rally(name)) => name.as_str().to_owned(),
                _ => edits::add_point(document, false, &text)?,
            };
            let before = before.map(ItemName::as_str);
            added = Some(edits::add_leg(document, &route, before, &to)?);
            Ok(())
        });
        self.select_added(added.map(|leg| Item::step(route, leg)), workspace);
    }

    /// The first click of a new route is where the robot is at first, the second its first leg.
    fn begin_route(&mut self, known: Option<Item>, at: MapPoint, workspace: &mut Workspace) {
        let Some(drivers) = drivers_of_new_route(workspace) else {
            workspace.messages.warn(NO_MOVER);
            return;
        };
        let Some(start) = self.new_start.replace(at) else { return };
        (self.new_start, self.is_new_route) = (None, false);
        let sight = self.sight();
        let at_start = self.camera.to_window(self.window, start);
        let known_start = sight.point_near(at_start, &|_| false).map(|(item, _)| item);
        let (from, to) = (new_position(start, " ", workspace), new_position(at, " ", workspace));
        let mut added = None;
        workspace.edit("add a route", |documents| {
            let document = documents.mission()?;
            let mut named = |known: Option<Item>, text: &str| match known {
                Some(Item::MapPoint(name) | Item::Rally(name)) => Ok(name.as_str().to_owned()),
                _ => edits::add_point(document, false, text),
            };
            let (start, to) = (named(known_start, &from)?, named(known, &to)?);
            let out = edits::ensure_ends(document)?;
            let new = NewRoute { drivers: &drivers, start: &start, out: &out };
            let route = edits::add_route(document, &new)?;
            let leg = edits::add_leg(document, &route, None, &to)?;
            edits::add_exits(document, &route)?;
            added = Some(Item::step(route, leg));
            Ok(())
        });
        self.select_added(added, workspace);
    }

    /// Draws points and a leg to each, at the end of the route, or as a new one that begins at the first.
    pub(super) fn add_path(
        &mut self,
        what: String,
        points: &[MapPoint],
        workspace: &mut Workspace,
    ) {
        let route = self.leg_route(workspace);
        let drivers = drivers_of_new_route(workspace);
        if route.is_none() && drivers.is_none() {
            return workspace.messages.warn(NO_MOVER);
        }
        let texts = points.iter().map(|at| new_position(*at, " ", workspace));
        let texts: Vec<_> = texts.collect();
        let mut added = None;
        workspace.edit(what, |documents| {
            let document = documents.mission()?;
            let end = match (route, &drivers) {
                (Some(route), _) => PathEnd::Of(route.as_str()),
                (None, Some(drivers)) => PathEnd::New(drivers),
                (None, None) => return Ok(()),
            };
            added = Some(edits::add_path(document, end, &texts)?);
            Ok(())
        });
        let Some((route, legs)) = added else { return };
        self.is_new_route = false;
        self.select_next = legs.iter().map(|leg| Item::step(&route, leg)).collect();
    }

    /// Puts a new point, and a leg to it, before a leg; or a leg to the point at the pointer.
    pub(super) fn insert_leg(
        &mut self,
        step: Item,
        at: Pos2,
        to: MapPoint,
        workspace: &mut Workspace,
    ) {
        let Item::Step { route, step } = step else { return };
        let known = self.sight().point_near(at, &|_| false).map(|(item, _)| item);
        self.add_leg(route, Some(step), known, to, workspace);
    }

    /// Moves a corner.
    pub(super) fn move_corner(&mut self, corner: Corner, to: MapPoint, workspace: &mut Workspace) {
        let what = format!("move corner {} of {}", corner.number + 1, corner.item);
        self.place(what, &[(corner, to)], workspace);
    }

    /// Adds a corner.
    pub(super) fn insert_corner(
        &mut self,
        corner: Corner,
        at: MapPoint,
        workspace: &mut Workspace,
    ) {
        let placement = placement_of(workspace);
        let what = format!("add a corner to {}", corner.item);
        let is_made = workspace.edit(what, |documents| {
            edits::insert_corner(documents.mission()?, placement.as_ref(), corner, at)
        });
        self.corner = is_made.then_some(corner);
    }

    /// Puts positions elsewhere.
    pub(super) fn place(
        &mut self,
        what: String,
        placed: &[(Corner, MapPoint)],
        workspace: &mut Workspace,
    ) {
        let placement = placement_of(workspace);
        workspace.edit(what, |documents| {
            edits::place_corners(documents.mission()?, placement.as_ref(), placed)
        });
    }

    /// The positions of what is selected, without those of legs: their points are moved.
    pub(super) fn selected_corners(&self) -> Vec<(Corner, MapPoint)> {
        let entries = self.scene.items.iter().filter(|it| self.selection.contains(&it.item));
        let corners = entries.flat_map(|entry| {
            let points = match &entry.shape {
                SceneShape::Leg { .. } | SceneShape::Stop { .. } => Vec::new(),
                SceneShape::Zone { .. } | SceneShape::Line { .. } => handles_of(&entry.shape),
                shape => shape.points(),
            };
            let item = entry.item;
            let is_circle =
                matches!(&entry.shape, SceneShape::Zone { outline, .. } if outline.is_circle());
            let count = if is_circle { 1 } else { points.len() };
            let points = points.into_iter().take(count).enumerate();
            points.map(move |(number, at)| (Corner { item, number }, at))
        });
        corners.collect()
    }

    /// Removes the corner that is selected, or what is selected.
    pub(super) fn delete(&mut self, workspace: &mut Workspace) {
        if let Some(corner) = self.corner.take() {
            let what = format!("remove corner {} of {}", corner.number + 1, corner.item);
            workspace.edit(what, |documents| edits::remove_corner(documents.mission()?, corner));
            return;
        }
        let items: Vec<_> = self.selection.iter().copied().collect();
        let what = match items.as_slice() {
            [item] => format!("remove {item}"),
            items => format!("remove {} items", items.len()),
        };
        let Some(mission) = mission_of(workspace).cloned() else { return };
        let is_made =
            workspace.edit(what, |documents| edits::remove(documents.mission()?, &mission, &items));
        if is_made {
            self.select([]);
        }
    }

    /// The route that new legs are added to: the one that is selected, that of the palette, or the
    /// last.
    pub(super) fn leg_route(&self, workspace: &Workspace) -> Option<ItemName> {
        if self.is_new_route {
            return None;
        }
        let routes = &mission_of(workspace)?.routes;
        let is_there =
            |name: &ItemName| routes.iter().any(|route| route.name.value == name.as_str());
        let selected = match self.only() {
            Some(Item::Step { route, .. } | Item::Route(route)) => Some(route),
            _ => None,
        };
        let last = || routes.last().map(|route| ItemName::new(&route.name.value));
        selected.filter(is_there).or(self.route.filter(is_there)).or_else(last)
    }

    /// Selects what was added once it is drawn, and shows its properties.
    pub(super) fn select_added(&mut self, item: Option<Item>, workspace: &mut Workspace) {
        if item.is_some() {
            workspace.settings.properties = true;
        }
        self.select_next = item.into_iter().collect();
    }
}

/// A new position, written as the others of the map are: as latitude and longitude if the first one
/// is.
fn new_position(at: MapPoint, between: &str, workspace: &Workspace) -> String {
    let map = mission_of(workspace).and_then(|mission| mission.map.as_ref());
    let first = map.and_then(|map| map.points.iter().chain(&map.rallies).next());
    let written = first.map_or("", |point| point.position.at.text());
    let placement = placement_of(workspace).filter(|_| is_geographic(written));
    PositionStyle { placement: placement.as_ref() }.write(at, between)
}

/// The routes that lead to a point, with their legs: what a removal of the point takes along.
pub(super) fn legs_to(item: Item, workspace: &Workspace) -> Vec<Item> {
    let (Item::MapPoint(name) | Item::Rally(name)) = item else { return Vec::new() };
    let routes = mission_of(workspace).map_or(&[][..], |mission| &mission.routes);
    let legs = routes.iter().flat_map(|route| {
        let legs = route
            .steps
            .iter()
            .filter(|step| matches!(step, RouteStep::Leg(leg) if leg.to.value == name.as_str()));
        legs.map(|leg| Item::step(&route.name.value, &leg.name().value))
    });
    legs.collect()
}
