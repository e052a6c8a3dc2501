//! Archives of a gigabyte: how long they take to open, printed with `--nocapture`. No time is
//! asserted.

use std::os::unix::fs::FileExt;
use std::path::Path;
use std::time::Instant;

use armor_tiles::{Source, TileId};
use tempfile::tempdir;

use crate::written::{
    ArchiveForm, WrittenEntry, hilbert_number, pixel, pmtiles_front, png_bytes, write_mbtiles,
};

const GIGABYTE: u64 = 1 << 30;
const FORM: ArchiveForm =
    ArchiveForm { kind: 2, is_compressed: true, leaf_entries: 4_096, degrees: [0.0; 4] };

fn measure(what: &str, path: &Path, id: TileId) -> Source {
    let len = std::fs::metadata(path).unwrap().len();
    let begin = Instant::now();
    let source = Source::open(path).unwrap();
    let opened = begin.elapsed();
    let image = source.decode(id).unwrap().unwrap();
    let decoded = begin.elapsed() - opened;
    assert_eq!(pixel(&image, 0, 0), [7, 8, 9]);
    let ms = |time: std::time::Duration| time.as_secs_f64() * 1e3;
    println!("{what} of {len} bytes: open {:.2} ms, first tile {:.2} ms", ms(opened), ms(decoded));
    source
}

/// All 349,525 tiles of the zooms 0 to 9, three KiB apart. The file is sparse: only the directories
/// and one tile are written.
#[test]
fn a_large_pmtiles_archive_opens_by_its_header_and_root() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("large.pmtiles");
    let tile = png_bytes(256, 256, |_, _| [7, 8, 9]);
    let count = hilbert_number(10, 0, 0);
    let apart = GIGABYTE / count;
    let entries: Vec<WrittenEntry> =
        (0..count).map(|id| (id, 1, tile.len() as u64, id * apart)).collect();
    let front = pmtiles_front(&entries, GIGABYTE, (0, 9), FORM);
    let file = std::fs::File::create(&path).unwrap();
    file.write_all_at(&front, 0).unwrap();
    let data = front.len() as u64;
    file.set_len(data + GIGABYTE).unwrap();
    let id = TileId { level: 9, column: 300, row: 200 };
    file.write_all_at(&tile, data + hilbert_number(9, 300, 200) * apart).unwrap();
    measure("PMTiles", &path, id);
}

/// 65,536 tiles of 16 KiB; with `ARMOR_FULL` only, since it writes a gigabyte.
#[test]
fn a_large_mbtiles_archive_opens_by_its_metadata() {
    if std::env::var_os("ARMOR_FULL").is_none() {
        return;
    }
    let folder = tempdir().unwrap();
    let path = folder.path().join("large.mbtiles");
    let tile = png_bytes(256, 256, |_, _| [7, 8, 9]);
    let metadata = [("format", "png"), ("minzoom", "8"), ("maxzoom", "8")];
    write_mbtiles(&path, &[(8, 255, 255, tile)], &metadata, 4_096);
    let database = rusqlite::Connection::open(&path).unwrap();
    let fill = "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;
        WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 65534)
        INSERT INTO tiles SELECT 8, i % 256, 255 - i / 256, zeroblob(16300) FROM n";
    database.execute_batch(fill).unwrap();
    drop(database);
    measure("MBTiles", &path, TileId { level: 8, column: 255, row: 255 });
}
