//! The daemon on a free port, over real files that are saved, moved, cut, deleted and linked.

// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use armor_configd::{Background, Notice, Options, ServeError};
use armor_wire::codec;
use armor_wire::config::{Assigned, Reply, Request, Settings};
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{self, Hello, Purpose};

/// How long anything may take before a test counts as failed.
const DEADLINE: Duration = Duration::from_secs(20);

fn file(rate_hz: u32) -> String {
    format!(
        r#"<armor version="1"><system><component name="lamp" kind="lamp" rate="{rate_hz}Hz"><parameter name="picture" value="a.png"/></component></system></armor>"#
    )
}

/// A folder of its own, with a first version of the file in it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("configd-{name}"));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let folder = Self(folder);
        fs::write(folder.file(), file(1)).unwrap();
        folder
    }

    fn file(&self) -> PathBuf {
        self.0.join("robot.xml")
    }

    fn configd(&self) -> Background {
        self.configd_of(&self.file())
    }

    fn configd_of(&self, file: &Path) -> Background {
        let configd = Background::start(Options::new(file)).unwrap();
        expect_taken(&configd, 1);
        configd
    }

    /// Written beside it, synced, and renamed over it, as careful editors do.
    fn save(&self, text: &str) {
        let beside = self.0.join(".robot.xml.new");
        let mut new = fs::File::create(&beside).unwrap();
        new.write_all(text.as_bytes()).unwrap();
        new.sync_all().unwrap();
        fs::rename(beside, self.file()).unwrap();
    }
}

/// The next that is no mere state.
fn notice(configd: &Background) -> Notice {
    loop {
        match configd.notices().recv_timeout(DEADLINE).unwrap() {
            Notice::State(_) => {}
            other => return other,
        }
    }
}

fn expect_taken(configd: &Background, wanted: u64) {
    match notice(configd) {
        Notice::Taken { version, .. } => assert_eq!(version, wanted),
        other => panic!("{other:?}"),
    }
}

/// As [`expect_taken`], after a save that may be caught half-written first.
fn expect_taken_in_the_end(configd: &Background, wanted: u64) {
    loop {
        match notice(configd) {
            Notice::Refused { .. } => {}
            Notice::Taken { version, .. } => return assert_eq!(version, wanted),
            other => panic!("{other:?}"),
        }
    }
}

fn expect_refused(configd: &Background, wanted: u64) {
    match notice(configd) {
        Notice::Refused { kept, findings } => assert!(kept == wanted && findings.has_errors()),
        other => panic!("{other:?}"),
    }
}

fn expect_restored(configd: &Background, wanted: u64) {
    match notice(configd) {
        Notice::Restored { version } => assert_eq!(version, wanted),
        other => panic!("{other:?}"),
    }
}

/// Connects as the component, asks once, and leaves.
fn ask(address: SocketAddr, from: &str, request: &Request) -> Reply {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(DEADLINE)).unwrap();
    let hello = Hello::new(from, 1, Purpose::Config);
    stream.write_all(&frame::to_bytes(FrameKind::Hello, &hello).unwrap()).unwrap();
    stream.write_all(&frame::to_bytes(FrameKind::Control, request).unwrap()).unwrap();
    let mut frames = FrameReader::new();
    let mut welcome = false;
    loop {
        let mut answer = None;
        while let Some(frame) = frames.next_frame().unwrap() {
            match frame.kind {
                FrameKind::Beat => {}
                _ if !welcome => welcome = hello::read_answer(&frame).map(|_| true).unwrap(),
                _ => answer = Some(codec::decode_control(frame.body).unwrap()),
            }
        }
        if let Some(answer) = answer {
            return answer;
        }
        let read = stream.read(frames.space()).unwrap();
        assert!(read > 0, "closed without an answer");
        frames.filled(read);
    }
}

fn settings(configd: &Background) -> Settings {
    match ask(configd.address(), "lamp", &Request::Settings { request: 9 }) {
        Reply::Settings { request: 9, settings } => settings,
        other => panic!("{other:?}"),
    }
}

