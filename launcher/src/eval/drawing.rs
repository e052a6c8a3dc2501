//! A few shapes on a sheet, as SVG or PNG. Positions are in points from the top left corner.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};
use armor_map_writer::canvas::{Canvas, Colour};

/// Pixels of a PNG for each point.
const SCALE: f64 = 2.0;
/// Height of the letters, in points.
const LETTER: f64 = 13.0;

/// What is drawn.
enum Shape {
    Line { points: Vec<(f64, f64)>, colour: Colour },
    Bar { corner: (f64, f64), size: (f64, f64), colour: Colour },
    Text { at: (f64, f64), words: String },
}

/// A sheet of a width, as high as what is drawn on it.
pub struct Drawing {
    width: f64,
    height: f64,
    shapes: Vec<Shape>,
}

/// The form of a picture, by the ending of its file's name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    Svg,
    Png,
}

impl Form {
    /// # Errors
    /// If it is another ending.
    pub fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => bail!("{} is neither .svg nor .png; name it so", path.display()),
        }
    }
}

impl Drawing {
    pub fn new(width: f64) -> Self {
        Self { width, height: 0.0, shapes: Vec::new() }
    }

    pub fn width(&self) -> f64 {
        self.width
    }

    /// Adds room below; gives where it begins.
    pub fn room(&mut self, height: f64) -> f64 {
        self.height += height;
        self.height - height
    }

    pub fn line(&mut self, points: Vec<(f64, f64)>, colour: Colour) {
        self.shapes.push(Shape::Line { points, colour });
    }

    /// A rectangle from its top left corner.
    pub fn bar(&mut self, corner: (f64, f64), size: (f64, f64), colour: Colour) {
        self.shapes.push(Shape::Bar { corner, size, colour });
    }

    /// ASCII words from the left end of their foot.
    pub fn text(&mut self, at: (f64, f64), words: impl Into<String>) {
        self.shapes.push(Shape::Text { at, words: words.into() });
    }

    /// Writes it in the form that its name asks for.
    ///
    /// # Errors
    /// If the file cannot be written, or has neither ending.
    pub fn write(&self, path: &Path) -> Result<()> {
        let bytes = match Form::of(path)? {
            Form::Svg => self.svg().into_bytes(),
            Form::Png => self.png()?,
        };
        std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
    }

    fn svg(&self) -> String {
        let (width, height) = (self.width, self.height);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"{LETTER}\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
        );
        for shape in &self.shapes {
            // Writing to a string cannot fail.
            let _ = match shape {
                Shape::Line { points, colour } => {
                    let mut places = String::new();
                    for (x, y) in points {
                        let _ = write!(places, "{x:.1},{y:.1} ");
                    }
                    let colour = hex(*colour);
                    writeln!(
                        text,
                        "<polyline fill=\"none\" stroke=\"{colour}\" points=\"{places}\"/>"
                    )
                }
                Shape::Bar { corner: (x, y), size: (w, h), colour } => writeln!(
                    text,
                    "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"{}\"/>",
                    hex(*colour)
                ),
                Shape::Text { at: (x, y), words } => {
                    writeln!(text, "<text x=\"{x:.1}\" y=\"{y:.1}\">{words}</text>")
                }
            };
        }
        text + "</svg>\n"
    }

    fn png(&self) -> Result<Vec<u8>> {
        let pixels = |points: f64| (points * SCALE).round();
        let size = |points: f64| pixels(points).max(1.0) as usize;
        let mut canvas = Canvas::new(size(self.width), size(self.height), [255; 3]);
        let place = |(x, y): (f64, f64)| (pixels(x), pixels(y));
        for shape in &self.shapes {
            match shape {
                Shape::Line { points, colour } => {
                    for pair in points.windows(2) {
                        canvas.line(place(pair[0]), place(pair[1]), 0, *colour);
                    }
                }
                Shape::Bar { corner, size, colour } => {
                    let ((x, y), (w, h)) = (place(*corner), place(*size));
                    canvas.rectangle(x as i32, y as i32, w.max(1.0) as i32, h as i32, *colour);
                }
                Shape::Text { at: (x, y), words } => {
                    let (x, y) = place((*x, *y - LETTER + 2.0));
                    canvas.text(x as i32, y as i32, words, [0; 3]);
                }
            }
        }
        canvas.png().context("cannot make a PNG")
    }
}

fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
