//! Which simulator is the robot of which route: the one that is fewest links away from the components of the
//! route.

use std::collections::{BTreeSet, VecDeque};

use armor_robotfile::drawn_route::DrawnRoute;
use armor_robotfile::model::System;
use armor_robotfile::timing::{MissionPreview, StraightLengths};
use armor_robotfile::{Configuration, Mission};

use super::stand_in::StandIn;
use super::trial::RehearsedRobot;
use super::zone_rooms::ZoneMeter;

/// The robots, one for each simulator that is one of a route.
pub fn list_robots(
    configuration: &Configuration,
    mission: &Mission,
    stand_in: &StandIn,
) -> Vec<RehearsedRobot> {
    let system = &configuration.system;
    let preview = MissionPreview::of_mission(mission, system, &StraightLengths, None);
    let radius_of = |route: &str| {
        let robots = preview.iter().flat_map(|preview| &preview.robots);
        robots.filter(|robot| robot.route == route).map(|robot| robot.radius_m).fold(0.0, f64::max)
    };
    let mut robots: Vec<RehearsedRobot> = Vec::new();
    for simulator in &stand_in.simulators {
        let is_its = |route: &&DrawnRoute| {
            find_simulator(route, system, stand_in).is_some_and(|found| found == simulator)
        };
        let routes: Vec<_> =
            mission.routes.iter().filter(is_its).map(|route| route.name.value.clone()).collect();
        if routes.is_empty() {
            continue;
        }
        let radius_m = routes.iter().map(|route| radius_of(route)).fold(0.0, f64::max);
        let meter = ZoneMeter::new(mission.map.as_ref(), routes.join(", "), radius_m);
        robots.push(RehearsedRobot { simulator: simulator.clone(), routes, meter });
    }
    robots
}

/// The simulator that is fewest links away from the components that a route names.
fn find_simulator<'a>(
    route: &DrawnRoute,
    system: &System,
    stand_in: &'a StandIn,
) -> Option<&'a String> {
    let ports = [Some(&route.mover), route.pace.as_ref(), route.pose.as_ref()];
    let named = ports.into_iter().flatten().map(|port| &port.component).chain(&route.components);
    let mut queue: VecDeque<&str> = named.map(|name| name.value.as_str()).collect();
    let mut seen: BTreeSet<&str> = queue.iter().copied().collect();
    while let Some(component) = queue.pop_front() {
        let is_replaced = stand_in.replaced.iter().any(|name| name == component);
        let simulator = stand_in.simulators.iter().find(|name| *name == component);
        if let Some(simulator) = simulator.or(stand_in.simulators.first().filter(|_| is_replaced)) {
            return Some(simulator);
        }
        for link in &system.links {
            let ends = [&link.from.component.value, &link.to.component.value];
            for [one, other] in [ends, [ends[1], ends[0]]] {
                if one == component && seen.insert(other) {
                    queue.push_back(other);
                }
            }
        }
    }
    None
}
