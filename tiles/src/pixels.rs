//! Decodes PNG and JPEG to pixels, with limits that are checked before there is memory for them.

use std::io::{BufRead, Seek};

use png::{ColorType, Limits, Transformations};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::error::PictureFault;
use crate::limits::{MAX_PROGRESSIVE_PIXELS, MAX_SIDE, PNG_OVERHEAD};

const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
const JPEG: &[u8] = &[0xff, 0xd8, 0xff];

/// Pixels as red, green, blue and opacity, the top row first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pixels {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) rgba: Vec<u8>,
}

/// The format of a picture, by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PixelFormat {
    Png,
    Jpeg,
}

impl PixelFormat {
    pub(crate) fn of(bytes: &[u8]) -> Result<Self, PictureFault> {
        let other = match bytes {
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => "WebP",
            [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', ..] => "AVIF",
            [b'G', b'I', b'F', ..] => "GIF",
            [0x1a, ..] => "a vector tile",
            [0x1f, 0x8b, ..] => "compressed by gzip",
            _ if bytes.starts_with(PNG) => return Ok(Self::Png),
            _ if bytes.starts_with(JPEG) => return Ok(Self::Jpeg),
            _ => "of an unknown format",
        };
        Err(PictureFault::UnknownFormat(other))
    }
}

/// Decodes the picture in `bytes`, of at most `most_pixels`.
pub(crate) fn decode_bytes(bytes: &[u8], most_pixels: usize) -> Result<Pixels, PictureFault> {
    match PixelFormat::of(bytes)? {
        PixelFormat::Png => decode_png(std::io::Cursor::new(bytes), most_pixels),
        PixelFormat::Jpeg => decode_jpeg(bytes, most_pixels),
    }
}

/// Refuses a picture without pixels, and one with too many.
pub(crate) fn check_size(width: u32, height: u32, most_pixels: usize) -> Result<(), PictureFault> {
    if width == 0 || height == 0 {
        return Err(PictureFault::Empty);
    }
    let count = u64::from(width) * u64::from(height);
    if width > MAX_SIDE || height > MAX_SIDE || count > most_pixels as u64 {
        return Err(PictureFault::TooManyPixels { width, height });
    }
    Ok(())
}

fn png_fault(error: png::DecodingError) -> PictureFault {
    PictureFault::Png(error.to_string())
}

/// The width and height of a PNG.
pub(crate) fn read_png_size<R: BufRead + Seek>(reader: R) -> Result<(u32, u32), PictureFault> {
    let limits = Limits { bytes: PNG_OVERHEAD };
    let mut decoder = png::Decoder::new_with_limits(reader, limits);
    let header = decoder.read_header_info().map_err(png_fault)?;
    Ok((header.width, header.height))
}

/// Decodes a PNG of any kind.
pub(crate) fn decode_png<R: BufRead + Seek>(
    reader: R,
    most_pixels: usize,
) -> Result<Pixels, PictureFault> {
    let limits = Limits { bytes: PNG_OVERHEAD };
    let mut decoder = png::Decoder::new_with_limits(reader, limits);
    decoder.set_transformations(Transformations::normalize_to_color8() | Transformations::ALPHA);
    let header = decoder.read_header_info().map_err(png_fault)?;
    let (width, height) = (header.width, header.height);
    check_size(width, height, most_pixels)?;
    let mut reader = decoder.read_info().map_err(png_fault)?;
    let len = reader.output_buffer_size().filter(|&len| len <= 4 * most_pixels);
    let mut bytes = vec![0; len.ok_or(PictureFault::TooManyPixels { width, height })?];
    let frame = reader.next_frame(&mut bytes).map_err(png_fault)?;
    if (frame.width, frame.height) != (width, height) {
        return Err(PictureFault::Png("its first frame is smaller than the picture".to_owned()));
    }
    bytes.truncate(frame.buffer_size());
    let rgba = match frame.color_type {
        ColorType::Rgba => bytes,
        ColorType::GrayscaleAlpha => widen(&bytes, |&[grey, alpha]| [grey, grey, grey, alpha]),
        ColorType::Rgb => widen(&bytes, |&[red, green, blue]| [red, green, blue, 255]),
        ColorType::Grayscale => widen(&bytes, |&[grey]| [grey, grey, grey, 255]),
        ColorType::Indexed => return Err(PictureFault::Png("it has no palette".to_owned())),
    };
    check_length(width, height, rgba)
}

fn widen<const N: usize>(bytes: &[u8], rgba: impl Fn(&[u8; N]) -> [u8; 4]) -> Vec<u8> {
    bytes.as_chunks::<N>().0.iter().flat_map(rgba).collect()
}

fn check_length(width: u32, height: u32, rgba: Vec<u8>) -> Result<Pixels, PictureFault> {
    if rgba.len() as u64 == u64::from(width) * u64::from(height) * 4 {
        Ok(Pixels { width, height, rgba })
    } else {
        Err(PictureFault::Damaged("it has not as many pixels as it states".to_owned()))
    }
}

/// The frame of a JPEG: its size, and whether it is progressive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct JpegFrame {
    pub(crate) width: u32,
    pub(crate) height: u32,
    is_progressive: bool,
}

