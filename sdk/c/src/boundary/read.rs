//! Reads what C has filled in: texts, tables, declarations. Each function copies, but for the memory of a
//! message.

use std::ffi::{CStr, c_char, c_int};
use std::marker::PhantomData;
use std::slice;

use armor_sdk::Outcome;
use armor_sdk::foreign::KindDeclaration;
use armor_sdk::wire::manifest::{EventManifest, EventValue, ParameterManifest, ParameterType};
use armor_sdk::wire::text_format::TextFormat;

use super::handles::ArmorComponent;
use crate::codec::ForeignMemory;
use crate::declaration::{
    ArmorEvent, ArmorField, ArmorFieldForm, ArmorFieldKind, ArmorOutcome, ArmorOutcomeKind,
    ArmorParameter, ArmorType,
};
use crate::failure::{ArmorError, Failure};
use crate::layout::{FieldTable, MAX_DEPTH, TypeContent, TypeTable};

/// What the constructor may not do, for C and C++.
const CONSTRUCTOR_RULE: &str = "it runs for --describe too and opens no hardware or files: do that \
                                when `exec` is called with ARMOR_CALL_STARTED";

const FIELD_KINDS: [ArmorFieldKind; 13] = [
    ArmorFieldKind::Bool,
    ArmorFieldKind::U8,
    ArmorFieldKind::I8,
    ArmorFieldKind::U16,
    ArmorFieldKind::I16,
    ArmorFieldKind::U32,
    ArmorFieldKind::I32,
    ArmorFieldKind::U64,
    ArmorFieldKind::I64,
    ArmorFieldKind::F32,
    ArmorFieldKind::F64,
    ArmorFieldKind::Text,
    ArmorFieldKind::Nested,
];
const FIELD_FORMS: [ArmorFieldForm; 3] =
    [ArmorFieldForm::One, ArmorFieldForm::Fixed, ArmorFieldForm::List];

/// Looks up a number that C has written.
fn find_kind<T: Copy>(kinds: &[T], number: c_int, what: &str) -> Result<T, Failure> {
    let found = usize::try_from(number).ok().and_then(|number| kinds.get(number)).copied();
    found.ok_or_else(|| Failure::new(ArmorError::Table, format!("{number} is no {what}")))
}

/// Reads a text that must be given.
///
/// # Safety
/// `text` is NULL, or ends with a NUL and does not change while the result is used.
pub(super) unsafe fn read_text<'a>(text: *const c_char, what: &str) -> Result<&'a str, Failure> {
    check_utf8(unsafe { read_bytes(text, what) }?, what)
}

/// As [`read_text`], not yet known to be UTF-8.
///
/// # Safety
/// As there.
pub(super) unsafe fn read_bytes<'a>(text: *const c_char, what: &str) -> Result<&'a CStr, Failure> {
    if text.is_null() {
        return Err(Failure::null(what));
    }
    Ok(unsafe { CStr::from_ptr(text) })
}

pub(crate) fn check_utf8<'a>(text: &'a CStr, what: &str) -> Result<&'a str, Failure> {
    text.to_str()
        .map_err(|_| Failure::new(ArmorError::NotUtf8, format!("{what} is not UTF-8: {text:?}")))
}

/// Reads a text that may be left out; empty without.
///
/// # Safety
/// As [`read_text`].
pub(super) unsafe fn read_optional_text<'a>(
    text: *const c_char,
    what: &str,
) -> Result<&'a str, Failure> {
    if text.is_null() { Ok("") } else { unsafe { read_text(text, what) } }
}

/// Reads a pointer that must be given.
///
/// # Safety
/// `pointer` is NULL, or leads to a value that is valid and does not change while the result is used.
pub(super) unsafe fn read_pointer<'a, T>(pointer: *const T, what: &str) -> Result<&'a T, Failure> {
    unsafe { pointer.as_ref() }.ok_or_else(|| Failure::null(what))
}

