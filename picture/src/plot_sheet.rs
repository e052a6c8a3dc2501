//! A sheet of lines, bars and text, written as SVG or PNG. Positions are in points from the top
//! left corner.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::canvas::{RgbCanvas, RgbColour};

/// Pixels of a PNG for each point.
const PIXELS_PER_POINT: f64 = 2.0;
/// Height of the letters, in points.
const LETTER_HEIGHT: f64 = 13.0;

/// Why a sheet was not written.
#[derive(Debug, thiserror::Error)]
pub enum SheetError {
    /// The file name has another ending.
    #[error("{} ends in neither .svg nor .png; choose one of them", .0.display())]
    UnknownFormat(PathBuf),
    /// The file system refused it.
    #[error("cannot write {}", .0.display())]
    Unwritable(PathBuf, #[source] std::io::Error),
    /// The sheet is empty, or too large for a PNG.
    #[error("cannot encode a PNG")]
    Unencodable(#[from] png::EncodingError),
}

/// The format of a picture, chosen by the ending of its file name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PictureFormat {
    /// Scalable Vector Graphics.
    Svg,
    /// Portable Network Graphics.
    Png,
}

impl PictureFormat {
    /// Returns the format that a file's name asks for.
    ///
    /// # Errors
    /// If the name ends in neither `.svg` nor `.png`.
    pub fn from_path(path: &Path) -> Result<Self, SheetError> {
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(SheetError::UnknownFormat(path.into())),
        }
    }
}

enum SheetShape {
    Line { points: Vec<(f64, f64)>, colour: RgbColour },
    Bar { corner: (f64, f64), size: (f64, f64), colour: RgbColour },
    Text { at: (f64, f64), text: String },
}

/// A sheet of fixed width that grows downwards as rows are added.
pub struct PlotSheet {
    width: f64,
    height: f64,
    shapes: Vec<SheetShape>,
}

impl PlotSheet {
    /// Makes an empty sheet of a width in points.
    pub fn new(width: f64) -> Self {
        Self { width, height: 0.0, shapes: Vec::new() }
    }

    /// Returns the width in points.
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Adds a row of a height below the others, and returns its upper edge.
    pub fn add_row(&mut self, height: f64) -> f64 {
        self.height += height;
        self.height - height
    }

    /// Draws a line through the points.
    pub fn draw_line(&mut self, points: Vec<(f64, f64)>, colour: RgbColour) {
        self.shapes.push(SheetShape::Line { points, colour });
    }

    /// Fills a rectangle, given its top left corner.
    pub fn fill_bar(&mut self, corner: (f64, f64), size: (f64, f64), colour: RgbColour) {
        self.shapes.push(SheetShape::Bar { corner, size, colour });
    }

    /// Writes ASCII text; `at` is the left end of its baseline.
    pub fn draw_text(&mut self, at: (f64, f64), text: impl Into<String>) {
        self.shapes.push(SheetShape::Text { at, text: text.into() });
    }

    /// Writes the sheet to a file, in the format that the file's name asks for.
    ///
    /// # Errors
    /// If the name has another ending, or the file cannot be written.
    pub fn write_file(&self, path: &Path) -> Result<(), SheetError> {
        let bytes = match PictureFormat::from_path(path)? {
            PictureFormat::Svg => self.to_svg().into_bytes(),
            PictureFormat::Png => self.encode_png()?,
        };
        std::fs::write(path, bytes).map_err(|error| SheetError::Unwritable(path.into(), error))
    }

    /// Returns the sheet as an SVG file.
    pub fn to_svg(&self) -> String {
        let (width, height) = (self.width, self.height);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"{LETTER_HEIGHT}\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
        );
        for shape in &self.shapes {
            // Writing to a string cannot fail.
            let _ = match shape {
                SheetShape::Line { points, colour } => {
                    let mut coordinates = String::new();
                    for (x, y) in points {
                        let _ = write!(coordinates, "{x:.1},{y:.1} ");
                    }
                    let colour = format_hex(*colour);
                    writeln!(
                        svg,
                        "<polyline fill=\"none\" stroke=\"{colour}\" points=\"{coordinates}\"/>"
                    )
                }
                SheetShape::Bar { corner: (x, y), size: (w, h), colour } => writeln!(
                    svg,
                    "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"{}\"/>",
                    format_hex(*colour)
                ),
                SheetShape::Text { at: (x, y), text } => {
                    writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\">{text}</text>")
                }
            };
        }
        svg + "</svg>\n"
    }

    /// Returns the sheet as a PNG file.
    ///
    /// # Errors
    /// If the sheet is too large for the format.
    pub fn encode_png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let pixels = |points: f64| (points * PIXELS_PER_POINT).round();
        let size = |points: f64| pixels(points).max(1.0) as usize;
        let mut canvas = RgbCanvas::new(size(self.width), size(self.height), [255; 3]);
        let place = |(x, y): (f64, f64)| (pixels(x), pixels(y));
        for shape in &self.shapes {
            match shape {
                SheetShape::Line { points, colour } => {
                    for pair in points.windows(2) {
                        canvas.draw_line(place(pair[0]), place(pair[1]), 0, *colour);
                    }
                }
                SheetShape::Bar { corner, size, colour } => {
                    let ((x, y), (w, h)) = (place(*corner), place(*size));
                    canvas.fill_rectangle(x as i32, y as i32, w.max(1.0) as i32, h as i32, *colour);
                }
                SheetShape::Text { at: (x, y), text } => {
                    // The canvas wants the top of the letters, two points below their full height.
                    let (x, y) = place((*x, *y - LETTER_HEIGHT + 2.0));
                    canvas.draw_text(x as i32, y as i32, text, [0; 3]);
                }
            }
        }
        canvas.encode_png()
    }
}

fn format_hex([red, green, blue]: RgbColour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_endings_are_refused() {
        let error = PlotSheet::new(10.0).write_file(Path::new("errors.gif")).unwrap_err();
        let error = error.to_string();
        assert!(error.contains("errors.gif") && error.contains(".svg"), "{error}");
    }

    #[test]
    fn both_formats_are_as_wide_as_the_sheet() {
        let mut sheet = PlotSheet::new(10.0);
        let top = sheet.add_row(4.0);
        sheet.fill_bar((1.0, top), (2.0, 3.0), [1, 2, 3]);
        assert!(sheet.to_svg().contains("viewBox=\"0 0 10 4\""), "{}", sheet.to_svg());
        let bytes = sheet.encode_png().expect("encoded");
        let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        assert_eq!((reader.info().width, reader.info().height), (20, 8));
    }
}
