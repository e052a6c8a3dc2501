//! The data that guards and variables name: whether it exists, and its type.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use armor_wire::manifest::Manifest;
use armor_wire::quantity::{self, Dimension, Unit};
use armor_wire::schema::{self, FieldError, FieldPath, Schema};

use super::{measured_meaning, within};
use crate::check::names::listed;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::{Meaning, Measure, Name, Type};
use crate::manifests::Manifests;
use crate::mission::Variable;
use crate::model::System;
use crate::source::{Location, Spanned};
use crate::suggestion::suggest_similar;
use crate::typed_manifests::TypedManifests;

/// The fewest letters of a beginning that can only mean one name.
const SHORTEST_BEGINNING: usize = 3;
/// Reports that components of every kind may send.
const COMMON_REPORTS: [&str; 2] = ["done", "failed"];

/// Fields of standard messages with the least and the greatest value that their documentation states.
const RANGES: [(&str, &str, (f64, f64)); 1] = [("BatteryState", "percentage", (0.0, 1.0))];
/// The unit of a share, which is from 0 to 100 of it.
const PERCENT: &str = "%";
/// Any number.
pub(super) const ANY_NUMBER: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// The values that a field can have.
pub(super) struct FieldRange {
    /// The least and the greatest, in SI.
    pub(super) ends: (f64, f64),
    /// Both in words.
    pub(super) text: String,
}

/// The data that guards may name.
pub(super) struct DataFields<'a> {
    system: &'a System,
    /// By component; none without manifests.
    kinds: Option<TypedManifests<'a>>,
    /// The parsed schemas: many guards may use the same one.
    schemas: RefCell<BTreeMap<String, Option<Rc<Schema>>>>,
}

impl<'a> DataFields<'a> {
    pub(super) fn of(system: &'a System, manifests: Option<&'a Manifests>) -> Self {
        let kinds = manifests.map(|manifests| TypedManifests::of(system, manifests));
        Self { system, kinds, schemas: RefCell::default() }
    }

    pub(super) fn variable(&self, variable: &Variable, findings: &mut Findings) -> Meaning {
        let is = match &variable.source {
            None => Type::Any,
            Some(source) => match Name::of_data(&source.value) {
                Some(name) => self.field(&name, source, findings).unwrap_or(Type::Any),
                None => {
                    let message = format!("`{}` is not a field of data", source.value);
                    let finding = Finding::new(Code::BadValue, &source.at, message);
                    let remedy =
                        "write component.output, and .field for each field: power.state.level";
                    findings.push(finding.remedy(remedy));
                    Type::Any
                }
            },
        };
        let ends = [&variable.minimum, &variable.maximum];
        let is =
            ends.into_iter().flatten().fold(is, |is, end| of_domain(variable, is, end, findings));
        let [low, high] = ends.map(|end| end.as_ref().map(|end| (end.value, end.at.text())));
        let domain = match (low, high) {
            (Some((_, low)), Some((_, high))) => format!("{low} to {high}"),
            (Some((_, low)), None) => format!("{low} or more"),
            (None, Some((_, high))) => format!("{high} or less"),
            (None, None) => "any value".into(),
        };
        let mut within =
            (low.map_or(f64::NEG_INFINITY, |low| low.0), high.map_or(f64::INFINITY, |high| high.0));
        // That the minimum exceeds the maximum is a finding already.
        if within.0 > within.1 {
            within = ANY_NUMBER;
        }
        let source = variable.source.as_ref().and_then(|source| Name::of_data(&source.value));
        // A domain that is wider than the field decides nothing.
        if let Some(range) = source.and_then(|source| self.find_range(&source))
            && within.0 <= range.ends.0
            && within.1 >= range.ends.1
            && within != range.ends
        {
            return measured_meaning(is, Some(range));
        }
        Meaning { is, within, domain, is_measured: variable.source.is_some() }
    }

