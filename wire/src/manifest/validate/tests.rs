//! Each fault of a manifest is named, and all of them together.

use super::*;
use crate::manifest::{PortFrame, ValueEffect};
use crate::text_format::TextFormat;

type Fault = fn(&mut Manifest);

fn manifest() -> Manifest {
    let schema = "Scan{ranges:[f32](m)}";
    let port = |id: &str| PortManifest {
        id: id.into(),
        type_name: "Scan".into(),
        schema: schema.into(),
        schema_hash: schema::hash_text(schema),
        doc: String::new(),
        required: false,
        many: false,
        latched: false,
        stale_after: String::new(),
    };
    let speed = ParameterManifest {
        name: "speed".into(),
        kind: ParameterType::Number,
        unit: "m/s".into(),
        default: Some("0.5".into()),
        minimum: Some(0.0),
        maximum: Some(1.0),
        choices: vec![],
        format: None,
        doc: "how fast".into(),
        live: true,
        written: false,
    };
    let lap = EventManifest {
        name: "lap".into(),
        doc: "a lap is over".into(),
        value: Some(EventValue::Number),
        unit: "s".into(),
        named_by: String::new(),
    };
    Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind: "mapper".into(),
        summary: "Draws.".into(),
        controllable: true,
        reads_all: false,
        protocol: None,
        reports_done: true,
        ends_by_itself: false,
        needs_rate: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
        inputs: vec![port("scan")],
        outputs: vec![port("map")],
        parameters: vec![speed],
        events: Some(vec![lap]),
    }
}

fn effect(parameter: &str, effect: EffectKind, value: &str, output: &str) -> ValueEffect {
    let (parameter, value, output) = (parameter.into(), value.into(), output.into());
    ValueEffect { parameter, effect, value, output, times: Vec::new() }
}

/// Its only event.
fn lap(manifest: &mut Manifest) -> &mut EventManifest {
    &mut manifest.events.as_mut().expect("events")[0]
}

fn set_schema(port: &mut PortManifest, schema: &str) {
    (port.schema, port.schema_hash) = (schema.into(), schema::hash_text(schema));
}

