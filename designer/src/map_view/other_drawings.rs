//! The drawings of other files and of systems that run, and what of them is shown on the map of the open
//! file. Maps with an origin are brought together by it; without one, both must begin at the same place.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use armor_geo::{MapPlacement, MapPoint};
use armor_inspect::WakeCallback;
use armor_robotfile::Mission;
use armor_robotfile::timing::FollowedMission;

use crate::map_view::camera::MapBounds;
use crate::map_view::live::robots::{RobotPose, ShownRobot};
use crate::map_view::other_robots::{OtherRobots, OtherRoutes};
use crate::map_view::scene::MapScene;
use crate::map_view::symbol_picture::SymbolPictures;
use crate::mission::marks::Marks;

/// The most other drawings at the same time.
const MAX_OTHERS: usize = 16;
/// Period with which other files are checked for changes, in seconds.
const LOOK_EVERY_S: f64 = 1.0;

/// The drawings of others.
#[derive(Default)]
pub struct OtherDrawings {
    pub(super) typed: String,
    pub(super) list: Vec<OtherDrawing>,
    symbols: SymbolPictures,
    looked_s: Option<f64>,
    /// The map that they were brought to.
    placed_in: Option<PlacedIn>,
}

/// Where the map of the open file is in the world, and whether there is one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlacedIn {
    pub(super) has_map: bool,
    pub(super) placement: Option<MapPlacement>,
}

/// The drawing of a file that is not open.
pub(super) struct OtherDrawing {
    pub(super) path: PathBuf,
    /// The file, or the system that runs.
    pub(super) name: String,
    pub(super) is_shown: bool,
    /// The registry of a system that runs.
    registry: Option<String>,
    /// Its robots, while it runs and is shown.
    pub(super) robots: Option<OtherRobots>,
    modified: Option<SystemTime>,
    /// Why nothing of it is shown, if so.
    pub(super) scene: Result<MapScene, String>,
}

impl OtherDrawings {
    /// Adds the drawing of a file, under a name; of a system that runs, with the address of its registry.
    pub(super) fn add(
        &mut self,
        path: &Path,
        name: String,
        registry: Option<String>,
    ) -> Result<(), String> {
        if self.list.iter().any(|other| other.path == path) {
            return Err(format!("{} is shown already", path.display()));
        }
        if self.list.len() == MAX_OTHERS {
            return Err(format!("at most {MAX_OTHERS} other drawings are shown: remove one"));
        }
        let (path, scene) = (path.to_owned(), Err(String::new()));
        let (is_shown, robots, modified) = (true, None, None);
        self.list.push(OtherDrawing { path, name, is_shown, registry, robots, modified, scene });
        self.placed_in = None;
        Ok(())
    }

    /// Reads what has changed, on the disk or in the map of the open file. Returns whether something has.
    pub(super) fn follow(&mut self, placed_in: PlacedIn, now_s: f64) -> bool {
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
                let read = read_scene(&other.path, &placed_in, &mut self.symbols);
                (other.scene, other.robots) = match read {
                    Ok((scene, routes)) => {
                        let registry = other.registry.as_deref();
                        let robots = registry.map(|registry| OtherRobots::begin(registry, routes));
                        (Ok(scene), robots)
                    }
                    Err(why) => (Err(why), None),
                };
            }
        }
        self.placed_in = Some(placed_in);
        is_changed
    }

    /// Takes the newest poses of the robots of systems that run, and lets go of those that are not shown.
    pub(super) fn follow_robots(&mut self, wake: &WakeCallback, now_s: f64) {
        for other in &mut self.list {
            if let Some(robots) = &mut other.robots {
                robots.follow(other.is_shown, wake, now_s);
            }
        }
    }

    /// The robots that are shown, each with the name of its drawing.
    pub(super) fn robots(&self) -> impl Iterator<Item = (&str, &ShownRobot, RobotPose)> {
        let shown = self.list.iter().filter(|other| other.is_shown);
        shown.flat_map(|other| {
            let robots = other.robots.iter().flat_map(OtherRobots::robots);
            robots.filter_map(|robot| Some((other.name.as_str(), robot, robot.pose?)))
        })
    }

    pub(super) fn shown(&self) -> impl Iterator<Item = (&str, &MapScene)> {
        let shown = self.list.iter().filter(|other| other.is_shown);
        shown.filter_map(|other| Some((other.name.as_str(), other.scene.as_ref().ok()?)))
    }

    /// The smallest area that has all that are shown.
    pub fn bounds(&self) -> Option<MapBounds> {
        self.shown().filter_map(|(_, scene)| scene.bounds()).reduce(MapBounds::union)
    }
}

/// The scene of a file, brought to the map of another one, and the routes of its robots.
fn read_scene(
    path: &Path,
    placed_in: &PlacedIn,
    symbols: &mut SymbolPictures,
) -> Result<(MapScene, OtherRoutes), String> {
    let reading = armor_robotfile::load(path);
    let Some(configuration) = reading.configuration else {
        return Err("the file cannot be read: open it, or run armor check".into());
    };
    let mission = configuration.mission.as_ref().ok_or("the file has no mission")?;
    let (scene, between) = scene_in(mission, placed_in, symbols)?;
    let followed = FollowedMission::of_mission(mission, &configuration.system);
    let robots = followed.robots().map(|(name, radius, output)| (name.to_owned(), radius, output));
    Ok((scene, OtherRoutes { robots: robots.collect(), between }))
}

fn scene_in(
    mission: &Mission,
    placed_in: &PlacedIn,
    symbols: &mut SymbolPictures,
) -> Result<(MapScene, Option<[MapPlacement; 2]>), String> {
    let map = mission.map.as_ref().ok_or("its mission has no map")?;
    let here = placed_in.placement.filter(|_| placed_in.has_map);
    let between = match (map.placement, here) {
        (Some(there), Some(here)) if there == here => None,
        (Some(there), Some(here)) => Some([there, here]),
        // As both robots begin at the same place, or nothing is drawn here yet.
        (None, None) => None,
        (Some(_), None) if !placed_in.has_map => None,
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
    let moved = |at: MapPoint| bring(between.as_ref(), at);
    let known = |at: MapPoint| moved(at).is_some();
    let points = map.points.iter().chain(&map.rallies).map(|point| point.position.value.point);
    if !points.into_iter().all(known) {
        return Err("it is too far away for this map".into());
    }
    let displaced = |_, at: MapPoint| moved(at).unwrap_or(at);
    Ok((MapScene::of(mission, &Marks::default(), symbols, &displaced), between))
}

/// A point of one map on another one; both are the same without placements.
pub(super) fn bring(between: Option<&[MapPlacement; 2]>, at: MapPoint) -> Option<MapPoint> {
    match between {
        None => Some(at),
        Some([there, here]) => here.map_from_geo(there.geo_from_map(at).ok()?).ok(),
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
        let shown = |text, symbols: &mut SymbolPictures| {
            scene_in(&mission(text), &placed(PARIS), symbols).expect("it is shown").0
        };
        let same = shown(PARIS, symbols);
        assert_eq!(point_in(&same), map_point([3.0, 4.0]));
        // There y points east, and x south.
        let turned = shown(TURNED, symbols);
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
