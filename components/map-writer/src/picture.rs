//! `map.png`: the known part of the map, the trajectory coloured from start to end, a
//! scale bar in metres.

use armor_grid::{Cell, Grid, Point2};
use armor_picture::canvas::{LETTER, RgbCanvas, RgbColour};

/// The longer side of the map is drawn with at least this many pixels, ...
const SMALL: usize = 800;
/// ... and at most this many: large enough for a 400 m building, small enough for a screen.
const LARGE: usize = 2400;
/// A cell is drawn with at most this many pixels.
const CELL: usize = 8;
/// Around what is known, in metres.
const BORDER_M: f64 = 0.5;
/// Height of the strip below the map, and the least width it needs, in pixels.
const STRIP: usize = 56;
const STRIP_WIDTH: usize = 560;

const UNKNOWN: RgbColour = [214, 219, 224];
const INK: RgbColour = [30, 34, 40];
const TRUTH: RgbColour = [150, 150, 150];
const START: RgbColour = [20, 150, 70];
const END: RgbColour = [215, 40, 40];
/// Colours along the trajectory: blue at the start over purple to orange at the end.
const WAY: [RgbColour; 3] = [[25, 100, 220], [150, 50, 175], [240, 110, 30]];

/// Draws a map in percent (negative: unknown), the trajectory, and the true one if it is known.
pub(crate) fn draw_picture(
    map: &Grid<i8>,
    trajectory: impl Iterator<Item = Point2> + Clone,
    truth: impl Iterator<Item = Point2> + Clone,
) -> RgbCanvas {
    let view = MapView::of(map, trajectory.clone().chain(truth.clone()));
    let width = view.width().max(STRIP_WIDTH);
    let mut canvas = RgbCanvas::new(width, view.height() + STRIP, UNKNOWN);
    view.draw_map(&mut canvas, map);
    let truth: Vec<_> = truth.map(|point| view.pixel(point)).collect();
    for pair in truth.windows(2) {
        canvas.draw_line(pair[0], pair[1], 0, TRUTH);
    }
    draw_trajectory(&mut canvas, &trajectory.map(|point| view.pixel(point)).collect::<Vec<_>>());
    draw_strip(&mut canvas, &view, width as i32);
    canvas
}

/// Which cells are shown, and how large.
#[derive(Debug)]
struct MapView {
    /// Lower left cell shown.
    first: Cell,
    columns: usize,
    rows: usize,
    scale: Scale,
    origin: Point2,
    resolution_m: f64,
}

/// How cells become pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    PixelsPerCell(usize),
    CellsPerPixel(usize),
}

impl MapView {
    fn of(map: &Grid<i8>, trajectory: impl Iterator<Item = Point2>) -> Self {
        let geometry = map.geometry();
        let known = map.iter().filter(|(_, percent)| **percent >= 0).map(|(cell, _)| cell);
        // A pose far off the map is a fault elsewhere; it must not blow the picture up.
        let driven =
            trajectory.map(|point| geometry.cell_at(point)).filter(|&c| geometry.contains(c));
        let shown = known.chain(driven);
        let bounds = shown.fold(None, |bounds: Option<(Cell, Cell)>, cell| {
            let (low, high) = bounds.unwrap_or((cell, cell));
            Some((
                Cell::new(low.column.min(cell.column), low.row.min(cell.row)),
                Cell::new(high.column.max(cell.column), high.row.max(cell.row)),
            ))
        });
        let (low, high) = bounds.unwrap_or((Cell::new(0, 0), Cell::new(0, 0)));
        let border = (BORDER_M / geometry.resolution_m).ceil() as i32;
        let columns = (high.column - low.column + 1 + 2 * border) as usize;
        let rows = (high.row - low.row + 1 + 2 * border) as usize;
        let longer = columns.max(rows);
        let scale = if longer > LARGE {
            Scale::CellsPerPixel(longer.div_ceil(LARGE))
        } else {
            Scale::PixelsPerCell(SMALL.div_ceil(longer).min(CELL))
        };
        Self {
            first: low.offset(-border, -border),
            columns,
            rows,
            scale,
            origin: geometry.origin,
            resolution_m: geometry.resolution_m,
        }
    }

    fn pixels(&self, cells: usize) -> usize {
        match self.scale {
            Scale::PixelsPerCell(pixels) => cells * pixels,
            Scale::CellsPerPixel(skip) => cells.div_ceil(skip),
        }
    }

    fn width(&self) -> usize {
        self.pixels(self.columns)
    }

    fn height(&self) -> usize {
        self.pixels(self.rows)
    }

    fn pixels_per_metre(&self) -> f64 {
        match self.scale {
            Scale::PixelsPerCell(pixels) => pixels as f64 / self.resolution_m,
            Scale::CellsPerPixel(skip) => 1.0 / (self.resolution_m * skip as f64),
        }
    }

