//! `<mission>` → [`Mission`].

use std::sync::Arc as Shared;

use armor_wire::name::is_name;

use crate::code::Code;
use crate::elements::MISSION_CHILDREN;
use crate::fields::{ElementFields, digits};
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{
    Class, Exclusive, Mission, Place, PlaceParameter, Resume, Submission, Variable,
};
use crate::read::layout;
use crate::read::limits::{MAX_ELEMENTS, MAX_ROUTES, add_limited};
use crate::read::system::assignment;
use crate::read::{route, site_map, transition};
use crate::route::add_nets;
use crate::source::{Location, Source, Spanned, plain_path};
use crate::tree::Element;
use crate::unreadable::UnreadableParts;

pub(super) fn read(element: &Element, source: &Shared<Source>, findings: &mut Findings) -> Mission {
    let mut fields = ElementFields::new(element, source, findings);
    let mut mission = Mission {
        name: fields.name("name"),
        system: fields.text("system"),
        goal: fields.name("goal"),
        safe: fields.name("safe"),
        resume: fields.choice(
            "resume",
            &[("continue", Resume::Continue), ("hold", Resume::Hold), ("safe", Resume::Safe)],
        ),
        period: fields.longer_than_nothing("period"),
        variables: Vec::new(),
        places: Vec::new(),
        exclusives: Vec::new(),
        transitions: Vec::new(),
        submissions: Vec::new(),
        map: None,
        routes: Vec::new(),
        checks: Vec::new(),
        at: fields.at(),
        layout: Vec::new(),
        unreadable: UnreadableParts::default(),
    };
    for child in fields.finish(MISSION_CHILDREN) {
        read_child(&mut mission, child, source, findings);
    }
    add_nets(&mut mission, findings);
    for child in element.elements() {
        // An unknown element with a name may be a place under another noun, such as <state>.
        let is_unknown = !MISSION_CHILDREN.contains(&child.name.as_str())
            && !child.name.contains(':')
            && child.attribute("name").is_some();
        if is_unknown {
            mission.unreadable.add_element(child);
            (mission.unreadable.in_start, mission.unreadable.in_moves) = (true, true);
        }
    }
    mission
}

fn read_child(
    mission: &mut Mission,
    child: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) {
    /// Reads the child and adds it to its list.
    macro_rules! into {
        ($list:ident, $read:expr) => {
            if let Some(item) = $read {
                add_limited(&mut mission.$list, item, MAX_ELEMENTS, &child.at(source), findings);
            }
        };
    }
    match child.name.as_str() {
        "map" => read_map(mission, child, source, findings),
        "route" => {
            let before = findings.total();
            let read = route::read(child, source, findings);
            // A step that could not be read may lead to any place, and activate any component.
            mission.unreadable.in_start |= findings.total() > before;
            mission.unreadable.in_moves |= findings.total() > before;
            if let Some(read) = read {
                add_limited(&mut mission.routes, read, MAX_ROUTES, &child.at(source), findings);
            }
        }
        "variable" => into!(variables, read_variable(child, source, findings)),
        "place" => {
            let before = findings.total();
            let read = read_place(child, source, findings);
            let unreadable = &mut mission.unreadable;
            unreadable.add_if_misnamed(child, read.as_ref().map(|place| place.name.value.as_str()));
            unreadable.in_start |= findings.total() > before;
            unreadable.in_moves |= findings.total() > before;
            into!(places, read);
        }
        "exclusive" => into!(exclusives, read_exclusive(child, source, findings)),
        "transition" => {
            let before = findings.total();
            let mut read = transition::read(child, source, findings);
            let is_doubtful = findings.total() > before;
            mission.unreadable.in_moves |= is_doubtful;
            read.iter_mut().for_each(|transition| transition.is_doubtful = is_doubtful);
            into!(transitions, read);
        }
        "check" => into!(checks, read_check(child, source, findings)),
        "submission" => {
            let read = read_submission(child, source, findings);
            // The components of its places are not known.
            mission.unreadable.in_start |= read.is_none();
            into!(submissions, read);
        }
        _ => layout::read(child, source, &mut mission.layout),
    }
}

/// A mission has one map; a further one is a finding.
fn read_map(
    mission: &mut Mission,
    child: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) {
    let before = findings.total();
    let map = site_map::read(child, source, findings);
    let in_map = findings.total() > before;
    mission.unreadable.in_map |= in_map;
    match &mission.map {
        None => mission.map = Some(map),
        Some(first) => {
            let finding = Finding::new(Code::DuplicateElement, &map.at, "<map> occurs twice");
            findings.push(finding.remedy("keep one of them").related(&first.at, "first here"));
        }
    }
}

fn read_variable(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<Variable> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let data = fields.text("source");
    let (minimum, maximum) = (fields.quantity("min"), fields.quantity("max"));
    let initial = fields.converted("initial", whole_number);
    if let (Some(low), Some(high)) = (&minimum, &maximum)
        && low.value > high.value
    {
        fields.bad_value("max", high, "max must not be below min".into());
    }
    if data.is_none() {
        read_counted(&mut fields, name.as_ref(), [&minimum, &maximum], initial.as_ref());
    } else {
        fields.without_effect("initial", "its value is always that of the data: remove it");
    }
    fields.finish(&[]);
    Some(Variable { name: name?, source: data, minimum, maximum, initial })
}

