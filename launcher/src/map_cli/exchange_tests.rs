//! Plans drawn into a file and back: the nine plans of other planners, plans with everything, and
//! damaged ones.

use std::path::{Path, PathBuf};

use armor_exchange::{PlanFormat, RoutePlan, read_plan, write_plan};
use armor_robotfile::drawn_route::RouteStep;
use armor_robotfile::{Configuration, Reading, read_bytes};

use super::drawing::{ComponentPort, DrawingOptions, PositionForm};
use super::drawn_plan::draw_plan;
use super::import::{ChangedText, check_text, draw_into};
use super::planning::plan_drawing;
use crate::arguments::KindFolders;

/// The system of the example that is drawn, without its mission: a robot with a patrol, a planner
/// and a driver.
pub(super) fn system_text() -> String {
    let text = include_str!("../../../missions/drawn.xml");
    let (before, _) = text.split_once("\n\n  <!-- Simulator, mapper").expect("its mission");
    format!("{before}\n</armor>\n")
}

/// A file that does not exist, in the folder of the example.
pub(super) fn base_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/drawn-with-plan.xml")
}

pub(super) fn port(component: &str, port: &str) -> ComponentPort {
    ComponentPort { component: component.to_owned(), port: port.to_owned() }
}

pub(super) fn options(positions: PositionForm) -> DrawingOptions {
    DrawingOptions {
        route: None,
        only: None,
        mover: port("way", "route"),
        pace: Some(port("driver", "speed")),
        pose: Some(port("mapper", "pose")),
        active: Vec::new(),
        camera: None,
        enter: None,
        leave: Some("over".to_owned()),
        positions,
    }
}

fn with_camera(positions: PositionForm) -> DrawingOptions {
    DrawingOptions { camera: Some(port("camera", "done")), ..options(positions) }
}

fn read_text(text: &str) -> Reading {
    let path = base_path();
    armor_robotfile::read(&path, &mut |asked| {
        if asked == path { Ok(text.as_bytes().to_vec()) } else { read_bytes(asked) }
    })
}

pub(super) fn draw(
    base: &str,
    plan: &RoutePlan,
    options: &DrawingOptions,
) -> anyhow::Result<ChangedText> {
    let reading = read_text(base);
    draw_into(&base_path(), base.as_bytes(), reading.configuration.as_ref(), |existing| {
        Ok(draw_plan(plan, options, existing)?)
    })
}

/// The findings of a file that are errors.
pub(super) fn errors_of(text: &str) -> Option<String> {
    let checked = check_text(&base_path(), text.as_bytes(), &KindFolders::default());
    let checked = checked.expect("the kinds can be read");
    checked.accepted().is_none().then(|| checked.describe_problems())
}

fn configuration_of(text: &str) -> Configuration {
    read_text(text).configuration.expect("it can be read")
}

/// What is planned of a file, with one route.
fn plan_of(text: &str) -> RoutePlan {
    let configuration = configuration_of(text);
    let mission = configuration.mission.expect("a mission");
    let map = mission.map.as_ref().expect("a map");
    let routes: Vec<_> = mission.routes.iter().collect();
    plan_drawing(map, &routes, Some(&port("camera", "done"))).expect("it has an origin")
}

/// The steps of the only route, with positions on the map in metres.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum SeenStep {
    Leg { x_m: f64, y_m: f64, speed: Option<String>, components: usize },
    Stay { for_s: Option<f64>, is_on: bool },
}

pub(super) fn steps_of(text: &str) -> Vec<SeenStep> {
    let configuration = configuration_of(text);
    let mission = configuration.mission.expect("a mission");
    let map = mission.map.expect("a map");
    let route = mission.routes.last().expect("a route");
    let seen = |step: &RouteStep| match step {
        RouteStep::Leg(leg) => {
            let at = map.find_point(&leg.to.value).expect("it is drawn").position.value.point;
            SeenStep::Leg {
                x_m: at.x_m(),
                y_m: at.y_m(),
                speed: leg.speed.as_ref().map(|speed| speed.value.clone()),
                components: leg.components.len(),
            }
        }
        RouteStep::Stay(stay) => SeenStep::Stay {
            for_s: stay.duration.as_ref().map(|time| time.value.as_secs_f64()),
            is_on: stay.on.is_some(),
        },
        RouteStep::Meet(_) => panic!("no plan has meetings"),
    };
    route.steps.iter().map(seen).collect()
}

