//! What is drawn: names that exist once, points that exist, and legs that keep their distance from zones
//! and lines.

use std::collections::BTreeSet;

use armor_geo::{Clearance, MapPoint};

use crate::check::drawn_exits::{ExitSite, check_exits, describe_intrusion};
use crate::check::names::KnownNames;
use crate::code::Code;
use crate::drawn_route::{DrawnMeet, DrawnRoute, ExitAction, ExitCause, RouteStep};
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::System;
use crate::route::clear::{PathFault, find_leg_fault};
use crate::route::{ExitPaths, MAX_ROUTE_PIECES, RoutePiece, divide_into_pieces, find_partner};
use crate::site_map::{LineKind, SiteMap, ZoneKind};
use crate::source::Spanned;
use crate::suggestion::suggest_similar;

/// Checks the map of a mission and its routes. `is_whole`: whether it is the mission that is played, and
/// not one that it includes, so that names of its transitions are those of firings, and its zones those
/// that robots obey.
pub(super) fn check(mission: &Mission, system: &System, is_whole: bool, findings: &mut Findings) {
    let map = mission.map.as_ref();
    if let Some(map) = map {
        KnownNames::collect("mark", Code::DrawnTwice, map.names(), findings);
    }
    let names = mission.routes.iter().map(|route| &route.name);
    KnownNames::collect("route", Code::DrawnTwice, names, findings);
    let mut paths = ExitPaths::new(map);
    for route in &mission.routes {
        let steps = route.steps.iter().map(RouteStep::name);
        KnownNames::collect("step", Code::DrawnTwice, steps, findings);
        let named = name_marks(route, map, mission.unreadable.in_map, findings);
        check_ends(route, mission, findings);
        check_meetings(route, &mission.routes, findings);
        // A point that is misspelt is somewhere else.
        if let Some(map) = map.filter(|_| named) {
            let pieces = divide_into_pieces(route, Some(map));
            // More are a finding already.
            if pieces.len() <= MAX_ROUTE_PIECES {
                check_legs(route, &pieces, map, findings);
                let site = ExitSite { mission, map, system, is_whole };
                check_exits(route, &pieces, site, &mut paths, findings);
            }
        }
    }
}

/// Reports marks that are named and not drawn; returns whether there are none.
fn name_marks(
    route: &DrawnRoute,
    map: Option<&SiteMap>,
    is_unreadable: bool,
    findings: &mut Findings,
) -> bool {
    let legs = route.steps.iter().filter_map(|step| match step {
        RouteStep::Leg(leg) => Some(&leg.to),
        _ => None,
    });
    let exits = route.exits.iter().filter_map(|exit| exit.to.as_ref());
    let wanted = route.start.iter().chain(legs).chain(exits);
    let drawn = || map.into_iter().flat_map(|map| map.points.iter().chain(&map.rallies));
    let known: BTreeSet<_> = drawn().map(|point| point.name.value.as_str()).collect();
    let mut all = true;
    for name in wanted.filter(|name| !known.contains(name.value.as_str())) {
        all = false;
        if is_unreadable {
            continue;
        }
        let message = format!("there is no point {} on the map", short(&name.value));
        let finding = Finding::new(Code::UnknownMark, &name.at, message);
        let guess = suggest_similar(&name.value, known.iter().copied());
        findings.push(finding.remedy(guess.unwrap_or_else(|| {
            format!("draw it: <map><point name=\"{}\" at=\"1 2\"/></map>", short(&name.value))
        })));
    }
    all
}

/// A route has steps, and each of its exits has an end.
fn check_ends(route: &DrawnRoute, mission: &Mission, findings: &mut Findings) {
    let name = &route.name.value;
    if route.steps.is_empty() && !mission.unreadable.in_start {
        let message = format!("route {name} has no legs");
        let finding = Finding::new(Code::RouteEmpty, &route.name.at, message);
        findings.push(finding.remedy("write <leg name=\"l1\" to=\"P1\"/> in it"));
    }
    if route.safe.is_none() && mission.safe.is_none() {
        let message = format!("route {name} leads nowhere when a leg fails");
        let finding = Finding::new(Code::NoRally, &route.name.at, message);
        findings.push(finding.remedy(
            "write safe=\"hold\" at <mission>, or at this <route>, with the place to end in",
        ));
    }
    let has_rally = mission.map.as_ref().is_some_and(|map| !map.rallies.is_empty());
    for exit in &route.exits {
        let (what, remedy) = match exit.action.value {
            ExitAction::Rally if exit.to.is_none() && !has_rally && !mission.unreadable.in_map => {
                ("there is no rally point on the map", "draw one: <rally name=\"R1\" at=\"1 2\"/>")
            }
            ExitAction::Home if route.start.is_none() => {
                ("the route has no start to go home to", "write start=\"P0\" at its <route>")
            }
            _ => continue,
        };
        findings.push(Finding::new(Code::NoRally, &exit.action.at, what).remedy(remedy));
    }
    let causes = route.exits.iter().flat_map(|exit| &exit.causes);
    let breach = causes.filter(|_| route.fence.is_none()).find(|it| it.value == ExitCause::Breach);
    if let Some(breach) = breach {
        let message = format!("nothing reports a breach: route {name} names no fence");
        let finding = Finding::new(Code::DrawnIncomplete, &breach.at, message);
        findings.push(finding.remedy(
            "write fence=\"fence\" at its <route>, the component that reports it; or remove `breach`",
        ));
    }
}

