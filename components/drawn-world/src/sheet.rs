//! Collects the walls, the starts and the routes of people from the XML events of a drawing.

use armor_grid::Pose2;
use quick_xml::events::{BytesStart, Event};

use crate::affine::Affine;
use crate::element::DrawingElement;
use crate::fault::{DrawingFault, shorten_text};
use crate::route::WalkedRoute;
use crate::segment::Segment;
use crate::start::WorldStart;
use crate::{WorldDrawing, limits, shapes};

/// An element that is open: how its content is transformed, and whether the robot sees it.
#[derive(Clone, Copy)]
struct OpenElement {
    drawing_from_content: Affine,
    is_ignored: bool,
}

/// How fast people walk if the drawing states none, in metres per second.
const WALK_MPS: f64 = 1.0;

/// What has been read so far.
#[derive(Default)]
pub(super) struct DrawingSheet {
    open: Vec<OpenElement>,
    element_count: usize,
    segments: Vec<Segment>,
    starts: Vec<DrawnStart>,
    routes: Vec<WalkedRoute>,
}

/// A circle from which a robot begins.
struct DrawnStart {
    id: String,
    pose: Pose2,
    line: usize,
}

impl DrawingSheet {
    /// Takes one event; true at the end of the file.
    pub(super) fn take(
        &mut self,
        event: &Event<'_>,
        line: impl Fn() -> usize,
    ) -> Result<bool, DrawingFault> {
        match event {
            Event::Start(tag) => {
                let open = self.take_element(tag, line)?;
                self.open.push(open);
            }
            Event::Empty(tag) => {
                self.take_element(tag, line)?;
            }
            Event::End(_) => {
                self.open.pop();
            }
            Event::DocType(_) => return Err(DrawingFault::Doctype),
            Event::Eof if !self.open.is_empty() => {
                return Err(DrawingFault::Xml("the file ends inside an element".to_owned()));
            }
            Event::Eof => return Ok(true),
            _ => {}
        }
        Ok(false)
    }

    fn take_element(
        &mut self,
        tag: &BytesStart<'_>,
        line: impl Fn() -> usize,
    ) -> Result<OpenElement, DrawingFault> {
        self.element_count += 1;
        if self.element_count > limits::ELEMENTS {
            return Err(DrawingFault::TooManyElements);
        }
        if self.open.len() == limits::DEPTH {
            return Err(DrawingFault::TooDeep);
        }
        let element = DrawingElement::read(tag)?;
        let Some(&around) = self.open.last() else { return self.take_root(&element) };
        if around.is_ignored || element.is_ignored() {
            return Ok(OpenElement { is_ignored: true, ..around });
        }
        let mut open = around;
        if let Some(transform) = element.text("transform") {
            open.drawing_from_content =
                around.drawing_from_content.after(Affine::parse(transform)?);
        }
        if element.text("id") == Some("start") || element.has_class("start") {
            self.place_start(&element, open.drawing_from_content, line())?;
        } else if element.has_class("person") {
            self.draw_route(&element, open.drawing_from_content)?;
        } else if element.name != "g" {
            self.draw_shape(&element, open.drawing_from_content)?;
        }
        Ok(open)
    }

    fn take_root(&mut self, element: &DrawingElement<'_>) -> Result<OpenElement, DrawingFault> {
        if self.element_count > 1 {
            return Err(DrawingFault::Xml("a second outermost element".to_owned()));
        }
        if element.name != "svg" {
            return Err(DrawingFault::NotSvg(shorten_text(element.name)));
        }
        Ok(OpenElement { drawing_from_content: Affine::IDENTITY, is_ignored: false })
    }

