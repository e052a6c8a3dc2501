//! Runs a user interface frame by frame without a window, by a clock of its own.

use std::time::Duration;

use egui::epaint::{ClippedShape, Primitive};
use egui::{Color32, Context, Event, RawInput, Rect, Ui, Vec2, ViewportId};

use super::pixels::{Pixels, Textures};
use super::raster::paint_primitives;

/// Time from one frame to the next.
const FRAME: Duration = Duration::from_millis(16);

/// An egui context with the shapes of its last frame.
pub struct Stage {
    context: Context,
    textures: Textures,
    size_points: Vec2,
    pixels_per_point: f32,
    now: Duration,
    shapes: Vec<ClippedShape>,
    next_frame: Duration,
}

impl Stage {
    /// Makes a stage of `width` × `height` pixels, of which `pixels_per_point` make a point.
    pub fn new(context: Context, width: usize, height: usize, pixels_per_point: f32) -> Self {
        let size_points = Vec2::new(width as f32, height as f32) / pixels_per_point;
        Self {
            context,
            textures: Textures::default(),
            size_points,
            pixels_per_point,
            now: Duration::ZERO,
            shapes: Vec::new(),
            next_frame: Duration::ZERO,
        }
    }

    /// Shows one frame with these events, and keeps what it shows.
    pub fn frame(&mut self, events: Vec<Event>, show: impl FnMut(&mut Ui)) {
        let mut input = RawInput {
            screen_rect: Some(Rect::from_min_size(Default::default(), self.size_points)),
            time: Some(self.now.as_secs_f64()),
            predicted_dt: FRAME.as_secs_f32(),
            focused: true,
            events,
            ..RawInput::default()
        };
        let viewport = input.viewports.entry(ViewportId::ROOT).or_default();
        viewport.native_pixels_per_point = Some(self.pixels_per_point);
        viewport.inner_rect = input.screen_rect;
        let mut output = self.context.run_ui(input, show);
        self.now += FRAME;
        self.textures.set(&output.textures_delta);
        self.textures.free(&output.textures_delta);
        output.textures_delta.clear();
        self.shapes = output.shapes;
        let root = output.viewport_output.get(&ViewportId::ROOT);
        self.next_frame = root.map_or(Duration::MAX, |root| root.repaint_delay);
    }

    /// Returns the time until the next frame is wanted if there is no input; `Duration::MAX` is
    /// never.
    pub fn next_frame(&self) -> Duration {
        self.next_frame
    }

    /// Shows frames until the first animations, and sizes that depend on one another, have settled.
    pub fn settle(&mut self, frames: usize, mut show: impl FnMut(&mut Ui)) {
        for _ in 0..frames {
            self.frame(Vec::new(), &mut show);
        }
    }

    /// Returns the shapes of the last frame.
    pub fn shapes(&self) -> &[ClippedShape] {
        &self.shapes
    }

    /// Tessellates the last frame, as any painter must, and returns the number of triangles. The
    /// frame's shapes are consumed.
    pub fn triangles(&mut self) -> usize {
        let shapes = std::mem::take(&mut self.shapes);
        let primitives = self.context.tessellate(shapes, self.pixels_per_point);
        let count = |primitive: &Primitive| match primitive {
            Primitive::Mesh(mesh) => mesh.indices.len() / 3,
            Primitive::Callback(_) => 0,
        };
        primitives.iter().map(|clipped| count(&clipped.primitive)).sum()
    }

    /// Paints the last frame over a colour.
    pub fn pixels(&self, under: Color32) -> Pixels {
        let size = self.size_points * self.pixels_per_point;
        let mut pixels = Pixels::filled(size.x.round() as usize, size.y.round() as usize, under);
        let primitives = self.context.tessellate(self.shapes.clone(), self.pixels_per_point);
        paint_primitives(&mut pixels, &primitives, &self.textures, self.pixels_per_point);
        pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Frame, RichText};

    fn shown(text: &str) -> Pixels {
        let mut stage = Stage::new(Context::default(), 200, 60, 2.0);
        stage.settle(2, |ui| {
            Frame::NONE.fill(Color32::WHITE).show(ui, |ui| {
                ui.set_min_size(ui.available_size());
                ui.label(RichText::new(text).color(Color32::BLACK));
            });
        });
        stage.pixels(Color32::RED)
    }

    #[test]
    fn text_is_painted_black_on_white() {
        let pixels = shown("Rover");
        let count = |colour| pixels.colours.iter().filter(|c| **c == colour).count();
        assert_eq!(count(Color32::RED), 0, "the frame covers all");
        assert!(count(Color32::BLACK) > 30, "there are {} black pixels", count(Color32::BLACK));
        assert!(count(Color32::WHITE) > 200 * 60 / 2);
    }

    #[test]
    fn the_same_gives_the_same_and_something_else_does_not() {
        assert!(shown("Rover").colours == shown("Rover").colours);
        assert!(shown("Rover").colours != shown("River").colours);
    }
}
