//! The reader of modules finds what imports what, on small crates written here.

use std::fs;
use std::path::PathBuf;

use armor_house::{circles_of, measure_names, read_modules};

/// Writes a crate into a folder of its own and returns its root file.
fn write_crate(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("armor-house-{}-{name}", std::process::id()));
    for (file, text) in files {
        let path = folder.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder.join("lib.rs")
}

/// The sizes of the circles in a crate of these files.
fn circle_sizes(name: &str, files: &[(&str, &str)]) -> Vec<usize> {
    let root = write_crate(name, files);
    let sizes = circles_of(&read_modules(&root).unwrap()).iter().map(|c| c.files.len()).collect();
    fs::remove_dir_all(root.parent().unwrap()).unwrap();
    sizes
}

#[test]
fn a_name_that_is_only_handed_on_ties_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
        ("a.rs", "use crate::B; pub struct A(B);"),
        ("b.rs", "pub struct B;"),
    ];
    assert_eq!(circle_sizes("facade", &files), Vec::<usize>::new());
}

#[test]
fn imports_in_a_loop_are_a_circle_wherever_they_are_written() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c; pub use a::A;"),
        ("a.rs", "use crate::b::B; pub struct A(B);"),
        ("b.rs", "pub struct B; fn f() { println!(\"{}\", super::c::TEXT); }"),
        ("c.rs", "pub const TEXT: &str = \"\"; fn g(_: crate::A) {}"),
    ];
    assert_eq!(circle_sizes("loop", &files), [3]);
}

#[test]
fn test_code_ties_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "use crate::b::B; pub struct A(B);"),
        ("b.rs", "pub struct B; #[cfg(test)] mod tests { use crate::a::A; fn t(_: A) {} }"),
    ];
    assert_eq!(circle_sizes("tests", &files), Vec::<usize>::new());
}

#[test]
fn names_are_counted() {
    let files = [
        ("lib.rs", "mod a; pub struct Twice; fn begin() {}"),
        ("a.rs", "enum Twice {} fn to_do() {}"),
    ];
    let root = write_crate("names", &files);
    let figures = measure_names([&read_modules(&root).unwrap()]);
    fs::remove_dir_all(root.parent().unwrap()).unwrap();
    assert_eq!((figures.functions, figures.one_word), (2, 1));
    assert_eq!((figures.types, figures.shared_types), (2, 2));
}
