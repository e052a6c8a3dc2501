//! Which part of the map is shown, and how large: metres of the map to points of the window and
//! back. The map's y axis points up, that of the window down.

use armor_geo::{MAX_COORDINATE_M, MapPoint};
use eframe::egui::{Pos2, Rect, Vec2};

/// Points of the window for a metre: a hundred kilometres in a window, to a millimetre in a point.
const MIN_SCALE: f64 = 0.002;
const MAX_SCALE: f64 = 1_000.0;
/// Margin around what is fitted into the window, in points.
const MARGIN: f64 = 50.0;
/// Steps to which positions are snapped are at least this far apart in the window.
const LEAST_SNAP: f64 = 8.0;
/// The longest scale bar, in points.
const LONGEST_BAR: f64 = 160.0;

/// A part of the map in the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The position in the middle of the window: x and y, in metres.
    centre_m: [f64; 2],
    /// Points of the window for a metre.
    scale: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self { centre_m: [0.0, 0.0], scale: 20.0 }
    }
}

impl Camera {
    /// Points of the window for a metre.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Where a position of the map is in the window.
    pub fn to_window(self, window: Rect, at: MapPoint) -> Pos2 {
        self.offset_to_window(window, [at.x_m(), at.y_m()])
    }

    /// The same of coordinates, which may be outside of any map.
    pub fn offset_to_window(self, window: Rect, [x_m, y_m]: [f64; 2]) -> Pos2 {
        let across = (x_m - self.centre_m[0]) * self.scale;
        let up = (y_m - self.centre_m[1]) * self.scale;
        window.center() + Vec2::new(across as f32, -up as f32)
    }

    /// The position of the map under a point of the window, kept within the largest map.
    pub fn to_map(self, window: Rect, at: Pos2) -> MapPoint {
        let offset = at - window.center();
        let x_m = self.centre_m[0] + f64::from(offset.x) / self.scale;
        let y_m = self.centre_m[1] - f64::from(offset.y) / self.scale;
        map_point([x_m, y_m])
    }

    /// Moves the map by points of the window.
    pub fn pan(&mut self, by: Vec2) {
        self.centre_m[0] -= f64::from(by.x) / self.scale;
        self.centre_m[1] += f64::from(by.y) / self.scale;
        self.keep_within();
    }

    /// Shows it larger or smaller so that what is under `at` stays there.
    pub fn zoom_at(&mut self, window: Rect, at: Pos2, factor: f64) {
        let before = self.to_map(window, at);
        self.scale = (self.scale * factor).clamp(MIN_SCALE, MAX_SCALE);
        let after = self.to_map(window, at);
        self.centre_m[0] += before.x_m() - after.x_m();
        self.centre_m[1] += before.y_m() - after.y_m();
        self.keep_within();
    }

    /// Shows a metre as this many points.
    pub fn set_scale(&mut self, scale: f64) {
        self.scale = scale.clamp(MIN_SCALE, MAX_SCALE);
    }

    /// Shows an area as large as it fits.
    pub fn fit(&mut self, window: Rect, area: MapBounds) {
        let free = |side: f32| (f64::from(side) - 2.0 * MARGIN).max(20.0);
        let [width_m, height_m] = area.size_m();
        // A single point is shown with some metres around it.
        let scale = (free(window.width()) / width_m.max(4.0))
            .min(free(window.height()) / height_m.max(4.0));
        self.scale = scale.clamp(MIN_SCALE, MAX_SCALE);
        self.centre_m = area.centre_m();
        self.keep_within();
    }

    /// Shows this position in the middle.
    pub fn show(&mut self, at: MapPoint) {
        self.centre_m = [at.x_m(), at.y_m()];
    }

    /// The part of the map that is shown.
    pub fn shown(&self, window: Rect) -> MapBounds {
        let corners = [window.left_bottom(), window.right_top()];
        MapBounds::of(corners.map(|at| self.to_map(window, at))).unwrap_or_default()
    }

    /// The step to which positions are snapped at this size: 1, 2 or 5 times a power of ten.
    pub fn snap_step_m(&self) -> f64 {
        round_up(LEAST_SNAP / self.scale)
    }

    /// The finest step that a pointer can mean at this size: a power of ten, a millimetre at least.
    pub fn fine_step_m(&self) -> f64 {
        10_f64.powf((0.5 / self.scale).log10().floor()).max(1e-3)
    }

    /// A position on the steps of this size.
    pub fn snapped(&self, at: MapPoint, is_coarse: bool) -> MapPoint {
        let step_m = if is_coarse { self.snap_step_m() } else { self.fine_step_m() };
        let on_step = |value: f64| (value / step_m).round() * step_m;
        map_point([on_step(at.x_m()), on_step(at.y_m())])
    }

    /// The length of the scale bar in metres, and in points of the window.
    pub fn scale_bar(&self) -> (f64, f32) {
        let most_m = LONGEST_BAR / self.scale;
        let length_m = [5.0, 2.0, 1.0]
            .map(|digit| digit * 10_f64.powf(most_m.log10().floor()))
            .into_iter()
            .find(|length_m| *length_m <= most_m)
            .unwrap_or(most_m);
        (length_m, (length_m * self.scale) as f32)
    }

    fn keep_within(&mut self) {
        for value in &mut self.centre_m {
            *value = value.clamp(-MAX_COORDINATE_M, MAX_COORDINATE_M);
        }
    }
}

/// The next number from `least` on that is 1, 2 or 5 times a power of ten.
fn round_up(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|digit| digit * power >= least * (1.0 - 1e-9));
    digit.unwrap_or(10.0) * power
}