fn assert_same_route(one: &[SeenStep], other: &[SeenStep]) {
    assert_eq!(one.len(), other.len(), "{one:?}\n{other:?}");
    for pair in one.iter().zip(other) {
        match pair {
            (
                SeenStep::Leg { x_m, y_m, speed, components },
                SeenStep::Leg { x_m: x, y_m: y, speed: other_speed, components: others },
            ) => {
                assert!((x_m - x).hypot(y_m - y) <= 1e-3, "{pair:?}");
                assert_eq!((speed, components), (other_speed, others));
            }
            (one, other) => assert_eq!(one, other),
        }
    }
}

/// Draws a plan, and checks what applies to every plan: the file is valid and laid out, the same
/// again, and exported and imported again it has the same route.
pub(super) fn check_import(name: &str, plan: &RoutePlan, form: PositionForm) -> ChangedText {
    let base = system_text();
    let changed = draw(&base, plan, &options(form)).expect(name);
    assert_eq!(errors_of(&changed.after), None, "{name}\n{}", changed.after);
    let formatted = armor_robotfile::format(&base_path(), changed.after.as_bytes()).expect(name);
    assert_eq!(String::from_utf8_lossy(&formatted), changed.after, "{name}");
    let again = draw(&base, plan, &options(form)).expect(name);
    assert_eq!(again.after, changed.after, "{name}");
    for format in [PlanFormat::GroundControl, PlanFormat::WaypointList] {
        let exported = plan_of(&changed.after);
        let (text, _) = write_plan(&exported, format).expect(name);
        let plan = read_plan(&text, format).expect(name);
        let imported = draw(&base, &plan, &options(form)).expect(name);
        assert_same_route(&steps_of(&imported.after), &steps_of(&changed.after));
    }
    changed
}

#[test]
fn the_nine_plans_are_imported_or_refused_with_the_reason() {
    let Some(folder) = std::env::var_os("ARMOR_DATA") else {
        assert!(std::env::var_os("CI").is_none(), "ARMOR_DATA names the data folder");
        eprintln!("skipped: ARMOR_DATA is not set");
        return;
    };
    let folder = PathBuf::from(folder).join("plans");
    for (name, expected) in [
        ("", Ok(4)),
        ("_with_survey", Ok(8)),
        ("_with_digicam_control", Err("there is nothing to import")),
        ("_wrong_overall_version", Err("the plan has version 42")),
        ("_wrong_mission_version", Err("the mission has version 7")),
        ("_without_mission", Err("the plan has no mission")),
        ("_with_survey_wrong_version", Err("item 2 (survey) has version 9")),
        ("_with_survey_missing_items", Err("item 2 (survey) has no Items")),
        ("_with_structured_scan", Err("item 2 is a StructureScan")),
    ] {
        let path = folder.join(format!("qgroundcontrol_sample{name}.plan"));
        let plan = super::plan_file::load_plan(&path);
        match expected {
            Ok(legs) => {
                let plan = plan.expect(name);
                for form in [PositionForm::Metres, PositionForm::Wgs84] {
                    let changed = check_import(name, &plan, form);
                    let steps = steps_of(&changed.after);
                    let is_leg = |step: &&SeenStep| matches!(step, SeenStep::Leg { .. });
                    assert_eq!(steps.iter().filter(is_leg).count(), legs, "{name}");
                }
            }
            Err(reason) => {
                let error = match plan {
                    Ok(plan) => draw(&system_text(), &plan, &options(PositionForm::Metres)).err(),
                    Err(error) => Some(error),
                };
                let error = format!("{:#}", error.expect(name));
                assert!(error.contains(reason), "{name}: {error}");
            }
        }
    }
}

