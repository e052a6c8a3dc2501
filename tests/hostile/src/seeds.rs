//! Well-formed inputs of each decoder, as the formats are today. `fuzz/corpus` keeps some of them.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use armor_exchange::{PlanFormat, read_plan, write_plan};
use armor_executive::journal;
use armor_grid_slam::config::Config;
use armor_grid_slam::pose::Pose as SlamPose;
use armor_grid_slam::recorder::StateRecorder;
use armor_grid_slam::scan::MapperScan;
use armor_grid_slam::slam::Slam;
use armor_grid_slam::state::{StateFit, StateHeader, encode_header};
use armor_keys::invitations::{InvitationOrder, Invitations, Secret};
use armor_keys::{Authority, KeyHolder, KeyPurpose, Validity};
use armor_memory::{PageLayout, PageWords, RingEntry, RingWriter};
use armor_petri::file::{pnml, tina};
use armor_recording::{Compression, MessageHead, OutputType, RecordingWriter};
use armor_sdk::messages::LaserScan;
use armor_wire::acting::KeyRole;
use armor_wire::codec;
use armor_wire::datagram::{DatagramReceiver, DatagramSender};
use armor_wire::frame::DataHeader;
use armor_wire::message::{Message, WireType};
use armor_wire::shared_memory::write_slot_header;

use crate::entry::SEPARATOR;

const GUARDS: [&str; 7] = [
    "battery < 30% and not charger.state.docked",
    "round == 2 or laser.scan.range_min >= 0.25m",
    "a.b.c + 3 * (x - 2) <= 10 and (not y or z != 0)",
    "never over and round != 3",
    "duration(home) <= 10min",
    "explore leads to home",
    "always reachable(hold)",
];

const PNML: &str = r#"<pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml">
<net id="n" type="http://www.pnml.org/version-2009/grammar/ptnet"><name><text>n</text></name><page id="g">
<place id="p"><name><text>first</text></name><graphics><position x="20" y="-3.5"/></graphics>
<initialMarking><text>3</text></initialMarking></place><place id="q"/>
<transition id="t"/><transition id="u"/>
<arc id="a" source="p" target="t"><inscription><text>2</text></inscription></arc>
<arc id="b" source="t" target="q"/><arc id="c" source="q" target="u"/><arc id="d" source="u" target="p"/>
</page></net></pnml>"#;

const TINA: &str = "net {a net}\npl p : first (3)\npl q (2K)\ntr t : go [0,4.5] p*2 q?1 -> q\n\
                    tr u [2,w[ q?-3 p -> p*4 q\npr u > t\n# end\n";

const WORLD: &str = r##"<svg width="10" height="8"><!-- walls --><g transform="translate(1,2) rotate(30) scale(1.5)">
<rect x="-3" y="-3" width="6" height="6"/><polyline points="0,0 1,2 -1.5,3e-1"/>
<path d="M 1 1 l 2 0 h-1 v2 H 3 V-1 L 2 2 z"/><line x1="0" y1="0" x2="1" y2="1"/></g>
<circle id="start" cx="1" cy="0.5" r="0.2" transform="rotate(90)"/>
<circle class="start" id="blue" cx="2" cy="0.5"/><polygon points="2,2 3,2 3,3"/></svg>"##;

const WAYPOINTS: &str = "QGC WPL 110\n0 1 0 16 0 0 0 0 48.1 2.1 35 1\n\
                         1 0 3 22 0 0 0 0 0 0 20 1\n2 0 3 16 5 0 0 0 48.2 2.2 20 1\n\
                         3 0 2 178 1 4 -1 0 0 0 0 1\n4 0 2 177 2 3 0 0 0 0 0 1\n";

const AREA: &str = r#"{"type":"FeatureCollection","features":[
{"type":"Feature","properties":{"kind":"no-go"},"geometry":{"type":"Polygon","coordinates":[[[2,48],[2.2,48],[2.2,48.2],[2,48]]]}},
{"type":"Feature","properties":{"kind":"stay-in","radius_m":50},"geometry":{"type":"Point","coordinates":[2.1,48.1]}},
{"type":"Feature","properties":{"kind":"rally","name":"R"},"geometry":{"type":"Point","coordinates":[2.1,48.1]}}]}"#;

