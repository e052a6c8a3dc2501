//! Every invalid file of the error catalogue is opened and shown in every view, with its findings.

use std::path::{Path, PathBuf};

use armor_designer::{Designer, Settings, Start, View};
use armor_robotfile::Severity;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use crate::bench_kinds;

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robotfile/tests/errors");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let is_xml = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "xml");
    let mut files: Vec<_> = entries.filter(is_xml).collect();
    files.sort();
    files
}

fn window(file: &Path, view: View) -> Harness<'static, Designer> {
    let start = Start {
        file: Some(file.to_path_buf()),
        view,
        kinds: Some(bench_kinds::kinds()),
        ..Start::default()
    };
    let mut harness = Harness::builder()
        .with_size([1000.0, 700.0])
        .allow_missing_glyphs()
        .build_eframe(|creation| Designer::new(&creation.egui_ctx, start, Settings::default()));
    harness.run_steps(2);
    harness.state_mut().desk().project.settle();
    harness.run_steps(3);
    harness
}

#[test]
fn what_is_wrong_with_an_invalid_file_is_shown() {
    let files = files();
    assert!(files.len() > 150, "there are {} only", files.len());
    for file in &files {
        let mut harness = window(file, View::System);
        let checked = harness.state_mut().desk().project.checked().clone();
        assert!(checked.is_complete, "{}", file.display());
        let first = checked.findings.iter().find(|f| f.severity() == Severity::Error);
        let Some(first) = first else { continue };
        let is_shown = harness.query_all_by_label_contains(first.code.as_str()).next().is_some();
        let said = harness.state_mut().desk().messages.last().unwrap_or_default().to_owned();
        assert!(is_shown, "{}: {first} is not shown, but {said:?}", file.display());
    }
}

#[test]
fn an_invalid_file_is_shown_in_every_view() {
    for file in files() {
        for view in [View::Mission, View::Live] {
            window(&file, view);
        }
    }
}

#[test]
fn what_is_no_text_at_all_is_refused_with_the_reason() {
    let folder = std::env::temp_dir().join(format!("armor-designer-odd-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (name, bytes) in
        [("latin.xml", &b"<armor v=\"\xe4\"/>"[..]), ("empty.xml", b""), ("nul.xml", b"\0")]
    {
        let file = folder.join(name);
        std::fs::write(&file, bytes).unwrap();
        let mut harness = window(&file, View::System);
        let desk = harness.state_mut().desk();
        assert!(desk.project.checked().findings.has_errors(), "{name} seems fine");
        assert!(!desk.project.is_dirty() && desk.project.is_broken(), "{name}");
    }
    let mut harness = window(&folder, View::System);
    let said = harness.state_mut().desk().messages.last().unwrap_or_default().to_owned();
    assert!(said.contains("not a regular file"), "{said}");
    std::fs::remove_dir_all(&folder).unwrap();
}
