//! Reads a world from an SVG drawing, as the simulator and the map view show it. Pure but for
//! [`WorldDrawing::read`]. In a drawing 1 user unit is 1 m, y up (SVG's y points down, so it is
//! negated), shapes are outlines of solid things. What is drawn is what the robot meets: an element
//! without a geometry here is refused, not skipped, unless it is marked as annotation.

mod affine;
mod element;
mod fault;
mod limits;
mod numbers;
mod path_data;
mod route;
mod segment;
mod shapes;
mod sheet;
mod start;
#[cfg(test)]
mod tests;

use std::io::Read;
use std::path::Path;

use armor_grid::Pose2;
use quick_xml::Reader;

pub use fault::{DrawingError, DrawingFault};
pub use limits::SEGMENTS as MAX_SEGMENTS;
pub use route::WalkedRoute;
pub use segment::Segment;
use sheet::DrawingSheet;
pub use start::WorldStart;

/// The contents of a drawing, in its own frame with y up.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldDrawing {
    /// Everything solid, in the order drawn; never empty.
    pub segments: Vec<Segment>,
    /// Where the robot begins.
    pub start: Pose2,
    /// The line of the start in the file, if it is drawn.
    pub start_line: Option<usize>,
    /// The routes that people walk.
    pub routes: Vec<WalkedRoute>,
}

impl WorldDrawing {
    /// Reads a drawing file in which a robot begins at `start`.
    ///
    /// # Errors
    /// The first fault found, with file and line.
    pub fn read(path: &Path, start: &WorldStart) -> Result<Self, DrawingError> {
        let file = path.display().to_string();
        let mut bytes = Vec::new();
        // One byte more than allowed distinguishes a full file from one that is too large.
        std::fs::File::open(path)
            .and_then(|opened| opened.take(limits::BYTES as u64 + 1).read_to_end(&mut bytes))
            .map_err(|e| DrawingError {
                file: file.clone(),
                line: 0,
                fault: DrawingFault::Unreadable(e.to_string()),
            })?;
        Self::parse(&file, &bytes, start)
    }

    /// Reads a drawing from bytes; `file` is only used to name it in errors.
    ///
    /// # Errors
    /// The first fault found, with file and line.
    pub fn parse(file: &str, bytes: &[u8], start: &WorldStart) -> Result<Self, DrawingError> {
        let whole_file = |fault| DrawingError { file: file.to_owned(), line: 0, fault };
        if bytes.len() > limits::BYTES {
            return Err(whole_file(DrawingFault::TooLarge));
        }
        let text = std::str::from_utf8(bytes).map_err(|_| whole_file(DrawingFault::NotUtf8))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut sheet = DrawingSheet::default();
        let mut reader = Reader::from_str(text);
        loop {
            let offset = reader.buffer_position();
            let done = match reader.read_event() {
                Ok(event) => sheet.take(&event, || line_of(text, offset)),
                Err(e) => Err(DrawingFault::Xml(e.to_string())),
            };
            match done {
                Ok(false) => {}
                Ok(true) => return sheet.finish(start).map_err(whole_file),
                Err(fault) => {
                    let line = line_of(text, offset);
                    return Err(DrawingError { file: file.to_owned(), line, fault });
                }
            }
        }
    }
}

fn line_of(text: &str, offset: u64) -> usize {
    let end = usize::try_from(offset).unwrap_or(usize::MAX).min(text.len());
    1 + text.as_bytes()[..end].iter().filter(|&&byte| byte == b'\n').count()
}
