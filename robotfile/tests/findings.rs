//! One file, one fault, one finding: the right code at the marked piece of text.

mod any_type;
mod astray;
mod branches;
mod exchanged;
mod exits;
mod file;
mod follow_ups;
mod frames;
mod manifests;
mod meant;
mod mission_slips;
mod missions;
mod one_cause;
mod one_mistake;
mod remedies;
mod silent;
mod submissions;
mod systems;
mod together;
mod value_effects;
mod waiting;

use std::path::Path;

use armor_robotfile::{Colours, Manifests, Reading, check, read};

/// Reads `file`, in which `[[…]]` marks what is to be underlined.
fn reading(file: &str, manifests: Option<&Manifests>) -> (Reading, usize) {
    let mark = file.find("[[").unwrap_or(0);
    let plain = file.replace("[[", "").replace("]]", "");
    let reading = read(Path::new("a.xml"), &mut |path| {
        if path == Path::new("a.xml") {
            Ok(plain.clone().into())
        } else {
            Err(std::io::ErrorKind::NotFound.into())
        }
    });
    (check(reading, &[], manifests), mark)
}

/// The file has exactly one finding, of this code, at its mark.
fn one(code: &str, file: &str) {
    one_with(code, file, None);
}

/// The file has no finding at all.
fn none(file: &str) {
    let (reading, _) = reading(file, None);
    assert!(reading.findings.is_empty(), "{file}\n{}", reading.findings.render(Colours::No));
}

fn one_with(code: &str, file: &str, manifests: Option<&Manifests>) {
    let (reading, mark) = reading(file, manifests);
    let shown = reading.findings.render(Colours::No);
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(codes, [code], "{file}\n{shown}");
    let finding = reading.findings.iter().next().unwrap();
    assert!(!finding.remedy.is_empty(), "{shown}");
    if file.contains("[[") {
        let at = finding.at.as_ref().unwrap();
        let wanted = file.split("[[").nth(1).unwrap().split("]]").next().unwrap();
        assert_eq!((at.span.start(), at.text()), (mark, wanted), "{shown}");
    }
}

fn system(inner: &str) -> String {
    format!("<armor version=\"1\"><system>{inner}</system></armor>")
}

fn mission(inner: &str) -> String {
    let components = r#"<component name="go" kind="k"/><component name="stop" kind="k"/><component name="free" kind="k" controllable="false"/>"#;
    format!(
        r#"<armor version="1"><system>{components}</system><mission goal="over" safe="hold"><place name="a" initial="true"/><place name="over"/><place name="hold"/><transition name="end" from="a" to="over" when="free.state.ready"/>{inner}</mission></armor>"#
    )
}

/// The codes of all findings of the file, and these as they are shown.
fn found_in(file: &str) -> (Vec<&'static str>, String) {
    let (reading, _) = reading(file, None);
    let codes = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    (codes, reading.findings.render(Colours::No))
}

/// All that is found, as codes, in the order of the file.
fn all_of(file: &str) -> Vec<&'static str> {
    let (reading, _) = reading(file, None);
    assert!(!reading.is_valid());
    reading.findings.iter().map(|finding| finding.code.as_str()).collect()
}
