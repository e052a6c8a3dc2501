//! Collects the walls and the start from the XML events of a drawing.

use quick_xml::events::{BytesStart, Event};

use super::affine::Affine;
use super::element::Element;
use super::fault::{DrawingFault, shortened};
use super::{Drawing, Segment, limits, shapes};
use crate::pose::Pose2;

/// An element that is open: how its content is transformed, and whether the robot sees it.
#[derive(Clone, Copy)]
struct Open {
    drawing_from_content: Affine,
    is_ignored: bool,
}

/// What has been read so far.
#[derive(Default)]
pub(super) struct Sheet {
    open: Vec<Open>,
    element_count: usize,
    segments: Vec<Segment>,
    start: Option<(Pose2, usize)>,
}

impl Sheet {
    /// Takes one event; true at the end of the file.
    pub(super) fn take(
        &mut self,
        event: &Event<'_>,
        line: impl Fn() -> usize,
    ) -> Result<bool, DrawingFault> {
        match event {
            Event::Start(tag) => {
                let open = self.element(tag, line)?;
                self.open.push(open);
            }
            Event::Empty(tag) => {
                self.element(tag, line)?;
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

    fn element(
        &mut self,
        tag: &BytesStart<'_>,
        line: impl Fn() -> usize,
    ) -> Result<Open, DrawingFault> {
        self.element_count += 1;
        if self.element_count > limits::ELEMENTS {
            return Err(DrawingFault::TooManyElements);
        }
        if self.open.len() == limits::DEPTH {
            return Err(DrawingFault::TooDeep);
        }
        let element = Element::read(tag)?;
        let Some(&around) = self.open.last() else { return self.root(&element) };
        if around.is_ignored || element.is_ignored() {
            return Ok(Open { is_ignored: true, ..around });
        }
        let mut open = around;
        if let Some(transform) = element.text("transform") {
            open.drawing_from_content =
                around.drawing_from_content.after(Affine::parse(transform)?);
        }
        if element.text("id") == Some("start") {
            self.place_start(&element, open.drawing_from_content, line())?;
        } else if element.name != "g" {
            self.draw(&element, open.drawing_from_content)?;
        }
        Ok(open)
    }

    fn root(&mut self, element: &Element<'_>) -> Result<Open, DrawingFault> {
        if self.element_count > 1 {
            return Err(DrawingFault::Xml("a second outermost element".to_owned()));
        }
        if element.name != "svg" {
            return Err(DrawingFault::NotSvg(shortened(element.name)));
        }
        Ok(Open { drawing_from_content: Affine::IDENTITY, is_ignored: false })
    }

    fn place_start(
        &mut self,
        element: &Element<'_>,
        drawing_from_content: Affine,
        line: usize,
    ) -> Result<(), DrawingFault> {
        if element.name != "circle" {
            return Err(DrawingFault::StartNotCircle(shortened(element.name)));
        }
        if self.start.is_some() {
            return Err(DrawingFault::SecondStart);
        }
        let coordinate = |name| Ok(element.number(name)?.unwrap_or(0.0));
        let (x_m, y_m) = within(drawing_from_content.point(coordinate("cx")?, coordinate("cy")?))?;
        let (sin, cos) = libm::sincos(coordinate("data-heading")?.to_radians());
        // The heading is given with y up; the transform works with y down, on both sides of it.
        let (ahead, down) = drawing_from_content.direction(cos, -sin);
        self.start = Some((Pose2::new(x_m, -y_m, libm::atan2(-down, ahead)), line));
        Ok(())
    }

    fn draw(
        &mut self,
        element: &Element<'_>,
        drawing_from_content: Affine,
    ) -> Result<(), DrawingFault> {
        let outline = shapes::outline(element, drawing_from_content.growth())?
            .ok_or_else(|| DrawingFault::UnknownElement(shortened(element.name)))?;
        for polyline in outline {
            let mut last = None;
            for (x, y) in polyline {
                let (x_m, y_m) = within(drawing_from_content.point(x, y))?;
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

    pub(super) fn finish(self) -> Result<Drawing, DrawingFault> {
        if self.element_count == 0 {
            return Err(DrawingFault::Empty);
        }
        let (start, start_line) = self.start.ok_or(DrawingFault::NoStart)?;
        if self.segments.is_empty() {
            return Err(DrawingFault::NoWalls);
        }
        Ok(Drawing { segments: self.segments, start, start_line })
    }
}

/// Refuses a point that is too far out, or not a number at all.
fn within((x, y): (f64, f64)) -> Result<(f64, f64), DrawingFault> {
    let is_within = x.abs() <= limits::COORDINATE_M && y.abs() <= limits::COORDINATE_M;
    if is_within { Ok((x, y)) } else { Err(DrawingFault::TooFar) }
}
