//! Places a scan on a map near where the odometry expects it: correlative search, then refinement.

use crate::field::{CellWindow, LikelihoodField};
use crate::grid::SurfaceGrid;
use crate::pose::Point;
use crate::prior::Prior;
use crate::refine::{Expected, Refined, points_in_front, refine};
use crate::search::search;

/// Scans with fewer points are not matched.
const FEWEST_POINTS: usize = 8;
/// Below this share of points on surfaces a match is rejected, and odometry alone moves the robot.
pub(crate) const BELIEVED_SUPPORT: f64 = 0.35;
/// Blur of the likelihood field, metres.
const BLUR_M: f64 = 0.1;
/// Levels of maxima above the finest; squares of 8 cells at the top.
const LEVELS: usize = 3;
/// A field is drawn wider than a scan needs it, metres, so that it serves the next ones too.
const WIDER_M: f64 = 1.0;

/// Finds where `points` fit the map. The field is kept between scans that change nothing; `None`
/// when they fit nowhere.
pub(crate) fn place_scan(
    grid: &SurfaceGrid,
    field: &mut Option<LikelihoodField>,
    points: &[Point],
    expected: &Expected,
    prior: &Prior,
) -> Option<Refined> {
    if points.len() < FEWEST_POINTS {
        return None;
    }
    let resolution_m = grid.resolution_m();
    let window = CellWindow::around(points, prior, resolution_m, 3.0 * BLUR_M);
    if !field.as_ref().is_some_and(|field| field.window().contains(&window)) {
        let wide = window.widened((WIDER_M / resolution_m) as i32);
        *field = Some(LikelihoodField::draw(grid, wide, BLUR_M, LEVELS));
    }
    let in_front = points_in_front(grid, points, &prior.pose);
    let searched = if in_front.len() < FEWEST_POINTS { points } else { &in_front[..] };
    let found = search(field.as_ref()?, searched, prior, resolution_m, None)?;
    let refined = refine(grid, points, found.pose, &expected.doubted(&found.pose));
    (refined.support >= BELIEVED_SUPPORT).then_some(refined)
}
