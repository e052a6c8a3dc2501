//! A component that is declared while it runs: its manifest, its ports and its faults.

use armor_wire::manifest::{EventManifest, ParameterManifest, ParameterType};

use super::*;
use crate::messages::{Count, Image};
use crate::testing::{ReportKind, RunState};

/// Sends what it receives, in two pieces, and keeps it.
struct Echo {
    armor: ForeignArmor,
    kept: Vec<KeptMessage>,
    speed: f64,
}

impl ForeignComponent for Echo {
    fn parameter_received(&mut self, _: &str, value: &Value) -> Result<(), Fault> {
        self.speed = value.number()?;
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let (head, tail) = data.bytes().split_at(4);
        self.armor.send_data(&format!("{}-back", header.id()), &[head, tail])?;
        self.kept.push(data.keep());
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Tick if self.speed > 1.0 => Err("too fast".into()),
            Call::Tick => Ok(Outcome::event("echoed", self.kept.len() as f64)),
            _ => Ok(Outcome::CarryOn),
        }
    }
}

fn echo() -> KindDeclaration {
    KindDeclaration {
        parameters: vec![ParameterManifest {
            name: "speed".into(),
            kind: ParameterType::Number,
            unit: "m/s".into(),
            default: Some("0.5m/s".into()),
            minimum: None,
            maximum: None,
            choices: Vec::new(),
            format: None,
            doc: String::new(),
            live: true,
            written: false,
        }],
        events: vec![EventManifest {
            name: "echoed".into(),
            doc: String::new(),
            value: None,
            unit: String::new(),
            named_by: String::new(),
        }],
        ports: vec![("count".into(), "what came".into())],
        ..KindDeclaration::new("echo", "Sends what it receives.")
    }
}

fn count_type() -> PortType {
    PortType::parse("Count{count:u64}").expect("a schema")
}

fn construct_echo(armor: ForeignArmor) -> Result<Box<dyn ForeignComponent>, Fault> {
    for (id, of) in [("count", count_type()), ("image", image_type())] {
        armor.subscribe(id, &of, true, false)?;
        armor.provide(&format!("{id}-back"), &of, false)?;
    }
    armor.get_parameter("speed")?;
    armor.synchronize()?;
    let arrived = armor.find_arrived("speed");
    let speed = arrived.map_or(Ok(0.0), |value| value.number())?;
    Ok(Box::new(Echo { armor, kept: Vec::new(), speed }))
}

fn image_type() -> PortType {
    use armor_wire::WireType;
    PortType::of_schema(Image::schema()).expect("a message")
}

#[test]
fn its_manifest_is_that_of_a_rust_component_with_the_same_declarations() {
    let manifest = manifest_of(&echo(), construct_echo).expect("it is valid");
    assert_eq!((&*manifest.kind, &*manifest.summary), ("echo", "Sends what it receives."));
    let [count, image] = manifest.inputs.as_slice() else { panic!("{:?}", manifest.inputs) };
    use armor_wire::Message;
    assert_eq!((&*count.type_name, count.schema_hash), ("Count", Count::schema_hash()));
    assert_eq!((&*count.doc, count.required, count.many), ("what came", true, false));
    assert_eq!((&*image.type_name, image.schema_hash), ("Image", Image::schema_hash()));
    assert_eq!(manifest.parameters[0].name, "speed");
    let mut wrong = echo();
    wrong.ports.push(("sound".into(), "none".into()));
    wrong.constructor_rule = "no files in __init__";
    let why = manifest_of(&wrong, construct_echo).expect_err("no such port").to_string();
    assert!(why.contains("PORTS has a text for `sound`"), "{why}");
    let failing = |_| Err("no camera".into());
    let why = manifest_of(&wrong, failing).expect_err("it fails").to_string();
    assert_eq!(why, "its constructor failed: no camera; no files in __init__");
}