#[test]
fn components_are_answered_and_changes_show() {
    let folder = Folder::new("answers");
    let configd = folder.configd();
    assert_eq!((settings(&configd).version, settings(&configd).rate_hz), (1, Some(1.0)));
    let request = Request::Parameter { request: 1, name: "picture".into() };
    let Reply::Parameter { assigned: Some(Assigned { text, base, origin }), .. } =
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
fn the_last_good_version_outlives_every_fault() {
    let folder = Folder::new("faults");
    let configd = folder.configd();
    let whole = file(2);

    // Caught half-written: the first half is not valid, the whole is.
    let mut open = fs::File::create(folder.file()).unwrap();
    open.write_all(&whole.as_bytes()[..60]).unwrap();
    open.sync_all().unwrap();
    expect_refused(&configd, 1);
    assert_eq!(settings(&configd).version, 1);
    open.write_all(&whole.as_bytes()[60..]).unwrap();
    drop(open);
    expect_taken_in_the_end(&configd, 2);

    folder.save(&file(3).replace("rate=", "rat="));
    expect_refused(&configd, 2);
    assert_eq!(settings(&configd).rate_hz, Some(2.0));

    fs::remove_file(folder.file()).unwrap();
    expect_refused(&configd, 2);
    assert_eq!(settings(&configd).version, 2);
    folder.save(&whole);
    expect_restored(&configd, 2);

    // The dance of an editor that keeps a backup.
    fs::rename(folder.file(), folder.0.join("robot.xml~")).unwrap();
    expect_refused(&configd, 2);
    fs::write(folder.file(), file(4)).unwrap();
    expect_taken_in_the_end(&configd, 3);
    fs::rename(folder.0.join("robot.xml~"), folder.file()).unwrap();
    expect_taken(&configd, 4);
    assert_eq!(settings(&configd).rate_hz, Some(2.0));
}

#[test]
fn a_swapped_link_and_a_replaced_folder_are_noticed() {
    let folder = Folder::new("links");
    fs::write(folder.0.join("two.xml"), file(2)).unwrap();
    fs::rename(folder.file(), folder.0.join("one.xml")).unwrap();
    std::os::unix::fs::symlink("one.xml", folder.file()).unwrap();
    let configd = folder.configd();
    assert_eq!(settings(&configd).rate_hz, Some(1.0));
    std::os::unix::fs::symlink("two.xml", folder.0.join("link")).unwrap();
    fs::rename(folder.0.join("link"), folder.file()).unwrap();
    expect_taken(&configd, 2);
    assert_eq!(settings(&configd).rate_hz, Some(2.0));

    let away = folder.0.with_extension("away");
    let _ = fs::remove_dir_all(&away);
    fs::rename(&folder.0, &away).unwrap();
    expect_refused(&configd, 2);
    fs::create_dir(&folder.0).unwrap();
    fs::write(folder.file(), file(3)).unwrap();
    expect_taken_in_the_end(&configd, 3);
    folder.save(&file(4));
    expect_taken(&configd, 4);
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
    match Background::start(Options::new(folder.file())).err() {
        Some(ServeError::Refused(findings)) => assert!(findings.has_errors()),
        other => panic!("{other:?}"),
    }
}

/// A way of saving a file in several steps.
type Save = fn(&Folder, &str);

/// Ways in which editors and tools save, each with moments in which the file is not whole.
const SAVES: [(&str, Save); 8] = [
    ("written beside and renamed", |folder, text| folder.save(text)),
    ("cut and written in pieces", |folder, text| {
        let mut file = fs::File::create(folder.file()).unwrap();
        for piece in text.as_bytes().chunks(40) {
            file.write_all(piece).unwrap();
            file.sync_all().unwrap();
        }
    }),
    ("written twice", |folder, text| {
        fs::write(folder.file(), &text[..text.len() / 2]).unwrap();
        fs::write(folder.file(), text).unwrap();
    }),
    ("moved to a backup and written anew", |folder, text| {
        fs::rename(folder.file(), folder.0.join("robot.xml~")).unwrap();
        fs::write(folder.file(), text).unwrap();
    }),
    ("copied to a backup, written, backup removed", |folder, text| {
        fs::copy(folder.file(), folder.0.join("robot.xml.bak")).unwrap();
        fs::write(folder.file(), text).unwrap();
        fs::remove_file(folder.0.join("robot.xml.bak")).unwrap();
    }),
    ("deleted and written anew", |folder, text| {
        fs::remove_file(folder.file()).unwrap();
        fs::write(folder.file(), text).unwrap();
    }),
    ("replaced by a hard link", |folder, text| {
        fs::write(folder.0.join("other"), text).unwrap();
        fs::remove_file(folder.file()).unwrap();
        fs::hard_link(folder.0.join("other"), folder.file()).unwrap();
    }),
    ("left as a link to another file", |folder, text| {
        fs::write(folder.0.join("target.xml"), text).unwrap();
        let _ = fs::remove_file(folder.file());
        std::os::unix::fs::symlink("target.xml", folder.file()).unwrap();
    }),
];

#[test]
fn no_step_of_a_save_is_taken_for_the_whole() {
    /// Well within the time that a save has; a machine that pauses longer shows nothing.
    const QUICK: Duration = Duration::from_millis(40);
    let folder = Folder::new("saves");
    let configd = folder.configd();
    let mut version = 1;
    for (style, save) in SAVES {
        let quick = loop {
            version += 1;
            let start = Instant::now();
            save(&folder, &file(version));
            let was_quick = start.elapsed() < QUICK;
            match notice(&configd) {
                Notice::Taken { version: taken, .. } if taken == u64::from(version) => {
                    break was_quick;
                }
                Notice::Refused { .. } if !was_quick => {
                    expect_taken_in_the_end(&configd, version.into());
                }
                other => panic!("{style}: {other:?}"),
            }
        };
        if !quick {
            println!("{style}: the machine was too slow to show it");
        }
        assert_eq!(settings(&configd).rate_hz, Some(f64::from(version)), "{style}");
    }
}

#[test]
fn a_swapped_link_anywhere_on_the_way_is_noticed() {
    let folder = Folder::new("way");
    for version in [1, 2] {
        let robot = folder.0.join(format!("v{version}/robot"));
        fs::create_dir_all(&robot).unwrap();
        fs::write(robot.join("robot.xml"), file(version)).unwrap();
    }
    std::os::unix::fs::symlink("v1", folder.0.join("current")).unwrap();
    let configd = folder.configd_of(&folder.0.join("current/robot/robot.xml"));
    std::os::unix::fs::symlink("v2", folder.0.join("next")).unwrap();
    fs::rename(folder.0.join("next"), folder.0.join("current")).unwrap();
    expect_taken(&configd, 2);
    // The new target is watched, and the old one no more.
    fs::write(folder.0.join("v1/robot/robot.xml"), file(9)).unwrap();
    fs::write(folder.0.join("v2/robot/robot.xml"), file(3)).unwrap();
    expect_taken(&configd, 3);
    assert_eq!(settings(&configd).rate_hz, Some(3.0));
    // A folder on the way is moved away and another one put there.
    fs::rename(folder.0.join("v2"), folder.0.join("v2-old")).unwrap();
    fs::create_dir_all(folder.0.join("v2/robot")).unwrap();
    fs::write(folder.0.join("v2/robot/robot.xml"), file(4)).unwrap();
    expect_taken_in_the_end(&configd, 4);
}

fn set(configd: &Background, parameter: &str, value: Option<&str>) -> Reply {
    let request = Request::Set {
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
        Reply::Set { request: 5, version: 2, changes } => {
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
        Reply::Rejected { findings, .. } => assert_eq!(findings[0].severity, "error"),
        other => panic!("{other:?}"),
    }
    assert_eq!(fs::read_to_string(folder.file()).unwrap(), "<armor");
}

#[test]
fn a_value_never_overwrites_what_somebody_else_just_saved() {
    let folder = Folder::new("race");
    let configd = folder.configd();
    for round in 2..10 {
        folder.save(&file(round));
        let picture = format!("{round}.png");
        let was_set = match set(&configd, "picture", Some(&picture)) {
            Reply::Set { .. } => true,
            Reply::Rejected { text, .. } => {
                assert!(text.contains("changed by somebody else"), "{text}");
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

#[test]
fn a_restart_over_an_invalid_file_goes_on_with_the_last_good_version() {
    let folder = Folder::new("restart");
    let kept = folder.0.join("out/configd");
    let options = || Options { versions: Some(kept.clone()), ..Options::new(folder.file()) };
    let configd = Background::start(options()).unwrap();
    expect_taken(&configd, 1);
    folder.save(&file(2));
    expect_taken(&configd, 2);
    while !kept.join("2/index").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    drop(configd);
    fs::write(folder.file(), "<armor").unwrap();
    let configd = Background::start(options()).unwrap();
    expect_refused(&configd, 2);
    assert_eq!((settings(&configd).version, settings(&configd).rate_hz), (2, Some(2.0)));
    folder.save(&file(3));
    expect_taken(&configd, 3);
    // As an editor would find it after a bad day.
    assert_eq!(fs::read_to_string(kept.join("2/1-robot.xml")).unwrap(), file(2));
    drop(configd);
    fs::write(folder.file(), "<armor").unwrap();
    let refused = Background::start(Options::new(folder.file())).err();
    assert!(matches!(refused, Some(ServeError::Refused(_))), "without the versions it cannot");
}
