//! Places and transitions that are derived from a route of the mission: they are drawn, played and
//! proven as all others, but their line in the file is that of the route.

use armor_robotfile::drawn_route::RouteStep;
use armor_robotfile::mission::Mission;

use crate::item::Item;

/// Returns what a place or transition is derived from, such as `leg l1 of route red, line 58 of
/// drawn.xml`; `None` for one that has its own element.
pub fn source_of(mission: &Mission, name: &str) -> Option<String> {
    let (route_name, rest) = name.split_once('.')?;
    let route = mission.routes.iter().find(|route| route.name.value == route_name)?;
    let step_name = rest.split('.').next();
    let step = route.steps.iter().find(|step| Some(step.name().value.as_str()) == step_name);
    let at = step.map_or(&route.at, |step| &step.name().at);
    let of_route = format!("route {route_name}");
    let from = match step {
        Some(step) => format!("{} {} of {of_route}", step_word(step), step.name().value),
        None => of_route,
    };
    let (line, _) = at.line_column();
    let file = at.source.path().file_name().unwrap_or_default().to_string_lossy();
    Some(format!("{from}, line {line} of {file}"))
}

/// The step of a route that a place or transition is derived from.
pub fn step_of(mission: &Mission, name: &str) -> Option<Item> {
    let mut words = name.split('.');
    let (route, step) = (words.next()?, words.next()?);
    let item = Item::step(route, step);
    find_step(mission, &item).map(|_| item)
}

/// The step of a route as the file has it.
pub fn find_step<'a>(mission: &'a Mission, item: &Item) -> Option<&'a RouteStep> {
    let Item::Step { route, step } = item else { return None };
    let route = mission.routes.iter().find(|known| *route == known.name.value)?;
    route.steps.iter().find(|known| *step == known.name().value)
}

/// A step of a route with its line, such as `leg l1 of route red, line 58 of drawn.xml`.
pub fn source_of_step(mission: &Mission, item: &Item) -> Option<String> {
    let Item::Step { route, step } = item else { return None };
    find_step(mission, item)?;
    source_of(mission, &format!("{route}.{step}"))
}

/// The reason why a step of a route is not changed in the net.
pub fn step_refusal(mission: &Mission, item: &Item) -> Option<String> {
    let source = source_of_step(mission, item)?;
    Some(format!("{source}, is edited in the view Map (Ctrl+3), or that line in the file"))
}

/// Returns whether a place or transition is derived from a route.
pub fn is_derived(mission: &Mission, name: &str) -> bool {
    let route = name.split_once('.').map(|(route, _)| route);
    route.is_some_and(|route| mission.routes.iter().any(|known| known.name.value == route))
}

/// The reason why a place or transition is not changed, with the line to change; `None` for one
/// that has its own element.
pub fn refusal(mission: &Mission, name: &str) -> Option<String> {
    let source = source_of(mission, name)?;
    Some(format!(
        "{name} is derived from {source}: edit it in the view Map, or that line in the file"
    ))
}

pub fn step_word(step: &RouteStep) -> &'static str {
    match step {
        RouteStep::Leg(_) => "leg",
        RouteStep::Stay(_) => "stay",
        RouteStep::Meet(_) => "meet",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_the_step_is_named_or_that_of_the_route() {
        let file = "<armor version='1'><system/><mission goal='over' safe='over'>\n<map>\
            <point name='P0' at='0 0'/><point name='P1' at='9 0'/></map>\n\
            <route name='red' mover='way.route' start='P0' out='over'>\n\
            <leg name='l1' to='P1' by='1min'/></route>\n<place name='over'/></mission></armor>";
        let mission = crate::mission::read_text(file).mission.unwrap();
        let names = mission.places.iter().map(|place| place.name.value.as_str());
        assert_eq!(names.collect::<Vec<_>>(), ["over", "red.l1"]);
        let leg = Some("leg l1 of route red, line 4 of a.xml".to_owned());
        assert_eq!(source_of(&mission, "red.l1.late"), leg);
        let route = Some("route red, line 3 of a.xml".to_owned());
        assert_eq!(source_of(&mission, "red.end"), route);
        assert_eq!(source_of(&mission, "over"), None);
        assert_eq!(source_of(&mission, "dock.creep"), None);
        assert!(is_derived(&mission, "red.l1") && !is_derived(&mission, "dock.creep"));
    }
}
