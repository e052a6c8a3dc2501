//! `#[derive(Message)]`: gives a struct or enum its wire layout, its schema and its type name.
//!
//! The layout is bincode's: fields in order, an enum's variant as a `u32` first.

#[cfg(test)]
mod tests;
mod view;

use armor_quantity::{Unit, explain_unknown};
use proc_macro::TokenStream;
use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::{
    Attribute, Data, DeriveInput, Error, Field, Fields, GenericArgument, Ident, LitStr,
    PathArguments, Result, Type, parse_macro_input,
};
use view::ViewTokens;

/// Names of the types that schema text uses without a definition.
const PRIMITIVES: [&str; 12] =
    ["bool", "u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64", "string"];

/// Derives `Encode`, `WireType` and `Message`.
///
/// `#[message(name = "…")]` on the type names it otherwise than the Rust type;
/// `#[message(view)]` on a struct also derives `…View`, the struct as it is read without a copy;
/// `#[message(unit = "m")]` on a field states the unit of its number;
/// `#[message(text)]` on a field sends its value as the string that `Display` writes and `FromStr`
/// reads; `#[message(wire = "path::to::armor_wire")]` names the path of the wire crate.
#[proc_macro_derive(Message, attributes(message))]
pub fn derive_message(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    derive_or_stub(&input).into()
}

/// Returns the code of a message, or its errors together with a stub.
fn derive_or_stub(input: &DeriveInput) -> Tokens {
    expand_message(input).unwrap_or_else(|error| {
        let mut code = error.into_compile_error();
        code.extend(stub_message(input));
        code
    })
}

/// Writes the derived traits without meaning for a type that is refused: its uses would be errors
/// otherwise, next to those that explain what is wrong.
fn stub_message(input: &DeriveInput) -> Tokens {
    let wire = wire_path(read_attributes(&input.attrs).unwrap_or_default().wire);
    let ident = &input.ident;
    let (impl_generics, generics, conditions) = input.generics.split_for_impl();
    let conditions = conditions.map(|conditions| &conditions.predicates).into_iter();
    let conditions = quote!(where Self: ::core::marker::Send + 'static, #(#conditions)*);
    quote! {
        impl #impl_generics #wire::bincode::Encode for #ident #generics #conditions {
            fn encode<E: #wire::bincode::enc::Encoder>(
                &self, _: &mut E,
            ) -> ::core::result::Result<(), #wire::bincode::error::EncodeError> {
                ::core::unreachable!()
            }
        }
        impl #impl_generics #wire::WireType for #ident #generics #conditions {
            const MIN_LEN: usize = 1;
            fn schema() -> #wire::schema::Schema { ::core::unreachable!() }
            fn read_value<D: #wire::bincode::de::Decoder>(
                _: &mut D,
            ) -> ::core::result::Result<Self, #wire::bincode::error::DecodeError> {
                ::core::unreachable!()
            }
            type View<'view> = Self;
            fn view_value<'view, D: #wire::bincode::de::BorrowDecoder<'view>>(
                _: &mut D,
            ) -> ::core::result::Result<Self, #wire::bincode::error::DecodeError> {
                ::core::unreachable!()
            }
        }
        impl #impl_generics #wire::Message for #ident #generics #conditions {
            const NAME: &'static str = "";
        }
    }
}

/// The wire crate as the derived code names it.
fn wire_path(given: Option<syn::Path>) -> Tokens {
    given.map_or_else(|| quote!(::armor_sdk::wire), |path| quote!(#path))
}

/// The faults of a type, of which all are reported together, each where it is.
#[derive(Default)]
struct Faults(Option<Error>);

impl Faults {
    /// Returns the value; records the error instead, if there is one.
    fn keep<T>(&mut self, result: Result<T>) -> Option<T> {
        match (result, &mut self.0) {
            (Ok(value), _) => return Some(value),
            (Err(error), Some(all)) => all.combine(error),
            (Err(error), none) => *none = Some(error),
        }
        None
    }

    fn into_result(self) -> Result<()> {
        self.0.map_or(Ok(()), Err)
    }
}

/// How an entry of `#[message(…)]` is written.
const ENTRY: &str = "write it like unit = \"m/s\", with quotation marks";

#[derive(Default)]
struct MessageAttributes {
    name: Option<String>,
    unit: Option<LitStr>,
    text: bool,
    view: bool,
    wire: Option<syn::Path>,
}

fn read_attributes(attributes: &[Attribute]) -> Result<MessageAttributes> {
    let mut options = MessageAttributes::default();
    for attribute in attributes.iter().filter(|a| a.path().is_ident("message")) {
        attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("text") {
                options.text = true;
                return Ok(());
            }
            if meta.path.is_ident("view") {
                options.view = true;
                return Ok(());
            }
            let is_known = ["name", "unit", "wire"].iter().any(|key| meta.path.is_ident(key));
            if !is_known {
                return Err(meta.error("expected name, unit, text, view or wire"));
            }
            let value = meta.value().and_then(|value| value.parse::<LitStr>());
            let value = value.map_err(|error| Error::new(error.span(), ENTRY))?;
            if meta.path.is_ident("name") {
                options.name = Some(value.value());
            } else if meta.path.is_ident("unit") {
                options.unit = Some(value);
            } else {
                options.wire = Some(value.parse()?);
            }
            Ok(())
        })?;
    }
    Ok(options)
}

