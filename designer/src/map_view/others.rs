//! The drawings of other files and of systems that run, on the same map: lighter, read only, with their names.
//! Maps with an origin are brought together by it; without one, both must begin at the same place.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use armor_geo::{MapPlacement, MapPoint};
use armor_picture::theme::ThemeColours;
use armor_robotfile::Mission;
use eframe::egui::accesskit::{Node, Role};
use eframe::egui::{
    self, Align2, Color32, Painter, Rect, Response, RichText, Shape, Stroke, TextEdit, Vec2,
};

use crate::canvas::paintable;
use crate::live::running;
use crate::map_view::camera::MapBounds;
use crate::map_view::hit::Sight;
use crate::map_view::model::{mission_of, placement_of};
use crate::map_view::names::publish;
use crate::map_view::painting::paint_note;
use crate::map_view::scene::{MapScene, SceneShape};
use crate::map_view::state::{MapFit, MapView};
use crate::map_view::symbol_picture::SymbolPictures;
use crate::mission::marks::Marks;
use crate::panels::fields::is_entered;
use crate::workspace::Workspace;

/// The most other drawings at once.
const MAX_OTHERS: usize = 16;
/// How often the files of others are looked at, in seconds.
const LOOK_EVERY_S: f64 = 1.0;

/// The drawings of others.
#[derive(Default)]
pub struct OtherDrawings {
    typed: String,
    list: Vec<OtherDrawing>,
    symbols: SymbolPictures,
    looked_s: Option<f64>,
    /// The map that they were brought to.
    placed_in: Option<PlacedIn>,
}

/// Where the map of the open file is in the world, and whether there is one.
#[derive(Clone, Debug, PartialEq)]
struct PlacedIn {
    has_map: bool,
    placement: Option<MapPlacement>,
}

/// The drawing of a file that is not open.
struct OtherDrawing {
    path: PathBuf,
    /// The file, or the system that runs.
    name: String,
    is_shown: bool,
    modified: Option<SystemTime>,
    /// Why nothing of it is shown, if so.
    scene: Result<MapScene, String>,
}

impl OtherDrawings {
    /// Adds the drawing of a file, under a name.
    fn add(&mut self, path: &Path, name: String) -> Result<(), String> {
        if self.list.iter().any(|other| other.path == path) {
            return Err(format!("{} is shown already", path.display()));
        }
        if self.list.len() == MAX_OTHERS {
            return Err(format!("at most {MAX_OTHERS} other drawings are shown: remove one"));
        }
        let (path, scene) = (path.to_owned(), Err(String::new()));
        self.list.push(OtherDrawing { path, name, is_shown: true, modified: None, scene });
        self.placed_in = None;
        Ok(())
    }

    /// Reads what has changed, on the disk or in the map of the open file. Returns whether something has.
    fn follow(&mut self, placed_in: PlacedIn, now_s: f64) -> bool {
        let is_moved = self.placed_in.as_ref() != Some(&placed_in);
        let is_due = self.looked_s.is_none_or(|at_s| now_s >= at_s + LOOK_EVERY_S);
        if self.list.is_empty() || !(is_moved || is_due) {
            return false;
        }
        let mut is_changed = false;
        self.looked_s = Some(now_s);
        for other in &mut self.list {
            let modified = std::fs::metadata(&other.path).and_then(|it| it.modified()).ok();
            if is_moved || modified != other.modified {
                is_changed = true;
                other.modified = modified;
                other.scene = read_scene(&other.path, &placed_in, &mut self.symbols);
            }
        }
        self.placed_in = Some(placed_in);
        is_changed
    }

    fn shown(&self) -> impl Iterator<Item = (&str, &MapScene)> {
        let shown = self.list.iter().filter(|other| other.is_shown);
        shown.filter_map(|other| Some((other.name.as_str(), other.scene.as_ref().ok()?)))
    }

    /// The smallest area that has all that are shown.
    pub fn bounds(&self) -> Option<MapBounds> {
        self.shown().filter_map(|(_, scene)| scene.bounds()).reduce(MapBounds::union)
    }
}

/// The scene of a file, brought to the map of another one.
fn read_scene(
    path: &Path,
    placed_in: &PlacedIn,
    symbols: &mut SymbolPictures,
) -> Result<MapScene, String> {
    let reading = armor_robotfile::load(path);
    let Some(configuration) = reading.configuration else {
        return Err("the file cannot be read: open it, or run armor check".into());
    };
    let mission = configuration.mission.ok_or("the file has no mission")?;
    scene_in(&mission, placed_in, symbols)
}

