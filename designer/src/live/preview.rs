//! Data that are looked at rather than read: maps, images, scans and paths, as a small picture.

use armor_sdk::messages::{Image, LaserScan, OccupancyGrid, Path};
use armor_wire::WireType;
use armor_wire::codec;
use armor_wire::schema::Schema;
use eframe::egui::{
    self, Color32, ColorImage, Pos2, Rect, Role, Sense, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Vec2, WidgetInfo, pos2, vec2,
};

use armor_picture::theme::{ThemeColours, mix};

/// Most pixels of a side; larger pictures are sampled.
const MAX_SIDE: usize = 256;
/// Height of a picture, in points.
const HEIGHT: f32 = 160.0;
/// Most points of a scan or a path that are drawn.
const MAX_POINTS: usize = 2000;

/// What is shown of one message.
#[derive(Clone, Debug, PartialEq)]
pub struct Preview {
    /// What it is, with its size.
    pub words: String,
    /// What is drawn.
    pub drawn: Drawn,
}

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Drawn {
    /// The top row first.
    Pixels {
        /// Columns and rows.
        size: [usize; 2],
        /// Their colours.
        pixels: Vec<Color32>,
    },
    /// In metres, x to the right and y up.
    Points {
        /// The points.
        points: Vec<Pos2>,
        /// Whether a line leads through them.
        is_line: bool,
    },
}

/// The preview of a message; none if its type has none, or its contents do not fit each other.
pub fn preview(schema: &Schema, payload: &[u8], colours: &ThemeColours) -> Option<Preview> {
    let hash = schema.hash();
    if hash == OccupancyGrid::schema().hash() {
        map(&codec::decode(payload).ok()?, colours)
    } else if hash == Image::schema().hash() {
        image(&codec::decode(payload).ok()?)
    } else if hash == LaserScan::schema().hash() {
        Some(scan(&codec::decode(payload).ok()?))
    } else if hash == Path::schema().hash() {
        Some(path(&codec::decode(payload).ok()?))
    } else {
        None
    }
}

/// Samples a picture of this size so that no side has more than [`MAX_SIDE`] pixels.
fn sample(
    width: usize,
    height: usize,
    pixel: impl Fn(usize, usize) -> Option<Color32>,
) -> Option<Drawn> {
    if width == 0 || height == 0 {
        return None;
    }
    let step = width.max(height).div_ceil(MAX_SIDE);
    let size = [width.div_ceil(step), height.div_ceil(step)];
    let at = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x * step, y * step)));
    let pixels = at.map(|(x, y)| pixel(x, y)).collect::<Option<Vec<_>>>()?;
    Some(Drawn::Pixels { size, pixels })
}

fn map(map: &OccupancyGrid, colours: &ThemeColours) -> Option<Preview> {
    let (width, height) = (map.info.width as usize, map.info.height as usize);
    let cell = |x: usize, y: usize| {
        // The first row of a map is its lowest.
        let row = (height - 1 - y).checked_mul(width)?;
        Some(match *map.data.get(row.checked_add(x)?)? {
            unknown if unknown < 0 => mix(colours.background, colours.weak, 0.35),
            occupied => mix(Color32::WHITE, Color32::BLACK, f32::from(occupied.min(100)) / 100.0),
        })
    };
    let drawn = sample(width, height, cell)?;
    let words = format!("map of {width} x {height} cells of {:.3} m", map.info.resolution);
    Some(Preview { words, drawn })
}

fn image(image: &Image) -> Option<Preview> {
    let (width, height) = (image.width as usize, image.height as usize);
    let (bytes, red, blue) = match image.encoding.as_str() {
        "rgb8" => (3, 0, 2),
        "bgr8" => (3, 2, 0),
        "rgba8" => (4, 0, 2),
        "bgra8" => (4, 2, 0),
        "mono8" => (1, 0, 0),
        _ => return None,
    };
    let pixel = |x: usize, y: usize| {
        let at = y.checked_mul(image.step as usize)?.checked_add(x * bytes)?;
        let own = image.data.get(at..at.checked_add(bytes)?)?;
        let green = own[usize::from(bytes > 1)];
        Some(Color32::from_rgb(own[red], green, own[blue]))
    };
    let drawn = sample(width, height, pixel)?;
    let words = format!("image of {width} x {height} pixels, {}", image.encoding);
    Some(Preview { words, drawn })
}

