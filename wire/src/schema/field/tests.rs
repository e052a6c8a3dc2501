use super::*;
use crate::schema::{Variant, parse};

fn schema() -> Schema {
    Schema::Struct {
        name: "M".into(),
        fields: vec![
            Field::new("stamp", Schema::F64),
            Field::new("name", Schema::Text),
            Field::new("names", Schema::List(Box::new(Schema::Text))),
            Field::new("ranges", Schema::List(Box::new(Schema::F32))),
            Field::new("fixed", Schema::Fixed(Box::new(Schema::U16), 3)),
            Field::new(
                "mode",
                Schema::Enum {
                    name: "Mode".into(),
                    variants: ["Off", "On"]
                        .map(|name| Variant { name: name.into(), fields: vec![] })
                        .into(),
                },
            ),
            Field::new(
                "inner",
                Schema::Option(Box::new(Schema::Struct {
                    name: "Inner".into(),
                    fields: vec![Field::with_unit("level", Schema::F32, "V")],
                })),
            ),
            Field::new("ok", Schema::Bool),
        ],
    }
}

fn payload(inner: Option<f32>) -> Vec<u8> {
    let mut out = 1.5_f64.to_le_bytes().to_vec();
    let text = |out: &mut Vec<u8>, text: &str| {
        out.extend((text.len() as u64).to_le_bytes());
        out.extend(text.as_bytes());
    };
    text(&mut out, "robot");
    out.extend(2_u64.to_le_bytes());
    text(&mut out, "a");
    text(&mut out, "bc");
    out.extend(3_u64.to_le_bytes());
    out.extend([0; 12]);
    out.extend([0; 6]);
    out.extend(1_u32.to_le_bytes());
    out.push(u8::from(inner.is_some()));
    out.extend(inner.iter().flat_map(|level| level.to_le_bytes()));
    out.push(1);
    out
}

#[test]
fn a_value_is_found_behind_everything_else() {
    let schema = schema();
    let check = |names: &[&str], expected: Option<Scalar>| {
        let path = FieldPath::find(&schema, names).expect("it is there");
        assert_eq!(path.read(&schema, &payload(Some(0.3))), Ok(expected), "{names:?}");
    };
    check(&["stamp"], Some(Scalar::Number(1.5)));
    check(&["name"], Some(Scalar::Text("robot".into())));
    check(&["mode"], Some(Scalar::Text("On".into())));
    check(&["inner", "level"], Some(Scalar::Number(0.3)));
    check(&["inner"], Some(Scalar::Number(0.3)));
    check(&["ok"], Some(Scalar::Flag(true)));
    check(&[], Some(Scalar::Flag(true)));
    let level = FieldPath::find(&schema, &["inner"]).expect("it is there");
    assert_eq!((level.unit, level.schema), (Some("V"), &Schema::F32));
    assert_eq!(level.read(&schema, &payload(None)), Ok(None));
}

#[test]
fn a_path_to_no_single_value_is_an_error() {
    let schema = schema();
    let find = |names: &[&str]| FieldPath::find(&schema, names).expect_err("no value");
    assert!(matches!(find(&["lvel"]), FieldError::Unknown { index: 0, .. }));
    assert!(matches!(find(&["inner", "lvel"]), FieldError::Unknown { index: 1, .. }));
    assert!(matches!(find(&["ok", "x"]), FieldError::NoFields { index: 1, .. }));
    assert_eq!(find(&["ranges"]), FieldError::List);
    let two = parse("P{x:f64,y:f64}").expect("a schema");
    let known = vec!["x".into(), "y".into()];
    assert_eq!(FieldPath::find(&two, &[]), Err(FieldError::NotOne { known }));
}

#[test]
fn every_cut_payload_is_an_error_and_none_a_panic() {
    let schema = schema();
    let whole = payload(Some(1.0));
    let path = FieldPath::find(&schema, &["ok"]).expect("it is there");
    for len in 0..whole.len() {
        assert!(path.read(&schema, &whole[..len]).is_err(), "{len}");
    }
    let mut lying = whole;
    lying[8..16].fill(0xff);
    assert!(path.read(&schema, &lying).is_err());
}
