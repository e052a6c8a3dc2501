//! What `#[derive(Message)]` makes of every shape of type: name, schema, bytes, and back.

use armor_wire::schema::{hash_text, parse, to_json};
use armor_wire::{Array, Message, codec};
use serde_json::{Value, json};

#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
struct Empty;

#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire", name = "geometry_msgs/Point")]
struct Point {
    #[message(unit = "m")]
    x: f32,
    #[message(unit = "m")]
    r#type: f32,
}

#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
struct Pair(u8, String);

#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
enum Level {
    Low,
    High { margin: f64, encoder: bool },
    Both(u8, Option<i16>),
}

#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
struct Everything {
    nothing: Empty,
    points: [Point; 2],
    pairs: Vec<Pair>,
    levels: Vec<Level>,
    matrix: [[i32; 2]; 2],
    bulk: Array<u16>,
    boxed: Box<Option<Vec<u64>>>,
    decoder: bool,
}

fn everything() -> Everything {
    let point = |x| Point { x, r#type: -x };
    Everything {
        nothing: Empty,
        points: [point(0.5), point(1.5)],
        pairs: vec![Pair(1, "é".into()), Pair(2, String::new())],
        levels: vec![
            Level::Low,
            Level::High { margin: 0.25, encoder: true },
            Level::Both(7, Some(-2)),
        ],
        matrix: [[1, 2], [3, -4]],
        bulk: Array::from(vec![1, 65535]),
        boxed: Box::new(Some(vec![u64::MAX])),
        decoder: false,
    }
}

fn check<T: Message + PartialEq + std::fmt::Debug>(
    value: &T,
    name: &str,
    schema: &str,
    min_len: usize,
    json: &Value,
) {
    assert_eq!(T::NAME, name);
    assert_eq!(T::schema().to_string(), schema);
    assert_eq!(parse(schema), Ok(T::schema()));
    assert_eq!(T::schema().hash(), hash_text(schema));
    assert_eq!((T::MIN_LEN, T::schema().min_len()), (min_len, min_len), "{schema}");
    let bytes = codec::encode(value).expect("short");
    assert_eq!(codec::encoded_len(value).expect("short"), bytes.len());
    assert_eq!(codec::decode::<T>(&bytes).expect("as encoded"), *value);
    assert_eq!(to_json(&T::schema(), &bytes).as_ref(), Ok(json), "{schema}");
    for len in 0..bytes.len() {
        assert!(codec::decode::<T>(&bytes[..len]).is_err(), "{len} bytes of {schema}");
        assert!(to_json(&T::schema(), &bytes[..len]).is_err(), "{len} bytes of {schema}");
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(matches!(codec::decode::<T>(&longer), Err(codec::DecodeError::LeftOver(1))));
}

#[test]
fn a_unit_struct() {
    check(&Empty, "Empty", "Empty{}", 0, &json!({}));
}

#[test]
fn a_struct_with_another_name_units_and_a_raw_field() {
    let schema = "geometry_msgs/Point{x:f32(m),type:f32(m)}";
    let json = json!({"x": 0.1, "type": -2.0});
    check(&Point { x: 0.1, r#type: -2.0 }, "geometry_msgs/Point", schema, 8, &json);
}

#[test]
fn a_tuple_struct() {
    let json = json!({"f0": 3, "f1": "hi"});
    check(&Pair(3, "hi".into()), "Pair", "Pair{f0:u8,f1:string}", 9, &json);
}

#[test]
fn an_enum_with_and_without_data() {
    let schema = "Level<Low,High{margin:f64,encoder:bool},Both{f0:u8,f1:?i16}>";
    check(&Level::Low, "Level", schema, 4, &json!("Low"));
    let both = json!({"Both": {"f0": 9, "f1": null}});
    check(&Level::Both(9, None), "Level", schema, 4, &both);
    let high = json!({"High": {"margin": 0.5, "encoder": true}});
    check(&Level::High { margin: 0.5, encoder: true }, "Level", schema, 4, &high);
}

#[test]
fn a_struct_of_everything() {
    let schema = "Everything{nothing:Empty{},points:[geometry_msgs/Point{x:f32(m),type:f32(m)};2],\
        pairs:[Pair{f0:u8,f1:string}],\
        levels:[Level<Low,High{margin:f64,encoder:bool},Both{f0:u8,f1:?i16}>],\
        matrix:[[i32;2];2],bulk:[u16],boxed:?[u64],decoder:bool}";
    let json = json!({
        "nothing": {},
        "points": [{"x": 0.5, "type": -0.5}, {"x": 1.5, "type": -1.5}],
        "pairs": [{"f0": 1, "f1": "é"}, {"f0": 2, "f1": ""}],
        "levels": ["Low", {"High": {"margin": 0.25, "encoder": true}}, {"Both": {"f0": 7, "f1": -2}}],
        "matrix": [[1, 2], [3, -4]],
        "bulk": [1, 65535],
        "boxed": [u64::MAX],
        "decoder": false,
    });
    check(&everything(), "Everything", schema, 16 + 8 + 8 + 16 + 8 + 1 + 1, &json);
}

#[test]
fn an_unknown_variant_is_refused() {
    let error = codec::decode::<Level>(&[3, 0, 0, 0]).expect_err("there are three");
    assert!(error.to_string().contains("unknown variant"), "{error}");
}
