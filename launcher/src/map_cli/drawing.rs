//! What a plan of another planner becomes in a mission file: marks of the map and a route. Pure.

use std::collections::BTreeSet;

use armor_exchange::{PlanNote, RoutePlan};
use armor_geo::MapPlacement;
use armor_robotfile::{MAX_ROUTES, NewElement};

use super::marks::MarkBook;
use super::route_steps::plan_steps;
use super::route_writing::write_route;

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

/// Draws a plan. Names are new: none is among those of `existing`.
///
/// # Errors
/// If a limit of the file is exceeded, a position or fence cannot be on the map, or nothing can be
/// drawn.
pub fn draw_plan(
    plan: &RoutePlan,
    options: &DrawingOptions,
    existing: &ExistingDrawing,
) -> Result<Drawing, DrawingError> {
    let route = choose_route(plan, options)?;
    let route_name = choose_name(plan, route, options, existing)?;
    let mut marks = MarkBook::new(plan, route, options.positions, existing)?;
    let mut drawing = Drawing { origin: marks.new_origin(), ..Drawing::default() };
    let is_kept = |note: &&PlanNote| !is_about_command(plan, note);
    drawing.notes.extend(plan.notes.iter().filter(is_kept).cloned());
    marks.draw_fences(&plan.fences)?;
    marks.draw_rallies(plan)?;
    if let Some(index) = route {
        let steps = plan_steps(&plan.routes[index], plan.home, options, &drawing.notes)?;
        drawing.notes.extend(steps.notes.iter().cloned());
        if steps.is_empty() {
            let text = "it leads to no position, and is not drawn".to_owned();
            drawing.notes.push(general_note("the route", text));
        } else {
            let route = write_route(&route_name, steps, options, existing.rallies > 0, &mut marks)?;
            drawing.route = Some(route);
        }
    }
    marks.draw_other_points(&plan.points)?;
    if drawing.route.is_none() && !marks.has_any() {
        return Err(DrawingError::Empty);
    }
    if plan.routes.len() > 1 && route.is_some() {
        let text = format!("{} other routes are not imported", plan.routes.len() - 1);
        drawing.notes.push(general_note("the plan", text));
    }
    drawing.notes.extend(marks.note_altitudes());
    drawing.marks = marks.into_elements()?;
    comment_on_plan(&mut drawing);
    Ok(drawing)
}

/// Keeps the notes that are about no item in the file, above the route or else the first mark.
fn comment_on_plan(drawing: &mut Drawing) {
    let general = drawing.notes.iter().filter(|note| note.item.is_none());
    let mut texts: Vec<String> = general.map(ToString::to_string).collect();
    let more = texts.len().saturating_sub(MOST_COMMENTS);
    texts.truncate(MOST_COMMENTS);
    texts.extend((more > 0).then(|| describe_more_notes(more)));
    let element = drawing.route.as_mut().or(drawing.marks.first_mut());
    if let Some(element) = element {
        *element = texts.iter().fold(std::mem::take(element), |it, text| it.comment(text));
    }
}

/// Stands for notes that are not kept in the file.
pub(super) fn describe_more_notes(count: usize) -> String {
    format!("{count} more notes: `armor map import` prints them")
}

/// A note on the plan as a whole.
pub(super) fn general_note(place: &str, text: String) -> PlanNote {
    PlanNote { place: place.to_owned(), text, item: None }
}

/// Whether a note is about a command that the plan keeps as it is: it is described with its
/// parameters where it would be carried out.
fn is_about_command(plan: &RoutePlan, note: &PlanNote) -> bool {
    let item = note.item.and_then(|item| plan.routes.first()?.items.get(item));
    matches!(item, Some(armor_exchange::PlanItem::Other(_)))
}

/// The index of the route that is drawn; none if the plan has none.
fn choose_route(plan: &RoutePlan, options: &DrawingOptions) -> Result<Option<usize>, DrawingError> {
    let number = |index: usize| (index + 1).to_string();
    let names: Vec<String> = plan
        .routes
        .iter()
        .enumerate()
        .map(|(index, route)| route.name.clone().unwrap_or_else(|| number(index)))
        .collect();
    let Some(only) = &options.only else {
        return match names.len() {
            0 => Ok(None),
            1 => Ok(Some(0)),
            _ => Err(DrawingError::SeveralRoutes { names: shorten_list(names) }),
        };
    };
    let by_name = names.iter().position(|name| name == only);
    let found = by_name.or_else(|| (0..names.len()).find(|index| number(*index) == *only));
    match found {
        Some(index) => Ok(Some(index)),
        None => {
            let names = shorten_list(names);
            Err(DrawingError::NoSuchRoute { name: only.clone(), names })
        }
    }
}

/// The first names, for a message.
fn shorten_list(names: Vec<String>) -> Vec<String> {
    const SHOWN: usize = 12;
    let more = names.len().saturating_sub(SHOWN);
    let shorten = |name: String| name.chars().take(40).collect::<String>();
    let mut names: Vec<_> = names.into_iter().take(SHOWN).map(shorten).collect();
    if more > 0 {
        names.push(format!("and {more} more"));
    }
    names
}

fn choose_name(
    plan: &RoutePlan,
    route: Option<usize>,
    options: &DrawingOptions,
    existing: &ExistingDrawing,
) -> Result<String, DrawingError> {
    let present = existing.routes.len();
    if route.is_some() && present >= MAX_ROUTES {
        let (what, found, most) = ("route", 1, MAX_ROUTES);
        return Err(DrawingError::TooMany { what, found, present, most });
    }
    if let Some(name) = &options.route {
        if existing.routes.contains(name) {
            return Err(DrawingError::RouteTaken { name: name.clone() });
        }
        return Ok(name.clone());
    }
    let planned = route.and_then(|index| plan.routes[index].name.as_deref());
    let proposed = planned.and_then(super::marks::make_name);
    let proposed = proposed.unwrap_or_else(|| "route".to_owned());
    Ok(super::marks::make_unique(&proposed, &existing.routes))
}
