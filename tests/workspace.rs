//! The workspace itself: which crate may import which (ARCHITECTURE.md, Arrows), licences, and the
//! boundary between the middleware and the algorithms.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Each crate and the crates of the workspace it may import. Dev-dependencies do not count.
const ARROWS: &[(&str, &[&str])] = &[
    ("armor-files", &[]),
    ("armor-frames", &[]),
    ("armor-geo", &[]),
    ("armor-exchange", &[]),
    ("armor-symbols", &[]),
    ("armor-tiles", &["armor-drawn-world", "armor-geo", "armor-map-file"]),
    ("armor-quantity", &[]),
    ("armor-wire-derive", &["armor-quantity"]),
    ("armor-wire", &["armor-quantity", "armor-wire-derive"]),
    ("armor-socket", &["armor-wire"]),
    ("armor-memory", &[]),
    ("armor-keys", &["armor-files", "armor-socket", "armor-wire"]),
    ("armor-registry", &["armor-socket", "armor-wire"]),
    ("armor-robotfile", &["armor-geo", "armor-wire"]),
    (
        "armor-ground",
        &["armor-geo", "armor-grid", "armor-map-file", "armor-robotfile", "armor-zones"],
    ),
    ("armor-configd", &["armor-files", "armor-robotfile", "armor-socket", "armor-wire"]),
    ("armor-petri", &[]),
    ("armor-sdk-derive", &["armor-wire"]),
    ("armor-sdk", &["armor-memory", "armor-sdk-derive", "armor-socket", "armor-wire"]),
    ("armor-definitions", &["armor-sdk", "armor-wire"]),
    ("armor-python", &["armor-inspect", "armor-sdk"]),
    ("armor-c", &["armor-sdk"]),
    ("armor-marking", &["armor-wire"]),
    ("armor-plan", &["armor-petri", "armor-robotfile"]),
    ("armor-proof", &["armor-petri", "armor-plan", "armor-robotfile"]),
    (
        "armor-executive",
        &[
            "armor-files",
            "armor-marking",
            "armor-petri",
            "armor-plan",
            "armor-proof",
            "armor-robotfile",
            "armor-sdk",
        ],
    ),
    (
        "armor-recording",
        &["armor-inspect", "armor-robotfile", "armor-sdk", "armor-socket", "armor-wire"],
    ),
    ("armor-recorder", &["armor-inspect", "armor-recording", "armor-sdk"]),
    (
        "armor-web",
        &[
            "armor-inspect",
            "armor-keys",
            "armor-marking",
            "armor-sdk",
            "armor-socket",
            "armor-wire",
        ],
    ),
    ("armor-web-view", &["armor-inspect", "armor-sdk", "armor-web"]),
    (
        "armor-foxglove",
        &["armor-inspect", "armor-recording", "armor-sdk", "armor-socket", "armor-wire"],
    ),
    ("armor-inspect", &["armor-files", "armor-marking", "armor-sdk", "armor-wire"]),
    ("armor-grid", &[]),
    ("armor-map-file", &["armor-grid"]),
    ("armor-drawn-world", &["armor-grid"]),
    ("armor-zones", &["armor-geo", "armor-grid"]),
    ("armor-convert", &["armor-frames", "armor-geo", "armor-grid", "armor-sdk", "armor-zones"]),
    ("armor-chart", &["armor-sdk", "armor-convert", "armor-grid", "armor-map-file", "armor-zones"]),
    (
        "armor-simulator",
        &["armor-sdk", "armor-convert", "armor-drawn-world", "armor-grid", "armor-map-file"],
    ),
    (
        "armor-designer",
        &[
            "armor-configd",
            "armor-files",
            "armor-geo",
            "armor-inspect",
            "armor-marking",
            "armor-petri",
            "armor-plan",
            "armor-proof",
            "armor-robotfile",
            "armor-picture",
            "armor-recording",
            "armor-sdk",
            "armor-symbols",
            "armor-tiles",
            "armor-wire",
        ],
    ),
    ("armor-picture", &[]),
    ("armor-evaluation", &["armor-grid", "armor-grid-slam", "armor-picture"]),
    (
        "armor-map-writer",
        &["armor-sdk", "armor-convert", "armor-files", "armor-grid", "armor-picture"],
    ),
    (
        "armor-operator-view",
        &[
            "armor-sdk",
            "armor-convert",
            "armor-files",
            "armor-grid",
            "armor-inspect",
            "armor-picture",
        ],
    ),
];
/// Crates that every component may import.
const COMPONENT: &[&str] =
    &["armor-sdk", "armor-convert", "armor-files", "armor-grid", "armor-zones"];
/// Crates at the top, which no other crate imports.
const TOP: &[&str] = &["armor", "armor-bench", "armor-hostile", "armor-house", "armor-mutants"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the launcher is in the workspace").into()
}

fn metadata() -> Value {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("cargo prints JSON")
}

fn packages(metadata: &Value) -> impl Iterator<Item = &Value> {
    metadata["packages"].as_array().into_iter().flatten()
}

#[test]
fn crates_import_only_what_the_architecture_allows() {
    let metadata = metadata();
    let allowed: BTreeMap<&str, &[&str]> = ARROWS.iter().copied().collect();
    let (mut seen, mut wrong) = (BTreeSet::new(), Vec::new());
    for package in packages(&metadata).filter(|package| package["source"].is_null()) {
        let name = package["name"].as_str().unwrap_or_default();
        seen.insert(name.to_owned());
        let folder = package["manifest_path"].as_str().unwrap_or_default();
        let may = match allowed.get(name) {
            Some(may) => *may,
            None if folder.contains("/components/") => COMPONENT,
            None if TOP.contains(&name) => continue,
            None => panic!("{name} has no place in the architecture; give it one in ARROWS"),
        };
        for dependency in package["dependencies"].as_array().into_iter().flatten() {
            let target = dependency["name"].as_str().unwrap_or_default();
            let of_ours = target == "armor" || target.starts_with("armor-");
            if of_ours && dependency["kind"].as_str() != Some("dev") && !may.contains(&target) {
                wrong.push(format!("{name} -> {target}"));
            }
        }
    }
    assert!(wrong.is_empty(), "not allowed: {wrong:#?}");
    for (name, _) in ARROWS {
        assert!(seen.contains(*name), "{name} is in the architecture but not in the workspace");
    }
}

