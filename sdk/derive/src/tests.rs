//! What the derive writes, and where its errors point.

use quote::quote;
use syn::parse_str;

use crate::derive_or_stub;
use crate::event::{expand_enum, stub_enum};
use crate::expansion::{expand_struct, stub_struct};

/// Checks that a field is refused, why, and at which source text the error points.
fn check_refused(field: &str, at: &str, why: &str) {
    let source = format!("struct Settings {{ {field} }}");
    let input = parse_str(&source).expect("Rust");
    let error = expand_struct(&input).expect_err(field);
    assert!(error.to_string().contains(why), "{field}: {error}");
    assert_eq!(error.span().source_text().as_deref(), Some(at), "{field}: {error}");
}

#[test]
fn a_wrong_attribute_is_refused_where_it_stands() {
    check_refused("#[parameter(flavour = 1)] a: f64", "flavour", "expected name, unit");
    check_refused("#[parameter(live, live)] a: f64", "live", "`live` is given twice");
    check_refused("#[parameter(unit = \"m\")] a: i64", "\"m\"", "only f64 and f32 have a unit");
    check_refused("#[parameter(range = 0.0..=1.0)] a: bool", "0.0..=1.0", "only numbers");
    check_refused("#[parameter(range = 2.0..=-1.0)] a: f64", "2.0..=-1.0", "is empty");
    check_refused("#[parameter(range = 0.0..1.0)] a: f64", "0.0..1.0", "LOW..=HIGH");
    check_refused("#[parameter(name = \"9a\")] a: f64", "\"9a\"", "begins with a letter");
    check_refused("#[parameter(colour)] a: f64", "colour", "a colour is a String");
}

#[test]
fn a_wrong_default_is_refused_where_it_stands() {
    check_refused("#[parameter(default = 3)] a: bool", "3", "of a bool is true or false");
    check_refused("#[parameter(default = true)] a: u32", "true", "is a whole number, such as 3");
    check_refused("#[parameter(default = 1.5)] a: i64", "1.5", "is a whole number, such as 3");
    check_refused("#[parameter(default = 1)] a: String", "1", "as the file would: a text");
    check_refused("#[parameter(default = \"yes\")] a: bool", "\"yes\"", "true or false");
    check_refused("#[parameter(default = \"2.5\")] a: u32", "\"2.5\"", "no whole number");
    check_refused("#[parameter(unit = \"m\", default = 0.2)] a: f64", "0.2", "default = \"0.2m\"");
    check_refused(
        "#[parameter(choices(\"left\" = Side::Left), default = \"up\")] a: Side",
        "\"up\"",
        "none of the choices",
    );
    check_refused("#[parameter(default = -true)] a: bool", "-", "only a number");
}

#[test]
fn a_value_that_lacks_quotation_marks_or_has_too_many_is_refused_with_the_remedy() {
    for (written, text) in [
        ("20cm/s", "20cm/s"),
        ("20cm", "20cm"),
        ("0.6 m/s", "0.6m/s"),
        ("-5deg", "-5deg"),
        ("20%", "20%"),
    ] {
        for follows in ["", ", live"] {
            let source =
                format!("struct S {{ #[parameter(default = {written}{follows})] a: f64 }}");
            let error = expand_struct(&parse_str(&source).expect("Rust")).expect_err(&source);
            let expected = format!("in quotation marks: default = \"{text}\"");
            assert!(error.to_string().ends_with(&expected), "{error}");
        }
    }
    check_refused("#[parameter(default = left)] a: f64", "left", "a text in quotation marks");
    let range = "without quotation marks and units: range = 0.0..=2.0";
    check_refused("#[parameter(range = \"0..2\")] a: f64", "\"0..2\"", range);
    check_refused("#[parameter(range = 2)] a: f64", "2", range);
    let with_suffix = "struct S { #[parameter(default = 3_u8, range = 0.0..=5.0)] a: u8 }";
    expand_struct(&parse_str(with_suffix).expect("Rust")).expect("Rust's own suffix");
}

