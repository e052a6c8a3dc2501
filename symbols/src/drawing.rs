//! The language of the table of icons: a few verbs for lines, circles and areas.
//!
//! Statements are separated by `;`. A position is `x,y` from the octagon's centre. In a row of
//! positions, `~x,y,x,y,x,y` is a cubic curve: two control points and its end. A coordinate is a
//! number or a length of the frame (`Measures`), with or without `-`. `[fu]` before a
//! statement limits it to the frames of friends and unknown; `n` is neutral, `h` hostile.

use crate::frame::FrameGroup;
use crate::outline::{
    PaintRole, PathStep, Position, ShapeLine, SymbolShape, arc, capsule, ellipse, rectangle,
};
use crate::stroke_text::centred_text;

/// A statement that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{statement}`: {problem}")]
pub(crate) struct DrawingError {
    statement: String,
    problem: &'static str,
}

/// The lengths of a frame that icons which touch it need.
#[derive(Debug, Clone, Copy)]
struct Measures {
    group: FrameGroup,
}

impl Measures {
    /// A length by its name, for each frame: unknown, friend, neutral, hostile.
    fn length(self, name: &str) -> Option<f64> {
        let of_frames = match name {
            // Extent of the frame.
            "t" => [-171.0, -120.0, -132.0, -170.0],
            "b" => [171.0, 120.0, 132.0, 170.0],
            "l" => [-174.0, -177.0, -132.0, -168.0],
            "r" => [174.0, 176.0, 132.0, 168.0],
            // Where diagonals meet the frame: of the cross of infantry, and of all others.
            "sx" => [85.0, 179.5, 132.0, 85.5],
            "sy" => [85.0, 120.0, 132.0, 86.5],
            "cx" => [120.0, 179.5, 132.0, 104.0],
            "cy" => [79.0, 120.0, 132.0, 70.0],
            // The feet of the wedge of antitank.
            "ax" => [140.0, 179.5, 132.0, 125.0],
            "ay" => [67.5, 119.5, 57.5, 49.3],
            // Half of the line that supplies stand on.
            "qx" => [160.0, 182.0, 133.0, 130.0],
            _ => return None,
        };
        Some(
            of_frames[match self.group {
                FrameGroup::Unknown => 0,
                FrameGroup::Friend => 1,
                FrameGroup::Neutral => 2,
                FrameGroup::Hostile => 3,
            }],
        )
    }

    fn coordinate(self, word: &str) -> Option<f64> {
        if let Ok(number) = word.parse() {
            return Some(number);
        }
        match word.strip_prefix('-') {
            Some(name) => self.length(name).map(|length| -length),
            None => self.length(word),
        }
    }

    fn coordinates(self, word: &str) -> Option<Vec<f64>> {
        word.split(',').map(|part| self.coordinate(part)).collect()
    }

    fn position(self, word: &str) -> Option<Position> {
        self.coordinates(word)?.try_into().ok()
    }
}

/// Reads a drawing into shapes, for frames of this group.
pub(crate) fn read_drawing(
    drawing: &str,
    group: FrameGroup,
) -> Result<Vec<SymbolShape>, DrawingError> {
    let measures = Measures { group };
    let mut pen = 5.0;
    let mut shapes = Vec::new();
    for statement in drawing.split(';').map(str::trim).filter(|statement| !statement.is_empty()) {
        let problem = |problem| DrawingError { statement: statement.to_owned(), problem };
        let mut rest = statement;
        if let Some(limited) = statement.strip_prefix('[') {
            let (groups, after) = limited.split_once(']').ok_or_else(|| problem("no `]`"))?;
            if !groups.contains(group.letter()) {
                continue;
            }
            rest = after;
        }
        let mut words = rest.split_ascii_whitespace();
        let verb = words.next().unwrap_or_default();
        let words: Vec<&str> = words.collect();
        if verb == "pen" {
            pen = words
                .first()
                .and_then(|word| word.parse().ok())
                .ok_or_else(|| problem("no width"))?;
            continue;
        }
        shapes.push(draw(verb, &words, pen, measures).ok_or_else(|| problem("unreadable"))?);
    }
    Ok(shapes)
}

