//! What a kind of component looks like from outside, found by running its constructor with nothing
//! behind it (ArMoR 4.1).

use std::panic::{self, AssertUnwindSafe};
use std::sync::Arc;

use armor_wire::manifest::{
    MANIFEST_VERSION, Manifest, ManifestFault, ManifestFaults, PortManifest,
};
use armor_wire::schema;
use armor_wire::version::VERSION;
use thiserror::Error;

use crate::armor::Armor;
use crate::call::Fault;
use crate::calls::CalledFunction;
use crate::component::Component;
use crate::identity::ProcessIdentity;
use crate::kind_declaration::{CONSTRUCTOR_RULE, KindDeclaration};
use crate::parameters::ParameterError;
use crate::participant::Participant;
use crate::port_table::{DeclareError, SendError};
use crate::thread_panics::keep_panics_quiet;
use crate::user_code::{UserCode, describe_panic};

/// The manifest of a kind, checked as `armor check` and `armor run` do.
///
/// # Errors
/// If its constructor fails; [`ManifestFaults`] with everything that is wrong with the manifest, or
/// that the constructor and the constants of the component contradict each other in.
pub fn manifest_of<C: Component>() -> Result<Manifest, Fault> {
    describe_kind(&KindDeclaration::of::<C>(), construct::<C>)
}

/// Runs the constructor of a Rust component.
pub(crate) fn construct<C: Component>(armor: Armor) -> Result<Box<dyn UserCode>, Fault> {
    Ok(Box::new(C::new(armor)?))
}

/// The manifest of a kind, from its declaration and its constructor.
///
/// # Errors
/// As of [`manifest_of`].
pub(crate) fn describe_kind(
    kind: &KindDeclaration,
    constructor: impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault>,
) -> Result<Manifest, Fault> {
    let name = kind.kind.clone();
    let identity = ProcessIdentity { name: "describe".into(), kind: name, instance: 1 };
    let participant = Arc::new(Participant::new(identity, kind.declarations(), true)?);
    let running = participant.calls.begin_call(CalledFunction::New);
    let constructed = constructor(Armor { participant: Arc::clone(&participant) });
    constructed.map_err(|fault| explain_constructor(fault, kind.constructor_rule))?;
    drop(running);
    manifest_after_construction(kind, &participant)
}

/// The manifest of a kind whose constructor has declared its ports to `participant`.
///
/// # Errors
/// As of [`manifest_of`], but for the constructor's.
pub(crate) fn manifest_after_construction(
    kind: &KindDeclaration,
    participant: &Participant,
) -> Result<Manifest, Fault> {
    let docs = [kind.ports.clone(), participant.ports.list_docs()].concat();
    let find = |texts: &[(String, String)], id: &str| {
        let found = texts.iter().find(|(port, _)| port == id);
        found.map(|(_, text)| text.clone()).unwrap_or_default()
    };
    let mut faults = list_contradictions(kind, participant);
    let (inputs, outputs) = (participant.ports.inputs(), participant.ports.outputs());
    let inputs = inputs.iter().map(|input| PortManifest {
        doc: find(&docs, &input.id),
        id: input.id.clone(),
        type_name: input.type_name.clone(),
        schema: input.schema.clone(),
        schema_hash: schema::hash_text(&input.schema),
        required: input.required,
        many: input.many,
        latched: false,
        stale_after: find(&kind.stale_after, &input.id),
    });
    let outputs = outputs.iter().map(|output| PortManifest {
        doc: find(&docs, &output.id),
        id: output.id.clone(),
        type_name: output.entry.type_name.clone(),
        schema: output.entry.schema.clone(),
        schema_hash: schema::hash_text(&output.entry.schema),
        required: false,
        many: false,
        latched: output.entry.latched,
        stale_after: String::new(),
    });
    let (inputs, outputs) = (inputs.collect(), outputs.collect());
    let manifest = Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind: kind.kind.clone(),
        summary: kind.summary.clone(),
        inputs,
        outputs,
        parameters: kind.parameters.clone(),
        events: Some(kind.events.clone()),
        reports_done: kind.reports_done,
        ends_by_itself: kind.ends_by_itself,
        needs_rate: kind.needs_rate,
        needs_one_of: kind.needs_one_of.clone(),
        value_effects: kind.value_effects.clone(),
        frames: kind.frames.clone(),
        controllable: participant.lifecycle.is_controllable(),
        reads_all: kind.reads_all,
        protocol: Some(VERSION),
    };
    faults.extend(manifest.validate().err().into_iter().flat_map(|faults| faults.0));
    if faults.is_empty() { Ok(manifest) } else { Err(ManifestFaults(faults).into()) }
}

