//! What is written is read back: whole, from a moment on, from a file that was cut off, copied.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use armor_sdk::messages::{Number, Odometry};
use armor_wire::codec;
use armor_wire::message::WireType;

use super::*;

const EVERY_S: f64 = 0.1;

fn output_type<T: WireType>(name: &str) -> OutputType {
    OutputType { name: name.into(), schema: T::schema().to_string(), latched: false }
}

fn head(sequence: u64, lost: u64) -> MessageHead {
    MessageHead { sequence, stamp_s: sequence as f64 * EVERY_S, instance: 7, lost }
}

fn number(sequence: u64) -> Vec<u8> {
    codec::encode(&Number { data: sequence as f64 }).unwrap()
}

/// A recording of `count` messages of each of two outputs.
fn record(count: u64, compression: Compression) -> Vec<u8> {
    let about = BTreeMap::from([("system".into(), "office".into())]);
    let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), compression, about).unwrap();
    writer.add_file("office.xml", "application/xml", b"<armor/>").unwrap();
    let numbers = writer.add_output("a.number", &output_type::<Number>("Number")).unwrap();
    let odometry = writer.add_output("b.odometry", &output_type::<Odometry>("Odometry")).unwrap();
    assert_eq!(writer.add_output("a.number", &output_type::<Number>("Number")).unwrap(), numbers);
    for sequence in 0..count {
        let lost = if sequence == 3 { 2 } else { 0 };
        writer.write(numbers, &head(sequence, lost), &number(sequence)).unwrap();
        let message = Odometry { stamp: sequence as f64 * EVERY_S, ..Odometry::default() };
        let payload = codec::encode(&message).unwrap();
        writer.write(odometry, &head(sequence, 0), &payload).unwrap();
        if sequence % 50 == 0 {
            writer.flush().unwrap();
        }
    }
    assert!(writer.write(numbers, &head(count, 0), &[1]).is_err(), "of another layout");
    assert_eq!(writer.count_written(), 2 * count);
    writer.finish().unwrap().into_inner()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn save(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

fn read_all(recording: &mut Recording) -> Vec<RecordedMessage> {
    std::iter::from_fn(|| recording.next_message().unwrap()).collect()
}

fn only(data: &str) -> OutputSelection {
    OutputSelection { include: vec![data.into()], exclude: Vec::new() }
}

fn read_file(path: &Path) -> Vec<RecordedMessage> {
    read_all(&mut Recording::open(path).unwrap())
}

#[test]
fn a_recording_is_read_as_it_was_written() {
    let folder = Folder::new();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let path = folder.save("a.mcap", &record(200, compression));
        let mut recording = Recording::open(&path).unwrap();
        let summary = recording.summary().clone();
        assert!(summary.is_complete);
        assert_eq!(summary.about["system"], "office");
        let files = [("office.xml", "application/xml", 8)];
        let found = summary.files.iter().map(|it| (&*it.name, &*it.media_type, it.len));
        assert!(found.eq(files));
        let outputs =
            summary.outputs.iter().map(|it| (&*it.data, &*it.ros_type, it.messages, it.lost));
        assert!(outputs.eq([
            ("a.number", "std_msgs/msg/Float64", 200, 2),
            ("b.odometry", "nav_msgs/msg/Odometry", 200, 0)
        ]));
        assert_eq!(summary.span_s, Some((0.0, 19.9)));
        let [numbers, _] = &summary.outputs[..] else { panic!("{summary:?}") };
        assert!(numbers.span_s.is_some_and(|(from_s, to_s)| from_s == 0.0 && to_s > 19.8));
        assert!(numbers.rate_hz().is_some_and(|hz| (hz - 10.0).abs() < 1e-9));
        assert_eq!(recording.read_file("office.xml").unwrap().unwrap(), b"<armor/>");
        let messages = read_all(&mut recording);
        assert_eq!(messages.len(), 400);
        for (index, message) in messages.iter().enumerate() {
            let sequence = index as u64 / 2;
            let lost = if index == 6 { 2 } else { 0 };
            assert_eq!(message.head, head(sequence, lost));
            if index % 2 == 0 {
                assert_eq!(message.payload.as_ref().unwrap(), &number(sequence));
            } else {
                let odometry: Odometry = codec::decode(message.payload.as_ref().unwrap()).unwrap();
                assert_eq!(odometry.stamp.to_bits(), (sequence as f64 * EVERY_S).to_bits());
            }
        }
        recording.seek(15.0).unwrap();
        let rest = read_all(&mut recording);
        assert!(rest.len() < 400 && rest.last() == messages.last());
        assert!(rest[0].head.stamp_s <= 15.0, "nothing of that moment is passed over");
    }
}