    fn place_start(
        &mut self,
        element: &DrawingElement<'_>,
        drawing_from_content: Affine,
        line: usize,
    ) -> Result<(), DrawingFault> {
        if element.name != "circle" {
            return Err(DrawingFault::StartNotCircle(shorten_text(element.name)));
        }
        let id = element.text("id").unwrap_or("start");
        if self.starts.iter().any(|start| start.id == id) {
            return Err(DrawingFault::SecondStart(shorten_text(id)));
        }
        let coordinate = |name| Ok(element.number(name)?.unwrap_or(0.0));
        let (x_m, y_m) =
            check_coordinates(drawing_from_content.point(coordinate("cx")?, coordinate("cy")?))?;
        let (sin, cos) = libm::sincos(coordinate("data-heading")?.to_radians());
        // The heading is given with y up; the transform works with y down, on both sides of it.
        let (ahead, down) = drawing_from_content.direction(cos, -sin);
        let pose = Pose2::new(x_m, -y_m, libm::atan2(-down, ahead));
        self.starts.push(DrawnStart { id: id.to_owned(), pose, line });
        Ok(())
    }

    /// The route of a person: one line of at least two points.
    fn draw_route(
        &mut self,
        element: &DrawingElement<'_>,
        drawing_from_content: Affine,
    ) -> Result<(), DrawingFault> {
        let outline = match element.name {
            "line" | "polyline" | "polygon" | "path" => shapes::trace_outline(element, 1.0)?,
            _ => None,
        };
        let speed_mps = element.number("data-speed")?.unwrap_or(WALK_MPS);
        let mut points = Vec::new();
        if let Some([polyline]) = outline.as_deref() {
            for &(x, y) in polyline {
                let (x_m, y_m) = check_coordinates(drawing_from_content.point(x, y))?;
                points.push((x_m, -y_m));
            }
        }
        let route = WalkedRoute { points, speed_mps };
        if !(route.length_m() > 0.0 && (0.0..=limits::SPEED_MPS).contains(&speed_mps)) {
            return Err(DrawingFault::Route(shorten_text(element.name)));
        }
        if self.routes.len() == limits::PEOPLE {
            return Err(DrawingFault::TooManyPeople);
        }
        self.routes.push(route);
        Ok(())
    }

    fn draw_shape(
        &mut self,
        element: &DrawingElement<'_>,
        drawing_from_content: Affine,
    ) -> Result<(), DrawingFault> {
        let outline = shapes::trace_outline(element, drawing_from_content.growth())?
            .ok_or_else(|| DrawingFault::UnknownElement(shorten_text(element.name)))?;
        for polyline in outline {
            let mut last = None;
            for (x, y) in polyline {
                let (x_m, y_m) = check_coordinates(drawing_from_content.point(x, y))?;
                let to_m = (x_m, -y_m);
                if let Some(from_m) = last.replace(to_m)
                    && from_m != to_m
                {
                    self.segments.push(Segment { from_m, to_m });
                }
            }
            if self.segments.len() > limits::SEGMENTS {
                return Err(DrawingFault::TooManySegments);
            }
        }
        Ok(())
    }

    pub(super) fn finish(self, start: &WorldStart) -> Result<WorldDrawing, DrawingFault> {
        if self.element_count == 0 {
            return Err(DrawingFault::Empty);
        }
        let drawn = self.starts.iter().find(|drawn| drawn.id == start.id);
        // On the sheet y points down.
        let given = start.otherwise.map(|pose| Pose2 { y_m: -pose.y_m, ..pose });
        let (pose, start_line) = match (drawn, given) {
            (Some(drawn), _) => (drawn.pose, Some(drawn.line)),
            // A name that was requested and does not exist is a mistake, whatever else is given.
            (None, Some(pose)) if start.id == WorldStart::default().id => (pose, None),
            (None, _) => return Err(DrawingFault::NoStart(shorten_text(&start.id))),
        };
        if self.segments.is_empty() {
            return Err(DrawingFault::NoWalls);
        }
        Ok(WorldDrawing { segments: self.segments, start: pose, start_line, routes: self.routes })
    }
}

/// Refuses a point that is too far out, or not a number at all.
fn check_coordinates((x, y): (f64, f64)) -> Result<(f64, f64), DrawingFault> {
    let is_within = x.abs() <= limits::COORDINATE_M && y.abs() <= limits::COORDINATE_M;
    if is_within { Ok((x, y)) } else { Err(DrawingFault::TooFar) }
}