/// Returns a field's or variant's name, if schema text allows it.
fn field_label(ident: &Ident) -> Result<String> {
    let label = ident.to_string().trim_start_matches("r#").to_owned();
    check_name(&label).map_err(|why| Error::new_spanned(ident, why))?;
    Ok(label)
}

fn field_unit(field: &Field, attributes: MessageAttributes) -> Result<Option<String>> {
    let MessageAttributes { unit, name, wire, view, text: is_text } = attributes;
    if name.is_some() || wire.is_some() || view {
        return Err(Error::new_spanned(field, "name, view and wire belong on the type"));
    }
    let Some(unit) = unit else { return Ok(None) };
    let text = unit.value();
    let known = Unit::named(&text).ok_or_else(|| {
        let why = format!("there is no unit `{text}`; {}", explain_unknown(&text));
        Error::new_spanned(&unit, why)
    })?;
    let without = if is_text { Some("text") } else { unitless_value(&field.ty) };
    if let Some(value) = without {
        let why = format!("only numbers have a unit, but this field is {value}; remove the unit");
        return Err(Error::new_spanned(&unit, why));
    }
    // Schema text is ASCII.
    Ok(Some(known.ascii_name().to_owned()))
}

/// What the values of a field are that can have no unit, inside lists, arrays and options too. A type
/// of the component's own may be a number.
fn unitless_value(of: &Type) -> Option<&'static str> {
    let path = match of {
        Type::Path(path) => path,
        Type::Array(array) => return unitless_value(&array.elem),
        _ => return None,
    };
    let last = path.path.segments.last()?;
    match (last.ident.to_string().as_str(), &last.arguments) {
        ("String", PathArguments::None) => Some("text"),
        ("bool", PathArguments::None) => Some("true or false"),
        ("Vec" | "Array" | "Box" | "Option", PathArguments::AngleBracketed(inner)) => {
            match inner.args.first()? {
                GenericArgument::Type(inner) => unitless_value(inner),
                _ => None,
            }
        }
        _ => None,
    }
}

/// The grammar of names in schema text; `docs/protocol.md`, "Schema text".
fn check_name(name: &str) -> std::result::Result<(), String> {
    let allowed = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b'/');
    if name.len() > 128 || !name.bytes().all(allowed) {
        return Err(format!("`{name}` is not 1 to 128 ASCII letters, digits, _ - /"));
    }
    if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        return Err(format!("`{name}` does not begin with a letter or _"));
    }
    Ok(())
}

/// One struct or variant body, taken apart.
struct FieldTokens {
    /// `{ a: field_0 }`, `(field_0, field_1)` or nothing: a pattern that binds each field.
    pattern: Tokens,
    /// The same as an expression, each field decoded.
    construct: Tokens,
    /// Encodes each bound field.
    encode: Tokens,
    /// A `vec![…]` of schema fields.
    schema: Tokens,
    /// The sum of the fields' least lengths.
    min_len: Tokens,
}

/// Refuses a field with values of the message that it is part of.
fn check_not_recursive(of: &Type, owner: &Ident) -> Result<()> {
    let path = match of {
        Type::Path(path) if path.qself.is_none() => &path.path,
        Type::Array(array) => return check_not_recursive(&array.elem, owner),
        _ => return Ok(()),
    };
    if path.is_ident(owner) || path.is_ident("Self") {
        let why = format!(
            "a message cannot contain itself: its length would have no bound; send a Vec of \
             entries that refer to each other by index, not `{owner}` in `{owner}`"
        );
        return Err(Error::new_spanned(of, why));
    }
    let Some(PathArguments::AngleBracketed(inner)) = path.segments.last().map(|it| &it.arguments)
    else {
        return Ok(());
    };
    inner.args.iter().try_for_each(|argument| match argument {
        GenericArgument::Type(inner) => check_not_recursive(inner, owner),
        _ => Ok(()),
    })
}