fn scene_in(
    mission: &Mission,
    placed_in: &PlacedIn,
    symbols: &mut SymbolPictures,
) -> Result<MapScene, String> {
    let map = mission.map.as_ref().ok_or("its mission has no map")?;
    let here = placed_in.placement.filter(|_| placed_in.has_map);
    let moved: Box<dyn Fn(MapPoint) -> Option<MapPoint>> = match (map.placement, here) {
        (Some(there), Some(here)) if there == here => Box::new(Some),
        (Some(there), Some(here)) => {
            Box::new(move |at| here.map_from_geo(there.geo_from_map(at).ok()?).ok())
        }
        // As both robots begin at the same place, or nothing is drawn here yet.
        (None, None) => Box::new(Some),
        (Some(_), None) if !placed_in.has_map => Box::new(Some),
        (Some(_), None) => {
            return Err("its map has an origin and that of this file has none, so that it is not \
                        known how they lie to each other: give this one an origin"
                .into());
        }
        (None, Some(_)) => {
            return Err("its map has no origin and that of this file has one, so that it is not \
                        known how they lie to each other: give that one an origin"
                .into());
        }
    };
    let known = |at: MapPoint| moved(at).is_some();
    let points = map.points.iter().chain(&map.rallies).map(|point| point.position.value.point);
    if !points.into_iter().all(known) {
        return Err("it is too far away for this map".into());
    }
    let displaced = |_, at: MapPoint| moved(at).unwrap_or(at);
    Ok(MapScene::of(mission, &Marks::default(), symbols, &displaced))
}

impl MapView {
    /// Brings the drawings of others up to date.
    pub(super) fn follow_others(&mut self, ui: &egui::Ui, workspace: &Workspace) {
        let has_map = mission_of(workspace).is_some_and(|mission| mission.map.is_some());
        let placed_in = PlacedIn { has_map, placement: placement_of(workspace) };
        let is_changed = self.others.follow(placed_in, ui.input(|input| input.time));
        if is_changed && self.stays_fitted {
            self.fit = Some(MapFit::Everything);
        }
    }

    /// The list in the palette: which are shown, why one is not, and a field to add one.
    pub(super) fn show_others(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        ui.strong("Other drawings");
        let mut gone = None;
        for (number, other) in self.others.list.iter_mut().enumerate() {
            ui.horizontal(|ui| {
                let name = paintable(ui.ctx(), &other.name).into_owned();
                let shown = ui.checkbox(&mut other.is_shown, &name);
                shown
                    .on_hover_text(other.path.display().to_string())
                    .accessible_name(format!("other drawing: {name}"));
                let button = ui.small_button("x").on_hover_text("Remove it from this map");
                if button.accessible_name(format!("remove the drawing {name}")).clicked() {
                    gone = Some(number);
                }
            });
            if let Err(why) = &other.scene {
                let why = format!("not shown: {why}");
                ui.label(RichText::new(paintable(ui.ctx(), &why)).weak().small());
            }
        }
        if let Some(number) = gone {
            self.others.list.remove(number);
        }
        let field = TextEdit::singleline(&mut self.others.typed).hint_text("a file, Enter");
        let field = ui.add(field.desired_width(f32::INFINITY));
        let field = field.accessible_name("file of another drawing");
        if is_entered(ui, &field) {
            self.add_other(workspace);
        }
        let button = ui.button("Running systems");
        let button =
            button.on_hover_text("Adds the drawings of your systems that run on this host");
        if button.clicked() {
            self.add_running(workspace);
        }
    }

    fn add_other(&mut self, workspace: &mut Workspace) {
        let typed = self.others.typed.trim().to_owned();
        if typed.is_empty() {
            return;
        }
        let path = workspace.project.folder().join(&typed);
        let is_open = workspace.project.path().is_some_and(|open| is_same_file(open, &path));
        let result = match (path.is_file(), is_open) {
            (false, _) => Err(format!("there is no file {}", path.display())),
            (_, true) => Err(format!("{typed} is the open file")),
            _ => self.others.add(&path, typed),
        };
        match result {
            Ok(()) => self.others.typed.clear(),
            Err(why) => workspace.messages.warn(why),
        }
    }

    fn add_running(&mut self, workspace: &mut Workspace) {
        let records = match running() {
            Ok(records) => records,
            Err(error) => return workspace.messages.warn(error.to_string()),
        };
        let mut count = 0;
        for record in records {
            let path = record.resolve(&record.file);
            if workspace.project.path().is_some_and(|open| is_same_file(open, &path)) {
                continue;
            }
            count +=
                usize::from(self.others.add(&path, format!("{} (runs)", record.system)).is_ok());
        }
        if count == 0 {
            workspace.messages.warn("No other system of yours runs on this host.");
        }
    }

    /// Paints them beneath the drawing of the open file.
    pub(super) fn paint_others(&self, painter: &Painter, colours: &ThemeColours) {
        let colour = colours.weak.gamma_multiply(0.7);
        for (name, scene) in self.others.shown() {
            let sight = Sight { scene, ..self.sight() };
            for entry in sight.items() {
                paint_other(painter, &sight, &entry.shape, colour);
            }
            if let Some(at) = anchor_of(&sight) {
                paint_note(painter, at, Align2::LEFT_BOTTOM, name, colours);
            }
        }
    }