/// A plan in which every item occurs.
pub(super) const EVERYTHING: &str = r#"{"fileType":"Plan","version":1,"mission":{"version":2,"plannedHomePosition":[48.1,2.1,35],"items":[
{"type":"SimpleItem","command":22,"frame":3,"params":[0,0,0,null,48.1001,2.1,20],"doJumpId":1},
{"type":"SimpleItem","command":178,"frame":2,"params":[1,0.8,-1,0,0,0,0],"doJumpId":2},
{"type":"SimpleItem","command":16,"frame":3,"params":[5,0,0,null,48.1002,2.1001,20],"doJumpId":3},
{"type":"SimpleItem","command":195,"frame":3,"params":[0,0,0,0,48.2,2.2,0],"doJumpId":4},
{"type":"SimpleItem","command":19,"frame":3,"params":[7,0,12,null,48.1003,2.1001,20],"doJumpId":5},
{"type":"SimpleItem","command":93,"frame":2,"params":[3.5,-1,-1,-1,0,0,0],"doJumpId":6},
{"type":"SimpleItem","command":177,"frame":2,"params":[3,2,0,0,0,0,0],"doJumpId":7},
{"type":"SimpleItem","command":2000,"frame":2,"params":[0,0,1,0,0,0,0],"doJumpId":8},
{"type":"SimpleItem","command":2000,"frame":2,"params":[0,2,0,0,0,0,0],"doJumpId":9},
{"type":"SimpleItem","command":82,"frame":3,"params":[0,0,0,null,48.1004,2.1,20],"doJumpId":10},
{"type":"SimpleItem","command":2001,"frame":2,"params":[0,0,0,0,0,0,0],"doJumpId":11},
{"type":"SimpleItem","command":206,"frame":2,"params":[25,0,0,0,0,0,0],"doJumpId":12},
{"type":"SimpleItem","command":197,"frame":2,"params":[0,0,0,0,0,0,0],"doJumpId":13},
{"type":"SimpleItem","command":20,"frame":2,"params":[0,0,0,0,0,0,0],"doJumpId":14},
{"type":"SimpleItem","command":21,"frame":3,"params":[0,0,0,null,48.1,2.1,0],"doJumpId":15}]},
"geoFence":{"version":2,"circles":[{"circle":{"center":[48.101,2.102],"radius":12.5},"inclusion":false}],
"polygons":[{"polygon":[[48.09,2.09],[48.09,2.11],[48.11,2.11],[48.11,2.09],[48.09,2.09]],"inclusion":true}],"breachReturn":[48.1001,2.1,20]},
"rallyPoints":{"version":2,"points":[[48.10005,2.1,10]]}}"#;

/// The system, with a component for pictures.
fn system_with_camera() -> String {
    system_text().replace(
        "    <component name=\"writer\"",
        "    <component name=\"camera\" kind=\"homing\"/>\n    <component name=\"writer\"",
    )
}

#[test]
fn every_item_has_a_counterpart_or_a_note() {
    let plan = read_plan(EVERYTHING, PlanFormat::GroundControl).expect("it is a plan");
    let base = system_with_camera();
    let changed = draw(&base, &plan, &with_camera(PositionForm::Metres)).expect("it is drawn");
    let (_, mission) = changed.after.split_once("<mission").expect("it has one");
    let mission = format!("<mission{mission}");
    let expected = include_str!("everything_imported.xml");
    if std::env::var_os("ARMOR_BLESS").is_some() {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("src/map_cli/everything_imported.xml");
        std::fs::write(path, &mission).expect("it is written");
    } else {
        assert_eq!(mission, expected, "ARMOR_BLESS=1 writes what is drawn");
    }
    // Notes of the file are those that are printed.
    for note in &changed.drawing.notes {
        let text = note.to_string().replace("--", "- -");
        assert!(mission.contains(&format!("<!-- {text} -->")), "{text}\n{mission}");
    }
    let exported = plan_of(&changed.after);
    assert_eq!(exported.fences.len(), 2);
    assert_eq!((exported.rally_points.len(), exported.breach_return.is_some()), (1, true));
    let (text, _) = write_plan(&exported, PlanFormat::GroundControl).expect("it is written");
    let again = read_plan(&text, PlanFormat::GroundControl).expect("it is a plan");
    let again = draw(&base, &again, &with_camera(PositionForm::Metres)).expect("it is drawn");
    assert_same_route(&steps_of(&again.after), &steps_of(&changed.after));
    assert_eq!(shapes_of(&again.after), shapes_of(&changed.after));
}

/// Zones and rally points as they are written.
fn shapes_of(text: &str) -> Vec<String> {
    let lines = text.lines().map(str::trim);
    let is_mark =
        |line: &&str| ["<rally", "<zone", "kind=", "shape="].iter().any(|it| line.starts_with(it));
    lines.filter(is_mark).map(str::to_owned).collect()
}

