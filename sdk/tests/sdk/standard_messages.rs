//! The standard messages are a promise: a component built earlier links with one built today only if
//! their schemas are equal. A change of a schema is therefore a change of `standard_messages.txt`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use armor_sdk::messages;

/// The schemas of the list that tools and the other languages use, by name.
fn standard_schemas() -> Vec<(String, String)> {
    let definitions = messages::standard_definitions().into_iter();
    let texts = definitions.map(|it| it.schema.to_string());
    texts.map(|text| (text.split(['{', '<']).next().unwrap().to_owned(), text)).collect()
}

fn crate_file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The types in `src/messages/` that derive `Message`, with the name of their file.
fn messages_in_sources() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(crate_file("src/messages")).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let mut derives_message = false;
        for line in text.lines() {
            if line.starts_with("#[derive(") {
                derives_message = line.contains("Message)") || line.contains("Message,");
            }
            let declared =
                ["pub struct ", "pub enum "].iter().find_map(|kind| line.strip_prefix(kind));
            if let Some(rest) = declared.filter(|_| derives_message) {
                let name = rest.split(|c: char| !c.is_alphanumeric()).next().unwrap();
                let file = path.file_name().unwrap().to_string_lossy().into_owned();
                found.push((name.to_owned(), file));
                derives_message = false;
            }
        }
    }
    found
}

#[test]
fn the_schemas_of_the_standard_messages_stay_as_they_are() {
    let mut text = String::new();
    for (_, schema) in standard_schemas() {
        writeln!(text, "{schema}").unwrap();
    }
    let path = crate_file("tests/sdk/standard_messages.txt");
    if std::env::var_os("ARMOR_BLESS").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap();
    let changed: Vec<_> =
        text.lines().filter(|line| !golden.lines().any(|old| old == *line)).collect();
    assert!(
        text == golden,
        "components built before and after this change cannot be linked: {changed:#?}\n\
         If that is intended, run with ARMOR_BLESS=1 and write it into CHANGELOG.md"
    );
}

#[test]
fn every_standard_message_is_public_and_in_the_table_of_the_readme() {
    let listed: Vec<_> = standard_schemas().into_iter().map(|(name, _)| name).collect();
    let readme = std::fs::read_to_string(crate_file("README.md")).unwrap();
    let sources = messages_in_sources();
    assert!(sources.len() > 20, "{sources:?}");
    for (name, file) in &sources {
        assert!(listed.contains(name), "{name} is missing in src/messages/definitions.rs");
        let row = format!("| `messages/{file}` |");
        let row = readme.lines().find(|line| line.starts_with(&row));
        assert!(row.is_some_and(|row| row.contains(&format!("`{name}`"))), "{name}: sdk/README.md");
    }
    assert_eq!(listed.len(), sources.len());
}
