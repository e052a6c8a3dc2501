//! Threads that decode tiles. Requests that are not wanted any more are dropped before they begin.

use std::collections::{HashSet, VecDeque};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use crate::error::{DecodeError, PictureFault};
use crate::limits::PICTURE_MEMORY;
use crate::picture::WholePicture;
use crate::source::Source;
use crate::tile::{TileId, TileImage};

/// A source within a [`Tiles`](crate::Tiles).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LayerKey(pub(crate) u64);

/// A tile of a layer.
pub(crate) type TileKey = (LayerKey, TileId);

/// A tile that was decoded, or not.
pub(crate) struct DecodedTile {
    pub(crate) key: TileKey,
    pub(crate) result: Result<Option<TileImage>, DecodeError>,
}

/// More threads than this decode faster than a view scrolls.
const MAX_THREADS: usize = 4;
/// Tiles that wait to be received; together with those being decoded, as many as
/// `IN_FLIGHT_MEMORY` has space for.
const WAITING_TILES: usize = 4;

#[derive(Default)]
struct TileRequests {
    queue: VecDeque<(TileKey, Arc<Source>)>,
    running: HashSet<TileKey>,
    /// Layers that were removed; the threads release what they hold of them.
    removed: HashSet<LayerKey>,
    is_closed: bool,
}

struct WorkerState {
    requests: Mutex<TileRequests>,
    changed: Condvar,
    /// The pictures that are held whole, the last used last. Their tiles are cut with this lock, so
    /// that no thread holds a picture that was released.
    pictures: Mutex<Vec<(LayerKey, Arc<Source>)>>,
}

/// The threads, and the requests to them.
pub(crate) struct Workers {
    shared: Arc<WorkerState>,
    results: Receiver<DecodedTile>,
}

impl Workers {
    /// Starts the threads; each calls `wake` after a tile.
    pub(crate) fn start(wake: impl Fn() + Send + Sync + 'static) -> io::Result<Self> {
        let shared = Arc::new(WorkerState {
            requests: Mutex::default(),
            changed: Condvar::new(),
            pictures: Mutex::default(),
        });
        let (sender, results) = sync_channel(WAITING_TILES);
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        let workers = Self { shared, results };
        let count = std::thread::available_parallelism().map_or(1, usize::from);
        for number in 0..count.clamp(1, MAX_THREADS) {
            let (shared, sender, wake) = (workers.shared.clone(), sender.clone(), wake.clone());
            std::thread::Builder::new()
                .name(format!("tiles-{number}"))
                .spawn(move || decode_requests(&shared, &sender, &*wake))?;
        }
        Ok(workers)
    }

    /// Replaces all requests that have not begun.
    pub(crate) fn replace_requests(&self, wanted: Vec<(TileKey, Arc<Source>)>) {
        let mut requests = self.shared.lock_requests();
        requests.queue = wanted.into();
        let TileRequests { queue, running, .. } = &mut *requests;
        queue.retain(|(key, _)| !running.contains(key));
        let is_idle = queue.is_empty();
        drop(requests);
        if !is_idle {
            self.shared.changed.notify_all();
        }
    }

    /// The next tile that was decoded, without waiting.
    pub(crate) fn try_receive(&self) -> Option<DecodedTile> {
        let decoded = self.results.try_recv().ok()?;
        self.shared.lock_requests().running.remove(&decoded.key);
        Some(decoded)
    }

    /// Requests that are not answered yet.
    pub(crate) fn count_pending(&self) -> usize {
        let requests = self.shared.lock_requests();
        requests.queue.len() + requests.running.len()
    }

    /// Drops the picture that is held for a layer that was removed: immediately, or after the
    /// picture that is being decoded.
    pub(crate) fn release(&self, layer: LayerKey) {
        self.shared.lock_requests().removed.insert(layer);
        if let Ok(mut pictures) = self.shared.pictures.try_lock() {
            self.shared.release_removed(&mut pictures);
        }
    }
}

impl Drop for Workers {
    /// The threads end after the tile at hand.
    fn drop(&mut self) {
        let mut requests = self.shared.lock_requests();
        requests.is_closed = true;
        requests.queue.clear();
        drop(requests);
        self.shared.changed.notify_all();
    }
}

impl WorkerState {
    fn lock_requests(&self) -> MutexGuard<'_, TileRequests> {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_pictures(&self) -> MutexGuard<'_, Vec<(LayerKey, Arc<Source>)>> {
        self.pictures.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn release_removed(&self, pictures: &mut Vec<(LayerKey, Arc<Source>)>) {
        let requests = self.lock_requests();
        pictures.retain(|(key, source)| {
            let is_removed = requests.removed.contains(key);
            if is_removed {
                source.whole().into_iter().for_each(WholePicture::release);
            }
            !is_removed
        });
    }

    /// Waits for a request; nothing at the end.
    fn next_request(&self) -> Option<(TileKey, Arc<Source>)> {
        let mut requests = self.lock_requests();
        loop {
            if requests.is_closed {
                return None;
            }
            if let Some((key, source)) = requests.queue.pop_front() {
                requests.running.insert(key);
                return Some((key, source));
            }
            requests = self.changed.wait(requests).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn decode(
        &self,
        (layer, id): TileKey,
        source: &Arc<Source>,
    ) -> Result<Option<TileImage>, DecodeError> {
        let Some(picture) = source.whole() else { return source.decode(id) };
        let mut pictures = self.lock_pictures();
        pictures.retain(|(key, _)| *key != layer);
        // Pictures that were used longest ago make space for this one.
        let needed = picture.decoded_bytes();
        let bytes = |(_, held): &(LayerKey, Arc<Source>)| {
            held.whole().map_or(0, WholePicture::resident_bytes)
        };
        while !pictures.is_empty()
            && pictures.iter().map(bytes).sum::<usize>() + needed > PICTURE_MEMORY
        {
            let (_, oldest) = pictures.remove(0);
            oldest.whole().into_iter().for_each(WholePicture::release);
        }
        pictures.push((layer, source.clone()));
        let decoded = source.decode(id);
        self.release_removed(&mut pictures);
        decoded
    }
}

fn decode_requests(shared: &WorkerState, results: &SyncSender<DecodedTile>, wake: &dyn Fn()) {
    while let Some((key, source)) = shared.next_request() {
        // A decoder that panics costs its tile, not the thread.
        let decoded = catch_unwind(AssertUnwindSafe(|| shared.decode(key, &source)));
        let result = decoded.unwrap_or_else(|_| {
            let what = "its decoder stopped with a failure".to_owned();
            Err(source.decode_error(key.1, PictureFault::Damaged(what)))
        });
        if results.send(DecodedTile { key, result }).is_err() {
            return;
        }
        wake();
    }
}
