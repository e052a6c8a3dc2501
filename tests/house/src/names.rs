//! Names of functions and types, and how much of the code is comment.

use std::collections::BTreeMap;
use std::path::PathBuf;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::Item;

use crate::modules::{CrateModules, is_test_code};

/// A name that several types bear.
#[derive(Clone, Debug)]
pub struct SharedName {
    /// The name.
    pub name: String,
    /// The files that define a type of this name.
    pub files: Vec<PathBuf>,
}

/// The figures of docs/house.md.
#[derive(Clone, Debug, Default)]
pub struct NameFigures {
    /// Functions and methods, those of trait implementations too.
    pub functions: usize,
    /// Functions whose name is one word, such as `begin`.
    pub one_word: usize,
    /// Letters in all names of functions.
    pub letters: usize,
    /// Structs, enums, traits, unions and type aliases.
    pub types: usize,
    /// Types whose name another type bears too.
    pub shared_types: usize,
    /// The shared names, the most frequent first.
    pub shared: Vec<SharedName>,
}

impl NameFigures {
    /// The share of functions with a name of one word, in per cent.
    pub fn one_word_percent(&self) -> f64 {
        percent(self.one_word, self.functions)
    }

    /// The mean length of a function's name, in letters.
    pub fn mean_length(&self) -> f64 {
        self.letters as f64 / self.functions.max(1) as f64
    }

    /// The share of types that do not have their name for themselves, in per cent.
    pub fn shared_percent(&self) -> f64 {
        percent(self.shared_types, self.types)
    }
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// Measures the names in all the given crates together.
pub fn measure_names<'a>(crates: impl IntoIterator<Item = &'a CrateModules>) -> NameFigures {
    let mut figures = NameFigures::default();
    let mut types: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for modules in crates {
        for (file, item) in &modules.items {
            if let Some(name) = type_defined_by(item) {
                types.entry(name).or_default().push(modules.files[*file].clone());
            }
            if let Item::Impl(block) = item
                && is_test_code(&block.attrs)
            {
                continue;
            }
            count_functions(item.to_token_stream(), &mut figures);
        }
    }
    figures.types = types.values().map(Vec::len).sum();
    let shared = types.into_iter().filter(|(_, files)| files.len() > 1);
    figures.shared = shared.map(|(name, files)| SharedName { name, files }).collect();
    figures.shared_types = figures.shared.iter().map(|shared| shared.files.len()).sum();
    figures.shared.sort_by_key(|shared| std::cmp::Reverse(shared.files.len()));
    figures
}

fn count_functions(tokens: TokenStream, figures: &mut NameFigures) {
    let mut after_fn = false;
    for token in tokens {
        match token {
            TokenTree::Ident(word) => {
                let name = word.to_string();
                if after_fn {
                    figures.functions += 1;
                    figures.letters += name.len();
                    figures.one_word += usize::from(!name.trim_matches('_').contains('_'));
                }
                after_fn = name == "fn";
            }
            TokenTree::Group(group) => {
                after_fn = false;
                count_functions(group.stream(), figures);
            }
            _ => after_fn = false,
        }
    }
}

fn type_defined_by(item: &Item) -> Option<String> {
    match item {
        Item::Enum(item) => Some(item.ident.to_string()),
        Item::Struct(item) => Some(item.ident.to_string()),
        Item::Trait(item) => Some(item.ident.to_string()),
        Item::Type(item) => Some(item.ident.to_string()),
        Item::Union(item) => Some(item.ident.to_string()),
        _ => None,
    }
}
