use super::*;

pub(in crate::manifest) fn parameter(kind: ParameterType, unit: &str) -> ParameterManifest {
    ParameterManifest {
        name: "p".into(),
        kind,
        unit: unit.into(),
        default: None,
        minimum: None,
        maximum: None,
        choices: vec!["left".into(), "right".into()],
        format: None,
        doc: String::new(),
        live: false,
        written: false,
    }
}

#[test]
fn values_are_read_by_their_type() {
    use ParameterType::{Choice, Colour, Flag, Integer, Number, Path, Text};
    let good = [
        (Number, "deg", "180", ParameterValue::Number(std::f64::consts::PI)),
        (Number, "m", "50cm", ParameterValue::Number(0.5)),
        (Number, "", "0.25", ParameterValue::Number(0.25)),
        (Integer, "", "-3", ParameterValue::Integer(-3)),
        (Flag, "", "true", ParameterValue::Flag(true)),
        (Text, "", "", ParameterValue::Text("".into())),
        (Choice, "", "left", ParameterValue::Text("left".into())),
        (Path, "", "a/b", ParameterValue::Text("a/b".into())),
        (Colour, "", "#00ffAA", ParameterValue::Text("#00ffAA".into())),
    ];
    for (kind, unit, text, value) in good {
        assert_eq!(parameter(kind, unit).parse(text), Ok(value), "{kind:?} {text}");
    }
    let bad = [
        (Number, "m", "5s"),
        (Number, "", "5m"),
        (Number, "km", "1e308"),
        (Integer, "", "1.5"),
        (Flag, "", "yes"),
        (Choice, "", "up"),
        (Path, "", ""),
        (Colour, "", "#0g0000"),
        (Colour, "", "#é0000"),
    ];
    for (kind, unit, text) in bad {
        assert!(parameter(kind, unit).parse(text).is_err(), "{kind:?} {text}");
    }
}

#[test]
fn a_text_has_its_format() {
    let points = |default: Option<&str>| ParameterManifest {
        format: Some(TextFormat::Points),
        default: default.map(Into::into),
        ..parameter(ParameterType::Text, "")
    };
    assert_eq!(points(None).parse("4,1 9,1"), Ok(ParameterValue::Text("4,1 9,1".into())));
    let why = points(None).parse("3.6;1.5").expect_err("no point");
    assert!(why.contains("`3.6;1.5`") && why.contains("`4,1 9.5,-3`"), "{why}");
    // The empty text is a value only where the component declares it as its default.
    assert!(points(None).parse("").is_err() && points(Some("1,1")).parse("").is_err());
    assert!(points(Some("")).parse("").is_ok());
    let json = serde_json::to_string(&points(None)).expect("JSON");
    assert!(json.contains(r#""format":"points""#), "{json}");
    assert_eq!(points(None).form(), "points, such as 4,1 9.5,-3");
}

#[test]
fn a_table_leaves_out_the_ends_of_a_type() {
    let of = |minimum: f64, maximum: f64| {
        let (minimum, maximum) = (Some(minimum), Some(maximum));
        ParameterManifest { minimum, maximum, ..parameter(ParameterType::Integer, "") }
    };
    let count = of(0.0, f64::from(u32::MAX));
    assert_eq!(
        (count.range_with_unit(), count.range()),
        ("0 or more".into(), "0 to 4294967295".into())
    );
    assert!(count.parse("-1").is_err() && count.parse("4294967296").is_err());
    assert_eq!(of(f64::from(i32::MIN), f64::from(i32::MAX)).range_with_unit(), "");
    assert_eq!(of(1.0, 9.0).range_with_unit(), "1 to 9");
}

#[test]
fn ranges_are_in_si_and_inclusive() {
    let range = Some((-std::f64::consts::PI, std::f64::consts::PI));
    let (minimum, maximum) = range.unzip();
    let angle = ParameterManifest { minimum, maximum, ..parameter(ParameterType::Number, "deg") };
    assert!(angle.parse("180deg").is_ok() && angle.parse("-180").is_ok());
    assert!(
        angle.parse("180.1deg").is_err_and(|why| why.ends_with("out of range, -180 to 180 deg"))
    );
    assert_eq!(angle.range_with_unit(), "-180deg to 180deg");
}

#[test]
fn metres_for_minutes_are_recognised() {
    let time = parameter(ParameterType::Number, "s");
    let any = "m is metres; did you mean 30min or 30s or 30ms?";
    assert!(time.parse("30m").is_err_and(|why| why.ends_with(any)));
    let (minimum, maximum) = (Some(0.01), Some(3600.0));
    let short = ParameterManifest { minimum, maximum, ..parameter(ParameterType::Number, "s") };
    let possible = "m is metres; did you mean 400s or 400ms?";
    assert!(short.parse("400m").is_err_and(|why| why.ends_with(possible)));
    assert!(short.parse("9e9m").is_err_and(|why| why.ends_with("m is metres")));
    assert!(time.parse("30kg").is_err_and(|why| why.ends_with("a multiple of it")));
}

#[test]
fn a_ratio_is_received_in_its_own_unit() {
    let range = Some((0.0, 100.0));
    let (minimum, maximum) = range.unzip();
    let share = ParameterManifest { minimum, maximum, ..parameter(ParameterType::Number, "%") };
    for text in ["30%", "30"] {
        assert_eq!(share.parse(text), Ok(ParameterValue::Number(30.0)), "{text}");
    }
    assert_eq!(share.parse("29%"), Ok(ParameterValue::Number(29.0)));
    let Ok(ParameterValue::Number(number)) = share.parse("5000ppm") else { panic!("a number") };
    assert!((number - 0.5).abs() < 1e-12, "{number}");
    assert_eq!(share.range_with_unit(), "0% to 100%");
    assert!(share.parse("130%").is_err_and(|why| why.ends_with("out of range, 0 to 100 %")));
    // Without a unit a ratio is a fraction of one.
    let fraction = ParameterManifest { maximum: Some(1.0), ..parameter(ParameterType::Number, "") };
    assert_eq!(fraction.parse("0.3"), Ok(ParameterValue::Number(0.3)));
    assert!(fraction.parse("30%").is_err_and(|why| why.ends_with("has none; write 0.3")));
}

#[test]
fn defaults_are_shown_with_their_unit() {
    let shown = |kind, unit, default: &str| {
        let default = Some(default.to_owned());
        ParameterManifest { default, ..parameter(kind, unit) }.default_with_unit()
    };
    assert_eq!(shown(ParameterType::Number, "deg", "30").as_deref(), Some("30deg"));
    assert_eq!(shown(ParameterType::Number, "deg", "0.5rad").as_deref(), Some("0.5rad"));
    assert_eq!(shown(ParameterType::Integer, "", "30").as_deref(), Some("30"));
    assert_eq!(shown(ParameterType::Text, "", "a text").as_deref(), Some("a text"));
}
