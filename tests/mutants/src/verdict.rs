//! What `armor check --strict` finds in a mutant, and whether it means the same as its example.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, anyhow};
use armor_plan::Plan;
use armor_robotfile::{
    Configuration, Date, Findings, Manifests, NeededPath, Reading, Severity, check, differences,
    needed_paths, passed_dates, read, read_bytes,
};
use armor_wire::manifest::Manifest;

use crate::example::Example;

/// The day on which dates are judged, so that the study gives the same result on every day.
const TODAY_S: u64 = 1_790_000_000;

/// What `armor check --strict` does with a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CheckVerdict {
    /// It refuses it with errors.
    Refused,
    /// It warns.
    Warned,
    /// It passes it.
    Passed,
}

/// Returns the manifests of the kinds that the examples use.
///
/// # Errors
/// If one of the stock components is broken.
pub fn collect_manifests() -> Result<Manifests> {
    let manifests: [Result<Manifest, armor_sdk::Fault>; 8] = [
        armor_sdk::manifest_of::<armor_driver::Driver>(),
        armor_sdk::manifest_of::<armor_explorer::Explorer>(),
        armor_sdk::manifest_of::<armor_grid_slam::GridSlam>(),
        armor_sdk::manifest_of::<armor_homing::Homing>(),
        armor_sdk::manifest_of::<armor_map_writer::MapWriter>(),
        armor_sdk::manifest_of::<armor_patrol::Patrol>(),
        armor_sdk::manifest_of::<armor_planner::Planner>(),
        armor_sdk::manifest_of::<armor_simulator::Simulator>(),
    ];
    let named = manifests.into_iter().map(|manifest| {
        let manifest = manifest.map_err(|fault| anyhow!("a component is broken: {fault}"))?;
        Ok((manifest.kind.clone(), manifest))
    });
    named.collect()
}

/// Checks `text` as the file at `path`, as `armor check` does.
pub fn check_text(path: &Path, text: &str, manifests: &Manifests) -> Findings {
    let mut reading = check(read_text(path, text), &[], Some(manifests));
    if let Some(configuration) = &reading.configuration {
        let needed = needed_paths(configuration, manifests);
        reading.findings.extend(needed.iter().filter_map(NeededPath::find_fault));
        let today = Date::since_1970(Duration::from_secs(TODAY_S));
        reading.findings.extend(passed_dates(configuration, today));
    }
    if reading.is_valid()
        && let Some(configuration) = &reading.configuration
    {
        reading.findings.extend_proven(prove_mission(configuration), configuration);
    }
    reading.findings.sort();
    reading.findings
}

/// Returns the verdict that follows from the findings.
pub fn judge_findings(findings: &Findings) -> CheckVerdict {
    if findings.has_errors() {
        CheckVerdict::Refused
    } else if findings.count(Severity::Warning) > 0 {
        CheckVerdict::Warned
    } else {
        CheckVerdict::Passed
    }
}

/// Returns how the meaning of a mutant differs from its example's, in words: names that nothing
/// refers to and checks mean nothing for a run.
pub fn compare_meaning(example: &Example, text: &str) -> Vec<String> {
    let meaning = |text: &str| {
        let parsed = Example::parse(&example.path, text.to_owned()).ok()?;
        read_text(&example.path, &without_labels(&parsed)).configuration
    };
    match (meaning(&example.text), meaning(text)) {
        (Some(before), Some(after)) => {
            differences(&before, &after).iter().map(ToString::to_string).collect()
        }
        _ => vec!["it cannot be read".into()],
    }
}

/// The text with its transitions numbered, without the names of system and mission, and without
/// checks.
fn without_labels(example: &Example) -> String {
    let mut text = example.text.clone();
    let mut transitions = example.elements.iter().filter(|it| it.name == "transition").count();
    // From the end, so that the spans before stay true. No element here lies in another one of these.
    for element in example.elements.iter().rev() {
        let name = element.attributes.iter().find(|it| it.name == "name").map(|it| it.span);
        let (span, new) = match (element.name.as_str(), name) {
            ("transition", name) => {
                transitions -= 1;
                let Some(name) = name else { continue };
                (name, format!("name=\"t{transitions}\""))
            }
            ("system" | "mission", Some(name)) => (name, String::new()),
            ("check", _) => (element.span, String::new()),
            _ => continue,
        };
        text.replace_range(span.start()..span.end(), &new);
    }
    text
}

fn read_text(path: &Path, text: &str) -> Reading {
    read(path, &mut |asked| {
        if asked == path { Ok(text.as_bytes().to_vec()) } else { read_bytes(asked) }
    })
}

fn prove_mission(configuration: &Configuration) -> Findings {
    match Plan::of(configuration) {
        Ok(Some(plan)) => armor_proof::prove(configuration, &plan, &|| false),
        Ok(None) => Findings::default(),
        Err(findings) => findings,
    }
}

/// Checks `text` with another program `armor`, as a file in `folder`, which has all that the file
/// names.
///
/// # Errors
/// If the file cannot be written or the program cannot be started.
pub fn check_with_program(
    armor: &Path,
    folder: &Path,
    example: &Example,
    text: &str,
) -> Result<CheckVerdict> {
    let path = folder.join(example.file_name());
    std::fs::write(&path, text)?;
    let output = Command::new(armor).args(["check", "--format", "json"]).arg(&path).output()?;
    let printed = String::from_utf8_lossy(&output.stdout);
    let has_warnings = printed.lines().any(|line| line.contains("\"severity\":\"warning\""));
    // The next mutant may be of another example.
    std::fs::write(&path, &example.text)?;
    Ok(match (output.status.success(), has_warnings) {
        (false, _) => CheckVerdict::Refused,
        (true, true) => CheckVerdict::Warned,
        (true, false) => CheckVerdict::Passed,
    })
}
