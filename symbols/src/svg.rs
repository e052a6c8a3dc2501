//! Shapes as SVG.

use std::fmt::Write;

use crate::outline::{PaintRole, PathStep, Position, SymbolShape};

/// Shapes as an SVG image of these bounds, with a margin of a twentieth of the height.
pub fn svg_of(
    shapes: &[SymbolShape],
    [low, high]: [Position; 2],
    color: impl Fn(PaintRole) -> [u8; 3],
) -> String {
    let margin = (high[1] - low[1]) / 20.0;
    let (width, height) = (high[0] - low[0] + 2.0 * margin, high[1] - low[1] + 2.0 * margin);
    let (left, top) = (number(low[0] - margin), number(low[1] - margin));
    let (width, height) = (number(width), number(height));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{left} {top} {width} {height}\">\n"
    );
    for shape in shapes {
        write_shape(&mut svg, shape, &color);
    }
    svg.push_str("</svg>\n");
    svg
}

fn write_shape(svg: &mut String, shape: &SymbolShape, color: &impl Fn(PaintRole) -> [u8; 3]) {
    let hex = |role| {
        let [red, green, blue] = color(role);
        format!("#{red:02x}{green:02x}{blue:02x}")
    };
    let fill = shape.fill.map_or_else(|| "none".to_owned(), hex);
    svg.push_str("<path d=\"");
    write_steps(svg, &shape.steps);
    // Writing to a string cannot fail.
    let _ = write!(svg, "\" fill=\"{fill}\"");
    if let Some(line) = shape.line {
        let width = number(line.width);
        let _ = write!(svg, " stroke=\"{}\" stroke-width=\"{width}\"", hex(line.role));
        if let Some([dash, gap]) = line.dash {
            let _ = write!(svg, " stroke-dasharray=\"{} {}\"", number(dash), number(gap));
        }
    }
    match &shape.text {
        Some(text) => {
            let _ = writeln!(svg, "><title>{}</title></path>", escape(text));
        }
        None => svg.push_str("/>\n"),
    }
}

fn write_steps(svg: &mut String, steps: &[PathStep]) {
    for step in steps {
        let (letter, positions): (char, &[Position]) = match step {
            PathStep::Move(to) => ('M', &[*to]),
            PathStep::Line(to) => ('L', &[*to]),
            PathStep::Curve(first, second, to) => ('C', &[*first, *second, *to]),
            PathStep::Close => ('Z', &[]),
        };
        svg.push(letter);
        for (index, [x, y]) in positions.iter().enumerate() {
            let space = if index == 0 { "" } else { " " };
            let _ = write!(svg, "{space}{} {}", number(*x), number(*y));
        }
    }
}

/// A number with at most two decimals.
fn number(value: f64) -> String {
    let rounded = (value * 100.0).round() / 100.0;
    // Adding zero turns -0 into 0.
    format!("{}", rounded + 0.0)
}

/// XML has no control characters, not even escaped ones.
fn escape(text: &str) -> String {
    let text: String = text.chars().filter(|character| !character.is_control()).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::polyline;

    #[test]
    fn a_shape_is_a_path_with_its_colours_and_text() {
        let mut shape = SymbolShape::line(polyline(&[[0.0, -0.001], [10.0, 4.5]], true), 2.5);
        shape.text = Some("A&B".into());
        let svg = svg_of(&[shape], [[0.0, 0.0], [20.0, 20.0]], |_| [255, 0, 16]);
        assert!(svg.contains("viewBox=\"-1 -1 22 22\""), "{svg}");
        assert!(
            svg.contains(
                "d=\"M0 0L10 4.5Z\" fill=\"none\" stroke=\"#ff0010\" stroke-width=\"2.5\""
            ),
            "{svg}"
        );
        assert!(svg.contains("<title>A&amp;B</title>"), "{svg}");
    }
}
