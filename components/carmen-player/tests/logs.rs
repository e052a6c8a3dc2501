//! Reads real logs to their end: no scan is missing and none is malformed.

// A test that cannot continue may panic.
#![allow(clippy::unwrap_used)]

use armor_carmen_player::log::CarmenLog;
use armor_carmen_player::record::LogRecord;
use std::path::PathBuf;

/// Folder with `laser/`; without `ARMOR_DATA` the test is skipped, except under CI.
fn laser_logs() -> Option<PathBuf> {
    let data = std::env::var_os("ARMOR_DATA");
    assert!(data.is_some() || std::env::var_os("CI").is_none(), "ARMOR_DATA is not set");
    data.map(|folder| PathBuf::from(folder).join("laser"))
}

#[test]
fn every_scan_of_every_log_is_read() {
    let Some(folder) = laser_logs() else {
        println!("skipped: ARMOR_DATA is not set");
        return;
    };
    let expected = [
        ("intel", 910, 180),
        ("aces", 440, 180),
        ("freiburg-079", 4791, 360),
        ("edmonton", 340, 180),
        ("acapulco", 861, 181),
    ];
    for (name, scans, beams) in expected {
        let mut log = CarmenLog::open(&folder.join(format!("{name}.log.gz"))).unwrap();
        for record in log.by_ref() {
            if let LogRecord::Scan(scan) = record.unwrap() {
                assert_eq!(scan.ranges_m.len(), beams, "{name}");
            }
        }
        let tally = log.tally();
        assert_eq!((tally.scans, tally.malformed, tally.unknown), (scans, 0, 0), "{name}");
    }
}
