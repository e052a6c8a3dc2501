//! One field: its `#[parameter(…)]`, its doc comment and its type, checked against each other.

use armor_wire::manifest::{ParameterManifest, ParameterType};
use armor_wire::name::is_name;
use armor_wire::text_format::TextFormat;
use proc_macro2::Span;
use quote::ToTokens;
use syn::ext::IdentExt;
use syn::meta::ParseNestedMeta;
use syn::spanned::Spanned;
use syn::{
    Attribute, Error, Expr, ExprLit, Field, GenericArgument, Ident, Lit, LitStr, Path,
    PathArguments, Result, Type,
};

use crate::advice::{explain_list, explain_type};
use crate::entry::{
    float_of, parse_choices, parse_default, parse_format, parse_range, parse_value,
};
use crate::integer::IntegerType;

/// The type of the parameter, as the manifest has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ValueKind {
    Number,
    Integer,
    Flag,
    Text,
    Path,
    Choice,
    Colour,
}

/// How the received value becomes the field's.
pub(crate) enum Conversion {
    /// By `armor_sdk::FromValue` of the field's type.
    Typed,
    /// Each text sets the value of its expression.
    Choices(Vec<(LitStr, Expr)>),
    /// A function reads the text.
    Parsed(Path),
}

/// A field that is a parameter.
pub(crate) struct ParameterField {
    pub ident: Ident,
    pub name: String,
    pub kind: ValueKind,
    pub unit: Option<LitStr>,
    pub default: Option<String>,
    pub range: Option<(Expr, Expr)>,
    pub conversion: Conversion,
    pub format: Option<TextFormat>,
    pub doc: String,
    pub is_live: bool,
    pub is_written: bool,
}

/// What `#[parameter(…)]` states, before it is checked against the field's type.
#[derive(Default)]
struct Stated {
    name: Option<LitStr>,
    unit: Option<LitStr>,
    default: Option<Lit>,
    range: Option<(Span, Expr, Expr)>,
    choices: Option<Vec<(LitStr, Expr)>>,
    parse: Option<Path>,
    colour: Option<Span>,
    format: Option<(Span, TextFormat)>,
    is_live: bool,
    written: Option<Span>,
}

impl ParameterField {
    /// Reads a named field.
    pub(crate) fn read(field: &Field) -> Result<Self> {
        let Some(ident) = field.ident.clone() else {
            return Err(Error::new_spanned(field, "a parameter is a field with a name"));
        };
        let stated = Stated::read(field)?;
        let kind = stated.value_kind(&field.ty)?;
        let integer = IntegerType::of(&field.ty).filter(|_| kind == ValueKind::Integer);
        let mut errors = Vec::new();
        let default = stated.default.as_ref().map(|default| {
            if let Some(integer) = &integer {
                integer.check_default(default)?;
            }
            stated.default_text(default, kind)
        });
        let default = default.transpose().unwrap_or_else(|error| {
            errors.push(error);
            None
        });
        errors.extend(stated.check_unit(kind).err());
        errors.extend(stated.check_range(kind).err());
        let name = stated.parameter_name(&ident).unwrap_or_else(|error| {
            errors.push(error);
            String::new()
        });
        errors.extend(stated.check_as_manifest(&ident, &name, kind, default.as_deref()).err());
        combine_errors(errors.into_iter().map(Err::<(), _>))?;
        let Stated { unit, range, choices, parse, format, is_live, written, .. } = stated;
        let conversion = match (choices, parse) {
            (Some(choices), _) => Conversion::Choices(choices),
            (None, Some(function)) => Conversion::Parsed(function),
            (None, None) => Conversion::Typed,
        };
        let range = match range {
            Some((_, low, high)) => Some((low, high)),
            None => integer.and_then(|integer| integer.declared_range()),
        };
        let is_written = written.is_some();
        let format = format.map(|(_, format)| format);
        let doc = read_doc(&field.attrs);
        Ok(Self {
            ident,
            name,
            kind,
            unit,
            default,
            range,
            conversion,
            format,
            doc,
            is_live,
            is_written,
        })
    }
}