    /// Publishes their names.
    pub(super) fn describe_others(&self, ctx: &egui::Context, response: &Response) {
        for (number, (name, scene)) in self.others.shown().enumerate() {
            let sight = Sight { scene, ..self.sight() };
            for entry in sight.items() {
                let area = Rect::from_center_size(sight.anchor(&entry.shape), Vec2::splat(18.0));
                if !self.window.intersects(area) {
                    continue;
                }
                let label = format!("{name}: {}", entry.label);
                let id = response.id.with(("other", number, entry.label.as_str()));
                publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::ListItem));
            }
        }
    }
}

/// Where the name of a drawing is: at its first item that is a leg, or at its first.
fn anchor_of(sight: &Sight<'_>) -> Option<egui::Pos2> {
    let items = || sight.items();
    let leg = items().find(|entry| matches!(entry.shape, SceneShape::Leg { .. }));
    leg.or_else(|| items().next()).map(|entry| sight.anchor(&entry.shape))
}

fn paint_other(painter: &Painter, sight: &Sight<'_>, shape: &SceneShape, colour: Color32) {
    let stroke = Stroke::new(1.5, colour);
    match shape {
        SceneShape::Zone { outline, .. } => {
            let corners: Vec<_> = outline.corners().into_iter().map(|at| sight.at(at)).collect();
            painter.add(Shape::closed_line(corners, stroke));
        }
        SceneShape::Line { points, .. } => {
            let points: Vec<_> = points.iter().map(|at| sight.at(*at)).collect();
            painter.extend(Shape::dashed_line(&points, stroke, 6.0, 4.0));
        }
        SceneShape::Leg { from: Some(from), to } => {
            let [from, to] = sight.leg_ends(*from, *to);
            painter.arrow(from, to - from, stroke);
        }
        SceneShape::Leg { from: None, .. } | SceneShape::Stop { .. } => {}
        SceneShape::Point(at) | SceneShape::Rally(at) | SceneShape::Symbol { at, .. } => {
            painter.circle_stroke(sight.at(*at), 4.0, stroke);
        }
    }
}

fn is_same_file(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one == other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::item::Item;
    use crate::map_view::camera::map_point;

    fn mission(origin: &str) -> Mission {
        let text = format!(
            "<armor version=\"1\"><system/><mission goal=\"over\"><map{origin}><point name=\"P1\" \
             at=\"3 4\"/><zone name=\"well\" kind=\"observe\" shape=\"circle 3,4 1m\"/></map><place \
             name=\"over\"/></mission></armor>"
        );
        let read = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(text.as_bytes().to_vec()));
        read.configuration.and_then(|it| it.mission).expect("a mission")
    }

    fn placed(origin: &str) -> PlacedIn {
        PlacedIn { has_map: true, placement: mission(origin).map.expect("a map").placement }
    }

    fn point_in(scene: &MapScene) -> MapPoint {
        scene.find(Item::map_point("P1")).expect("the point").shape.points()[0]
    }

    const PARIS: &str = " origin=\"48.8583 2.2945 35m\"";
    const TURNED: &str = " origin=\"48.8583 2.2945 35m\" heading=\"90deg\"";
    const FAR: &str = " origin=\"-33.8568 151.2153 5m\"";

    #[test]
    fn two_maps_in_the_world_are_brought_together_by_their_origins() {
        let symbols = &mut SymbolPictures::default();
        let same = scene_in(&mission(PARIS), &placed(PARIS), symbols).expect("it is shown");
        assert_eq!(point_in(&same), map_point([3.0, 4.0]));
        // There y points east, and x south.
        let turned = scene_in(&mission(TURNED), &placed(PARIS), symbols).expect("it is shown");
        assert!(point_in(&turned).distance_m(map_point([4.0, -3.0])) < 1e-6);
        let zone = turned.find(Item::zone("well")).expect("the zone");
        let bounds = zone.shape.bounds().expect("its bounds");
        assert!(bounds.centre().distance_m(map_point([4.0, -3.0])) < 1e-6);
    }

    #[test]
    fn maps_that_do_not_lie_to_each_other_in_a_known_way_are_not_shown() {
        let symbols = &mut SymbolPictures::default();
        assert!(scene_in(&mission(""), &placed(""), symbols).is_ok());
        let why = scene_in(&mission(PARIS), &placed(""), symbols).err().expect("it is refused");
        assert!(why.contains("give this one an origin"), "{why}");
        let why = scene_in(&mission(""), &placed(PARIS), symbols).err().expect("it is refused");
        assert!(why.contains("give that one an origin"), "{why}");
        let why = scene_in(&mission(FAR), &placed(PARIS), symbols).err().expect("it is refused");
        assert!(why.contains("too far away"), "{why}");
    }
}
