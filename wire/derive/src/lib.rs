//! `#[derive(Message)]`: gives a struct or enum its wire layout, its schema and its type name.
//!
//! The layout is bincode's: fields in order, an enum's variant as a `u32` first.

use proc_macro::TokenStream;
use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::{
    Attribute, Data, DeriveInput, Error, Field, Fields, Ident, LitStr, Result, parse_macro_input,
};

/// What schema text calls the types that need no definition.
const PRIMITIVES: [&str; 12] =
    ["bool", "u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64", "string"];

/// Derives `Encode`, `WireType` and `Message`.
///
/// `#[message(name = "…")]` on the type names it otherwise than the Rust type;
/// `#[message(unit = "m")]` on a field states the unit of its number;
/// `#[message(wire = "path::to::armor_wire")]` tells where the wire crate is found.
#[proc_macro_derive(Message, attributes(message))]
pub fn derive_message(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    expand(&input).unwrap_or_else(Error::into_compile_error).into()
}

#[derive(Default)]
struct Options {
    name: Option<String>,
    unit: Option<String>,
    wire: Option<syn::Path>,
}

fn options(attributes: &[Attribute]) -> Result<Options> {
    let mut options = Options::default();
    for attribute in attributes.iter().filter(|a| a.path().is_ident("message")) {
        attribute.parse_nested_meta(|meta| {
            let value: LitStr = meta.value()?.parse()?;
            if meta.path.is_ident("name") {
                options.name = Some(value.value());
            } else if meta.path.is_ident("unit") {
                options.unit = Some(value.value());
            } else if meta.path.is_ident("wire") {
                options.wire = Some(value.parse()?);
            } else {
                return Err(meta.error("expected name, unit or wire"));
            }
            Ok(())
        })?;
    }
    Ok(options)
}

/// A field's or variant's name, if schema text can hold it.
fn label(ident: &Ident) -> Result<String> {
    let label = ident.to_string().trim_start_matches("r#").to_owned();
    check_name(&label).map_err(|why| Error::new_spanned(ident, why))?;
    Ok(label)
}

