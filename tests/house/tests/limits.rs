//! The limits of docs/house.md hold for this workspace.

use armor_house::{
    CrateModules, circles_of, find_crates, measure_names, read_modules, workspace_root,
};

/// A circle of three can be read as one; more cannot.
const LARGEST_CIRCLE: usize = 3;
/// Names such as `len`, `push` and what foreign traits prescribe.
const ONE_WORD_PERCENT: f64 = 45.0;
/// A few types are named after the same thing in two layers, such as a link in the file and its
/// live counterpart.
const SHARED_TYPES_PERCENT: f64 = 15.0;

fn all_modules() -> Vec<CrateModules> {
    let crates = find_crates(&workspace_root()).unwrap();
    let roots = crates.iter().flat_map(|sources| &sources.roots);
    roots.map(|file| read_modules(file).unwrap()).collect()
}

#[test]
fn no_circle_of_modules_is_larger_than_three() {
    let circles = all_modules().iter().flat_map(circles_of).collect::<Vec<_>>();
    let large = circles.iter().filter(|circle| circle.files.len() > LARGEST_CIRCLE);
    let large: Vec<_> = large.map(ToString::to_string).collect();
    assert!(large.is_empty(), "{}", large.join("\n"));
}

#[test]
fn most_functions_name_what_they_do_and_to_what() {
    let figures = measure_names(&all_modules());
    let percent = figures.one_word_percent();
    assert!(percent <= ONE_WORD_PERCENT, "{percent:.1} % of the functions have one word");
}

#[test]
fn a_type_has_its_name_for_itself() {
    let figures = measure_names(&all_modules());
    let percent = figures.shared_percent();
    assert!(percent <= SHARED_TYPES_PERCENT, "{percent:.1} %: {:#?}", figures.shared);
}
