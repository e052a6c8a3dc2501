//! The messages that are known: the standard ones, and those of the ports of all kinds.

use std::path::Path;

use anyhow::{Result, bail};
use armor_definitions::{Definition, select_messages, standard_messages};
use armor_robotfile::{Colours, Findings, advise_similar};
use armor_wire::manifest::{Manifest, PortManifest};
use armor_wire::schema::{Schema, parse};

use super::MessageSource;
use crate::kinds::Catalogue;
use crate::print::{print_notice, wants_colours};

/// A message, and the ports that have it.
#[derive(Clone, Debug)]
pub struct KnownMessage {
    /// Its definition.
    pub definition: Definition,
    /// Whether it is one of the standard messages.
    pub is_standard: bool,
    /// The ports that have it.
    pub ports: Vec<MessagePort>,
}

/// A port of a kind.
#[derive(Clone, Debug)]
pub struct MessagePort {
    /// The kind.
    pub kind: String,
    /// The port.
    pub port: String,
    /// Whether it is an input.
    pub is_input: bool,
    /// The parameter of the kind that names the frame of the data; empty if none does.
    pub frame: String,
}

/// All known messages: the standard ones in their order, then the others by name.
#[derive(Debug)]
pub struct KnownMessages(pub Vec<KnownMessage>);

impl KnownMessages {
    /// Gathers the standard messages and those of the kinds that `source` has. A component directory
    /// that cannot be used is reported on stderr.
    ///
    /// # Errors
    /// If a stock component is broken.
    pub fn gather(source: &MessageSource) -> Result<Self> {
        // Without a file, the `components/` of the current folder is searched.
        let file = source.file.as_deref().unwrap_or(Path::new("system.xml"));
        if source.file.is_some() && !file.is_file() {
            bail!("{} is not a file; --file names a system or mission", file.display());
        }
        let catalogue = Catalogue::gather(&source.kinds.directories, [file])?;
        let mut findings = Findings::default();
        findings.extend(catalogue.findings(None));
        let colours = if wants_colours(&std::io::stderr()) { Colours::Yes } else { Colours::No };
        let problems = findings.render(colours);
        if !problems.is_empty() {
            print_notice(problems.trim_end());
        }
        Ok(Self::of_manifests(catalogue.kinds.values().map(|kind| &kind.manifest)))
    }

    fn of_manifests<'a>(manifests: impl Iterator<Item = &'a Manifest>) -> Self {
        let standard = standard_messages();
        let known = standard.iter().map(|definition| KnownMessage {
            definition: definition.clone(),
            is_standard: true,
            ports: Vec::new(),
        });
        let mut known: Vec<_> = known.collect();
        let count = known.len();
        for manifest in manifests {
            let inputs = manifest.inputs.iter().map(|port| (port, true));
            let outputs = manifest.outputs.iter().map(|port| (port, false));
            for (port, is_input) in inputs.chain(outputs).filter(|(port, _)| !port.is_any()) {
                // A schema that cannot be read is a finding of the kind already.
                if let Ok(schema) = parse(&port.schema) {
                    add_port(&mut known, &standard, &schema, name_port(manifest, port, is_input));
                }
            }
        }
        known[count..].sort_by(|a, b| a.definition.name().cmp(b.definition.name()));
        Self(known)
    }

    /// Returns the messages with the name: several if kinds differ in it.
    ///
    /// # Errors
    /// If there is none, with the one that was probably meant.
    pub fn find(&self, name: &str) -> Result<Vec<&KnownMessage>> {
        let found: Vec<_> = self.0.iter().filter(|it| it.definition.name() == name).collect();
        if found.is_empty() {
            let advice = advise_similar(name, self.0.iter().map(|it| it.definition.name()));
            bail!(
                "no message is called {name}{advice}; `armor message list` shows all, and \
                 --components DIR or --file FILE those of more components"
            );
        }
        Ok(found)
    }

    /// Returns the only message with the name.
    ///
    /// # Errors
    /// If there is none, or several.
    pub fn find_one(&self, name: &str) -> Result<&KnownMessage> {
        let found = self.find(name)?;
        let [only] = found.as_slice() else {
            let kinds: Vec<_> = found.iter().map(|it| it.describe_ports()).collect();
            bail!(
                "{} different messages are called {name}: that of {}. Rename one, or use --components \
                 with a folder that has only one of them",
                found.len(),
                kinds.join("; that of ")
            );
        };
        Ok(only)
    }
}

impl KnownMessage {
    /// The ports in one line.
    pub fn describe_ports(&self) -> String {
        let ports = self.ports.iter().map(|it| format!("{}.{}", it.kind, it.port));
        match ports.collect::<Vec<_>>() {
            ports if ports.is_empty() && self.is_standard => "the standard".into(),
            ports => ports.join(", "),
        }
    }
}

fn name_port(manifest: &Manifest, port: &PortManifest, is_input: bool) -> MessagePort {
    let frame = manifest.frames.iter().find(|frame| frame.port == port.id);
    MessagePort {
        kind: manifest.kind.clone(),
        port: port.id.clone(),
        is_input,
        frame: frame.map(|it| it.parameter.clone()).unwrap_or_default(),
    }
}

/// Adds a port to its message, and the messages within that to those that are known.
fn add_port(
    known: &mut Vec<KnownMessage>,
    standard: &[Definition],
    schema: &Schema,
    port: MessagePort,
) {
    // Two messages of one name within one schema: the outer one alone is shown.
    let selection = select_messages(std::slice::from_ref(schema), standard).unwrap_or_default();
    for definition in selection.defined {
        if !known.iter().any(|it| it.definition.schema == definition.schema) {
            known.push(KnownMessage { definition, is_standard: false, ports: Vec::new() });
        }
    }
    if !known.iter().any(|it| it.definition.schema == *schema) {
        let definition = Definition::of_schema(schema.clone());
        known.push(KnownMessage { definition, is_standard: false, ports: Vec::new() });
    }
    if let Some(message) = known.iter_mut().find(|it| it.definition.schema == *schema) {
        message.ports.push(port);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds::sensor_manifest;

    #[test]
    fn messages_of_kinds_follow_the_standard_ones_with_their_ports() {
        let kinds = [
            sensor_manifest("a", "Reading{side:Side<Left,Right>,at:Vector3{x:f64,y:f64,z:f64}(m)}"),
            sensor_manifest("b", "Reading{celsius:f64}"),
        ];
        let known = KnownMessages::of_manifests(kinds.iter());
        let own: Vec<_> = known.0.iter().filter(|it| !it.is_standard).collect();
        let names: Vec<_> = own.iter().map(|it| it.definition.name()).collect();
        assert_eq!(names, ["Reading", "Reading", "Side"]);
        assert_eq!(own[0].describe_ports(), "a.out");
        assert!(known.find_one("LaserScan").is_ok());
        let error = known.find_one("Reading").expect_err("two").to_string();
        assert!(error.contains("that of a.out; that of b.out"), "{error}");
        let error = known.find("LaserScam").expect_err("none").to_string();
        assert!(error.contains("did you mean LaserScan?"), "{error}");
    }
}