    /// Where a point of the map is drawn, y downwards.
    fn pixel(&self, point: Point2) -> (f64, f64) {
        let left_m = self.origin.x_m + f64::from(self.first.column) * self.resolution_m;
        let low_m = self.origin.y_m + f64::from(self.first.row) * self.resolution_m;
        let per_metre = self.pixels_per_metre();
        let up = (point.y_m - low_m) * per_metre;
        ((point.x_m - left_m) * per_metre - 0.5, self.height() as f64 - up - 0.5)
    }

    fn draw_map(&self, canvas: &mut RgbCanvas, map: &Grid<i8>) {
        let height = self.height();
        for y in 0..height {
            for x in 0..self.width() {
                if let Some(percent) = self.percent(map, x, height - 1 - y) {
                    let grey = 255 - (f32::from(percent.min(100)) * 2.3) as u8;
                    canvas.set_pixel(x as i32, y as i32, [grey; 3]);
                }
            }
        }
    }

    /// The most occupied of the cells under a pixel, counted from the lower left; walls must not
    /// vanish where many cells share one pixel.
    fn percent(&self, map: &Grid<i8>, x: usize, up: usize) -> Option<i8> {
        let (column, row, count) = match self.scale {
            Scale::PixelsPerCell(pixels) => (x / pixels, up / pixels, 1),
            Scale::CellsPerPixel(skip) => (x * skip, up * skip, skip as i32),
        };
        let corner = self.first.offset(column as i32, row as i32);
        (0..count)
            .flat_map(|rows| (0..count).map(move |columns| corner.offset(columns, rows)))
            .filter_map(|cell| map.get(cell).copied())
            .filter(|percent| *percent >= 0)
            .max()
    }
}

fn draw_trajectory(canvas: &mut RgbCanvas, trajectory: &[(f64, f64)]) {
    for (index, pair) in trajectory.windows(2).enumerate() {
        canvas.draw_line(
            pair[0],
            pair[1],
            1,
            trajectory_colour(index as f64 / trajectory.len() as f64),
        );
    }
    if let (Some(first), Some(last)) = (trajectory.first(), trajectory.last()) {
        let at = |place: &(f64, f64)| (place.0.round() as i32, place.1.round() as i32);
        draw_end(canvas, at(last));
        draw_start(canvas, at(first));
    }
}

fn draw_start(canvas: &mut RgbCanvas, (x, y): (i32, i32)) {
    canvas.fill_disc(x, y, 8, [255; 3]);
    canvas.fill_disc(x, y, 6, START);
}

fn draw_end(canvas: &mut RgbCanvas, (x, y): (i32, i32)) {
    // Larger than the start: where a robot comes home, both are to be seen.
    canvas.fill_rectangle(x - 11, y - 11, 23, 23, [255; 3]);
    canvas.fill_rectangle(x - 9, y - 9, 19, 19, END);
}

/// Below the map: the scale bar on the left, on the right what the marks mean.
fn draw_strip(canvas: &mut RgbCanvas, view: &MapView, width: i32) {
    let top = view.height() as i32;
    let middle = top + STRIP as i32 / 2;
    canvas.fill_rectangle(0, top, width, STRIP as i32, [255; 3]);
    let (bar_m, bar) = scale_bar(view.pixels_per_metre(), f64::from(width) / 4.0);
    canvas.fill_rectangle(16, middle + 6, bar, 5, INK);
    canvas.fill_rectangle(16, middle, 3, 17, INK);
    canvas.fill_rectangle(16 + bar - 3, middle, 3, 17, INK);
    canvas.draw_text(16, middle - 18, &format!("{bar_m} m"), INK);

    let text = middle - LETTER / 2;
    let end = width - 16 - 3 * LETTER;
    canvas.draw_text(end, text, "end", INK);
    draw_end(canvas, (end - 20, middle));
    let ribbon = (end - 180, 130);
    for step in 0..ribbon.1 {
        let colour = trajectory_colour(f64::from(step) / f64::from(ribbon.1));
        canvas.fill_rectangle(ribbon.0 + step, middle - 2, 1, 5, colour);
    }
    draw_start(canvas, (ribbon.0 - 18, middle));
    canvas.draw_text(ribbon.0 - 34 - 5 * LETTER, text, "start", INK);
}

/// The longest of 1, 2, 5, 10 ... metres (or 0.1, 0.2, 0.5) that fits, and its pixels.
fn scale_bar(pixels_per_metre: f64, most: f64) -> (f64, i32) {
    let lengths_m = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
    let fitting = lengths_m.into_iter().rev().find(|length_m| length_m * pixels_per_metre <= most);
    let length_m = fitting.unwrap_or(lengths_m[0]);
    (length_m, (length_m * pixels_per_metre).round() as i32)
}

/// The colour at a fraction of the trajectory.
fn trajectory_colour(fraction: f64) -> RgbColour {
    let place = fraction.clamp(0.0, 1.0) * (WAY.len() - 1) as f64;
    let before = (place as usize).min(WAY.len() - 2);
    let share = place - before as f64;
    std::array::from_fn(|channel| {
        let (from, to) = (f64::from(WAY[before][channel]), f64::from(WAY[before + 1][channel]));
        (from + (to - from) * share).round() as u8
    })
}

#[cfg(test)]
#[path = "picture_tests.rs"]
mod tests;