/// Reads a pointer and a length; empty if the length is 0.
///
/// # Safety
/// `items` is NULL, or leads to `count` values that are valid and do not change while the result is
/// used.
pub(super) unsafe fn read_slice<'a, T>(
    items: *const T,
    count: usize,
    what: &str,
) -> Result<&'a [T], Failure> {
    match (items.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(Failure::null(what)),
        (false, _) => Ok(unsafe { slice::from_raw_parts(items, count) }),
    }
}

/// What a message of C points to.
pub(super) struct MessageMemory<'a>(PhantomData<&'a [u8]>);

impl MessageMemory<'_> {
    /// # Safety
    /// Every pointer in the message whose length is not 0 leads to as many values, which do not change
    /// while the result is used; the same applies to the pointers in these.
    pub unsafe fn of_message() -> Self {
        Self(PhantomData)
    }
}

impl<'a> ForeignMemory<'a> for MessageMemory<'a> {
    fn bytes(&self, address: usize, len: usize) -> &'a [u8] {
        // The caller of `of_message` answers for the pointers.
        unsafe { slice::from_raw_parts(std::ptr::with_exposed_provenance(address), len) }
    }
}

/// Reads the table of a type, with those that it contains.
///
/// # Safety
/// `table` is NULL, or it and everything that it leads to are valid.
pub(super) unsafe fn read_type(
    table: *const ArmorType,
    depth: usize,
) -> Result<TypeTable, Failure> {
    if depth > MAX_DEPTH {
        let why = format!("types are nested more than {MAX_DEPTH} deep; does one contain itself?");
        return Err(Failure::new(ArmorError::Table, why));
    }
    unsafe {
        let table = read_pointer(table, "the table of a type")?;
        let name = read_text(table.name, "the name of a type")?.to_owned();
        let content = if table.variants.is_null() {
            let fields = read_slice(table.fields, table.field_count, "the fields of a type")?;
            let fields = fields.iter().map(|field| read_field(field, depth));
            TypeContent::Fields(fields.collect::<Result<_, _>>()?)
        } else {
            let names = read_slice(table.variants, table.variant_count, "the values of an enum")?;
            let own = |name: &*const c_char| read_text(*name, "a value").map(str::to_owned);
            TypeContent::Variants(names.iter().map(own).collect::<Result<_, _>>()?)
        };
        Ok(TypeTable { name, size: table.size, alignment: table.alignment, content })
    }
}

/// # Safety
/// As [`read_type`].
unsafe fn read_field(field: &ArmorField, depth: usize) -> Result<FieldTable, Failure> {
    unsafe {
        let kind = find_kind(&FIELD_KINDS, field.kind, "armor_field_kind")?;
        let is_nested = kind == ArmorFieldKind::Nested;
        Ok(FieldTable {
            name: read_text(field.name, "the name of a field")?.to_owned(),
            unit: read_optional_text(field.unit, "the unit of a field")?.to_owned(),
            kind,
            form: find_kind(&FIELD_FORMS, field.form, "armor_field_form")?,
            offset: field.offset,
            count: field.count,
            of: is_nested.then(|| read_type(field.of, depth + 1)).transpose()?,
            presence: field.is_optional.then_some(field.presence),
        })
    }
}

