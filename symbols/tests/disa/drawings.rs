//! DISA's drawings (the folder `symbols` of `ARMOR_DATA`), and how they are turned into pixels.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::PathBuf;

use armor_symbols::{PaintRole, SymbolShape, svg_of};
use resvg::{tiny_skia, usvg};

/// The size of DISA's drawings.
pub const SIZE: [usize; 2] = [612, 792];

/// All drawings by their path below `svg/`, or nothing if there is no data here.
pub fn drawings() -> Option<BTreeMap<String, String>> {
    let Some(folder) = std::env::var_os("ARMOR_DATA").map(PathBuf::from) else {
        assert!(
            std::env::var_os("CI").is_none(),
            "ARMOR_DATA is not set: it names the data folder"
        );
        eprintln!("skipped: ARMOR_DATA names no folder with symbols/jmsml.tar.gz");
        return None;
    };
    let path = folder.join("symbols/jmsml.tar.gz");
    let packed = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut archive = Vec::new();
    flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut archive).expect("it is gzip");
    let files = files_of(&archive);
    assert!(files.len() > 2000, "only {} drawings in {}", files.len(), path.display());
    Some(files)
}

/// The SVG files of a tar archive: blocks of 512 bytes, a header before each file.
fn files_of(archive: &[u8]) -> BTreeMap<String, String> {
    let mut files = BTreeMap::new();
    let mut at = 0;
    while let Some(header) = archive.get(at..at + 512) {
        let text = |from: usize, to: usize| {
            let field = &header[from..to];
            let end = field.iter().position(|byte| *byte == 0).unwrap_or(field.len());
            String::from_utf8_lossy(&field[..end]).trim().to_owned()
        };
        let size = usize::from_str_radix(&text(124, 136), 8).unwrap_or(0);
        let name = text(0, 100);
        if let Some((_, name)) = name.split_once("/svg/").filter(|_| name.ends_with(".svg")) {
            let body = &archive[at + 512..at + 512 + size];
            files.insert(name.to_owned(), String::from_utf8_lossy(body).into_owned());
        }
        at += 512 + size.div_ceil(512) * 512;
    }
    files
}

/// The texts of a drawing.
pub fn texts(svg: &str) -> Vec<String> {
    let mut texts = Vec::new();
    for part in svg.split("<text").skip(1) {
        let inner = part.split_once('>').map_or("", |(_, inner)| inner);
        let inner = inner.split("</text>").next().unwrap_or_default();
        // Text may stand in spans.
        let plain: String =
            inner.split('<').map(|piece| piece.rsplit('>').next().unwrap_or_default()).collect();
        texts.push(plain.trim().to_owned());
    }
    texts.sort();
    texts
}

/// A picture: for each pixel its opacity, and how dark it is, from 0 to 1.
pub struct Picture {
    pub opaque: Vec<f32>,
    pub dark: Vec<f32>,
    pixels: Vec<[u8; 4]>,
}

impl Picture {
    pub fn of_svg(svg: &str) -> Self {
        let svg = without_entities(svg);
        let tree = usvg::Tree::from_str(&svg, &usvg::Options::default())
            .unwrap_or_else(|error| panic!("{error}: {svg}"));
        let [width, height] = SIZE.map(|side| side as u32);
        let mut pixmap = tiny_skia::Pixmap::new(width, height).expect("the size is positive");
        let size = tree.size();
        let scale = tiny_skia::Transform::from_scale(
            width as f32 / size.width(),
            height as f32 / size.height(),
        );
        resvg::render(&tree, scale, &mut pixmap.as_mut());
        let pixels: Vec<[u8; 4]> = pixmap
            .pixels()
            .iter()
            .map(|pixel| [pixel.red(), pixel.green(), pixel.blue(), pixel.alpha()])
            .collect();
        let share = |value: u8| f32::from(value) / 255.0;
        let opaque = pixels.iter().map(|[.., alpha]| share(*alpha)).collect();
        // Colours are multiplied by alpha, so what is missing from alpha is dark.
        let dark =
            pixels.iter().map(|[_, green, _, alpha]| share(alpha.saturating_sub(*green))).collect();
        Self { opaque, dark, pixels }
    }

    pub fn of_shapes(shapes: &[SymbolShape], color: impl Fn(PaintRole) -> [u8; 3]) -> Self {
        // With the margin of a twentieth of the height, this is the size of DISA's drawings.
        Self::of_svg(&svg_of(shapes, [[-270.0, -360.0], [270.0, 360.0]], color))
    }

    pub fn color_at(&self, [x, y]: [usize; 2]) -> [u8; 3] {
        let [red, green, blue, _] = self.pixels[y * SIZE[0] + x];
        [red, green, blue]
    }
}

/// Some drawings begin with declarations of entities, which are not needed to draw them.
fn without_entities(svg: &str) -> String {
    match (svg.find("<!DOCTYPE"), svg.find("<svg")) {
        (Some(from), Some(to)) if from < to => {
            let text = format!("{}{}", &svg[..from], &svg[to..]);
            text.replace('\u{feff}', "").split("&ns_").enumerate().fold(
                String::new(),
                |mut all, (index, part)| {
                    all.push_str(if index == 0 {
                        part
                    } else {
                        part.split_once(';').map_or(part, |(_, rest)| rest)
                    });
                    all
                },
            )
        }
        _ => svg.replace('\u{feff}', ""),
    }
}

/// How much two pictures overlap: what both cover, divided by what either covers.
pub fn overlap(ours: &[f32], theirs: &[f32]) -> f32 {
    let both: f32 = ours.iter().zip(theirs).map(|(ours, theirs)| ours.min(*theirs)).sum();
    let either: f32 = ours.iter().zip(theirs).map(|(ours, theirs)| ours.max(*theirs)).sum();
    if either > 0.0 { both / either } else { 0.0 }
}

/// The largest distance from a covered pixel of one picture to the nearest one of the other.
pub fn deviation(ours: &[f32], theirs: &[f32]) -> f32 {
    farthest(ours, theirs).max(farthest(theirs, ours))
}

fn farthest(from: &[f32], to: &[f32]) -> f32 {
    const REACH: isize = 40;
    let covered = |of: &[f32], [x, y]: [isize; 2]| {
        let inside = x >= 0 && y >= 0 && x < SIZE[0] as isize && y < SIZE[1] as isize;
        inside && of[y as usize * SIZE[0] + x as usize] > 0.5
    };
    let mut farthest = 0.0_f32;
    for y in 0..SIZE[1] as isize {
        for x in 0..SIZE[0] as isize {
            if !covered(from, [x, y]) || covered(to, [x, y]) {
                continue;
            }
            let mut nearest = f32::MAX;
            for down in -REACH..=REACH {
                for right in -REACH..=REACH {
                    let distance = (down as f32).hypot(right as f32);
                    if distance < nearest && covered(to, [x + right, y + down]) {
                        nearest = distance;
                    }
                }
            }
            farthest = farthest.max(nearest);
        }
    }
    farthest
}
