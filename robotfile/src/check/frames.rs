//! Frames: each placed once, none in a circle; and the parameters of the format `frames`, which they
//! fill.

use std::collections::BTreeSet;

use armor_wire::manifest::ParameterManifest;
use armor_wire::text_format::TextFormat;

use crate::check::graph::CheckGraph;
use crate::check::names::{KnownNames, listed};
use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Component, Configuration, Parameter, System};
use crate::source::Spanned;
use crate::suggestion::suggest_similar;

/// The frames that move and that every robot may have (REP-105). A component publishes where they
/// are, as `FrameTransforms`; the file does not place them.
pub const MOVING_FRAMES: [&str; 3] = ["map", "odom", "base_link"];
/// The frame of the robot's base, on which sensors are mounted (REP-105).
pub const BASE_FRAME: &str = "base_link";
/// The message with which a component publishes where frames are.
const MOVING_MESSAGE: &str = "FrameTransforms";
/// Most circles that are reported.
const MAX_CIRCLES: usize = 16;

/// Checks the frames of a file by themselves.
pub(super) fn check(system: &System, findings: &mut Findings) {
    let names = system.frames.iter().map(|frame| &frame.name);
    KnownNames::collect("frame", Code::DuplicateFrame, names, findings);
    for frame in &system.frames {
        if MOVING_FRAMES.contains(&frame.name.value.as_str()) {
            let name = &frame.name.value;
            let message =
                format!("{name} moves, so it has no fixed place in {}", frame.parent.value);
            let finding = Finding::new(Code::MovingFrame, &frame.name.at, message);
            findings.push(finding.remedy(format!(
                "remove it: where {name} is, a component publishes as {MOVING_MESSAGE}"
            )));
        }
    }
    let names = system.frames.iter().map(|frame| frame.name.value.as_str());
    // Of two frames with one name, which is a finding already, the second is meant as another one.
    let mut known = BTreeSet::new();
    let edges = system
        .frames
        .iter()
        .filter(|frame| known.insert(frame.name.value.as_str()))
        .map(|frame| (frame.name.value.as_str(), frame.parent.value.as_str(), frame));
    for circle in CheckGraph::new(names, edges).find_circles(MAX_CIRCLES) {
        let [first, ..] = circle.as_slice() else { continue };
        // The name of a frame that moves is a finding already, and another one is meant.
        if circle.iter().any(|frame| MOVING_FRAMES.contains(&frame.name.value.as_str())) {
            continue;
        }
        let chain = circle.iter().map(|frame| frame.name.value.as_str());
        let chain: Vec<_> = chain.chain([first.name.value.as_str()]).collect();
        let message = format!("frames in a circle: {}", chain.join(" in "));
        let finding = Finding::new(Code::FrameCircle, &first.parent.at, message);
        findings.push(finding.remedy(format!("name another frame here, such as {BASE_FRAME}")));
    }
}

/// Reports parents that nothing provides: neither the file nor, as far as the manifests show it, a
/// component.
pub(super) fn check_parents(system: &System, manifests: &Manifests, findings: &mut Findings) {
    let kind = |component: &Component| manifests.get(&component.kind.value);
    // What a component that publishes frames calls them is not in its manifest.
    let may_publish = system.components.iter().any(|component| {
        kind(component)
            .is_none_or(|kind| kind.outputs.iter().any(|output| output.type_name == MOVING_MESSAGE))
    });
    let placed: BTreeSet<_> = system.frames.iter().map(|it| it.name.value.as_str()).collect();
    let known = || placed.iter().copied().chain(MOVING_FRAMES);
    for frame in &system.frames {
        let parent = frame.parent.value.as_str();
        if known().any(|name| name == parent) {
            continue;
        }
        let others = known().filter(|name| *name != frame.name.value);
        let guess = suggest_similar(parent, others);
        if may_publish && guess.is_none() {
            continue;
        }
        let message = format!("nothing provides the frame {}", short(parent));
        let remedy = guess.unwrap_or_else(|| {
            format!("place it with a <frame> too, or name one of {}", listed(known()))
        });
        findings.push(Finding::new(Code::UnknownParent, &frame.parent.at, message).remedy(remedy));
    }
}

/// Returns whether the check fills the parameter with the frames of the file.
pub(super) fn is_filled(parameter: &ParameterManifest) -> bool {
    parameter.format == Some(TextFormat::Frames)
}

/// Gives the frames of the file to every component whose kind has a parameter for them, as if the file
/// assigned it: where the first frame is.
pub(super) fn fill_frames(configuration: &mut Configuration, manifests: &Manifests) {
    let system = &mut configuration.system;
    let Some(first) = system.frames.first() else { return };
    let frames: Vec<_> = system.frames.iter().map(|frame| frame.fixed.to_string()).collect();
    let value = Spanned::new(frames.join(" "), first.name.at.clone());
    let folder = first.name.at.source.folder();
    for component in &mut system.components {
        let Some(kind) = manifests.get(&component.kind.value) else { continue };
        for parameter in kind.parameters.iter().filter(|parameter| is_filled(parameter)) {
            component.parameters.retain(|given| given.name.value != parameter.name);
            let name = Spanned::new(parameter.name.clone(), first.name.at.clone());
            let (value, folder) = (value.clone(), folder.clone());
            component.parameters.push(Parameter { name, value, folder });
        }
    }
}
