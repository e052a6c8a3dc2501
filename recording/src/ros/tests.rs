//! Random types and messages survive the way to ROS and back; what is damaged is refused.

use armor_sdk::messages::{
    FrameTransform, FrameTransforms, LaserScan, NavSatFix, NavSatStatus, Odometry, Path,
    PoseStamped,
};
use armor_wire::codec;
use armor_wire::message::WireType;
use armor_wire::schema::{Field, Schema, Variant, parse};
use proptest::prelude::*;

use super::*;

fn names() -> impl Strategy<Value = String> {
    prop_oneof!["[a-z]{1,4}", "[A-Z][a-z_]{0,3}", Just("stamp".into()), Just("_x".into())]
}

fn fields(inner: BoxedStrategy<Schema>) -> impl Strategy<Value = Vec<Field>> {
    // Armor has no lists of values without bytes.
    proptest::collection::vec((names(), inner), 1..4)
        .prop_map(|fields| fields.iter().map(|(n, s)| Field::new(n, s.clone())).collect())
}

fn schemas() -> impl Strategy<Value = Schema> {
    let leaf = prop_oneof![
        Just(Schema::Bool),
        Just(Schema::U8),
        Just(Schema::I16),
        Just(Schema::U32),
        Just(Schema::I64),
        Just(Schema::F32),
        Just(Schema::F64),
        Just(Schema::Text),
    ];
    leaf.prop_recursive(3, 24, 4, |inner| {
        let inner = inner.boxed();
        prop_oneof![
            inner.clone().prop_map(|item| Schema::Option(Box::new(item))),
            inner.clone().prop_map(|item| Schema::List(Box::new(item))),
            (inner.clone(), 1_usize..4).prop_map(|(item, n)| Schema::Fixed(Box::new(item), n)),
            ("[A-Z][a-z]{0,2}", fields(inner.clone()), any::<bool>()).prop_map(
                |(name, mut fields, has_header)| {
                    if has_header {
                        fields.insert(0, Field::new("frame", Schema::Text));
                        fields.insert(0, Field::with_unit("stamp", Schema::F64, "s"));
                    }
                    Schema::Struct { name, fields }
                }
            ),
            ("[A-Z][a-z]{0,2}", proptest::collection::vec(fields(inner), 1..4)).prop_map(
                |(name, variants)| {
                    let variants = variants.into_iter().enumerate();
                    let named =
                        variants.map(|(i, fields)| Variant { name: format!("V{i}"), fields });
                    Schema::Enum { name, variants: named.collect() }
                }
            ),
        ]
    })
}

/// A value of a schema, made of `dice`.
fn write_value(schema: &Schema, dice: &mut impl FnMut() -> u64, out: &mut Vec<u8>) {
    match schema {
        Schema::Bool => out.push((dice() % 2) as u8),
        Schema::F64 => out.extend_from_slice(&((dice() % 4000) as f64 * 0.07).to_le_bytes()),
        Schema::Text => {
            let text = &"größer als \0 nichts"[..[0, 2, 4, 11][dice() as usize % 4]];
            out.extend_from_slice(&(text.len() as u64).to_le_bytes());
            out.extend_from_slice(text.as_bytes());
        }
        Schema::Option(item) => {
            let is_there = dice().is_multiple_of(2);
            out.push(is_there.into());
            if is_there {
                write_value(item, dice, out);
            }
        }
        Schema::List(item) => {
            let count = dice() % 4;
            out.extend_from_slice(&count.to_le_bytes());
            (0..count).for_each(|_| write_value(item, dice, out));
        }
        Schema::Fixed(item, count) => (0..*count).for_each(|_| write_value(item, dice, out)),
        Schema::Struct { fields, .. } => {
            fields.iter().for_each(|field| write_value(&field.schema, dice, out));
        }
        Schema::Enum { variants, .. } => {
            let index = dice() as usize % variants.len();
            out.extend_from_slice(&(index as u32).to_le_bytes());
            let fields = &variants[index].fields;
            fields.iter().for_each(|field| write_value(&field.schema, dice, out));
        }
        number => out.extend((0..number.min_len()).map(|_| dice() as u8)),
    }
}

fn dice(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    }
}

proptest! {
    #[test]
    fn a_message_of_any_type_survives(schema in schemas(), seed in any::<u64>()) {
        let mut payload = Vec::new();
        write_value(&schema, &mut dice(seed), &mut payload);
        let message = RosMessage::new(&schema);
        let ros = message.encode(&payload).unwrap();
        prop_assert_eq!(message.decode(&ros.bytes, &ros.stamps_s), Ok(payload), "{}", schema);
        let read = read_definition(message.name(), message.definition()).unwrap();
        let again = RosMessage::new(&read);
        let decoded = again.decode(&ros.bytes, &[]).unwrap();
        prop_assert_eq!(again.encode(&decoded).unwrap().bytes, ros.bytes, "{}", read);
        for line in message.definition().lines() {
            let is_field = line.split(' ').count() == 2 && !line.starts_with("MSG:");
            let name = line.split(' ').nth(1).unwrap_or_default();
            let is_name = name.starts_with(|c: char| c.is_ascii_lowercase())
                && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
                && !name.contains("__");
            prop_assert!(!is_field || is_name, "{line}");
        }
    }

    #[test]
    fn damaged_bytes_are_refused_or_read_and_never_more(schema in schemas(), seed in any::<u64>(), noise in proptest::collection::vec(any::<u8>(), 0..64)) {
        let message = RosMessage::new(&schema);
        let _ = message.encode(&noise);
        let mut payload = Vec::new();
        write_value(&schema, &mut dice(seed), &mut payload);
        let mut bytes = message.encode(&payload).unwrap().bytes;
        for (at, byte) in noise.iter().enumerate() {
            let len = bytes.len();
            bytes[(at * 7 + usize::from(*byte)) % len] ^= byte;
            let _ = message.decode(&bytes, &[]);
        }
        let _ = message.decode(&noise, &[]);
        let mut short = payload.clone();
        if short.pop().is_some() {
            prop_assert!(message.encode(&short).is_err());
        }
        payload.push(0);
        prop_assert!(message.encode(&payload).is_err());
    }
}

