//! `#[derive(Parameters)]`: a struct whose fields are the parameters of a component becomes their
//! table for the manifest, the requests in the constructor and the setter. `#[derive(Events)]`: an
//! enum whose variants are the events of a component becomes their table and their reports.

mod advice;
mod attribute;
mod entry;
mod event;
mod expansion;
mod integer;
#[cfg(test)]
mod tests;

use proc_macro::TokenStream;
use proc_macro2::TokenStream as TokenStream2;
use syn::{DeriveInput, Result, parse_macro_input};

/// Derives `armor_sdk::Parameters` for a struct with named fields, each of which is a parameter.
///
/// The doc comment of a field is the parameter's documentation; `#[parameter(…)]` takes `name`,
/// `unit`, `default`, `range`, `choices(…)`, `parse`, `format`, `colour`, `written` and `live`. The
/// README of this crate has the tables.
#[proc_macro_derive(Parameters, attributes(parameter))]
pub fn derive_parameters(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    derive_or_stub(&input, expansion::expand_struct, expansion::stub_struct).into()
}

/// Derives `armor_sdk::Events` for an enum, each variant of which is an event, and its conversion into
/// `armor_sdk::Outcome`.
///
/// The doc comment of a variant is the event's documentation; its field, if it has one, is the value;
/// `#[event(name = "…", unit = "…")]` gives another name, and the unit of the value.
#[proc_macro_derive(Events, attributes(event))]
pub fn derive_events(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    derive_or_stub(&input, event::expand_enum, event::stub_enum).into()
}

/// Returns the code that `expand` writes, or its errors together with a stub.
fn derive_or_stub(
    input: &DeriveInput,
    expand: fn(&DeriveInput) -> Result<TokenStream2>,
    stub: fn(&DeriveInput) -> TokenStream2,
) -> TokenStream2 {
    expand(input).unwrap_or_else(|error| {
        let mut code = error.into_compile_error();
        code.extend(stub(input));
        code
    })
}