fn scan(scan: &LaserScan) -> Preview {
    let count = scan.ranges.len();
    let step = count.div_ceil(MAX_POINTS).max(1);
    let rays = scan.ranges.iter().enumerate().step_by(step);
    let seen = rays.filter(|(_, range)| (scan.range_min..=scan.range_max).contains(*range));
    let points = seen.map(|(number, range)| {
        let angle = scan.angle_min + scan.angle_increment * number as f32;
        pos2(range * angle.cos(), range * angle.sin())
    });
    let words = format!("scan of {count} rays up to {} m", scan.range_max);
    Preview { words, drawn: Drawn::Points { points: finite(points), is_line: false } }
}

fn path(path: &Path) -> Preview {
    let count = path.poses.len();
    let step = count.div_ceil(MAX_POINTS).max(1);
    let poses = path.poses.iter().step_by(step);
    let points = poses.map(|stamped| {
        let at = stamped.pose.position;
        pos2(at.x as f32, at.y as f32)
    });
    let words = format!("path of {count} poses");
    Preview { words, drawn: Drawn::Points { points: finite(points), is_line: true } }
}

fn finite(points: impl Iterator<Item = Pos2>) -> Vec<Pos2> {
    points.filter(|point| point.x.is_finite() && point.y.is_finite()).collect()
}

/// A picture that was made, and of which message.
#[derive(Clone)]
struct KeptTexture {
    sequence: u64,
    is_dark: bool,
    preview: Preview,
    texture: Option<TextureHandle>,
}

/// Shows the preview of the newest message of `data`, made once for each message. Returns whether
/// there is one.
pub fn show(
    ui: &mut egui::Ui,
    data: &str,
    sequence: u64,
    make: impl FnOnce(&ThemeColours) -> Option<Preview>,
) -> bool {
    let colours = ThemeColours::of(ui.visuals());
    let id = egui::Id::unique(("preview", data));
    let kept = ui.data(|kept| kept.get_temp::<KeptTexture>(id));
    let is_it = |kept: &KeptTexture| kept.sequence == sequence && kept.is_dark == colours.is_dark;
    let kept = kept.filter(is_it).or_else(|| {
        let preview = make(colours)?;
        let texture = match &preview.drawn {
            Drawn::Pixels { size, pixels } => {
                let image = ColorImage::new(*size, pixels.clone());
                Some(ui.ctx().load_texture(data, image, TextureOptions::NEAREST))
            }
            Drawn::Points { .. } => None,
        };
        let is_dark = colours.is_dark;
        let kept = KeptTexture { sequence, is_dark, preview, texture };
        ui.data_mut(|all| all.insert_temp(id, kept.clone()));
        Some(kept)
    });
    let Some(kept) = kept else { return false };
    let (rect, response) = ui
        .allocate_exact_size(vec2(ui.available_width().min(HEIGHT * 2.0), HEIGHT), Sense::hover());
    // Screen readers leave out what has a name, but no role.
    let name = format!("preview of {data}: {}", kept.preview.words);
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 0.0, colours.background);
    match (&kept.preview.drawn, &kept.texture) {
        (Drawn::Pixels { size, .. }, Some(texture)) => {
            let size = vec2(size[0] as f32, size[1] as f32);
            let scale = (rect.width() / size.x).min(rect.height() / size.y);
            let area = Rect::from_center_size(rect.center(), size * scale);
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            painter.image(texture.id(), area, whole, Color32::WHITE);
        }
        (Drawn::Points { points, is_line }, _) => {
            paint_points(&painter, rect, points, *is_line, colours);
        }
        (Drawn::Pixels { .. }, None) => {}
    }
    painter.rect_stroke(rect, 0.0, Stroke::new(1.0, colours.outline), StrokeKind::Inside);
    ui.weak(&kept.preview.words);
    true
}

fn paint_points(
    painter: &egui::Painter,
    rect: Rect,
    points: &[Pos2],
    is_line: bool,
    colours: &ThemeColours,
) {
    // The place of the sensor, or the origin, is always seen.
    let mut extent = Rect::from_min_max(Pos2::ZERO, Pos2::ZERO);
    points.iter().for_each(|point| extent.extend_with(*point));
    let inner = rect.shrink(8.0);
    let size = extent.size().max(Vec2::splat(0.1));
    let scale = (inner.width() / size.x).min(inner.height() / size.y);
    let to_window = |point: Pos2| {
        let apart = point - extent.center();
        inner.center() + vec2(apart.x, -apart.y) * scale
    };
    let origin = to_window(Pos2::ZERO);
    let cross = Stroke::new(1.5, colours.error);
    painter.line_segment([origin - vec2(5.0, 0.0), origin + vec2(5.0, 0.0)], cross);
    painter.line_segment([origin - vec2(0.0, 5.0), origin + vec2(0.0, 5.0)], cross);
    let points: Vec<_> = points.iter().map(|point| to_window(*point)).collect();
    if is_line {
        painter.line(points, Stroke::new(2.0, colours.accent));
    } else {
        for point in points {
            painter.circle_filled(point, 1.5, colours.accent);
        }
    }
}

