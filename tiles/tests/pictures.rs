//! PNG and JPEG with world files.

use armor_tiles::{
    MapReference, OpenFault, PictureFault, PlaneBounds, PlanePoint, Source, SourceKind, TileId,
};
use tempfile::tempdir;

use crate::written::{color_at, jpeg_bytes, pixel, png_bytes, write};

/// Half a metre for a pixel; the top left corner at (100, 50).
const WORLD: &str = "0.5\n0\n0\n-0.5\n100.25\n49.75\n";

#[test]
fn a_png_lies_where_its_world_file_says() {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), "site.png", png_bytes(1300, 700, color_at));
    write(folder.path(), "site.pgw", WORLD);
    let source = Source::open(&path).unwrap();
    assert_eq!((source.kind(), source.reference()), (SourceKind::Png, MapReference::Local));
    assert_eq!(source.bounds(), PlaneBounds::new(100.0, -300.0, 750.0, 50.0));
    assert_eq!(source.levels(), 0..=2);

    // At two pixels for a metre, the finest level.
    let wanted = source.wanted(PlaneBounds::new(300.0, -100.0, 700.0, 0.0), 2.0);
    assert_eq!(wanted.len(), 3, "{wanted:?}");
    let tile = TileId { level: 0, column: 2, row: 1 };
    let image = source.decode(tile).unwrap().unwrap();
    assert_eq!((image.width, image.height), (1300 - 1024, 700 - 512));
    assert_eq!(pixel(&image, 10, 20), color_at(1034, 532));
    assert_eq!(image.corners[0], PlanePoint::new(612.0, -206.0));
    assert_eq!(image.corners[2], PlanePoint::new(750.0, -300.0));
    assert_eq!(source.coarser(tile), Some(TileId { level: 1, column: 1, row: 0 }));

    // A tenth of this: one tile of the coarsest level.
    let wanted = source.wanted(source.bounds(), 0.2);
    assert_eq!(wanted, [TileId { level: 2, column: 0, row: 0 }]);
    let image = source.decode(wanted[0]).unwrap().unwrap();
    assert_eq!((image.width, image.height), (325, 175));
    assert_eq!(source.wanted(PlaneBounds::new(0.0, 0.0, 99.0, 9.0), 2.0), []);
}

#[test]
fn a_turned_jpeg_in_a_zone_has_its_four_corners() {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), "site.jpeg", jpeg_bytes(64, 32, [200, 40, 90]));
    write(folder.path(), "site.JGW", "0\n1\n1\n0\n448000\n5411000\n");
    let utm = r#"PROJCS["WGS_1984_UTM_Zone_31N",GEOGCS["GCS_WGS_1984"]]"#;
    write(folder.path(), "site.prj", utm);
    let source = Source::open(&path).unwrap();
    assert_eq!((source.kind(), source.reference().epsg()), (SourceKind::Jpeg, Some(32631)));
    let image = source.decode(TileId { level: 0, column: 0, row: 0 }).unwrap().unwrap();
    let near = pixel(&image, 30, 15);
    assert!(near.iter().zip([200, 40, 90]).all(|(a, b)| a.abs_diff(b) < 6), "{near:?}");
    // Columns point to the north, rows to the east.
    assert_eq!(image.corners[1], PlanePoint::new(447_999.5, 5_411_063.5));
    assert_eq!(image.corners[3], PlanePoint::new(448_031.5, 5_410_999.5));
}

#[test]
fn grey_palettes_and_opacity_become_rgba() {
    let folder = tempdir().unwrap();
    write(folder.path(), "a.pgw", "1\n0\n0\n-1\n0\n0\n");
    let check = |color, depth, palette: Option<Vec<u8>>, data: &[u8], expected: [u8; 8]| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        let path = write(folder.path(), "a.png", bytes);
        let source = Source::open(&path).unwrap();
        let image = source.decode(TileId { level: 0, column: 0, row: 0 }).unwrap().unwrap();
        assert_eq!(image.rgba, expected, "{color:?} {depth:?}");
    };
    use png::{BitDepth, ColorType};
    let grey = [0, 0, 0, 255, 255, 255, 255, 255];
    check(ColorType::Grayscale, BitDepth::One, None, &[0b0100_0000], grey);
    check(ColorType::Grayscale, BitDepth::Sixteen, None, &[0, 0, 255, 255], grey);
    let palette = Some(vec![1, 2, 3, 4, 5, 6]);
    let indexed = [4, 5, 6, 255, 1, 2, 3, 255];
    check(ColorType::Indexed, BitDepth::Eight, palette, &[1, 0], indexed);
    let clear = [9, 8, 7, 6, 5, 4, 3, 2];
    check(ColorType::Rgba, BitDepth::Eight, None, &clear, clear);
}

#[test]
fn a_fault_names_its_file_and_the_remedy() {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), "site.png", png_bytes(4, 4, color_at));
    let error = Source::open(&path).unwrap_err();
    assert!(matches!(error.fault, OpenFault::NoWorldFile(_)));
    assert!(error.to_string().contains("write ") && error.to_string().contains("site.pgw"));

    write(folder.path(), "site.wld", "1\n0\n0\nminus one\n0\n0\n");
    let error = Source::open(&path).unwrap_err();
    assert!(error.file.ends_with("site.wld") && error.place == "line 4", "{error}");

    write(folder.path(), "site.wld", WORLD);
    write(folder.path(), "site.prj", r#"PROJCS["RGF93",AUTHORITY["EPSG","2154"]]"#);
    let error = Source::open(&path).unwrap_err();
    assert_eq!(error.fault, OpenFault::Reference("EPSG 2154".to_owned()));
    assert!(error.to_string().contains("gdalwarp"), "{error}");
    std::fs::remove_file(folder.path().join("site.prj")).unwrap();

    // The pixels are damaged: it opens, and its tiles fail.
    let mut bytes = png_bytes(400, 400, color_at);
    bytes.truncate(bytes.len() / 2);
    write(folder.path(), "site.png", &bytes);
    let source = Source::open(&path).unwrap();
    let error = source.decode(TileId { level: 0, column: 0, row: 0 }).unwrap_err();
    assert!(matches!(error.fault, PictureFault::Png(_)), "{error}");
    assert!(error.to_string().contains("site.png, tile 0/0/0: "), "{error}");

    let error = Source::open(&write(folder.path(), "site.txt", "a text")).unwrap_err();
    assert_eq!(error.fault, OpenFault::UnknownKind);
    let error = Source::open(&folder.path().join("none.png")).unwrap_err();
    assert!(matches!(error.fault, OpenFault::Unreadable(_)));
}

#[test]
fn a_picture_that_is_too_large_is_refused_by_its_header() {
    let folder = tempdir().unwrap();
    write(folder.path(), "huge.pgw", WORLD);
    let mut bytes = png_bytes(1, 1, color_at);
    // The width and the height of the header, and its checksum.
    bytes[16..24].copy_from_slice(&[0, 0, 0x60, 0, 0, 0, 0x60, 0]);
    let crc = crc_of(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    let error = Source::open(&write(folder.path(), "huge.png", bytes)).unwrap_err();
    let expected = PictureFault::TooManyPixels { width: 0x6000, height: 0x6000 };
    assert_eq!(error.fault, OpenFault::Picture(expected));
}

fn crc_of(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 }
        })
    })
}