impl Stated {
    fn read(field: &Field) -> Result<Self> {
        let mut stated = Self::default();
        for attribute in field.attrs.iter().filter(|a| a.path().is_ident("parameter")) {
            attribute.parse_nested_meta(|meta| stated.take_entry(&meta, &field.ty))?;
        }
        Ok(stated)
    }

    fn take_entry(&mut self, meta: &ParseNestedMeta<'_>, field: &Type) -> Result<()> {
        let Some(key) = meta.path.get_ident().map(ToString::to_string) else {
            return Err(meta.error(UNKNOWN));
        };
        let is_new = match key.as_str() {
            "name" => self.name.replace(parse_value(meta, NAME)?).is_none(),
            "unit" => self.unit.replace(parse_value(meta, UNIT)?).is_none(),
            "default" => self.default.replace(parse_default(meta)?).is_none(),
            "range" => self.range.replace(parse_range(meta)?).is_none(),
            "choices" => self.choices.replace(parse_choices(meta, field)?).is_none(),
            "parse" => self.parse.replace(parse_value(meta, PARSE)?).is_none(),
            "colour" => self.colour.replace(meta.path.span()).is_none(),
            "format" => self.format.replace(parse_format(meta)?).is_none(),
            "written" => self.written.replace(meta.path.span()).is_none(),
            "live" => !std::mem::replace(&mut self.is_live, true),
            _ => return Err(meta.error(UNKNOWN)),
        };
        if is_new { Ok(()) } else { Err(meta.error(format!("`{key}` is given twice"))) }
    }

    fn value_kind(&self, field: &Type) -> Result<ValueKind> {
        let kind = match (&self.choices, &self.parse) {
            (Some(_), Some(function)) => {
                return Err(Error::new_spanned(function, "a choice is not parsed"));
            }
            (Some(_), None) => ValueKind::Choice,
            (None, Some(_)) => ValueKind::Text,
            // `armor_sdk::FromValue` reads the list, whose type is none of those that are known here.
            (None, None) if self.format.is_some() && kind_of_type(field).is_none() => {
                let format = self.format.map(|(_, format)| format);
                match format.and_then(|format| explain_list(format, field)) {
                    Some(why) => return Err(Error::new_spanned(field, why)),
                    None => ValueKind::Text,
                }
            }
            (None, None) => {
                kind_of_type(field).ok_or_else(|| Error::new_spanned(field, explain_type(field)))?
            }
        };
        match self.colour {
            Some(_) if kind == ValueKind::Text && self.parse.is_none() => Ok(ValueKind::Colour),
            Some(span) => Err(Error::new(span, "a colour is a String")),
            None => Ok(kind),
        }
    }

    fn check_unit(&self, kind: ValueKind) -> Result<()> {
        match &self.unit {
            Some(unit) if kind != ValueKind::Number => {
                Err(Error::new_spanned(unit, "only f64 and f32 have a unit"))
            }
            _ => Ok(()),
        }
    }

    fn check_range(&self, kind: ValueKind) -> Result<()> {
        let is_numeric = matches!(kind, ValueKind::Number | ValueKind::Integer);
        match &self.range {
            Some((span, ..)) if !is_numeric => Err(Error::new(*span, "only numbers have a range")),
            _ => Ok(()),
        }
    }

