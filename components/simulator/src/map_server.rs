//! Reads a grid map as `map_server` has it: a YAML file that names a grey PGM picture and says how
//! large its cells are and where they lie. What is not free is solid: nobody drives into what no
//! robot has seen.

use std::io::Read;
use std::path::Path;

use armor_grid::{Geometry, Grid, Occupancy, Point2};

use crate::pgm::{self, Grey, PgmFault};
use crate::pose::Pose2;
use crate::raster::SolidCells;

/// Bytes of a YAML file: it has seven lines.
const YAML_BYTES: usize = 64 << 10;

/// A fault in a grid map, with the place where it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}{}: {fault}", if *line == 0 { String::new() } else { format!(":{line}") })]
pub struct MapError {
    /// The YAML file, or the picture it names.
    pub file: String,
    /// The line at fault, counted from 1 (0: the file as a whole).
    pub line: usize,
    /// What is wrong there.
    pub fault: MapFault,
}

/// What is wrong with a grid map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapFault {
    /// The file cannot be opened or read.
    #[error("cannot read it: {0}; check the path and its permissions")]
    Unreadable(String),
    /// The file is no YAML of a map.
    #[error("more than {YAML_BYTES} bytes, or not text; the file of a map has some seven lines")]
    NotText,
    /// A line is not a key with a value.
    #[error("`{0}` is not `key: value`; one key stands on each line")]
    NotAKey(String),
    /// A key that maps do not have.
    #[error(
        "key `{0}` is not known; a map has image, resolution, origin, negate, occupied_thresh, \
         free_thresh and mode"
    )]
    UnknownKey(String),
    /// A key twice.
    #[error("`{0}` is there a second time; keep one")]
    SecondKey(String),
    /// A key that a map needs.
    #[error("no `{0}`; add {wanted}", wanted = example(.0))]
    MissingKey(&'static str),
    /// A value that does not fit its key.
    #[error("`{value}` is no value for `{key}`; write it as in {}", example(.key))]
    BadValue {
        /// The key.
        key: &'static str,
        /// What is written there.
        value: String,
    },
    /// The thresholds leave no room between them.
    #[error("free_thresh must be less than occupied_thresh; usual are 0.196 and 0.65")]
    Thresholds,
    /// The picture cannot be read.
    #[error(transparent)]
    Picture(#[from] PgmFault),
    /// No cell is free.
    #[error("no cell is free; check negate and free_thresh, or draw the free space white")]
    NothingFree,
    /// The outlines have too many straight pieces.
    #[error("the outlines have {0} straight pieces; use a coarser map, or remove its speckles")]
    TooRagged(usize),
}

fn example(key: &str) -> &'static str {
    match key {
        "image" => "image: map.pgm",
        "resolution" => "resolution: 0.05",
        "origin" => "origin: [-10.0, -5.0, 0.0]",
        "negate" => "negate: 0",
        "occupied_thresh" => "occupied_thresh: 0.65",
        "free_thresh" => "free_thresh: 0.196",
        _ => "mode: trinary",
    }
}

/// What the YAML file says.
#[derive(Debug, PartialEq)]
struct Description {
    image: String,
    resolution_m: f64,
    /// Where the lower left corner of the picture is.
    origin: Pose2,
    is_negated: bool,
    free_below: f64,
    occupied_from: f64,
}

