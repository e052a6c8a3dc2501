//! The value of one entry of `#[parameter(…)]`, as it is written.

use armor_wire::text_format::TextFormat;
use proc_macro2::{Span, TokenTree};
use syn::meta::ParseNestedMeta;
use syn::parse::{Parse, ParseBuffer};
use syn::punctuated::Punctuated;
use syn::spanned::Spanned;
use syn::token::Paren;
use syn::{
    Error, Expr, ExprLit, Lit, LitFloat, LitStr, RangeLimits, Result, Token, Type, parenthesized,
};

use crate::advice::{list_texts, write_choices};

const DEFAULTS: &str = "a default is a number, true or false, or a text in quotation marks as the \
                        file would have it, such as \"20cm/s\"";
const RANGE: &str = "a range is written LOW..=HIGH, both numbers in SI, without quotation marks and \
                     units: range = 0.0..=2.0";
/// What may follow a number in Rust; all else is a unit.
const RUST_NUMBERS: [&str; 14] = [
    "i8", "i16", "i32", "i64", "i128", "isize", "u8", "u16", "u32", "u64", "u128", "usize", "f32",
    "f64",
];

/// Parses the value of an entry that is no number.
///
/// # Errors
/// With `example`, how the whole entry is written.
pub(crate) fn parse_value<T: Parse>(meta: &ParseNestedMeta<'_>, example: &str) -> Result<T> {
    let explain = |error: Error| Error::new(error.span(), format!("write it like {example}"));
    meta.value().map_err(explain)?.parse().map_err(explain)
}

/// Parses a default: a literal, which may be negative.
pub(crate) fn parse_default(meta: &ParseNestedMeta<'_>) -> Result<Lit> {
    let value = meta.value().map_err(|error| Error::new(error.span(), DEFAULTS))?;
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

/// States how a number with a unit is written, such as the one that `value` begins with.
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

/// Parses a range, of which whole numbers are written as `f64` too.
pub(crate) fn parse_range(meta: &ParseNestedMeta<'_>) -> Result<(Span, Expr, Expr)> {
    let value = meta.value().map_err(|error| Error::new(error.span(), RANGE))?;
    let range: Expr = value.parse().map_err(|error| Error::new(error.span(), RANGE))?;
    let Expr::Range(range) = range else { return Err(Error::new_spanned(range, RANGE)) };
    let span = range.span();
    match (range.start, range.limits, range.end) {
        (Some(low), RangeLimits::Closed(_), Some(high)) => {
            if has_unit(&low) || has_unit(&high) {
                return Err(Error::new(span, RANGE));
            }
            if let (Some(least), Some(most)) = (float_of(&low), float_of(&high))
                && least > most
            {
                return Err(Error::new(span, "the range is empty"));
            }
            Ok((span, write_float(*low), write_float(*high)))
        }
        _ => Err(Error::new(span, RANGE)),
    }
}

/// Returns whether an end of a range is a number with a suffix that is none of Rust's, such as `2m`.
fn has_unit(end: &Expr) -> bool {
    let suffix = match end {
        Expr::Lit(ExprLit { lit: Lit::Float(number), .. }) => number.suffix(),
        Expr::Lit(ExprLit { lit: Lit::Int(number), .. }) => number.suffix(),
        Expr::Unary(unary) => return has_unit(&unary.expr),
        _ => "",
    };
    !suffix.is_empty() && !RUST_NUMBERS.contains(&suffix)
}

/// Returns the end of a range as an `f64`: `5` is `5.0`. What is no literal remains.
fn write_float(end: Expr) -> Expr {
    match end {
        Expr::Lit(ExprLit { lit: Lit::Int(number), attrs }) => {
            let text = format!("{}.0", number.base10_digits());
            Expr::Lit(ExprLit { lit: Lit::Float(LitFloat::new(&text, number.span())), attrs })
        }
        Expr::Unary(mut unary) => {
            unary.expr = Box::new(write_float(*unary.expr));
            Expr::Unary(unary)
        }
        other => other,
    }
}

/// The number that an expression is, if it is a literal.
pub(crate) fn float_of(expression: &Expr) -> Option<f64> {
    match expression {
        Expr::Lit(ExprLit { lit: Lit::Float(number), .. }) => number.base10_parse().ok(),
        Expr::Lit(ExprLit { lit: Lit::Int(number), .. }) => number.base10_parse().ok(),
        Expr::Unary(unary) if matches!(unary.op, syn::UnOp::Neg(_)) => {
            float_of(&unary.expr).map(|number| -number)
        }
        _ => None,
    }
}

/// Parses the name of a format.
pub(crate) fn parse_format(meta: &ParseNestedMeta<'_>) -> Result<(Span, TextFormat)> {
    let name: LitStr = parse_value(meta, "format = \"points\"")?;
    let format = TextFormat::named(&name.value()).ok_or_else(|| {
        let known = TextFormat::ALL.map(TextFormat::name).join(", ");
        Error::new(name.span(), format!("there is no such format; there are {known}"))
    })?;
    Ok((name.span(), format))
}

/// Parses the choices for a field of the given type.
pub(crate) fn parse_choices(
    meta: &ParseNestedMeta<'_>,
    field: &Type,
) -> Result<Vec<(LitStr, Expr)>> {
    let explain = |span: Span, texts: &[String]| {
        let example = write_choices(field, texts);
        Error::new(span, format!("write each text with the value that it stands for: {example}"))
    };
    if !meta.input.peek(Paren) {
        return Err(explain(meta.path.span(), &[]));
    }
    let content;
    parenthesized!(content in meta.input);
    let texts = list_texts(content.fork().parse()?);
    let choices = Punctuated::<_, Token![,]>::parse_terminated_with(&content, |input| {
        let text: LitStr = input.parse()?;
        input.parse::<Token![=]>()?;
        Ok((text, input.parse::<Expr>()?))
    });
    let choices = choices.map_err(|error| explain(error.span(), &texts))?;
    if choices.is_empty() {
        return Err(explain(meta.path.span(), &[]));
    }
    for (index, (text, _)) in choices.iter().enumerate() {
        if choices.iter().take(index).any(|(earlier, _)| earlier.value() == text.value()) {
            return Err(Error::new_spanned(text, "this choice is given twice"));
        }
    }
    Ok(choices.into_iter().collect())
}