#[test]
fn a_file_that_was_cut_off_anywhere_is_read_up_to_its_last_flush() {
    let folder = Folder::new();
    let whole = record(120, Compression::Lz4);
    let all = read_file(&folder.save("whole.mcap", &whole));
    let mut most = 0;
    for cut in (8..whole.len()).step_by(97) {
        let path = folder.save("cut.mcap", &whole[..cut]);
        let mut recording = Recording::open(&path).unwrap();
        let messages = read_all(&mut recording);
        assert!(messages.len() >= most && all.starts_with(&messages), "cut at {cut}");
        most = messages.len();
        let summary = recording.summary();
        assert!(!summary.is_complete);
        let counted: u64 = summary.outputs.iter().map(|output| output.messages).sum();
        assert_eq!(counted, messages.len() as u64);
        let last_s = messages.iter().map(|message| message.head.stamp_s).reduce(f64::max);
        assert_eq!(summary.span_s.map(|span| span.1), last_s);
    }
    assert!(most >= 202, "the flush after 101 of each: {most}");
}

#[test]
fn a_copy_has_the_part_of_several_files_in_the_order_of_their_stamps() {
    let folder = Folder::new();
    let first = folder.save("first.mcap", &record(50, Compression::None));
    let second = folder.save("second.mcap", &record(30, Compression::Zstd));
    let part = CopiedPart { from_s: Some(1.0), to_s: Some(2.0), outputs: only("a.number") };
    let sink = Cursor::new(Vec::new());
    let (report, copy) =
        copy_recordings(&[&first, &second], &part, sink, Compression::Lz4, RecordingForm::Armor)
            .unwrap();
    assert_eq!(report, CopyReport { copied: 20, ..CopyReport::default() });
    let path = folder.save("copy.mcap", copy.get_ref());
    let messages = read_file(&path);
    let sequences: Vec<_> = messages.iter().map(|message| message.head.sequence).collect();
    assert_eq!(sequences, (10..20).flat_map(|n| [n, n]).collect::<Vec<_>>());
    let summary = Recording::open(&path).unwrap().summary().clone();
    assert_eq!((summary.about["system"].as_str(), summary.files.len()), ("office", 1));

    let cut_off = folder.save("cut.mcap", &fs::read(&first).unwrap()[..6000]);
    let before = read_file(&cut_off).len() as u64;
    let sink = Cursor::new(Vec::new());
    let (report, copy) = copy_recordings(
        &[&cut_off],
        &CopiedPart::default(),
        sink,
        Compression::None,
        RecordingForm::Armor,
    )
    .unwrap();
    assert_eq!(report, CopyReport { copied: before, ..CopyReport::default() });
    let recovered = Recording::open(&folder.save("recovered.mcap", copy.get_ref())).unwrap();
    assert!(recovered.summary().is_complete);
}

#[test]
fn a_part_begins_with_the_values_that_latched_outputs_have_then() {
    let folder = Folder::new();
    let about = BTreeMap::from([(BEGIN_KEY.to_owned(), "5".to_owned())]);
    let sink = Cursor::new(Vec::new());
    let mut writer = RecordingWriter::new(sink, Compression::None, about).unwrap();
    let latched = OutputType { latched: true, ..output_type::<Number>("Number") };
    let map = writer.add_output("a.map", &latched).unwrap();
    let pose = writer.add_output("a.pose", &output_type::<Number>("Number")).unwrap();
    for sequence in [10, 20] {
        writer.write(map, &head(sequence, 0), &number(sequence)).unwrap();
    }
    for sequence in 50..100 {
        writer.write(pose, &head(sequence, 0), &number(sequence)).unwrap();
    }
    let path = folder.save("a.mcap", writer.finish().unwrap().get_ref());
    assert_eq!(Recording::open(&path).unwrap().summary().begin_s(), Some(5.0));
    let part = CopiedPart { from_s: Some(7.05), to_s: Some(8.0), ..CopiedPart::default() };
    let sink = Cursor::new(Vec::new());
    let (_, copy) =
        copy_recordings(&[&path], &part, sink, Compression::None, RecordingForm::Armor).unwrap();
    let path = folder.save("b.mcap", copy.get_ref());
    let sequences: Vec<_> = read_file(&path).iter().map(|it| it.head.sequence).collect();
    assert_eq!(sequences, [20].into_iter().chain(71..80).collect::<Vec<_>>());
    assert_eq!(Recording::open(&path).unwrap().summary().begin_s(), Some(7.05));
}

