//! `#[derive(Message)]`: gives a struct or enum its wire layout, its schema and its type name.
//!
//! The layout is bincode's: fields in order, an enum's variant as a `u32` first.

use proc_macro::TokenStream;
use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::{Attribute, Data, DeriveInput, Error, Fields, LitStr, Result, parse_macro_input};

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

/// One struct or variant body, taken apart.
struct Body {
    /// `{ a, b }`, `( f0, f1 )` or nothing: a pattern that binds each field.
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
    let (mut names, mut labels, mut types, mut units) = (vec![], vec![], vec![], vec![]);
    for (index, field) in fields.iter().enumerate() {
        let binding = field.ident.clone().unwrap_or_else(|| format_ident!("f{index}"));
        labels.push(binding.to_string().trim_start_matches("r#").to_owned());
        names.push(binding);
        types.push(&field.ty);
        units.push(options(&field.attrs)?.unit);
    }
    let decoded = quote!(#wire::WireType::read(decoder)?);
    let (pattern, construct) = match fields {
        Fields::Named(_) => (quote!({ #(#names),* }), quote!({ #(#names: #decoded),* })),
        Fields::Unnamed(_) => {
            let items = names.iter().map(|_| &decoded);
            (quote!((#(#names),*)), quote!((#(#items),*)))
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
        encode: quote!(#(#wire::bincode::Encode::encode(#names, encoder)?;)*),
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
    let wire = opts.wire.map_or_else(|| quote!(::armor_sdk::wire), |path| quote!(#path));
    let ident = &input.ident;
    let name = opts.name.unwrap_or_else(|| ident.to_string());
    let Parts { encode, decode, schema, min_len } = match &input.data {
        Data::Struct(data) => struct_parts(&body(&data.fields, &wire)?, &wire, &name),
        Data::Enum(data) => enum_parts(data, &wire, &name)?,
        Data::Union(_) => return Err(Error::new_spanned(ident, "a union cannot travel")),
    };
    Ok(quote! {
        impl #wire::bincode::Encode for #ident {
            fn encode<E: #wire::bincode::enc::Encoder>(
                &self, encoder: &mut E,
            ) -> ::core::result::Result<(), #wire::bincode::error::EncodeError> {
                #encode
                ::core::result::Result::Ok(())
            }
        }
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
    let (mut encodes, mut decodes, mut schemas, mut lengths) = (vec![], vec![], vec![], vec![]);
    for (index, variant) in data.variants.iter().enumerate() {
        let index =
            u32::try_from(index).map_err(|_| Error::new_spanned(variant, "too many variants"))?;
        let Body { pattern, construct, encode, schema, min_len } = body(&variant.fields, wire)?;
        let (ident, label) = (&variant.ident, variant.ident.to_string());
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
