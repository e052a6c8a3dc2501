//! The picture and the grid under the drawing: opened when the file names them, decoded on threads,
//! painted as textures where the map has them.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use armor_geo::{MapPlacement, MapPoint};
use armor_picture::theme::ThemeColours;
use armor_robotfile::site_map::SiteMap;
use armor_tiles::{
    LayerKey, MapReference, PlanePoint, Source, TileId, TileImage, TileState, Tiles,
};
use eframe::egui::epaint::{Mesh, Vertex};
use eframe::egui::{
    self, Color32, ColorImage, Painter, Rect, RichText, Shape, TextureHandle, TextureOptions, pos2,
};

use crate::map_view::camera::{Camera, MapBounds};
use crate::map_view::layers::{Layer, Layers};
use crate::map_view::model::site_map_of;
use crate::workspace::Workspace;

/// The layers with pictures, from back to front.
const LAYERS: [Layer; 2] = [Layer::Picture, Layer::Grid];
/// Coarser tiles that are looked for while a tile is being decoded.
const MAX_COARSER: usize = 8;
/// How long an export waits for its tiles; then it is made without those that are missing.
const EXPORT_PATIENCE: Duration = Duration::from_secs(20);

/// The pictures of a map.
#[derive(Default)]
pub struct Pictures {
    /// None until the file names one: threads decode them.
    tiles: Option<Tiles<TextureHandle>>,
    pictures: [Option<MapPicture>; LAYERS.len()],
    placement: Option<MapPlacement>,
    /// Whether the file may name others since they were opened.
    is_stale: bool,
    /// Whether one was opened since this was last asked.
    is_opened: bool,
}

/// A picture that the file names.
struct MapPicture {
    path: PathBuf,
    /// Its key, or why it cannot be opened.
    opened: Result<LayerKey, String>,
    /// The first tile that could not be decoded, or why the picture has no place on the map.
    fault: Option<String>,
}

impl Pictures {
    /// The file has changed.
    pub fn follow(&mut self) {
        self.is_stale = true;
    }

    /// Opens what the file names, and takes the tiles that have been decoded.
    pub fn receive(&mut self, ctx: &egui::Context, workspace: &Workspace) {
        if std::mem::take(&mut self.is_stale) {
            self.open_named(ctx, workspace);
        }
        let Some(tiles) = &mut self.tiles else { return };
        let grid = self.pictures[1].as_ref().and_then(|it| it.opened.as_ref().ok().copied());
        let failures = tiles.receive(|layer, id, tile| {
            let options = match Some(layer) == grid {
                // A cell is a square, however large it is shown.
                true => TextureOptions::NEAREST,
                false => TextureOptions::LINEAR,
            };
            ctx.load_texture(format!("map tile {id}"), colour_image(&tile), options)
        });
        for failure in failures {
            let text = failure.to_string();
            let of_file = self.pictures.iter_mut().flatten();
            let mut of_file = of_file.filter(|it| text.contains(&it.path.display().to_string()));
            if let Some(picture) = of_file.next() {
                picture.fault.get_or_insert(text);
            }
        }
    }

    fn open_named(&mut self, ctx: &egui::Context, workspace: &Workspace) {
        let map = site_map_of(workspace);
        self.placement = map.and_then(|map| map.placement);
        for (number, layer) in LAYERS.into_iter().enumerate() {
            let named = map.and_then(|map| named_path(map, layer));
            let path = named.map(|named| workspace.project.folder().join(named));
            let known = self.pictures[number].as_ref().map(|picture| &picture.path);
            if known == path.as_ref() {
                continue;
            }
            if let (Some(MapPicture { opened: Ok(key), .. }), Some(tiles)) =
                (self.pictures[number].take(), &mut self.tiles)
            {
                tiles.remove(key);
            }
            self.pictures[number] = path.map(|path| {
                let opened = self.open(&path, ctx);
                MapPicture { path, opened, fault: None }
            });
        }
    }

    fn open(&mut self, path: &std::path::Path, ctx: &egui::Context) -> Result<LayerKey, String> {
        let source = Source::open(path).map_err(|error| error.to_string())?;
        let tiles = match &mut self.tiles {
            Some(tiles) => tiles,
            none => {
                let ctx = ctx.clone();
                let started = Tiles::new(move || ctx.request_repaint());
                none.insert(started.map_err(|error| format!("no thread decodes it: {error}"))?)
            }
        };
        let key = tiles.add(source);
        self.is_opened = true;
        Ok(key)
    }

    /// Returns whether a picture was opened since the last call.
    pub fn take_opened(&mut self) -> bool {
        std::mem::take(&mut self.is_opened)
    }

    /// The area of the map that the pictures have.
    pub fn bounds(&self) -> Option<MapBounds> {
        let keys = self.pictures.iter().flatten().filter_map(|it| it.opened.as_ref().ok());
        let areas = keys.filter_map(|key| {
            let source = self.tiles.as_ref()?.source(*key)?;
            let corners = source.bounds().corners();
            let placement = self.placement.as_ref();
            let placed = corners.map(|at| place(source.reference(), at, placement));
            MapBounds::of(placed.into_iter().flatten())
        });
        areas.reduce(MapBounds::union)
    }

