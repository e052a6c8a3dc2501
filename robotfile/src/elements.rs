//! The elements of the format: what each may contain, and which of them a misspelt name means. An
//! element with a misspelt name is read as the one that is meant, so that what it declares is not
//! missing as well.

use std::sync::Arc;

use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::source::{Source, Span};
use crate::suggestion::suggest_similar;
use crate::tree::{Element, Node};

/// The elements that `<mission>` may contain.
pub(crate) const MISSION_CHILDREN: &[&str] = &[
    "map",
    "route",
    "variable",
    "place",
    "exclusive",
    "transition",
    "check",
    "submission",
    "layout",
];
/// The elements that `<map>` may contain.
pub(crate) const MAP_CHILDREN: &[&str] = &["point", "zone", "line", "rally", "symbol"];
/// The elements that `<route>` may contain.
pub(crate) const ROUTE_CHILDREN: &[&str] = &["leg", "stay", "meet", "otherwise"];
/// The elements that an element may contain; a `<layout>` may contain anything.
const CHILDREN: [(&str, &[&str]); 9] = [
    ("armor", &["system", "mission"]),
    ("system", &["clock", "host", "frame", "component", "link", "layout"]),
    ("mission", MISSION_CHILDREN),
    ("map", MAP_CHILDREN),
    ("route", ROUTE_CHILDREN),
    ("component", &["parameter"]),
    ("place", &["parameter"]),
    ("transition", &["arc", "read", "inhibitor", "reset", "set"]),
    ("layout", &["block", "note", "group"]),
];

/// What other formats call an element.
const OTHER_NAMES: [(&str, &[&str]); 22] = [
    ("link", &["connect", "connection", "channel", "wire", "topic", "remap", "edge"]),
    ("component", &["node", "process", "module"]),
    ("host", &["machine", "computer"]),
    ("frame", &["transform", "tf"]),
    ("clock", &["time"]),
    ("parameter", &["argument", "arg", "property", "setting", "option"]),
    ("place", &["state", "step", "phase"]),
    ("transition", &["edge", "event"]),
    ("variable", &["counter", "signal"]),
    ("check", &["assert", "assertion", "claim", "cheque", "property", "invariant"]),
    ("exclusive", &["mutex", "exclude", "exclusion"]),
    ("submission", &["include", "subnet", "import"]),
    ("set", &["assign", "assignment", "let"]),
    ("read", &["test"]),
    ("reset", &["clear", "flush"]),
    ("mission", &["task", "plan"]),
    ("leg", &["waypoint", "goto", "drive"]),
    ("stay", &["loiter", "wait"]),
    ("otherwise", &["else", "exit", "failsafe"]),
    ("zone", &["fence", "geofence", "area", "polygon"]),
    ("rally", &["safepoint"]),
    ("line", &["polyline"]),
];

/// What other formats call an attribute of an element, where this one has another name.
const OTHER_ATTRIBUTES: [(&str, &str, &[&str]); 21] = [
    ("component", "rate", &["frequency", "hz", "period"]),
    ("component", "kind", &["type", "class", "exec", "executable", "pkg"]),
    ("component", "name", &["id"]),
    ("link", "from", &["source", "src", "output", "publisher", "start"]),
    ("link", "to", &["target", "destination", "dest", "sink", "input", "subscriber", "end"]),
    ("link", "keep", &["queue", "depth", "buffer", "size"]),
    ("parameter", "name", &["id", "key"]),
    ("parameter", "value", &["default"]),
    ("place", "name", &["id"]),
    ("place", "initial", &["start", "tokens", "marked"]),
    ("place", "components", &["activates", "active", "nodes", "runs"]),
    ("transition", "name", &["id"]),
    ("transition", "from", &["source", "in"]),
    ("transition", "to", &["target", "destination", "out"]),
    ("transition", "on", &["event", "trigger", "report"]),
    ("transition", "when", &["guard", "if", "condition", "where"]),
    ("transition", "after", &["delay", "wait"]),
    ("submission", "ref", &["file", "src", "path", "href"]),
    ("submission", "in", &["from", "enter", "entry"]),
    ("submission", "out", &["to", "leave", "exit"]),
    ("variable", "source", &["data", "topic", "from"]),
];

/// Returns the elements that an element may contain; none if any may be in it.
pub(crate) fn children_of(parent: &str) -> Option<&'static [&'static str]> {
    let found = CHILDREN.iter().find(|(name, _)| *name == parent && *name != "layout");
    found.map(|(_, children)| *children)
}

/// Returns whether an element may directly contain another one.
pub(crate) fn may_contain(parent: &str, child: &str) -> bool {
    children_of(parent).is_some_and(|children| children.contains(&child))
}

/// Returns where an element of this name belongs; none if the format has none.
pub(crate) fn find_parent(name: &str) -> Option<&'static str> {
    let (parent, _) = CHILDREN.iter().find(|(_, children)| children.contains(&name))?;
    Some(match (*parent, name) {
        (_, "parameter") => "a <component> or <place>",
        (_, "layout") => "<system> or <mission>",
        ("system", _) => "<system>",
        ("mission", _) => "<mission>",
        ("transition", _) => "a <transition>",
        ("map", _) => "<map>",
        ("route", _) => "a <route>",
        ("layout", _) => "<layout>",
        _ => "<armor>",
    })
}

