//! Reads a grid map as `map_server` has it: a YAML file that names a grey PGM picture and states
//! the size of its cells and their place. All cells that are not free are solid: what no robot has
//! seen is not for driving.

use std::io::Read;
use std::path::{Path, PathBuf};

use armor_grid::{Geometry, Grid, Occupancy, Point2, Pose2};

use crate::map_error::{MapFileError, MapFileFault, YAML_BYTES};
use crate::pgm::{self, GreyPicture};

/// The contents of the YAML file.
#[derive(Clone, Debug, PartialEq)]
pub struct MapDescription {
    /// The picture, as the file names it.
    pub image: String,
    /// The side of a cell.
    pub resolution_m: f64,
    /// Where the lower left corner of the picture is.
    pub origin: Pose2,
    /// Whether bright pixels are occupied; dark ones otherwise.
    pub is_negated: bool,
    /// The probability below which a cell is free.
    pub free_below: f64,
    /// The probability from which on a cell is occupied.
    pub occupied_from: f64,
}

/// Reads what a map knows of each cell, with the corner of the picture at (0, 0), and
/// map_from_cells.
///
/// # Errors
/// A file cannot be read, or does not hold what it should.
pub fn read_map_cells(path: &Path) -> Result<(Grid<Occupancy>, Pose2), MapFileError> {
    let (description, grey) = open_map(path)?;
    let cells = description.classify_cells(&grey, |occupied| {
        if occupied >= description.occupied_from {
            Occupancy::Occupied
        } else if occupied < description.free_below {
            Occupancy::Free
        } else {
            Occupancy::Unknown
        }
    });
    Ok((cells, description.origin))
}

/// Reads which cells of a map are solid, with the corner of the picture at (0, 0), and
/// map_from_cells. All that is not free is solid.
///
/// # Errors
/// A file cannot be read, or does not hold what it should.
pub fn read_solid_cells(path: &Path) -> Result<(Grid<bool>, Pose2), MapFileError> {
    let (description, grey) = open_map(path)?;
    let solid = description.classify_cells(&grey, |occupied| occupied >= description.free_below);
    Ok((solid, description.origin))
}

fn open_map(path: &Path) -> Result<(MapDescription, GreyPicture), MapFileError> {
    let (description, picture) = MapDescription::read(path)?;
    let grey = read_grey_picture(&picture)?;
    Ok((description, grey))
}

/// Reads the PGM picture of a map.
///
/// # Errors
/// The file cannot be read, or is no such picture.
pub fn read_grey_picture(path: &Path) -> Result<GreyPicture, MapFileError> {
    read_bytes(path, pgm::MOST_BYTES)
        .and_then(|bytes| pgm::parse(&bytes).map_err(MapFileFault::from))
        .map_err(|fault| MapFileError { file: path.display().to_string(), line: 0, fault })
}

fn read_bytes(path: &Path, most: usize) -> Result<Vec<u8>, MapFileFault> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)
        .and_then(|opened| opened.take(most as u64 + 1).read_to_end(&mut bytes))
        .map_err(|e| MapFileFault::Unreadable(e.to_string()))?;
    if bytes.len() > most && most == YAML_BYTES {
        return Err(MapFileFault::NotText);
    }
    Ok(bytes)
}

/// The keys in the order of `map_server`'s own files.
const KEYS: [&str; 7] =
    ["image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"];

impl MapDescription {
    /// Reads the YAML file of a map, and returns it with the path of its picture.
    ///
    /// # Errors
    /// The file cannot be read, or does not hold what it should.
    pub fn read(path: &Path) -> Result<(Self, PathBuf), MapFileError> {
        let file = path.display().to_string();
        let text = read_bytes(path, YAML_BYTES)
            .and_then(|bytes| String::from_utf8(bytes).map_err(|_| MapFileFault::NotText))
            .map_err(|fault| MapFileError { file: file.clone(), line: 0, fault })?;
        let description =
            Self::parse(&text).map_err(|(line, fault)| MapFileError { file, line, fault })?;
        let picture = path.parent().unwrap_or(Path::new("")).join(&description.image);
        Ok((description, picture))
    }

