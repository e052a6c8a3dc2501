//! What the derive refuses, and what it writes.

use syn::parse_str;

use super::*;

fn refusal(source: &str) -> String {
    let input = parse_str(source).expect("Rust");
    expand_message(&input).expect_err(source).to_string()
}

#[test]
fn a_unit_that_does_not_exist_is_refused() {
    let error = refusal(r#"struct Depth { #[message(unit = "furlong")] depth: f64 }"#);
    assert!(error.starts_with("there is no unit `furlong`; the units are s ms"), "{error}");
    let error = refusal(r#"struct Rate { #[message(unit = "hz")] rate: f64 }"#);
    assert!(error.contains("did you mean Hz?"), "{error}");
}

#[test]
fn a_type_that_is_no_message_is_refused() {
    for (source, why) in [
        ("union Either { a: u8 }", "a union cannot travel"),
        ("enum Nothing {}", "an enum without variants has no values"),
        ("struct Pair<T>(T);", "a message type has no generic parameters"),
        ("#[allow(non_camel_case_types)] struct string(u8);", "the name of a primitive type"),
        (r#"#[message(name = "a b")] struct Depth(f64);"#, "`a b` is not"),
        (r#"struct Depth { #[message(name = "d")] depth: f64 }"#, "name, view and wire belong on"),
        ("struct Depth { #[message(unit = m)] depth: f64 }", "write it like unit = \"m/s\""),
        ("struct Depth { #[message(unit)] depth: f64 }", "write it like unit = \"m/s\""),
        (r#"#[message(unit = "m")] struct Depth(f64);"#, "a unit belongs on a field"),
        (r#"struct Depth { #[message(flavour = "m")] depth: f64 }"#, "expected name, unit, text"),
    ] {
        let error = refusal(source);
        assert!(error.contains(why), "{source}: {error}");
    }
}

#[test]
fn all_faults_are_reported_together() {
    let source = r#"#[message(unit = "m")] struct Depth<T> {
        #[message(unit = "furlong")] depth: f64,
        #[message(unit = "m")] name: String,
        #[message(nut = "m")] bolt: T,
        größe: f64,
    }"#;
    let input = parse_str(source).expect("Rust");
    let error = expand_message(&input).expect_err("faults");
    let found: Vec<_> = error.into_iter().map(|fault| fault.to_string()).collect();
    let parts = [
        "no generic parameters",
        "a unit belongs on a field",
        "no unit `furlong`",
        "only numbers have a unit",
        "expected name, unit, text, view or wire",
        "`größe` is not",
    ];
    assert_eq!(found.len(), parts.len(), "{found:#?}");
    for (found, part) in found.iter().zip(parts) {
        assert!(found.contains(part), "{part}: {found}");
    }
    let input = parse_str(r#"enum State { Ä, On { #[message(unit = "s")] by: String } }"#);
    let error = expand_message(&input.expect("Rust")).expect_err("faults");
    assert_eq!(error.into_iter().count(), 2);
}

#[test]
fn a_message_that_contains_itself_is_refused() {
    for source in [
        "struct Node { next: Option<Box<Node>> }",
        "struct Node { children: Vec<Self> }",
        "enum Tree { Leaf, Pair([Tree; 2]) }",
    ] {
        let error = expand_message(&parse_str(source).expect("Rust")).expect_err(source);
        assert!(error.to_string().starts_with("a message cannot contain itself:"), "{error}");
    }
    let text = "struct Path { #[message(text)] root: Option<Path>, parent: std::path::Path }";
    expand_message(&parse_str(text).expect("Rust")).expect("another type, and a text");
}

#[test]
fn a_refused_type_has_its_traits_nevertheless() {
    for source in [
        r#"struct Depth { #[message(unit = "furlong")] depth: f64 }"#,
        "struct Pair<T: Copy>(T) where T: Send;",
        "enum Nothing {}",
        r#"#[message(wire = "wire", unit = "m")] union Either { a: u8 }"#,
    ] {
        let code = derive_or_stub(&parse_str(source).expect("Rust")).to_string();
        assert!(code.contains("compile_error"), "{source}");
        for name in ["bincode :: Encode", "WireType", "Message"] {
            assert_eq!(code.matches(&format!(":: {name} for ")).count(), 1, "{name}: {source}");
        }
    }
}

#[test]
fn only_numbers_have_a_unit() {
    let depth = |kind: &str| format!("struct Depth {{ #[message(unit = \"m\")] depth: {kind} }}");
    for (kind, value) in [
        ("String", "text"),
        ("Vec<std::string::String>", "text"),
        ("[bool; 3]", "true or false"),
        ("Array<bool>", "true or false"),
        ("Option<bool>", "true or false"),
    ] {
        let error = refusal(&depth(kind));
        let expected = format!("only numbers have a unit, but this field is {value};");
        assert!(error.starts_with(&expected), "{kind}: {error}");
    }
    let error = refusal(r#"struct Depth { #[message(unit = "m", text)] depth: Fathoms }"#);
    assert!(error.contains("this field is text"), "{error}");
    for kind in ["f32", "Vec<f64>", "[u16; 3]", "Option<i8>", "Fathoms"] {
        expand_message(&parse_str(&depth(kind)).expect("Rust")).expect(kind);
    }
}

#[test]
fn a_schema_has_the_ascii_spelling_of_a_unit() {
    for unit in ["N·m", "N*m"] {
        let source = format!(r#"struct Arm {{ #[message(unit = "{unit}")] torque: f64 }}"#);
        let input = parse_str(&source).expect("Rust");
        let code = expand_message(&input).expect("code").to_string();
        assert!(code.contains("\"N*m\"") && !code.contains('·'), "{code}");
    }
}

#[test]
fn a_field_is_asked_for_one_trait_only() {
    // A type without a wire form is one error then.
    let input = parse_str("struct Belt { count: usize }").expect("Rust");
    let code = expand_message(&input).expect("code").to_string();
    let encode =
        "< usize as :: armor_sdk :: wire :: WireType > :: encode_field (field_0 , encoder)";
    assert!(code.contains(encode) && !code.contains("Encode :: encode (field_0"), "{code}");
}

#[test]
fn only_a_struct_with_named_fields_has_a_view() {
    for source in [
        "#[message(view)] struct Pair(u8, u8);",
        "#[message(view)] struct Nothing;",
        "#[message(view)] enum Level { Low, High }",
    ] {
        let error = refusal(source);
        assert!(error.contains("for a struct with named fields; remove `view`"), "{error}");
    }
    let error = refusal("struct Depth { #[message(view)] depth: f64 }");
    assert!(error.contains("name, view and wire belong on the type"), "{error}");
}
