//! Transforms of a drawing: the part of SVG's `transform` that keeps straight lines simple to
//! reason about (translate, scale, rotate, matrix).

use crate::fault::{DrawingFault, shorten_text};
use crate::numbers::Numbers;

/// A 2-D affine map: (x, y) → (a x + c y + e, b x + d y + f), as SVG writes matrix(a b c d e f).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Affine {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    e: f64,
    f: f64,
}

impl Affine {
    pub(super) const IDENTITY: Self = Self { a: 1.0, b: 0.0, c: 0.0, d: 1.0, e: 0.0, f: 0.0 };

    /// Reads the value of a `transform` attribute.
    pub(super) fn parse(text: &str) -> Result<Self, DrawingFault> {
        let refuse = || DrawingFault::Transform(shorten_text(text));
        let mut total = Self::IDENTITY;
        let mut rest = Numbers::new(text).rest();
        while !rest.is_empty() {
            let (name, after) = rest.split_once('(').ok_or_else(refuse)?;
            let (arguments, after) = after.split_once(')').ok_or_else(refuse)?;
            let mut numbers = Numbers::new(arguments);
            let values: Vec<f64> = std::iter::from_fn(|| numbers.number()).take(7).collect();
            if !numbers.rest().is_empty() {
                return Err(refuse());
            }
            total = total.after(Self::from_function(name.trim(), &values).ok_or_else(refuse)?);
            rest = Numbers::new(after).rest();
        }
        Ok(total)
    }

    fn from_function(name: &str, values: &[f64]) -> Option<Self> {
        let shift = |e, f| Self { e, f, ..Self::IDENTITY };
        Some(match (name, values) {
            ("translate", &[x]) => shift(x, 0.0),
            ("translate", &[x, y]) => shift(x, y),
            ("scale", &[s]) => Self { a: s, d: s, ..Self::IDENTITY },
            ("scale", &[x, y]) => Self { a: x, d: y, ..Self::IDENTITY },
            ("rotate", &[degrees]) => Self::from_rotation(degrees),
            ("rotate", &[degrees, x, y]) => {
                shift(x, y).after(Self::from_rotation(degrees)).after(shift(-x, -y))
            }
            ("matrix", &[a, b, c, d, e, f]) => Self { a, b, c, d, e, f },
            _ => return None,
        })
    }

    fn from_rotation(degrees: f64) -> Self {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        Self { a: cos, b: sin, c: -sin, d: cos, ..Self::IDENTITY }
    }

    /// Composes: `inner` is applied to a point first, then `self`.
    pub(super) fn after(self, inner: Self) -> Self {
        let (e, f) = self.point(inner.e, inner.f);
        let (a, b) = self.direction(inner.a, inner.b);
        let (c, d) = self.direction(inner.c, inner.d);
        Self { a, b, c, d, e, f }
    }

    pub(super) fn point(self, x: f64, y: f64) -> (f64, f64) {
        (self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f)
    }

    pub(super) fn direction(self, x: f64, y: f64) -> (f64, f64) {
        (self.a * x + self.c * y, self.b * x + self.d * y)
    }

    /// An upper bound on how much lengths grow.
    pub(super) fn growth(self) -> f64 {
        libm::sqrt(self.a * self.a + self.b * self.b + self.c * self.c + self.d * self.d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(transform: &str, expected: (f64, f64)) {
        let (x, y) = Affine::parse(transform).expect("readable").point(1.0, 2.0);
        assert!((x - expected.0).abs() < 1e-9 && (y - expected.1).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn transforms_move_a_point_as_svg_specifies() {
        check("", (1.0, 2.0));
        check("translate(3)", (4.0, 2.0));
        check("translate(3,4) scale(2)", (5.0, 8.0));
        check("scale(2, 0.5), translate(1 1)", (4.0, 1.5));
        check("rotate(90)", (-2.0, 1.0));
        check("rotate(90 1 2)", (1.0, 2.0));
        check("matrix(1 0 0 1 5 6)", (6.0, 8.0));
    }

    #[test]
    fn other_transforms_are_refused() {
        for text in ["skewX(3)", "translate(", "scale()", "translate(1 2 3)", "scale(2px)", "7"] {
            assert_eq!(Affine::parse(text), Err(DrawingFault::Transform(text.to_owned())));
        }
    }
}
