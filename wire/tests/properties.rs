//! Properties over generated values: what is encoded comes back, however the stream is cut, and
//! whatever reads it.

use armor_wire::frame::{DATA_HEADER_LEN, DataHeader, FrameKind, FrameReader, append, signal};
use armor_wire::schema::{Field, Schema, Variant, parse, to_json};
use armor_wire::{Array, Message, WireType, codec};
use proptest::prelude::*;
use serde::Serialize;

#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire", view)]
struct Everything {
    flag: bool,
    small: Small,
    numbers: Vec<i64>,
    #[serde(serialize_with = "as_list")]
    bulk: Array<f64>,
    name: String,
    pair: Option<[i8; 2]>,
    steps: Vec<Step>,
    nested: Vec<Vec<Option<String>>>,
}

impl EverythingView<'_> {
    /// The message, copied.
    fn to_message(&self) -> Everything {
        let copy_text = |text: &Option<&str>| text.map(str::to_owned);
        let copy_texts = |texts: &Vec<Option<&str>>| texts.iter().map(copy_text).collect();
        Everything {
            flag: self.flag,
            small: self.small.clone(),
            numbers: self.numbers.clone(),
            bulk: self.bulk.iter().collect(),
            name: self.name.to_owned(),
            pair: self.pair,
            steps: self.steps.clone(),
            nested: self.nested.iter().map(copy_texts).collect(),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire")]
struct Small {
    a: u8,
    b: u16,
    c: u32,
    d: u64,
    e: i16,
    f: i32,
}

#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire")]
enum Step {
    Rest,
    Go { speed_mps: f64, via: Vec<Small> },
}

fn as_list<S: serde::Serializer>(items: &Array<f64>, to: S) -> Result<S::Ok, S::Error> {
    items.as_slice().serialize(to)
}

fn small() -> impl Strategy<Value = Small> {
    any::<(u8, u16, u32, u64, i16, i32)>().prop_map(|(a, b, c, d, e, f)| Small { a, b, c, d, e, f })
}

fn step() -> impl Strategy<Value = Step> {
    let via = prop::collection::vec(small(), 0..4);
    prop_oneof![
        Just(Step::Rest),
        (finite(), via).prop_map(|(speed_mps, via)| Step::Go { speed_mps, via }),
    ]
}

fn finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("JSON has no other numbers", |number| number.is_finite())
}

prop_compose! {
    fn everything()(
        flag in any::<bool>(),
        small in small(),
        numbers in prop::collection::vec(any::<i64>(), 0..6),
        bulk in prop::collection::vec(finite(), 0..6),
        name in ".{0,12}",
        pair in any::<Option<[i8; 2]>>(),
        steps in prop::collection::vec(step(), 0..4),
        nested in prop::collection::vec(prop::collection::vec(any::<Option<String>>(), 0..3), 0..3),
    ) -> Everything {
        Everything { flag, small, numbers, bulk: bulk.into(), name, pair, steps, nested }
    }
}

/// Names as schema text has them.
fn name() -> impl Strategy<Value = String> {
    "[A-Za-z_][A-Za-z0-9_/-]{0,9}".prop_filter("a primitive", |name| parse(name).is_err())
}

fn fields(item: BoxedStrategy<Schema>, least: usize) -> BoxedStrategy<Vec<Field>> {
    let unit = prop::option::of("[!-(*-~]{1,6}");
    let named = (item, unit).prop_map(|(schema, unit)| Field { name: String::new(), schema, unit });
    prop::collection::vec((name(), named), least..4)
        .prop_map(|fields| {
            let numbered = fields.into_iter().enumerate();
            numbered
                .map(|(n, (name, field))| Field { name: format!("{name}{n}"), ..field })
                .collect()
        })
        .boxed()
}

fn any_schema() -> impl Strategy<Value = Schema> {
    let leaf = prop::sample::select(vec![
        Schema::Bool,
        Schema::U8,
        Schema::I16,
        Schema::U64,
        Schema::F32,
        Schema::F64,
        Schema::Text,
    ]);
    leaf.prop_recursive(4, 24, 4, |item| {
        let solid = item.clone().prop_filter("an item takes bytes", |item| item.min_len() > 0);
        let plain = name().prop_map(|name| Variant { name, fields: vec![] });
        let full = (name(), fields(item.clone().boxed(), 1));
        let full = full.prop_map(|(name, fields)| Variant { name, fields });
        let variants = prop::collection::vec(prop_oneof![plain, full], 1..4);
        prop_oneof![
            item.clone().prop_map(|item| Schema::Option(Box::new(item))),
            solid.clone().prop_map(|item| Schema::List(Box::new(item))),
            (solid, 1..9_usize).prop_map(|(item, count)| Schema::Fixed(Box::new(item), count)),
            (name(), fields(item.boxed(), 0))
                .prop_map(|(name, fields)| Schema::Struct { name, fields }),
            (name(), variants).prop_map(|(name, variants)| {
                let numbered = variants.into_iter().enumerate();
                let variants = numbered
                    .map(|(n, v)| Variant { name: format!("{}{n}", v.name), ..v })
                    .collect();
                Schema::Enum { name, variants }
            }),
        ]
    })
}

proptest! {
    #[test]
    fn a_value_comes_back_as_it_was(value in everything()) {
        let bytes = codec::encode(&value).expect("short");
        prop_assert_eq!(bytes.len(), codec::encoded_len(&value).expect("short"));
        prop_assert!(bytes.len() >= Everything::MIN_LEN);
        prop_assert_eq!(codec::decode::<Everything>(&bytes).expect("as encoded"), value);
    }

    #[test]
    fn json_by_schema_is_json_by_type(value in everything()) {
        let bytes = codec::encode(&value).expect("short");
        let json = to_json(&Everything::schema(), &bytes).expect("as encoded");
        prop_assert_eq!(json, serde_json::to_value(&value).expect("plain data"));
    }

    #[test]
    fn a_damaged_value_is_refused_by_all_readers_or_by_none(
        value in everything(), at in any::<prop::sample::Index>(), byte in any::<u8>(),
    ) {
        let mut bytes = codec::encode(&value).expect("short");
        let at = at.index(bytes.len());
        bytes[at] = byte;
        let typed = codec::decode::<Everything>(&bytes);
        let untyped = to_json(&Everything::schema(), &bytes);
        prop_assert_eq!(typed.is_ok(), untyped.is_ok(), "{:?} {:?}", typed, untyped);
        let viewed = codec::view::<Everything>(&bytes);
        prop_assert_eq!(typed.is_ok(), viewed.is_ok(), "{:?} {:?}", typed, viewed);
        if let Ok(view) = viewed {
            prop_assert_eq!(codec::encode(&view.to_message()).expect("short"), bytes);
        }
    }

    #[test]
    fn a_view_borrows_its_arrays_and_texts(value in everything()) {
        let bytes = codec::encode(&value).expect("short");
        let view = codec::view::<Everything>(&bytes).expect("as encoded");
        prop_assert_eq!(&view.to_message(), &value);
        for borrowed in [view.bulk.bytes(), view.name.as_bytes()] {
            let inside = bytes.as_ptr_range().contains(&borrowed.as_ptr());
            prop_assert!(inside || borrowed.is_empty());
        }
    }

    #[test]
    fn an_array_is_a_list(items in any::<Vec<i32>>()) {
        let list = codec::encode(&items).expect("short");
        prop_assert_eq!(&codec::encode(&Array::from(items.clone())).expect("short"), &list);
        prop_assert_eq!(&*codec::decode::<Array<i32>>(&list).expect("a list"), &items);
        prop_assert_eq!(codec::decode::<Vec<i32>>(&list).expect("a list"), items);
        prop_assert_eq!(Array::<i32>::schema(), Vec::<i32>::schema());
    }

    #[test]
    fn a_schema_is_read_as_it_was_written(schema in any_schema()) {
        prop_assert_eq!(parse(&schema.to_string()), Ok(schema));
    }

    #[test]
    fn a_stream_cut_anywhere_is_the_same_frames(
        payloads in prop::collection::vec((0..90_000_usize, any::<u8>()), 1..6),
        cuts in prop::collection::vec(1..70_000_usize, 1..30),
    ) {
        let (mut bytes, mut expected) = (Vec::new(), Vec::new());
        for (sequence, (len, fill)) in (0..).zip(payloads) {
            let header = DataHeader { sequence, stamp_s: 0.5, instance: 1, fresh: fill % 2 == 0 };
            bytes.extend(header.to_bytes(len));
            bytes.resize(bytes.len() + len, fill);
            expected.push((header, vec![fill; len]));
            if fill % 3 == 0 {
                bytes.extend(signal(FrameKind::Beat));
                append(FrameKind::Control, &u64::from(fill), &mut bytes).expect("short");
            }
        }
        prop_assert!(bytes.len() >= DATA_HEADER_LEN);
        let (mut reader, mut found, mut left) = (FrameReader::new(), Vec::new(), bytes.as_slice());
        for cut in cuts.iter().cycle() {
            if left.is_empty() {
                break;
            }
            let space = reader.space();
            let len = (*cut).min(left.len()).min(space.len());
            space[..len].copy_from_slice(&left[..len]);
            reader.filled(len);
            left = &left[len..];
            while let Some(frame) = reader.next_frame().expect("well-formed") {
                if let Ok((header, payload)) = frame.data() {
                    found.push((header, payload.to_vec()));
                }
            }
        }
        prop_assert!(!reader.is_mid_frame());
        prop_assert_eq!(found, expected);
    }
}
