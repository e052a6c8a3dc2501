//! What numbers do to the selection: it is moved, turned, mirrored, offset; and patterns of legs over a zone
//! or along a line. Each is one step of the history, and changes a line of the file for each position.

use armor_geo::{
    Clearance, MapPoint, MapPolyline, MapShift, SurveyLanes, offset_line, sweep_area,
    sweep_corridor,
};
use armor_robotfile::drawn_route::RouteStep;
use armor_robotfile::site_map::SiteMap;
use armor_wire::quantity::{Dimension, parse_in};
use eframe::egui::{self, TextEdit};

use crate::item::Item;
use crate::map_view::camera::{MapBounds, map_point};
use crate::map_view::corner::Corner;
use crate::map_view::model::{mission_of, site_map_of};
use crate::map_view::scene::{SceneShape, handles_of};
use crate::map_view::state::MapView;
use crate::mission::panel::parts::section;
use crate::panels::fields::is_entered;
use crate::workspace::Workspace;

/// What is to be done with the selection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shaping {
    Move,
    Rotate,
    Mirror,
    Offset,
    Survey,
    Corridor,
}

impl MapView {
    /// The fields for what is selected.
    pub(super) fn show_shaping(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let corners = self.shaped_corners(workspace);
        if corners.is_empty() {
            return;
        }
        let mut wanted = None;
        section(ui, "By numbers");
        let form = &mut self.shaping;
        let mut row = |ui: &mut egui::Ui, what, name: &str, hint: &str, text: &mut String| {
            ui.horizontal(|ui| {
                let field = TextEdit::singleline(text).hint_text(hint).desired_width(90.0);
                let field = ui.add(field).accessible_name(format!("{name} the selection"));
                let is_done = is_entered(ui, &field);
                let button = ui.button(name).accessible_name(format!("apply: {name}"));
                if is_done || button.clicked() {
                    wanted = Some(what);
                }
            });
        };
        row(ui, Shaping::Move, "move by", "1.5 -2", &mut form.move_by);
        row(ui, Shaping::Rotate, "rotate by", "90deg", &mut form.rotate_by);
        row(ui, Shaping::Mirror, "mirror across", "x, y or 30deg", &mut form.mirror_across);
        row(ui, Shaping::Offset, "offset by", "0.5m, to the left", &mut form.offset_by);
        let only = self.only();
        if matches!(only, Some(Item::Zone(_) | Item::MapLine(_))) {
            section(ui, "Pattern of legs");
            let field = |ui: &mut egui::Ui, name: &str, text: &mut String| {
                ui.horizontal(|ui| {
                    let field = ui.add(TextEdit::singleline(text).desired_width(90.0));
                    field.accessible_name(format!("{name} of the pattern"));
                    ui.label(name);
                });
            };
            field(ui, "distance of lanes", &mut self.shaping.spacing);
            let (name, what) = match only {
                Some(Item::Zone(_)) => {
                    field(ui, "direction", &mut self.shaping.direction);
                    field(ui, "distance from the boundary", &mut self.shaping.inset);
                    ("Survey the zone", Shaping::Survey)
                }
                _ => {
                    field(ui, "width", &mut self.shaping.width);
                    ("Follow the line", Shaping::Corridor)
                }
            };
            if ui.button(name).clicked() {
                wanted = Some(what);
            }
        }
        if let Some(what) = wanted
            && let Err(why) = self.shape(what, &corners, workspace)
        {
            workspace.messages.warn(why);
        }
    }

