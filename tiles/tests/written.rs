//! Writes small files of every kind.

use std::path::{Path, PathBuf};

/// The colour of a pixel in all test pictures: it names its place.
pub fn color_at(column: u32, row: u32) -> [u8; 3] {
    [(column % 251) as u8, (row % 241) as u8, ((column / 7 + row / 5) % 256) as u8]
}

pub fn png_bytes(width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    let pixels: Vec<u8> = (0..height)
        .flat_map(|row| (0..width).map(move |column| (column, row)))
        .flat_map(|(column, row)| color(column, row))
        .collect();
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&pixels).unwrap();
    writer.finish().unwrap();
    bytes
}

pub fn jpeg_bytes(width: u16, height: u16, color: [u8; 3]) -> Vec<u8> {
    let pixels = color.repeat(usize::from(width) * usize::from(height));
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, 95);
    encoder.encode(&pixels, width, height, jpeg_encoder::ColorType::Rgb).unwrap();
    bytes
}

pub fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// The colour of a pixel of an image.
pub fn pixel(image: &armor_tiles::TileImage, column: u32, row: u32) -> [u8; 3] {
    let at = (row as usize * image.width as usize + column as usize) * 4;
    image.rgba[at..at + 3].try_into().unwrap()
}

/// A tile of an archive: zoom, column, row from the north, and its bytes.
pub type WrittenTile = (u8, u32, u32, Vec<u8>);

/// How an archive is written.
#[derive(Clone, Copy)]
pub struct ArchiveForm {
    /// The number of the format of its tiles: 2 for PNG, 3 for JPEG.
    pub kind: u8,
    /// Whether directories and metadata are compressed by gzip.
    pub is_compressed: bool,
    /// Entries of a leaf; with more of them the root has directories only.
    pub leaf_entries: usize,
    /// West, south, east, north.
    pub degrees: [f64; 4],
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut encoder, bytes).unwrap();
    encoder.finish().unwrap()
}

