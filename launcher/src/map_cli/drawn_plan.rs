//! A plan of another planner drawn: its marks, its route, and the notes on both. Pure.

use armor_exchange::{PlanNote, RoutePlan};
use armor_robotfile::MAX_ROUTES;

use super::drawing::{
    Drawing, DrawingError, DrawingOptions, ExistingDrawing, MOST_COMMENTS, describe_more_notes,
    general_note,
};
use super::marks::{MarkBook, make_name, make_unique};
use super::route_steps::plan_steps;
use super::route_writing::write_route;

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
    let proposed = planned.and_then(make_name);
    let proposed = proposed.unwrap_or_else(|| "route".to_owned());
    Ok(make_unique(&proposed, &existing.routes))
}
