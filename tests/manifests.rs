//! Manifests and their JSON schema: every manifest conforms to the schema, and the schema and the
//! program accept the same manifests.

mod schema;

use std::process::Command;

use armor_wire::manifest::Manifest;
use serde_json::{Value, json};

use crate::fixture::{Folder, run_to_end};
use crate::resilience::system::probe;
use schema::Schema;

fn schema() -> Schema {
    Schema::new(include_str!("../docs/manifest.schema.json"))
}

/// Whether the program accepts the manifest.
fn accepted(value: &Value) -> Result<(), String> {
    let manifest: Manifest =
        serde_json::from_value(value.clone()).map_err(|error| error.to_string())?;
    manifest.validate().map_err(|faults| faults.to_string())
}

/// A manifest with every member, none of them null or empty.
fn everything() -> Value {
    let schema = "Speed{value:f64(m/s)}";
    let hash = format!("{:016x}", armor_wire::schema::hash_text(schema));
    let port = |id: &str| {
        json!({"id": id, "type": "Speed", "schema": schema, "schema_hash": hash,
               "doc": "how fast", "required": true, "latched": true})
    };
    let mut input = port("in");
    input["stale_after"] = json!("0.5s");
    input["many"] = json!(true);
    json!({
        "armor_manifest": 1, "kind": "wheel", "summary": "Turns.", "controllable": false,
        "protocol": armor_wire::version::VERSION,
        "reports_done": false, "ends_by_itself": true, "needs_rate": true, "reads_all": true, "needs_one_of": [["buttons"]],
        "value_effects": [{"parameter": "radius", "effect": "idle", "value": "1m"},
                          {"parameter": "interval", "effect": "paces", "output": "out"},
                          {"parameter": "interval", "effect": "gives_up"},
                          {"parameter": "interval", "effect": "delays_done", "times": ["radius"]}],
        "frames": [{"port": "out", "parameter": "mount"}],
        "inputs": [input], "outputs": [port("out")],
        "parameters": [
            {"name": "radius", "type": "number", "unit": "m", "default": "0.1m", "minimum": 0.01,
             "maximum": 2, "doc": "of the wheel", "live": true},
            {"name": "side", "type": "choice", "choices": ["left", "right"]},
            {"name": "buttons", "type": "text", "format": "names"},
            {"name": "mount", "type": "text", "format": "frame", "default": "wheel"},
            {"name": "report", "type": "path", "default": "", "written": true},
            {"name": "interval", "type": "number", "unit": "s", "default": "1s"},
        ],
        "events": [
            {"name": "worn", "doc": "the tread is gone", "value": "number", "unit": "m"},
            {"name": "button", "named_by": "buttons"},
        ],
    })
}

/// The value at every path of `value`, and the paths of its members.
fn paths(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Object(members) => {
            members.iter().for_each(|(name, value)| paths(value, &format!("{at}/{name}"), found));
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(n, item)| paths(item, &format!("{at}/{n}"), found));
        }
        _ => {}
    }
}

#[test]
fn a_constructor_that_prints_on_stdout_is_named_by_its_own_description() {
    let folder = Folder::new("talker");
    // Under this name the program is a `talker`; a symbolic link would be resolved to `probe`.
    let script = format!("#!/bin/bash\nexec -a talker '{}' \"$@\"\n", probe().display());
    folder.executable("components/talker", &script);
    let output = Command::new(folder.path().join("components/talker"))
        .arg("--describe")
        .output()
        .expect("it runs");
    let (out, err) = (&output.stdout, String::from_utf8_lossy(&output.stderr));
    assert_eq!((output.status.code(), out.len()), (Some(1), 0), "{err}");
    let why = "talker: the constructor prints on stdout, where only the manifest may be: \"the talker \
               is ready\"; print on stderr";
    assert!(err.starts_with(why), "{err}");
}