    /// The default as the file would have it.
    fn default_text(&self, default: &Lit, kind: ValueKind) -> Result<String> {
        let text = match (default, kind) {
            (Lit::Str(text), _) => text.value(),
            (Lit::Bool(flag), ValueKind::Flag) => flag.value.to_string(),
            (Lit::Int(number), ValueKind::Integer) => number.base10_digits().to_owned(),
            (Lit::Int(number), ValueKind::Number) if self.unit.is_none() => {
                number.base10_digits().to_owned()
            }
            (Lit::Float(number), ValueKind::Number) if self.unit.is_none() => {
                number.base10_digits().to_owned()
            }
            (Lit::Int(_) | Lit::Float(_), ValueKind::Number) => {
                let unit = self.unit.as_ref().map(LitStr::value).unwrap_or_default();
                let number = default.to_token_stream();
                let why = format!("write the default with its unit: default = \"{number}{unit}\"");
                return Err(Error::new_spanned(default, why));
            }
            _ => return Err(Error::new_spanned(default, literal_wanted(kind))),
        };
        let is_right = match kind {
            ValueKind::Flag => text == "true" || text == "false",
            ValueKind::Integer => text.parse::<i64>().is_ok(),
            ValueKind::Choice => self.is_choice(&text),
            ValueKind::Number | ValueKind::Text | ValueKind::Path | ValueKind::Colour => true,
        };
        let why = match kind {
            ValueKind::Flag => "a flag is true or false",
            ValueKind::Choice => "the default is none of the choices",
            _ => "this is no whole number",
        };
        if is_right { Ok(text) } else { Err(Error::new_spanned(default, why)) }
    }

    fn is_choice(&self, text: &str) -> bool {
        self.choices.iter().flatten().any(|(choice, _)| choice.value() == text)
    }

    /// Checks what `manifest_of` and `armor check` would refuse, as far as it is known here: a range
    /// or a choice may be a constant of the component.
    fn check_as_manifest(
        &self,
        ident: &Ident,
        name: &str,
        kind: ValueKind,
        default: Option<&str>,
    ) -> Result<()> {
        // A unit or a range that the type does not have is refused before.
        let is_number = kind == ValueKind::Number;
        let unit = self.unit.as_ref().filter(|_| is_number);
        let range = self.range.as_ref().filter(|_| is_number || kind == ValueKind::Integer);
        let end = |of: fn(&(Span, Expr, Expr)) -> &Expr| range.map(of).and_then(float_of);
        let manifest = ParameterManifest {
            name: name.into(),
            kind: match kind {
                ValueKind::Number => ParameterType::Number,
                ValueKind::Integer => ParameterType::Integer,
                ValueKind::Flag => ParameterType::Flag,
                ValueKind::Text => ParameterType::Text,
                ValueKind::Path => ParameterType::Path,
                ValueKind::Choice => ParameterType::Choice,
                ValueKind::Colour => ParameterType::Colour,
            },
            unit: unit.map(LitStr::value).unwrap_or_default(),
            default: default.map(Into::into),
            minimum: end(|(_, low, _)| low),
            maximum: end(|(_, _, high)| high),
            choices: self.choices.iter().flatten().map(|(text, _)| text.value()).collect(),
            format: self.format.map(|(_, format)| format),
            doc: String::new(),
            live: false,
            written: self.written.is_some(),
        };
        let faults = manifest.list_faults().into_iter().map(|fault| {
            let span = match fault.member {
                "unit" => self.unit.as_ref().map(Spanned::span),
                "default" => self.default.as_ref().map(Spanned::span),
                "written" => self.written,
                "format" => self.format.map(|(span, _)| span),
                "range" => self.range.as_ref().map(|(span, ..)| *span),
                _ => None,
            };
            let why = format!("{}; {}", fault.problem, fault.remedy);
            Err::<(), _>(Error::new(span.unwrap_or(ident.span()), why))
        });
        combine_errors(faults).map(drop)
    }

    /// The name that is given, or the field's without the suffix of its SI unit.
    fn parameter_name(&self, ident: &Ident) -> Result<String> {
        let (span, name) = match &self.name {
            Some(name) => (name.span(), name.value()),
            None => {
                let field = ident.unraw().to_string();
                let suffix =
                    self.unit.as_ref().map(|unit| format!("_{}", si_suffix(&unit.value())));
                let short =
                    suffix.and_then(|suffix| field.strip_suffix(&suffix).map(str::to_owned));
                (ident.span(), short.filter(|short| !short.is_empty()).unwrap_or(field))
            }
        };
        if is_name(&name) { Ok(name) } else { Err(Error::new(span, NAME_RULE)) }
    }
}

