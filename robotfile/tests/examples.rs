//! Every example file is read, is valid, keeps its bytes, and has the expected contents.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use armor_robotfile::mission::{ArcKind, Autonomy, Class, Interval};
use armor_robotfile::model::{LinkMode, Restart, Transport};
use armor_robotfile::{Colours, Configuration, check, load, parse_tree, read};

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn missions() -> PathBuf {
    folder().join("../missions")
}

/// Those of components that are not stock, next to them.
const OTHERS: [&str; 4] = [
    "../components/joystick/joystick.xml",
    "../components/person-detector/person-detector.xml",
    "../components/pose-filter/pose-filter.xml",
    "../sdk/python/examples/office.xml",
];

fn examples() -> Vec<PathBuf> {
    let files = fs::read_dir(missions()).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        files.filter(|path| path.extension().is_some_and(|e| e == "xml")).collect();
    files.push(folder().join("tests/everything.xml"));
    files.extend(OTHERS.map(|file| folder().join(file)));
    assert!(files.len() >= 3);
    files
}

fn configuration(path: &Path) -> Configuration {
    let reading = check(load(path), &[], None);
    assert!(reading.findings.is_empty(), "{}", reading.findings.render(Colours::No));
    reading.configuration.unwrap()
}

#[test]
fn examples_are_valid() {
    for path in examples() {
        configuration(&path);
    }
}

#[test]
fn unchanged_files_keep_their_bytes() {
    for path in examples() {
        let bytes = fs::read(&path).unwrap();
        assert_eq!(parse_tree(&path, &bytes).unwrap().to_bytes(), bytes, "{}", path.display());
    }
    let odd = b"\xef\xbb\xbf<?xml version='1.0'?>\r\n<armor\tversion = '1' ><!-- \xc3\xa4 -->\r\n\r\n</armor >\n";
    assert_eq!(parse_tree(Path::new("a.xml"), odd).unwrap().to_bytes(), odd);
}

#[test]
fn the_office_has_the_expected_system_and_mission() {
    let office = configuration(&missions().join("office.xml"));
    let mission = office.mission.as_ref().unwrap();
    assert_eq!(mission.goal.as_ref().unwrap().value, "home");
    assert_eq!(mission.safe.as_ref().unwrap().value, "hold");
    for free in ["simulator", "mapper", "writer"] {
        assert!(!mission.controls(free), "{free} is always active");
    }
}

#[test]
fn the_world_of_the_office_exists() {
    let office = configuration(&missions().join("office.xml"));
    let world = office.system.component("simulator").unwrap().parameter("world").unwrap();
    assert!(world.folder.join(&world.value.value).is_file());
}

#[test]
fn the_replay_loses_nothing() {
    let replay = configuration(&missions().join("map-from-log.xml"));
    assert!(replay.system.links.iter().all(|link| link.keep.is_all()));
}

#[test]
fn every_part_of_the_format_reaches_the_model() {
    let all = configuration(&folder().join("tests/everything.xml"));
    let system = &all.system;
    let slam = system.component("slam").unwrap();
    assert_eq!(slam.rate_hz.as_ref().unwrap().value, 10.0);
    assert_eq!(slam.restart, Restart::Always);
    assert_eq!(slam.parameter("particles").unwrap().value.value, "30");
    assert_eq!(slam.parameter("particles").unwrap().folder, folder().join("tests"));
    assert!(!system.component("screen").unwrap().controllable);
    assert_eq!(system.links[3].mode, LinkMode::Pull);
    assert_eq!(system.links[3].history, 5);
    assert_eq!(system.links[0].transport, Transport::Shm);
    assert_eq!(system.clock.as_ref().unwrap().source.data(), "laser.time");

    let mission = all.mission.as_ref().unwrap();
    assert_eq!(mission.place("spares").unwrap().initial, 3);
    assert_eq!(mission.place("hold").unwrap().class, Class::Safety);
    assert_eq!(mission.place("explore").unwrap().parameters[0].parameter.value.value, "north");
    assert_eq!(mission.checks[1].value, "duration(home) <= 20min");
    let transition =
        |name: &str| mission.transitions.iter().find(|t| t.name.value == name).unwrap();
    assert_eq!(transition("weak").when.as_ref().unwrap().value, "battery < 30");
    assert_eq!(transition("weak").when.as_ref().unwrap().at.text(), "battery &lt; 30");
    assert_eq!(transition("mapped").on.as_ref().unwrap().event.value, "done");
    let minutes = Duration::from_secs(600);
    let timeout = transition("late").interval.as_ref().unwrap().value;
    assert_eq!(timeout, Interval { earliest: minutes, latest: Some(minutes) });
    let open = transition("open").interval.as_ref().unwrap().value;
    assert_eq!(open, Interval { earliest: Duration::from_secs(2), latest: None });
    assert_eq!(transition("recall").autonomy, Autonomy::Operator);
    let confirm =
        Autonomy::Confirm { within: Some(Duration::from_secs(4)), fire_unanswered: false };
    assert_eq!(transition("asked").autonomy, confirm);
    let arcs: Vec<_> = transition("repair")
        .arcs
        .iter()
        .map(|arc| (arc.kind, &*arc.place.value, arc.weight))
        .collect();
    let wanted = [
        (ArcKind::Take, "hold", 1),
        (ArcKind::Take, "spares", 2),
        (ArcKind::Put, "explore", 1),
        (ArcKind::Read, "late-marks", 1),
        (ArcKind::Inhibitor, "home", 2),
        (ArcKind::Reset, "return", 1),
    ];
    assert_eq!(arcs, wanted);
}

#[test]
fn a_mission_finds_its_system_in_another_file() {
    let mission = r#"<armor version="1"><mission system="robots/rover.xml" safe="a"><place name="a" initial="true" components="laser"/></mission></armor>"#;
    let system = r#"<armor version="1"><system><component name="laser" kind="laser"><parameter name="w" value="x.svg"/></component></system></armor>"#;
    let reading = read(Path::new("m/survey.xml"), &mut |path| match path.to_str().unwrap() {
        "m/survey.xml" => Ok(mission.into()),
        "m/robots/rover.xml" => Ok(system.into()),
        other => panic!("asked for {other}"),
    });
    let reading = check(reading, &[], None);
    assert!(reading.findings.is_empty(), "{}", reading.findings.render(Colours::No));
    let both = [PathBuf::from("m/survey.xml"), PathBuf::from("m/robots/rover.xml")];
    assert_eq!(reading.files, both);
    let configuration = reading.configuration.unwrap();
    assert_eq!(configuration.sources.len(), 2);
    // Paths in a file are relative to that file.
    assert_eq!(configuration.system.components[0].parameters[0].folder, Path::new("m/robots"));
}

/// The examples in the format's documentation are real ones.
#[test]
fn the_documented_examples_are_valid() {
    let text = fs::read_to_string(folder().join("../docs/file-format.md")).unwrap();
    let examples: Vec<_> =
        text.split("```xml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert!(examples.len() >= 3, "{} examples", examples.len());
    for example in examples {
        // A piece of a file is shown without what is around it.
        let whole = match example.trim_start() {
            start if start.starts_with("<armor") || start.starts_with("<?xml") => {
                example.to_owned()
            }
            _ => format!("<armor version=\"1\">{example}</armor>"),
        };
        let reading = read(Path::new("example.xml"), &mut |path| match path.to_str() {
            Some("example.xml") => Ok(whole.clone().into()),
            _ => fs::read(folder().join("tests/everything.xml")),
        });
        let reading = check(reading, &[], None);
        assert!(reading.findings.is_empty(), "{}", reading.findings.render(Colours::No));
    }
}