/// Reads what a map knows of each cell, with the corner of the picture at (0, 0), and
/// map_from_cells.
///
/// # Errors
/// A file cannot be read, or does not hold what it should.
pub fn occupancy(path: &Path) -> Result<(Grid<Occupancy>, Pose2), MapError> {
    let (description, grey) = open(path)?;
    let cells = description.cells(&grey, |occupied| {
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

/// Reads a map: its solid cells, with the corner of the picture at (0, 0), and sheet_from_cells.
pub(crate) fn read(path: &Path) -> Result<(SolidCells, Pose2), MapError> {
    let (description, grey) = open(path)?;
    let solid = description.cells(&grey, |occupied| occupied >= description.free_below);
    Ok((SolidCells { file: path.display().to_string(), solid }, description.origin))
}

fn open(path: &Path) -> Result<(Description, Grey), MapError> {
    let file = path.display().to_string();
    let text = bytes(path, YAML_BYTES)
        .and_then(|bytes| String::from_utf8(bytes).map_err(|_| MapFault::NotText))
        .map_err(|fault| MapError { file: file.clone(), line: 0, fault })?;
    let description =
        Description::parse(&text).map_err(|(line, fault)| MapError { file, line, fault })?;
    let picture = path.parent().unwrap_or(Path::new("")).join(&description.image);
    let grey = bytes(&picture, pgm::MOST_BYTES)
        .and_then(|bytes| pgm::parse(&bytes).map_err(MapFault::from))
        .map_err(|fault| MapError { file: picture.display().to_string(), line: 0, fault })?;
    Ok((description, grey))
}

fn bytes(path: &Path, most: usize) -> Result<Vec<u8>, MapFault> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)
        .and_then(|opened| opened.take(most as u64 + 1).read_to_end(&mut bytes))
        .map_err(|e| MapFault::Unreadable(e.to_string()))?;
    if bytes.len() > most && most == YAML_BYTES {
        return Err(MapFault::NotText);
    }
    Ok(bytes)
}

/// The keys in the order of `map_server`'s own files.
const KEYS: [&str; 7] =
    ["image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"];

impl Description {
    /// Reads the keys; a fault comes with its line.
    fn parse(text: &str) -> Result<Self, (usize, MapFault)> {
        let mut found: [Option<(usize, &str)>; KEYS.len()] = [None; KEYS.len()];
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.split_once('#').map_or(line, |(before, _)| before).trim();
            if line.is_empty() || line == "---" {
                continue;
            }
            let (key, value) = line
                .split_once(':')
                .ok_or_else(|| (number, MapFault::NotAKey(line.chars().take(40).collect())))?;
            let key = key.trim();
            let index = KEYS
                .iter()
                .position(|known| *known == key)
                .ok_or_else(|| (number, MapFault::UnknownKey(key.chars().take(40).collect())))?;
            if found[index].replace((number, value.trim())).is_some() {
                return Err((number, MapFault::SecondKey(key.to_owned())));
            }
        }
        Self::from_keys(&found)
    }

    fn from_keys(found: &[Option<(usize, &str)>; KEYS.len()]) -> Result<Self, (usize, MapFault)> {
        let given = |index: usize| found[index].ok_or((0, MapFault::MissingKey(KEYS[index])));
        let bad = |index: usize, (line, value): (usize, &str)| {
            (line, MapFault::BadValue { key: KEYS[index], value: value.to_owned() })
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
        let origin = pose(origin.1).ok_or_else(|| bad(3, origin))?;
        let is_negated = number(4, |&n| n == 0.0 || n == 1.0)? == 1.0;
        let occupied_from = number(5, |t| (0.0..=1.0).contains(t))?;
        let free_below = number(6, |t| (0.0..=1.0).contains(t))?;
        if free_below >= occupied_from {
            return Err((found[6].map_or(0, |(line, _)| line), MapFault::Thresholds));
        }
        let image = name.to_owned();
        Ok(Self { image, resolution_m, origin, is_negated, free_below, occupied_from })
    }

    /// What each cell of the picture, whose top row comes first, means by its probability of being
    /// occupied.
    fn cells<T: Copy>(&self, grey: &Grey, meaning: impl Fn(f64) -> T) -> Grid<T> {
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
fn pose(text: &str) -> Option<Pose2> {
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

    const YAML: &str = "image: map.pgm  # beside this file\nmode: trinary\nresolution: 0.05\n\
        origin: [-1.5, 2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

    #[test]
    fn the_keys_of_map_server_are_read() {
        let description = Description::parse(YAML).expect("a readable map");
        assert_eq!((description.image.as_str(), description.resolution_m), ("map.pgm", 0.05));
        assert_eq!(description.origin, Pose2::new(-1.5, 2.0, 0.5));
        assert!(!description.is_negated);
    }

    #[track_caller]
    fn check_fault(from: &str, to: &str, line: usize, fault: &MapFault) {
        let text = YAML.replace(from, to);
        assert_ne!(text, YAML, "{from}");
        assert_eq!(Description::parse(&text), Err((line, fault.clone())), "{text}");
    }

    #[test]
    fn faults_name_their_line_and_the_remedy() {
        let bad = |key, value: &str| MapFault::BadValue { key, value: value.to_owned() };
        check_fault("0.05", "5cm", 3, &bad("resolution", "5cm"));
        check_fault("0.05", "0", 3, &bad("resolution", "0"));
        check_fault("[-1.5, 2.0, 0.5]", "[-1.5, 2.0]", 4, &bad("origin", "[-1.5, 2.0]"));
        check_fault("negate: 0", "negate: maybe", 5, &bad("negate", "maybe"));
        check_fault("trinary", "scale", 2, &bad("mode", "scale"));
        check_fault("map.pgm", "", 1, &bad("image", ""));
        check_fault("negate: 0\n", "", 0, &MapFault::MissingKey("negate"));
        check_fault("negate", "negated", 5, &MapFault::UnknownKey("negated".to_owned()));
        check_fault("negate: 0", "negate", 5, &MapFault::NotAKey("negate".to_owned()));
        check_fault("mode: trinary", "negate: 1", 5, &MapFault::SecondKey("negate".to_owned()));
        check_fault("0.196", "0.7", 7, &MapFault::Thresholds);
        let error = MapError { file: "m.yaml".to_owned(), line: 3, fault: bad("origin", "x") };
        assert_eq!(
            error.to_string(),
            "m.yaml:3: `x` is no value for `origin`; write it as in origin: [-10.0, -5.0, 0.0]"
        );
    }

    #[test]
    fn only_what_is_free_is_not_solid_and_the_top_row_comes_first() {
        let grey = Grey { width: 2, height: 2, white: 255, pixels: vec![254, 205, 0, 254] };
        let description = Description::parse(YAML).expect("a readable map");
        let solid = |d: &Description| d.cells(&grey, |o| o >= d.free_below).values().to_vec();
        assert_eq!(solid(&description), [true, false, false, true]);
        let negated = Description { is_negated: true, ..description };
        assert_eq!(solid(&negated), [false, true, true, true]);
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read(Path::new("no/such/map.yaml")).err().expect("no such file");
        assert!(matches!(error.fault, MapFault::Unreadable(_)) && error.file == "no/such/map.yaml");
    }
}
