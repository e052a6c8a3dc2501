//! Every invalid file of the error catalogue is opened and shown in every view, with its findings.

use std::path::{Path, PathBuf};

use armor_designer::{Designer, Settings, Start, View};
use armor_robotfile::{Code, Severity};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use crate::ui::bench_kinds;

/// Writes the examples of all pages, each with the files that it names into a folder of its own,
/// and returns the paths of the main files.
fn write_examples(name: &str) -> Vec<PathBuf> {
    let folder = std::env::temp_dir().join(format!("armor-designer-{name}-{}", std::process::id()));
    let mut paths = Vec::new();
    for code in Code::ALL {
        let examples = [("faulty", code.faulty_example()), ("fixed", code.fixed_example())];
        for (form, example) in examples {
            let folder = folder.join(code.as_str()).join(form);
            std::fs::create_dir_all(&folder).unwrap();
            let Some(example) = example else { continue };
            for (name, bytes) in &example.files {
                std::fs::write(folder.join(name), bytes).unwrap();
            }
            paths.push(folder.join("robot.xml"));
        }
    }
    paths
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
    harness.state_mut().workspace().project.settle();
    harness.run_steps(3);
    harness
}

#[test]
fn what_is_wrong_with_an_invalid_file_is_shown() {
    let files = write_examples("findings");
    assert!(files.len() > 150, "there are {} only", files.len());
    for file in &files {
        let mut harness = window(file, View::System);
        let checked = harness.state_mut().workspace().project.checked().clone();
        assert!(checked.is_complete, "{}", file.display());
        let first = checked.findings.iter().find(|f| f.severity() == Severity::Error);
        let Some(first) = first else { continue };
        let is_shown = harness.query_all_by_label_contains(first.code.as_str()).next().is_some();
        let message =
            harness.state_mut().workspace().messages.last().unwrap_or_default().to_owned();
        assert!(is_shown, "{}: {first} is not shown, but {message:?}", file.display());
    }
}

#[test]
fn an_invalid_file_is_shown_in_every_view() {
    for file in write_examples("views") {
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
        let workspace = harness.state_mut().workspace();
        assert!(workspace.project.checked().findings.has_errors(), "{name} seems fine");
        assert!(!workspace.project.is_dirty() && workspace.project.is_broken(), "{name}");
    }
    let mut harness = window(&folder, View::System);
    let message = harness.state_mut().workspace().messages.last().unwrap_or_default().to_owned();
    assert!(message.contains("it is a folder"), "{message}");
    std::fs::remove_dir_all(&folder).unwrap();
}
