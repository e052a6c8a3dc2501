//! The map as textures: only the visible part, at the resolution of the screen, and repainted only
//! where it has changed. The cost depends on the pixels of the screen, not on the size of the map.

use std::collections::HashMap;

use armor_grid::Point2;
use eframe::egui::epaint::Vertex;
use eframe::egui::{
    Color32, ColorImage, Context, Mesh, Painter, Pos2, TextureFilter, TextureHandle,
    TextureOptions, TextureWrapMode, pos2,
};

use super::map_viewport::MapViewport;
use crate::map::{BLOCK, OccupancyMap};

/// Side of a texture in texels; a whole number of blocks.
const SIDE: usize = 2 * BLOCK;
/// Close up, cells are squares; zoomed out, texels are about as large as pixels.
const FILTER: TextureOptions = TextureOptions {
    magnification: TextureFilter::Nearest,
    minification: TextureFilter::Linear,
    wrap_mode: TextureWrapMode::ClampToEdge,
    mipmap_mode: None,
};
/// Coarsest level: 4096 cells in a texel.
const MAX_LEVEL: u32 = 12;

struct TextureTile {
    revision: u64,
    texture: TextureHandle,
}

/// The textures in use, by level and place.
#[derive(Default)]
pub(super) struct Tiles {
    tiles: HashMap<(u32, usize, usize), TextureTile>,
}

impl Tiles {
    /// Paints the visible part of the map.
    pub(super) fn paint(&mut self, painter: &Painter, look: &MapViewport, map: &OccupancyMap) {
        let layout = *map.layout();
        let pixels = look.scale * painter.ctx().pixels_per_point() * layout.resolution_m as f32;
        let level = level_of(pixels);
        let side = SIDE << level;
        let [columns, rows] = seen(look, map);
        let mut used = HashMap::new();
        for row in rows.0 / side..rows.1.div_ceil(side) {
            for column in columns.0 / side..columns.1.div_ceil(side) {
                let key = (level, column, row);
                let tile = self.tiles.remove(&key);
                let tile = made(painter.ctx(), map, key, tile);
                let corner = |x: usize, y: usize| {
                    let (x, y) = ((column + x) * side, (row + y) * side);
                    look.on_screen(layout.place(x as f64, y as f64))
                };
                let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                painter.add(quad(&tile.texture, corners));
                used.insert(key, tile);
            }
        }
        self.tiles = used;
    }
}

/// Returns the number of halvings after which a texel is at most a pixel, but more than half of
/// one.
fn level_of(pixels_per_cell: f32) -> u32 {
    let level = (1.0 / pixels_per_cell).log2().floor();
    if level > 0.0 { (level as u32).min(MAX_LEVEL) } else { 0 }
}

/// Returns the columns and rows of cells that may be visible, the last excluded; the map may be
/// rotated.
fn seen(look: &MapViewport, map: &OccupancyMap) -> [(usize, usize); 2] {
    let layout = map.layout();
    let rect = look.rect;
    let corners = [rect.left_top(), rect.right_top(), rect.left_bottom(), rect.right_bottom()];
    let inside = layout.corner.inverse();
    let cells = corners.map(|at| inside.apply(look.on_map(at)));
    let span = |of: fn(&Point2) -> f64, most: usize| {
        let places = cells.iter().map(|cell| of(cell) / layout.resolution_m);
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        // Casts end at 0 and at the map's edge, whatever the numbers are.
        ((low.floor() as usize).min(most), (high.ceil() as usize).min(most))
    };
    [span(|cell| cell.x_m, layout.width), span(|cell| cell.y_m, layout.height)]
}

fn made(
    context: &Context,
    map: &OccupancyMap,
    (level, column, row): (u32, usize, usize),
    tile: Option<TextureTile>,
) -> TextureTile {
    let blocks = (SIDE << level) / BLOCK;
    let revision = map.revision([column * blocks, row * blocks], blocks);
    match tile {
        Some(tile) if tile.revision == revision => tile,
        Some(mut tile) => {
            tile.texture.set(image(map, level, column, row), FILTER);
            TextureTile { revision, ..tile }
        }
        None => {
            let name = format!("map {level} {column} {row}");
            let texture = context.load_texture(name, image(map, level, column, row), FILTER);
            TextureTile { revision, texture }
        }
    }
}

