//! The decoded tiles of all layers of a view, within a bound of memory.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io;
use std::sync::Arc;

use crate::error::DecodeError;
use crate::limits::{IN_FLIGHT_MEMORY, MAX_TILE_MEMORY, PICTURE_MEMORY};
use crate::source::Source;
use crate::tile::{TileId, TileImage};
pub use crate::workers::LayerKey;
use crate::workers::{TileKey, Workers};

/// Answers without pixels that are kept: tiles that do not exist, or are damaged.
const MAX_EMPTY_ANSWERS: usize = 8_192;

/// What is known of a tile.
#[derive(Debug)]
pub enum TileState<'a, T> {
    /// It is decoded and stored.
    Ready(&'a T),
    /// The source has no picture there.
    Absent,
    /// It cannot be decoded.
    Failed(&'a DecodeError),
    /// It is requested, or was never wanted.
    Unknown,
}

struct TileLayer {
    source: Arc<Source>,
    /// Bytes of its largest tile so far.
    tile_bytes: usize,
}

enum TileAnswer<T> {
    Ready { value: T, bytes: usize },
    Absent,
    Failed(DecodeError),
}

struct StoredTile<T> {
    answer: TileAnswer<T>,
    used: u64,
}

/// The tiles of all layers of a view. Threads decode what is wanted; what was wanted longest ago is
/// dropped when the memory is full.
///
/// `T` is what the caller keeps of a tile, such as a texture: it is made in [`Tiles::receive`], and
/// dropped with the tile.
pub struct Tiles<T> {
    layers: BTreeMap<LayerKey, TileLayer>,
    next_layer: u64,
    stored: HashMap<TileKey, StoredTile<T>>,
    /// Counts the calls of `want`.
    turn: u64,
    workers: Workers,
}

impl<T> Tiles<T> {
    /// Starts the threads. They call `wake` after each tile: the window then repaints, and calls
    /// [`Tiles::receive`].
    ///
    /// # Errors
    /// No thread can be started.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> io::Result<Self> {
        Ok(Self {
            layers: BTreeMap::new(),
            next_layer: 0,
            stored: HashMap::new(),
            turn: 0,
            workers: Workers::start(wake)?,
        })
    }

    /// Adds a source; its key is never used again.
    pub fn add(&mut self, source: Source) -> LayerKey {
        let key = LayerKey(self.next_layer);
        self.next_layer += 1;
        let tile_bytes = source.tile_bytes();
        self.layers.insert(key, TileLayer { source: Arc::new(source), tile_bytes });
        key
    }

    /// Removes a source and all its tiles.
    pub fn remove(&mut self, layer: LayerKey) {
        self.layers.remove(&layer);
        self.stored.retain(|(key, _), _| *key != layer);
        self.workers.release(layer);
    }

    /// The source of a layer.
    pub fn source(&self, layer: LayerKey) -> Option<&Source> {
        self.layers.get(&layer).map(|layer| &*layer.source)
    }

    /// Requests what is wanted now, the most urgent first, and drops the requests of before that
    /// have not begun. Those that do not fit into the memory together are left out.
    pub fn want(&mut self, wanted: impl IntoIterator<Item = (LayerKey, TileId)>) {
        self.turn += 1;
        let mut seen = HashSet::new();
        let mut requests = Vec::new();
        let mut left = self.tile_memory();
        for key in wanted {
            let Some(layer) = self.layers.get(&key.0).filter(|_| seen.insert(key)) else {
                continue;
            };
            let Some(rest) = left.checked_sub(layer.tile_bytes) else { break };
            left = rest;
            match self.stored.get_mut(&key) {
                Some(stored) => stored.used = self.turn,
                None => requests.push((key, layer.source.clone())),
            }
        }
        self.workers.replace_requests(requests);
    }

    /// Takes the tiles that were decoded since the last call: `store` makes of each what is kept.
    /// Never waits. Returns what could not be decoded; each tile is reported once.
    pub fn receive(
        &mut self,
        mut store: impl FnMut(LayerKey, TileId, TileImage) -> T,
    ) -> Vec<DecodeError> {
        let mut failures = Vec::new();
        while let Some(decoded) = self.workers.try_receive() {
            let (key, used) = (decoded.key, self.turn);
            let Some(layer) = self.layers.get_mut(&key.0) else { continue };
            let answer = match decoded.result {
                Ok(Some(image)) => {
                    let bytes = image.rgba.len();
                    layer.tile_bytes = layer.tile_bytes.max(bytes);
                    TileAnswer::Ready { value: store(key.0, key.1, image), bytes }
                }
                Ok(None) => TileAnswer::Absent,
                Err(error) => {
                    failures.push(error.clone());
                    TileAnswer::Failed(error)
                }
            };
            self.stored.insert(key, StoredTile { answer, used });
        }
        self.drop_oldest();
        failures
    }

    /// What is known of a tile.
    pub fn get(&self, layer: LayerKey, id: TileId) -> TileState<'_, T> {
        match self.stored.get(&(layer, id)).map(|stored| &stored.answer) {
            Some(TileAnswer::Ready { value, .. }) => TileState::Ready(value),
            Some(TileAnswer::Absent) => TileState::Absent,
            Some(TileAnswer::Failed(error)) => TileState::Failed(error),
            None => TileState::Unknown,
        }
    }

    /// Requests that are not answered yet; 0 when all that is wanted is there.
    pub fn count_pending(&self) -> usize {
        self.workers.count_pending()
    }

    /// Bytes of the tiles that are stored.
    pub fn stored_bytes(&self) -> usize {
        self.stored.values().map(StoredTile::len_bytes).sum()
    }

    /// Bytes of everything at this time: the tiles, the pictures that are held whole, and what the
    /// threads may hold. Never more than [`MAX_TILE_MEMORY`].
    pub fn memory_bytes(&self) -> usize {
        MAX_TILE_MEMORY - self.tile_memory() + self.stored_bytes()
    }

    /// Bytes that tiles may have next to the pictures.
    fn tile_memory(&self) -> usize {
        let pictures = if self.layers.values().any(|layer| layer.source.whole().is_some()) {
            PICTURE_MEMORY
        } else {
            0
        };
        MAX_TILE_MEMORY - IN_FLIGHT_MEMORY - pictures
    }

    fn drop_oldest(&mut self) {
        let most = self.tile_memory();
        let mut bytes = self.stored_bytes();
        let mut empty = self.stored.values().filter(|stored| stored.len_bytes() == 0).count();
        if bytes <= most && empty <= MAX_EMPTY_ANSWERS {
            return;
        }
        let mut by_age: Vec<(u64, TileKey)> =
            self.stored.iter().map(|(key, stored)| (stored.used, *key)).collect();
        by_age.sort_unstable();
        for (_, key) in by_age {
            let len = self.stored.get(&key).map_or(0, StoredTile::len_bytes);
            let is_dropped = if len > 0 { bytes > most } else { empty > MAX_EMPTY_ANSWERS };
            if is_dropped {
                self.stored.remove(&key);
                bytes -= len;
                empty -= usize::from(len == 0);
            }
        }
    }
}

impl<T> StoredTile<T> {
    fn len_bytes(&self) -> usize {
        match self.answer {
            TileAnswer::Ready { bytes, .. } => bytes,
            TileAnswer::Absent | TileAnswer::Failed(_) => 0,
        }
    }
}