fn put_number(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// The number of a tile along Hilbert's curve, by turning whole squares.
pub fn hilbert_number(zoom: u8, mut x: u32, mut y: u32) -> u64 {
    let all = 1_u32 << zoom;
    let (mut number, mut side) = (0, all / 2);
    while side > 0 {
        let (right, down) = (u32::from(x & side > 0), u32::from(y & side > 0));
        number += u64::from(side) * u64::from(side) * u64::from((3 * right) ^ down);
        if down == 0 {
            if right == 1 {
                (x, y) = (all - 1 - x, all - 1 - y);
            }
            (x, y) = (y, x);
        }
        side /= 2;
    }
    (0..u64::from(zoom)).map(|zoom| 1 << (2 * zoom)).sum::<u64>() + number
}

/// An entry of a directory: tile, run, length, offset.
pub type WrittenEntry = (u64, u64, u64, u64);

pub fn directory_bytes(entries: &[WrittenEntry]) -> Vec<u8> {
    let mut bytes = Vec::new();
    put_number(&mut bytes, entries.len() as u64);
    let mut last = 0;
    for entry in entries {
        put_number(&mut bytes, entry.0 - last);
        last = entry.0;
    }
    entries.iter().for_each(|entry| put_number(&mut bytes, entry.1));
    entries.iter().for_each(|entry| put_number(&mut bytes, entry.2));
    let mut end = None;
    for entry in entries {
        put_number(&mut bytes, if end == Some(entry.3) { 0 } else { entry.3 + 1 });
        end = Some(entry.3 + entry.2);
    }
    bytes
}

/// The header, the directories and the metadata of a PMTiles archive, and where its tiles begin.
pub fn pmtiles_front(
    entries: &[WrittenEntry],
    data_len: u64,
    zooms: (u8, u8),
    form: ArchiveForm,
) -> Vec<u8> {
    let pack = |bytes: Vec<u8>| if form.is_compressed { gzip(&bytes) } else { bytes };
    let mut leaves = Vec::new();
    let root = if entries.len() > form.leaf_entries {
        let mut root = Vec::new();
        for part in entries.chunks(form.leaf_entries) {
            let leaf = pack(directory_bytes(part));
            root.push((part[0].0, 0, leaf.len() as u64, leaves.len() as u64));
            leaves.extend(leaf);
        }
        pack(directory_bytes(&root))
    } else {
        pack(directory_bytes(entries))
    };
    let metadata = pack(br#"{"attribution": "<b>&copy; The Surveyors</b>"}"#.to_vec());
    let mut bytes = b"PMTiles\x03".to_vec();
    let mut offset = 127;
    for len in [root.len(), metadata.len(), leaves.len(), data_len as usize] {
        bytes.extend((offset as u64).to_le_bytes());
        bytes.extend((len as u64).to_le_bytes());
        offset += len;
    }
    let count = entries.len() as u64;
    [count; 3].iter().for_each(|count| bytes.extend(count.to_le_bytes()));
    let compression = if form.is_compressed { 2 } else { 1 };
    bytes.extend([1, compression, 1, form.kind, zooms.0, zooms.1]);
    let degrees = form.degrees.map(|value| ((value * 1e7) as i32).to_le_bytes());
    bytes.extend(degrees.concat());
    bytes.extend([zooms.0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(bytes.len(), 127);
    [root, metadata, leaves].iter().for_each(|part| bytes.extend(part));
    bytes
}

pub fn pmtiles_bytes(tiles: &[WrittenTile], form: ArchiveForm) -> Vec<u8> {
    let mut sorted: Vec<(u64, &WrittenTile)> =
        tiles.iter().map(|tile| (hilbert_number(tile.0, tile.1, tile.2), tile)).collect();
    sorted.sort_by_key(|(number, _)| *number);
    let (mut entries, mut data): (Vec<WrittenEntry>, Vec<u8>) = (Vec::new(), Vec::new());
    for (number, tile) in &sorted {
        entries.push((*number, 1, tile.3.len() as u64, data.len() as u64));
        data.extend(&tile.3);
    }
    let zooms = tiles.iter().map(|tile| tile.0);
    let zooms = (zooms.clone().min().unwrap(), zooms.max().unwrap());
    let mut bytes = pmtiles_front(&entries, data.len() as u64, zooms, form);
    bytes.extend(data);
    bytes
}

/// Writes an MBTiles archive with these metadata.
pub fn write_mbtiles(
    path: &Path,
    tiles: &[WrittenTile],
    metadata: &[(&str, &str)],
    page_bytes: u32,
) {
    let mut database = rusqlite::Connection::open(path).unwrap();
    database.pragma_update(None, "page_size", page_bytes).unwrap();
    let tables = "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;
        CREATE TABLE metadata (name text, value text);
        CREATE TABLE tiles (zoom_level integer, tile_column integer, tile_row integer, tile_data blob);
        CREATE UNIQUE INDEX tile_index on tiles (zoom_level, tile_column, tile_row);";
    database.execute_batch(tables).unwrap();
    let changes = database.transaction().unwrap();
    for (name, value) in metadata {
        changes.execute("INSERT INTO metadata VALUES (?1, ?2)", (name, value)).unwrap();
    }
    for (zoom, column, row, data) in tiles {
        let row = (1_u32 << zoom) - 1 - row;
        let insert = "INSERT INTO tiles VALUES (?1, ?2, ?3, ?4)";
        changes.execute(insert, (zoom, column, row, data)).unwrap();
    }
    changes.commit().unwrap();
}

/// The tags of a place: half a metre for a pixel, the corner at (500,000, 5,400,000).
fn write_place<W: std::io::Write + std::io::Seek, K: tiff::encoder::TiffKind>(
    directory: &mut tiff::encoder::DirectoryEncoder<'_, W, K>,
    epsg: u16,
) {
    use tiff::tags::Tag;
    let scale = [0.5, 0.5, 0.0];
    let tie_point = [0.0, 0.0, 0.0, 500_000.0, 5_400_000.0, 0.0];
    directory.write_tag(Tag::ModelPixelScaleTag, &scale[..]).unwrap();
    directory.write_tag(Tag::ModelTiepointTag, &tie_point[..]).unwrap();
    let keys = [1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, epsg];
    directory.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
}

/// A GeoTIFF in strips.
pub fn geotiff_bytes(
    width: u32,
    height: u32,
    compression: tiff::encoder::Compression,
    epsg: u16,
) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder =
        tiff::encoder::TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
    let mut image = encoder.new_image::<tiff::encoder::colortype::RGB8>(width, height).unwrap();
    write_place(image.encoder(), epsg);
    let pixels: Vec<u8> = (0..height)
        .flat_map(|row| (0..width).flat_map(move |column| color_at(column, row)))
        .collect();
    image.write_data(&pixels).unwrap();
    bytes.into_inner()
}

/// A GeoTIFF of tiles of 64 pixels, and its overview of half the size.
pub fn tiled_geotiff_bytes(width: u32, height: u32, big_side: Option<u32>) -> Vec<u8> {
    use tiff::tags::Tag;
    const SIDE: u32 = 64;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).unwrap();
    for step in [1, 2] {
        let (width, height) = (width / step, height / step);
        let mut directory = encoder.image_directory().unwrap();
        let (mut offsets, mut lens): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        for top in (0..height).step_by(SIDE as usize) {
            for left in (0..width).step_by(SIDE as usize) {
                let tile: Vec<u8> = (top..top + SIDE)
                    .flat_map(|row| (left..left + SIDE).map(move |column| (column, row)))
                    .flat_map(|(column, row)| color_at(column * step, row * step))
                    .collect();
                offsets.push(directory.write_data(&tile[..]).unwrap() as u32);
                lens.push(tile.len() as u32);
            }
        }
        // A picture may state more than it has.
        let stated = if step == 1 { big_side } else { None };
        if let Some(side) = stated {
            let count = side.div_ceil(SIDE).pow(2) as usize;
            (offsets, lens) = (vec![offsets[0]; count], vec![lens[0]; count]);
        }
        directory.write_tag(Tag::NewSubfileType, step - 1).unwrap();
        directory.write_tag(Tag::ImageWidth, stated.unwrap_or(width)).unwrap();
        directory.write_tag(Tag::ImageLength, stated.unwrap_or(height)).unwrap();
        directory.write_tag(Tag::BitsPerSample, &[8_u16, 8, 8][..]).unwrap();
        directory.write_tag(Tag::Compression, 1_u16).unwrap();
        directory.write_tag(Tag::PhotometricInterpretation, 2_u16).unwrap();
        directory.write_tag(Tag::SamplesPerPixel, 3_u16).unwrap();
        directory.write_tag(Tag::TileWidth, SIDE).unwrap();
        directory.write_tag(Tag::TileLength, SIDE).unwrap();
        directory.write_tag(Tag::TileOffsets, &offsets[..]).unwrap();
        directory.write_tag(Tag::TileByteCounts, &lens[..]).unwrap();
        if step == 1 {
            write_place(&mut directory, 32_631);
        }
        directory.finish().unwrap();
    }
    bytes.into_inner()
}