    /// The least and the greatest value of a field, if they are known: of a standard message, of a field
    /// in percent, or of a whole number without a sign.
    pub(super) fn find_range(&self, name: &Name) -> Option<FieldRange> {
        let data = name.data()?;
        let (component, output) = data.split_once('.')?;
        let manifest = self.kinds.as_ref()?.find(component)?;
        let port = manifest.outputs.iter().find(|port| port.id == output)?;
        let is_field = |(message, field, _): &&(&str, &str, _)| {
            *message == port.type_name && name.fields() == [*field]
        };
        if let Some((.., (low, high))) = RANGES.iter().find(is_field) {
            return Some(FieldRange { ends: (*low, *high), text: format!("{low} to {high}") });
        }
        let schema = self.schema_of(data, &port.schema)?;
        let path = FieldPath::find(&schema, &name.fields()).ok()?;
        if path.unit == Some(PERCENT) {
            return Some(FieldRange { ends: (0.0, 1.0), text: "0 to 100 %".to_owned() });
        }
        let is_count = matches!(path.schema, Schema::U8 | Schema::U16 | Schema::U32 | Schema::U64);
        (is_count && path.unit.is_none())
            .then(|| FieldRange { ends: (0.0, f64::INFINITY), text: "0 and more".to_owned() })
    }

    /// The schema of the data of an output, parsed once.
    fn schema_of(&self, data: &str, text: &str) -> Option<Rc<Schema>> {
        let mut schemas = self.schemas.borrow_mut();
        let parse = || schema::parse(text).ok().map(Rc::new);
        schemas.entry(data.to_owned()).or_insert_with(parse).clone()
    }

    /// The type of a field of data; none, and a finding, if there is no such field.
    pub(super) fn field(
        &self,
        name: &Name,
        text: &Spanned<String>,
        findings: &mut Findings,
    ) -> Option<Type> {
        let data = name.data().unwrap_or_default();
        let (component, output) = data.split_once('.')?;
        let part = |index| within(text, name.part_at(index));
        let components = || self.system.components.iter().map(|c| c.name.value.as_str());
        if !components().any(|known| known == component) {
            let what = "component";
            if self.system.unreadable.may_contain(component) {
                return Some(Type::Any);
            }
            unknown(Code::UnknownComponent, what, component, &part(0), components(), findings);
            return None;
        }
        let Some(manifest) = self.kinds.as_ref().and_then(|kinds| kinds.find(component)) else {
            return Some(Type::Any);
        };
        let outputs = || manifest.outputs.iter().map(|output| output.id.as_str());
        let Some(port) = manifest.outputs.iter().find(|port| port.id == output) else {
            let what = format!("output of {}", manifest.kind);
            if name.fields().is_empty() && is_report(manifest, output) {
                let message = format!("there is no {what} called {output}: it is a report");
                let finding = Finding::new(Code::UnknownPort, &part(1), message);
                findings.push(finding.remedy(format!("write on=\"{data}\" for a report")));
                return None;
            }
            unknown(Code::UnknownPort, &what, output, &part(1), outputs(), findings);
            return None;
        };
        // What feeds a component that passes messages on is not known; that is a finding already.
        if port.is_any() {
            return Some(Type::Any);
        }
        // A manifest whose schema cannot be read is its own finding.
        let Some(schema) = self.schema_of(data, &port.schema) else { return Some(Type::Any) };
        let found = FieldPath::find(&schema, &name.fields());
        match found {
            Ok(path) => Some(type_of(&path)),
            Err(error) => {
                let whole = within(text, name.at.clone());
                wrong_field(&error, name, (&whole, &part), &port.type_name, findings);
                None
            }
        }
    }
}

fn wrong_field(
    error: &FieldError,
    name: &Name,
    (whole, part): (&Location, &dyn Fn(usize) -> Location),
    type_name: &str,
    findings: &mut Findings,
) {
    match error {
        FieldError::Unknown { index, name, known } => {
            let what = format!("field of {type_name}");
            let known = known.iter().map(String::as_str);
            unknown(Code::UnknownField, &what, name, &part(index + 2), known, findings);
        }
        FieldError::NoFields { index, name } => {
            let message = format!("{name} is not a field: the value before it has no fields");
            let finding = Finding::new(Code::UnknownField, &part(index + 2), message);
            findings.push(finding.remedy("remove it"));
        }
        FieldError::NotOne { known } => {
            let message = format!("{name} is a {type_name}, which is not a single value");
            let finding = Finding::new(Code::FieldNotSingle, whole, message);
            let remedy = match known.as_slice() {
                [] => "name a field that is a number, a boolean or a text; `armor describe` lists \
                       them"
                    .into(),
                known => {
                    let fields = known.iter().map(|field| format!("{name}.{field}"));
                    let fields: Vec<_> = fields.collect();
                    format!("name the field: {}", listed(fields.iter().map(String::as_str)))
                }
            };
            findings.push(finding.remedy(remedy));
        }
        FieldError::List => {
            let message = format!("{name} is a list");
            let finding = Finding::new(Code::FieldNotSingle, whole, message);
            let remedy = "guards use single values: publish the one that matters from a component";
            findings.push(finding.remedy(remedy));
        }
    }
}

