//! Which part of the drawing is shown, and how large.

use eframe::egui::{Pos2, Rect, Vec2};

/// The smallest and the largest size at which a drawing is shown.
const MIN_ZOOM: f32 = 0.04;
const MAX_ZOOM: f32 = 4.0;
/// Margin around what is fitted into the window, in points.
const MARGIN: f32 = 40.0;
/// The same as a share of a small window, which has no room for more.
const MARGIN_SHARE: f32 = 0.08;

/// Below this zoom ports and their names are not drawn.
pub(super) const DETAIL: f32 = 0.42;
/// Below this zoom blocks are plain and wires straight.
pub(super) const PLAIN: f32 = 0.2;

/// A part of the drawing in the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// The point of the drawing in the middle of the window.
    pub centre: Pos2,
    /// Points of the window for one unit of the drawing.
    pub zoom: f32,
}

impl Default for Viewport {
    fn default() -> Self {
        Self { centre: Pos2::new(300.0, 200.0), zoom: 1.0 }
    }
}

impl Viewport {
    /// The point of the window where a point of the drawing is.
    pub fn to_window(&self, window: Rect, at: Pos2) -> Pos2 {
        window.center() + (at - self.centre) * self.zoom
    }

    /// The point of the drawing under a point of the window.
    pub fn to_drawing(&self, window: Rect, at: Pos2) -> Pos2 {
        self.centre + (at - window.center()) / self.zoom
    }

    /// An area of the drawing in the window.
    pub fn area_to_window(&self, window: Rect, area: Rect) -> Rect {
        Rect::from_min_max(self.to_window(window, area.min), self.to_window(window, area.max))
    }

    /// The part of the drawing that is shown.
    pub fn shown(&self, window: Rect) -> Rect {
        Rect::from_center_size(self.centre, window.size() / self.zoom)
    }

    /// Shows it larger or smaller so that what is under `at` stays there.
    pub fn zoom_at(&mut self, window: Rect, at: Pos2, factor: f32) {
        let before = self.to_drawing(window, at);
        self.zoom = (self.zoom * factor).clamp(MIN_ZOOM, MAX_ZOOM);
        self.centre += before - self.to_drawing(window, at);
    }

    /// Moves the drawing by points of the window.
    pub fn pan(&mut self, by: Vec2) {
        self.centre -= by / self.zoom;
    }

    /// Shows an area as large as it fits, but not larger than `largest`.
    pub fn fit(&mut self, window: Rect, area: Rect, largest: f32) {
        let margin = MARGIN.min(MARGIN_SHARE * window.size().min_elem());
        let free = (window.size() - Vec2::splat(2.0 * margin)).max(Vec2::splat(20.0));
        let size = area.size().max(Vec2::splat(1.0));
        let zoom = (free.x / size.x).min(free.y / size.y);
        self.zoom = zoom.clamp(MIN_ZOOM, largest);
        self.centre = area.center();
    }

    /// The height of a window of this width into which a drawing of this size is fitted at `zoom`,
    /// or as large as the width allows.
    pub fn height_for(width: f32, size: Vec2, zoom: f32) -> f32 {
        let widest = (width - 2.0 * MARGIN) / size.x.max(1.0);
        let drawn = size.y * zoom.min(widest).max(MIN_ZOOM);
        (drawn + 2.0 * MARGIN).min(drawn / (1.0 - 2.0 * MARGIN_SHARE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Rect = Rect { min: Pos2::new(100.0, 50.0), max: Pos2::new(1100.0, 650.0) };

    #[test]
    fn what_is_under_the_pointer_stays_there() {
        let mut view = Viewport::default();
        let pointer = Pos2::new(333.0, 444.0);
        let before = view.to_drawing(WINDOW, pointer);
        view.zoom_at(WINDOW, pointer, 1.7);
        assert!((view.to_drawing(WINDOW, pointer) - before).length() < 1e-3);
        assert!((view.to_window(WINDOW, before) - pointer).length() < 1e-3);
    }

    #[test]
    fn the_height_for_a_zoom_is_enough_for_it() {
        let check = |width: f32, size: Vec2, wanted: f32, expected: f32| {
            let height = Viewport::height_for(width, size, wanted);
            let window = Rect::from_min_size(Pos2::ZERO, Vec2::new(width, height));
            let mut view = Viewport::default();
            view.fit(window, Rect::from_min_size(Pos2::ZERO, size), 1.0);
            assert!(view.zoom >= expected - 1e-3, "{width} {size}: {} < {expected}", view.zoom);
        };
        check(800.0, Vec2::new(1300.0, 640.0), 0.53, 0.53);
        check(1400.0, Vec2::new(1300.0, 640.0), 0.9, 0.9);
        // The width allows no more, whatever the height.
        check(800.0, Vec2::new(7200.0, 640.0), 0.53, 0.1);
        check(800.0, Vec2::new(100.0, 2000.0), 0.5, 0.5);
    }

    #[test]
    fn what_is_fitted_is_all_in_the_window() {
        let mut view = Viewport::default();
        let area = Rect::from_min_max(Pos2::new(-5000.0, 0.0), Pos2::new(3000.0, 700.0));
        view.fit(WINDOW, area, 1.0);
        assert!(WINDOW.contains_rect(view.area_to_window(WINDOW, area)));
        view.fit(WINDOW, Rect::from_center_size(Pos2::ZERO, Vec2::splat(1.0)), 1.0);
        assert_eq!(view.zoom, 1.0);
    }
}
