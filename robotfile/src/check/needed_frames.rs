//! The frames that components need: each placed on the robot's base. One frame that is missing or
//! misplaced is one finding, however many components need it.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, PortFrame};
use armor_wire::name::is_name;

use crate::check::frames::{BASE_FRAME, MOVING_FRAMES};
use crate::check::names::joined;
use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::model::{Component, Configuration, PlacedFrame, System};
use crate::source::{Location, Spanned};
use crate::suggestion::suggest_similar;

/// A frame and the components that need it.
#[derive(Default)]
struct NeededFrame<'a> {
    /// The components with the data that are taken in the frame, each once.
    needs: Vec<(&'a Component, &'a PortFrame)>,
    /// Where each of them names it: the value of a parameter, or the component's name where the
    /// default applies.
    at: Vec<Location>,
    /// Whether a value in the file names it.
    is_given: bool,
}

/// Reports the frames that components need and that are not placed on the robot's base.
pub(super) fn check(
    configuration: &Configuration,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let system = &configuration.system;
    let needed = find_needed(configuration, kinds);
    let placed: BTreeMap<_, _> =
        system.frames.iter().map(|frame| (frame.name.value.as_str(), frame)).collect();
    // By the name of the frame that is missing: one that a component needs, or in which another is.
    let mut missing: BTreeMap<String, Vec<Finding>> = BTreeMap::new();
    for (name, frame) in &needed {
        match placed.get(name.as_str()) {
            Some(it) => {
                let Some((parent, finding)) = find_misplaced(it, frame, &placed, system) else {
                    continue;
                };
                let is_moving = MOVING_FRAMES.contains(&parent.as_str());
                match is_moving {
                    true => findings.push(finding),
                    false => missing.entry(parent).or_default().push(finding),
                }
            }
            None => {
                let finding = find_missing(name, frame, &placed, &needed);
                missing.entry(name.clone()).or_default().push(finding);
            }
        }
    }
    // As many frames may be missing as are placed twice, or have the name of one that moves.
    let is_renamed = |it: &Finding| matches!(it.code, Code::DuplicateFrame | Code::MovingFrame);
    let renamed = findings.iter().filter(|it| is_renamed(it)).count();
    if missing.len() > renamed {
        findings.extend(missing.into_values().flatten());
    } else if let (Some(name), 1) = (missing.keys().next(), renamed)
        && missing.len() == 1
    {
        for finding in findings.iter_mut().filter(|it| is_renamed(it)) {
            let which = if finding.code == Code::DuplicateFrame { " for one of them" } else { "" };
            finding.remedy = format!("did you mean {name}{which}? Otherwise {}", finding.remedy);
        }
    }
}

/// The needed frames by name, apart from the base and those with a malformed name, which is a finding
/// already.
fn find_needed<'a>(
    configuration: &'a Configuration,
    kinds: &BTreeMap<&str, &'a Manifest>,
) -> BTreeMap<String, NeededFrame<'a>> {
    let system = &configuration.system;
    let mut needed: BTreeMap<String, NeededFrame<'_>> = BTreeMap::new();
    for component in &system.components {
        let Some(kind) = kinds.get(component.name.value.as_str()) else { continue };
        for need in kind.frames.iter().filter(|need| is_linked(system, component, need)) {
            // The value that is meant has another name, which is a finding already.
            if is_misspelt(component, kind, &need.parameter) {
                continue;
            }
            for (name, is_given) in named_frames(configuration, component, kind, need) {
                let frame = name.value.as_str();
                let may_be_read = is_name(frame) && !system.unreadable.may_contain(frame);
                if frame == BASE_FRAME || !may_be_read {
                    continue;
                }
                let frame = needed.entry(name.value).or_default();
                frame.is_given |= is_given;
                if !frame.needs.iter().any(|(it, _)| it.name.value == component.name.value) {
                    frame.needs.push((component, need));
                    frame.at.push(name.at);
                }
            }
        }
    }
    needed
}

/// Whether a parameter has no value, and an unknown name resembles its own.
fn is_misspelt(component: &Component, kind: &Manifest, parameter: &str) -> bool {
    let names = component.parameters.iter().map(|it| it.name.value.as_str());
    let mut unknown = names.filter(|name| !kind.parameters.iter().any(|it| it.name == *name));
    component.parameter(parameter).is_none()
        && unknown.any(|name| suggest_similar(name, std::iter::once(parameter)).is_some())
}

fn is_linked(system: &System, component: &Component, need: &PortFrame) -> bool {
    system
        .links
        .iter()
        .flat_map(|link| [&link.from, &link.to])
        .any(|port| port.component.value == component.name.value && port.port.value == need.port)
}

