//! The model of `<route>`: the legs that a robot drives over the mission's map, as drawn. Its net is
//! derived in `route.rs`.

use std::time::Duration;

use armor_geo::Clearance;

use crate::date::Date;
use crate::source::{Location, Spanned};

/// A route: what one robot does on the map, in order.
#[derive(Clone, Debug)]
pub struct DrawnRoute {
    /// Its name, which precedes those of its places.
    pub name: Spanned<String>,
    /// The parameter that gives the component that drives its waypoints.
    pub mover: RoutePort,
    /// The parameter that sets the speed.
    pub pace: Option<RoutePort>,
    /// The output with the robot's pose.
    pub pose: Option<RoutePort>,
    /// The components that are active on every leg.
    pub components: Vec<Spanned<String>>,
    /// The component that reports that the robot is where it must not be; it is active on the whole route.
    pub fence: Option<Spanned<String>>,
    /// The point where the robot is at first, to which it returns with `do="home"`.
    pub start: Option<Spanned<String>>,
    /// The place of the mission that begins it; without one it begins with the mission.
    pub enter: Option<Spanned<String>>,
    /// The place of the mission that it leads to.
    pub leave: Option<Spanned<String>>,
    /// The place of the mission for a robot that cannot continue.
    pub safe: Option<Spanned<String>>,
    /// The radius of the robot, added to every margin.
    pub radius: Clearance,
    /// By which share the mean speed of a drive may differ from its speed.
    pub tolerance: f64,
    /// How long its battery lasts from the beginning of the route.
    pub endurance: Option<Spanned<Duration>>,
    /// How long the robot waits at a rally point for the operator to resume the leg.
    pub patience: Option<Spanned<Duration>>,
    /// How long the drive to a rally point may take.
    pub rally_by: Option<Spanned<Duration>>,
    /// The legs, stays and meetings.
    pub steps: Vec<RouteStep>,
    /// What ends a leg early.
    pub exits: Vec<RouteExit>,
    /// The `<route>` tag.
    pub at: Location,
}

/// The share by which the mean speed of a drive may differ from its speed, if the route states none: a
/// robot accelerates, turns and drives around corners.
pub const USUAL_TOLERANCE: f64 = 0.2;

/// A parameter, output or report of a component: `component.name`.
#[derive(Clone, Debug)]
pub struct RoutePort {
    /// The component.
    pub component: Spanned<String>,
    /// The parameter, output or report.
    pub port: Spanned<String>,
}

/// One step of a route.
#[derive(Clone, Debug)]
pub enum RouteStep {
    /// A drive to a point.
    Leg(DrawnLeg),
    /// A stop for a time or a task.
    Stay(DrawnStay),
    /// A meeting with another route.
    Meet(DrawnMeet),
}

impl RouteStep {
    /// Its name.
    pub fn name(&self) -> &Spanned<String> {
        match self {
            Self::Leg(leg) => &leg.name,
            Self::Stay(stay) => &stay.name,
            Self::Meet(meet) => &meet.name,
        }
    }
}

/// `<leg>`: a drive to a point.
#[derive(Clone, Debug)]
pub struct DrawnLeg {
    /// Its name.
    pub name: Spanned<String>,
    /// The point.
    pub to: Spanned<String>,
    /// The speed, as written.
    pub speed: Option<Spanned<String>>,
    /// Whether it is driven along the straight line; otherwise on any free path.
    pub is_straight: bool,
    /// How long it may take.
    pub by: Option<Spanned<Duration>>,
    /// The robot does not continue from the point before this date.
    pub not_before: Option<Spanned<Date>>,
    /// The robot is late if it has not arrived at this date.
    pub not_after: Option<Spanned<Date>>,
    /// The components that are active on it, in addition to those of the route.
    pub components: Vec<Spanned<String>>,
}

/// `<stay>`: a stop for a time or a task.
#[derive(Clone, Debug)]
pub struct DrawnStay {
    /// Its name.
    pub name: Spanned<String>,
    /// How long.
    pub duration: Option<Spanned<Duration>>,
    /// The report that ends it.
    pub on: Option<RoutePort>,
    /// The components that are active during it.
    pub components: Vec<Spanned<String>>,
}

/// `<meet>`: waits until another route is at its meeting with this one.
#[derive(Clone, Debug)]
pub struct DrawnMeet {
    /// Its name.
    pub name: Spanned<String>,
    /// The other route.
    pub with: Spanned<String>,
    /// How long it waits; then it is late.
    pub patience: Option<Spanned<Duration>>,
}

/// `<otherwise>`: what ends any step early, and what follows.
#[derive(Clone, Debug)]
pub struct RouteExit {
    /// The last word of its transitions' names, for one with a guard.
    pub name: Spanned<String>,
    /// The events.
    pub causes: Vec<Spanned<ExitCause>>,
    /// The guard, as text.
    pub when: Option<Spanned<String>>,
    /// What follows.
    pub action: Spanned<ExitAction>,
    /// The rally point, if it is not the nearest one.
    pub to: Option<Spanned<String>>,
}

/// An event that ends a step early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitCause {
    /// The link to the operator is lost.
    LostLink,
    /// The mover, or the component that a stay waits for, reports a failure.
    Blocked,
    /// The time is over.
    Late,
    /// The operator recalls the robot.
    Recall,
    /// The fence of the route reports that the robot is where it must not be.
    Breach,
}

impl ExitCause {
    /// Each cause with its word in the file.
    pub const NAMED: [(&str, Self); 5] = [
        ("lost-link", Self::LostLink),
        ("blocked", Self::Blocked),
        ("late", Self::Late),
        ("recall", Self::Recall),
        ("breach", Self::Breach),
    ];

    /// The word in the file.
    pub fn word(self) -> &'static str {
        match self {
            Self::LostLink => "lost-link",
            Self::Blocked => "blocked",
            Self::Late => "late",
            Self::Recall => "recall",
            Self::Breach => "breach",
        }
    }
}

/// What follows when a step ends early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitAction {
    /// The robot drives to the rally point that is nearest to the worst point of the leg.
    Rally,
    /// The robot drives to the start of the route.
    Home,
    /// The route ends in its safe place.
    Hold,
    /// The next step begins.
    Skip,
}

impl ExitAction {
    /// Each action with its word in the file.
    pub const NAMED: [(&str, Self); 4] =
        [("rally", Self::Rally), ("home", Self::Home), ("hold", Self::Hold), ("skip", Self::Skip)];
}
