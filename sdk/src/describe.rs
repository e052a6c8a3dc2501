//! What a kind of component looks like from outside, found by running its constructor with nothing
//! behind it (ArMoR 4.1).

use std::sync::Arc;

use armor_wire::manifest::{MANIFEST_VERSION, Manifest, ParameterManifest, PortManifest};
use armor_wire::schema;

use crate::armor::Armor;
use crate::call::Fault;
use crate::component::Component;
use crate::identity::ProcessIdentity;
use crate::participant::Participant;

/// The manifest of a kind.
///
/// # Errors
/// If its constructor fails, or asks for a parameter that it does not declare.
pub fn manifest_of<C: Component>() -> Result<Manifest, Fault> {
    let identity = ProcessIdentity { name: "describe".into(), kind: C::KIND.into(), instance: 1 };
    let participant = Arc::new(Participant::new(identity, declared_parameters::<C>(), true)?);
    C::new(Armor { participant: Arc::clone(&participant) })?;
    let doc = |id: &str| {
        let found = C::PORTS.iter().find(|(port, _)| *port == id);
        found.map(|(_, doc)| (*doc).to_owned()).unwrap_or_default()
    };
    let parameters = &participant.parameters;
    let asked = parameters.unanswered();
    if let Some(unknown) = asked.iter().find(|name| parameters.declaration(name).is_none()) {
        return Err(
            format!("the constructor asks for `{unknown}`, which is not in PARAMETERS").into()
        );
    }
    let (inputs, outputs) = (participant.ports.inputs(), participant.ports.outputs());
    let inputs = inputs.iter().map(|input| PortManifest {
        doc: doc(&input.id),
        id: input.id.clone(),
        type_name: input.type_name.into(),
        schema: input.schema.clone(),
        schema_hash: schema::hash_text(&input.schema),
        required: input.required,
        latched: false,
    });
    let outputs = outputs.iter().map(|output| PortManifest {
        doc: doc(&output.id),
        id: output.id.clone(),
        type_name: output.entry.type_name.clone(),
        schema: output.entry.schema.clone(),
        schema_hash: schema::hash_text(&output.entry.schema),
        required: false,
        latched: output.entry.latched,
    });
    let (inputs, outputs) = (inputs.collect(), outputs.collect());
    Ok(Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind: C::KIND.into(),
        summary: C::SUMMARY.into(),
        inputs,
        outputs,
        parameters: declared_parameters::<C>(),
    })
}

/// The parameters a kind declares.
pub(crate) fn declared_parameters<C: Component>() -> Vec<ParameterManifest> {
    C::PARAMETERS.iter().map(crate::parameter::Parameter::manifest).collect()
}