/// Returns the element of `allowed` that an unknown name means: by a typing mistake, an abbreviation,
/// or the word of another format, which may be misspelt too.
pub(crate) fn find_meant(name: &str, allowed: &[&'static str]) -> Option<&'static str> {
    let name = name.to_ascii_lowercase();
    let means =
        |wanted: &&&'static str| suggest_similar(&name, std::iter::once(**wanted)).is_some();
    // Of two that are similar, the one that is suggested.
    let suggested = suggest_similar(&name, allowed.iter().copied());
    let is_suggested = |wanted: &&&'static str| {
        suggested.as_ref().is_some_and(|it| it.contains(&format!(" {wanted}?")))
    };
    if let Some(similar) = allowed.iter().filter(means).find(is_suggested) {
        return Some(similar);
    }
    let named = OTHER_NAMES.iter().filter(|(wanted, _)| allowed.contains(wanted));
    let exact = named.clone().find(|(_, others)| others.contains(&name.as_str()));
    let near = |(_, others): &&(&str, &[&str])| {
        let long = others.iter().copied().filter(|other| other.len() > MIN_MISSPELT_LEN);
        suggest_similar(&name, long).is_some()
    };
    exact.or_else(|| named.clone().find(near)).map(|(wanted, _)| *wanted)
}

/// Shorter words of other formats are recognized only as they are: too many words resemble them.
const MIN_MISSPELT_LEN: usize = 5;

/// Returns whether the end tag `end` belongs to a start tag with the misspelt name `start`, or the
/// reverse.
pub(crate) fn are_one_name(start: &str, end: &str) -> bool {
    let meant = |written: &str, wanted: &str| {
        let known = CHILDREN.iter().flat_map(|(_, children)| *children);
        let known = known.filter(|it| **it == wanted).copied().next();
        known.is_some_and(|wanted| find_meant(written, &[wanted]).is_some())
    };
    suggest_similar(start, std::iter::once(end)).is_some() || meant(start, end) || meant(end, start)
}

/// Returns the attribute of an element that has another name in other formats.
pub(crate) fn find_meant_attribute(element: &str, name: &str) -> Option<&'static str> {
    let name = name.to_ascii_lowercase();
    let mut known = OTHER_ATTRIBUTES.iter().filter(|(of, ..)| *of == element);
    known.find(|(.., others)| others.contains(&name.as_str())).map(|(_, wanted, _)| *wanted)
}

/// Reports an element that another one does not contain.
pub(crate) fn report_unknown_element(
    child: &Element,
    parent: &str,
    allowed: &[&'static str],
    source: &Arc<Source>,
) -> Finding {
    let message = format!("<{}> is not an element of <{parent}>", short(&child.name));
    let remedy = match find_parent(&child.name) {
        Some(parent) => {
            format!("write it directly in {parent}: is an end tag missing or misplaced?")
        }
        None => match (find_meant(&child.name, allowed), allowed) {
            (Some(meant), _) => format!("did you mean {meant}?"),
            (None, []) => "it may contain no elements".into(),
            (None, _) => format!("known elements: {}", allowed.join(", ")),
        },
    };
    Finding::new(Code::UnknownElement, &child.at(source), message).remedy(remedy)
}

/// Returns the tree with the names that the elements probably mean, and the start tags of those that
/// are misspelt, each of which is a finding; none if there are none.
pub(crate) fn correct_names(
    root: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<(Element, Vec<Span>)> {
    let mut corrected = root.clone();
    let mut tags = Vec::new();
    correct_children(&mut corrected, source, &mut tags, findings);
    (!tags.is_empty()).then_some((corrected, tags))
}

/// Recursion is bounded by the tree's depth.
fn correct_children(
    parent: &mut Element,
    source: &Arc<Source>,
    tags: &mut Vec<Span>,
    findings: &mut Findings,
) {
    let Some(allowed) = children_of(&parent.name) else { return };
    let has = |parent: &Element, name: &str| parent.elements().any(|it| it.name == name);
    for number in 0..parent.children.len() {
        let Some(Node::Element(child)) = parent.children.get(number) else { continue };
        let is_unknown = !allowed.contains(&child.name.as_str())
            && !child.name.contains(':')
            && find_parent(&child.name).is_none();
        let meant = is_unknown.then(|| find_meant(&child.name, allowed)).flatten();
        // Of these there is one at most: a second one may be anything.
        let is_second = |meant: &&str| {
            matches!(*meant, "system" | "mission" | "clock" | "layout" | "map")
                && has(parent, meant)
        };
        if let Some(meant) = meant.filter(|meant| !is_second(meant)) {
            findings.push(report_unknown_element(child, &parent.name, allowed, source));
            tags.push(child.tag_span);
            if let Some(Node::Element(child)) = parent.children.get_mut(number) {
                meant.clone_into(&mut child.name);
            }
        }
        if let Some(Node::Element(child)) = parent.children.get_mut(number) {
            correct_children(child, source, tags, findings);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_another_format_is_recognized() {
        let of_system = children_of("system").expect("children");
        let of_mission = children_of("mission").expect("children");
        for (name, allowed, expected) in [
            ("connect", of_system, Some("link")),
            ("conect", of_system, Some("link")),
            ("Node", of_system, Some("component")),
            ("componnet", of_system, Some("component")),
            ("var", of_mission, Some("variable")),
            ("cheque", of_mission, Some("check")),
            ("state", of_mission, Some("place")),
            ("zebra", of_mission, None),
            ("zebra", of_system, None),
        ] {
            assert_eq!(find_meant(name, allowed), expected, "{name}");
        }
        assert_eq!(find_meant_attribute("component", "frequency"), Some("rate"));
        assert_eq!(find_meant_attribute("place", "frequency"), None);
    }

    #[test]
    fn each_other_name_means_an_element_and_is_none_itself() {
        for (wanted, others) in OTHER_NAMES {
            assert!(find_parent(wanted).is_some(), "{wanted}");
            others.iter().for_each(|other| assert_eq!(find_parent(other), None, "{other}"));
        }
        for (element, ..) in OTHER_ATTRIBUTES {
            assert!(find_parent(element).is_some(), "{element}");
        }
    }
}
