//! The standard messages of Python, C and C++ are those of Rust, and messages of components can be
//! written in every language. `ARMOR_BLESS=1` writes the kept files.

// A test that cannot continue may panic.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use armor_definitions::{
    Definition, Language, export_messages, select_messages, standard_messages, write_c_header,
    write_cpp_header, write_python_module,
};
use armor_sdk::wire::message::WireType;
use armor_wire::schema::parse;

fn check_kept(file: &str, written: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    if std::env::var_os("ARMOR_BLESS").is_some() {
        std::fs::write(&path, written).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        kept == written,
        "{file} differs from the standard messages; ARMOR_BLESS=1 cargo test -p armor-definitions \
         writes it"
    );
}

#[test]
fn the_messages_of_python_are_those_of_rust() {
    let written = write_python_module(&standard_messages()).unwrap();
    check_kept("python/python/armor/messages.py", &written);
}

#[test]
fn the_messages_of_c_are_those_of_rust() {
    check_kept("c/include/armor_messages.h", &write_c_header(&standard_messages()).unwrap());
}

#[test]
fn the_messages_of_cpp_are_those_of_rust() {
    check_kept("c/include/armor_messages.hpp", &write_cpp_header(&standard_messages()).unwrap());
}

/// Each form of a field that all languages have, and standard messages.
const READING: &str = include_str!("kept/reading.schema").trim_ascii_end();

fn export(text: &str, language: Language) -> Result<String, String> {
    let selection = select_messages(&[parse(text).unwrap()], &standard_messages()).unwrap();
    export_messages(&selection, language).map_err(|error| error.to_string())
}

#[test]
fn a_message_of_a_component_is_written_in_every_language() {
    let check = |language, parts: &[&str]| {
        let text = export(READING, language).unwrap();
        for part in parts {
            assert!(text.contains(part), "{language}: {part}\n{text}");
        }
        assert!(!text.contains("Forward, in metres"), "a standard message is imported:\n{text}");
    };
    check(
        Language::Rust,
        &[
            "use armor_sdk::{Array, Message};\nuse armor_sdk::messages::Pose2D;\n",
            "#[derive(Clone, Debug, Default, PartialEq, Message)]\npub struct Reading {\n",
            "    #[message(unit = \"m\")]\n    pub ranges: Array<f32>,\n    pub raw: Array<u8>,\n",
            "    pub depth: Option<f64>,\n    pub state: State,\n    pub at: Pose2D,\n",
            "pub enum State {\n    #[default]\n    Idle,\n",
        ],
    );
    check(
        Language::Python,
        &[
            "import enum\nfrom typing import TYPE_CHECKING, List, Optional, Sequence, Union\n",
            "from armor._message import Message, _array\nfrom armor.messages import Pose2D\n",
            "        (\"depth\", \"depth\", \"m\", (\"optional\", \"f64\")),\n",
            "        depth: Optional[float] = None,\n        state: State = State.Idle,\n",
        ],
    );
    check(
        Language::C,
        &[
            "#include <armor_messages.h>",
            "  armor_string_list names;\n  // Unit: m.\n  double corner[4];\n  // Unit: m.\n  struct {\n",
            "  ARMOR_NESTED(armor_reading, at, armor_pose2d, \"\"),\n",
        ],
    );
    check(
        Language::Cpp,
        &[
            "using armor::messages::Pose2D;\n",
            "  std::optional<double> depth{};\n  State state{};\n  Pose2D at{};\n",
            "ARMOR_MESSAGE_NAMED(\"Reading\", Reading, (stamp, \"s\"), name, level,",
            "struct ReadingView {\n",
        ],
    );
}

#[test]
fn a_document_in_json_has_every_field_with_its_type_unit_and_text() {
    let text = export("Track{poses:[Pose2D{x:f64(m),y:f64(m),theta:f64(rad)}]}", Language::Json);
    let document: serde_json::Value = serde_json::from_str(&text.unwrap()).unwrap();
    let messages = &document["messages"];
    assert_eq!(messages[0]["name"], "Pose2D");
    assert_eq!(messages[0]["fields"][0]["unit"], "m");
    assert_eq!(messages[0]["fields"][0]["doc"], "Forward, in metres.");
    assert_eq!(messages[1]["fields"][0]["type"], "[Pose2D]");
}

#[test]
fn what_a_language_cannot_express_is_refused_with_the_field() {
    let refusal = |text: &str, language| export(text, language).unwrap_err();
    let with_fields = "A{mode:Mode<Off,On{level:u8}>}";
    for language in [Language::Python, Language::C, Language::Cpp] {
        let error = refusal(with_fields, language);
        assert!(error.starts_with("`Mode.On` is a variant with fields"), "{error}");
        assert!(error.contains("--lang rust"), "{error}");
    }
    assert!(export(with_fields, Language::Rust).unwrap().contains("    On {\n        level: u8,"));
    let error = refusal("A{rows:[[f32]]}", Language::C);
    assert!(error.starts_with("`A.rows` is a list of `[f32]`"), "{error}");
    let fields: Vec<_> = (0..33).map(|index| format!("f{index}:u8")).collect();
    let error = refusal(&format!("A{{{}}}", fields.join(",")), Language::Cpp);
    assert!(error.starts_with("`A.f32` is its field number 33, which"), "{error}");
    let error = refusal("A{class:u8}", Language::Cpp);
    assert!(error.contains("`A.class` is a reserved word"), "{error}");
    assert!(export("A{from:u8}", Language::Python).unwrap().contains("(\"from_\", \"from\", None"));
    assert!(export("A{type:u8}", Language::Rust).unwrap().contains("pub r#type: u8"));
}

/// What is written in Rust is compiled here, and has the schema that it was written from.
#[allow(dead_code, missing_docs)]
mod exported {
    include!("kept/reading.rs");
}

/// The packages of these languages compile or import the kept files in their own checks.
#[test]
fn what_is_written_in_the_other_languages_is_kept_for_their_checks() {
    for (language, file) in [
        (Language::Python, "definitions/tests/kept/reading.py"),
        (Language::C, "definitions/tests/kept/reading.h"),
        (Language::Cpp, "definitions/tests/kept/reading.hpp"),
    ] {
        check_kept(file, &export(READING, language).unwrap());
    }
}

#[test]
fn what_is_written_in_rust_has_the_same_schema() {
    let written = export(READING, Language::Rust).unwrap();
    // `include!` takes no inner documentation.
    let items = written.split_once("\n\n").unwrap().1;
    check_kept("definitions/tests/kept/reading.rs", items);
    assert_eq!(exported::Reading::schema().to_string(), READING);
}

#[test]
fn a_standard_message_that_is_asked_for_is_written_with_its_documentation() {
    let scan = standard_messages().into_iter().find(|it| it.name() == "LaserScan").unwrap();
    let Definition { schema, .. } = &scan;
    for language in [Language::Rust, Language::Python, Language::C, Language::Cpp, Language::Json] {
        let text = export(&schema.to_string(), language).unwrap();
        assert!(text.contains("Angle of the first ray."), "{text}");
    }
}