/// Each meeting has its counterpart in the other route.
fn check_meetings(route: &DrawnRoute, routes: &[DrawnRoute], findings: &mut Findings) {
    let meetings: Vec<&DrawnMeet> = route
        .steps
        .iter()
        .filter_map(|step| match step {
            RouteStep::Meet(meet) => Some(meet),
            _ => None,
        })
        .collect();
    for (number, meet) in meetings.iter().enumerate() {
        let with = &meet.with;
        let before = meetings[..number].iter().filter(|it| it.with.value == with.value).count();
        if find_partner(route, before, &with.value, routes).is_some() {
            continue;
        }
        let own = &route.name.value;
        let message = format!("{} waits for route {} in vain", meet.name.value, short(&with.value));
        let others = routes.iter().map(|other| other.name.value.as_str());
        let others = others.filter(|other| other != own);
        let remedy = match others.clone().any(|other| other == with.value) {
            true => format!(
                "write <meet name=\"m\" with=\"{own}\"/> in route {}: both wait for each other",
                with.value
            ),
            false if with.value == *own => "name another route".into(),
            false => suggest_similar(&with.value, others)
                .unwrap_or_else(|| "there is no such route".into()),
        };
        findings.push(Finding::new(Code::MeetingAlone, &with.at, message).remedy(remedy));
    }
}

/// The legs of a route.
fn check_legs(
    route: &DrawnRoute,
    pieces: &[RoutePiece<'_>],
    map: &SiteMap,
    findings: &mut Findings,
) {
    for (number, step) in route.steps.iter().enumerate() {
        let parts: Vec<_> = pieces.iter().filter(|piece| piece.step == number).collect();
        let (Some(first), Some(last)) = (parts.first(), parts.last()) else { continue };
        let RouteStep::Leg(leg) = step else { continue };
        let Some(end) = last.end else { continue };
        let Some(start) = first.start else {
            check_end(route, leg.name.value.as_str(), &leg.to, end, map, findings);
            continue;
        };
        if let Some(fault) = find_leg_fault(map, start, end, route.radius) {
            findings.push(report_leg(&leg.name, &leg.to, &fault, route.radius));
        }
    }
}

/// A first leg from an unknown start: its point is checked, the path cannot be.
fn check_end(
    route: &DrawnRoute,
    leg: &str,
    to: &Spanned<String>,
    end: MapPoint,
    map: &SiteMap,
    findings: &mut Findings,
) {
    if let Some(fault) = find_leg_fault(map, end, end, route.radius) {
        return findings.push(report_leg(to, to, &fault, route.radius));
    }
    let is_kept = |kind| matches!(kind, ZoneKind::NoGo | ZoneKind::StayIn);
    let has_zones = map.zones.iter().any(|zone| is_kept(zone.kind));
    if has_zones || map.lines.iter().any(|line| line.kind != LineKind::Phase) {
        let message = format!("where {leg} begins is unknown, so that its path cannot be checked");
        let finding = Finding::new(Code::StartUnknown, &route.name.at, message);
        findings.push(finding.remedy("write start=\"P0\", the point where the robot is at first"));
    }
}

fn report_leg(
    at: &Spanned<String>,
    to: &Spanned<String>,
    fault: &PathFault<'_>,
    radius: Clearance,
) -> Finding {
    let leg = &at.value;
    let remedy = format!("move {}, or add a leg that leads around", to.value);
    match fault {
        PathFault::Enters(zone) => {
            let message =
                format!("{leg} {}", describe_intrusion(&zone.name.value, zone.margin, radius));
            Finding::new(Code::LegIntrudes, &at.at, message)
                .remedy(remedy)
                .related(&zone.area.at, "this zone")
        }
        PathFault::Leaves(zone) => {
            let message =
                format!("{leg} leaves {}, or comes too near to its boundary", zone.name.value);
            Finding::new(Code::LegLeaves, &at.at, message)
                .remedy(format!("move {}, or add a leg that stays in the zone", to.value))
                .related(&zone.area.at, "this zone")
        }
        PathFault::Crosses(line) => {
            let message = format!("{leg} crosses {}", line.name.value);
            Finding::new(Code::LineCrossed, &at.at, message)
                .remedy(remedy)
                .related(&line.shape.at, "this line")
        }
    }
}