#[test]
fn a_plan_of_positions_is_the_same_route_in_every_format() {
    let list = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t-33.85\t151.2\t20\t1\n\
        1\t0\t3\t16\t0\t0\t0\t0\t-33.8501\t151.2002\t0\t1\n\
        2\t0\t3\t16\t0\t0\t0\t0\t-33.85025\t151.20015\t0\t1\n";
    let plan = read_plan(list, PlanFormat::WaypointList).expect("a list");
    let changed = check_import("list", &plan, PositionForm::Metres);
    let exported = plan_of(&changed.after);
    for format in PlanFormat::ALL {
        let (text, _) = write_plan(&exported, *format).expect("it is written");
        let mut plan = read_plan(&text, *format).expect("it is read");
        // Formats without a home: the map has its origin in the first position.
        plan.home = exported.home;
        let imported = draw(&system_text(), &plan, &options(PositionForm::Metres));
        let imported = imported.expect("it is drawn");
        assert_same_route(&steps_of(&imported.after), &steps_of(&changed.after));
        if *format == PlanFormat::Gpx {
            assert!(imported.after.contains("<leg name=\"l1\" to=\"P1\"/>"), "{}", imported.after);
            assert!(imported.after.contains("<route name=\"route\""), "{}", imported.after);
        }
    }
}

#[test]
fn names_of_the_file_stay_and_new_ones_are_new() {
    let plan = read_plan(EVERYTHING, PlanFormat::GroundControl).expect("it is a plan");
    let wgs84 = with_camera(PositionForm::Wgs84);
    let one = draw(&system_with_camera(), &plan, &wgs84).expect("it is drawn");
    let two = draw(&one.after, &plan, &wgs84).expect("it is drawn again");
    // Every line of before is still there, in its order.
    let mut lines = two.after.lines();
    for line in one.after.lines() {
        assert!(lines.any(|other| other == line), "{line}\n{}", two.after);
    }
    for name in
        ["\"route-2\"", "\"home-2\"", "\"P5\"", "\"stay-in-2\"", "\"breach-return-2\"", "\"R2\""]
    {
        assert!(two.after.contains(&format!(" name={name}")), "{name}\n{}", two.after);
    }
    let named = DrawingOptions { route: Some("route".into()), ..wgs84 };
    let error = draw(&one.after, &plan, &named).err().expect("it is taken").to_string();
    assert!(error.contains("a route route already"), "{error}");
}

#[test]
fn a_map_with_an_origin_and_heading_keeps_them() {
    let plan = read_plan(EVERYTHING, PlanFormat::GroundControl).expect("it is a plan");
    let base = system_with_camera().replace(
        "\n</armor>",
        "\n  <mission goal=\"over\" safe=\"hold\">\n    <map origin=\"48.1 2.1 35m\" heading=\"90deg\">\n      \
         <point name=\"home\" at=\"0 0\"/>\n    </map>\n    <place name=\"over\"/>\n    \
         <place name=\"hold\"/>\n  </mission>\n</armor>",
    );
    let changed = draw(&base, &plan, &options(PositionForm::Metres)).expect("it is drawn");
    assert!(changed.after.contains("<map origin=\"48.1 2.1 35m\" heading=\"90deg\">"));
    // The y axis points east: what is north of the origin has a negative x.
    assert!(changed.after.contains("at=\"-11.1193 0\""), "{}", changed.after);
    for (attribute, reason) in
        [("heading=\"90deg\"", "no origin"), ("origin=\"x\"", "cannot be read")]
    {
        let broken = base.replace("origin=\"48.1 2.1 35m\" heading=\"90deg\"", attribute);
        let error = draw(&broken, &plan, &options(PositionForm::Metres)).err().expect("refused");
        assert!(format!("{error:#}").contains(reason), "{error:#}");
    }
}

