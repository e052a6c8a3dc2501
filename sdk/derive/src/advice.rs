//! What to write in place of a declaration that is refused.

use armor_wire::text_format::TextFormat;
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::{GenericArgument, LitStr, PathArguments, Type};

use crate::attribute::kind_of_type;

/// Texts of an example, where the component names none.
const EXAMPLE_TEXTS: [&str; 2] = ["first", "second"];

const LIST: &str = "a list of numbers is a Vec<f64> with #[parameter(format = \"numbers\")]";

/// Returns why a type is no type of a parameter, and what to write instead.
pub(crate) fn explain_type(of: &Type) -> String {
    let written = write_type(of);
    match advise_known(of) {
        Some(advice) => format!("a parameter cannot be a `{written}` as it stands: {advice}"),
        None => format!(
            "a parameter is a number, bool, String, PathBuf, or an Option of the last two: if \
             `{written}` is an enum, list its values, #[parameter({})]; any other type needs \
             `parse = FUNCTION` with a fn(&str) -> Result<{written}, E>",
            write_choices(of, &[])
        ),
    }
}

/// Returns the advice for a type that components often declare.
fn advise_known(of: &Type) -> Option<&'static str> {
    let text = "write String";
    let path = match of {
        Type::Reference(reference) => {
            return match write_type(&reference.elem).as_str() {
                "str" => Some(text),
                "Path" => Some("write PathBuf"),
                _ => None,
            };
        }
        Type::Array(_) => return Some(LIST),
        Type::Path(path) => path,
        _ => return None,
    };
    let last = path.path.segments.last()?;
    let inner = match &last.arguments {
        PathArguments::AngleBracketed(arguments) => match arguments.args.first()? {
            GenericArgument::Type(inner) => Some(inner),
            _ => None,
        },
        _ => None,
    };
    Some(match (last.ident.to_string().as_str(), inner.map(write_type).as_deref()) {
        ("char" | "str", _) | ("Box" | "Arc" | "Rc" | "Cow", Some("str")) => text,
        ("Path", _) => "write PathBuf",
        ("i128" | "u128", _) => "write i64 or u64",
        ("Duration", _) => {
            "a time is an f64 with a unit: #[parameter(unit = \"s\")]; \
             Duration::from_secs_f64 converts it"
        }
        ("Vec", Some("[f64;2]" | "(f64,f64)")) => {
            "a list of points is a Vec<[f64; 2]> with #[parameter(format = \"points\")]"
        }
        ("Vec", Some("String" | "&str")) => {
            "a list of names is a Vec<String> with #[parameter(format = \"names\")]"
        }
        ("Vec", _) if inner.and_then(kind_of_type).is_some() => LIST,
        ("Option", _) if inner.and_then(kind_of_type).is_some() => {
            "only String and PathBuf may be an Option, where the empty text is None; give a number \
             or a bool a default"
        }
        _ => return None,
    })
}

/// Returns why a list does not have a format; a type of the component's own may have any.
pub(crate) fn explain_list(format: TextFormat, of: &Type) -> Option<String> {
    let (wanted, short) = match format {
        TextFormat::Points => ("Vec<[f64; 2]>", "Vec<[f64;2]>"),
        TextFormat::Numbers => ("Vec<f64>", "Vec<f64>"),
        TextFormat::Names => ("Vec<String>", "Vec<String>"),
        _ => return None,
    };
    let written = write_type(of);
    let is_list = matches!(of, Type::Array(_) | Type::Tuple(_)) || written.starts_with("Vec<");
    (is_list && written != short)
        .then(|| format!("a parameter with the format {format} is a {wanted}, or a String"))
}

/// Returns how `choices` is written for a field of this type, with the given texts.
pub(crate) fn write_choices(field: &Type, texts: &[String]) -> String {
    let written = write_type(field);
    let texts: Vec<&str> = match texts {
        [] => EXAMPLE_TEXTS.to_vec(),
        texts => texts.iter().map(String::as_str).collect(),
    };
    let choices = texts.iter().enumerate().map(|(number, text)| {
        let value = match kind_of_type(field) {
            Some(_) if written == "bool" => format!("{}", number == 0),
            Some(_) if written == "String" => format!("\"{text}\".into()"),
            Some(_) if written.starts_with(['f']) => format!("{number}.0"),
            Some(_) if written.starts_with(['i', 'u']) => number.to_string(),
            _ => format!("{written}::{}", camel_case(text)),
        };
        format!("\"{text}\" = {value}")
    });
    format!("choices({})", choices.collect::<Vec<_>>().join(", "))
}

/// Returns the texts in quotation marks, or else the names, that stand in `choices(…)`.
pub(crate) fn list_texts(inside: TokenStream) -> Vec<String> {
    let tokens: Vec<TokenTree> = inside.into_iter().collect();
    let quoted: Vec<String> = tokens
        .iter()
        .filter_map(|token| syn::parse2::<LitStr>(token.to_token_stream()).ok())
        .map(|text| text.value())
        .collect();
    if !quoted.is_empty() {
        return quoted;
    }
    // Of `Side::Left`, the last part.
    let follows = |at: usize| tokens.get(at).map(ToString::to_string).unwrap_or_default();
    let names = tokens.iter().enumerate().filter_map(|(at, token)| match token {
        TokenTree::Ident(name) if follows(at + 1) != ":" => Some(name.to_string().to_lowercase()),
        _ => None,
    });
    names.collect()
}

/// `slow-down` is `SlowDown`.
fn camel_case(text: &str) -> String {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words
        .map(|word| {
            let (first, rest) = word.split_at(1);
            first.to_ascii_uppercase() + rest
        })
        .collect()
}

/// The type as Rust has it, without spaces and lifetimes.
fn write_type(of: &Type) -> String {
    of.to_token_stream().to_string().replace(' ', "").replace("'static", "")
}
