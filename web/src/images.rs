//! Data as images: a camera's picture as JPEG, a map as PNG.

use armor_sdk::messages::{CompressedImage, Image, OccupancyGrid};
use armor_wire::WireType;
use armor_wire::codec;
use armor_wire::schema::Schema;
use jpeg_encoder::{ColorType, Encoder};
use serde_json::{Value, json};

/// The types that have an image, for messages.
pub(crate) const IMAGE_TYPES: &str = "CompressedImage, Image and OccupancyGrid";
/// Quality of a JPEG: the text of a sign is readable, and a picture of 640 × 480 has about 40 kB.
const JPEG_QUALITY: u8 = 80;
/// Most pixels of an image: a phone cannot show more.
const MAX_PIXELS: u64 = 1 << 24;

/// An image as a browser shows it.
#[derive(Debug)]
pub(crate) struct WebImage {
    /// `image/png` or `image/jpeg`.
    pub(crate) content_type: &'static str,
    /// The file.
    pub(crate) bytes: Vec<u8>,
    /// Where it belongs: for a map its frame, resolution, size and origin.
    pub(crate) place: Value,
}

/// Renders a message. A map is white where it is free and black where it is occupied, transparent
/// where it is unknown; its top row is that with the largest y.
///
/// # Errors
/// In words, if the type has no image or the message is damaged.
pub(crate) fn render_image(
    schema: &Schema,
    type_name: &str,
    payload: &[u8],
) -> Result<WebImage, String> {
    let hash = schema.hash();
    let damaged = |error: codec::DecodeError| format!("the message cannot be read: {error}");
    if hash == OccupancyGrid::schema().hash() {
        return render_map(&codec::decode(payload).map_err(damaged)?);
    }
    if hash == CompressedImage::schema().hash() {
        return pass_on(codec::decode(payload).map_err(damaged)?);
    }
    if hash == Image::schema().hash() {
        return render_camera(&codec::decode(payload).map_err(damaged)?);
    }
    Err(format!("{type_name} is no image; {IMAGE_TYPES} are"))
}

fn pass_on(image: CompressedImage) -> Result<WebImage, String> {
    let bytes: Vec<u8> = image.data.to_vec();
    // By their first bytes, so that a browser gets nothing but an image under that name.
    let content_type = match bytes.as_slice() {
        [0xff, 0xd8, 0xff, ..] => "image/jpeg",
        [0x89, b'P', b'N', b'G', ..] => "image/png",
        _ => return Err(format!("its format is `{}`: only jpeg and png are shown", image.format)),
    };
    Ok(WebImage { content_type, bytes, place: json!({"frame": image.frame}) })
}

fn render_camera(image: &Image) -> Result<WebImage, String> {
    let (width, height, step) = (image.width as usize, image.height as usize, image.step as usize);
    let (pixel_len, color) = match image.encoding.as_str() {
        "rgb8" => (3, ColorType::Rgb),
        "bgr8" => (3, ColorType::Bgr),
        "rgba8" => (4, ColorType::Rgba),
        "bgra8" => (4, ColorType::Bgra),
        "mono8" => (1, ColorType::Luma),
        other => return Err(format!("the encoding `{other}` cannot be shown")),
    };
    let size = u16::try_from(width).ok().zip(u16::try_from(height).ok());
    let (narrow_width, narrow_height) = size
        .filter(|(width, height)| *width > 0 && *height > 0)
        .ok_or("its size is 0, or too large")?;
    let row_len = width * pixel_len;
    if step < row_len || image.data.len() < (step * (height - 1)) + row_len {
        return Err("its data are shorter than its size".into());
    }
    let mut pixels = Vec::with_capacity(row_len * height);
    image.data.chunks(step).take(height).for_each(|row| pixels.extend_from_slice(&row[..row_len]));
    let mut bytes = Vec::new();
    Encoder::new(&mut bytes, JPEG_QUALITY)
        .encode(&pixels, narrow_width, narrow_height, color)
        .map_err(|error| error.to_string())?;
    Ok(WebImage { content_type: "image/jpeg", bytes, place: json!({"frame": image.frame}) })
}

fn render_map(map: &OccupancyGrid) -> Result<WebImage, String> {
    let info = &map.info;
    let (width, height) = (info.width as usize, info.height as usize);
    let pixels = u64::from(info.width) * u64::from(info.height);
    if pixels == 0 || pixels > MAX_PIXELS || map.data.len() as u64 != pixels {
        return Err(format!("a map of {width} × {height} cells cannot be shown"));
    }
    let mut gray_alpha = Vec::with_capacity(width * height * 2);
    for row in map.data.chunks(width).rev() {
        for &cell in row {
            gray_alpha.extend(match u8::try_from(cell) {
                Ok(occupied) => [255 - (u16::from(occupied.min(100)) * 255 / 100) as u8, 255],
                Err(_) => [0, 0],
            });
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, info.width, info.height);
    encoder.set_color(png::ColorType::GrayscaleAlpha);
    encoder.set_compression(png::Compression::Fast);
    let write = encoder.write_header().and_then(|mut writer| writer.write_image_data(&gray_alpha));
    write.map_err(|error| error.to_string())?;
    let (at, turned) = (&info.origin.position, &info.origin.orientation);
    let yaw_rad = 2.0 * turned.z.atan2(turned.w);
    let place = json!({
        "frame": map.frame, "resolution_m": info.resolution,
        "width": width, "height": height,
        "origin": {"x_m": at.x, "y_m": at.y, "yaw_rad": yaw_rad},
    });
    Ok(WebImage { content_type: "image/png", bytes, place })
}

#[cfg(test)]
mod tests {
    use armor_sdk::Array;
    use armor_sdk::messages::MapMetaData;

    use super::*;

    fn map(cells: &[i8], width: u32, height: u32) -> OccupancyGrid {
        let info = MapMetaData { width, height, resolution: 0.05, ..MapMetaData::default() };
        OccupancyGrid { info, data: Array::from(cells.to_vec()), ..OccupancyGrid::default() }
    }

    #[test]
    fn the_top_row_of_a_map_is_that_with_the_largest_y() {
        let image = render_map(&map(&[0, 100, -1, 50], 2, 2)).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&image.bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [0, 0, 128, 255, 255, 255, 0, 255]);
        assert_eq!(image.place["width"], 2);
    }

    #[test]
    fn a_map_whose_size_does_not_fit_its_cells_is_refused() {
        assert!(render_map(&map(&[0, 1, 2], 2, 2)).is_err());
        assert!(render_map(&map(&[], 0, 0)).is_err());
        assert!(render_map(&map(&[0], u32::MAX, u32::MAX)).is_err());
    }

    #[test]
    fn a_camera_image_with_padded_rows_becomes_a_jpeg() {
        let image = Image {
            width: 2,
            height: 2,
            step: 8,
            encoding: "rgb8".into(),
            data: Array::from(vec![200; 16]),
            ..Image::default()
        };
        let shown = render_camera(&image).unwrap();
        assert_eq!((shown.content_type, &shown.bytes[..2]), ("image/jpeg", &[0xff, 0xd8][..]));
        let short = Image { data: Array::from(vec![0; 13]), ..image.clone() };
        assert!(render_camera(&short).is_err());
        let empty = Image { height: 0, ..image };
        assert!(render_camera(&empty).is_err());
    }

    #[test]
    fn a_file_that_is_no_image_is_not_passed_on_as_one() {
        let page = CompressedImage {
            format: "jpeg".into(),
            data: Array::from(b"<script>".to_vec()),
            ..CompressedImage::default()
        };
        assert!(pass_on(page).is_err());
    }
}
