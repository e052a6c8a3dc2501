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
