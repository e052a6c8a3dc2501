//! What a plan of another planner becomes in a mission file: marks of the map and a route. Pure.

use std::collections::BTreeSet;

use armor_exchange::PlanNote;
use armor_geo::MapPlacement;
use armor_robotfile::NewElement;

/// Most notes that are kept as comments, of the plan and of its items each: a file has a limit.
pub(super) const MOST_COMMENTS: usize = 64;

/// How positions are written in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PositionForm {
    /// Metres of the map's frame.
    Metres,
    /// Latitude and longitude, as the plan has them.
    Wgs84,
}

/// A component, and its parameter, output or report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ComponentPort {
    /// The component.
    pub component: String,
    /// The parameter, output or report.
    pub port: String,
}

impl std::fmt::Display for ComponentPort {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.component, self.port)
    }
}

/// How a plan is drawn.
#[derive(Clone, Debug)]
pub struct DrawingOptions {
    /// The name of the new route; otherwise the plan's.
    pub route: Option<String>,
    /// Which route of the plan: its name, or its number from 1.
    pub only: Option<String>,
    /// The parameter that takes the point of a leg.
    pub mover: ComponentPort,
    /// The parameter that a leg's speed sets.
    pub pace: Option<ComponentPort>,
    /// The output with the robot's pose.
    pub pose: Option<ComponentPort>,
    /// Components that are active on every leg.
    pub active: Vec<String>,
    /// The component that takes pictures, with the report that it has taken one.
    pub camera: Option<ComponentPort>,
    /// The place whose token begins the route.
    pub enter: Option<String>,
    /// The place to which the route leads.
    pub leave: Option<String>,
    /// How positions are written.
    pub positions: PositionForm,
}

/// What a file has drawn already, and where its map is.
#[derive(Clone, Debug, Default)]
pub struct ExistingDrawing {
    /// Where the map is in the world, if it has an origin.
    pub placement: Option<MapPlacement>,
    /// The names of points, rally points, zones and lines.
    pub marks: BTreeSet<String>,
    /// The names of routes.
    pub routes: BTreeSet<String>,
    /// How many points the map has.
    pub points: usize,
    /// How many rally points.
    pub rallies: usize,
    /// How many zones.
    pub zones: usize,
    /// How many points all shapes have together.
    pub corners: usize,
}

/// What is to be added to a file.
#[derive(Clone, Debug, Default)]
pub struct Drawing {
    /// The `origin` that the map gets, if it has none.
    pub origin: Option<String>,
    /// Points, zones and rally points.
    pub marks: Vec<NewElement>,
    /// The route.
    pub route: Option<NewElement>,
    /// What has no counterpart.
    pub notes: Vec<PlanNote>,
}

/// Why a plan is not drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DrawingError {
    /// It has nothing that can be drawn.
    #[error(
        "the plan has no position to drive to, and no fence, rally point or point: there is nothing to import"
    )]
    Empty,
    /// It has several routes, which may be alternatives.
    #[error(
        "the plan has {} routes ({}): choose one with --only NAME, or --only and its number; import each with a mover of its own",
        .names.len(),
        .names.join(", ")
    )]
    SeveralRoutes {
        /// Their names, or numbers.
        names: Vec<String>,
    },
    /// It has no such route.
    #[error("the plan has no route {name} (it has: {})", .names.join(", "))]
    NoSuchRoute {
        /// The name.
        name: String,
        /// Those that it has.
        names: Vec<String>,
    },
    /// The file has a route of this name.
    #[error("the file has a route {name} already: choose another name with --route")]
    RouteTaken {
        /// The name.
        name: String,
    },
    /// The format of the file has a limit.
    #[error(
        "the plan has {found} {what}, the file {present}, and a file at most {most}: remove some in the planner"
    )]
    TooMany {
        /// What there are too many of.
        what: &'static str,
        /// How many the plan has.
        found: usize,
        /// How many the file has.
        present: usize,
        /// How many it may have.
        most: usize,
    },
    /// The route is too long.
    #[error(
        "the route has {steps} legs and stays, and a drawn route at most {most}: divide it in the planner, and import the parts one after the other (--in, --out)"
    )]
    TooManySteps {
        /// How many it has, without repetitions.
        steps: usize,
        /// How many it may have.
        most: usize,
    },
    /// A position cannot be on the map.
    #[error("{place}: {reason}")]
    Position {
        /// What has the position.
        place: String,
        /// Why not.
        reason: String,
    },
    /// A fence that is no area.
    #[error("{place}: {reason}; change it in the planner: a robot is not kept from it otherwise")]
    Shape {
        /// The fence.
        place: String,
        /// Why not.
        reason: String,
    },
}

/// Stands for notes that are not kept in the file.
pub(super) fn describe_more_notes(count: usize) -> String {
    format!("{count} more notes: `armor map import` prints them")
}

/// A note on the plan as a whole.
pub(super) fn general_note(place: &str, text: String) -> PlanNote {
    PlanNote { place: place.to_owned(), text, item: None }
}
