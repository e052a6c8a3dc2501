//! The steps of a route as elements of the file. Pure.

use armor_robotfile::NewElement;

use super::drawing::{DrawingError, DrawingOptions, MOST_COMMENTS, describe_more_notes};
use super::marks::MarkBook;
use super::route_steps::{PlannedSteps, StepAction};

/// Writes a route, and draws its points. With rally points, a leg that fails leads to one.
///
/// # Errors
/// If a position cannot be on the map.
pub(super) fn write_route(
    name: &str,
    planned: PlannedSteps,
    options: &DrawingOptions,
    has_rally_already: bool,
    marks: &mut MarkBook<'_>,
) -> Result<NewElement, DrawingError> {
    let home = planned.home.map(|home| marks.draw_home(&home)).transpose()?;
    let mut route = NewElement::new("route").attribute("name", name);
    let text =
        |port: &Option<super::drawing::ComponentPort>| port.as_ref().map(ToString::to_string);
    let active = Some(options.active.join(" ")).filter(|names| !names.is_empty());
    let attributes = [
        ("mover", Some(options.mover.to_string())),
        ("pace", text(&options.pace)),
        ("pose", text(&options.pose)),
        ("components", active),
        ("start", home),
        ("in", options.enter.clone()),
        ("out", options.leave.clone()),
    ];
    for (attribute, value) in attributes {
        if let Some(value) = value {
            route = route.attribute(attribute, value);
        }
    }
    let mut writer =
        StepWriter { options, legs: 0, stays: 0, comments_left: MOST_COMMENTS, more: 0 };
    for step in planned.steps {
        let element = writer.write_step(step.action, marks)?;
        route = route.child(writer.comment(element, &step.comments));
    }
    if has_rally_already || marks.has_rallies() {
        let exit = NewElement::new("otherwise").attribute("on", "lost-link blocked late");
        route = route.child(exit.attribute("do", "rally"));
    }
    route = writer.comment(route, &planned.last_comments);
    if writer.more > 0 {
        route = route.comment(&describe_more_notes(writer.more));
    }
    Ok(route)
}

struct StepWriter<'a> {
    options: &'a DrawingOptions,
    legs: usize,
    stays: usize,
    comments_left: usize,
    /// Comments that are left out.
    more: usize,
}

impl StepWriter<'_> {
    fn write_step(
        &mut self,
        action: StepAction,
        marks: &mut MarkBook<'_>,
    ) -> Result<NewElement, DrawingError> {
        let camera = self.options.camera.as_ref();
        match action {
            StepAction::Leg { to, name, place, speed_mps, with_camera } => {
                self.legs += 1;
                let point = marks.draw_point(&to, name.as_deref(), &place)?;
                let mut leg = NewElement::new("leg")
                    .attribute("name", format!("l{}", self.legs))
                    .attribute("to", point);
                if let Some(speed) = speed_mps {
                    leg = leg.attribute("speed", format!("{speed}m/s"));
                }
                if let Some(camera) = camera.filter(|_| with_camera) {
                    leg = leg.attribute("components", camera.component.clone());
                }
                Ok(leg)
            }
            StepAction::Stay(seconds) => {
                Ok(self.begin_stay().attribute("for", format!("{seconds}s")))
            }
            StepAction::Picture => {
                let mut stay = self.begin_stay();
                if let Some(camera) = camera {
                    stay = stay.attribute("on", camera.to_string());
                    stay = stay.attribute("components", camera.component.clone());
                }
                Ok(stay)
            }
        }
    }

    fn begin_stay(&mut self) -> NewElement {
        self.stays += 1;
        NewElement::new("stay").attribute("name", format!("s{}", self.stays))
    }

    fn comment(&mut self, element: NewElement, comments: &[String]) -> NewElement {
        let written = comments.len().min(self.comments_left);
        self.comments_left -= written;
        self.more += comments.len() - written;
        comments[..written].iter().fold(element, |element, text| element.comment(text))
    }
}