/// Reads the frame's header, by the lengths of the segments before it.
pub(crate) fn read_jpeg_frame(bytes: &[u8]) -> Result<JpegFrame, PictureFault> {
    let fault = || PictureFault::Jpeg("it has no frame header".to_owned());
    let mut at = 2;
    loop {
        let segment = bytes.get(at..).ok_or_else(fault)?;
        match segment {
            // Bytes that fill up.
            [0xff, 0xff, ..] => at += 1,
            // C4, C8 and CC are no frames.
            [0xff, 0xc4 | 0xc8 | 0xcc, high, low, ..] => at += 2 + length_of(*high, *low),
            [0xff, kind @ 0xc0..=0xcf, _, _, _, h1, h0, w1, w0, ..] => {
                return Ok(JpegFrame {
                    width: u32::from(u16::from_be_bytes([*w1, *w0])),
                    height: u32::from(u16::from_be_bytes([*h1, *h0])),
                    is_progressive: *kind != 0xc0 && *kind != 0xc1,
                });
            }
            [0xff, 0xda | 0xd9, ..] => return Err(fault()),
            [0xff, _, high, low, ..] => at += 2 + length_of(*high, *low),
            _ => return Err(fault()),
        }
    }
}

fn length_of(high: u8, low: u8) -> usize {
    usize::from(u16::from_be_bytes([high, low]))
}

/// Refuses a JPEG that would need too much memory.
pub(crate) fn check_jpeg(frame: JpegFrame, most_pixels: usize) -> Result<(), PictureFault> {
    check_size(frame.width, frame.height, most_pixels)?;
    let count = u64::from(frame.width) * u64::from(frame.height);
    if frame.is_progressive && count > MAX_PROGRESSIVE_PIXELS as u64 {
        return Err(PictureFault::Progressive);
    }
    Ok(())
}

fn decode_jpeg(bytes: &[u8], most_pixels: usize) -> Result<Pixels, PictureFault> {
    let frame = read_jpeg_frame(bytes)?;
    check_jpeg(frame, most_pixels)?;
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGBA)
        .set_max_width(MAX_SIDE as usize)
        .set_max_height(MAX_SIDE as usize);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let fault = |error: zune_jpeg::errors::DecodeErrors| PictureFault::Jpeg(error.to_string());
    decoder.decode_headers().map_err(fault)?;
    let is_same = decoder.info().is_some_and(|info| {
        (u32::from(info.width), u32::from(info.height)) == (frame.width, frame.height)
    });
    if !is_same {
        return Err(PictureFault::Jpeg("it has two frames".to_owned()));
    }
    let rgba = decoder.decode().map_err(fault)?;
    check_length(frame.width, frame.height, rgba)
}