fn unit(field: &Field) -> Result<Option<String>> {
    let Options { unit, name, wire } = options(&field.attrs)?;
    if name.is_some() || wire.is_some() {
        return Err(Error::new_spanned(field, "name and wire belong on the type"));
    }
    let is_unit = |unit: &String| {
        (1..=32).contains(&unit.len()) && unit.bytes().all(|b| b.is_ascii_graphic() && b != b')')
    };
    if unit.as_ref().is_some_and(|unit| !is_unit(unit)) {
        return Err(Error::new_spanned(field, "a unit is 1 to 32 visible ASCII characters but )"));
    }
    Ok(unit)
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
struct Body {
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

fn body(fields: &Fields, wire: &Tokens) -> Result<Body> {
    let (mut names, mut bindings) = (vec![], vec![]);
    let (mut labels, mut types, mut units) = (vec![], vec![], vec![]);
    for (index, field) in fields.iter().enumerate() {
        let name = field.ident.clone().unwrap_or_else(|| format_ident!("f{index}"));
        labels.push(label(&name)?);
        names.push(name);
        // Not the field's own name, which may be `encoder`.
        bindings.push(format_ident!("field_{index}"));
        types.push(&field.ty);
        units.push(unit(field)?);
    }
    let decoded = quote!(#wire::WireType::read(decoder)?);
    let (pattern, construct) = match fields {
        Fields::Named(_) => (quote!({ #(#names: #bindings),* }), quote!({ #(#names: #decoded),* })),
        Fields::Unnamed(_) => {
            let items = names.iter().map(|_| &decoded);
            (quote!((#(#bindings),*)), quote!((#(#items),*)))
        }
        Fields::Unit => (quote!(), quote!()),
    };
    let schemas = labels.iter().zip(&types).zip(&units).map(|((label, ty), unit)| {
        let schema = quote!(<#ty as #wire::WireType>::schema());
        match unit {
            Some(unit) => quote!(#wire::schema::Field::with_unit(#label, #schema, #unit)),
            None => quote!(#wire::schema::Field::new(#label, #schema)),
        }
    });
    Ok(Body {
        pattern,
        construct,
        encode: quote!(#(#wire::bincode::Encode::encode(#bindings, encoder)?;)*),
        schema: quote!(::std::vec![#(#schemas),*]),
        min_len: quote!(0 #(+ <#types as #wire::WireType>::MIN_LEN)*),
    })
}

fn expand(input: &DeriveInput) -> Result<Tokens> {
    if !input.generics.params.is_empty() {
        return Err(Error::new_spanned(
            &input.generics,
            "a message type has no generic parameters",
        ));
    }
    let opts = options(&input.attrs)?;
    if opts.unit.is_some() {
        return Err(Error::new_spanned(&input.ident, "a unit belongs on a field"));
    }
    let wire = opts.wire.map_or_else(|| quote!(::armor_sdk::wire), |path| quote!(#path));
    let ident = &input.ident;
    let name = opts.name.map_or_else(|| label(ident), Ok)?;
    check_name(&name).map_err(|why| Error::new_spanned(ident, why))?;
    if PRIMITIVES.contains(&name.as_str()) {
        return Err(Error::new_spanned(ident, "this is the name of a primitive type"));
    }
    let Parts { encode, decode, schema, min_len } = match &input.data {
        Data::Struct(data) => struct_parts(&body(&data.fields, &wire)?, &wire, &name),
        Data::Enum(data) => enum_parts(data, &wire, &name)?,
        Data::Union(_) => return Err(Error::new_spanned(ident, "a union cannot travel")),
    };
    Ok(quote! {
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
            fn read<D: #wire::bincode::de::Decoder>(
                decoder: &mut D,
            ) -> ::core::result::Result<Self, #wire::bincode::error::DecodeError> {
                ::core::result::Result::Ok(#decode)
            }
        }
        impl #wire::Message for #ident {
            const NAME: &'static str = #name;
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

fn struct_parts(body: &Body, wire: &Tokens, name: &str) -> Parts {
    let Body { pattern, construct, encode, schema, min_len } = body;
    Parts {
        encode: quote!(let Self #pattern = self; #encode),
        decode: quote!(Self #construct),
        schema: quote!(#wire::schema::Schema::Struct { name: #name.into(), fields: #schema }),
        min_len: min_len.clone(),
    }
}

fn enum_parts(data: &syn::DataEnum, wire: &Tokens, name: &str) -> Result<Parts> {
    if data.variants.is_empty() {
        return Err(Error::new_spanned(data.enum_token, "an enum without variants has no values"));
    }
    let (mut encodes, mut decodes, mut schemas, mut lengths) = (vec![], vec![], vec![], vec![]);
    for (index, variant) in data.variants.iter().enumerate() {
        let index =
            u32::try_from(index).map_err(|_| Error::new_spanned(variant, "too many variants"))?;
        let Body { pattern, construct, encode, schema, min_len } = body(&variant.fields, wire)?;
        let (ident, label) = (&variant.ident, label(&variant.ident)?);
        encodes.push(quote!(Self::#ident #pattern => {
            #wire::bincode::Encode::encode(&#index, encoder)?;
            #encode
        }));
        decodes.push(quote!(#index => Self::#ident #construct,));
        schemas.push(quote!(#wire::schema::Variant { name: #label.into(), fields: #schema }));
        lengths.push(min_len);
    }
    Ok(Parts {
        encode: quote!(match self { #(#encodes)* }),
        decode: quote!(match <u32 as #wire::WireType>::read(decoder)? {
            #(#decodes)*
            _ => return ::core::result::Result::Err(#wire::bincode::error::DecodeError::Other("unknown variant")),
        }),
        schema: quote!(#wire::schema::Schema::Enum {
            name: #name.into(), variants: ::std::vec![#(#schemas),*],
        }),
        min_len: quote!(4 + #wire::message::least(&[#(#lengths),*])),
    })
}
