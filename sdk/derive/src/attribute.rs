//! One field: its `#[parameter(…)]`, its doc comment and its type, checked against each other.

use armor_wire::manifest::{ParameterManifest, ParameterType};
use armor_wire::text_format::TextFormat;
use proc_macro2::{Span, TokenTree};
use syn::ext::IdentExt;
use syn::meta::ParseNestedMeta;
use syn::parse::ParseBuffer;
use syn::punctuated::Punctuated;
use syn::spanned::Spanned;
use syn::{
    Attribute, Error, Expr, ExprLit, Field, GenericArgument, Ident, Lit, LitStr, Path,
    PathArguments, RangeLimits, Result, Token, Type, parenthesized,
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
        let stated = Stated::read(&field.attrs)?;
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
    fn read(attributes: &[Attribute]) -> Result<Self> {
        let mut stated = Self::default();
        for attribute in attributes.iter().filter(|a| a.path().is_ident("parameter")) {
            attribute.parse_nested_meta(|meta| stated.take_entry(&meta))?;
        }
        Ok(stated)
    }

    fn take_entry(&mut self, meta: &ParseNestedMeta<'_>) -> Result<()> {
        let Some(key) = meta.path.get_ident().map(ToString::to_string) else {
            return Err(meta.error(UNKNOWN));
        };
        let is_new = match key.as_str() {
            "name" => self.name.replace(meta.value()?.parse()?).is_none(),
            "unit" => self.unit.replace(meta.value()?.parse()?).is_none(),
            "default" => self.default.replace(parse_literal(meta)?).is_none(),
            "range" => self.range.replace(parse_range(meta)?).is_none(),
            "choices" => self.choices.replace(parse_choices(meta)?).is_none(),
            "parse" => self.parse.replace(meta.value()?.parse()?).is_none(),
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
                ValueKind::Text
            }
            (None, None) => kind_of_type(field).ok_or_else(|| Error::new_spanned(field, TYPES))?,
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
        let Some(name) = &self.name else {
            let field = ident.unraw().to_string();
            let suffix = self.unit.as_ref().map(|unit| format!("_{}", si_suffix(&unit.value())));
            let short = suffix.and_then(|suffix| field.strip_suffix(&suffix).map(str::to_owned));
            return Ok(short.filter(|short| !short.is_empty()).unwrap_or(field));
        };
        let text = name.value();
        let is_name = text.starts_with(|c: char| c.is_ascii_alphabetic())
            && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
        let why = "a name has letters, digits, _ and -, and begins with a letter";
        if is_name { Ok(text) } else { Err(Error::new_spanned(name, why)) }
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
const DEFAULTS: &str = "a default is a number, true or false, or a text in quotation marks as the \
                        file would have it, such as \"20cm/s\"";
const RANGE: &str = "a range is written LOW..=HIGH, both numbers in SI, without quotation marks and \
                     units: range = 0.0..=2.0";
/// What may follow a number in Rust; all else is a unit.
const RUST_NUMBERS: [&str; 14] = [
    "i8", "i16", "i32", "i64", "i128", "isize", "u8", "u16", "u32", "u64", "u128", "usize", "f32",
    "f64",
];
const TYPES: &str = "a parameter is a number, bool, String, PathBuf, or an Option of the last two; \
                     any other type needs `choices(…)`, `parse = …` or `format = …`";

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

/// A literal, which may be negative.
fn parse_literal(meta: &ParseNestedMeta<'_>) -> Result<Lit> {
    let value = meta.value()?;
    let whole = value.fork();
    let minus: Option<Token![-]> = value.parse()?;
    let literal: Lit = value.parse().map_err(|error| Error::new(error.span(), DEFAULTS))?;
    let suffix = match &literal {
        Lit::Int(number) => number.suffix(),
        Lit::Float(number) => number.suffix(),
        _ => "",
    };
    let is_number = matches!(literal, Lit::Int(_) | Lit::Float(_));
    let ends = value.is_empty() || value.peek(Token![,]);
    let is_of_rust = suffix.is_empty() || RUST_NUMBERS.contains(&suffix);
    if is_number && !(ends && is_of_rust) {
        return Err(explain_unquoted(&whole));
    }
    Ok(match (minus, literal) {
        (None, literal) => literal,
        (Some(_), Lit::Int(number)) => {
            Lit::Str(LitStr::new(&format!("-{}", number.base10_digits()), number.span()))
        }
        (Some(_), Lit::Float(number)) => {
            Lit::Str(LitStr::new(&format!("-{}", number.base10_digits()), number.span()))
        }
        (Some(minus), _) => return Err(Error::new_spanned(minus, "only a number is negative")),
    })
}

/// Says how a number with a unit is written, such as the one that `value` begins with.
fn explain_unquoted(value: &ParseBuffer<'_>) -> Error {
    let mut span: Option<Span> = None;
    let mut text = String::new();
    while !value.is_empty() && !value.peek(Token![,]) {
        let Ok(token) = value.parse::<TokenTree>() else { break };
        text.push_str(&token.to_string());
        let so_far = span.unwrap_or_else(|| token.span());
        span = Some(so_far.join(token.span()).unwrap_or(so_far));
    }
    let why = format!("write it as the file would, in quotation marks: default = \"{text}\"");
    Error::new(span.unwrap_or_else(Span::call_site), why)
}

fn parse_range(meta: &ParseNestedMeta<'_>) -> Result<(Span, Expr, Expr)> {
    let value = meta.value()?;
    let range: Expr = value.parse().map_err(|error| Error::new(error.span(), RANGE))?;
    let Expr::Range(range) = range else { return Err(Error::new_spanned(range, RANGE)) };
    let span = range.span();
    match (range.start, range.limits, range.end) {
        (Some(low), RangeLimits::Closed(_), Some(high)) => {
            if let (Some(least), Some(most)) = (float_of(&low), float_of(&high))
                && least > most
            {
                return Err(Error::new(span, "the range is empty"));
            }
            Ok((span, *low, *high))
        }
        _ => Err(Error::new(span, RANGE)),
    }
}

/// The number that an expression is, if it is a literal.
fn float_of(expression: &Expr) -> Option<f64> {
    match expression {
        Expr::Lit(ExprLit { lit: Lit::Float(number), .. }) => number.base10_parse().ok(),
        Expr::Lit(ExprLit { lit: Lit::Int(number), .. }) => number.base10_parse().ok(),
        Expr::Unary(unary) if matches!(unary.op, syn::UnOp::Neg(_)) => {
            float_of(&unary.expr).map(|number| -number)
        }
        _ => None,
    }
}

fn parse_format(meta: &ParseNestedMeta<'_>) -> Result<(Span, TextFormat)> {
    let name: LitStr = meta.value()?.parse()?;
    let format = TextFormat::named(&name.value()).ok_or_else(|| {
        let known = TextFormat::ALL.map(TextFormat::name).join(", ");
        Error::new(name.span(), format!("there is no such format; there are {known}"))
    })?;
    Ok((name.span(), format))
}

fn parse_choices(meta: &ParseNestedMeta<'_>) -> Result<Vec<(LitStr, Expr)>> {
    let content;
    parenthesized!(content in meta.input);
    let choices = Punctuated::<_, Token![,]>::parse_terminated_with(&content, |input| {
        let text: LitStr = input.parse()?;
        input.parse::<Token![=]>()?;
        Ok((text, input.parse::<Expr>()?))
    })?;
    if choices.is_empty() {
        return Err(meta.error("a choice needs at least one text"));
    }
    for (index, (text, _)) in choices.iter().enumerate() {
        if choices.iter().take(index).any(|(earlier, _)| earlier.value() == text.value()) {
            return Err(Error::new_spanned(text, "this choice is given twice"));
        }
    }
    Ok(choices.into_iter().collect())
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
