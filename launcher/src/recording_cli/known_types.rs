//! Outputs of a recording whose types have other fields than here: in this program, or in the
//! components that would take them. A recording is read by its own types; this is for people.

use anyhow::{Result, anyhow, bail};
use armor_definitions::name_of;
use armor_marking::Marking;
use armor_recording::trail::{JOURNAL, PARAMETERS, RecordedDecision, RecordedParameter};
use armor_recording::{REPORTS, RecordedOutput, RecordedReport, RecordingSummary};
use armor_sdk::messages::standard_definitions;
use armor_wire::manifest::Manifest;
use armor_wire::message::Message;
use armor_wire::schema::difference;
use serde_json::json;

use crate::kinds::Catalogue;
use crate::kinds::stock::STOCK;
use crate::message_cli::MessageSource;

/// The output of the executive.
const MARKING: &str = "executive.marking";
/// Who has the standard messages, and the types of this program.
const THIS_VERSION: &str = "this version";

/// Types that are known here.
#[derive(Debug, Default)]
pub struct KnownTypes(Vec<KnownType>);

#[derive(Debug)]
struct KnownType {
    name: String,
    schema: String,
    whose: TypeOwner,
}

#[derive(Debug)]
enum TypeOwner {
    /// A standard message, of any output.
    Standard,
    /// The type of one output.
    Output(&'static str),
    /// The type of a port of a kind.
    Port { kind: String, id: String },
}

/// An output with a type that has other fields here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChangedType {
    data: String,
    type_name: String,
    /// Whose type it is that differs.
    whose: String,
    lines: Vec<String>,
}

impl KnownTypes {
    /// The types of this program: standard messages, and those of the stock components. With `source`,
    /// also those of the components there.
    ///
    /// # Errors
    /// If a stock component is broken, or the file of `source` is missing.
    pub fn gather(source: &MessageSource) -> Result<Self> {
        if source.file.is_none() && source.kinds.directories.is_empty() {
            // No other program is asked: it takes as long as all the rest.
            let stock = STOCK.iter().map(|stock| (stock.manifest)());
            let stock = stock.collect::<Result<Vec<_>, _>>().map_err(|fault| anyhow!("{fault}"))?;
            return Ok(Self::of_manifests(stock.iter()));
        }
        if let Some(file) = source.file.as_ref().filter(|file| !file.is_file()) {
            bail!("{} is not a file; --file names a system or mission", file.display());
        }
        let catalogue = Catalogue::gather(&source.kinds.directories, source.file.as_deref())?;
        Ok(Self::of_catalogue(&catalogue))
    }

    /// The types of this program and of all kinds.
    pub fn of_catalogue(catalogue: &Catalogue) -> Self {
        Self::of_manifests(catalogue.kinds.values().map(|kind| &kind.manifest))
    }

    fn of_manifests<'a>(manifests: impl Iterator<Item = &'a Manifest>) -> Self {
        let mut known = Self::default();
        for standard in standard_definitions() {
            let name = name_of(&standard.schema).unwrap_or_default().to_owned();
            let schema = standard.schema.to_string();
            known.0.push(KnownType { name, schema, whose: TypeOwner::Standard });
        }
        known.add_own::<RecordedReport>(REPORTS);
        known.add_own::<RecordedDecision>(JOURNAL);
        known.add_own::<RecordedParameter>(PARAMETERS);
        known.add_own::<Marking>(MARKING);
        for manifest in manifests {
            for port in manifest.inputs.iter().chain(&manifest.outputs).filter(|it| !it.is_any()) {
                let whose = TypeOwner::Port { kind: manifest.kind.clone(), id: port.id.clone() };
                let (name, schema) = (port.type_name.clone(), port.schema.clone());
                known.0.push(KnownType { name, schema, whose });
            }
        }
        known
    }

    fn add_own<T: Message>(&mut self, data: &'static str) {
        let (name, schema) = (T::NAME.to_owned(), T::schema().to_string());
        self.0.push(KnownType { name, schema, whose: TypeOwner::Output(data) });
    }

    /// The outputs of a recording whose type has other fields here. A type of a component is compared
    /// where name and output are the same: two kinds may call different types by one name.
    pub fn find_changed(&self, summary: &RecordingSummary) -> Vec<ChangedType> {
        let written = summary.outputs.iter().filter(|output| !output.schema.is_empty());
        written.filter_map(|output| self.compare_output(output)).collect()
    }

    fn compare_output(&self, output: &RecordedOutput) -> Option<ChangedType> {
        let port = output.data.split_once('.').map_or("", |(_, port)| port);
        let mut known = self.0.iter().filter(|known| {
            known.name == output.type_name
                && match &known.whose {
                    TypeOwner::Standard => true,
                    TypeOwner::Output(data) => *data == output.data,
                    TypeOwner::Port { id, .. } => id == port,
                }
        });
        let first = known.next()?;
        if first.schema == output.schema || known.any(|it| it.schema == output.schema) {
            return None;
        }
        let whose = match &first.whose {
            TypeOwner::Standard | TypeOwner::Output(_) => THIS_VERSION,
            TypeOwner::Port { kind, .. } => kind,
        };
        let lines = difference(("the recording", &output.schema), (whose, &first.schema));
        Some(ChangedType {
            data: output.data.clone(),
            type_name: output.type_name.clone(),
            whose: whose.into(),
            lines: lines.lines().map(str::to_owned).collect(),
        })
    }
}

