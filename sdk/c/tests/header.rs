//! `include/armor.h` is what cbindgen makes of the sources. `ARMOR_BLESS=1` writes it.

use std::path::Path;

/// The files that declare what C sees.
const SOURCES: [&str; 8] = [
    "src/failure.rs",
    "src/declaration.rs",
    "src/boundary/handles.rs",
    "src/boundary.rs",
    "src/boundary/received.rs",
    "src/boundary/any.rs",
    "src/boundary/history.rs",
    "src/boundary/testing.rs",
];
/// The enums, which no function names: C gives and takes their numbers.
const ENUMS: [&str; 8] = [
    "ArmorError",
    "ArmorFieldKind",
    "ArmorFieldForm",
    "ArmorParameterType",
    "ArmorCall",
    "ArmorOutcomeKind",
    "ArmorState",
    "ArmorText",
];

/// The sources state their contracts under `# Safety`, as Rust does; a header has one text.
fn generate() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config =
        cbindgen::Config::from_file(folder.join("cbindgen.toml")).expect("cbindgen.toml is valid");
    config.export.include = ENUMS.map(Into::into).into();
    let builder = cbindgen::Builder::new().with_config(config);
    let builder = SOURCES.iter().fold(builder, |builder, file| builder.with_src(folder.join(file)));
    let bindings = builder.generate().expect("the sources are bindings");
    let mut bytes = Vec::new();
    bindings.write(&mut bytes);
    let text = String::from_utf8(bytes).expect("UTF-8");
    let text =
        text.replace("// # Safety\n", "// Contract:\n").replace("[`", "`").replace("`]", "`");
    text.replace("\n\n\n", "\n\n")
}

#[test]
fn the_header_is_generated_from_the_sources() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/armor.h");
    let generated = generate();
    if std::env::var_os("ARMOR_BLESS").is_some() {
        std::fs::write(&path, &generated).expect("written");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        kept == generated,
        "include/armor.h differs from the sources; ARMOR_BLESS=1 cargo test -p armor-c --test header \
         writes it"
    );
}
