//! Pictures are encoded, decoded again and looked at pixel by pixel.

use super::*;
use armor_grid::Geometry;

struct Decoded {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Decoded {
    fn of(canvas: &RgbCanvas) -> Self {
        let bytes = canvas.encode_png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        assert_eq!(info.color_type, png::ColorType::Rgb);
        Self { width: info.width as usize, height: info.height as usize, rgb }
    }

    fn at(&self, (x, y): (f64, f64)) -> RgbColour {
        let at = (y.round() as usize * self.width + x.round() as usize) * 3;
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }
}

/// A room of 4 x 3 m with walls of one cell, unknown around it.
fn room() -> Grid<i8> {
    let geometry =
        Geometry { origin: Point2::new(-1.0, -1.0), resolution_m: 0.05, width: 120, height: 100 };
    let mut map = Grid::filled(geometry, -1);
    for cell in geometry.cells() {
        let (column, row) = (cell.column - 20, cell.row - 20);
        if (0..80).contains(&column) && (0..60).contains(&row) {
            let wall = column == 0 || column == 79 || row == 0 || row == 59;
            map[cell] = if wall { 100 } else { 0 };
        }
    }
    map
}

fn trajectory() -> Vec<Point2> {
    (0..=100).map(|i| Point2::new(0.5 + 0.03 * f64::from(i), 1.0)).collect()
}

#[test]
fn the_map_is_where_it_belongs() {
    let map = room();
    let view = MapView::of(&map, std::iter::empty());
    let decoded = Decoded::of(&draw_picture(&map, std::iter::empty(), std::iter::empty()));
    assert_eq!(view.scale, Scale::PixelsPerCell(8));
    assert_eq!((decoded.width, decoded.height), (100 * 8, 80 * 8 + STRIP));
    let check = |x_m, y_m, expected: RgbColour| {
        assert_eq!(decoded.at(view.pixel(Point2::new(x_m, y_m))), expected, "{x_m} {y_m}");
    };
    check(2.0, 1.5, [255; 3]);
    check(0.025, 1.5, [25; 3]);
    check(3.975, 1.5, [25; 3]);
    check(2.0, 2.975, [25; 3]);
    check(2.0, 0.025, [25; 3]);
    check(-0.2, 1.5, UNKNOWN);
    check(2.0, 3.2, UNKNOWN);
}

#[test]
fn the_way_runs_from_the_start_mark_to_the_end_mark() {
    let map = room();
    let view = MapView::of(&map, trajectory().into_iter());
    let decoded = Decoded::of(&draw_picture(&map, trajectory().into_iter(), std::iter::empty()));
    let colour = |x_m| decoded.at(view.pixel(Point2::new(x_m, 1.0)));
    assert_eq!(colour(0.5), START);
    assert_eq!(colour(3.5), END);
    let blue_to_orange = |c: RgbColour| i32::from(c[0]) - i32::from(c[2]);
    assert!(blue_to_orange(colour(0.8)) < blue_to_orange(colour(2.0)));
    assert!(blue_to_orange(colour(2.0)) < blue_to_orange(colour(3.2)));
    assert_eq!(decoded.at(view.pixel(Point2::new(2.0, 1.2))), [255; 3]);
}

#[test]
fn the_truth_is_drawn_below_the_way() {
    let map = room();
    let above = trajectory().into_iter().map(|p| Point2::new(p.x_m, p.y_m + 0.5));
    let decoded = Decoded::of(&draw_picture(&map, trajectory().into_iter(), above));
    let view = MapView::of(&map, trajectory().into_iter());
    assert_eq!(decoded.at(view.pixel(Point2::new(2.0, 1.5))), TRUTH);
}

#[test]
fn the_scale_bar_has_the_length_of_its_label() {
    let map = room();
    let decoded = Decoded::of(&draw_picture(&map, std::iter::empty(), std::iter::empty()));
    // 160 pixels are a metre here: a quarter of the width has room for one.
    let row = (decoded.height - STRIP / 2 + 8) as f64;
    let dark = (0..decoded.width / 2).filter(|x| decoded.at((*x as f64, row)) == INK).count();
    assert_eq!(dark, 160);
    assert_eq!(scale_bar(160.0, 200.0), (1.0, 160));
    assert_eq!(scale_bar(20.0, 250.0), (10.0, 200));
    assert_eq!(scale_bar(1.0, 250.0), (200.0, 200));
}

#[test]
fn a_large_map_is_made_smaller_and_keeps_its_walls() {
    let geometry =
        Geometry { origin: Point2::default(), resolution_m: 0.05, width: 5000, height: 600 };
    let mut map = Grid::filled(geometry, 0);
    for row in 0..600 {
        map[Cell::new(2500, row)] = 100;
    }
    let view = MapView::of(&map, std::iter::empty());
    assert_eq!(view.scale, Scale::CellsPerPixel(3));
    let decoded = Decoded::of(&draw_picture(&map, std::iter::empty(), std::iter::empty()));
    assert!(decoded.width <= LARGE);
    let row = decoded.height as f64 / 2.0 - 30.0;
    assert!((0..decoded.width).any(|x| decoded.at((x as f64, row)) == [25; 3]));
}

#[test]
fn a_map_of_nothing_is_still_a_picture() {
    let geometry = Geometry { origin: Point2::default(), resolution_m: 0.05, width: 2, height: 2 };
    let map = Grid::filled(geometry, -1);
    let decoded = Decoded::of(&draw_picture(&map, std::iter::empty(), std::iter::empty()));
    assert!(decoded.width >= STRIP_WIDTH && decoded.height > STRIP);
}
