//! Copying and pasting what is drawn: through the clipboard as a file of its own, so that it works between
//! windows and files.

use std::collections::{BTreeMap, BTreeSet};

use armor_geo::MapPlacement;
use armor_robotfile::drawn_route::RouteStep;
use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item as Named, Mission, NewElement};

use crate::fragment::{copied as element_with, same_element};
use crate::item::Item;
use crate::map_view::camera::map_point;
use crate::map_view::edits::{
    NewRoute, add_route, append_steps, ensure_ends, map_of, names_of_steps, names_on_map,
};
use crate::map_view::movers::RouteDrivers;
use crate::map_view::position_text::{PositionStyle, ShapeText, is_geographic};
use crate::project::Refused;

/// The attributes by which a map is in the world.
const PLACEMENT: [&str; 2] = ["origin", "heading"];

/// What is selected as the text of a file: marks of the map with the points that selected legs lead to, and
/// the legs and stays; of a route that is selected, all of them and its start. Meetings stay out: their
/// other route is not copied. None if nothing of that is selected.
pub fn copied(
    document: &Document,
    mission: &Mission,
    selection: &BTreeSet<Item>,
) -> Option<String> {
    let mut marks: BTreeSet<&str> = BTreeSet::new();
    let mut routes: Vec<NewElement> = Vec::new();
    for route in &mission.routes {
        let name = route.name.value.as_str();
        let is_whole = selection.contains(&Item::route(name));
        let steps = route.steps.iter().filter(|step| {
            let is_selected = selection.contains(&Item::step(name, &step.name().value));
            (is_whole || is_selected) && !matches!(step, RouteStep::Meet(_))
        });
        let steps: Vec<_> = steps.collect();
        if steps.is_empty() {
            continue;
        }
        let mut new = NewElement::new("route").attribute("name", name);
        if let Some(start) = route.start.as_ref().filter(|_| is_whole) {
            marks.insert(&start.value);
            new = new.attribute("start", start.value.as_str());
        }
        for step in steps {
            if let RouteStep::Leg(leg) = step {
                marks.insert(&leg.to.value);
            }
            let step = Named::Step { route: name, step: &step.name().value };
            let element = document.tree().element(&document.find(step)?)?;
            new = new.child(same_element(element));
        }
        routes.push(new);
    }
    let map = document.find(Named::Map).and_then(|path| document.tree().element(&path));
    let mut symbols = 0;
    let is_copied = |element: &&Element| {
        let name = element.attribute("name").map_or("", |name| name.value.as_str());
        match element.name.as_str() {
            "point" => selection.contains(&Item::map_point(name)) || marks.contains(name),
            "rally" => selection.contains(&Item::rally(name)) || marks.contains(name),
            "zone" => selection.contains(&Item::zone(name)),
            "line" => selection.contains(&Item::map_line(name)),
            "symbol" => {
                symbols += 1;
                selection.contains(&Item::Symbol(symbols - 1))
            }
            _ => false,
        }
    };
    let children: Vec<_> = map.into_iter().flat_map(Element::elements).filter(is_copied).collect();
    if children.is_empty() && routes.is_empty() {
        return None;
    }
    let mut new = NewElement::new("map");
    for name in PLACEMENT {
        if let Some(value) = map.and_then(|map| map.attribute(name)) {
            new = new.attribute(name, value.value.as_str());
        }
    }
    let new = children.into_iter().map(same_element).fold(new, NewElement::child);
    let empty = b"<armor version=\"1\">\n  <mission>\n  </mission>\n</armor>\n";
    let mut file = Document::open("clipboard".as_ref(), empty).ok()?;
    let elements: Vec<_> = [new].into_iter().chain(routes).collect();
    file.add_elements(Named::Mission, &elements).ok()?;
    Some(std::str::from_utf8(file.bytes()).ok()?.to_owned())
}

/// Where a fragment is pasted.
#[derive(Clone, Copy, Debug)]
pub struct PasteTarget<'a> {
    /// Where the map of the file is in the world.
    pub placement: Option<&'a MapPlacement>,
    /// The route that single steps are added to.
    pub route: Option<&'a str>,
    /// What drives a new route.
    pub drivers: Option<&'a RouteDrivers>,
}

