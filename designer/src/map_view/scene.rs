//! What is drawn on the map, as data: a model of the file becomes items with positions and texts,
//! from back to front. Nothing here knows the window.

use std::sync::Arc;

use armor_geo::{MapArea, MapPoint};
use armor_robotfile::Mission;
use armor_robotfile::drawn_route::{DrawnRoute, RouteStep};
use armor_robotfile::site_map::{DrawnZone, LineKind, SiteMap, ZoneKind};

use crate::canvas::Mark;
use crate::item::Item;
use crate::map_view::camera::{MapBounds, map_point};
use crate::map_view::corner::Corner;
use crate::map_view::scene_exits::{ExitTargets, SceneExit};
use crate::map_view::symbol_picture::{SymbolPicture, SymbolPictures};
use crate::mission::marks::Marks;

/// Sides of the polygon that stands for a circle.
const CIRCLE_SIDES: usize = 64;

/// Everything that is drawn.
#[derive(Default)]
pub struct MapScene {
    /// From back to front.
    pub items: Vec<SceneItem>,
    /// Where robots go when a step ends early.
    pub exits: Vec<SceneExit>,
}

/// One item of the map.
pub struct SceneItem {
    /// Which one.
    pub item: Item,
    /// What it looks like, and where.
    pub shape: SceneShape,
    /// The text next to it.
    pub text: String,
    /// Its name for screen readers and tests.
    pub label: String,
    /// What else there is to know of it.
    pub doc: String,
    /// The most severe finding of it.
    pub mark: Mark,
}

/// What an item looks like.
pub enum SceneShape {
    /// An area with a meaning.
    Zone {
        /// What it means.
        kind: ZoneKind,
        /// Its boundary.
        outline: Outline,
    },
    /// A line with a meaning.
    Line {
        /// What it means.
        kind: LineKind,
        /// Its points.
        points: Vec<MapPoint>,
    },
    /// A drive to a point; from where is unknown of a first leg without `start`.
    Leg {
        /// Where it begins.
        from: Option<MapPoint>,
        /// Where it ends.
        to: MapPoint,
    },
    /// A stay or a meeting at a point, beneath others there.
    Stop {
        /// Where.
        at: MapPoint,
        /// How many others are above it.
        row: usize,
    },
    /// A point that routes lead to.
    Point(MapPoint),
    /// A point where robots go when something fails.
    Rally(MapPoint),
    /// A military symbol.
    Symbol {
        /// Where.
        at: MapPoint,
        /// Its drawing; none if its code means nothing.
        picture: Option<Arc<SymbolPicture>>,
    },
}

/// The boundary of a zone.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// Its corners.
    Polygon(Vec<MapPoint>),
    /// A circle.
    Circle {
        /// Its centre.
        centre: MapPoint,
        /// Its radius.
        radius_m: f64,
    },
}

/// Where a position is shown while it is being dragged.
pub type Displaced<'a> = &'a dyn Fn(Corner, MapPoint) -> MapPoint;

impl MapScene {
    /// Draws the map and the routes of a mission.
    pub fn of(
        mission: &Mission,
        marks: &Marks,
        symbols: &mut SymbolPictures,
        displaced: Displaced<'_>,
    ) -> Self {
        let mut scene = Self::default();
        let Some(map) = &mission.map else { return scene };
        scene.add_areas(map, marks, displaced);
        let mut points = map.points.iter().chain(&map.rallies);
        let is_still = points.all(|point| {
            let drawn = point.position.value.point;
            find_shown(map, &point.name.value, displaced).is_none_or(|shown| shown == drawn)
        });
        let exits = ExitTargets::of(mission, is_still);
        for route in &mission.routes {
            scene.add_route(route, &exits, map, marks, displaced);
        }
        scene.add_points(map, marks, symbols, displaced);
        scene
    }

    /// The item's entry.
    pub fn find(&self, item: Item) -> Option<&SceneItem> {
        self.items.iter().find(|entry| entry.item == item)
    }

    /// The smallest area that has everything.
    pub fn bounds(&self) -> Option<MapBounds> {
        self.items.iter().filter_map(|item| item.shape.bounds()).reduce(MapBounds::union)
    }

    fn push(&mut self, item: Item, shape: SceneShape, text: String, label: String, marks: &Marks) {
        let doc = marks.messages(&item).trim_start().to_owned();
        self.items.push(SceneItem { item, shape, text, label, doc, mark: marks.mark(&item) });
    }

