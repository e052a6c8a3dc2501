//! What of the system drives a route: the component that takes its points, the one that paces it, and the
//! output that states where the robot is. All of it follows from links and kinds.

use std::collections::VecDeque;

use armor_robotfile::model::System;

use crate::kinds::Kinds;
use crate::map_view::model::mission_of;
use crate::workspace::Workspace;

/// The parameter by which a kind shows that it drives along a route.
const ROUTE_PARAMETER: &str = "route";
/// The parameter with the speed that a robot drives at, and its unit.
const SPEED: (&str, &str) = ("speed", "m/s");
/// The input with the robot's pose, and the output with the velocity of its wheels.
const POSE_INPUT: &str = "pose";
const VELOCITY_OUTPUT: &str = "velocity";
/// The event of a component that watches where the robot may be.
const BREACH: &str = "breach";

/// The drivers of a new route.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RouteDrivers {
    /// The parameter that takes the point of a leg: `way.route`.
    pub mover: String,
    /// The parameter that sets the speed: `driver.speed`.
    pub pace: Option<String>,
    /// The output with the robot's pose: `mapper.pose`.
    pub pose: Option<String>,
    /// The component that reports when the robot is where it must not be: `fence`.
    pub fence: Option<String>,
}

/// The first component that takes a route and has none yet, or the first of all, with what is linked to it.
pub(super) fn drivers_of_new_route(workspace: &Workspace) -> Option<RouteDrivers> {
    let configuration = workspace.project.configuration()?;
    let (system, kinds) = (&configuration.system, workspace.project.kinds());
    let has_route = |kind: &str| {
        let kind = kinds.find(kind)?;
        kind.parameters.iter().any(|parameter| parameter.name == ROUTE_PARAMETER).then_some(())
    };
    let components = system.components.iter();
    let movers = components.filter(|component| has_route(&component.kind.value).is_some());
    let movers: Vec<_> = movers.map(|component| component.name.value.as_str()).collect();
    let routes = mission_of(workspace).map_or(&[][..], |mission| &mission.routes);
    let is_free =
        |mover: &&&str| !routes.iter().any(|route| route.mover.component.value == **mover);
    let mover = movers.iter().find(is_free).or(movers.first())?;
    Some(RouteDrivers {
        mover: format!("{mover}.{ROUTE_PARAMETER}"),
        pace: find_pace(system, kinds, mover),
        pose: find_pose(system, mover),
        fence: find_fence(system, kinds, mover),
    })
}

/// The output that is linked to the pose of a component.
fn find_pose(system: &System, mover: &str) -> Option<String> {
    let links = system.links.iter().filter(|link| link.to.component.value == mover);
    let link = links.into_iter().find(|link| link.to.port.value == POSE_INPUT)?;
    Some(format!("{}.{}", link.from.component.value, link.from.port.value))
}

/// The component that watches the pose of the robot, and reports a breach.
fn find_fence(system: &System, kinds: &Kinds, mover: &str) -> Option<String> {
    let pose = find_pose(system, mover)?;
    let reports = |kind: &str| {
        let kind = kinds.find(kind);
        kind.is_some_and(|kind| kind.listed_events().iter().any(|event| event.name == BREACH))
    };
    let components = system.components.iter().filter(|component| reports(&component.kind.value));
    let mut names = components.map(|component| component.name.value.as_str());
    let fence = names.find(|name| find_pose(system, name).as_ref() == Some(&pose))?;
    Some(fence.to_owned())
}

/// The component fewest links behind the mover that publishes velocities and has a speed.
fn find_pace(system: &System, kinds: &Kinds, mover: &str) -> Option<String> {
    let (mut queue, mut seen) = (VecDeque::from([mover]), vec![mover]);
    while let Some(name) = queue.pop_front() {
        let component = system.component(name);
        let kind = component.and_then(|component| kinds.find(&component.kind.value));
        let paces = kind.is_some_and(|kind| {
            kind.outputs.iter().any(|port| port.id == VELOCITY_OUTPUT)
                && kind.parameters.iter().any(|it| (it.name.as_str(), it.unit.as_str()) == SPEED)
        });
        if paces {
            return Some(format!("{name}.{}", SPEED.0));
        }
        let links = system.links.iter().filter(|link| link.from.component.value == name);
        for next in links.map(|link| link.to.component.value.as_str()) {
            if !seen.contains(&next) {
                seen.push(next);
                queue.push_back(next);
            }
        }
    }
    None
}