    /// Paints the tiles that are decoded, and requests those that are missing.
    pub fn paint(&mut self, painter: &Painter, camera: &Camera, window: Rect, layers: &Layers) {
        let corners =
            [window.left_top(), window.right_top(), window.right_bottom(), window.left_bottom()]
                .map(|at| camera.to_map(window, at));
        let pixels_per_m = camera.scale() * f64::from(painter.pixels_per_point());
        let mut wanted: Vec<(LayerKey, TileId)> = Vec::new();
        for (number, layer) in LAYERS.into_iter().enumerate() {
            let opacity = layers.opacity(layer);
            let (Some(tiles), Some(picture)) = (&self.tiles, &mut self.pictures[number]) else {
                continue;
            };
            let (Ok(key), true) = (&picture.opened, opacity > 0.0) else { continue };
            let Some(source) = tiles.source(*key) else { continue };
            let view =
                source.reference().view_from_map(corners, pixels_per_m, self.placement.as_ref());
            let view = match view {
                Ok(view) => view,
                Err(error) => {
                    picture.fault = Some(error.to_string());
                    continue;
                }
            };
            let ids = source.wanted(view.bounds, view.pixels_per_unit);
            let tint = Color32::WHITE.gamma_multiply(opacity);
            for id in shown_tiles(tiles, *key, source, &ids) {
                let TileState::Ready(texture) = tiles.get(*key, id) else { continue };
                let Some(corners) = source.corners(id) else { continue };
                let places =
                    corners.map(|at| place(source.reference(), at, self.placement.as_ref()));
                let [Some(a), Some(b), Some(c), Some(d)] = places else { continue };
                let places = [a, b, c, d].map(|at| camera.to_window(window, at));
                painter.add(textured(texture, places, tint));
            }
            wanted.extend(ids.into_iter().map(|id| (*key, id)));
        }
        if let Some(tiles) = &mut self.tiles {
            tiles.want(wanted);
        }
    }

    /// Waits for the tiles that were requested, with a limit: a picture is made once.
    pub fn wait(&mut self, ctx: &egui::Context, workspace: &Workspace) {
        let start = Instant::now();
        while self.tiles.as_ref().is_some_and(|tiles| tiles.count_pending() > 0)
            && start.elapsed() < EXPORT_PATIENCE
        {
            self.receive(ctx, workspace);
            std::thread::sleep(Duration::from_millis(2));
        }
        self.receive(ctx, workspace);
    }

    /// What cannot be shown, and why; and who made a picture, if its file names them.
    pub fn show_status(&self, ui: &mut egui::Ui) {
        let colours = ThemeColours::of(ui.visuals());
        for picture in self.pictures.iter().flatten() {
            let fault = picture.opened.as_ref().err().or(picture.fault.as_ref());
            if let Some(fault) = fault {
                ui.label(RichText::new(format!("! {fault}")).color(colours.error).small());
            }
            let key = picture.opened.as_ref().ok().copied();
            let source = key.zip(self.tiles.as_ref()).and_then(|(key, tiles)| tiles.source(key));
            if let Some(author) = source.and_then(Source::attribution) {
                ui.label(RichText::new(author).weak().small());
            }
        }
    }
}

/// Where a point of a picture is on the map.
fn place(
    reference: MapReference,
    at: PlanePoint,
    placement: Option<&MapPlacement>,
) -> Option<MapPoint> {
    reference.map_from_plane(at, placement).ok()
}

fn named_path(map: &SiteMap, layer: Layer) -> Option<&str> {
    let named = match layer {
        Layer::Grid => &map.grid,
        _ => &map.picture,
    };
    named.as_ref().map(|named| named.value.as_str())
}

/// The tiles to be painted for those that are wanted: coarser ones, which are larger, first.
fn shown_tiles(
    tiles: &Tiles<TextureHandle>,
    key: LayerKey,
    source: &Source,
    wanted: &[TileId],
) -> Vec<TileId> {
    let is_ready = |id: TileId| matches!(tiles.get(key, id), TileState::Ready(_));
    let mut coarser: BTreeSet<(usize, TileId)> = BTreeSet::new();
    for id in wanted.iter().filter(|id| matches!(tiles.get(key, **id), TileState::Unknown)) {
        let mut next = source.coarser(*id);
        for depth in 0..MAX_COARSER {
            let Some(id) = next else { break };
            if is_ready(id) {
                coarser.insert((MAX_COARSER - depth, id));
                break;
            }
            next = source.coarser(id);
        }
    }
    let coarser = coarser.into_iter().map(|(_, id)| id);
    coarser.chain(wanted.iter().copied().filter(|id| is_ready(*id))).collect()
}

fn colour_image(tile: &TileImage) -> ColorImage {
    let size = [tile.width as usize, tile.height as usize];
    ColorImage::from_rgba_unmultiplied(size, &tile.rgba)
}

/// A texture between four places of the window, from top left clockwise.
fn textured(texture: &TextureHandle, places: [egui::Pos2; 4], tint: Color32) -> Shape {
    let mut mesh = Mesh::with_texture(texture.id());
    let corners = [pos2(0.0, 0.0), pos2(1.0, 0.0), pos2(1.0, 1.0), pos2(0.0, 1.0)];
    mesh.vertices.extend(places.into_iter().zip(corners).map(|(pos, uv)| Vertex {
        pos,
        uv,
        color: tint,
    }));
    mesh.indices.extend([0, 1, 2, 0, 2, 3]);
    Shape::mesh(mesh)
}
