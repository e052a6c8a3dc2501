//! Positions and shapes as they are written in the file. What was a latitude and a longitude stays
//! one, and words of a shape that are not changed keep their bytes.

use std::ops::Range;

use armor_geo::{GeoPosition, MapPlacement, MapPoint};

/// How a position is written.
#[derive(Clone, Copy)]
pub struct PositionStyle<'a> {
    /// Where the map is in the world, if the position is to be a latitude and a longitude.
    pub placement: Option<&'a MapPlacement>,
}

impl PositionStyle<'_> {
    /// The position with this between its two numbers.
    pub fn write(self, at: MapPoint, between: &str) -> String {
        let geo = self.placement.and_then(|placement| placement.geo_from_map(at).ok());
        match geo {
            Some(geo) => format!(
                "{}{between}{}",
                degrees(geo.latitude_deg(), ['N', 'S']),
                degrees(geo.longitude_deg(), ['E', 'W'])
            ),
            None => format!("{}{between}{}", metres(at.x_m()), metres(at.y_m())),
        }
    }
}

/// `48.8583012N`: seven decimals are a centimetre.
pub fn degrees(value: f64, [positive, negative]: [char; 2]) -> String {
    let letter = if value < 0.0 { negative } else { positive };
    format!("{:.7}{letter}", value.abs())
}

/// `12.5`: at most a millimetre, without zeros at the end.
pub fn metres(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Returns whether a written position is a latitude and a longitude.
pub fn is_geographic(text: &str) -> bool {
    text.trim_end().ends_with(['E', 'W'])
}

/// A shape as it is written: its text, and where its words are.
pub struct ShapeText<'a> {
    text: &'a str,
    words: Vec<Range<usize>>,
}

impl<'a> ShapeText<'a> {
    /// Divides a text into words.
    pub fn new(text: &'a str) -> Self {
        let words = text.split_ascii_whitespace().map(|word| {
            // Both slices are of one string, so the difference is the word's offset.
            let start = word.as_ptr() as usize - text.as_ptr() as usize;
            start..start + word.len()
        });
        Self { text, words: words.collect() }
    }

    /// Returns whether it is `circle 5,6 3m`.
    pub fn is_circle(&self) -> bool {
        self.words.first().is_some_and(|word| &self.text[word.clone()] == "circle")
    }

    /// How many corners it has; the centre of a circle is one.
    pub fn count(&self) -> usize {
        if self.is_circle() { 1 } else { self.words.len() }
    }

    /// Whether corner `number` is a latitude and a longitude.
    pub fn is_geographic(&self, number: usize) -> bool {
        self.word(number).is_some_and(|word| is_geographic(&self.text[word]))
    }

    /// The text with another word for a corner.
    pub fn with_corner(&self, number: usize, corner: &str) -> Option<String> {
        let word = self.word(number)?;
        Some(format!("{}{corner}{}", &self.text[..word.start], &self.text[word.end..]))
    }

    /// The text with another radius of the circle.
    pub fn with_radius(&self, radius_m: f64) -> Option<String> {
        let word = self.words.get(2).filter(|_| self.is_circle())?;
        let radius = metres(radius_m);
        Some(format!("{}{radius}m{}", &self.text[..word.start], &self.text[word.end..]))
    }

    /// The text with one more corner, before corner `number` or at the end.
    pub fn with_new_corner(&self, number: usize, corner: &str) -> Option<String> {
        if self.is_circle() {
            return None;
        }
        match self.words.get(number) {
            Some(next) => {
                let (before, after) = self.text.split_at(next.start);
                Some(format!("{before}{corner} {after}"))
            }
            None => {
                let (before, after) = self.text.split_at(self.words.last()?.end);
                Some(format!("{before} {corner}{after}"))
            }
        }
    }