    fn shape(
        &mut self,
        what: Shaping,
        corners: &[(Corner, MapPoint)],
        workspace: &mut Workspace,
    ) -> Result<(), String> {
        let form = self.shaping.clone();
        let centre = MapBounds::of(corners.iter().map(|(_, at)| *at)).map(|bounds| bounds.centre());
        let centre = centre.unwrap_or_else(|| map_point([0.0, 0.0]));
        let (name, shift) = match what {
            Shaping::Move => {
                let [x_m, y_m] = read_pair(&form.move_by)?;
                ("move", MapShift::Move { x_m, y_m })
            }
            Shaping::Rotate => {
                let angle_rad = read_angle(&form.rotate_by)?;
                ("rotate", MapShift::Rotate { centre, angle_rad })
            }
            Shaping::Mirror => {
                let axis_rad = match form.mirror_across.trim() {
                    "x" => 0.0,
                    "y" => std::f64::consts::FRAC_PI_2,
                    angle => read_angle(angle)?,
                };
                ("mirror", MapShift::Mirror { through: centre, axis_rad })
            }
            Shaping::Offset => return self.offset(&form.offset_by, workspace),
            Shaping::Survey | Shaping::Corridor => return self.sweep(what, workspace),
        };
        let placed = corners.iter().map(|(corner, at)| Ok((*corner, shift.apply(*at)?)));
        let placed: Result<Vec<_>, armor_geo::ShapeError> = placed.collect();
        let placed = placed.map_err(|error| error.to_string())?;
        self.place(format!("{name} {}", self.selection_words()), &placed, workspace);
        Ok(())
    }

    fn selection_words(&self) -> String {
        match self.only() {
            Some(item) => item.to_string(),
            None => format!("{} items", self.selection.len()),
        }
    }

    /// The positions of what is selected, and of the points that selected legs and routes lead to.
    fn shaped_corners(&self, workspace: &Workspace) -> Vec<(Corner, MapPoint)> {
        let mut corners = self.selected_corners();
        for (item, at) in self.points_of_legs(workspace) {
            let corner = Corner { item, number: 0 };
            if !corners.iter().any(|(known, _)| *known == corner) {
                corners.push((corner, at));
            }
        }
        corners
    }

    /// The points of the legs that are selected, by themselves or with their route, in their order.
    fn points_of_legs(&self, workspace: &Workspace) -> Vec<(Item, MapPoint)> {
        let (Some(mission), Some(map)) = (mission_of(workspace), site_map_of(workspace)) else {
            return Vec::new();
        };
        let mut points: Vec<(Item, MapPoint)> = Vec::new();
        for route in &mission.routes {
            let name = route.name.value.as_str();
            let whole = self.selection.contains(&Item::route(name));
            for step in &route.steps {
                let RouteStep::Leg(leg) = step else { continue };
                if whole || self.selection.contains(&Item::step(name, &leg.name.value)) {
                    points.extend(find_mark(map, &leg.to.value));
                }
            }
        }
        points
    }

    /// Offsets the outline of a zone, a line, or a path of legs to the left of its direction.
    fn offset(&mut self, text: &str, workspace: &mut Workspace) -> Result<(), String> {
        let left_m = read_length(text)?;
        let legs = self.points_of_legs(workspace);
        let (corners, is_closed): (Vec<(Corner, MapPoint)>, bool) = match self.only() {
            Some(item @ (Item::Zone(_) | Item::MapLine(_))) => {
                let entry = self.scene.find(item).ok_or("it is not drawn")?;
                if let SceneShape::Zone { outline, .. } = &entry.shape
                    && outline.is_circle()
                {
                    return Err("A circle is made larger by its boundary.".into());
                }
                let points = handles_of(&entry.shape).into_iter().enumerate();
                let corners = points.map(|(number, at)| (Corner { item, number }, at)).collect();
                (corners, matches!(item, Item::Zone(_)))
            }
            _ if legs.len() >= 2 => {
                let corners =
                    legs.iter().map(|(item, at)| (Corner { item: *item, number: 0 }, *at));
                (corners.collect(), false)
            }
            _ => return Err("Select a zone, a line, or two legs or more to offset.".into()),
        };
        let mut seen: Vec<Corner> = Vec::new();
        for (corner, _) in &corners {
            if seen.contains(corner) {
                return Err(format!(
                    "{} is in the path twice, so that it cannot be offset to one side.",
                    corner.item
                ));
            }
            seen.push(*corner);
        }
        let points: Vec<_> = corners.iter().map(|(_, at)| *at).collect();
        let moved = offset_line(&points, is_closed, left_m).map_err(|error| error.to_string())?;
        let placed: Vec<_> = seen.into_iter().zip(moved).collect();
        self.place(format!("offset {}", self.selection_words()), &placed, workspace);
        Ok(())
    }