    fn add_areas(&mut self, map: &SiteMap, marks: &Marks, displaced: Displaced<'_>) {
        for zone in &map.zones {
            let item = Item::zone(&zone.name.value);
            let kind = word_of(&ZoneKind::NAMED, zone.kind);
            let text = match &zone.speed_mps {
                Some(speed) => {
                    format!("{} ({kind}, {})", zone.name.value, quantity_words(speed.at.text()))
                }
                None => format!("{} ({kind})", zone.name.value),
            };
            let outline = outline_of(zone, item, displaced);
            let shape = SceneShape::Zone { kind: zone.kind, outline };
            self.push(item, shape, text, format!("zone {}", zone.name.value), marks);
        }
        for line in &map.lines {
            let item = Item::map_line(&line.name.value);
            let kind = word_of(&LineKind::NAMED, line.kind);
            let points = line.shape.value.points().iter().enumerate();
            let points = points.map(|(number, at)| displaced(Corner { item, number }, *at));
            let shape = SceneShape::Line { kind: line.kind, points: points.collect() };
            let text = format!("{} ({kind})", line.name.value);
            self.push(item, shape, text, format!("line {}", line.name.value), marks);
        }
    }

    fn add_route(
        &mut self,
        route: &DrawnRoute,
        exits: &ExitTargets<'_>,
        map: &SiteMap,
        marks: &Marks,
        displaced: Displaced<'_>,
    ) {
        let find = |name: &str| find_shown(map, name, displaced);
        let name = &route.name.value;
        let mut position = route.start.as_ref().and_then(|start| find(&start.value));
        let mut stops: Vec<MapPoint> = Vec::new();
        for (number, step) in route.steps.iter().enumerate() {
            let of = Item::step(name, &step.name().value);
            let text = format!("{}. {}", number + 1, describe_step(step));
            let before = position;
            let (sort, shape) = match step {
                RouteStep::Leg(leg) => {
                    let Some(to) = find(&leg.to.value) else {
                        position = None;
                        continue;
                    };
                    position = Some(to);
                    ("leg", SceneShape::Leg { from: before, to })
                }
                RouteStep::Stay(_) | RouteStep::Meet(_) => {
                    let Some(at) = position else { continue };
                    let row = stops.iter().filter(|other| **other == at).count();
                    stops.push(at);
                    let is_stay = matches!(step, RouteStep::Stay(_));
                    (if is_stay { "stay" } else { "meeting" }, SceneShape::Stop { at, row })
                }
            };
            let label = format!("{sort} {} of route {name}", step.name().value);
            self.push(of, shape, text, label, marks);
            let Some(end) = position else { continue };
            let start = before.unwrap_or(end);
            for target in exits.of_step(name, &step.name().value) {
                let Some(to) = find(target) else { continue };
                let from = if start.distance_m(to) > end.distance_m(to) { start } else { end };
                let around = exits.around(name, &step.name().value, target);
                let points = around.map_or_else(|| vec![from, to], <[MapPoint]>::to_vec);
                self.exits.push(SceneExit { of, points });
            }
        }
    }

    fn add_points(
        &mut self,
        map: &SiteMap,
        marks: &Marks,
        symbols: &mut SymbolPictures,
        displaced: Displaced<'_>,
    ) {
        for (number, symbol) in map.symbols.iter().enumerate() {
            let item = Item::Symbol(number);
            let at = displaced(Corner { item, number: 0 }, symbol.position.value.point);
            let picture = symbols.find(&symbol.sidc.value);
            let name = picture.as_ref().map_or("Unknown", |picture| picture.name);
            let text = symbol.label.as_ref().map_or("", |label| label.value.as_str()).to_owned();
            let label = match text.as_str() {
                "" => format!("symbol {}: {name}", number + 1),
                text => format!("symbol {}: {name} {text}", number + 1),
            };
            self.push(item, SceneShape::Symbol { at, picture }, text, label, marks);
        }
        for (points, is_rally) in [(&map.points, false), (&map.rallies, true)] {
            for point in points {
                let name = &point.name.value;
                let (item, label) = match is_rally {
                    false => (Item::map_point(name), format!("point {name}")),
                    true => (Item::rally(name), format!("rally point {name}")),
                };
                let at = displaced(Corner { item, number: 0 }, point.position.value.point);
                let shape = if is_rally { SceneShape::Rally(at) } else { SceneShape::Point(at) };
                self.push(item, shape, name.clone(), label, marks);
            }
        }
    }
}

impl SceneShape {
    /// The positions that it is drawn through.
    pub fn points(&self) -> Vec<MapPoint> {
        match self {
            Self::Zone { outline, .. } => outline.corners(),
            Self::Line { points, .. } => points.clone(),
            Self::Leg { from, to } => from.iter().copied().chain([*to]).collect(),
            Self::Stop { at, .. } | Self::Symbol { at, .. } | Self::Point(at) | Self::Rally(at) => {
                vec![*at]
            }
        }
    }

