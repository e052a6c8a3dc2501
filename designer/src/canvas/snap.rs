//! The grid with which positions are aligned.

use eframe::egui::Pos2;

/// Distance between two lines of the grid, in units of the drawing.
pub const GRID: f32 = 10.0;

/// Returns the nearest point on the grid.
pub fn snapped(at: Pos2) -> Pos2 {
    Pos2::new((at.x / GRID).round() * GRID, (at.y / GRID).round() * GRID)
}