/// The names of the crates are the map of the workspace; a folder of the same name elsewhere
/// misleads.
#[test]
fn no_folder_inside_a_crate_carries_the_name_of_another_crate() {
    let metadata = metadata();
    let manifests = packages(&metadata).filter(|package| package["source"].is_null());
    let crates: Vec<PathBuf> = manifests
        .filter_map(|package| Path::new(package["manifest_path"].as_str()?).parent())
        .map(Path::to_path_buf)
        .collect();
    let names: BTreeSet<_> = crates.iter().filter_map(|folder| folder.file_name()).collect();
    let mut wrong = Vec::new();
    for sources in crates.iter().map(|folder| folder.join("src")) {
        let mut folders = vec![sources];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
                let path = entry.path();
                if path.is_dir() {
                    if names.contains(entry.file_name().as_os_str()) {
                        wrong.push(path.display().to_string());
                    }
                    folders.push(path);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "rename: {wrong:#?}");
}

#[test]
fn algorithms_do_not_know_the_middleware() {
    let mut wrong = Vec::new();
    let folders = std::fs::read_dir(root().join("components")).expect("components").flatten();
    // This file consists of ports only: it converts messages to geometry.
    for kind in folders.filter(|folder| folder.file_name() != "convert") {
        let mut folders = vec![kind.path().join("src")];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
                let path = entry.path();
                let is_ports = path.components().any(|part| {
                    part.as_os_str().to_string_lossy().trim_end_matches(".rs") == "ports"
                });
                if path.is_dir() {
                    folders.push(path);
                } else if !is_ports
                    && std::fs::read_to_string(&path).is_ok_and(|text| text.contains("armor_sdk"))
                {
                    wrong.push(path.display().to_string());
                }
            }
        }
    }
    assert!(wrong.is_empty(), "only ports.rs may name armor_sdk: {wrong:#?}");
}

#[test]
fn every_dependency_has_a_licence_we_may_use() {
    const ALLOWED: &[&str] = &[
        "Apache-2.0",
        "MIT",
        "BSD-2-Clause",
        "BSD-3-Clause",
        "ISC",
        "Unicode-3.0",
        "Zlib",
        "CC0-1.0",
        "Unlicense",
        "0BSD",
        "Apache-2.0 WITH LLVM-exception",
        "MIT-0",
        "BSL-1.0",
        // The JPEG encoder of the camera; its README states this licence.
        "IJG",
        // The fonts of egui, in the designer only.
        "OFL-1.1",
        "Ubuntu-font-1.0",
    ];
    // It writes the header of sdk/c when its test runs; nothing of it is in a program.
    const TOOLS: &[(&str, &str)] = &[("cbindgen", "MPL-2.0")];
    let metadata = metadata();
    let is_tool = |package: &Value| {
        let of = |member: &str| package[member].as_str().unwrap_or_default();
        TOOLS.contains(&(of("name"), of("license")))
    };
    let may_use = |expression: &str| {
        let parts = expression.replace(['(', ')'], "").replace('/', " OR ");
        // Every AND part must offer at least one licence of the list.
        parts.split(" AND ").all(|part| part.split(" OR ").any(|one| ALLOWED.contains(&one.trim())))
    };
    let wrong: Vec<_> = packages(&metadata)
        .filter(|package| !is_tool(package))
        .filter(|package| !may_use(package["license"].as_str().unwrap_or_default()))
        .map(|package| format!("{}: {}", package["name"], package["license"]))
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_folder_describes_itself() {
    let metadata = metadata();
    let missing: Vec<_> = packages(&metadata)
        .filter(|package| package["source"].is_null())
        .filter_map(|package| Path::new(package["manifest_path"].as_str()?).parent())
        .filter(|folder| !folder.join("README.md").is_file())
        .map(Path::to_path_buf)
        .collect();
    assert!(missing.is_empty(), "no README.md in {missing:#?}");
}

/// Every file that ARCHITECTURE.md names exists, and so does every file that a document links to.
#[test]
fn documents_name_files_that_exist() {
    let mut wrong = Vec::new();
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    for name in text.split('`').skip(1).step_by(2) {
        let is_path =
            name.contains('/') && !name.starts_with('/') && !name.contains([' ', '*', '<', '…']);
        if is_path && !root().join(name).exists() {
            wrong.push(format!("ARCHITECTURE.md: {name}"));
        }
    }
    let mut folders = vec![root()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let name = entry.file_name();
            if path.is_dir() && !["target", "out", ".git"].iter().any(|skipped| name == *skipped) {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "md") {
                let text = std::fs::read_to_string(&path).expect("a document");
                let prose: String = text.split("```").step_by(2).collect();
                let links = prose.split("](").skip(1).filter_map(|rest| rest.split(')').next());
                for link in links.filter(|link| !link.contains("://") && !link.starts_with('#')) {
                    let file = link.split('#').next().unwrap_or_default();
                    let is_file_name = !file.is_empty() && !file.contains([' ', '"', '`']);
                    if is_file_name && !folder.join(file).exists() {
                        wrong.push(format!("{}: {link}", path.display()));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "these do not exist: {wrong:#?}");
}