/// A position of the map, kept within the largest map.
pub fn map_point([x_m, y_m]: [f64; 2]) -> MapPoint {
    let keep = |value: f64| {
        if value.is_nan() { 0.0 } else { value.clamp(-MAX_COORDINATE_M, MAX_COORDINATE_M) }
    };
    // Zero without a sign: it is written into files.
    let (x_m, y_m) = (keep(x_m) + 0.0, keep(y_m) + 0.0);
    MapPoint::new(x_m, y_m).expect("both are within the largest map")
}

/// A rectangle of the map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapBounds {
    low_m: [f64; 2],
    high_m: [f64; 2],
}

impl MapBounds {
    /// The smallest that has these positions; none without one.
    pub fn of(points: impl IntoIterator<Item = MapPoint>) -> Option<Self> {
        let of_one = |point: MapPoint| {
            let at = [point.x_m(), point.y_m()];
            Self { low_m: at, high_m: at }
        };
        points.into_iter().map(of_one).reduce(Self::union)
    }

    /// The smallest that has both.
    pub fn union(self, other: Self) -> Self {
        let both = |one: [f64; 2], two: [f64; 2], choose: fn(f64, f64) -> f64| {
            [choose(one[0], two[0]), choose(one[1], two[1])]
        };
        Self {
            low_m: both(self.low_m, other.low_m, f64::min),
            high_m: both(self.high_m, other.high_m, f64::max),
        }
    }

    /// Whether a part of the other is in it.
    pub fn meets(&self, other: &Self) -> bool {
        (0..2).all(|axis| {
            self.low_m[axis] <= other.high_m[axis] && other.low_m[axis] <= self.high_m[axis]
        })
    }

    /// The same with this much more at each side.
    #[must_use]
    pub fn expand_m(self, by_m: f64) -> Self {
        Self {
            low_m: self.low_m.map(|value| value - by_m),
            high_m: self.high_m.map(|value| value + by_m),
        }
    }

    /// Its lowest coordinates.
    pub fn low_m(&self) -> [f64; 2] {
        self.low_m
    }

    /// Its highest coordinates.
    pub fn high_m(&self) -> [f64; 2] {
        self.high_m
    }

    /// The position in its middle.
    pub fn centre(&self) -> MapPoint {
        map_point(self.centre_m())
    }

    fn size_m(&self) -> [f64; 2] {
        [self.high_m[0] - self.low_m[0], self.high_m[1] - self.low_m[1]]
    }

    fn centre_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.low_m[axis] + self.high_m[axis]) / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Rect = Rect { min: Pos2::new(100.0, 50.0), max: Pos2::new(1100.0, 650.0) };

    fn at(x_m: f64, y_m: f64) -> MapPoint {
        map_point([x_m, y_m])
    }

    #[test]
    fn y_points_up_and_what_is_under_the_pointer_stays_there() {
        let mut camera = Camera::default();
        assert_eq!(camera.to_window(WINDOW, at(1.0, 1.0)), Pos2::new(620.0, 330.0));
        let pointer = Pos2::new(333.0, 444.0);
        let before = camera.to_map(WINDOW, pointer);
        camera.zoom_at(WINDOW, pointer, 7.3);
        assert!(camera.to_map(WINDOW, pointer).distance_m(before) < 1e-9);
        camera.pan(Vec2::new(40.0, -20.0));
        let moved = camera.to_map(WINDOW, pointer + Vec2::new(40.0, -20.0));
        assert!(moved.distance_m(before) < 1e-9);
    }

    #[test]
    fn what_is_fitted_is_all_in_the_window_at_any_size() {
        for size_m in [0.5, 80.0, 90_000.0] {
            let mut camera = Camera::default();
            let area = MapBounds::of([at(-size_m, 3.0), at(2.0 * size_m, 3.0 + size_m)]);
            let area = area.expect("two points");
            camera.fit(WINDOW, area);
            for corner in [area.low_m(), area.high_m()] {
                assert!(WINDOW.contains(camera.to_window(WINDOW, at(corner[0], corner[1]))));
            }
            assert!(camera.shown(WINDOW).meets(&area));
        }
    }

    #[test]
    fn steps_are_round_and_fit_the_size() {
        let mut camera = Camera::default();
        for (scale, step_m, bar_m) in [(20.0, 0.5, 5.0), (1.0, 10.0, 100.0), (300.0, 0.05, 0.5)] {
            camera.set_scale(scale);
            assert!((camera.snap_step_m() - step_m).abs() < 1e-12, "{}", camera.snap_step_m());
            assert!((camera.scale_bar().0 - bar_m).abs() < 1e-9, "{:?}", camera.scale_bar());
        }
        camera.set_scale(20.0);
        assert_eq!(camera.snapped(at(1.26, -0.2), true), at(1.5, 0.0));
        assert_eq!(camera.snapped(at(1.263, -0.204), false).x_m(), 1.26);
    }

    #[test]
    fn no_position_leaves_the_largest_map() {
        let mut camera = Camera::default();
        camera.set_scale(0.0);
        for _ in 0..1000 {
            camera.pan(Vec2::splat(1e9));
        }
        let corner = camera.to_map(WINDOW, WINDOW.min);
        assert!(corner.x_m().abs() <= MAX_COORDINATE_M && corner.y_m().abs() <= MAX_COORDINATE_M);
        assert_eq!(map_point([f64::NAN, f64::INFINITY]).x_m(), 0.0);
    }
}