/// Reads what a component declares.
///
/// # Safety
/// `component` and everything that it leads to are valid.
pub(super) unsafe fn read_kind(component: &ArmorComponent) -> Result<KindDeclaration, Failure> {
    let ArmorComponent { parameters, parameter_count, ports, port_count, .. } = *component;
    unsafe {
        let kind = read_text(component.kind, "kind")?;
        let summary = read_text(component.summary, "summary")?;
        let mut declaration = KindDeclaration::new(kind, summary);
        for parameter in read_slice(parameters, parameter_count, "parameters")? {
            declaration.parameters.push(read_parameter(parameter)?);
        }
        for port in read_slice(ports, port_count, "ports")? {
            let name = read_text(port.port, "the name of a port")?;
            let doc = read_optional_text(port.doc, "the text of a port")?;
            declaration.ports.push((name.into(), doc.into()));
            let age = read_optional_text(port.stale_after, "stale_after")?;
            if !age.is_empty() {
                declaration.stale_after.push((name.into(), age.into()));
            }
        }
        for event in read_slice(component.events, component.event_count, "events")? {
            declaration.events.push(read_event(event)?);
        }
        declaration.reports_done = !component.never_done;
        declaration.ends_by_itself = component.ends_by_itself;
        declaration.needs_rate = component.needs_rate;
        declaration.reads_all = component.reads_all;
        declaration.constructor_rule = CONSTRUCTOR_RULE;
        Ok(declaration)
    }
}

/// # Safety
/// The texts of the parameter are valid.
unsafe fn read_parameter(parameter: &ArmorParameter) -> Result<ParameterManifest, Failure> {
    unsafe {
        let name = read_text(parameter.name, "the name of a parameter")?;
        let wrong = |why: String| {
            Failure::new(ArmorError::Parameter, format!("the parameter {name}: {why}"))
        };
        let kinds = ParameterType::ALL;
        let kind = find_kind(&kinds, parameter.kind, "armor_parameter_type")
            .map_err(|failure| wrong(failure.text))?;
        let format = read_optional_text(parameter.format, "format")?;
        let format = match format {
            "" => None,
            format => Some(
                TextFormat::ALL
                    .into_iter()
                    .find(|known| known.to_string() == format)
                    .ok_or_else(|| wrong(format!("there is no format `{format}`")))?,
            ),
        };
        let has_range = parameter.minimum != parameter.maximum;
        let bound = |bound: f64| (has_range && bound.is_finite()).then_some(bound);
        let default = (!parameter.default_value.is_null())
            .then(|| read_text(parameter.default_value, "default_value").map(str::to_owned));
        let choices = read_optional_text(parameter.choices, "choices")?;
        Ok(ParameterManifest {
            name: name.into(),
            kind,
            unit: read_optional_text(parameter.unit, "unit")?.into(),
            default: default.transpose()?,
            minimum: bound(parameter.minimum),
            maximum: bound(parameter.maximum),
            choices: choices.split_whitespace().map(Into::into).collect(),
            format,
            doc: read_optional_text(parameter.doc, "doc")?.into(),
            live: parameter.live,
            written: parameter.written,
        })
    }
}

/// # Safety
/// The texts of the event are valid.
unsafe fn read_event(event: &ArmorEvent) -> Result<EventManifest, Failure> {
    unsafe {
        Ok(EventManifest {
            name: read_text(event.name, "the name of an event")?.into(),
            doc: read_optional_text(event.doc, "doc")?.into(),
            value: event.has_value.then_some(EventValue::Number),
            unit: read_optional_text(event.unit, "unit")?.into(),
            named_by: String::new(),
        })
    }
}

/// Reads what `exec` has returned; `explain` has the text of a failure.
pub(crate) fn read_outcome(
    outcome: &ArmorOutcome,
    explain: impl FnOnce() -> String,
) -> Result<Outcome, Failure> {
    use ArmorOutcomeKind as Kind;
    match outcome.kind {
        kind if kind == Kind::CarryOn as c_int => Ok(Outcome::CarryOn),
        kind if kind == Kind::Done as c_int => Ok(Outcome::Done),
        kind if kind == Kind::Failed as c_int => Ok(Outcome::Failed(explain())),
        kind if kind == Kind::Event as c_int => {
            // `exec` promises a text that is valid when it returns.
            let name = unsafe { read_text(outcome.event, "the name of an event") }?;
            Ok(Outcome::event(name, outcome.value))
        }
        other => {
            let why = format!("`exec` has returned {other}, which is no armor_outcome_kind");
            Err(Failure::new(ArmorError::Failed, why))
        }
    }
}