fn unknown<'a>(
    code: Code,
    what: &str,
    name: &str,
    at: &Location,
    known: impl Iterator<Item = &'a str> + Clone,
    findings: &mut Findings,
) {
    let message = format!("there is no {what} called {name}");
    let before_minus =
        |known: &str| name.strip_prefix(known).is_some_and(|rest| rest.starts_with('-'));
    let remedy = if known.clone().any(before_minus) {
        "put spaces around a minus: without them it is part of the name".into()
    } else {
        let guess = suggest_longer(name, known.clone())
            .filter(|_| code == Code::UnknownField)
            .or_else(|| suggest_similar(name, known.clone()));
        guess.unwrap_or_else(|| match known.clone().next() {
            None => "there are none".into(),
            Some(_) => format!("there are: {}", listed(known)),
        })
    };
    findings.push(Finding::new(code, at, message).remedy(remedy));
}

/// Returns a remedy that names the only candidate of which `name` is the beginning.
fn suggest_longer<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let mut longer = known.filter(|known| known.starts_with(name));
    let only = longer.next().filter(|_| name.len() >= SHORTEST_BEGINNING)?;
    longer.next().is_none().then(|| format!("did you mean {only}?"))
}

/// Returns whether components of the kind report this.
fn is_report(manifest: &Manifest, event: &str) -> bool {
    COMMON_REPORTS.contains(&event) || manifest.listed_events().iter().any(|it| it.name == event)
}

fn type_of(path: &FieldPath<'_>) -> Type {
    match path.schema {
        Schema::Bool => Type::Truth,
        Schema::Text => Type::Text(None),
        Schema::Enum { variants, .. } => {
            Type::Text(Some(variants.iter().map(|variant| variant.name.clone()).collect()))
        }
        _ => Type::Number(match path.unit {
            None => Measure::Bare,
            Some(unit) => match Unit::named(unit) {
                None => Measure::Other(unit.to_owned()),
                Some(Unit { name, dimension, to_si }) => {
                    let is_si = (to_si - 1.0).abs() < f64::EPSILON;
                    Measure::Of { dimension: *dimension, unit: (!is_si).then_some(*name) }
                }
            },
        }),
    }
}

/// The type of a variable with an end of its domain: a number. If its source does not determine a
/// unit, it has the unit of that end.
fn of_domain(variable: &Variable, is: Type, end: &Spanned<f64>, findings: &mut Findings) -> Type {
    let written = quantity::parse(end.at.text()).ok().and_then(|quantity| quantity.unit);
    let measure =
        written.map_or(Measure::Bare, |unit| Measure::Of { dimension: unit.dimension, unit: None });
    let name = &variable.name.value;
    let complain = |findings: &mut Findings, code, message: String, remedy: String| {
        findings.push(Finding::new(code, &end.at, message).remedy(remedy));
    };
    match (&is, &measure) {
        (Type::Truth | Type::Text(_), _) => {
            let message = format!(
                "{name} follows data that is not a number, so it has no minimum or maximum"
            );
            complain(findings, Code::GuardType, message, "remove min and max".into());
        }
        (Type::Any | Type::Number(Measure::Any), _) => return Type::Number(measure),
        (Type::Number(Measure::Of { unit: Some(unit), .. }), Measure::Bare) if end.value != 0.0 => {
            let message = format!("`{}` has no unit, but {name} is in {unit}", end.at.text());
            complain(findings, Code::GuardUnit, message, format!("write {}{unit}", end.at.text()));
        }
        (Type::Number(Measure::Of { dimension, .. }), Measure::Of { dimension: other, .. })
            if dimension != other =>
        {
            let message = format!("`{}` is of another quantity than {name}", end.at.text());
            let remedy = "write it in the unit of the source, which `armor describe` shows".into();
            complain(findings, Code::GuardUnit, message, remedy);
        }
        (Type::Number(Measure::Bare), Measure::Of { dimension, .. })
            if *dimension != Dimension::Ratio && variable.source.is_some() =>
        {
            let message =
                format!("`{}` has a unit, but the data of {name} have none", end.at.text());
            complain(findings, Code::GuardUnit, message, "write a number without unit".into());
        }
        _ => {}
    }
    is
}
