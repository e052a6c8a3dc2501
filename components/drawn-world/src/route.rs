//! The route that a person walks.

/// The route of a person: from end to end and back, or round if it ends where it begins.
#[derive(Clone, Debug, PartialEq)]
pub struct WalkedRoute {
    /// Its corners, in metres; two at least, and not all in one place.
    pub points: Vec<(f64, f64)>,
    /// How fast it is walked, in metres per second.
    pub speed_mps: f64,
}

impl WalkedRoute {
    /// Returns the same route in another frame.
    #[must_use]
    pub fn moved(&self, point: impl Fn((f64, f64)) -> (f64, f64)) -> Self {
        Self { points: self.points.iter().map(|&p| point(p)).collect(), ..*self }
    }

    /// Its length from end to end, in metres.
    pub fn length_m(&self) -> f64 {
        self.straight_pieces().map(|(from, to)| length_m(from, to)).sum()
    }

    /// Whether it ends where it begins.
    pub fn is_round(&self) -> bool {
        self.points.first() == self.points.last()
    }

    fn straight_pieces(&self) -> impl Iterator<Item = ((f64, f64), (f64, f64))> {
        self.points.windows(2).map(|pair| (pair[0], pair[1]))
    }

    /// Returns the point after a distance along it.
    pub fn point_along(&self, along_m: f64) -> (f64, f64) {
        let mut left_m = along_m;
        let mut last = self.points.first().copied().unwrap_or_default();
        for (from, to) in self.straight_pieces() {
            let piece_m = length_m(from, to);
            if left_m < piece_m {
                let share = left_m / piece_m;
                return (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share);
            }
            left_m -= piece_m;
            last = to;
        }
        last
    }
}

fn length_m(from: (f64, f64), to: (f64, f64)) -> f64 {
    libm::hypot(to.0 - from.0, to.1 - from.1)
}
