//! Values set in the file.

use std::fs;

use armor_configd::BackgroundConfigd;
use armor_wire::config::{ConfigReply, ConfigRequest, FindingSeverity};

use crate::bench::*;

fn set(configd: &BackgroundConfigd, parameter: &str, value: Option<&str>) -> ConfigReply {
    let request = ConfigRequest::Set {
        request: 5,
        component: "lamp".into(),
        parameter: parameter.into(),
        value: value.map(Into::into),
    };
    ask(configd.address(), "param-1", &request)
}

#[test]
fn a_value_is_written_into_the_file_and_the_rest_stays() {
    let folder = Folder::new("set");
    let text = file(1).replace("<component", "<!-- mine -->\n  <component ");
    fs::rename(folder.file(), folder.0.join("real.xml")).unwrap();
    fs::write(folder.0.join("real.xml"), &text).unwrap();
    std::os::unix::fs::symlink("real.xml", folder.file()).unwrap();
    let configd = folder.configd();
    match set(&configd, "picture", Some("b & c.png")) {
        ConfigReply::Set { request: 5, version: 2, changes, .. } => {
            assert_eq!(changes[0].text, "parameter lamp.picture: a.png → \"b & c.png\"");
        }
        other => panic!("{other:?}"),
    }
    assert!(fs::symlink_metadata(folder.file()).unwrap().is_symlink());
    let written = text.replace("a.png", "b &amp; c.png");
    assert_eq!(fs::read_to_string(folder.file()).unwrap(), written);
    expect_taken(&configd, 2);
    // The watching makes no second version of it.
    folder.save(&file(3));
    expect_taken(&configd, 3);
    fs::write(folder.file(), "<armor").unwrap();
    expect_refused(&configd, 3);
    match set(&configd, "picture", Some("d.png")) {
        ConfigReply::Rejected { findings, .. } => {
            assert_eq!(findings[0].severity, FindingSeverity::Error);
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(fs::read_to_string(folder.file()).unwrap(), "<armor");
}

#[test]
fn a_value_never_overwrites_what_another_program_just_saved() {
    let folder = Folder::new("race");
    let configd = folder.configd();
    for round in 2..10 {
        folder.save(&file(round));
        let picture = format!("{round}.png");
        let was_set = match set(&configd, "picture", Some(&picture)) {
            ConfigReply::Set { .. } => true,
            ConfigReply::Rejected { text, .. } => {
                assert!(text.contains("changed by another program"), "{text}");
                false
            }
            other => panic!("{other:?}"),
        };
        let text = fs::read_to_string(folder.file()).unwrap();
        assert!(text.contains(&format!("\"{round}Hz\"")), "{text}");
        assert_eq!(text.contains(&picture), was_set, "{text}");
        while settings(&configd).rate_hz != Some(f64::from(round)) {
            notice(&configd);
        }
    }
}