fn expand_fields(fields: &Fields, owner: &Ident, wire: &Tokens) -> Result<FieldTokens> {
    let (mut names, mut bindings) = (vec![], vec![]);
    let (mut labels, mut types, mut units) = (vec![], vec![], vec![]);
    let mut is_text_field = vec![];
    let mut faults = Faults::default();
    for (index, field) in fields.iter().enumerate() {
        let name = field.ident.clone().unwrap_or_else(|| format_ident!("f{index}"));
        labels.extend(faults.keep(field_label(&name)));
        names.push(name);
        // Not the field's own name, which may be `encoder`.
        bindings.push(format_ident!("field_{index}"));
        let attributes = faults.keep(read_attributes(&field.attrs)).unwrap_or_default();
        let (ty, is_text) = (&field.ty, attributes.text);
        if !is_text {
            faults.keep(check_not_recursive(ty, owner));
        }
        types.push(if is_text { quote!(::std::string::String) } else { quote!(#ty) });
        is_text_field.push(is_text);
        units.extend(faults.keep(field_unit(field, attributes)));
    }
    faults.into_result()?;
    let decoded: Vec<_> = is_text_field
        .iter()
        .zip(&types)
        .map(|(is_text, ty)| match is_text {
            true => quote!(#wire::message::read_text(decoder)?),
            false => quote!(<#ty as #wire::WireType>::read_value(decoder)?),
        })
        .collect();
    let encoded = bindings.iter().zip(&is_text_field).zip(&types);
    let encoded = encoded.map(|((binding, is_text), ty)| match is_text {
        true => quote!(#wire::message::encode_text(#binding, encoder)?;),
        false => quote!(<#ty as #wire::WireType>::encode_field(#binding, encoder)?;),
    });
    let encode = quote!(#(#encoded)*);
    let (pattern, construct) = match fields {
        Fields::Named(_) => (quote!({ #(#names: #bindings),* }), quote!({ #(#names: #decoded),* })),
        Fields::Unnamed(_) => (quote!((#(#bindings),*)), quote!((#(#decoded),*))),
        Fields::Unit => (quote!(), quote!()),
    };
    let schemas = labels.iter().zip(&types).zip(&units).map(|((label, ty), unit)| {
        let schema = quote!(<#ty as #wire::WireType>::schema());
        match unit {
            Some(unit) => quote!(#wire::schema::Field::with_unit(#label, #schema, #unit)),
            None => quote!(#wire::schema::Field::new(#label, #schema)),
        }
    });
    Ok(FieldTokens {
        pattern,
        construct,
        encode,
        schema: quote!(::std::vec![#(#schemas),*]),
        min_len: quote!(0 #(+ <#types as #wire::WireType>::MIN_LEN)*),
    })
}

/// Returns the name that is given, or the type's.
fn message_name(ident: &Ident, given: Option<String>) -> Result<String> {
    let name = given.map_or_else(|| field_label(ident), Ok)?;
    check_name(&name).map_err(|why| Error::new_spanned(ident, why))?;
    if PRIMITIVES.contains(&name.as_str()) {
        return Err(Error::new_spanned(ident, "this is the name of a primitive type"));
    }
    Ok(name)
}

fn expand_message(input: &DeriveInput) -> Result<Tokens> {
    let mut faults = Faults::default();
    if !input.generics.params.is_empty() {
        let why = "a message type has no generic parameters";
        faults.keep::<()>(Err(Error::new_spanned(&input.generics, why)));
    }
    let opts = faults.keep(read_attributes(&input.attrs)).unwrap_or_default();
    if let Some(unit) = &opts.unit {
        faults.keep::<()>(Err(Error::new_spanned(unit, "a unit belongs on a field")));
    }
    let wire = wire_path(opts.wire);
    let ident = &input.ident;
    let name = faults.keep(message_name(ident, opts.name)).unwrap_or_default();
    let parts = match &input.data {
        Data::Struct(data) => expand_fields(&data.fields, ident, &wire)
            .map(|fields| struct_parts(&fields, &wire, &name)),
        Data::Enum(data) => enum_parts(data, ident, &wire, &name),
        Data::Union(_) => Err(Error::new_spanned(ident, "a union cannot travel")),
    };
    let parts = faults.keep(parts);
    let view = faults.keep(match (opts.view, &input.data) {
        (false, _) => Ok(view::copy_value(&wire)),
        (true, Data::Struct(data)) => view::expand_view(input, &data.fields, &wire),
        (true, _) => Err(Error::new_spanned(ident, view::NEEDS_NAMED_FIELDS)),
    });
    faults.into_result()?;
    let Some(Parts { encode, decode, schema, min_len }) = parts else { return Ok(Tokens::new()) };
    let Some(ViewTokens { definition, members }) = view else { return Ok(Tokens::new()) };
    Ok(quote! {
        #definition
        #[allow(unused_variables)]
        impl #wire::bincode::Encode for #ident {
            fn encode<E: #wire::bincode::enc::Encoder>(
                &self, encoder: &mut E,
            ) -> ::core::result::Result<(), #wire::bincode::error::EncodeError> {
                #encode
                ::core::result::Result::Ok(())
            }
        }
        #[allow(unused_variables)]
        impl #wire::WireType for #ident {
            const MIN_LEN: usize = #min_len;
            fn schema() -> #wire::schema::Schema { #schema }
            fn read_value<D: #wire::bincode::de::Decoder>(
                decoder: &mut D,
            ) -> ::core::result::Result<Self, #wire::bincode::error::DecodeError> {
                ::core::result::Result::Ok(#decode)
            }
            #members
        }
        impl #wire::Message for #ident {
            const NAME: &'static str = #name;
            fn schema_hash() -> u64 {
                static HASH: ::std::sync::OnceLock<u64> = ::std::sync::OnceLock::new();
                *HASH.get_or_init(|| {
                    let schema = <Self as #wire::WireType>::schema();
                    #wire::schema::hash_text(&::std::string::ToString::to_string(&schema))
                })
            }
        }
    })
}

/// The bodies of the derived items.
struct Parts {
    encode: Tokens,
    decode: Tokens,
    schema: Tokens,
    min_len: Tokens,
}

fn struct_parts(body: &FieldTokens, wire: &Tokens, name: &str) -> Parts {
    let FieldTokens { pattern, construct, encode, schema, min_len } = body;
    Parts {
        encode: quote!(let Self #pattern = self; #encode),
        decode: quote!(Self #construct),
        schema: quote!(#wire::schema::Schema::Struct { name: #name.into(), fields: #schema }),
        min_len: min_len.clone(),
    }
}

fn enum_parts(data: &syn::DataEnum, owner: &Ident, wire: &Tokens, name: &str) -> Result<Parts> {
    if data.variants.is_empty() {
        return Err(Error::new_spanned(data.enum_token, "an enum without variants has no values"));
    }
    let (mut encodes, mut decodes, mut schemas, mut lengths) = (vec![], vec![], vec![], vec![]);
    let mut faults = Faults::default();
    for (index, variant) in data.variants.iter().enumerate() {
        let index =
            u32::try_from(index).map_err(|_| Error::new_spanned(variant, "too many variants"));
        let fields = faults.keep(expand_fields(&variant.fields, owner, wire));
        let label = faults.keep(field_label(&variant.ident));
        let (Some(index), Some(fields), Some(label)) = (faults.keep(index), fields, label) else {
            continue;
        };
        let FieldTokens { pattern, construct, encode, schema, min_len } = fields;
        let ident = &variant.ident;
        encodes.push(quote!(Self::#ident #pattern => {
            #wire::bincode::Encode::encode(&#index, encoder)?;
            #encode
        }));
        decodes.push(quote!(#index => Self::#ident #construct,));
        schemas.push(quote!(#wire::schema::Variant { name: #label.into(), fields: #schema }));
        lengths.push(min_len);
    }
    faults.into_result()?;
    Ok(Parts {
        encode: quote!(match self { #(#encodes)* }),
        decode: quote!(match <u32 as #wire::WireType>::read_value(decoder)? {
            #(#decodes)*
            _ => return ::core::result::Result::Err(#wire::bincode::error::DecodeError::Other("unknown variant")),
        }),
        schema: quote!(#wire::schema::Schema::Enum {
            name: #name.into(), variants: ::std::vec![#(#schemas),*],
        }),
        min_len: quote!(4 + #wire::message::least(&[#(#lengths),*])),
    })
}
