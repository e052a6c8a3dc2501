//! GeoTIFF in strips and in tiles.

use armor_tiles::{OpenFault, PictureFault, PlaneBounds, PlanePoint, Source, SourceKind, TileId};
use tempfile::tempdir;
use tiff::encoder::Compression;

use crate::written::{color_at, geotiff_bytes, pixel, tiled_geotiff_bytes, write};

#[test]
fn strips_of_every_compression_are_read() {
    let folder = tempdir().unwrap();
    let deflate = Compression::Deflate(tiff::encoder::DeflateLevel::Fast);
    for (number, compression) in
        [Compression::Uncompressed, Compression::Lzw, deflate, Compression::Packbits]
            .into_iter()
            .enumerate()
    {
        let bytes = geotiff_bytes(700, 300, compression, 32_631);
        let source = Source::open(&write(folder.path(), "a.tif", bytes)).unwrap();
        assert_eq!((source.kind(), source.reference().epsg()), (SourceKind::GeoTiff, Some(32_631)));
        let expected = PlaneBounds::new(500_000.0, 5_399_850.0, 500_350.0, 5_400_000.0);
        assert_eq!((source.bounds(), source.levels()), (expected, 0..=1));
        let image = source.decode(TileId { level: 0, column: 1, row: 0 }).unwrap().unwrap();
        assert_eq!((image.width, image.height), (700 - 512, 300));
        assert_eq!(pixel(&image, 100, 250), color_at(612, 250), "{number}");
        assert_eq!(image.corners[0], PlanePoint::new(500_256.0, 5_400_000.0));
    }
}

#[test]
fn tiles_and_overviews_are_decoded_one_by_one() {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), "a.tif", tiled_geotiff_bytes(300, 200, None));
    let source = Source::open(&path).unwrap();
    assert_eq!(source.levels(), 0..=1);
    let image = source.decode(TileId { level: 0, column: 4, row: 3 }).unwrap().unwrap();
    assert_eq!((image.width, image.height), (300 - 256, 200 - 192), "without its padding");
    assert_eq!(pixel(&image, 10, 5), color_at(266, 197));
    assert_eq!(image.corners[2], PlanePoint::new(500_150.0, 5_399_900.0));
    let image = source.decode(TileId { level: 1, column: 2, row: 1 }).unwrap().unwrap();
    assert_eq!((image.width, image.height), (150 - 128, 100 - 64));
    assert_eq!(pixel(&image, 3, 4), color_at(262, 136));
    assert_eq!(image.corners[2], PlanePoint::new(500_150.0, 5_399_900.0));
    // Two pixels for a metre are those of the picture, one those of its overview.
    let bounds = source.bounds();
    assert_eq!(source.wanted(bounds, 2.0).len(), 5 * 4);
    assert_eq!(source.wanted(bounds, 1.0).len(), 3 * 2);
    assert_eq!(source.wanted(bounds, 0.01).len(), 3 * 2);
    let id = TileId { level: 0, column: 4, row: 3 };
    assert_eq!(source.coarser(id), Some(TileId { level: 1, column: 2, row: 1 }));
    let none = TileId { level: 1, column: 3, row: 0 };
    assert_eq!(source.decode(none).unwrap_err().fault, PictureFault::NoSuchTile);
}

#[test]
fn another_reference_and_missing_tags_are_refused() {
    let folder = tempdir().unwrap();
    let bytes = geotiff_bytes(4, 4, Compression::Uncompressed, 2_154);
    let error = Source::open(&write(folder.path(), "a.tif", bytes)).unwrap_err();
    assert_eq!(error.fault, OpenFault::Reference("EPSG 2154".to_owned()));

    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<tiff::encoder::colortype::Gray8>(2, 2, &[0; 4]).unwrap();
    let error = Source::open(&write(folder.path(), "b.tif", bytes.into_inner())).unwrap_err();
    assert!(error.to_string().contains("ModelTiepoint"), "{error}");
}

#[test]
fn a_large_picture_needs_overviews_that_are_small() {
    let folder = tempdir().unwrap();
    // It states 20,000 pixels on a side, and its overview is of another shape.
    let path = write(folder.path(), "a.tif", tiled_geotiff_bytes(300, 200, Some(20_000)));
    let error = Source::open(&path).unwrap_err();
    assert!(error.to_string().contains("gdaladdo"), "{error}");
}
