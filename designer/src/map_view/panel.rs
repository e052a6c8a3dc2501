//! The panel at the right: what is selected on the map, in numbers and words. What is typed takes
//! effect when the field is left.

use std::collections::HashMap;

use armor_geo::MapPoint;
use armor_robotfile::drawn_route::{DrawnRoute, ExitAction, RouteStep};
use armor_robotfile::site_map::{LineKind, SiteMap, ZoneKind};
use armor_robotfile::tree::Element;
use armor_robotfile::{Item as Named, Mission};
use armor_symbols::Symbol;
use eframe::egui::{self, RichText};

use crate::item::Item;
use crate::map_view::actions::legs_to;
use crate::map_view::model::mission_of;
use crate::map_view::painting::length_text;
use crate::mission::changes::Change;
use crate::mission::form::{Form, given, is_date, is_guard, is_name, is_time, row};
use crate::mission::marks::Marks;
use crate::mission::panel::parts::{PanelRequest, go_to, section, show_finding};
use crate::panels::fields::anything;
use crate::workspace::Workspace;

/// An attribute of an item as a field: its name in the file, its name and its explanation here, and
/// what its text must be.
type FieldRow = (&'static str, &'static str, &'static str, fn(&str) -> Result<(), String>);

const POINT: &[FieldRow] = &[(
    "at",
    "position",
    "Metres x and y, such as 12.5 4, or latitude and longitude, such as 48.8583N 2.2945E",
    anything,
)];
const ZONE: &[FieldRow] = &[
    ("margin", "margin", "The distance that robots keep from its boundary: 2m", anything),
    ("speed", "highest speed", "In a zone of the kind speed: 0.5m/s", anything),
    ("shape", "corners", "3,4 9,4 9,8, or circle 5,6 3m", anything),
];
const LINE: &[FieldRow] = &[
    ("margin", "margin", "The distance before it at which robots wait: 2m", anything),
    ("not-before", "not before", "No robot crosses a phase line before this date", is_date),
    ("shape", "points", "0,20 60,22", anything),
];
const SYMBOL: &[FieldRow] = &[
    ("sidc", "code", "20 digits, or the 15 letters of an older code", anything),
    ("label", "text", "The text next to it", anything),
    POINT[0],
];
const LEG: &[FieldRow] = &[
    ("way", "way", "Empty: any free path; straight: along the line", is_way),
    ("speed", "speed", "0.5m/s", anything),
    ("by", "takes at most", "Then it is late: 2min", is_time),
    ("not-before", "not before", "The robot does not continue before this date", is_date),
    ("not-after", "not after", "The robot is late if it has not arrived at this date", is_date),
    ("components", "components", "Active on it, in addition to those of the route", anything),
];
const STAY: &[FieldRow] = &[
    ("for", "time", "How long it stays: 30s", is_time),
    ("on", "until report", "The report that ends it: camera.done", anything),
    ("components", "components", "Active during it", anything),
];
const MEET: &[FieldRow] = &[
    ("with", "with route", "The other route", anything),
    ("patience", "patience", "How long it waits; then it is late", is_time),
];
const ROUTE: &[FieldRow] = &[
    ("mover", "mover", "The parameter that takes the point of a leg: way.route", anything),
    ("pace", "pace", "The parameter that sets the speed: driver.speed", anything),
    ("pose", "pose", "The output with the robot's pose: mapper.pose", anything),
    ("fence", "fence", "The component that reports a breach of a zone", anything),
    ("start", "start", "The point where the robot is at first", anything),
    (
        "in",
        "begins at",
        "The place that begins it; without one it begins with the mission",
        anything,
    ),
    ("out", "leads to", "The place that it leads to", anything),
    ("safe", "safe place", "Where a robot goes that cannot continue", anything),
    ("radius", "robot's radius", "Added to every margin: 0.25m", anything),
    ("patience", "patience", "How long it waits at a rally point to be resumed", is_time),
    ("rally-by", "rally takes at most", "How long the drive to a rally point may take", is_time),
    ("tolerance", "tolerance", "By how much a drive may differ from its speed: 20%", anything),
    ("endurance", "battery lasts", "From the beginning of the route: 40min", is_time),
    ("components", "components", "Active on every leg", anything),
];
const MAP: &[FieldRow] = &[
    (
        "origin",
        "origin",
        "Latitude, longitude, height of the point 0 0: 48.8583 2.2945 35m",
        anything,
    ),
    ("heading", "heading", "The direction of its y axis, clockwise from north: 12deg", anything),
    ("picture", "picture", "The file of the picture under the drawing", anything),
    ("grid", "grid", "The file of what is free and occupied", anything),
];

fn is_way(text: &str) -> Result<(), String> {
    match text.trim() {
        "" | "free" | "straight" => Ok(()),
        _ => Err("free or straight is expected".into()),
    }
}

/// Examples of what the fields of the map take.
const MAP_HINTS: [&str; 4] = ["48.8583 2.2945 35m", "12deg", "site.png", "site.yaml"];

/// Shows what is selected. Returns the requests of the user apart from changes.
pub fn show(
    ui: &mut egui::Ui,
    workspace: &Workspace,
    marks: &Marks,
    selected: &[Item],
    form: &mut Form,
) -> Vec<PanelRequest> {
    let mut requests = Vec::new();
    let Some(mission) = mission_of(workspace) else {
        ui.weak("This file has no mission yet: what is drawn on the map begins one.");
        return requests;
    };
    let mut panel = MapPanel { workspace, mission, form, requests: &mut requests };
    match selected {
        [] => panel.show_whole(ui),
        [item] => {
            panel.show_item(ui, *item);
            let mut found = marks.found(item).peekable();
            if found.peek().is_some() {
                section(ui, "Findings");
            }
            for finding in found {
                show_finding(ui, finding, &workspace.project, &mut requests);
            }
        }
        many => {
            ui.heading(format!("{} items selected", many.len()));
            ui.label("Drag or Shift and an arrow key moves them, Delete removes them.");
        }
    }
    requests
}

struct MapPanel<'a> {
    workspace: &'a Workspace,
    mission: &'a Mission,
    form: &'a mut Form,
    requests: &'a mut Vec<PanelRequest>,
}