impl ChangedType {
    /// In words.
    pub fn describe(&self) -> String {
        let Self { data, type_name, whose, lines } = self;
        format!("{data}: {type_name} has other fields in {whose}: {}", lines.join("; "))
    }

    /// As an object.
    pub fn to_json(&self) -> serde_json::Value {
        json!({
            "data": self.data, "type": self.type_name, "whose": self.whose,
            "difference": self.lines,
        })
    }
}

/// How the type of an output has changed within a recording, in words; none if it has not.
pub fn describe_change_within(output: &RecordedOutput) -> Option<String> {
    let before = output.earlier_schemas.last()?;
    let lines = difference(("its earlier form", before), ("its last form", &output.schema));
    let data = &output.data;
    Some(format!("{data}: its fields have changed meanwhile: {}", lines.replace('\n', "; ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds::sensor_manifest;

    fn output(data: &str, type_name: &str, schema: &str) -> RecordedOutput {
        RecordedOutput {
            data: data.into(),
            type_name: type_name.into(),
            schema: schema.into(),
            ..RecordedOutput::default()
        }
    }

    fn find(outputs: Vec<RecordedOutput>) -> Vec<String> {
        let kinds = [
            sensor_manifest("wheel", "Reading{speed:f64,load:f64}"),
            sensor_manifest("arm", "Reading{angle:f64}"),
        ];
        let summary = RecordingSummary { outputs, ..RecordingSummary::default() };
        let known = KnownTypes::of_manifests(kinds.iter());
        known.find_changed(&summary).iter().map(ChangedType::describe).collect()
    }

    #[test]
    fn other_fields_are_named_with_the_side_that_has_them() {
        let found = find(vec![
            output("a.out", "Reading", "Reading{angle:f64}"),
            output("b.out", "Reading", "Reading{speed:f64,heat:f64}"),
            output("c.other", "Reading", "Reading{x:u8}"),
            output("d.value", "Number", "Number{data:f32}"),
            output("e.value", "", ""),
            output(REPORTS, "RecordedReport", "RecordedReport{stamp:f64(s)}"),
        ]);
        assert_eq!(found.len(), 3, "{found:?}");
        assert_eq!(
            found[0],
            "b.out: Reading has other fields in wheel: heat: only the recording has it; \
             load: only wheel has it"
        );
        assert_eq!(
            found[1],
            "d.value: Number has other fields in this version: data: the recording has f32, \
             this version has f64"
        );
        assert!(found[2].contains("component: only this version has it"), "{}", found[2]);
    }

    #[test]
    fn a_change_within_a_recording_is_named() {
        let mut changed = output("a.out", "Reading", "Reading{x:f64,y:f64}");
        assert_eq!(describe_change_within(&changed), None);
        changed.earlier_schemas.push("Reading{x:f64}".into());
        let expected = "a.out: its fields have changed meanwhile: y: only its last form has it";
        assert_eq!(describe_change_within(&changed).as_deref(), Some(expected));
    }
}
