//! PMTiles and MBTiles.

use armor_tiles::{MapReference, OpenFault, PictureFault, PlaneBounds, Source, SourceKind, TileId};
use tempfile::tempdir;

use crate::written::{
    ArchiveForm, WrittenTile, color_at, hilbert_number, jpeg_bytes, pixel, pmtiles_bytes,
    png_bytes, write, write_mbtiles,
};

const FORM: ArchiveForm = ArchiveForm {
    kind: 2,
    is_compressed: true,
    leaf_entries: 1_000,
    degrees: [2.0, 48.0, 3.0, 49.0],
};

/// The tiles of zooms 6 to 9 around Paris; the first pixel of each names its column and row.
fn paris_tiles() -> Vec<WrittenTile> {
    let mut tiles = Vec::new();
    for zoom in 6..=9_u8 {
        let (column, row) = (32 << (zoom - 6), 22 << (zoom - 6));
        for (x, y) in (column..column + 3).flat_map(|x| (row..row + 3).map(move |y| (x, y))) {
            let color = move |_, _| [x as u8, y as u8, zoom];
            tiles.push((zoom, x, y, png_bytes(256, 256, color)));
        }
    }
    tiles
}

fn check_paris(source: &Source, tiles: &[WrittenTile]) {
    assert_eq!((source.reference(), source.levels()), (MapReference::WebMercator, 6..=9));
    let bounds = source.bounds();
    assert!((bounds.min.x - 222_638.98).abs() < 0.1, "{bounds:?}");
    assert!((bounds.max.y - 6_274_861.39).abs() < 0.1, "{bounds:?}");
    for &(level, column, row, _) in tiles {
        let image = source.decode(TileId { level, column, row }).unwrap().unwrap();
        assert_eq!((image.width, image.height), (256, 256));
        assert_eq!(pixel(&image, 0, 0), [column as u8, row as u8, level]);
    }
    let none = TileId { level: 9, column: 0, row: 0 };
    assert_eq!(source.decode(none).unwrap(), None);
    let beyond = TileId { level: 10, column: 0, row: 0 };
    assert_eq!(source.decode(beyond).unwrap_err().fault, PictureFault::NoSuchTile);

    // A pixel of the screen for one of zoom 8.
    let pixels_per_unit = 256.0 * 256.0 / 40_075_016.69;
    let wanted = source.wanted(bounds, pixels_per_unit);
    assert!(wanted.iter().all(|id| id.level == 8), "{wanted:?}");
    assert!(wanted.contains(&TileId { level: 8, column: 129, row: 88 }), "{wanted:?}");
    let corners = source.corners(TileId { level: 8, column: 129, row: 88 }).unwrap();
    assert!((corners[0].x - 156_543.03).abs() < 0.01, "{corners:?}");
    assert!(corners[0].y > corners[3].y && corners[1].x > corners[0].x);
    // Far in: the deepest zoom. Far out: the first one.
    assert!(source.wanted(bounds, 1e9).iter().all(|id| id.level == 9));
    assert!(source.wanted(bounds, 1e-9).iter().all(|id| id.level == 6));
    assert_eq!(source.wanted(PlaneBounds::new(-9e6, -9e6, -8e6, -8e6), 1.0), []);
    assert_eq!(source.coarser(wanted[0]).unwrap().level, 7);
}

#[test]
fn pmtiles_are_read_from_the_root_and_from_leaves() {
    let folder = tempdir().unwrap();
    let tiles = paris_tiles();
    for (is_compressed, leaf_entries) in [(false, 1_000), (true, 1_000), (false, 5), (true, 5)] {
        let form = ArchiveForm { is_compressed, leaf_entries, ..FORM };
        let path = write(folder.path(), "a.pmtiles", pmtiles_bytes(&tiles, form));
        let source = Source::open(&path).unwrap();
        assert_eq!(source.kind(), SourceKind::PmTiles);
        assert_eq!(source.attribution(), Some("© The Surveyors"));
        check_paris(&source, &tiles);
    }
}

#[test]
fn mbtiles_are_read_with_rows_from_the_south() {
    let folder = tempdir().unwrap();
    let tiles = paris_tiles();
    let path = folder.path().join("a.mbtiles");
    let metadata = [
        ("name", "Paris"),
        ("format", "png"),
        ("bounds", "2.0,48.0,3.0,49.0"),
        ("minzoom", "6"),
        ("maxzoom", "9"),
        ("attribution", "&copy; The Surveyors"),
    ];
    write_mbtiles(&path, &tiles, &metadata, 4_096);
    let source = Source::open(&path).unwrap();
    assert_eq!(
        (source.kind(), source.attribution()),
        (SourceKind::MbTiles, Some("© The Surveyors"))
    );
    check_paris(&source, &tiles);

    // Without zooms these are found in the tiles.
    std::fs::remove_file(&path).unwrap();
    write_mbtiles(&path, &tiles, &metadata[..3], 4_096);
    check_paris(&Source::open(&path).unwrap(), &tiles);
}