impl<'a> MapPanel<'a> {
    fn show_item(&mut self, ui: &mut egui::Ui, item: Item) {
        self.form.of(item);
        match item {
            Item::MapPoint(_) => {
                self.show_named(ui, item, "Point", "name of the point");
                self.show_rows(ui, item, POINT);
                self.show_uses(ui, item);
            }
            Item::Rally(_) => {
                self.show_named(ui, item, "Rally point", "name of the rally point");
                self.show_rows(ui, item, POINT);
                self.show_uses(ui, item);
            }
            Item::Zone(_) => {
                self.show_named(ui, item, "Zone", "name of the zone");
                self.show_kind(ui, item, "kind of zone", &ZoneKind::NAMED.map(|(word, _)| word));
                self.show_rows(ui, item, ZONE);
            }
            Item::MapLine(_) => {
                self.show_named(ui, item, "Line", "name of the line");
                self.show_kind(ui, item, "kind of line", &LineKind::NAMED.map(|(word, _)| word));
                self.show_rows(ui, item, LINE);
            }
            Item::Symbol(number) => self.show_symbol(ui, item, number),
            Item::Route(name) => {
                self.show_named(ui, item, "Route", "name of the route");
                self.show_rows(ui, item, ROUTE);
                if let Some(route) = self.route(&name) {
                    self.show_exits(ui, item, route);
                    self.show_steps(ui, route);
                }
            }
            Item::Step { route, step } => self.show_step(ui, item, &route, &step),
            _ => {}
        }
    }

    /// The map as a whole: where it is in the world, its pictures, its routes.
    fn show_whole(&mut self, ui: &mut egui::Ui) {
        ui.heading("Map");
        self.form.of("map");
        let value = |name| {
            let document = self.workspace.project.document_with(Named::Map)?;
            let map = document.tree().element(&document.find(Named::Map)?)?;
            Some(map.attribute(name)?.value.clone())
        };
        let values: Vec<_> = MAP.iter().map(|(name, ..)| value(name)).collect();
        for (((attribute, name, doc, judge), value), hint) in MAP.iter().zip(values).zip(MAP_HINTS)
        {
            let value = value.unwrap_or_default();
            row(ui, &capitalized(name), doc, |ui| {
                self.form.hinted(ui, name, hint, &value, judge, |text| {
                    Some(Change::Map(attribute, given(text)))
                });
            });
        }
        section(ui, "Routes");
        let points = points_by_name(self.mission.map.as_ref());
        for route in &self.mission.routes {
            let item = Item::route(&route.name.value);
            let length = route_length_m(route, &points);
            let text = match length {
                Some(length_m) => format!("{} ({})", item, length_text(length_m)),
                None => item.to_string(),
            };
            go_to(ui, &text, item, self.requests);
        }
        if self.mission.routes.is_empty() {
            ui.weak("none: the tool Leg begins one");
        }
    }

