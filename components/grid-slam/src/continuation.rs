//! What a mapper that starts does with the state that it finds: it is the first of its run, it
//! continues, or it begins a new epoch of the map frame. Pure.

use std::hash::{BuildHasher, RandomState};

use crate::config::Config;
use crate::recognition::PlaceSearch;
use crate::recorder::StateRecorder;
use crate::scan::MapperScan;
use crate::slam::Slam;
use crate::state::{ScanShape, StateFit, decode_header, decode_state};
use thiserror::Error;

/// How a mapper begins.
pub enum Continuation {
    /// It is the first one of its run: the frame has its plain name.
    First,
    /// It continues in the frame of the state.
    Known(Box<KnownMap>),
    /// It begins a frame with another origin.
    NewEpoch(RefusedState),
}

/// A map that was stored, and how to continue it.
pub struct KnownMap {
    /// The map; the robot is not placed on it yet.
    pub slam: Slam,
    /// Finds the robot's place on it.
    pub search: PlaceSearch,
    /// Continues the file.
    pub recorder: StateRecorder,
    /// Epoch of its frame.
    pub epoch: String,
    /// Bytes of the file that count.
    pub len: usize,
}

/// Why a state is not continued.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RefusedState {
    /// The file is none.
    #[error(transparent)]
    File(#[from] crate::state::StateError),
    /// It was written with other parameters.
    #[error("it was written with another resolution, laser position or loop closing")]
    Parameters,
    /// It was written with another laser.
    #[error("the scans of its laser have other angles, ranges or numbers of beams")]
    Sensor,
    /// This is not the first mapper of the run, and there is no state.
    #[error("its state is not kept, or is gone")]
    Gone,
    /// The mapper died before any of its map was written.
    #[error("nothing of its map was written")]
    Empty,
    /// Its graph is none.
    #[error("its keyframes are not connected")]
    Graph,
    /// The file cannot be read or written.
    #[error("{0}")]
    Disk(String),
    /// The robot's place on the map was not found.
    #[error("the robot was not recognised on its map within {0} s")]
    Lost(u32),
}

/// A start of a mapper: the number of its run, and whether an earlier mapper of it may have begun a
/// frame.
#[derive(Clone, Copy, Debug)]
pub struct MapperStart<'a> {
    /// The number of the run.
    pub run: &'a str,
    /// It is the first process of its component in the run.
    pub is_first: bool,
}

/// Decides how a mapper begins that found `file`, when its first scan arrives.
pub fn judge_state(
    file: Option<&[u8]>,
    start: MapperStart<'_>,
    config: &Config,
    scan: &MapperScan,
) -> Continuation {
    let begin = || match start.is_first {
        true => Continuation::First,
        false => Continuation::NewEpoch(RefusedState::Gone),
    };
    let Some(bytes) = file else { return begin() };
    if bytes == mark_not_begun(start.run) {
        return Continuation::First;
    }
    match decode_header(bytes) {
        // Of an earlier run in the same folder.
        Ok(header) if header.run != start.run => begin(),
        Ok(_) => match continue_map(bytes, config, scan) {
            Ok(known) => Continuation::Known(Box::new(known)),
            Err(refused) => Continuation::NewEpoch(refused),
        },
        Err(error) => Continuation::NewEpoch(error.into()),
    }
}

/// What the first mapper of a run writes in place of a state, before it begins any frame: it may die
/// before its first scan, and then the next one is still the first to begin one.
pub fn mark_not_begun(run: &str) -> Vec<u8> {
    format!("no map yet in the run {run}\n").into_bytes()
}

fn continue_map(
    bytes: &[u8],
    config: &Config,
    scan: &MapperScan,
) -> Result<KnownMap, RefusedState> {
    let state = decode_state(bytes)?;
    if state.header.fit != StateFit::of(config) {
        return Err(RefusedState::Parameters);
    }
    let here = state.here.ok_or(RefusedState::Empty)?;
    let shape = ScanShape::of(scan);
    if !state.keyframes.iter().any(|keyframe| ScanShape::of(&keyframe.scan) == shape) {
        return Err(RefusedState::Sensor);
    }
    let (search, recorder) = (PlaceSearch::new(here), StateRecorder::continue_state(&state));
    let (epoch, len) = (state.header.epoch.clone(), state.len);
    let slam = Slam::restore(*config, state).ok_or(RefusedState::Graph)?;
    Ok(KnownMap { slam, search, recorder, epoch, len })
}

/// Draws the name of a new epoch: four hexadecimal digits.
pub fn draw_epoch() -> String {
    let number = RandomState::new().hash_one("epoch");
    format!("{:04x}", number & 0xffff)
}

#[cfg(test)]
#[path = "continuation_tests.rs"]
mod tests;