    /// The smallest area that has it.
    pub fn bounds(&self) -> Option<MapBounds> {
        MapBounds::of(self.points())
    }
}

impl Outline {
    /// Whether it is a circle.
    pub fn is_circle(&self) -> bool {
        matches!(self, Self::Circle { .. })
    }

    /// Its corners; those of a polygon for a circle.
    pub fn corners(&self) -> Vec<MapPoint> {
        match self {
            Self::Polygon(corners) => corners.clone(),
            Self::Circle { centre, radius_m } => {
                let corner = |number: usize| {
                    let angle = std::f64::consts::TAU * number as f64 / CIRCLE_SIDES as f64;
                    let (sin, cos) = angle.sin_cos();
                    map_point([centre.x_m() + radius_m * cos, centre.y_m() + radius_m * sin])
                };
                (0..CIRCLE_SIDES).map(corner).collect()
            }
        }
    }
}

/// The positions of an item that can be dragged one by one: corners, and of a circle its centre and
/// a point of its boundary, which is number 1.
pub fn handles_of(shape: &SceneShape) -> Vec<MapPoint> {
    match shape {
        SceneShape::Zone { outline: Outline::Circle { centre, radius_m }, .. } => {
            vec![*centre, map_point([centre.x_m() + radius_m, centre.y_m()])]
        }
        SceneShape::Zone { outline: Outline::Polygon(corners), .. } => corners.clone(),
        SceneShape::Line { points, .. } => points.clone(),
        _ => Vec::new(),
    }
}

/// Where a new corner can be drawn out of the boundary: the middles of its sides, with the number
/// that the corner gets.
pub fn new_corners_of(shape: &SceneShape) -> Vec<(usize, MapPoint)> {
    let (points, is_closed) = match shape {
        SceneShape::Zone { outline: Outline::Polygon(corners), .. } => (corners, true),
        SceneShape::Line { points, .. } => (points, false),
        _ => return Vec::new(),
    };
    let sides = points.len() - usize::from(!is_closed && !points.is_empty());
    let middle = |number: usize| {
        let (one, other) = (points[number], points[(number + 1) % points.len()]);
        (number + 1, between(one, other, 0.5))
    };
    (0..sides).map(middle).collect()
}

/// The position at this share of the way from one to the other.
pub fn between(one: MapPoint, other: MapPoint, share: f64) -> MapPoint {
    let mix = |from: f64, to: f64| from + (to - from) * share;
    map_point([mix(one.x_m(), other.x_m()), mix(one.y_m(), other.y_m())])
}

fn outline_of(zone: &DrawnZone, item: Item, displaced: Displaced<'_>) -> Outline {
    match &zone.area.value {
        MapArea::Polygon(polygon) => {
            let corners = polygon.corners().iter().enumerate();
            let corners = corners.map(|(number, at)| displaced(Corner { item, number }, *at));
            Outline::Polygon(corners.collect())
        }
        MapArea::Circle(circle) => {
            let centre = circle.centre();
            let radius_m = circle.radius().metres();
            let rim = map_point([centre.x_m() + radius_m, centre.y_m()]);
            let shown_rim = displaced(Corner { item, number: 1 }, rim);
            let shown = displaced(Corner { item, number: 0 }, centre);
            // A rim that is dragged changes the radius; a centre takes the rim along.
            let is_resized = shown == centre && shown_rim != rim;
            let radius_m = if is_resized { centre.distance_m(shown_rim) } else { radius_m };
            Outline::Circle { centre: shown, radius_m }
        }
    }
}

/// A point or rally point where it is shown.
fn find_shown(map: &SiteMap, name: &str, displaced: Displaced<'_>) -> Option<MapPoint> {
    let named = |points: &[armor_robotfile::site_map::DrawnPoint]| {
        let found = points.iter().find(|point| point.name.value == name);
        found.map(|point| point.position.value.point)
    };
    let as_point = named(&map.points).map(|at| (Item::map_point(name), at));
    let found = as_point.or_else(|| named(&map.rallies).map(|at| (Item::rally(name), at)));
    found.map(|(item, at)| displaced(Corner { item, number: 0 }, at))
}

/// A step in a few words: `l1 → door, 0.9m/s`.
fn describe_step(step: &RouteStep) -> String {
    match step {
        RouteStep::Leg(leg) => match &leg.speed {
            Some(speed) => format!("{} ({})", leg.name.value, quantity_words(&speed.value)),
            None => leg.name.value.clone(),
        },
        RouteStep::Stay(stay) => match (&stay.duration, &stay.on) {
            (Some(time), _) => {
                format!("{}: {}", stay.name.value, armor_proof::time_in_words(time.value))
            }
            (None, Some(on)) => {
                format!("{}: until {}.{}", stay.name.value, on.component.value, on.port.value)
            }
            (None, None) => stay.name.value.clone(),
        },
        RouteStep::Meet(meet) => format!("{}: meets {}", meet.name.value, meet.with.value),
    }
}