    /// The text without a corner.
    pub fn without_corner(&self, number: usize) -> Option<String> {
        if self.is_circle() {
            return None;
        }
        let word = self.words.get(number)?;
        let kept = match (number.checked_sub(1), self.words.get(number + 1)) {
            (_, Some(next)) => [&self.text[..word.start], &self.text[next.start..]],
            (Some(last), None) => [&self.text[..self.words[last].end], &self.text[word.end..]],
            (None, None) => return None,
        };
        Some(kept.concat())
    }

    /// Where a corner is on the map.
    pub fn corner_point(
        &self,
        number: usize,
        placement: Option<&MapPlacement>,
    ) -> Option<MapPoint> {
        let (first, second) = self.text[self.word(number)?].split_once(',')?;
        if !is_geographic(second) {
            return MapPoint::new(first.parse().ok()?, second.parse().ok()?).ok();
        }
        let degrees = |word: &str, positive: char, negative: char| {
            let sign = if word.ends_with(negative) { -1.0 } else { 1.0 };
            let number: f64 = word.trim_end_matches([positive, negative]).parse().ok()?;
            Some(sign * number)
        };
        let (latitude, longitude) = (degrees(first, 'N', 'S')?, degrees(second, 'E', 'W')?);
        let placement = placement?;
        let height_m = placement.origin().height_m();
        placement.map_from_geo(GeoPosition::new(latitude, longitude, height_m).ok()?).ok()
    }

    fn word(&self, number: usize) -> Option<Range<usize>> {
        let number =
            if self.is_circle() { number.checked_add(1).filter(|n| *n == 1)? } else { number };
        self.words.get(number).cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map_view::camera::map_point;

    #[test]
    fn positions_are_written_as_short_as_they_are_exact() {
        for (value, expected) in
            [(12.5, "12.5"), (4.0, "4"), (-0.0001, "0"), (-0.25, "-0.25"), (100.0, "100")]
        {
            assert_eq!(metres(value), expected);
        }
        let origin = GeoPosition::new(48.8583, 2.2945, 35.0).expect("it exists");
        let placement = MapPlacement::new(origin, 0.0, 1.0).expect("it is one");
        let style = PositionStyle { placement: Some(&placement) };
        assert_eq!(style.write(map_point([0.0, 0.0]), " "), "48.8583000N 2.2945000E");
        let there = style.write(map_point([10.0, -20.0]), ",");
        assert!(is_geographic(&there) && there.starts_with("48.8581"), "{there}");
        assert_eq!(PositionStyle { placement: None }.write(map_point([1.0, 2.5]), ","), "1,2.5");
    }

    #[test]
    fn a_changed_corner_leaves_the_others_as_they_are_written() {
        let shape = ShapeText::new(" 3.0,4  9,4.00 9,8 ");
        assert_eq!(shape.count(), 3);
        assert_eq!(shape.with_corner(1, "7,7").as_deref(), Some(" 3.0,4  7,7 9,8 "));
        assert_eq!(shape.with_corner(3, "7,7"), None);
        assert_eq!(shape.with_new_corner(1, "7,7").as_deref(), Some(" 3.0,4  7,7 9,4.00 9,8 "));
        assert_eq!(shape.with_new_corner(3, "7,7").as_deref(), Some(" 3.0,4  9,4.00 9,8 7,7 "));
        assert_eq!(shape.without_corner(0).as_deref(), Some(" 9,4.00 9,8 "));
        assert_eq!(shape.without_corner(2).as_deref(), Some(" 3.0,4  9,4.00 "));
    }

    #[test]
    fn a_circle_has_a_centre_and_a_radius() {
        let circle = ShapeText::new("circle 48.1N,2E 3m");
        assert!(circle.is_circle() && circle.is_geographic(0));
        assert_eq!(circle.with_corner(0, "1,2").as_deref(), Some("circle 1,2 3m"));
        assert_eq!(circle.with_radius(4.25).as_deref(), Some("circle 48.1N,2E 4.25m"));
        assert_eq!((circle.with_corner(1, "1,2"), circle.with_new_corner(0, "1,2")), (None, None));
        assert_eq!(ShapeText::new("1,2 3,4").with_radius(1.0), None);
    }
}
