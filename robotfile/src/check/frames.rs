//! Frames: each placed once, none in a circle, those that components need placed on the robot; and
//! the parameters of the format `frames`, which they fill.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, ParameterManifest, PortFrame};
use armor_wire::name::is_name;
use armor_wire::text_format::TextFormat;

use crate::check::graph::CheckGraph;
use crate::check::names::{KnownNames, listed};
use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Component, Configuration, Parameter, PlacedFrame, System};
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
    let edges = system
        .frames
        .iter()
        .map(|frame| (frame.name.value.as_str(), frame.parent.value.as_str(), frame));
    for circle in CheckGraph::new(names, edges).find_circles(MAX_CIRCLES) {
        let [first, ..] = circle.as_slice() else { continue };
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

/// Reports the frames that components need and that are not placed on the robot's base.
pub(super) fn check_needed(
    configuration: &Configuration,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let system = &configuration.system;
    for component in &system.components {
        let Some(kind) = kinds.get(component.name.value.as_str()) else { continue };
        let mut reported = BTreeSet::new();
        for need in kind.frames.iter().filter(|need| is_linked(system, component, need)) {
            for name in named_frames(configuration, component, kind, need) {
                if reported.insert(name.value.clone()) {
                    check_placed(system, component, need, &name, findings);
                }
            }
        }
    }
}

fn is_linked(system: &System, component: &Component, need: &PortFrame) -> bool {
    system
        .links
        .iter()
        .flat_map(|link| [&link.from, &link.to])
        .any(|port| port.component.value == component.name.value && port.port.value == need.port)
}

/// The frames that a parameter names: in the system, or by default, and in the places of missions. The
/// location is that of the value, or of the component's name where the default applies.
fn named_frames(
    configuration: &Configuration,
    component: &Component,
    kind: &Manifest,
    need: &PortFrame,
) -> Vec<Spanned<String>> {
    let default = || {
        let declared = kind.parameters.iter().find(|it| it.name == need.parameter)?;
        Some(Spanned::new(declared.default.clone()?, component.name.at.clone()))
    };
    let own = component.parameter(&need.parameter).map(|given| given.value.clone());
    let places = configuration.missions().flat_map(|mission| &mission.places);
    let in_places = places.flat_map(|place| &place.parameters).filter(|given| {
        given.component.value == component.name.value
            && given.parameter.name.value == need.parameter
    });
    let in_places = in_places.map(|given| given.parameter.value.clone());
    own.or_else(default).into_iter().chain(in_places).collect()
}

/// Reports a frame that does not lead to the robot's base through frames of the file.
fn check_placed(
    system: &System,
    component: &Component,
    need: &PortFrame,
    name: &Spanned<String>,
    findings: &mut Findings,
) {
    let (who, frame) = (&component.name.value, name.value.as_str());
    // A malformed name is a finding already.
    if frame == BASE_FRAME || !is_name(frame) || system.unreadable.may_contain(frame) {
        return;
    }
    let by_name: BTreeMap<_, _> =
        system.frames.iter().map(|frame| (frame.name.value.as_str(), frame)).collect();
    let example = format!("<frame name=\"{frame}\" in=\"{BASE_FRAME}\" x=\"0m\" z=\"0m\"/>");
    let Some(placed) = by_name.get(frame) else {
        let message = format!(
            "{who} needs the frame {frame} for {}, and the file does not place it",
            need.port
        );
        let known = by_name.keys().copied();
        let remedy = match suggest_similar(frame, known.clone()) {
            Some(guess) => format!("{guess} Otherwise add {example} to the system"),
            None => format!(
                "add {example} to the system, with its measures, or name another frame with the \
                 parameter {}",
                need.parameter
            ),
        };
        return findings.push(Finding::new(Code::FrameMissing, &name.at, message).remedy(remedy));
    };
    // A circle is a finding of its own; no chain is longer than the list.
    let (mut last, mut steps): (&PlacedFrame, _) = (placed, 0);
    while let Some(next) = by_name.get(last.parent.value.as_str()) {
        (last, steps) = (next, steps + 1);
        if steps > system.frames.len() {
            return;
        }
    }
    if last.parent.value != BASE_FRAME {
        let message = format!(
            "{who} needs the frame {frame} for {}, and it is placed in {}, not on the robot",
            need.port, last.parent.value
        );
        let finding = Finding::new(Code::FrameMissing, &name.at, message);
        findings.push(
            finding
                .remedy(format!("place it, or {}, in {BASE_FRAME}", last.parent.value))
                .related(&placed.name.at, "placed here"),
        );
    }
}

/// Returns whether the check fills the parameter with the frames of the file.
pub(super) fn is_filled(parameter: &ParameterManifest) -> bool {
    parameter.format == Some(TextFormat::Frames)
}

/// Gives the frames of the file to every component whose kind has a parameter for them, as if the file
/// assigned it: where the first frame is. [`check`](crate::check()) does it; a caller does it for a
/// configuration that is not checked.
pub fn fill_frames(configuration: &mut Configuration, manifests: &Manifests) {
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