#[test]
fn each_fault_is_named() {
    assert_eq!(manifest().validate(), Ok(()));
    let faults: [(&str, Fault); 38] = [
        ("version 2", |m| m.armor_manifest = 2),
        ("speaks version 3 of the protocol", |m| m.protocol = Some(3)),
        ("`9x` is not a name", |m| m.kind = "9x".into()),
        ("summary is not one line", |m| m.summary = "a\u{1b}[2J".into()),
        ("port map occurs twice", |m| m.inputs[0].id = "map".into()),
        ("`a b` is not a name", |m| m.inputs[0].id = "a b".into()),
        ("its schema", |m| m.inputs[0].schema = "Scan{".into()),
        ("that of Scan", |m| m.outputs[0].type_name = "Map".into()),
        ("schema_hash", |m| m.outputs[0].schema_hash = 1),
        ("the port map: a field of Scan has the unknown unit `furlong`", |m| {
            set_schema(&mut m.outputs[0], "Scan{hits:[Hit{at:f32(furlong)}]}");
        }),
        ("no unit called `knots`", |m| m.parameters[0].unit = "knots".into()),
        ("no number", |m| {
            m.parameters[0].kind = ParameterType::Text;
            (m.parameters[0].minimum, m.parameters[0].maximum) = (None, None);
        }),
        ("range is empty", |m| m.parameters[0].minimum = Some(2.0)),
        ("its default: `0.5` is out of range", |m| m.parameters[0].maximum = Some(0.1)),
        ("its default: `fast`", |m| m.parameters[0].default = Some("fast".into())),
        ("its default: `1.5s` is not in m/s", |m| {
            m.parameters[0].default = Some("1.5s".into());
        }),
        ("its default: `0.5` is not a whole number", |m| {
            let parameter = &mut m.parameters[0];
            (parameter.kind, parameter.unit) = (ParameterType::Integer, String::new());
        }),
        ("choices, but is none", |m| m.parameters[0].choices = vec!["a".into()]),
        ("no choices", |m| {
            let parameter = &mut m.parameters[0];
            (parameter.kind, parameter.unit) = (ParameterType::Choice, String::new());
            (parameter.minimum, parameter.maximum) = (None, None);
        }),
        ("`a` occurs twice", |m| {
            let parameter = &mut m.parameters[0];
            (parameter.kind, parameter.unit) = (ParameterType::Choice, String::new());
            (parameter.minimum, parameter.maximum) = (None, None);
            parameter.choices = vec!["a".into(), "a".into()];
        }),
        ("the port scan: `soon` is neither an age", |m| {
            m.inputs[0].stale_after = "soon".into();
        }),
        ("the port scan: `speed` is neither an age", |m| {
            m.inputs[0].stale_after = "speed".into();
        }),
        ("`sound` is no input or parameter", |m| {
            m.needs_one_of = vec![vec!["scan".into(), "sound".into()]];
        }),
        ("`1kg` has an effect, and is no value of it", |m| {
            m.value_effects = vec![effect("speed", EffectKind::Idle, "1kg", "")];
        }),
        ("its value has an effect, and there is no such parameter", |m| {
            m.value_effects = vec![effect("sped", EffectKind::Idle, "0m/s", "")];
        }),
        ("its value has an effect as a time, and it is none", |m| {
            m.value_effects = vec![effect("speed", EffectKind::DelaysDone, "", "")];
        }),
        ("`rounds` is no parameter that multiplies its time", |m| {
            let mut idle = effect("speed", EffectKind::Idle, "0m/s", "");
            idle.times = vec!["rounds".into()];
            m.value_effects = vec![idle];
        }),
        ("the port map: it is an output", |m| m.outputs[0].stale_after = "1s".into()),
        ("it has a frame, and there is no such port", |m| {
            let (name, default) = ("mount".into(), Some("laser".into()));
            let (kind, format) = (ParameterType::Text, Some(TextFormat::Frame));
            let (unit, minimum, maximum) = (String::new(), None, None);
            let speed = m.parameters[0].clone();
            m.parameters.push(ParameterManifest {
                name,
                default,
                kind,
                format,
                unit,
                minimum,
                maximum,
                ..speed
            });
            m.frames = vec![PortFrame { port: "sound".into(), parameter: "mount".into() }];
        }),
        ("`speed` does not name its frame", |m| {
            m.frames = vec![PortFrame { port: "scan".into(), parameter: "speed".into() }];
        }),
        ("it has the format points, but is no text", |m| {
            m.parameters[0].format = Some(TextFormat::Points);
        }),
        ("its default: point 1, `0.5`, is not x,y", |m| {
            let parameter = &mut m.parameters[0];
            (parameter.kind, parameter.unit) = (ParameterType::Text, String::new());
            (parameter.minimum, parameter.maximum) = (None, None);
            parameter.format = Some(TextFormat::Points);
        }),
        ("occurs twice", |m| m.parameters.push(m.parameters[0].clone())),
        ("the event lap occurs twice", |m| {
            let lap = lap(m).clone();
            m.events.get_or_insert_default().push(lap);
        }),
        ("the event done: `done` and `failed`", |m| lap(m).name = "done".into()),
        ("the event lap: there is no unit called `knots`", |m| {
            lap(m).unit = "knots".into();
        }),
        ("named by `speed`, which is no text", |m| lap(m).named_by = "speed".into()),
        ("the event lap: it has the unit s", |m| lap(m).value = None),
    ];
    for (expected, fault) in faults {
        let mut manifest = manifest();
        fault(&mut manifest);
        let why = manifest.validate().expect_err(expected);
        assert!(why.to_string().contains(expected), "{why} instead of {expected}");
        assert_eq!(why.0.len(), 1, "{why}");
        assert!(!why.0[0].remedy.is_empty(), "{why}");
    }
}

#[test]
fn all_faults_are_found_together() {
    let mut manifest = manifest();
    manifest.kind = "9x".into();
    manifest.inputs[0].schema_hash = 1;
    manifest.parameters[0].unit = "knots".into();
    lap(&mut manifest).name = "failed".into();
    let faults = manifest.validate().expect_err("four faults");
    let members: Vec<_> = faults.0.iter().map(|fault| fault.member).collect();
    assert_eq!(members, ["kind", "schema_hash", "unit", "name"]);
}