    fn show_named(&mut self, ui: &mut egui::Ui, item: Item, heading: &str, label: &str) {
        ui.heading(heading);
        let name = self.value(item, "name");
        row(ui, "Name", "The name by which others refer to it.", |ui| {
            self.form.line(ui, label, &name, &is_name, |text| {
                Some(Change::Rename(item, text.trim().to_owned()))
            });
        });
    }

    fn show_rows(&mut self, ui: &mut egui::Ui, item: Item, rows: &[FieldRow]) {
        for (attribute, name, doc, judge) in rows {
            let value = self.value(item, attribute);
            row(ui, &capitalized(name), doc, |ui| {
                self.form.line(ui, name, &value, judge, |text| {
                    Some(match item {
                        Item::Symbol(number) => Change::Symbol(number, attribute, given(text)),
                        item => Change::Attribute(item, attribute, given(text)),
                    })
                });
            });
        }
    }

    fn show_kind(&mut self, ui: &mut egui::Ui, item: Item, label: &str, words: &[&'static str]) {
        let value = self.value(item, "kind");
        let choices: Vec<_> =
            words.iter().map(|word| ((*word).to_owned(), (*word).to_owned())).collect();
        row(ui, "Kind", "What it means.", |ui| {
            self.form.choice(ui, label, &value, &choices, |word| {
                Change::Attribute(item, "kind", Some(word.clone()))
            });
        });
    }

    fn show_symbol(&mut self, ui: &mut egui::Ui, item: Item, number: usize) {
        ui.heading("Symbol");
        let code = self.value(item, "sidc");
        match Symbol::parse(&code) {
            Ok(symbol) => {
                ui.label(symbol.name());
                for finding in symbol.findings() {
                    ui.label(RichText::new(finding.to_string()).weak().small());
                }
            }
            Err(error) => {
                ui.label(RichText::new(error.to_string()).weak().small());
            }
        }
        self.show_rows(ui, Item::Symbol(number), SYMBOL);
    }

    fn show_step(&mut self, ui: &mut egui::Ui, item: Item, route: &str, step: &str) {
        let drawn = self.route(route);
        let found = drawn.and_then(|it| it.steps.iter().find(|it| it.name().value == step));
        match found {
            Some(RouteStep::Leg(leg)) => {
                self.show_named(ui, item, "Leg", "name of the leg");
                self.show_target(ui, item, &leg.to.value);
                self.show_rows(ui, item, LEG);
            }
            Some(RouteStep::Stay(_)) => {
                self.show_named(ui, item, "Stay", "name of the stay");
                self.show_rows(ui, item, STAY);
            }
            Some(RouteStep::Meet(_)) => {
                self.show_named(ui, item, "Meeting", "name of the meeting");
                self.show_rows(ui, item, MEET);
            }
            None => {}
        }
        section(ui, "Route");
        go_to(ui, &format!("route {route}"), Item::route(route), self.requests);
        if let Some(drawn) = drawn {
            self.show_steps(ui, drawn);
        }
    }

    /// The point that a leg leads to, as a choice.
    fn show_target(&mut self, ui: &mut egui::Ui, item: Item, to: &str) {
        let points = self.mission.map.iter().flat_map(|map| map.points.iter().chain(&map.rallies));
        let choices: Vec<_> =
            points.map(|point| (point.name.value.clone(), point.name.value.clone())).collect();
        row(ui, "To", "The point that it leads to.", |ui| {
            self.form.choice(ui, "point of the leg", &to.to_owned(), &choices, |name| {
                Change::Attribute(item, "to", Some(name.clone()))
            });
        });
    }

    /// The steps of a route in order, with the length of each leg.
    fn show_steps(&mut self, ui: &mut egui::Ui, route: &DrawnRoute) {
        section(ui, "Steps");
        let mut position = route.start.as_ref().and_then(|start| self.point(&start.value));
        for (number, step) in route.steps.iter().enumerate() {
            let mut text = format!("{}. {}", number + 1, step.name().value);
            if let RouteStep::Leg(leg) = step {
                let end = self.point(&leg.to.value);
                text += &format!(" to {}", leg.to.value);
                if let Some((from, to)) = position.zip(end) {
                    text += &format!(", {}", length_text(from.distance_m(to)));
                }
                position = end;
            }
            go_to(ui, &text, Item::step(&route.name.value, &step.name().value), self.requests);
        }
    }

    /// What ends the steps of a route early, and what follows.
    fn show_exits(&mut self, ui: &mut egui::Ui, item: Item, route: &DrawnRoute) {
        section(ui, "Exits");
        let actions = ExitAction::NAMED.map(|(word, action)| (action, word.to_owned()));
        for (number, exit) in route.exits.iter().enumerate() {
            let name = |what: &str| format!("{what} of exit {}", number + 1);
            let causes: Vec<_> = exit.causes.iter().map(|cause| cause.value.word()).collect();
            let doc = "What ends a step: lost-link, blocked, late, recall, breach";
            row(ui, &format!("{}. On", number + 1), doc, |ui| {
                self.form.line(ui, &name("causes"), &causes.join(" "), &anything, |text| {
                    Some(Change::Exit(item, number, "on", given(text)))
                });
            });
            let when = exit.when.as_ref().map(|when| when.value.clone()).unwrap_or_default();
            row(ui, "When", "A guard that ends a step: battery < 30%", |ui| {
                self.form.line(ui, &name("guard"), &when, &is_guard, |text| {
                    Some(Change::Exit(item, number, "when", given(text)))
                });
            });
            row(
                ui,
                "Leads to",
                "The nearest rally point, the start, the safe place, or on",
                |ui| {
                    self.form.choice(ui, &name("action"), &exit.action.value, &actions, |action| {
                        let named = ExitAction::NAMED.iter().find(|(_, it)| it == action);
                        let word = named.map(|(word, _)| (*word).to_owned());
                        Change::Exit(item, number, "do", word)
                    });
                },
            );
        }
        if route.exits.is_empty() && ui.button("Add exits").clicked() {
            self.form.change(Change::AddExits(item));
        }
    }

    /// The legs to a point.
    fn show_uses(&mut self, ui: &mut egui::Ui, item: Item) {
        let legs = legs_to(item, self.workspace);
        if legs.is_empty() {
            return;
        }
        section(ui, "Legs to it");
        for leg in legs {
            go_to(ui, &leg.to_string(), leg, self.requests);
        }
    }

    fn route(&self, name: &str) -> Option<&'a DrawnRoute> {
        self.mission.routes.iter().find(|route| route.name.value == name)
    }