    /// Adds points and legs that sweep the selected zone, or follow the selected line.
    fn sweep(&mut self, what: Shaping, workspace: &mut Workspace) -> Result<(), String> {
        let Some(map) = site_map_of(workspace) else { return Ok(()) };
        let form = &self.shaping;
        let spacing_m = read_length(&form.spacing)?;
        let from = self.end_of_route(workspace, map);
        let points = match self.only() {
            Some(Item::Zone(name)) if what == Shaping::Survey => {
                let zone = map.zones.iter().find(|zone| zone.name.value == name.as_str());
                let armor_geo::MapArea::Polygon(area) =
                    &zone.ok_or("there is no such zone")?.area.value
                else {
                    return Err("A circle is not surveyed: draw a zone with corners.".into());
                };
                let inset = Clearance::new(read_length(&form.inset)?);
                let lanes = SurveyLanes {
                    spacing_m,
                    direction_rad: read_angle(&form.direction)?,
                    inset: inset.map_err(|error| error.to_string())?,
                    from,
                };
                sweep_area(area, lanes)
            }
            Some(Item::MapLine(name)) => {
                let line = map.lines.iter().find(|line| line.name.value == name.as_str());
                let line: &MapPolyline = &line.ok_or("there is no such line")?.shape.value;
                sweep_corridor(line, read_length(&form.width)?, spacing_m)
            }
            _ => return Ok(()),
        };
        let points = points.map_err(|error| error.to_string())?;
        let what = format!("draw legs over {}", self.selection_words());
        self.add_path(what, &points, workspace);
        Ok(())
    }

    /// Where the route ends that legs are added to.
    fn end_of_route(&self, workspace: &Workspace, map: &SiteMap) -> Option<MapPoint> {
        let name = self.leg_route(workspace)?;
        let routes = &mission_of(workspace)?.routes;
        let route = routes.iter().find(|route| route.name.value == name.as_str())?;
        let last = route.steps.iter().rev().find_map(|step| match step {
            RouteStep::Leg(leg) => Some(leg.to.value.as_str()),
            _ => None,
        });
        let last = last.or(route.start.as_ref().map(|start| start.value.as_str()))?;
        find_mark(map, last).map(|(_, at)| at)
    }
}

/// A point or a rally point, as the item that it is.
fn find_mark(map: &SiteMap, name: &str) -> Option<(Item, MapPoint)> {
    let is_it = |point: &&armor_robotfile::site_map::DrawnPoint| point.name.value == name;
    let at = |point: &armor_robotfile::site_map::DrawnPoint| point.position.value.point;
    let point = map.points.iter().find(is_it).map(|point| (Item::map_point(name), at(point)));
    point.or_else(|| map.rallies.iter().find(is_it).map(|point| (Item::rally(name), at(point))))
}

fn read_length(text: &str) -> Result<f64, String> {
    let wanted = "a length such as 0.5m";
    parse_in(text.trim(), Dimension::Length, wanted).map_err(|error| error.to_string())
}

fn read_angle(text: &str) -> Result<f64, String> {
    let wanted = "an angle such as 90deg";
    parse_in(text.trim(), Dimension::Angle, wanted).map_err(|error| error.to_string())
}

/// `1.5 -2`: metres to the right and up.
fn read_pair(text: &str) -> Result<[f64; 2], String> {
    let numbers = text.split(|c: char| c.is_whitespace() || c == ',');
    let numbers = numbers.filter(|word| !word.is_empty()).map(|word| {
        let number: f64 = word.trim_end_matches('m').parse().ok()?;
        number.is_finite().then_some(number)
    });
    match numbers.collect::<Option<Vec<_>>>().as_deref() {
        Some([x_m, y_m]) => Ok([*x_m, *y_m]),
        _ => Err(format!("{text} are not two lengths: write 1.5 -2, to the right and up")),
    }
}