/// One statement as a shape.
fn draw(verb: &str, words: &[&str], pen: f64, measures: Measures) -> Option<SymbolShape> {
    let position = |index: usize| measures.position(words.get(index)?);
    let number = |index: usize| measures.coordinate(words.get(index)?);
    let role = PaintRole::Icon;
    Some(match verb {
        "line" => SymbolShape::line(row(words, measures, false)?, pen),
        "loop" => SymbolShape::line(row(words, measures, true)?, pen),
        "fill" => SymbolShape::filled(row(words, measures, true)?, role),
        "solid" => both(row(words, measures, true)?, role, pen),
        "open" => both(row(words, measures, true)?, PaintRole::IconFill, pen),
        "circle" => SymbolShape::line(round(position(0)?, number(1)?), pen),
        "disc" => SymbolShape::filled(round(position(0)?, number(1)?), role),
        "wheel" => both(round(position(0)?, number(1)?), PaintRole::IconFill, pen),
        "ellipse" => SymbolShape::line(ellipse(position(0)?, position(1)?), pen),
        "oval" => SymbolShape::filled(ellipse(position(0)?, position(1)?), role),
        "box" => SymbolShape::line(rectangle(position(0)?, position(1)?), pen),
        "block" => SymbolShape::filled(rectangle(position(0)?, position(1)?), role),
        "capsule" => {
            let radii = position(2)?;
            SymbolShape::line(capsule(position(0)?, number(1)?, radii), pen)
        }
        "arc" => {
            let [from, to] = position(2)?;
            SymbolShape::line(arc(position(0)?, position(1)?, from, to), pen)
        }
        "text" => centred_text(words.get(2)?, position(0)?, number(1)?),
        _ => return None,
    })
}

fn round(centre: Position, radius: f64) -> Vec<PathStep> {
    ellipse(centre, [radius, radius])
}

fn both(steps: Vec<PathStep>, fill: PaintRole, width: f64) -> SymbolShape {
    let line = Some(ShapeLine { role: PaintRole::Icon, width, dash: None });
    SymbolShape { steps, fill: Some(fill), line, text: None }
}

/// A row of positions and curves.
fn row(words: &[&str], measures: Measures, closed: bool) -> Option<Vec<PathStep>> {
    let mut steps = Vec::with_capacity(words.len() + 1);
    for word in words {
        match word.strip_prefix('~') {
            Some(curve) => {
                let [ax, ay, bx, by, x, y] = measures.coordinates(curve)?.try_into().ok()?;
                steps.push(PathStep::Curve([ax, ay], [bx, by], [x, y]));
            }
            None => {
                let to = measures.position(word)?;
                steps.push(if steps.is_empty() { PathStep::Move(to) } else { PathStep::Line(to) });
            }
        }
    }
    if !matches!(steps.first(), Some(PathStep::Move(_))) || steps.len() < 2 {
        return None;
    }
    if closed {
        steps.push(PathStep::Close);
    }
    Some(steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::polyline;

    #[test]
    fn a_statement_is_read_for_its_frames_only() {
        let count =
            |group| read_drawing("[fn] line 0,t 0,b; disc 0,0 4", group).expect("valid").len();
        assert_eq!(count(FrameGroup::Friend), 2);
        assert_eq!(count(FrameGroup::Hostile), 1);
    }

    #[test]
    fn a_length_of_the_frame_replaces_a_number() {
        let shapes = read_drawing("line -sx,t sx,b", FrameGroup::Friend).expect("valid");
        assert_eq!(shapes[0].steps, polyline(&[[-179.5, -120.0], [179.5, 120.0]], false));
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        for (drawing, part) in [
            ("disc 0,0 4; spiral 1,2", "spiral"),
            ("line 0,0 q,4", "unreadable"),
            ("line 0,0", "unreadable"),
            ("fill ~1,2,3,4,5,6 1,1", "unreadable"),
            ("[f line 0,0 1,1", "no `]`"),
        ] {
            let error = read_drawing(drawing, FrameGroup::Friend).expect_err(drawing).to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
