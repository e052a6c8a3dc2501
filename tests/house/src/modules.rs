//! The modules of one crate and which module takes names from which.
//!
//! An import is resolved through re-exports to the module that defines the name, so a façade that
//! only hands names on is no part of a circle. Test code is left out.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::{Attribute, Item, UseTree, Visibility};

/// Re-exports followed before a name counts as not found; more would be a loop of re-exports.
const MAX_HOPS: usize = 16;

/// The modules of one library or program.
#[derive(Default)]
pub struct CrateModules {
    /// The files, by the index that [`Self::imports`] uses.
    pub files: Vec<PathBuf>,
    /// For each pair of files, the names that the first takes from the second.
    pub imports: BTreeMap<(usize, usize), BTreeSet<String>>,
    pub(crate) items: Vec<(usize, Item)>,
    modules: Vec<Module>,
}

/// One module: a file, or an inline `mod` within one.
#[derive(Default)]
struct Module {
    file: usize,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    definitions: BTreeSet<String>,
    bindings: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    /// Paths that this module's code uses.
    references: Vec<Vec<String>>,
}

/// Reads the modules that the file `root` declares, directly or not.
///
/// # Errors
/// If a file is missing or is not Rust.
pub fn read_modules(root: &Path) -> Result<CrateModules> {
    let mut modules = CrateModules::default();
    let folder = root.parent().unwrap_or(Path::new(".")).to_path_buf();
    modules.add_file(root, &folder, None)?;
    for index in 0..modules.modules.len() {
        modules.resolve_references(index);
    }
    Ok(modules)
}

impl CrateModules {
    fn add_file(&mut self, file: &Path, folder: &Path, parent: Option<usize>) -> Result<usize> {
        let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
        let parsed = syn::parse_file(&text).with_context(|| file.display().to_string())?;
        self.files.push(file.to_path_buf());
        let file = self.files.len() - 1;
        self.add_module(file, folder, parent, parsed.items)
    }

    fn add_module(
        &mut self,
        file: usize,
        folder: &Path,
        parent: Option<usize>,
        items: Vec<Item>,
    ) -> Result<usize> {
        self.modules.push(Module { file, parent, ..Module::default() });
        let index = self.modules.len() - 1;
        let (mut uses, mut words) = (Vec::new(), BTreeSet::new());
        for item in items.into_iter().filter(|item| !is_test_code(attributes_of(item))) {
            match item {
                Item::Mod(inner) => {
                    let name = inner.ident.to_string();
                    let below = folder.join(&name);
                    let child = match inner.content {
                        Some((_, items)) => self.add_module(file, &below, Some(index), items)?,
                        None => {
                            let (child, below) = child_file(folder, &name, &inner.attrs);
                            self.add_file(&child, &below, Some(index))?
                        }
                    };
                    self.modules[index].children.insert(name, child);
                }
                Item::Use(item) => {
                    let is_reexport = !matches!(item.vis, Visibility::Inherited);
                    flatten_use(&item.tree, &mut Vec::new(), is_reexport, &mut uses);
                }
                item => {
                    let module = &mut self.modules[index];
                    module.definitions.extend(name_defined_by(&item));
                    collect_paths(item.to_token_stream(), &mut module.references, &mut words);
                    self.items.push((file, item));
                }
            }
        }
        let module = &mut self.modules[index];
        for imported in uses {
            // A re-export that this file does not use itself only hands a name on.
            if !imported.is_reexport || words.contains(&imported.name) {
                module.references.push(imported.path.clone());
            }
            match imported.name.as_str() {
                "*" => module.globs.push(imported.path),
                _ => _ = module.bindings.insert(imported.name, imported.path),
            }
        }
        Ok(index)
    }

    fn resolve_references(&mut self, index: usize) {
        let from = self.modules[index].file;
        for path in std::mem::take(&mut self.modules[index].references) {
            let Some(target) = self.resolve_path(index, &path, 0) else { continue };
            let to = self.modules[target].file;
            if to != from {
                let name = path.last().cloned().unwrap_or_default();
                self.imports.entry((from, to)).or_default().insert(name);
            }
        }
    }

    /// The module that defines what `path` means in module `from`; none if it is of another crate.
    fn resolve_path(&self, from: usize, path: &[String], hops: usize) -> Option<usize> {
        if hops > MAX_HOPS {
            return None;
        }
        let (first, rest) = path.split_first()?;
        let module = &self.modules[from];
        match first.as_str() {
            "crate" => self.resolve_within(0, rest, hops),
            "self" => self.resolve_within(from, rest, hops),
            "super" => self.resolve_within(module.parent?, rest, hops),
            name => match (module.children.get(name), module.bindings.get(name)) {
                (Some(child), _) => self.resolve_within(*child, rest, hops),
                (None, Some(binding)) if binding.first() != Some(first) => {
                    let path = [binding, rest].concat();
                    self.resolve_path(from, &path, hops + 1)
                }
                _ => None,
            },
        }
    }