const LOG: &str = "# a log\nPARAM robot_front_laser_max 81.9\n\
ODOM 0.1 0.2 0.3 0.4 0.5 0.6 10.5 host 10.6\n\
FLASER 4 1.0 2.5 81.9 0.3 0.1 0.2 0.3 0.1 0.2 0.3 10.5 host 10.6\n\
ROBOTLASER1 0 -1.57 3.14 0.785 81.9 0.01 0 5 1 2 3 4 5 0 1 2 3 4 5 6 0.1 0.2 0.3 0 0 11.5 host 1.0\n\
SYNC x\n";

/// The inputs of the decoder called `name`.
///
/// # Errors
/// If one cannot be made; `folder` is for temporary files.
pub fn make_seeds(name: &str, folder: &Path) -> Result<Vec<Vec<u8>>> {
    let text = |texts: &[&str]| texts.iter().map(|text| text.as_bytes().to_vec()).collect();
    Ok(match name {
        "guards" => text(&GUARDS),
        "pnml" => with_written(PNML, pnml::write(&pnml::read(PNML)?)),
        "tina" => with_written(TINA, tina::write(&pnml::read(PNML)?)?),
        "worlds" => text(&[WORLD]),
        "logs" => text(&[LOG]),
        "journals" => vec![make_journal(folder)?],
        "keys" => make_keys()?,
        "states" => vec![make_state()],
        "rings" => make_rings(),
        "datagrams" => make_datagrams(),
        "recordings" => make_recordings()?,
        "plans" => make_plans()?,
        "pictures" => make_pictures(),
        _ => return Err(anyhow!("there is no decoder called {name}")),
    })
}

/// A small picture of each kind: `ARMOR_BLESS=1 cargo test -p armor-tiles` writes them.
fn make_pictures() -> Vec<Vec<u8>> {
    let pictures: [&[u8]; 8] = [
        include_bytes!("../pictures/a.png"),
        include_bytes!("../pictures/a.jpg"),
        include_bytes!("../pictures/a.pmtiles"),
        include_bytes!("../pictures/a.mbtiles"),
        include_bytes!("../pictures/a.tif"),
        include_bytes!("../pictures/a.yaml"),
        include_bytes!("../pictures/a.svg"),
        include_bytes!("../pictures/a.geojson"),
    ];
    (0..).zip(pictures).map(|(kind, picture)| [&[kind], picture].concat()).collect()
}

/// A plan with a fence and a rally point, in each format.
fn make_plans() -> Result<Vec<Vec<u8>>> {
    let mut plan = read_plan(WAYPOINTS, PlanFormat::WaypointList)?;
    let area = read_plan(AREA, PlanFormat::GeoJson)?;
    (plan.fences, plan.rally_points) = (area.fences, area.rally_points);
    let mut plans = Vec::new();
    for format in PlanFormat::ALL {
        plans.push(write_plan(&plan, *format)?.0.into_bytes());
    }
    Ok(plans)
}

/// Small recordings: complete ones of each compression, and one whose recorder was killed.
fn make_recordings() -> Result<Vec<Vec<u8>>> {
    let mut recordings = Vec::new();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let about = BTreeMap::from([("system".to_owned(), "office".to_owned())]);
        let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), compression, about)?;
        writer.add_file("office.xml", "application/xml", b"<armor/>")?;
        let output_type = OutputType {
            name: LaserScan::NAME.into(),
            schema: LaserScan::schema().to_string(),
            latched: true,
        };
        let output = writer.add_output("laser.scan", &output_type)?;
        for sequence in 0..6 {
            let stamp_s = sequence as f64 / 10.0;
            let head = MessageHead { sequence, stamp_s, instance: 7, lost: sequence / 4 };
            let scan = LaserScan {
                stamp: stamp_s,
                frame: "laser".into(),
                ranges: vec![1.0, 2.5].into(),
                ..LaserScan::default()
            };
            writer.write(output, &head, &codec::encode(&scan)?)?;
            if sequence == 3 {
                writer.flush()?;
                writer.add_file_at(0.35, "versions/2/office.xml", "application/xml", b"<a/>")?;
            }
        }
        recordings.push(writer.finish()?.into_inner());
    }
    // Without its summary and half of its last chunk.
    let killed = recordings[0].len() / 2;
    recordings.push(recordings[0][..killed].to_vec());
    Ok(recordings)
}

