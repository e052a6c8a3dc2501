//! What every test of the daemon needs: a folder with a system file, a configd that watches it, and
//! a client.

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use armor_configd::{BackgroundConfigd, ConfigdOptions, Notice};
use armor_wire::codec;
use armor_wire::config::{ComponentSettings, ConfigReply, ConfigRequest};
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{self, Hello, Purpose};

/// How long anything may take before a test counts as failed.
pub const DEADLINE: Duration = Duration::from_secs(60);

pub fn file(rate_hz: u32) -> String {
    format!(
        r#"<armor version="1"><system><component name="lamp" kind="lamp" rate="{rate_hz}Hz"><parameter name="picture" value="a.png"/></component></system></armor>"#
    )
}

/// A folder of its own, with a first version of the file in it.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("configd-{name}"));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let folder = Self(folder);
        fs::write(folder.file(), file(1)).unwrap();
        folder
    }

    pub fn file(&self) -> PathBuf {
        self.0.join("robot.xml")
    }

    pub fn configd(&self) -> BackgroundConfigd {
        self.configd_of(&self.file())
    }

    pub fn configd_of(&self, file: &Path) -> BackgroundConfigd {
        let configd = BackgroundConfigd::start(ConfigdOptions::new(file)).unwrap();
        expect_taken(&configd, 1);
        configd
    }

    /// Saves as careful editors do: writes a second file, syncs it, and renames it over the first.
    pub fn save(&self, text: &str) {
        let temporary = self.0.join(".robot.xml.new");
        let mut new = fs::File::create(&temporary).unwrap();
        new.write_all(text.as_bytes()).unwrap();
        new.sync_all().unwrap();
        fs::rename(temporary, self.file()).unwrap();
    }
}

/// Looks until it is so.
pub fn wait_for(what: &str, is_so: impl Fn() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < DEADLINE, "{what}: it never was");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The next that is no mere state.
pub fn notice(configd: &BackgroundConfigd) -> Notice {
    loop {
        match configd.notices().recv_timeout(DEADLINE).unwrap() {
            Notice::State(_) | Notice::Readers(_) => {}
            other => return other,
        }
    }
}

pub fn expect_taken(configd: &BackgroundConfigd, wanted: u64) {
    match notice(configd) {
        Notice::Taken { version, .. } => assert_eq!(version, wanted),
        other => panic!("{other:?}"),
    }
}

/// As [`expect_taken`], after a save that may be caught half-written first.
pub fn expect_taken_in_the_end(configd: &BackgroundConfigd, wanted: u64) {
    loop {
        match notice(configd) {
            Notice::Refused { .. } => {}
            Notice::Taken { version, .. } => return assert_eq!(version, wanted),
            other => panic!("{other:?}"),
        }
    }
}

pub fn expect_refused(configd: &BackgroundConfigd, wanted: u64) {
    match notice(configd) {
        Notice::Refused { kept, findings } => {
            assert!(kept == Some(wanted) && findings.has_errors());
        }
        other => panic!("{other:?}"),
    }
}

pub fn expect_restored(configd: &BackgroundConfigd, wanted: u64) {
    match notice(configd) {
        Notice::Restored { version } => assert_eq!(version, wanted),
        other => panic!("{other:?}"),
    }
}

/// Connects as the component, asks once, and leaves.
pub fn ask(address: SocketAddr, from: &str, request: &ConfigRequest) -> ConfigReply {
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

pub fn settings(configd: &BackgroundConfigd) -> ComponentSettings {
    match ask(configd.address(), "lamp", &ConfigRequest::Settings { request: 9 }) {
        ConfigReply::Settings { request: 9, settings } => settings,
        other => panic!("{other:?}"),
    }
}