#[test]
fn a_default_that_the_type_cannot_hold_is_refused_where_it_stands() {
    check_refused(
        "#[parameter(default = 300)] a: u8",
        "300",
        "`300` is out of range for u8, 0 to 255",
    );
    check_refused(
        "#[parameter(default = \"-129\")] a: i8",
        "\"-129\"",
        "out of range for i8, -128 to 127",
    );
    for (unsigned, default) in [("u32", "-1"), ("u64", "-1"), ("usize", "-3")] {
        let source =
            format!("struct Settings {{ #[parameter(default = {default})] a: {unsigned} }}");
        let error = expand_struct(&parse_str(&source).expect("Rust")).expect_err(&source);
        let expected = format!("`{default}` is out of range for {unsigned}, 0 to ");
        assert!(error.to_string().starts_with(&expected), "{error}");
    }
    // Here the integer is what a text stands for.
    let choice = "struct Settings { #[parameter(choices(\"300\" = 3), default = \"300\")] a: u8 }";
    expand_struct(&parse_str(choice).expect("Rust")).expect("a choice");
}

#[test]
fn an_integer_without_a_range_has_that_of_its_type() {
    for (kind, range) in [
        ("u8", quote!(.range(0f64, 255f64))),
        ("i16", quote!(.range(-32768f64, 32767f64))),
        ("u32", quote!(.range(0f64, 4294967295f64))),
        ("i32", quote!(.range(-2147483648f64, 2147483647f64))),
    ] {
        let source = format!("struct Settings {{ a: {kind} }}");
        let code = expand_struct(&parse_str(&source).expect("Rust")).expect("code").to_string();
        assert!(code.contains(&range.to_string()), "{code}");
    }
    for source in ["struct Settings { a: u64 }", "struct Settings { a: i64 }"] {
        let code = expand_struct(&parse_str(source).expect("Rust")).expect("code").to_string();
        assert!(!code.contains("range"), "{code}");
    }
    let code = expand_struct(
        &parse_str("struct Settings { #[parameter(range = 1.0..=9.0)] a: u8 }").expect("Rust"),
    );
    assert!(code.expect("code").to_string().contains(&quote!(.range(1.0, 9.0)).to_string()));
}

#[test]
fn a_wrong_choice_or_type_is_refused_where_it_stands() {
    check_refused(
        "#[parameter(choices(\"a\" = 1, \"a\" = 2))] a: u8",
        "\"a\"",
        "this choice is given twice",
    );
    check_refused("#[parameter(choices(\"a\" = 1), parse = f)] a: u8", "f", "not parsed");
    check_refused(
        "a_m: f64, #[parameter(name = \"a_m\")] b: f64",
        "b",
        "two parameters are called",
    );
}

#[test]
fn a_type_that_is_none_of_a_parameter_is_answered_with_what_to_write() {
    for (field, advice) in [
        ("Vec<f64>", "is a Vec<f64> with #[parameter(format = \"numbers\")]"),
        ("Vec<u8>", "is a Vec<f64> with #[parameter(format = \"numbers\")]"),
        ("[f64; 2]", "is a Vec<f64> with #[parameter(format = \"numbers\")]"),
        ("Vec<[f64; 2]>", "with #[parameter(format = \"points\")]"),
        ("Vec<String>", "with #[parameter(format = \"names\")]"),
        ("std::time::Duration", "is an f64 with a unit: #[parameter(unit = \"s\")]"),
        ("&'static str", "a `&str` as it stands: write String"),
        ("Box<str>", "write String"),
        ("char", "write String"),
        ("&'static Path", "write PathBuf"),
        ("u128", "write i64 or u64"),
        ("Option<f64>", "only String and PathBuf may be an Option"),
        ("Option<bool>", "give a number or a bool a default"),
        (
            "Manners",
            "#[parameter(choices(\"first\" = Manners::First, \"second\" = Manners::Second))]",
        ),
        ("Manners", "`parse = FUNCTION` with a fn(&str) -> Result<Manners, E>"),
        ("HashMap<String, f64>", "a number, bool, String, PathBuf, or an Option of the last two"),
    ] {
        check_refused(&format!("a: {field}"), field, advice);
    }
    for (format, field, wanted) in [
        ("numbers", "Vec<u32>", "is a Vec<f64>"),
        ("points", "Vec<(f64, f64)>", "is a Vec<[f64; 2]>"),
        ("names", "Vec<&'static str>", "is a Vec<String>"),
        ("numbers", "[f64; 2]", "is a Vec<f64>"),
    ] {
        let declared = format!("#[parameter(format = \"{format}\")] a: {field}");
        check_refused(&declared, field, wanted);
    }
}

