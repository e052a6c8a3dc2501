//! `#[derive(Parameters)]`: a struct whose fields are the parameters of a component becomes their
//! table for the manifest, the requests in the constructor and the setter.

mod attribute;
mod expansion;
#[cfg(test)]
mod tests;

use proc_macro::TokenStream;
use syn::{DeriveInput, Error, parse_macro_input};

/// Derives `armor_sdk::Parameters` for a struct with named fields, each of which is a parameter.
///
/// The doc comment of a field is the parameter's documentation; `#[parameter(…)]` takes `name`,
/// `unit`, `default`, `range`, `choices(…)`, `parse`, `colour` and `live`. The README of this crate
/// has the tables.
#[proc_macro_derive(Parameters, attributes(parameter))]
pub fn derive_parameters(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    expansion::expand_struct(&input).unwrap_or_else(Error::into_compile_error).into()
}