/// Changes a few pieces: mostly a number becomes another one, so that most of what is damaged can
/// still be read as a plan; else bytes are replaced, removed or doubled.
fn damage(bytes: &mut Vec<u8>, random: &mut fastrand::Rng) {
    const NUMBERS: [&str; 12] =
        ["0", "-1", "1e9", "90", "-90", "180", "48.10005", "2.1", "16", "177", "20", "99999999999"];
    const PIECES: [&str; 5] = ["--", "&", "\u{1}", "-->", "null"];
    for _ in 0..random.usize(1..6) {
        let at = random.usize(..bytes.len());
        match random.u8(..20) {
            0 => bytes[at] = random.u8(b' '..b'~'),
            1 => drop(bytes.drain(at..(at + random.usize(1..20)).min(bytes.len()))),
            2 => {
                let piece = bytes[at..(at + random.usize(1..200)).min(bytes.len())].to_vec();
                let to = random.usize(..=bytes.len());
                bytes.splice(to..to, piece);
            }
            3 => {
                let piece = PIECES[random.usize(..PIECES.len())];
                bytes.splice(at..at, piece.bytes());
            }
            _ => {
                let is_of_number = |byte: &u8| byte.is_ascii_digit() || b".-".contains(byte);
                let Some(start) = bytes[at..].iter().position(is_of_number) else { continue };
                let start = at + start;
                let len = bytes[start..].iter().take_while(|byte| is_of_number(byte)).count();
                let number = NUMBERS[random.usize(..NUMBERS.len())];
                bytes.splice(start..start + len, number.bytes());
            }
        }
        if bytes.is_empty() {
            return;
        }
    }
}

#[test]
fn damaged_plans_are_drawn_or_refused() {
    let count = if std::env::var_os("ARMOR_FULL").is_some() { 300_000 } else { 3_000 };
    let geojson = r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"name":"--red->","names":["A","B"]},"geometry":{"type":"LineString","coordinates":[[2.1,48.1],[2.1002,48.1]]}},
        {"type":"Feature","properties":{"kind":"no-go","name":"a & b"},"geometry":{"type":"Polygon","coordinates":[[[2,48],[2.2,48],[2.2,48.01],[2,48]]]}},
        {"type":"Feature","properties":{"kind":"rally","name":"R"},"geometry":{"type":"Point","coordinates":[2.1,48.1]}}]}"#;
    let bases = [system_with_camera(), {
        let plan = read_plan(geojson, PlanFormat::GeoJson).expect("a plan");
        let base = draw(&system_with_camera(), &plan, &options(PositionForm::Metres));
        base.expect("it is drawn").after
    }];
    let mut random = fastrand::Rng::with_seed(19);
    for (format, text) in [(PlanFormat::GroundControl, EVERYTHING), (PlanFormat::GeoJson, geojson)]
    {
        let (mut drawn, mut refused, mut valid) = (0, 0, 0);
        for _ in 0..count {
            let mut bytes = text.as_bytes().to_vec();
            damage(&mut bytes, &mut random);
            let damaged = String::from_utf8_lossy(&bytes);
            let Ok(plan) = read_plan(&damaged, format) else { continue };
            let form = [PositionForm::Metres, PositionForm::Wgs84][random.usize(..2)];
            let base = &bases[random.usize(..2)];
            let changed = match draw(base, &plan, &with_camera(form)) {
                Ok(changed) => changed,
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().len() < 2_000, "{error}");
                    continue;
                }
            };
            drawn += 1;
            assert!(changed.after.len() < base.len() + 100_000, "{damaged}");
            let reading = armor_robotfile::check(read_text(&changed.after), &[], None);
            // The legs may be in zones; what was written can be read, and every name is new.
            for finding in reading.findings.iter() {
                let code = finding.code.as_str();
                assert!(!["E0301", "E0303", "E0302"].contains(&code), "{finding}\n{damaged}");
                let is_written_badly = code == "E0019"
                    && !finding.message.contains("for")
                    && !finding.message.contains("speed");
                assert!(!is_written_badly, "{finding}\n{damaged}");
            }
            let Some(configuration) = reading.configuration.as_ref() else { continue };
            valid += usize::from(reading.is_valid());
            let mission = configuration.mission.as_ref().expect("it has one");
            let map = mission.map.as_ref().expect("it has one");
            let routes: Vec<_> = mission.routes.iter().collect();
            let plan = plan_drawing(map, &routes, None).expect("its positions are on the map");
            for to in PlanFormat::ALL {
                assert!(write_plan(&plan, *to).is_ok() || routes.len() > 1, "{damaged}");
            }
        }
        println!("{}: {drawn} drawn, {valid} valid, {refused} refused", format.name());
        assert!(
            drawn > count / 10 && refused > count / 50 && valid > 0,
            "{drawn} {refused} {valid}"
        );
    }
}
