//! What is found out of a system before its recording begins: its time, and what its run is.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, SystemTime};

use armor_inspect::ObservedSystem;
use armor_inspect::systems::RunRecord;
use armor_robotfile::format_date;
use armor_sdk::control::OutputStatus;
use armor_sdk::messages::Clock;
use armor_wire::codec;

use super::split::FileContents;
use crate::playback::PLAYBACK;
use crate::writer::Compression;

/// The data that time follows are latched, so that they come within this time if there are any.
const CLOCK_WITHIN: Duration = Duration::from_millis(200);

/// The data that the time of a system follows, by its file, or by who links to it.
pub(super) fn find_clock(observed: &ObservedSystem, record: Option<&RunRecord>) -> Option<String> {
    // A player brings the time of what it plays, whatever the file specifies.
    let played = format!("{PLAYBACK}.clock");
    let listed = observed.list().map(|listing| listing.data).unwrap_or_default();
    if listed.iter().any(|entry| entry.data == played) {
        return Some(played);
    }
    if let Some(record) = record {
        let configuration = armor_robotfile::load(&record.file).configuration?;
        return configuration.system.clock.map(|clock| clock.source.data());
    }
    let sightings = observed.ask_statuses().ok()?;
    let statuses = sightings.into_iter().filter_map(|sighting| sighting.status.ok());
    let mut outputs = statuses.flat_map(|status| status.outputs);
    let brings_time = |output: &OutputStatus| {
        output.links.iter().any(|link| {
            let process = link.to.split(':').next().unwrap_or_default();
            link.to == armor_sdk::time_link(process)
        })
    };
    outputs.find(brings_time).map(|output| output.data)
}

/// System time now; none if it follows data that have not been published yet.
pub(super) fn find_begin(observed: &ObservedSystem, clock: Option<&str>) -> Option<f64> {
    let Some(clock) = clock else { return Some(observed.timestamp()) };
    let mut tap = observed.tap_within(clock, CLOCK_WITHIN).ok()?;
    let message = tap.next(CLOCK_WITHIN).ok()??;
    codec::decode::<Clock>(&message.payload).ok().map(|reading| reading.clock)
}

/// What each file of the recording begins with.
pub(super) fn describe_recording(
    record: Option<&RunRecord>,
    compression: Compression,
) -> FileContents {
    let now_s = SystemTime::UNIX_EPOCH.elapsed().map_or(0.0, |passed| passed.as_secs_f64());
    let mut about = BTreeMap::from([
        ("armor".into(), env!("CARGO_PKG_VERSION").into()),
        ("begun".into(), format_date(now_s)),
        ("host".into(), armor_socket::host_name()),
    ]);
    let mut files = Vec::new();
    if let Some(record) = record {
        about.insert("system".into(), record.system.clone());
        about.insert("file".into(), record.file.display().to_string());
        let folder = record.file.parent().unwrap_or(Path::new(""));
        // The file itself first, then what it includes; one that is elsewhere has its name alone.
        for path in armor_robotfile::load(&record.file).files {
            let name = path.strip_prefix(folder).ok().or(path.file_name().map(Path::new));
            if let (Some(name), Ok(bytes)) = (name, std::fs::read(&path)) {
                files.push((name.to_string_lossy().into_owned(), bytes));
            }
        }
    }
    FileContents { about, files, compression }
}