#[test]
fn what_is_no_recording_is_refused() {
    let folder = Folder::new();
    assert!(Recording::open(&folder.save("empty.mcap", b"")).is_err());
    assert!(Recording::open(&folder.0.path().join("none.mcap")).is_err());
    let text = folder.save("text.mcap", b"this is no recording, and longer than its first bytes");
    let Err(error) = Recording::open(&text) else { panic!("it was opened") };
    assert_eq!(error.to_string(), "it does not begin as an MCAP file does");
}

#[test]
fn a_recording_for_ros_has_its_topics_and_is_read_as_one_of_ros() {
    let folder = Folder::new();
    let path = folder.save("ours.mcap", &record(20, Compression::Lz4));
    let sink = Cursor::new(Vec::new());
    let all = CopiedPart::default();
    let (report, copy) =
        copy_recordings(&[&path], &all, sink, Compression::Zstd, RecordingForm::Ros2).unwrap();
    assert_eq!(report, CopyReport { copied: 40, ..CopyReport::default() });
    let path = folder.save("ros.mcap", copy.get_ref());
    let recording = Recording::open(&path).unwrap();
    let outputs: Vec<_> = recording.summary().outputs.iter().collect();
    let types: Vec<_> =
        outputs.iter().map(|it| (it.data.as_str(), it.type_name.as_str())).collect();
    assert_eq!(types, [("a.number", "Number"), ("b.odometry", "Odometry")]);
    assert_eq!(outputs[1].ros_type, "nav_msgs/msg/Odometry");
    let messages = read_file(&path);
    assert_eq!(messages.len(), 40);
    for (at, message) in messages.iter().enumerate() {
        let bytes = message.payload.as_ref().unwrap();
        let stamp_s = (at / 2) as f64 * EVERY_S;
        assert!((message.head.stamp_s - stamp_s).abs() < 1e-9);
        if message.data == "b.odometry" {
            let odometry: Odometry = codec::decode(bytes).unwrap();
            assert!((odometry.stamp - stamp_s).abs() < 1e-9, "to the nanosecond");
        } else {
            assert_eq!(*bytes, number(message.head.sequence));
        }
    }
}

/// A topic, its type, the encoding of its messages, its definition, its quality of service, a message.
type ForeignTopic<'a> = (&'a str, &'a str, &'a str, &'a str, &'a str, &'a [u8]);

/// A file of ROS 2 that another program has written: three messages of each topic.
fn write_foreign(topics: &[ForeignTopic<'_>]) -> Vec<u8> {
    let options = mcap::WriteOptions::new().profile("ros2").compression(None);
    let mut file = options.create(Cursor::new(Vec::new())).unwrap();
    for (topic, ros_type, encoding, definition, metadata, bytes) in topics {
        let schema = file.add_schema(ros_type, "ros2msg", definition.as_bytes()).unwrap();
        let metadata = BTreeMap::from([("offered_qos_profiles".into(), (*metadata).into())]);
        let channel_id = file.add_channel(schema, topic, encoding, &metadata).unwrap();
        for sequence in 0..3 {
            let time = 1_000_000_000 * u64::from(sequence + 1);
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence,
                log_time: time,
                publish_time: time,
            };
            file.write_to_known_channel(&header, bytes).unwrap();
        }
    }
    file.finish().unwrap();
    file.into_inner().into_inner()
}

#[test]
fn messages_of_other_programs_are_read_by_their_definition_or_left_out_with_the_reason() {
    let folder = Folder::new();
    let state = [0, 1, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, b'a', 0];
    let path = folder.save(
        "foreign.mcap",
        &write_foreign(&[
            ("/arm/state", "arm_msgs/msg/State", "cdr", "uint8 state\nstring text", "", &state),
            ("/arm/title", "arm_msgs/msg/Title", "cdr", "wstring title", "", &state),
            ("/arm/json", "arm_msgs/msg/Any", "json", "", "", b"{}"),
            ("/arm/unknown", "arm_msgs/msg/Outer", "cdr", "Inner inner", "", &state),
        ]),
    );
    let (sink, all) = (Cursor::new(Vec::new()), CopiedPart::default());
    let (report, copy) =
        copy_recordings(&[&path], &all, sink, Compression::None, RecordingForm::Armor).unwrap();
    assert_eq!((report.copied, report.left_out.count()), (3, 9), "{report:?}");
    let reason = |data: &str| report.left_out.outputs[data].1.clone();
    assert!(reason("/arm/title").contains("title is a wstring"), "{report:?}");
    assert!(reason("/arm/json").contains("the encoding `json`"), "{report:?}");
    assert!(reason("/arm/unknown").contains("lacks the type arm_msgs/Inner"), "{report:?}");
    let path = folder.save("copy.mcap", copy.get_ref());
    let messages = read_file(&path);
    let types = messages.iter().map(|it| (it.data.as_str(), it.output_type.schema.as_str()));
    assert!(types.eq([("arm.state", "State{state:u8,text:string}"); 3]));
    let expected = [&[3][..], &1_u64.to_le_bytes(), b"a"].concat();
    assert_eq!(messages[0].payload.as_ref().unwrap(), &expected);
}

