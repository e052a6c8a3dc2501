//! The straight part of SVG path data: M, L, H, V, Z, absolute and relative.

use crate::fault::{DrawingFault, shorten_text};
use crate::numbers::Numbers;

/// Reads path data into polylines; a closed one ends where it began.
pub(super) fn parse_polylines(data: &str) -> Result<Vec<Vec<(f64, f64)>>, DrawingFault> {
    let mut pen = Pen::default();
    let mut text = Numbers::new(data);
    let mut command = None;
    while !text.rest().is_empty() {
        let here = text.rest();
        command = match (text.read_letter(), command) {
            (Some(letter), _) => Some(letter),
            // Numbers without a letter repeat the command; after a move they draw lines.
            (None, Some('M')) => Some('L'),
            (None, Some('m')) => Some('l'),
            (None, Some('Z' | 'z') | None) => {
                return Err(DrawingFault::PathData(shorten_text(here)));
            }
            (None, repeated) => repeated,
        };
        if let Some(letter) = command {
            pen.draw_command(letter, &mut text, here)?;
        }
    }
    pen.lift_pen();
    Ok(pen.finished)
}

#[derive(Default)]
struct Pen {
    at: (f64, f64),
    current: Vec<(f64, f64)>,
    finished: Vec<Vec<(f64, f64)>>,
}

impl Pen {
    fn draw_command(
        &mut self,
        command: char,
        text: &mut Numbers<'_>,
        here: &str,
    ) -> Result<(), DrawingFault> {
        let mut number = || text.number().ok_or_else(|| DrawingFault::PathData(shorten_text(here)));
        let (x, y) = self.at;
        let (from_x, from_y) = if command.is_ascii_lowercase() { (x, y) } else { (0.0, 0.0) };
        let to = match command.to_ascii_uppercase() {
            'M' | 'L' => (from_x + number()?, from_y + number()?),
            'H' => (from_x + number()?, y),
            'V' => (x, from_y + number()?),
            'Z' => return self.close_polyline(here),
            'C' | 'S' | 'Q' | 'T' | 'A' => return Err(DrawingFault::PathCommand(command)),
            _ => return Err(DrawingFault::PathData(shorten_text(here))),
        };
        if matches!(command, 'M' | 'm') {
            self.lift_pen();
        } else if self.current.is_empty() {
            return Err(DrawingFault::PathData(shorten_text(here)));
        }
        self.current.push(to);
        self.at = to;
        Ok(())
    }

    fn close_polyline(&mut self, here: &str) -> Result<(), DrawingFault> {
        let first =
            *self.current.first().ok_or_else(|| DrawingFault::PathData(shorten_text(here)))?;
        self.current.push(first);
        self.lift_pen();
        // What follows without a move begins where this one began.
        self.at = first;
        self.current.push(first);
        Ok(())
    }

    fn lift_pen(&mut self) {
        let polyline = std::mem::take(&mut self.current);
        if polyline.len() > 1 {
            self.finished.push(polyline);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absolute_and_relative_draw_the_same() {
        let corner = vec![vec![(1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 1.0)]];
        for data in
            ["M1 1 L3 1 L3 2 Z", "m1,1 l2,0 0,1z", "M1 1H3V2Z", "M1,1h2v1z", "M1 1 3 1 3 2Z"]
        {
            assert_eq!(parse_polylines(data), Ok(corner.clone()), "{data}");
        }
    }

    #[test]
    fn subpaths_are_separate_and_go_on_after_a_close() {
        let drawn = parse_polylines("M0 0H1 M5 5v1z l1 0").expect("readable");
        assert_eq!(
            drawn,
            [
                vec![(0.0, 0.0), (1.0, 0.0)],
                vec![(5.0, 5.0), (5.0, 6.0), (5.0, 5.0)],
                vec![(5.0, 5.0), (6.0, 5.0)],
            ]
        );
    }

    #[test]
    fn what_bends_or_breaks_is_refused() {
        assert_eq!(parse_polylines("M0 0 C 1 1 2 2 3 3"), Err(DrawingFault::PathCommand('C')));
        assert_eq!(parse_polylines("M0 0 a1 1 0 0 0 2 2"), Err(DrawingFault::PathCommand('a')));
        for data in ["L1 1", "1 2", "M1", "M1 1 L2", "M1 1 Z 3 3", "M0 0 X", "M0 0 #", "Z"] {
            let refused = parse_polylines(data);
            assert!(matches!(refused, Err(DrawingFault::PathData(_))), "{data}: {refused:?}");
        }
    }
}