/// A page with entries in its ring, and a slot with a message.
fn make_rings() -> Vec<Vec<u8>> {
    let layout = PageLayout { cells: 4, slots: 8 };
    let words: Vec<_> = (0..layout.count_words()).map(|_| AtomicU64::new(0)).collect();
    let page = PageWords::of(&words, layout);
    let mut writer = RingWriter::default();
    for slot in 1..=6 {
        page.lend(slot);
        writer.push(page, RingEntry { slot, fresh: slot == 3 });
    }
    let words = words.iter().flat_map(|word| word.load(Ordering::Relaxed).to_be_bytes());
    let page = [layout.cells as u8 - 1, layout.slots as u8 - 1].into_iter().chain(words).collect();
    let header = DataHeader { sequence: 3, stamp_s: 1.5, instance: 7, fresh: false };
    let mut slot = vec![9; 200];
    write_slot_header(&mut slot, &header, 30);
    vec![page, slot]
}

/// Messages of several lengths in datagrams, and the receipts for them.
fn make_datagrams() -> Vec<Vec<u8>> {
    let mut receiver = DatagramReceiver::new(0, 3);
    let mut sender = DatagramSender::new(0, 3, Duration::ZERO);
    let mut input = Vec::new();
    for (sequence, len) in [(4, 10), (5, 3000), (6, 0)] {
        let header = DataHeader { sequence, stamp_s: 1.5, instance: 7, fresh: sequence == 4 };
        let mut sent: Vec<Vec<u8>> = Vec::new();
        let payload = Arc::from(vec![7; len]);
        sender.publish(&header, &payload, Duration::ZERO, |bytes| sent.push(bytes.into()));
        receiver.receive(&sent[0]);
        sent.push(receiver.write_receipt());
        for datagram in sent {
            input.extend_from_slice(&(datagram.len() as u16).to_le_bytes());
            input.extend(datagram);
        }
    }
    vec![input]
}

fn with_written(text: &str, written: String) -> Vec<Vec<u8>> {
    vec![text.as_bytes().to_vec(), written.into_bytes()]
}

/// A journal of several lives, and its state file.
fn make_journal(folder: &Path) -> Result<Vec<u8>> {
    let path = folder.join("executive.journal");
    for _ in 0..4 {
        journal::rest(&path)?;
    }
    let state = std::fs::read(journal::state_path(&path)).context("its state file")?;
    // The space that is reserved after the last line.
    let mut journal = std::fs::read(&path)?;
    journal.retain(|byte| *byte != SEPARATOR);
    Ok([&journal[..], &[SEPARATOR], &state].concat())
}

/// The state of a mapper after two scans.
fn make_state() -> Vec<u8> {
    let fit = StateFit::of(&Config::default());
    let header = StateHeader { run: "00000000000000a1".into(), epoch: String::new(), fit };
    let (mut bytes, mut slam) = (encode_header(&header), Slam::new(Config::default()));
    let mut recorder = StateRecorder::default();
    for step in 0..2 {
        let odometry = SlamPose::new(0.3 * f64::from(step), 0.0, 0.0);
        let (angle_min_rad, increment_rad, range_max_m) = (-1.5, 0.1, 20.0);
        let ranges_m = (0..30).map(|beam| 2.0 + 0.1 * beam as f32).collect();
        let stamp_s = f64::from(step);
        let range_min_m = 0.05;
        let scan = MapperScan {
            stamp_s,
            angle_min_rad,
            increment_rad,
            range_min_m,
            range_max_m,
            ranges_m,
        };
        if slam.add(odometry, &scan).drawn {
            recorder.scan_drawn(slam.travelled_m(), scan);
        }
        bytes.extend(recorder.take_batch(&slam, odometry));
    }
    bytes
}

fn make_keys() -> Result<Vec<Vec<u8>>> {
    let authority = Authority::create(0).map_err(|why| anyhow!(why))?;
    let mut seeds = vec![b"# revoked\n00112233445566778899aabbccddeeff alice\n".to_vec()];
    let holder = KeyHolder { name: "robot".into(), purpose: KeyPurpose::Host };
    let key = authority.issue_key(holder, Validity::days_from(0, 1)).map_err(|why| anyhow!(why))?;
    seeds.push(key.text.into_bytes());
    let mut invitations = Invitations::default();
    let order =
        InvitationOrder { name: "alice".into(), role: KeyRole::Operator, for_s: 60, devices: 1 };
    let (link, session) = (Secret::new([1; 20]), Secret::new([2; 20]));
    invitations.invite(&order, &link, 0).map_err(|why| anyhow!(why))?;
    invitations.redeem(&link, &session, None, 1)?;
    seeds.push(invitations.to_text().into_bytes());
    Ok(seeds)
}