fn image(map: &OccupancyMap, level: u32, column: usize, row: usize) -> ColorImage {
    let side = SIDE << level;
    let cells = map.shrunk([column * side, row * side], [SIDE, SIDE], 1 << level);
    ColorImage::new([SIDE, SIDE], cells.into_iter().map(colour).collect())
}

/// Returns the colour of a cell: free is bright, occupied is dark, unknown is transparent.
fn colour(cell: i8) -> Color32 {
    match u8::try_from(cell) {
        Ok(percent) => {
            let share = u32::from(percent.min(100));
            Color32::from_gray((236 - share * 220 / 100) as u8)
        }
        Err(_) => Color32::TRANSPARENT,
    }
}

fn quad(texture: &TextureHandle, corners: [Pos2; 4]) -> Mesh {
    let mut mesh = Mesh::with_texture(texture.id());
    let uvs = [pos2(0.0, 0.0), pos2(1.0, 0.0), pos2(1.0, 1.0), pos2(0.0, 1.0)];
    for (pos, uv) in corners.into_iter().zip(uvs) {
        mesh.vertices.push(Vertex { pos, uv, color: Color32::WHITE });
    }
    mesh.add_triangle(0, 1, 2);
    mesh.add_triangle(0, 2, 3);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::MapLayout;
    use armor_picture::{Pixels, Stage};
    use eframe::egui::{CentralPanel, Frame};

    /// A map of walls every 50 cells, shown whole on a small screen, turned by `yaw_rad`.
    fn shown(side: usize, yaw_rad: f64, tiles: &mut Tiles) -> Pixels {
        let mut map = OccupancyMap::default();
        let corner = armor_grid::Pose2::new(0.0, 0.0, yaw_rad);
        let layout = MapLayout { corner, resolution_m: 0.05, width: side, height: side };
        let cells = (0..side * side).map(|n| if n % side % 50 == 7 { 100 } else { 0 }).collect();
        map.replace(1.0, layout, cells).unwrap();
        let mut stage = Stage::new(Context::default(), 320, 320, 1.0);
        stage.settle(2, |ui| {
            CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
                let mut look = MapViewport { rect: ui.max_rect(), ..MapViewport::default() };
                let middle = layout.place(side as f64 / 2.0, side as f64 / 2.0);
                look.scale = 320.0 / (side as f32 * 0.05);
                look.centre = middle;
                tiles.paint(ui.painter(), &look, &map);
            });
        });
        stage.pixels(Color32::RED)
    }

    #[test]
    fn a_large_map_is_painted_with_few_textures_and_its_thin_walls_are_seen() {
        let mut tiles = Tiles::default();
        let pixels = shown(4000, 0.0, &mut tiles);
        assert!(tiles.tiles.len() <= 9, "{} textures", tiles.tiles.len());
        let row = &pixels.colours[160 * 320..161 * 320];
        let dark = row.iter().filter(|colour| colour.r() < 150).count();
        assert!((60..200).contains(&dark), "{dark} of 320 pixels are wall, there are 80 walls");
        assert!(!pixels.colours[10_000..90_000].contains(&Color32::RED), "no gaps");
    }

    #[test]
    fn a_map_may_lie_askew() {
        let pixels = shown(256, 0.4, &mut Tiles::default());
        let middle = pixels.colours[160 * 320 + 160];
        assert_ne!(middle, Color32::RED);
        assert_eq!(pixels.colours[0], Color32::RED, "its corners are turned away");
    }

    #[test]
    fn levels_keep_texels_about_as_large_as_pixels() {
        let levels = [(5.0, 0), (1.0, 0), (0.6, 0), (0.5, 1), (0.2, 2), (1e-9, MAX_LEVEL)];
        for (pixels, expected) in levels {
            assert_eq!(level_of(pixels), expected, "{pixels} pixels for each cell");
        }
        assert_eq!(level_of(f32::NAN), 0);
    }
}