/// Adds a fragment; what is added gets names of its own, and lies where it was copied from: on the same
/// metres, or, if both maps have an origin, at the same place of the world. Returns what was added.
///
/// # Errors
/// If the text holds nothing of a map, or there is no route for its steps.
pub fn paste(
    document: &mut Document,
    text: &str,
    target: PasteTarget<'_>,
) -> Result<Vec<Item>, Refused> {
    let nothing = || Refused::Rule("the clipboard holds no part of a map".into());
    let source = Document::open("clipboard".as_ref(), text.as_bytes()).map_err(|_| nothing())?;
    let map = source.find(Named::Map).and_then(|path| source.tree().element(&path));
    let map = map.ok_or_else(nothing)?;
    let moves = Moves { from: placement_of(map), to: target.placement };
    map_of(document)?;
    let mut names = names_on_map(document);
    let mut renamed: BTreeMap<String, String> = BTreeMap::new();
    let (mut elements, mut added) = (Vec::new(), Vec::new());
    let symbols = count_symbols(document);
    for element in map.elements() {
        let old = element.attribute("name").map(|name| name.value.clone());
        let new = old
            .as_ref()
            .map(|old| names.free(old, old.trim_end_matches(|c: char| c.is_ascii_digit())));
        elements.push(moves.element(element, new.as_deref()));
        added.push(match (element.name.as_str(), &new) {
            ("point", Some(name)) => Item::map_point(name),
            ("rally", Some(name)) => Item::rally(name),
            ("zone", Some(name)) => Item::zone(name),
            ("line", Some(name)) => Item::map_line(name),
            _ => {
                let before = added.iter().filter(|item| matches!(item, Item::Symbol(_))).count();
                Item::Symbol(symbols + before)
            }
        });
        if let (Some(old), Some(new)) = (old, new) {
            renamed.insert(old, new);
        }
    }
    document.add_elements(Named::Map, &elements)?;
    let mission = source.find(Named::Mission).and_then(|path| source.tree().element(&path));
    let routes = mission.into_iter().flat_map(Element::elements);
    for route in routes.filter(|element| element.name == "route") {
        let start = route.attribute("start").and_then(|start| renamed.get(&start.value));
        let name = match (start, target.route, target.drivers) {
            (None, Some(route), _) => route.to_owned(),
            (start, _, Some(drivers)) => {
                let first =
                    route.elements().find_map(|step| renamed.get(&step.attribute("to")?.value));
                let start = start.or(first).ok_or_else(nothing)?;
                let out = ensure_ends(document)?;
                add_route(document, &NewRoute { drivers, start, out: &out })?
            }
            (_, _, None) => {
                return Err(Refused::Rule(
                    "a route needs a component that drives along it: add one of the kind patrol \
                     to the system"
                        .into(),
                ));
            }
        };
        let mut taken = names_of_steps(document, &name);
        let mut steps = Vec::new();
        for step in route.elements() {
            let old = step.attribute("name").map_or("l1", |name| name.value.as_str());
            let new = taken.free(old, old.trim_end_matches(|c: char| c.is_ascii_digit()));
            added.push(Item::step(&name, &new));
            let value = |attribute: &str, value: &str| {
                Some(match attribute {
                    "name" => new.clone(),
                    "to" => renamed.get(value).map_or(value, String::as_str).to_owned(),
                    _ => value.to_owned(),
                })
            };
            steps.push(element_with(step, value, |child| Some(same_element(child))));
        }
        append_steps(document, &name, &steps)?;
    }
    if added.is_empty() { Err(nothing()) } else { Ok(added) }
}

fn count_symbols(document: &Document) -> usize {
    let map = document.find(Named::Map).and_then(|path| document.tree().element(&path));
    let children = map.into_iter().flat_map(Element::elements);
    children.filter(|child| child.name == "symbol").count()
}