/// A quantity of the file with a space before its unit: `0.5 m/s`.
fn quantity_words(text: &str) -> String {
    let text = text.trim();
    match text.find(|c: char| c.is_ascii_alphabetic()) {
        Some(unit) if unit > 0 => format!("{} {}", text[..unit].trim_end(), &text[unit..]),
        _ => text.to_owned(),
    }
}

/// The word of a kind in the file.
pub fn word_of<T: PartialEq>(named: &[(&'static str, T)], kind: T) -> &'static str {
    named.iter().find(|(_, known)| *known == kind).map_or("", |(word, _)| word)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWN: &str = "<armor version=\"1\"><system name=\"s\"><component name=\"way\" \
        kind=\"patrol\"/></system><mission goal=\"over\" safe=\"hold\"><map>\
        <point name=\"P1\" at=\"0 0\"/><point name=\"P2\" at=\"10 0\"/><rally name=\"R1\" at=\"-1 0\"/>\
        <zone name=\"well\" kind=\"observe\" shape=\"circle 14,4 1m\"/></map>\
        <route name=\"red\" mover=\"way.route\" start=\"P1\" out=\"over\"><leg name=\"l1\" to=\"P2\"/>\
        <stay name=\"s1\" for=\"2s\"/><stay name=\"s2\" for=\"90s\"/><leg name=\"l2\" to=\"P1\"/>\
        <otherwise on=\"blocked\" do=\"rally\"/></route><place name=\"over\"/><place name=\"hold\"/>\
        </mission></armor>";

    fn at(x_m: f64, y_m: f64) -> MapPoint {
        map_point([x_m, y_m])
    }

    fn scene(displaced: Displaced<'_>) -> MapScene {
        let read = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(DRAWN.as_bytes().to_vec()));
        let mission = read.configuration.and_then(|it| it.mission).expect("a mission");
        MapScene::of(&mission, &Marks::default(), &mut SymbolPictures::default(), displaced)
    }

    #[test]
    fn steps_are_drawn_in_order_and_each_exit_from_the_point_farthest_from_its_end() {
        let scene = scene(&|_, at| at);
        let labels: Vec<_> = scene.items.iter().map(|entry| entry.label.as_str()).collect();
        let expected = [
            "zone well",
            "leg l1 of route red",
            "stay s1 of route red",
            "stay s2 of route red",
            "leg l2 of route red",
            "point P1",
            "point P2",
            "rally point R1",
        ];
        assert_eq!(labels, expected);
        assert_eq!(scene.items[3].text, "3. s2: 1 min 30 s");
        assert!(matches!(scene.items[3].shape, SceneShape::Stop { row: 1, .. }));
        let exit = scene.exits.iter().find(|exit| exit.of == Item::step("red", "l1"));
        let exit = exit.expect("the leg has an exit");
        assert_eq!(exit.points, [at(10.0, 0.0), at(-1.0, 0.0)]);
        assert_eq!(scene.bounds(), MapBounds::of([at(-1.0, 0.0), at(15.0, 5.0), at(15.0, 3.0)]));
    }

    #[test]
    fn legs_and_exits_follow_a_point_while_it_is_dragged() {
        let item = Item::map_point("P2");
        let scene = scene(&|corner, there| if corner.item == item { at(5.0, 5.0) } else { there });
        let leg = scene.find(Item::step("red", "l2")).expect("the leg back");
        let SceneShape::Leg { from, to } = leg.shape else { panic!("a leg is one") };
        assert_eq!((from, to), (Some(at(5.0, 5.0)), at(0.0, 0.0)));
        assert!(scene.exits.iter().any(|exit| exit.points[0] == at(5.0, 5.0)));
    }

    #[test]
    fn the_boundary_of_a_circle_sizes_it_and_its_centre_moves_it() {
        let item = Item::zone("well");
        let moved = |number, to: MapPoint| {
            let scene = scene(&|corner, there| {
                if corner == (Corner { item, number }) { to } else { there }
            });
            let entry = scene.find(item).expect("the zone");
            let SceneShape::Zone { outline, .. } = &entry.shape else { panic!("a zone is one") };
            outline.clone()
        };
        let centre = at(14.0, 4.0);
        assert_eq!(moved(1, at(17.0, 4.0)), Outline::Circle { centre, radius_m: 3.0 });
        let centre = at(1.0, 1.0);
        assert_eq!(moved(0, centre), Outline::Circle { centre, radius_m: 1.0 });
    }
}