fn ros<T: WireType>(value: &T) -> (RosMessage, RosBytes) {
    let message = RosMessage::new(&T::schema());
    let payload = codec::encode(value).unwrap();
    let ros = message.encode(&payload).unwrap();
    assert_eq!(message.decode(&ros.bytes, &ros.stamps_s), Ok(payload));
    (message, ros)
}

#[test]
fn a_scan_is_that_of_ros() {
    let scan = LaserScan {
        stamp: 3.25,
        frame: "laser".into(),
        angle_min: -1.0,
        ranges: vec![1.0, 2.0].into(),
        intensities: vec![9.0].into(),
        ..LaserScan::default()
    };
    let (message, ros) = ros(&scan);
    assert_eq!(message.name(), "sensor_msgs/msg/LaserScan");
    let definition = message.definition();
    assert!(definition.starts_with("std_msgs/Header header\nfloat32 angle_min\n"), "{definition}");
    assert!(definition.contains("\nfloat32[] ranges\nfloat32[] intensities\n=="), "{definition}");
    assert!(definition.contains("MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n"));
    assert!(ros.stamps_s.is_empty(), "nanoseconds express it");
    // Header: encapsulation, 3 s, 250,000,000 ns, "laser".
    assert_eq!(ros.bytes[..16], [0, 1, 0, 0, 3, 0, 0, 0, 0x80, 0xb2, 0xe6, 0x0e, 6, 0, 0, 0]);
    assert_eq!(&ros.bytes[16..22], b"laser\0");
    // Two gap bytes, then the first angle.
    assert_eq!(ros.bytes[22..28], [0, 0, 0, 0, 0x80, 0xbf]);
    assert!(ros.bytes.ends_with(&[1, 0, 0, 0, 0, 0, 0x10, 0x41]), "intensities are the last");
}

#[test]
fn transforms_have_the_stamp_of_the_message_and_stamps_are_exact() {
    let transform =
        FrameTransform { parent: "map".into(), child: "odom".into(), ..Default::default() };
    let stamp = 0.1 + 0.2;
    let both = FrameTransforms { stamp, transforms: vec![transform.clone(), transform] };
    let (message, bytes) = ros(&both);
    assert_eq!(message.name(), "tf2_msgs/msg/TFMessage");
    assert_eq!(bytes.stamps_s, [stamp]);
    for name in ["geometry_msgs/TransformStamped", "geometry_msgs/Transform", "std_msgs/Header"] {
        assert!(message.definition().contains(&format!("MSG: {name}\n")), "{name}");
    }
    let rounded = message.decode(&bytes.bytes, &[]).unwrap();
    let rounded: FrameTransforms = codec::decode(&rounded).unwrap();
    assert!((rounded.stamp - stamp).abs() < 1e-9, "without the exact stamp, the first transform's");
    ros(&FrameTransforms { stamp, transforms: Vec::new() });
    let pose = PoseStamped { stamp: 1.1, frame: "map".into(), ..Default::default() };
    ros(&Path { stamp: 0.7 * 3.0, frame: "map".into(), poses: vec![pose; 3] });
}

#[test]
fn names_of_ros_stand_for_numbers_of_armor() {
    let fix = NavSatFix { status: NavSatStatus::NoFix, latitude: 48.0, ..Default::default() };
    let (message, bytes) = ros(&fix);
    assert!(
        message
            .definition()
            .contains("MSG: sensor_msgs/NavSatStatus\nint8 status\nuint16 service\n")
    );
    // Behind the header: seconds, nanoseconds, the empty frame.
    assert_eq!(bytes.bytes[4 + 13], 0xff, "STATUS_NO_FIX is -1");
    let (message, _) = ros(&Odometry::default());
    assert!(message.definition().starts_with("std_msgs/Header header\nstring child_frame_id\n"));
}

#[test]
fn another_type_of_a_standard_name_is_armors_own() {
    let schema = parse("LaserScan{stamp:f64(s),frame:string,Range-Max:f32(m),class:[u8]}")
        .unwrap_or(Schema::Struct {
            name: "LaserScan".into(),
            fields: vec![Field::new("RangeMax", Schema::F32)],
        });
    assert_eq!(RosMessage::new(&schema).name(), "armor_msgs/msg/LaserScan");
}

#[test]
fn every_line_of_the_table_names_all_fields_of_its_type() {
    for standard in standard::list_standard() {
        let message = RosMessage::new(standard.schema());
        assert_eq!(message.name(), standard.name.replacen('/', "/msg/", 1));
        let mut payload = Vec::new();
        write_value(standard.schema(), &mut dice(7), &mut payload);
        let ros = message.encode(&payload).unwrap();
        assert_eq!(message.decode(&ros.bytes, &ros.stamps_s), Ok(payload), "{}", standard.name);
    }
}