    /// Reads the keys; a fault comes with its line.
    fn parse(text: &str) -> Result<Self, (usize, MapFileFault)> {
        let mut found: [Option<(usize, &str)>; KEYS.len()] = [None; KEYS.len()];
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.split_once('#').map_or(line, |(before, _)| before).trim();
            if line.is_empty() || line == "---" {
                continue;
            }
            let (key, value) = line
                .split_once(':')
                .ok_or_else(|| (number, MapFileFault::NotAKey(line.chars().take(40).collect())))?;
            let key = key.trim();
            let index = KEYS.iter().position(|known| *known == key).ok_or_else(|| {
                (number, MapFileFault::UnknownKey(key.chars().take(40).collect()))
            })?;
            if found[index].replace((number, value.trim())).is_some() {
                return Err((number, MapFileFault::SecondKey(key.to_owned())));
            }
        }
        Self::from_keys(&found)
    }

    fn from_keys(
        found: &[Option<(usize, &str)>; KEYS.len()],
    ) -> Result<Self, (usize, MapFileFault)> {
        let given = |index: usize| found[index].ok_or((0, MapFileFault::MissingKey(KEYS[index])));
        let bad = |index: usize, (line, value): (usize, &str)| {
            (line, MapFileFault::BadValue { key: KEYS[index], value: value.to_owned() })
        };
        let number = |index: usize, fits: fn(&f64) -> bool| {
            let given = given(index)?;
            given.1.parse().ok().filter(fits).ok_or_else(|| bad(index, given))
        };
        let image = given(0)?;
        let name = image.1.trim_matches(['"', '\'']);
        if name.is_empty() {
            return Err(bad(0, image));
        }
        if let Some(mode) = found[1].filter(|(_, mode)| *mode != "trinary") {
            return Err(bad(1, mode));
        }
        let resolution_m = number(2, |&r| (0.001..=100.0).contains(&r))?;
        let origin = given(3)?;
        let origin = parse_pose(origin.1).ok_or_else(|| bad(3, origin))?;
        let is_negated = number(4, |&n| n == 0.0 || n == 1.0)? == 1.0;
        let occupied_from = number(5, |t| (0.0..=1.0).contains(t))?;
        let free_below = number(6, |t| (0.0..=1.0).contains(t))?;
        if free_below >= occupied_from {
            return Err((found[6].map_or(0, |(line, _)| line), MapFileFault::Thresholds));
        }
        let image = name.to_owned();
        Ok(Self { image, resolution_m, origin, is_negated, free_below, occupied_from })
    }

    /// What each cell of the picture, whose top row comes first, means by its probability of being
    /// occupied.
    fn classify_cells<T: Copy>(&self, grey: &GreyPicture, meaning: impl Fn(f64) -> T) -> Grid<T> {
        let geometry = Geometry {
            origin: Point2::default(),
            resolution_m: self.resolution_m,
            width: grey.width,
            height: grey.height,
        };
        let mut cells = Grid::filled(geometry, meaning(0.0));
        let rows = cells.values_mut().chunks_exact_mut(grey.width).rev();
        for (row, pixels) in rows.zip(grey.pixels.chunks_exact(grey.width)) {
            for (cell, &pixel) in row.iter_mut().zip(pixels) {
                let bright = f64::from(pixel) / f64::from(grey.white);
                *cell = meaning(if self.is_negated { bright } else { 1.0 - bright });
            }
        }
        cells
    }
}

/// `[x, y, yaw]` in metres and radians.
fn parse_pose(text: &str) -> Option<Pose2> {
    let inner = text.strip_prefix('[')?.strip_suffix(']')?;
    let numbers: Option<Vec<f64>> =
        inner.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    match numbers?[..] {
        [x_m, y_m, yaw_rad] => Some(Pose2::new(x_m, y_m, yaw_rad)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YAML: &str = "image: map.pgm  # next to this file\nmode: trinary\nresolution: 0.05\n\
        origin: [-1.5, 2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

    #[test]
    fn the_keys_of_map_server_are_read() {
        let description = MapDescription::parse(YAML).expect("a readable map");
        assert_eq!((description.image.as_str(), description.resolution_m), ("map.pgm", 0.05));
        assert_eq!(description.origin, Pose2::new(-1.5, 2.0, 0.5));
        assert!(!description.is_negated);
    }

    #[track_caller]
    fn check_fault(from: &str, to: &str, line: usize, fault: &MapFileFault) {
        let text = YAML.replace(from, to);
        assert_ne!(text, YAML, "{from}");
        assert_eq!(MapDescription::parse(&text), Err((line, fault.clone())), "{text}");
    }

    #[test]
    fn faults_name_their_line_and_the_remedy() {
        let bad = |key, value: &str| MapFileFault::BadValue { key, value: value.to_owned() };
        check_fault("0.05", "5cm", 3, &bad("resolution", "5cm"));
        check_fault("0.05", "0", 3, &bad("resolution", "0"));
        check_fault("[-1.5, 2.0, 0.5]", "[-1.5, 2.0]", 4, &bad("origin", "[-1.5, 2.0]"));
        check_fault("negate: 0", "negate: maybe", 5, &bad("negate", "maybe"));
        check_fault("trinary", "scale", 2, &bad("mode", "scale"));
        check_fault("map.pgm", "", 1, &bad("image", ""));
        check_fault("negate: 0\n", "", 0, &MapFileFault::MissingKey("negate"));
        check_fault("negate", "negated", 5, &MapFileFault::UnknownKey("negated".to_owned()));
        check_fault("negate: 0", "negate", 5, &MapFileFault::NotAKey("negate".to_owned()));
        check_fault("mode: trinary", "negate: 1", 5, &MapFileFault::SecondKey("negate".to_owned()));
        check_fault("0.196", "0.7", 7, &MapFileFault::Thresholds);
        let error = MapFileError { file: "m.yaml".to_owned(), line: 3, fault: bad("origin", "x") };
        assert_eq!(
            error.to_string(),
            "m.yaml:3: `x` is no value for `origin`; write it as in origin: [-10.0, -5.0, 0.0]"
        );
    }

    #[test]
    fn only_what_is_free_is_not_solid_and_the_top_row_comes_first() {
        let grey = GreyPicture { width: 2, height: 2, white: 255, pixels: vec![254, 205, 0, 254] };
        let description = MapDescription::parse(YAML).expect("a readable map");
        let solid =
            |d: &MapDescription| d.classify_cells(&grey, |o| o >= d.free_below).values().to_vec();
        assert_eq!(solid(&description), [true, false, false, true]);
        let negated = MapDescription { is_negated: true, ..description };
        assert_eq!(solid(&negated), [false, true, true, true]);
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read_solid_cells(Path::new("no/such/map.yaml")).expect_err("no such file");
        assert!(
            matches!(error.fault, MapFileFault::Unreadable(_)) && error.file == "no/such/map.yaml"
        );
    }
}