/// Collects the results, or all errors as one.
pub(crate) fn combine_errors<T>(results: impl Iterator<Item = Result<T>>) -> Result<Vec<T>> {
    let mut all: Option<Error> = None;
    let mut fine = Vec::new();
    for result in results {
        match (result, &mut all) {
            (Ok(value), _) => fine.push(value),
            (Err(error), Some(all)) => all.combine(error),
            (Err(error), None) => all = Some(error),
        }
    }
    all.map_or(Ok(fine), Err)
}

/// Which literal a default is, in words.
fn literal_wanted(kind: ValueKind) -> &'static str {
    match kind {
        ValueKind::Integer => "the default of a whole number is a whole number, such as 3",
        ValueKind::Flag => "the default of a bool is true or false",
        ValueKind::Number => {
            "write the default as the file would: a text, with its unit if it has one"
        }
        ValueKind::Text | ValueKind::Path | ValueKind::Choice | ValueKind::Colour => {
            "write the default as the file would: a text"
        }
    }
}

const UNKNOWN: &str =
    "expected name, unit, default, range, choices, parse, format, colour, written or live";
pub(crate) const NAME_RULE: &str =
    "a name has ASCII letters, digits, _ and -, at most 64, and begins with a letter";
/// How entries are written.
const NAME: &str = "name = \"max-speed\"";
const UNIT: &str = "unit = \"m/s\"";
const PARSE: &str =
    "parse = read_side, the path of a fn(&str) -> Result<T, E> without quotation marks";

/// Returns the type of the parameter that a field of this type is, unless its attribute states it.
pub(crate) fn kind_of_type(of: &Type) -> Option<ValueKind> {
    let Type::Path(path) = of else { return None };
    let last = path.path.segments.last()?;
    Some(match last.ident.to_string().as_str() {
        "f64" | "f32" => ValueKind::Number,
        "i8" | "i16" | "i32" | "i64" | "isize" | "u8" | "u16" | "u32" | "u64" | "usize" => {
            ValueKind::Integer
        }
        "bool" => ValueKind::Flag,
        "String" => ValueKind::Text,
        "PathBuf" => ValueKind::Path,
        "Option" => {
            let PathArguments::AngleBracketed(arguments) = &last.arguments else { return None };
            let Some(GenericArgument::Type(inner)) = arguments.args.first() else { return None };
            let kind = kind_of_type(inner)?;
            return matches!(kind, ValueKind::Text | ValueKind::Path).then_some(kind);
        }
        _ => return None,
    })
}

/// The suffix of a field that holds a number of this unit in SI: `m/s` is `mps`, `deg` is `rad`.
fn si_suffix(unit: &str) -> String {
    let base = |unit: &str| match unit {
        "deg" => "rad".to_owned(),
        "mm" | "cm" | "km" => "m".to_owned(),
        "ns" | "us" | "ms" | "min" | "h" => "s".to_owned(),
        "N·m" | "N*m" => "nm".to_owned(),
        "hPa" | "kPa" | "bar" => "pa".to_owned(),
        "uT" => "t".to_owned(),
        "L" => "m3".to_owned(),
        "rpm" => "radps".to_owned(),
        unit => unit.to_lowercase(),
    };
    unit.split('/').map(base).collect::<Vec<_>>().join("p")
}

/// The doc comment in one line.
pub(crate) fn read_doc(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter(|a| a.path().is_ident("doc")).filter_map(|attribute| {
        let Ok(value) = attribute.meta.require_name_value() else { return None };
        let Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) = &value.value else { return None };
        Some(text.value().trim().to_owned())
    });
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}
