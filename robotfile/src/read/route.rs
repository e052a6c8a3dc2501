//! `<route>` → [`DrawnRoute`].

use std::sync::Arc;

use armor_geo::Clearance;
use armor_wire::quantity::{self, Dimension};

use crate::code::Code;
use crate::drawn_route::{
    DrawnLeg, DrawnMeet, DrawnRoute, DrawnStay, ExitAction, ExitCause, RouteExit, RoutePort,
    RouteStep, USUAL_TOLERANCE,
};
use crate::elements::ROUTE_CHILDREN;
use crate::fields::ElementFields;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::model::Port;
use crate::read::limits::{MAX_ROUTE_EXITS, MAX_ROUTE_STEPS, add_limited};
use crate::read::site_map::read_clearance;
use crate::source::{Source, Spanned};
use crate::suggestion::list_choices;
use crate::tree::Element;

/// Names that the net of a route uses itself.
const RESERVED: [&str; 2] = ["begin", "end"];

pub(super) fn read(
    element: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnRoute> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let mover = fields.required_dotted("mover").map(route_port);
    let mut route = DrawnRoute {
        name: name.clone().unwrap_or_else(|| Spanned::new(String::new(), fields.at())),
        mover: mover.clone().unwrap_or_else(|| {
            let none = Spanned::new(String::new(), fields.at());
            RoutePort { component: none.clone(), port: none }
        }),
        pace: fields.dotted("pace").map(route_port),
        pose: fields.dotted("pose").map(route_port),
        components: fields.names("components"),
        fence: fields.name("fence"),
        start: fields.name("start"),
        enter: fields.name("in"),
        leave: fields.name("out"),
        safe: fields.name("safe"),
        radius: read_clearance(&mut fields, "radius").unwrap_or(Clearance::ZERO),
        tolerance: read_tolerance(&mut fields),
        endurance: fields.longer_than_nothing("endurance"),
        patience: fields.longer_than_nothing("patience"),
        rally_by: fields.longer_than_nothing("rally-by"),
        steps: Vec::new(),
        exits: Vec::new(),
        at: fields.at(),
    };
    for child in fields.finish(ROUTE_CHILDREN) {
        let at = child.at(source);
        match child.name.as_str() {
            "otherwise" => {
                let number = route.exits.len() + 1;
                let exit = read_exit(child, number, source, findings);
                if let Some(exit) = exit {
                    add_limited(&mut route.exits, exit, MAX_ROUTE_EXITS, &at, findings);
                }
            }
            sort => {
                let step = match sort {
                    "leg" => read_leg(child, &route, source, findings).map(RouteStep::Leg),
                    "stay" => read_stay(child, source, findings).map(RouteStep::Stay),
                    _ => read_meet(child, source, findings).map(RouteStep::Meet),
                };
                if let Some(step) = step {
                    add_limited(&mut route.steps, step, MAX_ROUTE_STEPS, &at, findings);
                }
            }
        }
    }
    (name.is_some() && mover.is_some()).then_some(route)
}

/// `20%` or `0.2`.
fn read_tolerance(fields: &mut ElementFields<'_, '_>) -> f64 {
    let tolerance = fields.converted("tolerance", |text| {
        let wanted = || "a share from 0% to 90% is expected, such as 20%".to_owned();
        let share = quantity::parse(text).map_err(|_| wanted())?;
        let is_share = share.unit.is_none_or(|unit| unit.dimension == Dimension::Ratio);
        let share = Some(share.si).filter(|share| is_share && (0.0..=0.9).contains(share));
        share.ok_or_else(wanted)
    });
    tolerance.map_or(USUAL_TOLERANCE, |tolerance| tolerance.value)
}

fn route_port(port: Port) -> RoutePort {
    RoutePort { component: port.component, port: port.port }
}

/// The name of a step, which must not be one that the net uses.
fn read_step_name(fields: &mut ElementFields<'_, '_>) -> Option<Spanned<String>> {
    let name = fields.required_name("name")?;
    if RESERVED.contains(&name.value.as_str()) {
        fields.bad_value("name", &name, "begin and end are places of every route".into());
    }
    Some(name)
}

