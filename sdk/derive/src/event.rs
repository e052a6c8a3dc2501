//! The events of a component: each variant of an enum, checked, and the code for them.

use armor_wire::manifest::{EventManifest, EventValue};
use armor_wire::name::is_name;
use proc_macro2::TokenStream;
use quote::quote;
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::{Data, DeriveInput, Error, Fields, Ident, LitStr, Result, Variant};

use crate::attribute::{NAME_RULE, ValueKind, combine_errors, kind_of_type, read_doc};
use crate::entry::parse_value;

/// A variant that is an event.
struct EventVariant<'a> {
    ident: &'a Ident,
    manifest: EventManifest,
}

/// Writes `impl Events` for an enum.
pub(crate) fn expand_enum(input: &DeriveInput) -> Result<TokenStream> {
    if !input.generics.params.is_empty() {
        return Err(Error::new_spanned(&input.generics, "events are not generic"));
    }
    let Data::Enum(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "events are the variants of an enum"));
    };
    if data.variants.is_empty() {
        return Err(Error::new_spanned(&input.ident, "an enum without variants has no events"));
    }
    let read = data.variants.iter().map(EventVariant::read);
    let events: Vec<_> = combine_errors(read)?;
    for (index, event) in events.iter().enumerate() {
        let name = &event.manifest.name;
        if events[..index].iter().any(|earlier| earlier.manifest.name == *name) {
            let why = format!("two events are called `{name}`");
            return Err(Error::new_spanned(event.ident, why));
        }
    }
    let ident = &input.ident;
    let declarations = events.iter().map(EventVariant::expand_declaration);
    let names = events.iter().map(|event| {
        let (variant, name) = (event.ident, &event.manifest.name);
        quote!(Self::#variant { .. } => #name)
    });
    let values = events.iter().map(|event| {
        let variant = event.ident;
        match event.manifest.value {
            Some(_) => quote!(Self::#variant(value) => *value as f64),
            None => quote!(Self::#variant { .. } => 1.0),
        }
    });
    Ok(quote! {
        impl ::armor_sdk::Events for #ident {
            const DECLARED: &'static [::armor_sdk::DeclaredEvent] = &[#(#declarations),*];

            fn event_name(&self) -> &'static str {
                match self { #(#names),* }
            }

            #[allow(clippy::cast_lossless, clippy::cast_precision_loss, clippy::unnecessary_cast)]
            fn event_value(&self) -> f64 {
                match self { #(#values),* }
            }
        }

        impl ::core::convert::From<#ident> for ::armor_sdk::Outcome {
            fn from(event: #ident) -> Self {
                Self::event(
                    ::armor_sdk::Events::event_name(&event),
                    ::armor_sdk::Events::event_value(&event),
                )
            }
        }
    })
}

/// Writes an `impl Events` without meaning for a type that is refused, as
/// [`stub_struct`](crate::expansion::stub_struct) does.
pub(crate) fn stub_enum(input: &DeriveInput) -> TokenStream {
    let ident = &input.ident;
    let (impl_generics, generics, conditions) = input.generics.split_for_impl();
    quote! {
        impl #impl_generics ::armor_sdk::Events for #ident #generics #conditions {
            const DECLARED: &'static [::armor_sdk::DeclaredEvent] = &[];

            fn event_name(&self) -> &'static str {
                ::core::unreachable!()
            }

            fn event_value(&self) -> f64 {
                ::core::unreachable!()
            }
        }

        impl #impl_generics ::core::convert::From<#ident #generics> for ::armor_sdk::Outcome
        #conditions
        {
            fn from(_: #ident #generics) -> Self {
                ::core::unreachable!()
            }
        }
    }
}

impl<'a> EventVariant<'a> {
    fn read(variant: &'a Variant) -> Result<Self> {
        let (mut name, mut unit): (Option<LitStr>, Option<LitStr>) = (None, None);
        for attribute in variant.attrs.iter().filter(|a| a.path().is_ident("event")) {
            attribute.parse_nested_meta(|meta| {
                let place = if meta.path.is_ident("name") {
                    &mut name
                } else if meta.path.is_ident("unit") {
                    &mut unit
                } else {
                    return Err(meta.error("expected name or unit"));
                };
                let example = "name = \"lap\" or unit = \"m/s\"";
                match place.replace(parse_value(&meta, example)?) {
                    None => Ok(()),
                    Some(_) => Err(meta.error("this is given twice")),
                }
            })?;
        }
        let manifest = EventManifest {
            name: name
                .as_ref()
                .map_or_else(|| snake_case(&variant.ident.unraw().to_string()), LitStr::value),
            doc: read_doc(&variant.attrs),
            value: value_of(variant)?,
            unit: unit.as_ref().map(LitStr::value).unwrap_or_default(),
            named_by: String::new(),
        };
        let name_span = name.as_ref().map_or(variant.ident.span(), Spanned::span);
        if !is_name(&manifest.name) {
            return Err(Error::new(name_span, NAME_RULE));
        }
        let faults = manifest.list_faults().into_iter().map(|fault| {
            let span = match (fault.member, &unit) {
                ("unit", Some(unit)) => unit.span(),
                ("name", _) => name_span,
                _ => variant.ident.span(),
            };
            Err::<(), _>(Error::new(span, format!("{}; {}", fault.problem, fault.remedy)))
        });
        combine_errors(faults)?;
        Ok(Self { ident: &variant.ident, manifest })
    }

    /// The entry of the table, as it would be written by hand.
    fn expand_declaration(&self) -> TokenStream {
        let EventManifest { name, doc, value, unit, .. } = &self.manifest;
        let mut declaration = quote!(::armor_sdk::DeclaredEvent::new(#name));
        if !doc.is_empty() {
            declaration.extend(quote!(.doc(#doc)));
        }
        match value {
            Some(EventValue::Number) => declaration.extend(quote!(.number(#unit))),
            Some(EventValue::Integer) => declaration.extend(quote!(.integer())),
            None => {}
        }
        declaration
    }
}

fn value_of(variant: &Variant) -> Result<Option<EventValue>> {
    let why = "the value of an event is one number: write Variant(f64), Variant(u32) or Variant";
    match &variant.fields {
        Fields::Unit => Ok(None),
        Fields::Unnamed(fields) if fields.unnamed.len() == 1 => {
            match kind_of_type(&fields.unnamed[0].ty) {
                Some(ValueKind::Number) => Ok(Some(EventValue::Number)),
                Some(ValueKind::Integer) => Ok(Some(EventValue::Integer)),
                _ => Err(Error::new_spanned(&variant.fields, why)),
            }
        }
        _ => Err(Error::new_spanned(&variant.fields, why)),
    }
}

/// `LidOpen` is `lid_open`.
fn snake_case(variant: &str) -> String {
    let mut name = String::new();
    for c in variant.chars() {
        if c.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(c.to_lowercase());
    }
    name
}