#[test]
fn choices_in_another_form_are_answered_with_the_right_one() {
    let sides = "choices(\"left\" = Side::Left, \"right\" = Side::Right)";
    for (written, at) in [
        ("choices(\"left\", \"right\")", ","),
        ("choices(Left, Right)", "Left"),
        ("choices(Side::Left, Side::Right)", "Side"),
        ("choices(\"left\": Side::Left, \"right\": Side::Right)", ":"),
        ("choices(\"left\" => Side::Left, \"right\" => Side::Right)", ">"),
    ] {
        check_refused(&format!("#[parameter({written})] a: Side"), at, sides);
    }
    let example = "choices(\"first\" = Side::First, \"second\" = Side::Second)";
    check_refused("#[parameter(choices())] a: Side", "choices", example);
    check_refused("#[parameter(choices = [\"left\"])] a: Side", "choices", example);
    for (field, value) in [
        ("String", "\"slow-down\".into()"),
        ("u8", "1"),
        ("f32", "1.0"),
        ("bool", "false"),
        ("Pace", "Pace::SlowDown"),
    ] {
        let declared = format!("#[parameter(choices(\"go\", \"slow-down\"))] a: {field}");
        check_refused(&declared, ",", &format!("\"slow-down\" = {value})"));
    }
    // What is advised compiles as far as the derive can see.
    let declared = format!("struct S {{ #[parameter({sides})] a: Side }}");
    expand_struct(&parse_str(&declared).expect("Rust")).expect("choices");
}

#[test]
fn an_entry_in_another_form_is_answered_with_how_it_is_written() {
    for (written, at, example) in [
        ("unit = m", "m", "write it like unit = \"m/s\""),
        ("unit: \"m\"", ":", "write it like unit = \"m/s\""),
        ("name = speed", "speed", "write it like name = \"max-speed\""),
        ("parse = \"read\"", "\"read\"", "without quotation marks"),
        ("format = points", "points", "write it like format = \"points\""),
        ("default: 3", ":", "a default is a number"),
        ("range = 0m..=5m", "0m..=5m", "without quotation marks and units: range = 0.0..=2.0"),
        ("range = -5deg..=5.0", "-5deg..=5.0", "range = 0.0..=2.0"),
        ("range: 1..=2", ":", "range = 0.0..=2.0"),
        ("min = 0.0", "min", "expected name, unit, default, range"),
    ] {
        check_refused(&format!("#[parameter({written})] a: f64"), at, example);
    }
    check_refused("größe: f64", "größe", "ASCII letters, digits, _ and -");
    check_event_refused("#[event(name = lap)] A", "lap", "write it like name = \"lap\"");
    check_event_refused(
        "#[event(unit = \"m\", unit = \"s\")] A(f64)",
        "unit = \"s\"",
        "given twice",
    );
}

#[test]
fn whole_numbers_are_a_range_of_any_number() {
    for field in ["f64", "u8"] {
        let source = format!("struct Settings {{ #[parameter(range = -1..=5)] a: {field} }}");
        let code = expand_struct(&parse_str(&source).expect("Rust")).expect("code").to_string();
        assert!(code.contains(&quote!(.range(-1.0, 5.0)).to_string()), "{code}");
    }
}

#[test]
fn only_a_plain_struct_with_named_fields_has_parameters() {
    for (source, why) in [
        ("enum Settings { A }", "fields of a struct"),
        ("struct Settings(f64);", "fields with names"),
        ("struct Settings<T> { a: T }", "not generic"),
    ] {
        let error = expand_struct(&parse_str(source).expect("Rust")).expect_err(source);
        assert!(error.to_string().contains(why), "{source}: {error}");
    }
}

#[test]
fn only_a_path_is_written() {
    check_refused("#[parameter(written)] a: String", "written", "it is written to, but is no path");
    check_refused(
        "#[parameter(written, written)] a: PathBuf",
        "written",
        "`written` is given twice",
    );
}

#[test]
fn only_a_text_has_a_format_that_exists() {
    check_refused("#[parameter(format = \"regex\")] a: String", "\"regex\"", "there are points, ");
    check_refused("#[parameter(format = \"points\")] a: f64", "\"points\"", "but is no text");
    check_refused(
        "#[parameter(format = \"points\", default = \"1;2\")] a: Vec<[f64; 2]>",
        "\"1;2\"",
        "point 1, `1;2`, is not x,y",
    );
    let source = "struct Settings { #[parameter(format = \"points\")] a: Vec<[f64; 2]> }";
    let code = expand_struct(&parse_str(source).expect("Rust")).expect("code").to_string();
    let expected = quote!(text("a").format(::armor_sdk::wire::text_format::TextFormat::Points));
    assert!(code.contains(&expected.to_string()), "{code}");
}

