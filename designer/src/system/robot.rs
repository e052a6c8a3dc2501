//! A whole simulated robot, added in one step: its components with their links, under names that are
//! free, so that a second one is as quick as the first.

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item as Named, NewElement};
use armor_wire::manifest::{MANIFEST_VERSION, Manifest};
use eframe::egui::{Pos2, Rect};

use crate::fragment::{Fragment, same_element};
use crate::item::Item;
use crate::kinds::Kinds;
use crate::project::{Documents, Refused};
use crate::system::fragment::paste;
use crate::view::View;

/// What palettes call it. No kind has this name: it has a space.
pub(super) const ROBOT: &str = "simulated robot";
/// The robot, as a part of a file.
const TEXT: &str = include_str!("robot.xml");
/// Its kinds.
const KINDS: [&str; 6] = ["simulator", "grid-slam", "patrol", "planner", "driver", CHART];
/// What publishes the zones of the map: one for all robots.
const CHART: &str = "chart";
/// The parameter of its simulator that has no default.
const WORLD: &str = "world";

/// Its entry in the palette, if all of its kinds are known.
pub(super) fn entry(kinds: &Kinds) -> Option<Manifest> {
    KINDS.iter().all(|kind| kinds.find(kind).is_some()).then(|| Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind: ROBOT.into(),
        summary:
            "Simulator, mapper, patrol, planner, driver and the chart of the zones with their \
                  links: a robot that drives a route of the map. The first one gets a world in its \
                  simulator; further ones get the same, and share the chart."
                .into(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        parameters: Vec::new(),
        events: None,
        reports_done: false,
        ends_by_itself: false,
        needs_rate: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
        controllable: true,
        reads_all: false,
        protocol: None,
    })
}

/// Adds a robot. Its clock and its frames are those of the file, if the file has some; its simulator has the
/// world of the first one. Returns what was added.
///
/// # Errors
/// If there is no system to add it to.
pub fn add_robot(documents: &mut Documents, at: Pos2) -> Result<Vec<Item>, Refused> {
    let world = world_of(documents.system()?);
    let chart = chart_of(documents.system()?);
    let text = match &chart {
        Some(_) => without_chart(TEXT),
        None => TEXT.to_owned(),
    };
    let fragment = Fragment::read(&text, View::System)?;
    let mut added = paste(documents, &text, |_: Rect| at)?;
    let document = documents.system()?;
    if let Some(chart) = chart {
        let readers = added.iter().filter_map(|item| match item {
            Item::Component(name) => Some(name.as_str()),
            _ => None,
        });
        let readers =
            readers.filter(|name| ["planner", "driver"].iter().any(|kind| name.starts_with(kind)));
        let link = |reader| {
            let link = NewElement::new("link").attribute("from", format!("{chart}.zones"));
            link.attribute("to", format!("{reader}.zones"))
        };
        let links: Vec<_> = readers.map(link).collect();
        document.add_elements(Named::System, &links)?;
    }
    for (frame, name) in fragment.named("frame") {
        if document.find(Named::Frame(name)).is_none() {
            document.add_elements(Named::System, &[same_element(frame)])?;
        }
    }
    let simulator = added.iter().find_map(|item| match item {
        Item::Component(name) if name.as_str().starts_with(KINDS[0]) => Some(*name),
        _ => None,
    });
    if let Some(name) = simulator {
        if !has_clock(document) {
            let clock = NewElement::new("clock").attribute("source", format!("{name}.clock"));
            document.add_elements(Named::System, &[clock])?;
        }
        if let Some(world) = world {
            document.set_parameter(&name, WORLD, Some(&world))?;
        }
    }
    // What needs a value first is shown: the simulator.
    added.sort_by_key(
        |item| !matches!(item, Item::Component(name) if name.as_str().starts_with(KINDS[0])),
    );
    Ok(added)
}

fn elements_of(document: &Document) -> impl Iterator<Item = &Element> {
    let system = document.find(Named::System).and_then(|path| document.tree().element(&path));
    system.into_iter().flat_map(Element::elements)
}

/// The first component that publishes the zones.
fn chart_of(document: &Document) -> Option<String> {
    let is_chart =
        |element: &&Element| element.attribute("kind").is_some_and(|kind| kind.value == CHART);
    let mut charts = elements_of(document).filter(|it| it.name == "component").filter(is_chart);
    Some(charts.next()?.attribute("name")?.value.clone())
}

/// The robot without a chart of its own: each element of it is one line.
fn without_chart(text: &str) -> String {
    let is_other = |line: &&str| !line.contains(&format!("\"{CHART}"));
    text.lines().filter(is_other).flat_map(|line| [line, "\n"]).collect()
}

fn has_clock(document: &Document) -> bool {
    elements_of(document).any(|element| element.name == "clock")
}

/// The world of the first simulator that has one.
fn world_of(document: &Document) -> Option<String> {
    let is_simulator =
        |element: &&Element| element.attribute("kind").is_some_and(|kind| kind.value == KINDS[0]);
    elements_of(document).filter(is_simulator).find_map(|simulator| {
        let parameters = simulator.elements().filter(|element| element.name == "parameter");
        let mut worlds = parameters.filter(|parameter| {
            parameter.attribute("name").is_some_and(|name| name.value == WORLD)
        });
        Some(worlds.next()?.attribute("value")?.value.clone())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Project;

    #[test]
    fn a_second_robot_has_names_of_its_own_and_the_world_and_clock_of_the_first() {
        let mut project = Project::new(std::sync::Arc::default());
        project
            .edit("two robots", |documents| {
                add_robot(documents, Pos2::ZERO)?;
                documents.system()?.set_parameter("simulator", WORLD, Some("office.svg"))?;
                add_robot(documents, Pos2::new(0.0, 400.0)).map(drop)
            })
            .expect("they are added");
        let system = &project.configuration().expect("it is read").system;
        let names: Vec<_> = system.components.iter().map(|it| it.name.value.as_str()).collect();
        assert_eq!(names.len(), 11, "one chart for both: {names:?}");
        assert!(names.contains(&"simulator-2") && names.contains(&"driver-2"), "{names:?}");
        assert_eq!((system.links.len(), system.frames.len()), (28, 1));
        let zones = system.links.iter().filter(|link| link.from.component.value == "chart");
        let zones: Vec<_> = zones.map(|link| link.to.component.value.as_str()).collect();
        assert_eq!(zones, ["planner", "driver", "planner-2", "driver-2"]);
        let clock = system.clock.as_ref().map(|it| it.source.component.value.as_str());
        assert_eq!(clock, Some("simulator"));
        let second = system.component("simulator-2").expect("the second simulator");
        let world = second.parameters.iter().find(|it| it.name.value == WORLD);
        assert_eq!(world.map(|it| it.value.value.as_str()), Some("office.svg"));
        project.undo();
        assert!(project.configuration().is_none_or(|it| it.system.components.is_empty()));
    }
}