    fn resolve_within(&self, at: usize, path: &[String], hops: usize) -> Option<usize> {
        let Some((name, rest)) = path.split_first() else { return Some(at) };
        let module = &self.modules[at];
        if name == "super" {
            return self.resolve_within(module.parent?, rest, hops);
        }
        if module.definitions.contains(name) || name == "*" {
            return Some(at);
        }
        if let Some(child) = module.children.get(name) {
            return self.resolve_within(*child, rest, hops);
        }
        if let Some(binding) = module.bindings.get(name) {
            return self.resolve_path(at, &[binding, rest].concat(), hops + 1);
        }
        let through = |glob: &Vec<String>| {
            let target = self.resolve_path(at, &glob[..glob.len() - 1], hops + 1)?;
            let known = &self.modules[target];
            let has = known.definitions.contains(name) || known.bindings.contains_key(name);
            has.then(|| self.resolve_within(target, path, hops + 1))?
        };
        // An unknown name is a variant, or what a macro defines: it belongs to this module.
        module.globs.iter().find_map(through).or(Some(at))
    }
}

struct ImportedName {
    name: String,
    path: Vec<String>,
    is_reexport: bool,
}

fn flatten_use(
    tree: &UseTree,
    path: &mut Vec<String>,
    is_reexport: bool,
    out: &mut Vec<ImportedName>,
) {
    let mut add = |name: String, last: Option<String>| {
        let path = path.iter().cloned().chain(last).collect();
        out.push(ImportedName { name, path, is_reexport });
    };
    match tree {
        UseTree::Path(inner) => {
            path.push(inner.ident.to_string());
            flatten_use(&inner.tree, path, is_reexport, out);
            path.pop();
        }
        UseTree::Name(name) if name.ident == "self" => {
            add(path.last().cloned().unwrap_or_default(), None);
        }
        UseTree::Name(name) => add(name.ident.to_string(), Some(name.ident.to_string())),
        UseTree::Rename(name) => add(name.rename.to_string(), Some(name.ident.to_string())),
        UseTree::Glob(_) => add("*".into(), Some("*".into())),
        UseTree::Group(group) => {
            for tree in &group.items {
                flatten_use(tree, path, is_reexport, out);
            }
        }
    }
}

/// Collects every path (`a::b::c`) and every single word of the code, also within macros.
fn collect_paths(tokens: TokenStream, paths: &mut Vec<Vec<String>>, words: &mut BTreeSet<String>) {
    let mut path: Vec<String> = Vec::new();
    let mut colons = 0;
    for token in tokens {
        match token {
            TokenTree::Ident(word) => {
                if colons != 2 {
                    finish_path(&mut path, paths);
                }
                words.insert(word.to_string());
                path.push(word.to_string());
                colons = 0;
            }
            TokenTree::Punct(punct) if punct.as_char() == ':' && !path.is_empty() => colons += 1,
            TokenTree::Group(group) => {
                finish_path(&mut path, paths);
                colons = 0;
                collect_paths(group.stream(), paths, words);
            }
            _ => {
                finish_path(&mut path, paths);
                colons = 0;
            }
        }
    }
    finish_path(&mut path, paths);
}

fn finish_path(path: &mut Vec<String>, paths: &mut Vec<Vec<String>>) {
    let path = std::mem::take(path);
    if path.len() > 1 {
        paths.push(path);
    }
}

/// Where the module `name` of a file in `folder` lies, and where its own children do.
fn child_file(folder: &Path, name: &str, attributes: &[Attribute]) -> (PathBuf, PathBuf) {
    let given = attributes.iter().find_map(|attribute| match &attribute.meta {
        syn::Meta::NameValue(pair) if pair.path.is_ident("path") => match &pair.value {
            syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(path), .. }) => Some(path.value()),
            _ => None,
        },
        _ => None,
    });
    let below = folder.join(name);
    if let Some(given) = given {
        return (folder.join(given), below);
    }
    let as_folder = below.join("mod.rs");
    let file = if as_folder.is_file() { as_folder } else { folder.join(format!("{name}.rs")) };
    (file, below)
}

/// Whether an item is compiled for tests alone.
pub(crate) fn is_test_code(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let text = attribute.meta.to_token_stream().to_string();
        text == "test" || text.starts_with("cfg (test") || text.starts_with("cfg (all (test")
    })
}

fn attributes_of(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn name_defined_by(item: &Item) -> Option<String> {
    let name = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(name.to_string())
}
