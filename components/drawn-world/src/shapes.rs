//! From one SVG element to polylines in its own coordinates.

use std::f64::consts::{PI, TAU};

use crate::element::DrawingElement;
use crate::fault::DrawingFault;
use crate::numbers::Numbers;
use crate::path_data;

/// How far a drawn circle may be from the polygon that stands for it (metres): well below what a
/// laser resolves.
const CHORD_ERROR_M: f64 = 0.0005;

type Polyline = Vec<(f64, f64)>;

/// The outline of a shape, or nothing for an element that is not a shape. `growth` is by how much
/// the transforms around it enlarge it.
pub(super) fn trace_outline(
    element: &DrawingElement<'_>,
    growth: f64,
) -> Result<Option<Vec<Polyline>>, DrawingFault> {
    Ok(Some(match element.name {
        "line" => vec![trace_line(element)?],
        "polyline" => vec![read_points(element)?],
        "polygon" => vec![close_polyline(read_points(element)?)],
        "rect" => vec![trace_rect(element)?],
        "circle" => vec![trace_circle(element, growth)?],
        "path" => path_data::parse_polylines(element.text("d").unwrap_or(""))?,
        _ => return Ok(None),
    }))
}

fn trace_line(element: &DrawingElement<'_>) -> Result<Polyline, DrawingFault> {
    let end = |x, y| Ok((element.number(x)?.unwrap_or(0.0), element.number(y)?.unwrap_or(0.0)));
    Ok(vec![end("x1", "y1")?, end("x2", "y2")?])
}

fn read_points(element: &DrawingElement<'_>) -> Result<Polyline, DrawingFault> {
    let text = element.text("points").unwrap_or("");
    let mut numbers = Numbers::new(text);
    let values: Vec<f64> = std::iter::from_fn(|| numbers.number()).collect();
    if !numbers.rest().is_empty() {
        return Err(element.bad_number("points", numbers.rest()));
    }
    if !values.len().is_multiple_of(2) {
        return Err(DrawingFault::OddPoints(values.len()));
    }
    Ok(values.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect())
}

fn close_polyline(mut polyline: Polyline) -> Polyline {
    polyline.extend(polyline.first().copied());
    polyline
}

fn trace_rect(element: &DrawingElement<'_>) -> Result<Polyline, DrawingFault> {
    for radius in ["rx", "ry"] {
        if element.number(radius)?.is_some_and(|radius| radius != 0.0) {
            return Err(DrawingFault::RoundedCorners(radius));
        }
    }
    let (x, y) = (element.number("x")?.unwrap_or(0.0), element.number("y")?.unwrap_or(0.0));
    let (width, height) = (element.size("width")?, element.size("height")?);
    Ok(close_polyline(vec![(x, y), (x + width, y), (x + width, y + height), (x, y + height)]))
}

fn trace_circle(element: &DrawingElement<'_>, growth: f64) -> Result<Polyline, DrawingFault> {
    let (x, y) = (element.number("cx")?.unwrap_or(0.0), element.number("cy")?.unwrap_or(0.0));
    let radius = element.size("r")?;
    if radius == 0.0 {
        return Ok(Vec::new());
    }
    let corners = circle_corners(radius * growth);
    let corner = |i: u32| {
        let (sin, cos) = libm::sincos(TAU * f64::from(i) / f64::from(corners));
        (x + radius * cos, y + radius * sin)
    };
    Ok(close_polyline((0..corners).map(corner).collect()))
}

/// How many corners keep the polygon within the chord error.
fn circle_corners(radius_m: f64) -> u32 {
    let half_angle = libm::acos((1.0 - CHORD_ERROR_M / radius_m).clamp(-1.0, 1.0));
    // A circle of the largest radius allowed would need some 3,000.
    libm::ceil(PI / half_angle).clamp(12.0, 4096.0) as u32
}