#[test]
fn messages_pass_as_bytes_and_are_those_of_rust() {
    let mut echo =
        TestedComponent::build_foreign(&echo(), &[("speed", "0.2m/s")], construct_echo).unwrap();
    echo.start().unwrap();
    echo.send("count", &Count { count: 7 }).unwrap();
    echo.send_encoded("count", None, &count_type(), &8_u64.to_le_bytes()).unwrap();
    let counts = echo.outputs::<Count>("count-back").unwrap();
    assert_eq!(counts, [Count { count: 7 }, Count { count: 8 }]);
    let image = Image { width: 200, data: vec![7; 100_000].into(), ..Image::default() };
    echo.send("image", &image).unwrap();
    assert_eq!(echo.outputs::<Image>("image-back").unwrap(), [image]);
    echo.tick_after(std::time::Duration::from_secs(1)).unwrap();
    let event = ReportKind::Event { name: "echoed".into(), value: 3.0 };
    assert_eq!(echo.reports(), [event]);
    let other = PortType::parse("Count{count:u32}").unwrap();
    let refused = echo.send_encoded("count", None, &other, &[0; 4]).unwrap_err().to_string();
    assert!(refused.contains("input `count` is declared as Count"), "{refused}");
}

#[test]
fn its_faults_are_reports() {
    let mut echo = TestedComponent::build_foreign(&echo(), &[], construct_echo).unwrap();
    echo.start().unwrap();
    echo.set_parameter("speed", "2m/s").unwrap();
    let failed = echo.tick_after(std::time::Duration::from_secs(1)).unwrap_err().to_string();
    assert_eq!(failed, "`echo` has failed: too fast");
    assert_eq!(echo.state(), RunState::Failed);
}

/// Passes on what it receives.
struct Relay(ForeignArmor);

impl ForeignComponent for Relay {
    fn parameter_received(&mut self, _: &str, _: &Value) -> Result<(), Fault> {
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let message = AnyMessage::received(header, data)?;
        assert_eq!(message.stamp_s(), header.stamp_s);
        self.0.send_any("out", &message)?;
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Tick {
            self.0.send_data("out", &[&[0; 8]])?;
        }
        Ok(Outcome::CarryOn)
    }
}

#[test]
fn messages_of_any_type_are_passed_on_as_the_first_link_gives_it() {
    let any = PortType::parse("Any{}").expect("a schema");
    assert!(any.is_any() && !count_type().is_any());
    let kind = KindDeclaration::new("relay", "Passes messages on.");
    let construct = |armor: ForeignArmor| -> Result<Box<dyn ForeignComponent>, Fault> {
        armor.subscribe("in", &any, true, true)?;
        armor.provide("out", &any, false)?;
        Ok(Box::new(Relay(armor)))
    };
    let manifest = manifest_of(&kind, construct).expect("it is valid");
    assert_eq!((&*manifest.inputs[0].type_name, &*manifest.outputs[0].schema), ("Any", "Any{}"));
    let mut relay = TestedComponent::build_foreign(&kind, &[], construct).unwrap();
    relay.start().unwrap();
    relay.send_encoded("in", None, &count_type(), &8_u64.to_le_bytes()).unwrap();
    relay.send("in", &Count { count: 9 }).unwrap();
    let (schema, messages) = relay.encoded_outputs("out").unwrap();
    assert_eq!(schema, count_type().text());
    assert_eq!(messages, [8_u64.to_le_bytes(), 9_u64.to_le_bytes()]);
    let other = relay.send_encoded("in", None, &image_type(), &[]).unwrap_err().to_string();
    assert!(other.contains("is a Image, which input `in` does not take"), "{other}");
    let encoded = relay.tick_after(std::time::Duration::from_secs(1)).unwrap_err().to_string();
    assert!(
        encoded.contains("out` is declared as Count, but a message in encoded form"),
        "{encoded}"
    );
}

#[test]
fn only_a_struct_or_an_enum_with_a_name_is_a_message() {
    for (text, why) in [
        ("[u8]", "is not the schema of a message"),
        ("Count{count:u65}", "schema text, byte 1"),
        ("Count{count:u64", "schema text, byte 15"),
    ] {
        let refused = PortType::parse(text).expect_err(text).to_string();
        assert!(refused.contains(why), "{refused}");
    }
}
