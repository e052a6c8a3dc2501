//! Tokens that move from place to place, painted over the drawing.

use armor_petri::PlaceId;
use eframe::egui::{self, Pos2, Stroke, Vec2};

use super::state::MissionView;
use crate::canvas::{path, point_at};
use crate::item::Item;
use armor_picture::theme::ThemeColours;
use armor_robotfile::mission::ArcKind;

/// The radius of a token, in the drawing.
const TOKEN: f32 = 6.5;
/// Pieces of an arc along which a token moves.
const PIECES: usize = 24;

impl MissionView {
    /// Paints the tokens that are on their way, and asks for the next frame as long as there are
    /// some.
    pub(super) fn paint_motion(&mut self, ui: &egui::Ui) {
        let now = ui.input(|i| i.time);
        let Some(simulator) = &mut self.simulator else { return };
        match simulator.advance(now) {
            Some(wait) if wait <= 0.0 => ui.ctx().request_repaint(),
            Some(wait) => {
                let wait = std::time::Duration::from_secs_f64(wait);
                ui.ctx().request_repaint_after(wait);
            }
            None => {}
        }
        let Some(motion) = simulator.motion() else { return };
        let share = motion.share(now);
        let stage = simulator.play().stage();
        let Some(written) = stage.written(motion.transition) else { return };
        let net = stage.net.transition(motion.transition);
        // First to the transition, then on from there.
        let (kind, arcs, along) = if share < 0.5 {
            (ArcKind::Take, &net.inputs, share * 2.0)
        } else {
            (ArcKind::Put, &net.outputs, share * 2.0 - 1.0)
        };
        let arc_item = |(place, _): &(PlaceId, _)| {
            Item::arc(&written.name.value, stage.net.place(*place), kind)
        };
        let items: Vec<_> = arcs.iter().map(arc_item).collect();
        let colours = ThemeColours::of(ui.visuals());
        let painter = ui.painter_at(self.pane.canvas.rect());
        for item in items {
            let wire = self.diagram.wires.iter().position(|wire| wire.item == item);
            if let Some(at) = wire.and_then(|wire| self.point(wire, eased(along))) {
                let radius = (TOKEN * self.pane.canvas.viewport.zoom).max(3.0);
                let edge = Stroke::new(2.0, colours.background);
                painter.circle(at, radius, colours.good, edge);
            }
        }
    }

    /// A point along a wire, in the window.
    fn point(&self, wire: usize, share: f32) -> Option<Pos2> {
        let points = path(&self.diagram, wire, |_| Vec2::ZERO, PIECES)?;
        Some(self.pane.canvas.to_window(point_at(&points, share.clamp(0.0, 1.0))))
    }
}

/// Slow at both ends.
fn eased(share: f32) -> f32 {
    share * share * (3.0 - 2.0 * share)
}