#[test]
fn the_table_is_what_one_would_write_by_hand() {
    let input = quote! {
        struct Settings {
            /// fastest
            /// speed
            #[parameter(unit = "m/s", default = "0.6m/s", range = 0.05..=5.0, live)]
            speed_mps: f64,
            #[parameter(default = 8)]
            r#loop: usize,
            #[parameter(default = "", written)]
            report: Option<PathBuf>,
        }
    };
    let code = expand_struct(&syn::parse2(input).expect("Rust")).expect("code").to_string();
    let speed = quote!(
        ::armor_sdk::Parameter::number("speed", "m/s")
            .default("0.6m/s")
            .range(0.05, 5.0)
            .doc("fastest speed")
            .live()
    );
    let count = quote!(::armor_sdk::Parameter::integer("loop").default("8"));
    assert!(code.contains(&speed.to_string()), "{code}");
    assert!(code.contains(&count.to_string()), "{code}");
    let report = quote!(::armor_sdk::Parameter::path("report").default("").written());
    assert!(code.contains(&report.to_string()), "{code}");
}

#[test]
fn a_name_has_no_suffix_of_its_unit() {
    for (field, unit, name) in [
        ("turn_acceleration_radps2", "rad/s2", "turn_acceleration"),
        ("heading_rad", "deg", "heading"),
        ("rate_hz", "Hz", "rate"),
        ("wait_s", "min", "wait"),
        ("bias_radpm", "deg", "bias_radpm"),
        ("x", "m", "x"),
    ] {
        let source = format!("struct Settings {{ #[parameter(unit = \"{unit}\")] {field}: f64 }}");
        let code = expand_struct(&parse_str(&source).expect("Rust")).expect("code").to_string();
        let declared = quote!(::armor_sdk::Parameter::number(#name, #unit)).to_string();
        assert!(code.contains(&declared), "{code}");
    }
}

#[test]
fn what_a_manifest_would_be_refused_for_does_not_compile() {
    check_refused(
        "#[parameter(unit = \"furlong\")] a: f64",
        "\"furlong\"",
        "no unit called `furlong`",
    );
    check_refused("#[parameter(unit = \"hz\")] a: f64", "\"hz\"", "did you mean Hz?");
    check_refused(
        "#[parameter(unit = \"m/s\", default = \"3s\")] a: f64",
        "\"3s\"",
        "`3s` is not in m/s",
    );
    check_refused(
        "#[parameter(default = \"fast\")] a: f64",
        "\"fast\"",
        "does not start with a number",
    );
    check_refused(
        "#[parameter(default = 7, range = 1.0..=5.0)] a: u8",
        "7",
        "`7` is out of range, 1 to 5",
    );
    check_refused(
        "#[parameter(unit = \"cm\", default = \"2m\", range = 0.0..=1.0)] a: f64",
        "\"2m\"",
        "out of range, 0 to 100 cm; write it as a file would, 0cm to 100cm",
    );
    check_refused("#[parameter(default = \"red\", colour)] a: String", "\"red\"", "not a colour");
}

#[test]
fn a_range_of_constants_is_left_to_the_manifest() {
    let input = quote!(
        struct Settings {
            #[parameter(default = 9, range = LOW..=HIGH)]
            a: u8,
        }
    );
    assert!(expand_struct(&syn::parse2(input).expect("Rust")).is_ok());
}

#[test]
fn all_wrong_fields_are_refused_together() {
    let source = "struct Settings { #[parameter(unit = \"x\")] a: f64, b: Vec<f64>, c: Vec<u8> }";
    let error = expand_struct(&parse_str(source).expect("Rust")).expect_err("three faults");
    assert_eq!(error.into_iter().count(), 3);
}

#[test]
fn all_faults_of_a_field_are_refused_together() {
    for (field, faults) in [
        (r#"#[parameter(unit = "furlong", default = 0.2)] a: f64"#, vec![r#""furlong""#, "0.2"]),
        (
            r#"#[parameter(unit = "furlong", default = "fast")] a: f64"#,
            vec![r#""furlong""#, r#""fast""#],
        ),
        (
            r#"#[parameter(unit = "m", default = 1.5, name = "9a")] a: i64"#,
            vec![r#""m""#, "1.5", r#""9a""#],
        ),
        (r#"#[parameter(range = 0.0..=1.0, default = 3)] a: bool"#, vec!["0.0..=1.0", "3"]),
        // What is wrong with this default follows from the unit, if anything is.
        (r#"#[parameter(unit = "furlong", default = "3s")] a: f64"#, vec![r#""furlong""#]),
    ] {
        let source = format!("struct Settings {{ {field} }}");
        let error = expand_struct(&parse_str(&source).expect("Rust")).expect_err(field);
        let places = error.into_iter().map(|error| error.span().source_text().unwrap_or_default());
        let (mut places, mut faults): (Vec<_>, Vec<_>) = (places.collect(), faults);
        places.sort();
        faults.sort_unstable();
        assert_eq!(places, faults, "{field}");
    }
}

/// What `impl` block stands for a refused type, so that its uses are no further errors.
#[test]
fn a_refused_type_has_its_trait_nevertheless() {
    for source in [
        "struct Settings { #[parameter(unit = \"furlong\")] a: f64 }",
        "struct Settings<T>(T);",
        "enum Settings { A }",
    ] {
        let code = derive_or_stub(&parse_str(source).expect("Rust"), expand_struct, stub_struct);
        let code: syn::File = syn::parse2(code).expect("Rust");
        let [syn::Item::Macro(error), syn::Item::Impl(stub)] = &code.items[..] else {
            panic!("{source}")
        };
        assert!(error.mac.path.segments.iter().any(|part| part.ident == "compile_error"));
        assert_eq!(stub.items.len(), 3, "as many as the trait requires");
    }
    let events = parse_str("enum Reported { Done }").expect("Rust");
    let code = derive_or_stub(&events, expand_enum, stub_enum).to_string();
    for part in ["compile_error", ":: armor_sdk :: Events for Reported", "From < Reported >"] {
        assert!(code.contains(part), "{code}");
    }
}

fn check_event_refused(variant: &str, at: &str, why: &str) {
    let source = format!("enum Reported {{ {variant} }}");
    let input = parse_str(&source).expect("Rust");
    let error = expand_enum(&input).expect_err(variant);
    assert!(error.to_string().contains(why), "{variant}: {error}");
    assert_eq!(error.span().source_text().as_deref(), Some(at), "{variant}: {error}");
}

#[test]
fn a_wrong_event_is_refused_where_it_stands() {
    check_event_refused("Done", "Done", "reports of their own");
    check_event_refused("#[event(name = \"a b\")] A", "\"a b\"", "begins with a letter");
    check_event_refused("#[event(unit = \"furlong\")] A(f64)", "\"furlong\"", "no unit called");
    check_event_refused("#[event(unit = \"m\")] A(u32)", "\"m\"", "its value is no number");
    check_event_refused("#[event(flavour = \"m\")] A", "flavour", "expected name or unit");
    check_event_refused("A(String)", "(String)", "is one number");
    check_event_refused("A { x: f64 }", "{ x: f64 }", "is one number");
    check_event_refused("LidOpen, #[event(name = \"lid_open\")] B", "B", "two events are called");
}

#[test]
fn only_a_plain_enum_has_events() {
    for (source, why) in [
        ("struct Reported { lap: u32 }", "variants of an enum"),
        ("enum Reported {}", "an enum without variants"),
        ("enum Reported<T> { Lap(T) }", "not generic"),
    ] {
        let error = expand_enum(&parse_str(source).expect("Rust")).expect_err(source);
        assert!(error.to_string().contains(why), "{source}: {error}");
    }
}

#[test]
fn the_table_of_events_is_what_one_would_write_by_hand() {
    let input = quote! {
        enum Reported {
            /// the water
            /// is hot
            #[event(unit = "degC")]
            WaterHot(f64),
            Lap(u32),
            Opened,
        }
    };
    let code = expand_enum(&syn::parse2(input).expect("Rust")).expect("code").to_string();
    for declaration in [
        quote!(::armor_sdk::DeclaredEvent::new("water_hot").doc("the water is hot").number("degC")),
        quote!(::armor_sdk::DeclaredEvent::new("lap").integer()),
        quote!(::armor_sdk::DeclaredEvent::new("opened")),
    ] {
        assert!(code.contains(&declaration.to_string()), "{code}");
    }
}
