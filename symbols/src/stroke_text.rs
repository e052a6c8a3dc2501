//! Text as strokes: each character is a few lines on a grid of 4 by 6, so that a symbol looks the
//! same on every computer and needs no font.

use crate::outline::{PathStep, Position, SymbolShape, moved};

/// The distance from one character to the next, in units of the grid.
const ADVANCE: f64 = 5.6;
/// The height of a character, in units of the grid.
const HEIGHT: f64 = 6.0;

/// The strokes of a character: pairs of x and y, lines separated by spaces, strokes by bars.
fn strokes(character: char) -> &'static str {
    match character.to_ascii_uppercase() {
        'A' => "06 20 46|13 33",
        'B' => "00 06 36 45 44 33 03|00 30 41 42 33",
        'C' => "41 30 10 01 05 16 36 45",
        'D' => "00 06 26 44 42 20 00",
        'E' => "40 00 06 46|03 33",
        'F' => "40 00 06|03 33",
        'G' => "41 30 10 01 05 16 36 45 43 23",
        'H' => "00 06|40 46|03 43",
        'I' => "10 30|20 26|16 36",
        'J' => "40 45 36 16 05",
        'K' => "00 06|40 03 46",
        'L' => "00 06 46",
        'M' => "06 00 23 40 46",
        'N' => "06 00 46 40",
        'O' => "10 01 05 16 36 45 41 30 10",
        'P' => "06 00 30 41 42 33 03",
        'Q' => "10 01 05 16 36 45 41 30 10|24 46",
        'R' => "06 00 30 41 42 33 03|23 46",
        'S' => "41 30 10 01 02 13 33 44 45 36 16 05",
        'T' => "00 40|20 26",
        'U' => "00 05 16 36 45 40",
        'V' => "00 26 40",
        'W' => "00 16 23 36 40",
        'X' => "00 46|40 06",
        'Y' => "00 23 40|23 26",
        'Z' => "00 40 06 46",
        '0' => "10 01 05 16 36 45 41 30 10|14 32",
        '1' => "11 20 26|16 36",
        '2' => "01 10 30 41 42 06 46",
        '3' => "01 10 30 41 42 33 44 45 36 16 05|13 33",
        '4' => "36 30 04 44",
        '5' => "40 00 02 32 43 45 36 16 05",
        '6' => "41 30 10 01 05 16 36 45 44 33 03",
        '7' => "00 40 16",
        '8' => "10 01 02 13 33 44 45 36 16 05 04 13|33 42 41 30 10",
        '9' => "43 13 02 01 10 30 41 45 36 16 05",
        '-' => "03 43",
        '/' => "06 40",
        '?' => "01 10 30 41 42 23 24|26 26",
        '.' | ',' => "26 26",
        '(' => "30 11 15 36",
        ')' => "10 31 35 16",
        '+' => "03 43|21 25",
        ':' => "22 22|25 25",
        ' ' => "",
        // A box stands for a character that has no strokes.
        _ => "00 40 46 06 00",
    }
}

/// The width of a text of this height.
pub(crate) fn text_width(text: &str, height: f64) -> f64 {
    (text.chars().count() as f64 * ADVANCE - (ADVANCE - 4.0)).max(0.0) * height / HEIGHT
}

/// Text whose middle is at a position, as one shape.
pub(crate) fn centred_text(text: &str, centre: Position, height: f64) -> SymbolShape {
    let scale = height / HEIGHT;
    let left = centre[0] - text_width(text, height) / 2.0;
    let mut steps = Vec::new();
    for (index, character) in text.chars().enumerate() {
        let at = [left + index as f64 * ADVANCE * scale, centre[1] - height / 2.0];
        steps.extend(moved(&character_steps(character), scale, at));
    }
    let mut shape = SymbolShape::line(steps, height / 8.0);
    shape.text = Some(text.to_owned());
    shape
}

fn character_steps(character: char) -> Vec<PathStep> {
    let mut steps = Vec::new();
    for stroke in strokes(character).split('|') {
        for (index, pair) in stroke.split_ascii_whitespace().enumerate() {
            let mut digits = pair.bytes().map(|digit| f64::from(digit - b'0'));
            let (Some(x), Some(y)) = (digits.next(), digits.next()) else { continue };
            // A dot is a short stroke: a line of no length is not drawn.
            let same = matches!(steps.last(), Some(PathStep::Move(from)) if *from == [x, y]);
            let to = [x, if same { y - 0.6 } else { y }];
            steps.push(if index == 0 { PathStep::Move(to) } else { PathStep::Line(to) });
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_centred_and_keeps_its_characters() {
        let shape = centred_text("MP", [10.0, 20.0], 60.0);
        let [low, high] = shape.bounds().expect("it has strokes");
        assert!((low[0] + high[0] - 20.0).abs() < 1e-9, "{low:?} {high:?}");
        assert!((low[1] + high[1] - 40.0).abs() < 1e-9, "{low:?} {high:?}");
        assert_eq!(shape.text.as_deref(), Some("MP"));
    }

    #[test]
    fn every_letter_and_digit_has_its_own_strokes() {
        let all: Vec<_> = ('A'..='Z').chain('0'..='9').map(strokes).collect();
        for (index, one) in all.iter().enumerate() {
            assert!(!one.is_empty() && !all[..index].contains(one), "{one}");
            assert_ne!(*one, strokes('€'), "a box stands for what is missing");
        }
    }
}