#[test]
fn tiles_that_have_no_decoder_are_refused_by_name() {
    let folder = tempdir().unwrap();
    let tiles = [(0, 0, 0, b"RIFF\x08\x00\x00\x00WEBPVP8 ".to_vec())];
    for (kind, name) in [(1, "MVT"), (4, "WebP"), (5, "AVIF"), (6, "MLT"), (9, "`type 9`")] {
        let bytes = pmtiles_bytes(&tiles, ArchiveForm { kind, ..FORM });
        let error = Source::open(&write(folder.path(), "a.pmtiles", bytes)).unwrap_err();
        assert_eq!(error.place, "byte 99");
        assert!(error.to_string().contains(name), "{error}");
    }
    for format in ["pbf", "webp"] {
        let path = folder.path().join(format!("{format}.mbtiles"));
        write_mbtiles(&path, &tiles, &[("format", format)], 4_096);
        let error = Source::open(&path).unwrap_err();
        assert_eq!(error.place, "metadata `format`");
        assert!(matches!(error.fault, OpenFault::NotSupported { .. }), "{error}");
    }
    // An archive that states PNG and has something else.
    let path = write(folder.path(), "b.pmtiles", pmtiles_bytes(&tiles, FORM));
    let error = Source::open(&path).unwrap().decode(TileId { level: 0, column: 0, row: 0 });
    assert_eq!(error.unwrap_err().fault, PictureFault::UnknownFormat("WebP"));
}

#[test]
fn damage_is_named_with_its_place() {
    let folder = tempdir().unwrap();
    let tiles = paris_tiles();
    let whole = pmtiles_bytes(&tiles, ArchiveForm { leaf_entries: 5, ..FORM });
    let open = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        Source::open(&write(folder.path(), "a.pmtiles", bytes))
    };
    let place = |at: usize, byte: u8| open(at, byte).unwrap_err().place;
    assert_eq!(place(7, 2), "byte 7");
    assert_eq!(place(97, 3), "byte 97");
    assert_eq!(place(98, 4), "byte 98");
    assert_eq!(place(14, 9), "byte 8");
    assert_eq!(place(62, 9), "byte 56");
    assert_eq!(place(101, 200), "byte 100");
    assert_eq!(place(105, 99), "byte 102");
    assert_eq!(place(127, 0), "byte 127");
    let short = Source::open(&write(folder.path(), "a.pmtiles", &whole[..100])).unwrap_err();
    assert!(short.to_string().contains("its header is not whole"), "{short}");

    // The leaves are damaged: their tiles fail, and are named.
    let leaves = u64::from_le_bytes(whole[40..48].try_into().unwrap()) as usize;
    let source = open(leaves, 0).unwrap();
    let (level, column, row, _) =
        *tiles.iter().min_by_key(|tile| hilbert_number(tile.0, tile.1, tile.2)).unwrap();
    let error = source.decode(TileId { level, column, row }).unwrap_err();
    assert!(error.to_string().contains(&format!("tile {level}/{column}/{row}: ")), "{error}");
    assert!(error.to_string().contains(&format!("directory at byte {leaves}")), "{error}");

    let path = folder.path().join("a.mbtiles");
    write_mbtiles(&path, &tiles, &[("format", "png"), ("bounds", "2,48,three,49")], 4_096);
    let error = Source::open(&path).unwrap_err();
    assert_eq!(error.place, "metadata `bounds`");
    let database = rusqlite::Connection::open(folder.path().join("b.mbtiles")).unwrap();
    database.execute_batch("CREATE TABLE other (a)").unwrap();
    let error = Source::open(&folder.path().join("b.mbtiles")).unwrap_err();
    assert_eq!(error.place, "table metadata");
}

/// A view in the file may compute for ever, or make a tile of any length.
#[test]
fn a_view_that_harms_is_stopped() {
    let folder = tempdir().unwrap();
    let views = [
        "CREATE VIEW tiles AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)
         SELECT 0 AS zoom_level, 0 AS tile_column, 0 AS tile_row, i AS tile_data FROM n WHERE i < 0",
        "CREATE VIEW tiles AS SELECT 0 AS zoom_level, 0 AS tile_column, 0 AS tile_row,
         zeroblob(900000000) AS tile_data",
        "CREATE VIEW tiles AS SELECT 0 AS zoom_level, 0 AS tile_column, 0 AS tile_row,
         load_extension('/tmp/a.so') AS tile_data",
    ];
    for (number, view) in views.iter().enumerate() {
        let path = folder.path().join(format!("{number}.mbtiles"));
        let database = rusqlite::Connection::open(&path).unwrap();
        let metadata = "CREATE TABLE metadata (name text, value text);
            INSERT INTO metadata VALUES ('minzoom', 0), ('maxzoom', 0);";
        database.execute_batch(&format!("{metadata}{view}")).unwrap();
        drop(database);
        let decoded =
            Source::open(&path).map(|source| source.decode(TileId { level: 0, column: 0, row: 0 }));
        match decoded {
            Ok(Ok(image)) => panic!("{number}: {image:?}"),
            Ok(Err(error)) => assert!(error.to_string().contains("SQLite reports"), "{error}"),
            Err(error) => assert!(error.to_string().contains("SQLite reports"), "{error}"),
        }
    }
}

#[test]
fn jpeg_tiles_of_another_size_and_runs_are_read() {
    let folder = tempdir().unwrap();
    let tiles = [(0, 0, 0, jpeg_bytes(512, 512, [10, 200, 30]))];
    let form = ArchiveForm { kind: 3, degrees: [0.0; 4], ..FORM };
    let path = write(folder.path(), "a.pmtiles", pmtiles_bytes(&tiles, form));
    let source = Source::open(&path).unwrap();
    assert!((source.bounds().width() - 40_075_016.69).abs() < 1.0, "{source:?}");
    let image = source.decode(TileId { level: 0, column: 0, row: 0 }).unwrap().unwrap();
    assert_eq!(image.width, 512);
    let large = [(0, 0, 0, png_bytes(2_000, 1_100, color_at))];
    let path = write(folder.path(), "a.pmtiles", pmtiles_bytes(&large, FORM));
    let error = Source::open(&path).unwrap().decode(TileId { level: 0, column: 0, row: 0 });
    let expected = PictureFault::LargeTile { width: 2_000, height: 1_100 };
    assert_eq!(error.unwrap_err().fault, expected);
}