fn read_leg(
    element: &Element,
    route: &DrawnRoute,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnLeg> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = read_step_name(&mut fields);
    let to = fields.required_name("to");
    let speed = fields.converted("speed", |text| {
        let speed = quantity::parse_in(text, Dimension::Speed, "a speed such as 0.5m/s");
        let positive = speed.ok().filter(|speed| *speed > 0.0);
        let wanted = || "a speed above zero is expected, such as 0.5m/s".to_owned();
        positive.map(|_| text.to_owned()).ok_or_else(wanted)
    });
    if route.pace.is_none() {
        let why = "its route has no pace=\"driver.speed\", the parameter that it sets";
        fields.without_effect("speed", why);
    }
    let is_straight = fields.choice("way", &[("straight", true), ("free", false)]);
    let is_straight = is_straight.is_some_and(|is_straight| is_straight.value);
    let by = fields.longer_than_nothing("by");
    let not_before = fields.converted("not-before", str::parse);
    let not_after = fields.converted("not-after", str::parse);
    let components = fields.names("components");
    // What is missing is reported here, before anything is given up.
    fields.finish(&[]);
    let (name, to) = (name?, to?);
    Some(DrawnLeg { name, to, speed, is_straight, by, not_before, not_after, components })
}

fn read_stay(
    element: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnStay> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = read_step_name(&mut fields);
    let duration = fields.longer_than_nothing("for");
    let on = fields.dotted("on").map(route_port);
    let components = fields.names("components");
    let is_endless = ["for", "on"].iter().all(|name| fields.attribute_at(name).is_none());
    if is_endless && !fields.has_strangers() {
        let finding = Finding::new(Code::DrawnIncomplete, &fields.at(), "nothing ends this <stay>");
        fields.report(finding.remedy("write for=\"30s\", or the report that ends it: on=\"…\""));
    }
    fields.finish(&[]);
    Some(DrawnStay { name: name?, duration, on, components })
}

fn read_meet(
    element: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnMeet> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = read_step_name(&mut fields);
    let with = fields.required_name("with");
    let patience = fields.longer_than_nothing("patience");
    fields.finish(&[]);
    Some(DrawnMeet { name: name?, with: with?, patience })
}

fn read_exit(
    element: &Element,
    number: usize,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<RouteExit> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.name("name");
    let causes = read_causes(&mut fields);
    let when = fields.text("when");
    let to = fields.name("to");
    fields.required("do");
    let action = fields.choice("do", &ExitAction::NAMED);
    if action.as_ref().is_some_and(|action| action.value != ExitAction::Rally) {
        fields.without_effect("to", "it names the rally point of do=\"rally\": remove it");
    }
    let is_idle = ["on", "when"].iter().all(|name| fields.attribute_at(name).is_none());
    if is_idle && !fields.has_strangers() {
        let finding =
            Finding::new(Code::DrawnIncomplete, &fields.at(), "nothing leads to this <otherwise>");
        fields.report(finding.remedy(
            "write on=\"blocked\", or other causes, or a guard: when=\"battery &lt; 30%\"",
        ));
    }
    if when.is_none() {
        fields.without_effect("name", "it names the transitions of when=\"…\": remove it");
    }
    let at = fields.at();
    fields.finish(&[]);
    let name = name.unwrap_or_else(|| Spanned::new(format!("otherwise-{number}"), at));
    Some(RouteExit { name, causes, when, action: action?, to })
}

/// `lost-link blocked late recall breach`.
fn read_causes(fields: &mut ElementFields<'_, '_>) -> Vec<Spanned<ExitCause>> {
    let words = fields.names("on");
    let mut causes = Vec::new();
    for word in words {
        match ExitCause::NAMED.iter().find(|(name, _)| *name == word.value) {
            Some((_, cause)) => causes.push(word.with(*cause)),
            None => {
                let message = format!("on: `{}` is not valid", short(&word.value));
                let names = ExitCause::NAMED.iter().map(|(name, _)| *name);
                let finding = Finding::new(Code::BadValue, &word.at, message);
                fields.report(finding.remedy(list_choices(&word.value, names)));
            }
        }
    }
    causes
}
