//! The map as `map_server` reads it: a grey PGM image, top row first, and a YAML file next to it.

use armor_grid::{Grid, Occupancy, Thresholds};

const FREE: u8 = 254;
const UNKNOWN: u8 = 205;
const OCCUPIED: u8 = 0;

/// Returns the content of `map.pgm`.
pub(crate) fn encode_pgm(map: &Grid<i8>) -> Vec<u8> {
    let geometry = map.geometry();
    let mut bytes = format!("P5\n{} {}\n255\n", geometry.width, geometry.height).into_bytes();
    let thresholds = Thresholds::default();
    for row in map.values().chunks_exact(geometry.width.max(1)).rev() {
        bytes.extend(row.iter().map(|&percent| match thresholds.classify(percent) {
            Occupancy::Free => FREE,
            Occupancy::Unknown => UNKNOWN,
            Occupancy::Occupied => OCCUPIED,
        }));
    }
    bytes
}

/// Returns the content of `map.yaml`.
pub(crate) fn write_yaml(map: &Grid<i8>) -> String {
    let geometry = map.geometry();
    let Thresholds { free, occupied } = Thresholds::default();
    format!(
        "image: map.pgm\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\n\
         occupied_thresh: {occupied}\nfree_thresh: {free}\n",
        format_metres(geometry.resolution_m),
        format_metres(geometry.origin.x_m),
        format_metres(geometry.origin.y_m),
    )
}

/// To the micrometre: a resolution that came as an f32 reads 0.05 again, not 0.05000000074505806.
fn format_metres(value_m: f64) -> String {
    let text = format!("{value_m:.6}");
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_grid::{Geometry, Point2};

    fn map() -> Grid<i8> {
        let origin = Point2::new(-1.25, 0.0);
        let resolution_m = f64::from(0.05_f32);
        let geometry = Geometry { origin, resolution_m, width: 3, height: 2 };
        Grid::from_values(geometry, vec![0, -1, 100, 50, 10, 66]).unwrap()
    }

    #[test]
    fn the_top_row_comes_first() {
        let expected = [b"P5\n3 2\n255\n".as_slice(), &[205, 254, 0, 254, 205, 0]].concat();
        assert_eq!(encode_pgm(&map()), expected);
    }

    #[test]
    fn the_yaml_is_map_servers() {
        let expected = "image: map.pgm\nmode: trinary\nresolution: 0.05\n\
                        origin: [-1.25, 0.0, 0.0]\nnegate: 0\n\
                        occupied_thresh: 0.65\nfree_thresh: 0.196\n";
        assert_eq!(write_yaml(&map()), expected);
    }
}