/// The frames that a parameter names, in the system, or by default, and in the places of missions; and
/// whether the file gives the name.
fn named_frames(
    configuration: &Configuration,
    component: &Component,
    kind: &Manifest,
    need: &PortFrame,
) -> Vec<(Spanned<String>, bool)> {
    let default = || {
        let declared = kind.parameters.iter().find(|it| it.name == need.parameter)?;
        Some((Spanned::new(declared.default.clone()?, component.name.at.clone()), false))
    };
    let own = component.parameter(&need.parameter).map(|given| (given.value.clone(), true));
    let places = configuration.missions().flat_map(|mission| &mission.places);
    let in_places = places.flat_map(|place| &place.parameters).filter(|given| {
        given.component.value == component.name.value
            && given.parameter.name.value == need.parameter
    });
    let in_places = in_places.map(|given| (given.parameter.value.clone(), true));
    own.or_else(default).into_iter().chain(in_places).collect()
}

impl NeededFrame<'_> {
    /// `mapper needs the frame laser for scan`, `base, mapper and driver need the frame laser`.
    fn describe(&self, frame: &str) -> String {
        let names = joined(self.needs.iter().map(|(component, _)| component.name.value.as_str()));
        match self.needs.as_slice() {
            [(_, need)] => format!("{names} needs the frame {frame} for {}", need.port),
            _ => format!("{names} need the frame {frame}"),
        }
    }
}

/// The finding for a frame that the file does not place: at a frame that was probably meant, or else at
/// the first component that needs it.
fn find_missing(
    name: &str,
    frame: &NeededFrame<'_>,
    placed: &BTreeMap<&str, &PlacedFrame>,
    needed: &BTreeMap<String, NeededFrame<'_>>,
) -> Finding {
    let message = format!("{}, and the file does not place it", frame.describe(name));
    let example = format!("<frame name=\"{name}\" in=\"{BASE_FRAME}\" x=\"0m\" z=\"0m\"/>");
    // A frame under a name that nothing needs, and that no other frame is in.
    let is_free = |it: &&PlacedFrame| {
        let free = it.name.value.as_str();
        !needed.contains_key(free) && !placed.values().any(|other| other.parent.value == free)
    };
    let is_similar = |it: &&&PlacedFrame| {
        suggest_similar(name, std::iter::once(it.name.value.as_str())).is_some()
    };
    let mut similar = placed.values().filter(|it| is_free(it)).filter(is_similar);
    if let (Some(meant), None, false) = (similar.next(), similar.next(), frame.is_given) {
        let finding = Finding::new(Code::FrameMissing, &meant.name.at, message)
            .remedy(format!("did you mean {name}? Otherwise add {example} to the system"));
        return frame.at.iter().fold(finding, |it, at| it.related(at, "needed here"));
    }
    let (first, others) = (&frame.at[..1], &frame.at[1..]);
    let remedy = match suggest_similar(name, placed.keys().copied()) {
        Some(guess) => format!("{guess} Otherwise add {example} to the system"),
        None => {
            let parameters: BTreeSet<_> =
                frame.needs.iter().map(|(_, need)| need.parameter.as_str()).collect();
            format!(
                "add {example} to the system, with its measures, or name another frame with the \
                 parameter {}",
                parameters.into_iter().collect::<Vec<_>>().join(" or ")
            )
        }
    };
    let finding = Finding::new(Code::FrameMissing, &first[0], message).remedy(remedy);
    others.iter().fold(finding, |it, at| it.related(at, "needed here too"))
}

/// The finding for a frame that does not lead to the robot's base through frames of the file, at the
/// `in` of the last of them, and what this names.
fn find_misplaced(
    placed: &PlacedFrame,
    frame: &NeededFrame<'_>,
    by_name: &BTreeMap<&str, &PlacedFrame>,
    system: &System,
) -> Option<(String, Finding)> {
    // A circle is a finding of its own; no chain is longer than the list.
    let (mut last, mut steps): (&PlacedFrame, _) = (placed, 0);
    while let Some(next) = by_name.get(last.parent.value.as_str()) {
        (last, steps) = (next, steps + 1);
        if steps > system.frames.len() {
            return None;
        }
    }
    let (name, parent) = (placed.name.value.as_str(), last.parent.value.as_str());
    if parent == BASE_FRAME || !is_name(parent) || system.unreadable.may_contain(parent) {
        return None;
    }
    let is_moving = MOVING_FRAMES.contains(&parent);
    let message = match is_moving {
        true => format!("{}, and it is placed in {parent}, not on the robot", frame.describe(name)),
        false => format!(
            "{}, and it is placed in {}, which the file does not place",
            frame.describe(name),
            short(parent)
        ),
    };
    let others = by_name.keys().copied().filter(|it| *it != last.name.value && *it != name);
    let guess = suggest_similar(parent, others.chain([BASE_FRAME])).filter(|_| !is_moving);
    let remedy = guess.unwrap_or_else(|| match is_moving {
        true => format!("write in=\"{BASE_FRAME}\", or another frame on the robot"),
        false => format!(
            "add <frame name=\"{parent}\" in=\"{BASE_FRAME}\" x=\"0m\" z=\"0m\"/> to the system, \
             with its measures, or place {} in {BASE_FRAME}",
            last.name.value
        ),
    });
    let finding = Finding::new(Code::FrameMissing, &last.parent.at, message).remedy(remedy);
    let finding = frame.at.iter().fold(finding, |it, at| it.related(at, "needed here"));
    Some((parent.to_owned(), finding))
}