/// The form of a standard message follows from a table, which another version may have otherwise.
#[test]
fn a_type_in_a_form_of_another_version_is_not_misread() {
    let folder = Folder::new();
    let metadata = BTreeMap::from([
        (TYPE_KEY.to_owned(), "Number".to_owned()),
        (SCHEMA_KEY.to_owned(), Number::schema().to_string()),
    ]);
    let record = |definition: &str| {
        let options = mcap::WriteOptions::new().profile(PROFILE).compression(None);
        let mut file = options.create(Cursor::new(Vec::new())).unwrap();
        let schema =
            file.add_schema("std_msgs/msg/Float64", ROS2MSG, definition.as_bytes()).unwrap();
        let channel_id = file.add_channel(schema, "a.number", CDR, &metadata).unwrap();
        let (log_time, publish_time) = (1_000_000_000, 1_000_000_000);
        let header =
            mcap::records::MessageHeader { channel_id, sequence: 0, log_time, publish_time };
        let bytes = [&[0, 1, 0, 0][..], &2.5_f64.to_le_bytes(), &7.0_f64.to_le_bytes()].concat();
        file.write_to_known_channel(&header, &bytes).unwrap();
        file.finish().unwrap();
        let path = folder.save("form.mcap", &file.into_inner().into_inner());
        read_file(&path).remove(0)
    };
    let same = record("# a comment\n\nfloat64 data # in no unit\n");
    assert_eq!(same.decode_as::<Number>(), Ok(Number { data: 2.5 }));
    let other = record("float64 error\nfloat64 data\n");
    let reason = other.payload.clone().unwrap_err();
    assert!(reason.contains("std_msgs/msg/Float64 with other fields"), "{reason}");
    assert_eq!(other.decode_as::<Number>(), Err(reason));
}

#[test]
fn a_type_with_other_fields_is_no_type_of_this_program_and_they_are_named() {
    let message = RecordedMessage {
        data: "a.number".into(),
        output_type: OutputType {
            name: "Number".into(),
            schema: "Number{data:f64,error:f64}".into(),
            latched: false,
        },
        head: MessageHead::default(),
        payload: Ok(vec![0; 16]),
    };
    let expected = "a.number was recorded with other fields than Number has here: \
                    error: only the recording has it";
    assert_eq!(message.decode_as::<Number>(), Err(expected.into()));
}

#[test]
fn an_output_whose_type_has_changed_has_both() {
    let folder = Folder::new();
    let sink = Cursor::new(Vec::new());
    let mut writer = RecordingWriter::new(sink, Compression::None, BTreeMap::new()).unwrap();
    let schemas = ["Value{a:f64}", "Value{a:f64,b:f64}"];
    for (at, schema) in schemas.into_iter().enumerate() {
        let name = "Value".to_owned();
        let output_type = OutputType { name, schema: schema.into(), latched: false };
        let output = writer.add_output("a.value", &output_type).unwrap();
        writer.write(output, &head(at as u64, 0), &vec![0; 8 + 8 * at]).unwrap();
    }
    let bytes = writer.finish().unwrap().into_inner();
    for (name, bytes) in [("whole.mcap", &bytes[..]), ("cut.mcap", &bytes[..bytes.len() - 9])] {
        let path = folder.save(name, bytes);
        let summary = Recording::open(&path).unwrap().summary().clone();
        let [output] = &summary.outputs[..] else { panic!("{summary:?}") };
        assert_eq!(
            (output.schema.as_str(), &*output.earlier_schemas),
            (schemas[1], &[schemas[0].into()][..])
        );
        let read = read_file(&path);
        let types = read.iter().map(|message| message.output_type.schema.as_str());
        assert!(
            types.eq(schemas) && read.iter().all(|message| message.payload.is_ok()),
            "{read:?}"
        );
    }
}