#[cfg(test)]
mod tests {
    use armor_sdk::messages::{MapMetaData, PoseStamped};
    use egui_kittest::Harness;
    use egui_kittest::kittest::{NodeT, Queryable};

    use super::*;

    fn of<T: WireType>(message: &T) -> Option<Preview> {
        preview(
            &T::schema(),
            &codec::encode(message).expect("it can be encoded"),
            ThemeColours::of_theme(true),
        )
    }

    fn grid(width: u32, height: u32, data: &[i8]) -> OccupancyGrid {
        let info = MapMetaData { width, height, resolution: 0.05, ..MapMetaData::default() };
        OccupancyGrid { info, data: data.to_vec().into(), ..OccupancyGrid::default() }
    }

    #[test]
    fn a_map_is_drawn_with_its_first_row_at_the_bottom() {
        let shown = of(&grid(2, 2, &[100, 0, 0, 0])).expect("a map");
        assert_eq!(shown.words, "map of 2 x 2 cells of 0.050 m");
        let white = Color32::WHITE;
        let pixels = vec![white, white, Color32::BLACK, white];
        assert_eq!(shown.drawn, Drawn::Pixels { size: [2, 2], pixels });
    }

    #[test]
    fn sizes_that_do_not_fit_the_data_have_no_preview() {
        assert_eq!(of(&grid(2, 2, &[0, 0, 0])), None);
        assert_eq!(of(&grid(0, 2, &[])), None);
        assert_eq!(of(&grid(u32::MAX, u32::MAX, &[0])), None);
        let image = Image {
            width: 4,
            height: 4,
            step: u32::MAX,
            encoding: "rgb8".into(),
            ..Image::default()
        };
        assert_eq!(of(&image), None);
    }

    #[test]
    fn a_large_map_is_sampled() {
        let shown = of(&grid(1000, 10, &[0; 10_000])).expect("a map");
        let Drawn::Pixels { size, pixels } = shown.drawn else { panic!("pixels") };
        assert_eq!((size, pixels.len()), ([250, 3], 750));
    }

    #[test]
    fn an_image_is_drawn_in_its_encoding() {
        let image = |encoding: &str, data: &[u8]| {
            let step = data.len() as u32;
            let data = data.to_vec().into();
            let shown = Image {
                width: 1,
                height: 1,
                step,
                encoding: encoding.into(),
                data,
                ..Image::default()
            };
            let Some(Drawn::Pixels { pixels, .. }) = of(&shown).map(|shown| shown.drawn) else {
                return None;
            };
            Some(pixels[0])
        };
        assert_eq!(image("rgb8", &[1, 2, 3]), Some(Color32::from_rgb(1, 2, 3)));
        assert_eq!(image("bgr8", &[1, 2, 3]), Some(Color32::from_rgb(3, 2, 1)));
        assert_eq!(image("mono8", &[7]), Some(Color32::from_gray(7)));
        assert_eq!(image("16UC1", &[7, 7]), None, "an unknown encoding is shown as values");
    }

    #[test]
    fn rays_that_saw_nothing_are_no_points() {
        let scan = LaserScan {
            range_min: 0.1,
            range_max: 10.0,
            angle_increment: std::f32::consts::FRAC_PI_2,
            ranges: vec![1.0, 2.0, 20.0, f32::NAN].into(),
            ..LaserScan::default()
        };
        let shown = of(&scan).expect("a scan");
        let Drawn::Points { points, is_line: false } = shown.drawn else { panic!("points") };
        assert_eq!(points.len(), 2);
        assert!((points[1] - pos2(0.0, 2.0)).length() < 1e-5);
    }

    #[test]
    fn a_preview_has_a_name_and_values_of_other_types_have_none() {
        let poses = vec![PoseStamped::default(), PoseStamped::default()];
        let path = Path { poses, ..Path::default() };
        let shown = of(&path).expect("a path");
        assert_eq!(of(&PoseStamped::default()), None);
        let harness = Harness::new_ui(move |ui| {
            let made = shown.clone();
            assert!(show(ui, "planner.path", 1, |_| Some(made)));
        });
        let preview = harness.get_by_label("preview of planner.path: path of 2 poses");
        assert_eq!(preview.accesskit_node().role(), Role::Image);
    }
}
