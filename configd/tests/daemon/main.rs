//! The daemon on a free port, over real files that are saved, moved, cut, deleted and linked.

// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

mod bench;
mod mutations;
mod saves;
mod setting;

use std::fs;
use std::path::Path;

use armor_configd::{BackgroundConfigd, ConfigdOptions, ConfigdStartError};
use armor_wire::config::{Assigned, ConfigReply, ConfigRequest};

use bench::*;

#[test]
fn components_are_answered_and_changes_show() {
    let folder = Folder::new("answers");
    let configd = folder.configd();
    assert_eq!((settings(&configd).version, settings(&configd).rate_hz), (1, Some(1.0)));
    let request = ConfigRequest::Parameter { request: 1, name: "picture".into() };
    let ConfigReply::Parameter { assigned: Some(Assigned { text, base, origin }), .. } =
        ask(configd.address(), "lamp", &request)
    else {
        panic!("not assigned");
    };
    assert_eq!((text.as_str(), Path::new(&base)), ("a.png", folder.0.as_path()));
    let column = file(1).find("a.png").unwrap() + 1;
    assert_eq!(origin, format!("{}:1:{column}", folder.file().display()));
    for version in 2..12 {
        folder.save(&file(version));
        expect_taken(&configd, version.into());
        let settings = settings(&configd);
        assert_eq!((settings.version, settings.rate_hz), (version.into(), Some(version.into())));
    }
}

#[test]
fn the_system_file_of_a_mission_is_watched_too() {
    let folder = Folder::new("include");
    let mission = r#"<armor version="1"><mission system="parts/rover.xml" safe="a"><place name="a" initial="true" components="lamp"/></mission></armor>"#;
    fs::create_dir(folder.0.join("parts")).unwrap();
    let system = folder.0.join("parts/rover.xml");
    fs::write(&system, file(1)).unwrap();
    fs::write(folder.file(), mission).unwrap();
    let configd = folder.configd();
    assert!(settings(&configd).controlled);
    fs::write(&system, file(7)).unwrap();
    expect_taken_in_the_end(&configd, 2);
    assert_eq!(settings(&configd).rate_hz, Some(7.0));
}

#[test]
fn it_does_not_start_over_an_invalid_file() {
    let folder = Folder::new("invalid");
    fs::write(folder.file(), "<armor version=\"1\"><system/>").unwrap();
    match BackgroundConfigd::start(ConfigdOptions::new(folder.file())).err() {
        Some(ConfigdStartError::Refused(findings)) => assert!(findings.has_errors()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_restart_over_an_invalid_file_continues_with_the_last_good_version() {
    let folder = Folder::new("restart");
    let kept = folder.0.join("out/configd");
    let options =
        || ConfigdOptions { versions: Some(kept.clone()), ..ConfigdOptions::new(folder.file()) };
    let configd = BackgroundConfigd::start(options()).unwrap();
    expect_taken(&configd, 1);
    folder.save(&file(2));
    expect_taken(&configd, 2);
    wait_for("version 2 on the disk", || kept.join("2/index").exists());
    drop(configd);
    fs::write(folder.file(), "<armor").unwrap();
    let configd = BackgroundConfigd::start(options()).unwrap();
    expect_refused(&configd, 2);
    assert_eq!((settings(&configd).version, settings(&configd).rate_hz), (2, Some(2.0)));
    folder.save(&file(3));
    expect_taken(&configd, 3);
    // As an editor would find it after a bad day.
    assert_eq!(fs::read_to_string(kept.join("2/1-robot.xml")).unwrap(), file(2));
    drop(configd);
    fs::write(folder.file(), "<armor").unwrap();
    let refused = BackgroundConfigd::start(ConfigdOptions::new(folder.file())).err();
    assert!(
        matches!(refused, Some(ConfigdStartError::Refused(_))),
        "without the versions it cannot"
    );
}

#[test]
fn a_version_that_vanished_is_kept_again() {
    let folder = Folder::new("vanished");
    let kept = folder.0.join("out/configd");
    let options =
        || ConfigdOptions { versions: Some(kept.clone()), ..ConfigdOptions::new(folder.file()) };
    let configd = BackgroundConfigd::start(options()).unwrap();
    expect_taken(&configd, 1);
    let whole = || {
        wait_for("a whole version", || {
            let text = fs::read_to_string(kept.join("1/1-robot.xml"));
            text.is_ok_and(|text| text == file(1)) && kept.join("1/index").exists()
        });
    };
    whole();
    wait_for("the end of the folder", || fs::remove_dir_all(&kept).is_ok());
    whole();
    fs::write(kept.join("1/1-robot.xml"), "<arm").unwrap();
    whole();
    // A restart without any: refusals until the file is valid.
    drop(configd);
    fs::write(folder.file(), "<armor").unwrap();
    let empty = Some(folder.0.join("out/empty"));
    let options = ConfigdOptions { wait: true, versions: empty, ..options() };
    let configd = BackgroundConfigd::start(options).unwrap();
    let refused = ask(configd.address(), "lamp", &ConfigRequest::Settings { request: 1 });
    assert!(matches!(refused, ConfigReply::Refused { .. }), "{refused:?}");
    folder.save(&file(2));
    expect_taken_in_the_end(&configd, 1);
}
