//! The view of the map: its centre and scale, and conversions between map and screen.

use armor_grid::{Point2, Pose2};
use eframe::egui::{Pos2, Rect, vec2};

/// Smallest and largest scale, in points for each metre.
const SCALES: (f32, f32) = (0.2, 1000.0);
/// The scale before there is a map.
const FIRST_SCALE: f32 = 40.0;
/// Share of the area that a fitted map takes.
const FITTED: f32 = 0.94;

/// Centre and scale of the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MapViewport {
    /// The point in the middle, on the map.
    pub(super) centre: Point2,
    /// Points of the screen for each metre.
    pub(super) scale: f32,
    /// Where on the screen the map is.
    pub(super) rect: Rect,
}

impl Default for MapViewport {
    fn default() -> Self {
        Self { centre: Point2::default(), scale: FIRST_SCALE, rect: Rect::ZERO }
    }
}

impl MapViewport {
    /// Returns the place of a point on the screen; y points up on the map.
    pub(super) fn on_screen(&self, point: Point2) -> Pos2 {
        let scale = f64::from(self.scale);
        let x = (point.x_m - self.centre.x_m) * scale;
        let y = (self.centre.y_m - point.y_m) * scale;
        self.rect.center() + vec2(x as f32, y as f32)
    }

    /// Returns the point under a place of the screen.
    pub(super) fn on_map(&self, at: Pos2) -> Point2 {
        let away = (at - self.rect.center()) / self.scale;
        Point2::new(self.centre.x_m + f64::from(away.x), self.centre.y_m - f64::from(away.y))
    }

    /// Scales around a place of the screen, which stays where it is.
    pub(super) fn zoom(&mut self, at: Pos2, factor: f32) {
        let before = self.on_map(at);
        self.scale = (self.scale * factor).clamp(SCALES.0, SCALES.1);
        let after = self.on_map(at);
        self.centre.x_m += before.x_m - after.x_m;
        self.centre.y_m += before.y_m - after.y_m;
    }

    /// Shows a rectangle of the map whole.
    pub(super) fn fit(&mut self, low: Point2, high: Point2) {
        let (width, height) = ((high.x_m - low.x_m) as f32, (high.y_m - low.y_m) as f32);
        if !(width.is_finite() && height.is_finite()) || width <= 0.0 || height <= 0.0 {
            return;
        }
        self.centre = low.toward(high, 0.5);
        let scale = (self.rect.width() / width).min(self.rect.height() / height) * FITTED;
        self.scale = scale.clamp(SCALES.0, SCALES.1);
    }

    /// The length of a scale bar of about `points` on the screen: 1, 2 or 5 times a power of ten.
    pub(super) fn bar_m(&self, points: f32) -> f64 {
        let most = f64::from(points / self.scale);
        let ten = 10_f64.powf(most.log10().floor());
        let step = [5.0, 2.0].into_iter().find(|step| step * ten <= most);
        step.unwrap_or(1.0) * ten
    }

    /// Converts a line to the screen, without points nearer than one screen point to the last one,
    /// and without those that are not finite.
    pub(super) fn line(&self, points: impl Iterator<Item = Point2>) -> Vec<Pos2> {
        let mut line: Vec<Pos2> = Vec::new();
        for at in points.map(|point| self.on_screen(point)) {
            let is_far = line.last().is_none_or(|last| last.distance_sq(at) >= 1.0);
            if is_far && at.x.is_finite() && at.y.is_finite() {
                line.push(at);
            }
        }
        line
    }
}

/// Returns the pose that a stroke on the map means: at its start, heading along it.
pub(super) fn pose_of(from: Point2, toward: Point2) -> Pose2 {
    Pose2::new(from.x_m, from.y_m, from.bearing_rad(toward))
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::pos2;

    fn look() -> MapViewport {
        MapViewport {
            rect: Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 200.0)),
            ..MapViewport::default()
        }
    }

    #[test]
    fn the_map_goes_up_where_the_screen_goes_down() {
        let look = look();
        assert_eq!(look.on_screen(Point2::new(1.0, 1.0)), pos2(240.0, 60.0));
        assert_eq!(look.on_map(pos2(240.0, 60.0)), Point2::new(1.0, 1.0));
    }

    #[test]
    fn what_is_under_the_pointer_stays_there_while_zooming() {
        let mut look = look();
        let at = pos2(350.0, 20.0);
        let before = look.on_map(at);
        for factor in [1.5, 1e9, 0.3, 1e-12, 4.0] {
            look.zoom(at, factor);
            assert!(look.on_map(at).distance_m(before) < 1e-4, "{:?}", look.on_map(at));
        }
    }

    #[test]
    fn a_map_fits_and_odd_ones_change_nothing() {
        let mut look = look();
        look.fit(Point2::new(-10.0, 0.0), Point2::new(10.0, 20.0));
        assert!((look.scale - 9.4).abs() < 1e-4, "{}", look.scale);
        assert_eq!(look.centre, Point2::new(0.0, 10.0));
        let before = look;
        look.fit(Point2::new(0.0, 0.0), Point2::new(f64::NAN, 1.0));
        look.fit(Point2::new(0.0, 0.0), Point2::new(0.0, 0.0));
        assert_eq!(look, before);
    }

    #[test]
    fn a_scale_bar_is_one_two_or_five() {
        for (scale, expected) in [(40.0, 2.0), (100.0, 1.0), (19.0, 5.0), (1000.0, 0.1)] {
            let bar_m = MapViewport { scale, ..look() }.bar_m(101.0);
            assert!((bar_m - expected).abs() < 1e-9, "{bar_m} at {scale}");
        }
    }
}