/// Where a copied map is in the world.
fn placement_of(map: &Element) -> Option<MapPlacement> {
    let mut alone = NewElement::new("map");
    for name in PLACEMENT {
        if let Some(value) = map.attribute(name) {
            alone = alone.attribute(name, value.value.as_str());
        }
    }
    // A mission is read only together with a system.
    let empty = b"<armor version=\"1\">\n  <system/>\n  <mission/>\n</armor>\n";
    let mut file = Document::open("clipboard".as_ref(), empty).ok()?;
    file.add_elements(Named::Mission, &[alone]).ok()?;
    let text = file.bytes().to_vec();
    let read = armor_robotfile::read("clipboard".as_ref(), &mut |_| Ok(text.clone()));
    read.configuration?.mission?.map?.placement
}

/// From the frame of one map to that of another.
struct Moves<'a> {
    from: Option<MapPlacement>,
    to: Option<&'a MapPlacement>,
}

impl Moves<'_> {
    /// The element under another name, its positions in metres where they are in the other map.
    fn element(&self, element: &Element, name: Option<&str>) -> NewElement {
        let value = |attribute: &str, value: &str| {
            Some(match (attribute, name) {
                ("name", Some(name)) => name.to_owned(),
                ("at", _) => self.position(value).unwrap_or_else(|| value.to_owned()),
                ("shape", _) => self.shape(value).unwrap_or_else(|| value.to_owned()),
                _ => value.to_owned(),
            })
        };
        element_with(element, value, |child| Some(same_element(child)))
    }

    /// A position in metres, in the other frame; none if it stays as it is written.
    fn metres(&self, x_m: f64, y_m: f64) -> Option<armor_geo::MapPoint> {
        let (from, to) = (self.from.as_ref()?, self.to?);
        if from == to || !(x_m.is_finite() && y_m.is_finite()) {
            return None;
        }
        to.map_from_geo(from.geo_from_map(map_point([x_m, y_m])).ok()?).ok()
    }

    fn position(&self, text: &str) -> Option<String> {
        if is_geographic(text) {
            return None;
        }
        let mut numbers = text.split_whitespace().map(str::parse::<f64>);
        let (x_m, y_m) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
        Some(PositionStyle { placement: None }.write(self.metres(x_m, y_m)?, " "))
    }

    fn shape(&self, text: &str) -> Option<String> {
        let mut changed = text.to_owned();
        for number in 0..ShapeText::new(text).count() {
            let shape = ShapeText::new(&changed);
            if shape.is_geographic(number) {
                continue;
            }
            let at = shape.corner_point(number, None)?;
            let at = self.metres(at.x_m(), at.y_m())?;
            changed =
                shape.with_corner(number, &PositionStyle { placement: None }.write(at, ","))?;
        }
        Some(changed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWN: &str = r#"<armor version="1">
  <system name="bench"><component name="way" kind="patrol"/></system>
  <mission goal="over" safe="hold">
    <map origin="48.8583 2.2945 35m">
      <point name="P1" at="0 0"/>
      <point name="P2" at="10 0"/>
      <zone name="yard" kind="no-go" shape="2,2 8,2 8,6 2,6"/>
      <symbol at="16 7" sidc="10031000131211000000"/>
    </map>
    <route name="red" mover="way.route" start="P1" out="over">
      <leg name="l1" to="P2" by="1min"/>
      <stay name="s1" for="2s"/>
      <leg name="l2" to="P1"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
  </mission>
</armor>
"#;

    fn mission(text: &str) -> Mission {
        let read = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(text.as_bytes().to_vec()));
        read.configuration.and_then(|it| it.mission).expect("it has a mission")
    }

    fn document(text: &str) -> Document {
        Document::open("a.xml".as_ref(), text.as_bytes()).expect("it is XML")
    }

    fn text(document: &Document) -> &str {
        std::str::from_utf8(document.bytes()).expect("it is text")
    }

    fn copy(selection: &[Item]) -> Option<String> {
        let selection = selection.iter().copied().collect();
        copied(&document(DRAWN), &mission(DRAWN), &selection)
    }

    fn drivers() -> RouteDrivers {
        RouteDrivers { mover: "way.route".into(), ..RouteDrivers::default() }
    }

    #[test]
    fn legs_are_pasted_with_their_points_each_as_one_line() {
        let clipboard = copy(&[Item::step("red", "l1"), Item::step("red", "s1")]).expect("a text");
        let mut target = document(DRAWN);
        let paste_into =
            PasteTarget { placement: None, route: Some("red"), drivers: Some(&drivers()) };
        let added = paste(&mut target, &clipboard, paste_into).expect("it is pasted");
        let expected = [Item::map_point("P3"), Item::step("red", "l3"), Item::step("red", "s2")];
        assert_eq!(added, expected);
        let new: Vec<_> =
            text(&target).lines().filter(|line| !DRAWN.lines().any(|old| old == *line)).collect();
        let lines = [
            r#"      <point name="P3" at="10 0"/>"#,
            r#"      <leg name="l3" to="P3" by="1min"/>"#,
            r#"      <stay name="s2" for="2s"/>"#,
        ];
        assert_eq!(new, lines);
    }

    #[test]
    fn a_whole_route_becomes_one_of_another_file_driven_by_what_it_has() {
        let clipboard = copy(&[Item::route("red"), Item::zone("yard"), Item::Symbol(0)]);
        let clipboard = clipboard.expect("a text");
        let mut target = document("<armor version=\"1\">\n  <system/>\n  <mission/>\n</armor>\n");
        let other = RouteDrivers { mover: "other.route".into(), ..RouteDrivers::default() };
        let paste_into = PasteTarget { placement: None, route: None, drivers: Some(&other) };
        paste(&mut target, &clipboard, paste_into).expect("it is pasted");
        let pasted = mission(text(&target));
        let route = &pasted.routes[0];
        assert_eq!(route.mover.component.value, "other");
        assert_eq!(route.start.as_ref().map(|it| it.value.as_str()), Some("P1"));
        assert_eq!(route.steps.len(), 3);
        let map = pasted.map.as_ref().expect("a map");
        assert_eq!((map.points.len(), map.zones.len(), map.symbols.len()), (2, 1, 1));
        let without = PasteTarget { placement: None, route: None, drivers: None };
        let refused = paste(&mut document(DRAWN), &clipboard, without).expect_err("no mover");
        assert!(refused.to_string().contains("kind patrol"), "{refused}");
    }

    #[test]
    fn between_two_maps_in_the_world_the_place_is_kept_and_not_the_metres() {
        let clipboard = copy(&[Item::map_point("P2"), Item::zone("yard")]).expect("a text");
        // The other map begins 10 m to the east, and its y axis points east.
        let here = mission(DRAWN).map.and_then(|it| it.placement).expect("a placement");
        let east = here.geo_from_map(map_point([10.0, 0.0])).expect("a position");
        let there = MapPlacement::new(east, std::f64::consts::FRAC_PI_2, 1.0).expect("a map");
        let mut target = document("<armor version=\"1\">\n  <system/>\n  <mission/>\n</armor>\n");
        let paste_into = PasteTarget { placement: Some(&there), route: None, drivers: None };
        paste(&mut target, &clipboard, paste_into).expect("it is pasted");
        let pasted = text(&target);
        assert!(pasted.contains(r#"<point name="P2" at="0 0"/>"#), "{pasted}");
        assert!(pasted.contains(r#"shape="-2,-8 -2,-2 -6,-2 -6,-8""#), "{pasted}");
    }

    #[test]
    fn what_is_no_part_of_a_map_is_refused() {
        assert_eq!(copy(&[Item::component("way")]), None);
        let target = PasteTarget { placement: None, route: None, drivers: None };
        for text in ["scrap", "<armor version=\"1\"><system/></armor>"] {
            let mut into = document(DRAWN);
            let refused = paste(&mut into, text, target).expect_err("it is none");
            assert!(refused.to_string().contains("no part of a map"), "{refused}");
            assert_eq!(text_of(&into), DRAWN);
        }
    }

    fn text_of(document: &Document) -> &str {
        text(document)
    }
}