#[test]
fn the_schema_and_the_program_accept_the_same() {
    let (schema, everything) = (schema(), everything());
    assert_eq!(schema.check(&everything), Ok(()));
    assert_eq!(accepted(&everything), Ok(()));
    assert_eq!(schema.members(), schema.members_used(&everything), "the sample has every member");
    let mut all = Vec::new();
    paths(&everything, "", &mut all);
    let mut refused = 0;
    let mut agree = |changed: &Value, what: &str| {
        let (by_schema, by_program) = (schema.check(changed), accepted(changed));
        let verdicts = format!("{what}: schema {by_schema:?}, program {by_program:?}\n{changed:#}");
        // The program is stricter than the schema here: an age is a time, a default must be within its range, a unit
        // belongs to a number, and what names events or has a value with an effect must exist.
        assert!(by_schema.is_ok() || by_program.is_err(), "only the program takes it: {verdicts}");
        let deeper = [
            "stale_after",
            "needs_one_of",
            "value_effects",
            "/frames/0",
            "/parameters/3",
            "default",
            "schema",
            "type",
            "choices",
            "unit",
            "minimum",
            "maximum",
            "/events/0/value",
            "named_by",
            "/parameters/2",
            "without /parameters",
            "without /outputs",
            "/outputs is",
            "/parameters is",
        ];
        let same = by_schema.is_ok() == by_program.is_ok();
        assert!(same || deeper.iter().any(|word| what.contains(word)), "{verdicts}");
        refused += usize::from(by_program.is_err());
    };
    for path in all.iter().filter(|path| !path.is_empty()) {
        let (parent, name) = path.rsplit_once('/').expect("it has a parent");
        let mut without = everything.clone();
        match without.pointer_mut(parent).expect("it is there") {
            Value::Object(members) => drop(members.remove(name)),
            Value::Array(items) => drop(items.remove(name.parse().expect("an index"))),
            _ => unreachable!("a parent has members"),
        }
        agree(&without, &format!("without {path}"));
        let others = [
            json!(null),
            json!(true),
            json!(-1),
            json!(0.5),
            json!(""),
            json!("9 x"),
            json!([]),
            json!({}),
            json!([{}]),
            json!("a\u{7}b"),
            json!("x".repeat(65)),
        ];
        for other in others {
            let mut changed = everything.clone();
            *changed.pointer_mut(path).expect("it is there") = other.clone();
            agree(&changed, &format!("{path} is {other}"));
        }
        let mut more = everything.clone();
        if let Some(Value::Object(members)) = more.pointer_mut(path) {
            members.insert("colour".into(), json!(1));
            agree(&more, &format!("{path} with a stranger"));
        }
    }
    assert!(refused > 100, "{refused} were refused");
}

#[test]
fn every_stock_kind_conforms_to_the_schema() {
    let (folder, schema) = (Folder::new("schema"), schema());
    let (code, out, err) = run_to_end(&mut folder.armor(&["describe", "--format", "json"]));
    assert_eq!(code, 0, "{err}");
    assert!(out.lines().count() >= 7, "{out}");
    for line in out.lines() {
        let mut described: Value = serde_json::from_str(line).expect("JSON Lines");
        let kind = described["kind"].as_str().expect("a kind").to_owned();
        let origin = described.as_object_mut().and_then(|members| members.remove("origin"));
        let origin = origin.and_then(|origin| Some(origin.as_str()?.to_owned()));
        // Programs with a window are described if they are in the folder of `armor`.
        let mut asked = match origin.expect("an origin").as_str() {
            "stock" => folder.armor(&["component", &kind, "--describe"]),
            program => {
                let mut asked = Command::new(program);
                asked.arg("--describe");
                asked
            }
        };
        let (code, out, err) = run_to_end(&mut asked);
        assert_eq!(code, 0, "{err}");
        let own: Value = serde_json::from_str(&out).expect("JSON");
        assert_eq!(schema.check(&own), Ok(()), "{kind}");
        assert_eq!(accepted(&own), Ok(()), "{kind}");
        assert_eq!(described, own);
    }
}

/// As [`every_stock_kind_conforms_to_the_schema`], for an executable.
pub fn keeps_to_the_schema(executable: &std::path::Path) {
    let printed = Command::new(executable).arg("--describe").output().expect("it starts").stdout;
    let manifest: Value = serde_json::from_slice(&printed).expect("JSON");
    assert_eq!(schema().check(&manifest), Ok(()));
}

#[test]
fn the_documented_example_conforms_to_the_schema() {
    let page = include_str!("../docs/manifest.md");
    let block = page.split("```json\n").nth(1).and_then(|rest| rest.split("```").next());
    let example: Value = serde_json::from_str(block.expect("an example")).expect("JSON");
    assert_eq!(schema().check(&example), Ok(()));
    assert_eq!(accepted(&example), Ok(()));
}

#[test]
fn a_file_is_refused_for_a_kind_claimed_twice_and_for_no_other_executable() {
    let folder = Folder::new("rivals");
    let manifest = r#"{"armor_manifest":1,"kind":"arm","summary":"","inputs":[],"outputs":[],"parameters":[]}"#;
    for name in ["one", "two"] {
        folder.executable(&format!("components/{name}"), &format!("#!/bin/sh\necho '{manifest}'"));
    }
    folder.executable("components/README", "No program.");
    let uses = folder.system("uses", &["a arm", "b driver"]);
    let (code, _, err) = run_to_end(&mut folder.armor(&["check", &uses]));
    assert!(code == 1 && err.contains("E0124") && err.contains("uses.xml:3:"), "{err}");
    let (code, out, _) = run_to_end(&mut folder.armor(&["check", &uses, "--format", "json"]));
    let codes: Vec<Value> =
        out.lines().map(|line| serde_json::from_str(line).expect("JSON Lines")).collect();
    assert!(code == 1 && codes.iter().any(|finding| finding["code"] == "W0128"), "{out}");
    let alone = folder.system("alone", &["b homing"]);
    let (_, _, err) = run_to_end(&mut folder.armor(&["check", &alone]));
    assert!(!err.contains("E0124") && err.contains("W0130") && err.contains("W0128"), "{err}");
    let (code, out, err) = run_to_end(&mut folder.armor(&["describe"]));
    assert!(code == 0 && out.contains("simulator") && err.contains("README"), "{out}{err}");
}
