//! The daemon on a free port, over real files that are saved, moved, cut, deleted and linked.

// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

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
        let configd = Background::start(Options::new(self.file())).unwrap();
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

fn notice(configd: &Background) -> Notice {
    configd.notices().recv_timeout(DEADLINE).unwrap()
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