/// A variable that transitions set counts from one whole number to another.
fn read_counted(
    fields: &mut ElementFields<'_, '_>,
    variable: Option<&Spanned<String>>,
    ends: [&Option<Spanned<f64>>; 2],
    initial: Option<&Spanned<i64>>,
) {
    let missing = ["min", "max"].into_iter().find(|name| fields.attribute_at(name).is_none());
    // One that is misspelt, or that was to be the source, is a finding already.
    if let (Some(name), Some(variable), false) = (missing, variable, fields.has_strangers()) {
        let message = format!("{} follows no data, and has no {name}", variable.value);
        let finding = Finding::new(Code::NotSettable, &variable.at, message);
        fields.report(finding.remedy(
            "write min=\"…\" max=\"…\", whole numbers: transitions set it between them; or let it \
             follow data with source=\"…\"",
        ));
    }
    for (name, end) in ["min", "max"].into_iter().zip(ends) {
        let Some(end) = end else { continue };
        let is_bare = whole_number(end.at.text()).is_ok();
        if !is_bare {
            let expected = "a variable without a source counts whole numbers without unit";
            fields.bad_value(name, end, expected.into());
        }
    }
    let [Some(low), Some(high)] = ends else { return };
    if let Some(initial) = initial
        && low.value <= high.value
        && !(low.value..=high.value).contains(&(initial.value as f64))
    {
        let expected = format!(
            "write a value from {} to {}, or widen min=\"…\" and max=\"…\"",
            low.at.text(),
            high.at.text()
        );
        fields.bad_value("initial", initial, expected);
    }
}

/// As a variable counts: at most nine digits.
fn whole_number(text: &str) -> Result<i64, String> {
    digits(text.strip_prefix('-').unwrap_or(text))
        .and_then(|_| text.parse().ok())
        .ok_or_else(|| "a whole number from -999999999 to 999999999 is expected".into())
}

fn read_place(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<Place> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let initial = fields.word_or("initial", &["true", "false"], parse_tokens);
    let components = fields.names("components");
    let class = class(&mut fields);
    let on_failure = fields.name("on-failure");
    report_default_class(&mut fields);
    let children = fields.finish(&["parameter"]);
    let parameters =
        children.iter().filter_map(|child| read_parameter(child, source, findings)).collect();
    Some(Place {
        name: name?,
        initial: initial.map_or(0, |initial| initial.value),
        components,
        class,
        on_failure,
        parameters,
    })
}

/// `true` is one token; a number is that many.
fn parse_tokens(text: &str) -> Result<u32, String> {
    match text {
        "true" => Ok(1),
        "false" => Ok(0),
        number => digits(number)
            .and_then(|digits| digits.parse().ok())
            .ok_or_else(|| "true, false or a number of tokens up to 999999999 is expected".into()),
    }
}

/// Reports a class that is written and that the element has without it.
pub(super) fn report_default_class(fields: &mut ElementFields<'_, '_>) {
    if fields.has_value("class", "normal") {
        fields.without_effect(
            "class",
            "it is normal without this attribute: remove it, or was class=\"safety\" meant?",
        );
    }
}

pub(super) fn class(fields: &mut ElementFields<'_, '_>) -> Class {
    let class = fields.choice("class", &[("normal", Class::Normal), ("safety", Class::Safety)]);
    class.map(|class| class.value).unwrap_or_default()
}

fn read_parameter(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<PlaceParameter> {
    if let Some(finding) = find_dotted(element, source) {
        findings.push(finding);
        return None;
    }
    let mut fields = ElementFields::new(element, source, findings);
    let component = fields.required_name("component");
    let parameter = assignment(&mut fields, source);
    fields.finish(&[]);
    Some(PlaceParameter { component: component?, parameter: parameter? })
}

/// Returns the finding for a parameter whose component is written before its name, with a dot.
fn find_dotted(element: &Element, source: &Shared<Source>) -> Option<Finding> {
    let name = element.attribute("name").filter(|_| element.attribute("component").is_none())?;
    let (component, parameter) = name.value.split_once('.')?;
    if !is_name(component) || !is_name(parameter) {
        return None;
    }
    let at = Location::new(source, name.value_span);
    let finding = Finding::new(Code::BadName, &at, format!("`{}` is not a name", name.value));
    Some(finding.remedy(format!("write component=\"{component}\" name=\"{parameter}\"")))
}

fn read_exclusive(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<Exclusive> {
    let mut fields = ElementFields::new(element, source, findings);
    let at = fields.at();
    let given = fields.required("components").is_some();
    let components = fields.names("components");
    fields.finish(&[]);
    given.then_some(Exclusive { components, at })
}

fn read_check(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<Spanned<String>> {
    let at = element.at(source);
    let (text, span) = element.text();
    let fields = ElementFields::new(element, source, findings);
    // A statement in an attribute is a finding already.
    let is_misplaced = text.is_empty() && fields.has_strangers();
    fields.finish_text();
    if is_misplaced {
        return None;
    }
    if text.is_empty() {
        let finding = Finding::new(Code::BadValue, &at, "this check is empty");
        findings.push(finding.remedy("write a statement, such as always reachable(home)"));
        return None;
    }
    let Some(at) = span.map(|span| Location::new(source, span)) else {
        return Some(Spanned::new(text, at));
    };
    let raw = at.text();
    let (start, end) = (raw.len() - raw.trim_start().len(), raw.trim_end().len());
    Some(Spanned::new(text, at.part(start, end)))
}

fn read_submission(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<Submission> {
    let mut fields = ElementFields::new(element, source, findings);
    let file = fields.required("ref");
    let (enter, leave) = (fields.name("in"), fields.name("out"));
    fields.finish(&[]);
    let file = file?;
    let path = plain_path(&source.folder().join(&file.value));
    Some(Submission { file, path, enter, leave })
}