/// A panic of a constructor.
#[derive(Debug, Error)]
#[error("its constructor panicked{place}: {text}; {CONSTRUCTOR_RULE}")]
pub(crate) struct PanickedConstructor {
    /// ` at FILE:LINE`, if it is known.
    place: String,
    text: String,
}

/// Runs a constructor.
///
/// # Errors
/// Its panic, of which nothing else is printed: `armor check` shows one line.
pub(crate) fn catch_panic<T>(constructor: impl FnOnce() -> T) -> Result<T, PanickedConstructor> {
    let quiet = keep_panics_quiet();
    panic::catch_unwind(AssertUnwindSafe(constructor)).map_err(|panic| {
        let place = quiet.place().map(|place| format!(" at {place}")).unwrap_or_default();
        PanickedConstructor { place, text: describe_panic(panic.as_ref()) }
    })
}

/// Adds the rule to a fault of the component's own; those of the SDK state their remedies.
fn explain_constructor(fault: Fault, rule: &str) -> Fault {
    let is_of_sdk =
        fault.is::<DeclareError>() || fault.is::<SendError>() || fault.is::<ParameterError>();
    if is_of_sdk {
        return fault;
    }
    format!("its constructor failed: {fault}; {rule}").into()
}

/// What the constructor does otherwise than the constants say.
fn list_contradictions(kind: &KindDeclaration, participant: &Participant) -> Vec<ManifestFault> {
    let parameters = &participant.parameters;
    let asked = parameters.unanswered();
    let unknown = asked.iter().filter(|name| parameters.declaration(name).is_none());
    let unknown = unknown.map(|name| ManifestFault {
        subject: format!("the parameter {name}"),
        member: "name",
        problem: format!("the constructor requests `{name}`, which is not in PARAMETERS"),
        remedy: "declare it there, or do not request it".into(),
    });
    let (inputs, outputs) = (participant.ports.inputs(), participant.ports.outputs());
    let inputs = inputs.iter().map(|input| input.id.as_str());
    let ports: Vec<_> = inputs.chain(outputs.iter().map(|output| output.id.as_str())).collect();
    let without_port = kind.ports.iter().filter(|(port, _)| !ports.contains(&port.as_str()));
    let without_port = without_port.map(|(port, _)| ManifestFault {
        subject: format!("the port {port}"),
        member: "doc",
        problem: format!(
            "PORTS has a text for `{port}`, but the constructor declares no such port"
        ),
        remedy: match ports.as_slice() {
            [] => "it declares none".into(),
            ports => format!("it declares {}", ports.join(", ")),
        },
    });
    let documented = kind.ports.iter().enumerate();
    let twice =
        documented.filter(|(n, (port, _))| kind.ports[..*n].iter().any(|(id, _)| id == port));
    let twice = twice.map(|(_, (port, _))| ManifestFault {
        subject: format!("the port {port}"),
        member: "doc",
        problem: format!("PORTS has two texts for `{port}`"),
        remedy: "remove one of them".into(),
    });
    let is_input = |id: &&String| participant.ports.inputs().iter().any(|input| input.id == **id);
    let aged = kind.stale_after.iter().map(|(input, _)| input);
    let without_input = aged.filter(|id| !is_input(id)).map(|id| ManifestFault {
        subject: format!("the port {id}"),
        member: "stale_after",
        problem: format!("STALE_AFTER names `{id}`, but the constructor declares no such input"),
        remedy: "name an input".into(),
    });
    unknown.chain(without_port).chain(twice).chain(without_input).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::component::Component;
    use crate::event::DeclaredEvent;
    use crate::messages::{Flag, Number};
    use crate::parameter::Parameter;

    /// Everything about it is wrong that only its manifest shows.
    struct Faulty;

    impl Component for Faulty {
        const KIND: &'static str = "faulty";
        const SUMMARY: &'static str = "Wrong.";
        const PARAMETERS: &'static [Parameter] = &[
            Parameter::number("depth", "furlong"),
            Parameter::number("speed", "m/s").default("3s"),
            Parameter::integer("count").default("1.5"),
            Parameter::integer("size").default("7").range(1.0, 5.0),
            Parameter::choice("side", &["left", "right"]).default("up"),
            Parameter::flag("count"),
        ];
        const PORTS: &'static [(&'static str, &'static str)] =
            &[("light", "on or off"), ("sound", "none"), ("light", "again")];
        const EVENTS: &'static [DeclaredEvent] = &[DeclaredEvent::new("done")];
        const STALE_AFTER: &'static [(&'static str, &'static str)] =
            &[("light", "soon"), ("dark", "1s")];

        fn new(armor: Armor) -> Result<Self, Fault> {
            armor.provide::<Flag>("light")?;
            armor.subscribe::<Number>("light")?;
            armor.get_parameter("volume")?;
            Ok(Self)
        }
    }

    /// Does in its constructor what no constructor may.
    struct Eager<const N: usize>;

    impl<const N: usize> Component for Eager<N> {
        const KIND: &'static str = "eager";
        const SUMMARY: &'static str = "Opens its device too early.";

        fn new(armor: Armor) -> Result<Self, Fault> {
            armor.provide::<Flag>("light")?;
            if N == 0 {
                std::fs::File::open("/no/such/device")?;
            }
            armor.provide::<Flag>("light")?;
            Ok(Self)
        }
    }

    #[test]
    fn a_constructor_that_fails_names_what_it_may_not_do() {
        let why = manifest_of::<Eager<0>>().expect_err("no such file").to_string();
        let expected = "its constructor failed: No such file or directory (os error 2); `new` runs \
                        for --describe too and opens no hardware or files: do that at Call::Started";
        assert_eq!(why, expected);
        let why = manifest_of::<Eager<1>>().expect_err("a port twice").to_string();
        assert!(why.starts_with("the port `light` is declared twice; inputs and"), "{why}");
    }

    /// Panics in its constructor.
    struct Hasty;

    impl Component for Hasty {
        const KIND: &'static str = "hasty";
        const SUMMARY: &'static str = "Reads its map too early.";

        fn new(_: Armor) -> Result<Self, Fault> {
            panic!("there is no map")
        }
    }

    #[test]
    fn a_constructor_that_panics_names_the_same_and_its_place() {
        let caught = catch_panic(manifest_of::<Hasty>);
        let why = caught.map(|_| ()).expect_err("it panics").to_string();
        let parts = [
            "its constructor panicked at ",
            "describe.rs:",
            ": there is no map; ",
            CONSTRUCTOR_RULE,
        ];
        assert!(parts.iter().all(|part| why.contains(part)), "{why}");
    }

    #[test]
    fn every_fault_of_a_component_is_found_with_its_remedy() {
        let fault = manifest_of::<Faulty>().expect_err("it is wrong");
        let faults = &fault.downcast_ref::<ManifestFaults>().expect("faults").0;
        let expected = [
            "requests `volume`, which is not in PARAMETERS",
            "PORTS has a text for `sound`, but the constructor declares no such port; it declares",
            "PORTS has two texts for `light`",
            "STALE_AFTER names `dark`, but the constructor declares no such input",
            "the port light occurs twice",
            "the parameter count occurs twice",
            "the port light: `soon` is neither an age nor a parameter that is a time",
            "no unit called `furlong`",
            "the parameter speed: its default: `3s` is not in m/s",
            "the parameter count: its default: `1.5` is not a whole number",
            "the parameter size: its default: `7` is out of range, 1 to 5",
            "the parameter side: its default: `up` is none of left, right",
            "the event done",
        ];
        assert_eq!(faults.len(), expected.len(), "{faults:#?}");
        for (fault, expected) in faults.iter().zip(expected) {
            let text = fault.to_string();
            assert!(text.contains(expected), "{text} instead of {expected}");
            assert!(!fault.remedy.is_empty(), "{text}");
        }
    }
}
