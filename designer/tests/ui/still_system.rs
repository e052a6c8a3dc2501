//! A system that is shown without running: what one process reports, a radar that publishes tracks,
//! and a mission that plays. The measurement of the frames shows it too.

use std::time::Duration;

use armor_inspect::{SystemEvent, SystemPicture};
use armor_marking::{Marking, MarkingStage};
use armor_sdk::control::{Answer, OutputStatus, RunState, Status};
use armor_sdk::directory::DirectoryChange;
use armor_wire::registry::ComponentEntry;

/// The entry of a component in the registry.
pub fn entry(name: &str) -> ComponentEntry {
    ComponentEntry {
        name: name.into(),
        kind: "bench".into(),
        instance: 1,
        pid: 7,
        host: "here".into(),
        endpoint: "127.0.0.1:1".into(),
    }
}

/// What an active component without ports reports.
pub fn status(name: &str) -> Status {
    Status {
        name: name.into(),
        kind: "bench".into(),
        state: RunState::Active,
        activation: 1,
        controllable: true,
        uptime_s: 1.0,
        exec_calls: 0,
        skipped_ticks: 0,
        skipped_share: 0.0,
        clock_offset_s: 0.0,
        clock_error_s: None,
        last_error: String::new(),
        untaken_events: 0,
        time_s: 0.0,
        busy: false,
        call: None,
        outputs: Vec::new(),
        inputs: Vec::new(),
    }
}

/// A radar that publishes tracks.
pub fn radar() -> SystemPicture {
    let output = OutputStatus {
        id: "tracks".into(),
        data: "radar.tracks".into(),
        type_name: "Tracks".into(),
        published: 1,
        published_bytes: 0,
        links: Vec::new(),
    };
    let status = Status { outputs: vec![output], ..status("radar") };
    let mut picture = SystemPicture::default();
    for event in [
        SystemEvent::Registry(DirectoryChange::Appeared(entry("radar"))),
        SystemEvent::Connected("radar".into(), 1),
        SystemEvent::Answered("radar".into(), 1, Answer::Status { request: 1, status }),
    ] {
        picture.handle_event(event, Duration::ZERO);
    }
    picture
}

/// A mission that plays, with no token anywhere. No clock has been received, so no time passes.
pub fn playing(mission: &str, now_at_s: f64) -> Marking {
    Marking {
        stamp: 0.0,
        mission: mission.into(),
        now_at_s,
        clock: String::new(),
        stage: MarkingStage::Playing,
        why: String::new(),
        places: Vec::new(),
        in_flight: Vec::new(),
        enabled: Vec::new(),
        waiting: Vec::new(),
        variables: Vec::new(),
        guards: Vec::new(),
        dates: Vec::new(),
        components: Vec::new(),
        fired: 0,
        history: Vec::new(),
        late_reports: 0,
        unheard_reports: 0,
        unwritten_orders: 0,
        pause: None,
        holder: None,
        link_lost_at_s: None,
        confirmations: Vec::new(),
        orders: Vec::new(),
        version: 0,
        version_since_at_s: 0.0,
        change: None,
    }
}