    fn point(&self, name: &str) -> Option<MapPoint> {
        let map = self.mission.map.as_ref()?;
        map.find_point(name).map(|point| point.position.value.point)
    }

    /// The text of an attribute in the file; empty without one.
    fn value(&self, item: Item, attribute: &str) -> String {
        self.attribute(item, attribute).unwrap_or_default()
    }

    fn attribute(&self, item: Item, attribute: &str) -> Option<String> {
        let project = &self.workspace.project;
        let element = |named: Named<'_>| -> Option<&Element> {
            let document = project.document_with(named)?;
            document.tree().element(&document.find(named)?)
        };
        let element = match item {
            Item::Symbol(number) => {
                element(Named::Map)?.elements().filter(|it| it.name == "symbol").nth(number)?
            }
            item => element(item.named()?)?,
        };
        Some(element.attribute(attribute)?.value.clone())
    }
}

/// The positions of points and rally points: a route names many of them.
fn points_by_name(map: Option<&SiteMap>) -> HashMap<&str, MapPoint> {
    let drawn = map.into_iter().flat_map(|map| map.points.iter().chain(&map.rallies));
    let mut points = HashMap::new();
    for point in drawn {
        points.entry(point.name.value.as_str()).or_insert(point.position.value.point);
    }
    points
}

/// The length of all legs whose ends are known.
fn route_length_m(route: &DrawnRoute, points: &HashMap<&str, MapPoint>) -> Option<f64> {
    let point = |name: &str| points.get(name).copied();
    let mut position = point(&route.start.as_ref()?.value)?;
    let mut length_m = 0.0;
    for step in &route.steps {
        if let RouteStep::Leg(leg) = step {
            let end = point(&leg.to.value)?;
            length_m += position.distance_m(end);
            position = end;
        }
    }
    Some(length_m)
}

fn capitalized(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().collect::<String>() + letters.as_str()
    })
}
