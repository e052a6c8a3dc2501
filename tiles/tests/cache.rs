//! The tiles of several layers: decoded on threads, within the bound.

use std::sync::mpsc::channel;
use std::time::Duration;

use armor_tiles::{MAX_TILE_MEMORY, Source, TileId, TileImage, TileState, Tiles};
use tempfile::tempdir;

use crate::written::{color_at, pixel, png_bytes, write};

/// Only a hang takes so long.
const DEADLINE: Duration = Duration::from_secs(120);

/// Receives until nothing is pending.
fn receive_all(tiles: &mut Tiles<TileImage>, woken: &std::sync::mpsc::Receiver<()>) -> usize {
    let mut failures = 0;
    loop {
        failures += tiles.receive(|_, _, image| image).len();
        if tiles.count_pending() == 0 {
            return failures;
        }
        // A tile may have been received before its wake-up.
        let _ = woken.recv_timeout(Duration::from_millis(200));
    }
}

#[test]
fn what_is_wanted_arrives_and_what_is_removed_is_gone() {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), "a.png", png_bytes(1100, 600, color_at));
    write(folder.path(), "a.wld", "1\n0\n0\n-1\n0\n0\n");
    let (sender, woken) = channel();
    let mut tiles = Tiles::new(move || sender.send(()).unwrap_or_default()).unwrap();
    let source = Source::open(&path).unwrap();
    let wanted = source.wanted(source.bounds(), 1.0);
    assert_eq!(wanted.len(), 6);
    let layer = tiles.add(source);
    tiles.want(wanted.iter().map(|&id| (layer, id)));
    assert_eq!(receive_all(&mut tiles, &woken), 0);
    for &id in &wanted {
        let TileState::Ready(image) = tiles.get(layer, id) else { panic!("{id}") };
        assert_eq!(pixel(image, 3, 4), color_at(id.column * 512 + 3, id.row * 512 + 4));
    }
    assert_eq!(tiles.stored_bytes(), 1100 * 600 * 4);

    let none = TileId { level: 0, column: 99, row: 0 };
    tiles.want([(layer, none)]);
    assert_eq!(receive_all(&mut tiles, &woken), 1);
    assert!(matches!(tiles.get(layer, none), TileState::Failed(_)));
    assert!(matches!(tiles.get(layer, wanted[0]), TileState::Ready(_)), "it is kept");

    tiles.remove(layer);
    assert!(matches!(tiles.get(layer, wanted[0]), TileState::Unknown));
    assert_eq!(tiles.stored_bytes(), 0);
    tiles.want([(layer, wanted[0])]);
    assert_eq!(tiles.count_pending(), 0);
}

/// Three pictures of 4000 × 4000 pixels have 192 MiB, and their reductions a third more.
#[test]
fn the_memory_has_its_bound_with_more_pictures_than_fit() {
    let folder = tempdir().unwrap();
    let bytes = png_bytes(4000, 4000, |column, _| [(column / 16) as u8, 0, 0]);
    let (sender, woken) = channel();
    let mut tiles = Tiles::new(move || sender.send(()).unwrap_or_default()).unwrap();
    let mut wanted = Vec::new();
    for name in ["a", "b", "c"] {
        let path = write(folder.path(), &format!("{name}.png"), &bytes);
        write(folder.path(), &format!("{name}.wld"), "1\n0\n0\n-1\n0\n0\n");
        let source = Source::open(&path).unwrap();
        let ids = source.wanted(source.bounds(), 1.0);
        assert_eq!(ids.len(), 64);
        let layer = tiles.add(source);
        wanted.extend(ids.into_iter().map(|id| (layer, id)));
    }
    for layers in wanted.chunks(64) {
        tiles.want(layers.iter().copied());
        assert_eq!(receive_all(&mut tiles, &woken), 0);
        assert!(tiles.memory_bytes() <= MAX_TILE_MEMORY);
        assert!(
            layers.iter().all(|&(layer, id)| matches!(tiles.get(layer, id), TileState::Ready(_)))
        );
    }
    // All at a time: the first ones, as many as fit.
    tiles.want(wanted.iter().copied());
    receive_all(&mut tiles, &woken);
    assert!(tiles.memory_bytes() <= MAX_TILE_MEMORY);
    let ready = |&&(layer, id): &&_| matches!(tiles.get(layer, id), TileState::Ready(_));
    let count = wanted.iter().take_while(ready).count();
    assert!((64..=96).contains(&count), "{count}");
}

#[test]
fn requests_of_before_are_dropped() {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), "a.png", png_bytes(3000, 3000, color_at));
    write(folder.path(), "a.wld", "1\n0\n0\n-1\n0\n0\n");
    let mut tiles: Tiles<TileImage> = Tiles::new(|| ()).unwrap();
    let source = Source::open(&path).unwrap();
    let ids = source.wanted(source.bounds(), 1.0);
    let layer = tiles.add(source);
    tiles.want(ids.iter().map(|&id| (layer, id)));
    tiles.want([]);
    let deadline = std::time::Instant::now() + DEADLINE;
    while tiles.count_pending() > 0 {
        tiles.receive(|_, _, image| image);
        assert!(std::time::Instant::now() < deadline, "it hangs");
        std::thread::yield_now();
    }
    let count =
        ids.iter().filter(|&&id| matches!(tiles.get(layer, id), TileState::Ready(_))).count();
    assert!(count < ids.len(), "all {count} were decoded");
}
