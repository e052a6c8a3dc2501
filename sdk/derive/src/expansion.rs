//! The code of a struct's parameters.

use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Fields, Result};

use crate::attribute::{Conversion, ParameterField, ValueKind, combine_errors};

/// Writes `impl Parameters` for a struct.
pub(crate) fn expand_struct(input: &DeriveInput) -> Result<TokenStream> {
    if !input.generics.params.is_empty() {
        return Err(Error::new_spanned(&input.generics, "parameters are not generic"));
    }
    let Data::Struct(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "parameters are the fields of a struct"));
    };
    let Fields::Named(fields) = &data.fields else {
        return Err(Error::new_spanned(&input.ident, "parameters are fields with names"));
    };
    let fields = combine_errors(fields.named.iter().map(ParameterField::read))?;
    for (index, field) in fields.iter().enumerate() {
        if fields.iter().take(index).any(|earlier| earlier.name == field.name) {
            let why = format!("two parameters are called `{}`", field.name);
            return Err(Error::new_spanned(&field.ident, why));
        }
    }
    let ident = &input.ident;
    let declarations = fields.iter().map(expand_declaration);
    let initial = fields.iter().map(expand_initial_value);
    let names = fields.iter().map(|field| &field.name);
    let assignments = fields.iter().map(expand_assignment);
    Ok(quote! {
        impl ::armor_sdk::Parameters for #ident {
            const DECLARED: &'static [::armor_sdk::Parameter] = &[#(#declarations),*];

            fn defaults() -> Self {
                let mut parameters = Self { #(#initial),* };
                ::armor_sdk::parameters::assign_defaults(&mut parameters);
                parameters
            }

            fn set(
                &mut self, name: &str, value: &::armor_sdk::Value,
            ) -> ::core::result::Result<(), ::armor_sdk::ParameterError> {
                let outcome = match name {
                    #(#names => #assignments,)*
                    _ => return ::core::result::Result::Err(
                        ::armor_sdk::ParameterError::Unknown(name.into()),
                    ),
                };
                outcome.map_err(|cause| ::armor_sdk::ParameterError::Value {
                    name: name.into(), cause,
                })
            }
        }
    })
}

/// Writes an `impl Parameters` without meaning for a type that is refused: its uses would be errors
/// otherwise, next to those that explain what is wrong.
pub(crate) fn stub_struct(input: &DeriveInput) -> TokenStream {
    let ident = &input.ident;
    let (impl_generics, generics, conditions) = input.generics.split_for_impl();
    quote! {
        impl #impl_generics ::armor_sdk::Parameters for #ident #generics #conditions {
            const DECLARED: &'static [::armor_sdk::Parameter] = &[];

            fn defaults() -> Self {
                ::core::unreachable!()
            }

            fn set(
                &mut self, _: &str, _: &::armor_sdk::Value,
            ) -> ::core::result::Result<(), ::armor_sdk::ParameterError> {
                ::core::unreachable!()
            }
        }
    }
}

/// The entry of the table, as it would be written by hand.
fn expand_declaration(field: &ParameterField) -> TokenStream {
    let name = &field.name;
    let mut declaration = match (field.kind, &field.conversion) {
        (ValueKind::Number, _) => {
            let unit = field.unit.as_ref().map(syn::LitStr::value).unwrap_or_default();
            quote!(number(#name, #unit))
        }
        (ValueKind::Choice, Conversion::Choices(choices)) => {
            let texts = choices.iter().map(|(text, _)| text);
            quote!(choice(#name, &[#(#texts),*]))
        }
        (ValueKind::Integer, _) => quote!(integer(#name)),
        (ValueKind::Flag, _) => quote!(flag(#name)),
        (ValueKind::Path, _) => quote!(path(#name)),
        (ValueKind::Colour, _) => quote!(colour(#name)),
        (ValueKind::Text | ValueKind::Choice, _) => quote!(text(#name)),
    };
    if let Some(default) = &field.default {
        declaration.extend(quote!(.default(#default)));
    }
    if let Some((low, high)) = &field.range {
        declaration.extend(quote!(.range(#low, #high)));
    }
    if let Some(format) = field.format {
        let variant =
            proc_macro2::Ident::new(&format!("{format:?}"), proc_macro2::Span::call_site());
        declaration.extend(quote!(.format(::armor_sdk::wire::text_format::TextFormat::#variant)));
    }
    if !field.doc.is_empty() {
        let doc = &field.doc;
        declaration.extend(quote!(.doc(#doc)));
    }
    if field.is_live {
        declaration.extend(quote!(.live()));
    }
    if field.is_written {
        declaration.extend(quote!(.written()));
    }
    quote!(::armor_sdk::Parameter::#declaration)
}

/// The field before the default is assigned: of a choice the first one, since its type need not
/// have a default of its own.
fn expand_initial_value(field: &ParameterField) -> TokenStream {
    let ident = &field.ident;
    match &field.conversion {
        Conversion::Choices(choices) => {
            let first = choices.iter().map(|(_, value)| value).take(1);
            quote!(#ident: #(#first)*)
        }
        Conversion::Typed | Conversion::Parsed(_) => {
            quote!(#ident: ::core::default::Default::default())
        }
    }
}

/// An expression that assigns `value` to the field.
fn expand_assignment(field: &ParameterField) -> TokenStream {
    let ident = &field.ident;
    match &field.conversion {
        Conversion::Typed => {
            quote!(::armor_sdk::parameters::assign_value(&mut self.#ident, value))
        }
        Conversion::Choices(choices) => {
            let (texts, values): (Vec<_>, Vec<_>) = choices.iter().cloned().unzip();
            quote!(::armor_sdk::parameters::assign_choice(
                &mut self.#ident, value, [#((#texts, #values)),*],
            ))
        }
        Conversion::Parsed(function) => {
            quote!(::armor_sdk::parameters::assign_parsed(&mut self.#ident, value, #function))
        }
    }
}
