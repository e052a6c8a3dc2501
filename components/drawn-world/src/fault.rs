//! What can be wrong with a drawing: each fault states its cause and a remedy.

use crate::limits;

/// A fault in a drawing file, with the place where it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}{}: {fault}", describe_place(*.line))]
pub struct DrawingError {
    /// The file as the caller named it.
    pub file: String,
    /// The line of the element at fault, counted from 1 (0: the file as a whole).
    pub line: usize,
    /// What is wrong there.
    pub fault: DrawingFault,
}

fn describe_place(line: usize) -> String {
    if line == 0 { String::new() } else { format!(":{line}") }
}

/// What is wrong with a drawing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DrawingFault {
    /// The file cannot be opened or read.
    #[error("cannot read the drawing: {0}; check the path and its permissions")]
    Unreadable(String),
    /// The file is larger than any drawing needs to be.
    #[error("more than {} bytes; simplify the drawing or split the world", limits::BYTES)]
    TooLarge,
    /// The bytes are not UTF-8.
    #[error("not UTF-8 text; save the drawing as plain SVG in UTF-8")]
    NotUtf8,
    /// The XML is not well-formed.
    #[error("not well-formed XML: {0}; correct it there or save the drawing again")]
    Xml(String),
    /// A document type, which could define entities.
    #[error("a <!DOCTYPE> is not read; delete that line, SVG needs none")]
    Doctype,
    /// The outermost element is not `<svg>`.
    #[error("the outermost element is <{0}>; a world is one <svg> element")]
    NotSvg(String),
    /// The file has no element at all.
    #[error("no <svg> element; a world is one <svg> element with shapes in it")]
    Empty,
    /// Elements are nested too deeply.
    #[error("nested deeper than {} elements; ungroup some", limits::DEPTH)]
    TooDeep,
    /// Too many elements.
    #[error("more than {} elements; simplify the drawing", limits::ELEMENTS)]
    TooManyElements,
    /// Too many attributes on one element.
    #[error("<{0}> has more than {max} attributes; remove some", max = limits::ATTRIBUTES)]
    TooManyAttributes(String),
    /// The shapes come to too many straight walls.
    #[error("more than {} straight segments in all; simplify the drawing", limits::SEGMENTS)]
    TooManySegments,
    /// An element that is drawn but that the simulator has no geometry for.
    #[error(
        "<{0}> has no geometry here; draw it with line, polyline, polygon, rect, circle or path, \
         or mark it class=\"annotation\" if the robot shall not see it"
    )]
    UnknownElement(String),
    /// A shape lacks an attribute that it needs.
    #[error("<{element}> lacks {attribute}; add {attribute}=\"…\" in metres")]
    MissingAttribute {
        /// The shape.
        element: String,
        /// What it lacks.
        attribute: &'static str,
    },
    /// A value is not a plain number.
    #[error(
        "{attribute}=\"{value}\" is not a plain number; write metres without a unit, as in 1.5"
    )]
    BadNumber {
        /// The attribute.
        attribute: String,
        /// Its value, shortened.
        value: String,
    },
    /// A width, height or radius is negative.
    #[error("{attribute}=\"{value}\" is negative; sizes are 0 or more")]
    NegativeSize {
        /// The attribute.
        attribute: &'static str,
        /// Its value in metres.
        value: f64,
    },
    /// A list of points has an x without a y.
    #[error("points=\"…\" has {0} numbers; write pairs x,y")]
    OddPoints(usize),
    /// Rounded corners on a rect.
    #[error("{0}=\"…\" rounds corners, which is not simulated; remove it or draw a path")]
    RoundedCorners(&'static str),
    /// A path command that bends.
    #[error("path command '{0}' is not read; use straight ones (M L H V Z): flatten the path")]
    PathCommand(char),
    /// Path data that breaks the grammar.
    #[error("path data near \"{0}\" is not readable; commands are M L H V Z with plain numbers")]
    PathData(String),
    /// A transform that is not read.
    #[error(
        "transform \"{0}\" is not readable; use translate, scale, rotate or matrix with plain numbers"
    )]
    Transform(String),
    /// A point lies too far out.
    #[error(
        "a point lies more than {} m from the origin; 1 user unit is 1 m, so scale the drawing down",
        limits::COORDINATE_M
    )]
    TooFar,
    /// There is no start.
    #[error(
        "no start; add <circle id=\"{0}\" class=\"start\" cx=\"…\" cy=\"…\" r=\"0.18\" \
         data-heading=\"0\"/> where the robot begins, or give start_x and start_y"
    )]
    NoStart(String),
    /// There is more than one start.
    #[error("a second id=\"{0}\"; keep one")]
    SecondStart(String),
    /// The start is not a circle.
    #[error("a start is drawn as <{0}>; it is a circle, <circle id=\"start\" …>")]
    StartNotCircle(String),
    /// What is marked as a person's route is none.
    #[error(
        "<{0} class=\"person\"> is no route to walk; draw one line, polyline, polygon or path of \
         straight pieces, with data-speed=\"…\" from 0 to {most} m/s",
        most = limits::SPEED_MPS
    )]
    Route(String),
    /// More people than allowed.
    #[error("more than {} people; remove some", limits::PEOPLE)]
    TooManyPeople,
    /// Nothing in the drawing is solid.
    #[error("nothing solid is drawn; add walls with line, polyline, polygon, rect, circle or path")]
    NoWalls,
}

/// Shortens a text from a file to what fits into a message.
pub(super) fn shorten_text(text: &str) -> String {
    const SHOWN: usize = 40;
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
