//! World files: six lines that place a picture, in a file next to it.

use std::path::{Path, PathBuf};

use crate::error::OpenFault;
use crate::pixel_placement::PixelPlacement;
use crate::reference::PlanePoint;

/// The extensions of world files for pictures of an extension (in small letters), the usual first.
pub(crate) fn extensions_for(picture: &str) -> &'static [&'static str] {
    match picture {
        "png" => &["pgw", "pngw", "wld", "PGW", "PNGW", "WLD"],
        _ => &["jgw", "jpgw", "jpegw", "wld", "JGW", "JPGW", "JPEGW", "WLD"],
    }
}

/// The world file next to a picture, if there is one.
pub(crate) fn find_next_to(picture: &Path, extensions: &[&str]) -> Option<PathBuf> {
    extensions.iter().map(|it| picture.with_extension(it)).find(|path| path.is_file())
}

/// Reads the six numbers. A fault comes with its line.
pub(crate) fn parse_world_file(text: &str) -> Result<PixelPlacement, (usize, OpenFault)> {
    let mut numbers = [0.0; 6];
    let mut lines = (1..).zip(text.trim_start_matches('\u{feff}').lines().map(str::trim));
    let mut last = 0;
    for number in &mut numbers {
        // Empty lines at the end are usual, and harmless elsewhere.
        let line = lines.find(|(_, line)| !line.is_empty());
        let (at, line) = line.unwrap_or((last + 1, ""));
        last = at;
        *number = line
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite())
            .ok_or_else(|| (at, OpenFault::WorldFileLine(line.chars().take(40).collect())))?;
    }
    if let Some((at, line)) = lines.find(|(_, line)| !line.is_empty()) {
        return Err((at, OpenFault::WorldFileLine(line.chars().take(40).collect())));
    }
    let [column_x, column_y, row_x, row_y, x, y] = numbers;
    // The file has the centre of the top left pixel.
    let origin = PlanePoint::new(x - 0.5 * (column_x + row_x), y - 0.5 * (column_y + row_y));
    let (column, row) = (PlanePoint::new(column_x, column_y), PlanePoint::new(row_x, row_y));
    PixelPlacement::new(origin, column, row).ok_or((0, OpenFault::Placement))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_is_half_a_pixel_from_the_centre() {
        let placement =
            parse_world_file("0.5\r\n0\r\n0\r\n-0.5\r\n10.25\r\n19.75\r\n\r\n").unwrap();
        assert_eq!(placement.plane_from_pixel(0.0, 0.0), PlanePoint::new(10.0, 20.0));
        assert_eq!(placement.plane_from_pixel(4.0, 2.0), PlanePoint::new(12.0, 19.0));
    }

    #[test]
    fn a_fault_names_its_line() {
        let line = |text: &str| parse_world_file(text).unwrap_err().0;
        assert_eq!(line("0.5\n0\nzero\n-0.5\n1\n1\n"), 3);
        assert_eq!(line("0.5\n0\n0\n-0.5\n1\n"), 6);
        assert_eq!(line("0.5\n0\n0\n-0.5\n1\n1\n7\n"), 7);
        assert_eq!(line("nan\n0\n0\n-0.5\n1\n1\n"), 1);
        assert_eq!(parse_world_file("0\n0\n0\n0\n0\n0\n").unwrap_err(), (0, OpenFault::Placement));
    }
}