#[test]
fn a_part_of_a_recording_of_ros_begins_with_its_latched_values() {
    let folder = Folder::new();
    let number = [&[0, 1, 0, 0][..], &7.0_f64.to_le_bytes()].concat();
    let (latched, plain) = ("- durability: 1\n", "- durability: 2\n");
    let path = folder.save(
        "foreign.mcap",
        &write_foreign(&[
            ("/a/map", "std_msgs/msg/Float64", "cdr", "float64 data", latched, &number),
            ("/a/pose", "std_msgs/msg/Float64", "cdr", "float64 data", plain, &number),
        ]),
    );
    let held = ["a.map".to_owned(), "a.pose".to_owned()].into();
    let mut recording = Recording::open(&path).unwrap();
    let held = recording.seek_with_held(2.5, &held).unwrap();
    let stamps: Vec<_> = held.values().map(|it| (it.data.as_str(), it.head.stamp_s)).collect();
    assert_eq!(stamps, [("a.map", 2.0), ("a.pose", 2.0)]);
}

#[test]
fn a_recording_for_ros_comes_back_whole() {
    let folder = Folder::new();
    let about = BTreeMap::from([("system".into(), "office".into())]);
    let sink = Cursor::new(Vec::new());
    let mut writer = RecordingWriter::new(sink, Compression::Lz4, about).unwrap();
    let schema = "Own{mode:Mode<On,Off{why:string}>,maxSpeed:?f64(m/s),lists:[[u8]]}";
    let own = OutputType { name: "Own".into(), schema: schema.into(), latched: true };
    let output = writer.add_output("my-arm.own_state", &own).unwrap();
    let payload = [
        &1_u32.to_le_bytes()[..],
        &2_u64.to_le_bytes(),
        b"no",
        &[0],
        &1_u64.to_le_bytes(),
        &2_u64.to_le_bytes(),
        &[5, 6],
    ]
    .concat();
    for sequence in 0..5 {
        let head = MessageHead { lost: sequence / 4, ..head(sequence, 0) };
        writer.write(output, &head, &payload).unwrap();
    }
    let original = folder.save("original.mcap", writer.finish().unwrap().get_ref());
    let copy = |from: &Path, form| {
        let (sink, all) = (Cursor::new(Vec::new()), CopiedPart::default());
        let (report, copy) = copy_recordings(&[from], &all, sink, Compression::Zstd, form).unwrap();
        assert_eq!(report, CopyReport { copied: 5, ..CopyReport::default() });
        folder.save(
            if form == RecordingForm::Ros2 { "ros.mcap" } else { "back.mcap" },
            &copy.into_inner(),
        )
    };
    let ros = copy(&original, RecordingForm::Ros2);
    let ros_summary = Recording::open(&ros).unwrap().summary().clone();
    assert_eq!((ros_summary.about["system"].as_str(), ros_summary.outputs[0].lost), ("office", 1));
    let back = copy(&ros, RecordingForm::Armor);
    let whole = read_file(&original);
    assert_eq!(whole.len(), 5);
    for (before, after) in whole.iter().zip(read_file(&back)) {
        assert_eq!((&before.data, &before.output_type), (&after.data, &after.output_type));
        assert_eq!(before.payload, after.payload);
        assert_eq!(before.head.sequence, after.head.sequence);
    }
}

#[test]
fn a_damaged_chunk_costs_only_what_is_in_it() {
    let folder = Folder::new();
    let bytes = record(200, Compression::Lz4);
    let whole = read_file(&folder.save("whole.mcap", &bytes));
    let mut lost_some = 0;
    for at in (bytes.len() / 10..bytes.len() * 6 / 10).step_by(bytes.len() / 20) {
        let mut damaged = bytes.clone();
        damaged[at..at + 16].iter_mut().for_each(|byte| *byte ^= 0x5a);
        let path = folder.save("damaged.mcap", &damaged);
        let sink = Cursor::new(Vec::new());
        let all = CopiedPart::default();
        let copied = copy_recordings(&[&path], &all, sink, Compression::None, RecordingForm::Armor);
        let Ok((report, copy)) = copied else { continue };
        let rest = read_file(&folder.save("rest.mcap", copy.get_ref()));
        assert!(rest.len() >= whole.len() / 4, "at {at}: {}", rest.len());
        assert!(rest.iter().all(|message| whole.contains(message)), "at {at}");
        lost_some += usize::from(rest.len() < whole.len() && report.damaged_chunks > 0);
    }
    assert!(lost_some >= 3, "{lost_some}");
}
