//! A mission begins after all components are registered and linked, so that every subscriber
//! receives the data of the first place from the first message on.

use std::fmt::Write;

use crate::fixture::{Folder, run_to_end};

/// Scans in the log.
const SCANS: usize = 20;

/// A robot that stands in a room 4 m wide, as a CARMEN log.
fn log() -> String {
    let mut log = String::new();
    for scan in 0..SCANS {
        let ranges = "2.0 ".repeat(181);
        let _ = writeln!(log, "FLASER 181 {ranges} 0 0 0 0 0 0 {scan}.5 robot {scan}.5");
    }
    log
}

/// Adds the kind `late-mapper`: the stock kind `grid-slam`, started one second late.
fn late_mapper(folder: &Folder) {
    let stock = format!("{} component grid-slam", env!("CARGO_BIN_EXE_armor"));
    let text = format!(
        "#!/bin/sh\nif [ \"$1\" = --describe ]; then\n  \
         {stock} --describe | sed s/grid-slam/late-mapper/\nelse\n  \
         sleep 1; exec {stock} \"$@\"\nfi\n"
    );
    folder.executable("components/late-mapper", &text);
}

#[test]
fn a_log_is_not_played_before_the_mapper_listens() {
    let folder = Folder::new("gathering");
    late_mapper(&folder);
    folder.write("stand.log", &log());
    let replay = include_str!("../missions/map-from-log.xml");
    assert!(replay.contains("kind=\"grid-slam\""));
    folder.write("late.xml", &replay.replace("\"grid-slam\"", "\"late-mapper\""));
    let arguments = ["run", "late.xml", "--set", "player.file=stand.log", "--for", "60s"];
    let (code, out, err) = run_to_end(&mut folder.armor(&arguments));
    assert!(code == 0 && out.contains("reached its goal"), "{code}\n{out}{err}");
    let trajectory = folder.path().join("out/map-from-log/trajectory.csv");
    let trajectory = std::fs::read_to_string(trajectory).expect("it is written");
    assert_eq!(trajectory.lines().count(), 1 + SCANS, "{trajectory}");
}
