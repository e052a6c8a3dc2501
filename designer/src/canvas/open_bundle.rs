//! Which bundles are open: the links of one are drawn one by one while the pointer is at it or one of
//! them is selected.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::bundle::{Bundle, is_plain};
use crate::canvas::diagram::{Diagram, DiagramId};
use crate::canvas::edges::path;
use crate::canvas::hit::Hit;
use crate::canvas::state::Canvas;

/// A bundle stays open while the pointer is at most so far from its links.
const OPEN_REACH: f32 = 14.0;

impl<Id: DiagramId> Canvas<Id> {
    /// The bundle that a wire is drawn in now, if its links are not drawn one by one.
    pub(super) fn closed_bundle<'a>(
        &self,
        diagram: &'a Diagram<Id>,
        wire: usize,
    ) -> Option<&'a Bundle> {
        let bundle = diagram.bundle(wire)?;
        let is_selected = |n: &usize| self.selection.contains(diagram.wires[*n].item);
        // Marks, colours and texts may have been given to the wires of a finished drawing.
        let is_plain = |n: &usize| is_plain(&diagram.nodes, &diagram.wires[*n]);
        let is_open = self.open_bundle == Some(ids(diagram, bundle))
            || (!self.selection.is_empty() && bundle.wires.iter().any(is_selected))
            || !bundle.wires.iter().all(is_plain);
        (!is_open).then_some(bundle)
    }

    /// The points of a wire as it is drawn now.
    pub(super) fn wire_path(
        &self,
        diagram: &Diagram<Id>,
        wire: usize,
        shift: impl Fn(usize) -> Vec2,
        pieces: usize,
    ) -> Option<Vec<Pos2>> {
        match self.closed_bundle(diagram, wire) {
            Some(bundle) => {
                let [out, trunk, into] = diagram.bundled_path(bundle, wire, shift, pieces)?;
                Some([out, trunk, into].concat())
            }
            None => path(diagram, wire, shift, pieces),
        }
    }

    /// Opens the bundle under the pointer, and closes it when the pointer has left its links.
    pub(super) fn open_hovered_bundle(
        &mut self,
        diagram: &Diagram<Id>,
        pointer: Option<Pos2>,
        hovered: Option<Hit>,
    ) {
        if self.is_busy() {
            return;
        }
        let bundle = match hovered {
            Some(Hit::Wire(wire) | Hit::Grip { wire, .. }) => {
                diagram.bundle(wire).map(|bundle| ids(diagram, bundle))
            }
            Some(Hit::Port(_) | Hit::Node(_)) => None,
            // Between two links of an open bundle, it stays open.
            _ => self.open_bundle.filter(|open| {
                let bundle = diagram.bundles().iter().find(|it| ids(diagram, it) == *open);
                bundle.zip(pointer).is_some_and(|(bundle, pointer)| {
                    let paths = bundle.wires.iter();
                    let paths = paths.filter_map(|n| path(diagram, *n, |_| Vec2::ZERO, 12));
                    let areas = paths.map(|points| Rect::from_points(&points));
                    let area = areas.reduce(Rect::union).unwrap_or(Rect::NOTHING);
                    area.expand(OPEN_REACH).contains(self.to_drawing(pointer))
                })
            }),
        };
        self.open_bundle = bundle;
    }
}

fn ids<Id: DiagramId>(diagram: &Diagram<Id>, bundle: &Bundle) -> (Id, Id) {
    let [from, to] = bundle.nodes;
    (diagram.nodes[from].item, diagram.nodes[to].item)
}
