//! `armor map import` and `armor map export` with files.

use std::path::Path;

use super::drawing::PositionForm;
use super::exchange_tests::{EVERYTHING, errors_of, port, system_text};
use super::export::{ExportArguments, export_plan};
use super::import::{ImportArguments, import_plan};
use crate::arguments::{KindFolders, OutputFormat};
use crate::exit::CommandEnding;
use crate::scratch::ScratchFolder;

/// A folder with a plan and a system, and the arguments that draw the one into the other.
fn prepare_import(name: &str, plan: &str) -> (ScratchFolder, ImportArguments) {
    let folder = ScratchFolder::new(name);
    let (plan_path, file) = (folder.path().join("field.plan"), folder.path().join("robot.xml"));
    std::fs::write(&plan_path, plan).expect("it is written");
    std::fs::write(&file, system_text()).expect("it is written");
    let arguments = ImportArguments {
        plan: plan_path,
        into: Some(file),
        write: false,
        system: None,
        route: Some("field".into()),
        only: None,
        mover: None,
        pace: None,
        pose: None,
        active: Vec::new(),
        camera: None,
        enter: None,
        leave: None,
        positions: PositionForm::Metres,
        kinds: KindFolders::default(),
    };
    (folder, arguments)
}

fn import(arguments: &ImportArguments) -> anyhow::Result<CommandEnding> {
    import_plan(arguments, OutputFormat::Text)
}

#[test]
fn a_file_changes_only_with_write_and_only_without_errors() {
    let (folder, mut arguments) = prepare_import("map-import", EVERYTHING);
    let file = folder.path().join("robot.xml");
    let read = || std::fs::read_to_string(&file).expect("it is there");
    assert_eq!(import(&arguments).expect("it is printed"), CommandEnding::Fine);
    assert_eq!(read(), system_text());
    arguments.write = true;
    assert_eq!(import(&arguments).expect("it is written"), CommandEnding::Fine);
    let written = read();
    assert!(
        written.contains("mover=\"way.route\"") && written.contains("out=\"over\""),
        "{written}"
    );
    assert_eq!(errors_of(&written), None);
    let error = import(&arguments).expect_err("its name is taken");
    assert!(format!("{error:#}").contains("a route field already"), "{error:#}");

    // The second leg enters the circle.
    let blocked = EVERYTHING.replace("48.101,2.102", "48.10015,2.10005");
    let (folder, mut arguments) = prepare_import("map-import-blocked", &blocked);
    arguments.write = true;
    assert_eq!(import(&arguments).expect("it is refused"), CommandEnding::Failed);
    let text = std::fs::read_to_string(folder.path().join("robot.xml")).expect("it is there");
    assert_eq!(text, system_text());
}

#[test]
fn what_a_command_line_lacks_is_named() {
    let (folder, mut arguments) = prepare_import("map-import-lacks", EVERYTHING);
    let file = folder.path().join("robot.xml");
    let refuse = |arguments: &ImportArguments, reason: &str| {
        let error = format!("{:#}", import(arguments).expect_err(reason));
        assert!(error.contains(reason), "{error}");
    };
    let second = system_text().replace(
        "    <component name=\"planner\"",
        "    <component name=\"way-2\" kind=\"patrol\"/>\n    <component name=\"planner\"",
    );
    std::fs::write(&file, second).expect("it is written");
    refuse(&arguments, "several components of the kind patrol: write --mover way.route");
    std::fs::write(&file, "<armor version=\"1\"><system/></armor>").expect("it is written");
    refuse(&arguments, "no component of the kind patrol: write --mover");
    arguments.into = Some(folder.path().join("gone.xml"));
    refuse(&arguments, "gone.xml");
    arguments.into = Some(file);
    arguments.mover = Some(port("way", "route"));
    arguments.plan = folder.path().join("field.txt");
    refuse(&arguments, "cannot read");
}

#[test]
fn an_export_names_the_route_the_map_and_the_origin_that_it_lacks() {
    let (folder, mut arguments) = prepare_import("map-export", EVERYTHING);
    arguments.write = true;
    import(&arguments).expect("it is written");
    let file = folder.path().join("robot.xml");
    let export = |file: &Path, out: &str, routes: &[&str]| {
        let arguments = ExportArguments {
            file: file.to_path_buf(),
            out: folder.path().join(out),
            route: routes.iter().map(|name| (*name).to_owned()).collect(),
            plan_format: None,
            camera: None,
        };
        export_plan(&arguments, OutputFormat::Text).map_err(|error| format!("{error:#}"))
    };
    assert_eq!(export(&file, "field.kml", &["field"]), Ok(CommandEnding::Fine));
    let text = std::fs::read_to_string(folder.path().join("field.kml")).expect("it is there");
    assert!(text.contains("<name>field</name>"), "{text}");
    let error = export(&file, "field.plan", &["fields"]).expect_err("no such route");
    assert!(error.contains("no route fields") && error.contains("it has: field"), "{error}");
    let error = export(&file, "field.xml", &[]).expect_err("no format");
    assert!(error.contains(".plan, .waypoints"), "{error}");
    let system = folder.path().join("system.xml");
    std::fs::write(&system, system_text()).expect("it is written");
    let error = export(&system, "a.gpx", &[]).expect_err("no map");
    assert!(error.contains("has no <map>"), "{error}");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/drawn.xml");
    let error = export(&example, "a.gpx", &[]).expect_err("no origin");
    assert!(error.contains("write origin="), "{error}");
}
