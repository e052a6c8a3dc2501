//! Aligns nodes, or spaces them evenly.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::diagram::DiagramId;

/// How nodes are aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alignment {
    /// Their left edges.
    Left,
    /// Their right edges.
    Right,
    /// Their upper edges.
    Top,
    /// Their lower edges.
    Bottom,
    /// The gaps from left to right alike.
    Across,
    /// The gaps from top to bottom alike.
    Down,
}

/// Returns the new positions of the nodes.
pub fn align<Id: DiagramId>(areas: &[(Id, Rect)], how: Alignment) -> Vec<(Id, Pos2)> {
    let Some(whole) = areas.iter().map(|(_, area)| *area).reduce(Rect::union) else {
        return Vec::new();
    };
    if matches!(how, Alignment::Across | Alignment::Down) {
        return space(areas, whole, how);
    }
    let moved = |area: &Rect| match how {
        Alignment::Left => Pos2::new(whole.min.x, area.min.y),
        Alignment::Right => Pos2::new(whole.max.x - area.width(), area.min.y),
        Alignment::Top => Pos2::new(area.min.x, whole.min.y),
        _ => Pos2::new(area.min.x, whole.max.y - area.height()),
    };
    areas.iter().map(|(item, area)| (*item, moved(area))).collect()
}

fn space<Id: DiagramId>(areas: &[(Id, Rect)], whole: Rect, how: Alignment) -> Vec<(Id, Pos2)> {
    let along = |v: Vec2| if how == Alignment::Across { v.x } else { v.y };
    let mut sorted: Vec<_> = areas.iter().collect();
    sorted.sort_by(|a, b| along(a.1.min.to_vec2()).total_cmp(&along(b.1.min.to_vec2())));
    let filled: f32 = areas.iter().map(|(_, area)| along(area.size())).sum();
    let gaps = (areas.len().max(2) - 1) as f32;
    let gap = ((along(whole.size()) - filled) / gaps).max(10.0);
    let mut at = along(whole.min.to_vec2());
    let mut places = Vec::new();
    for (item, area) in sorted {
        let corner = match how {
            Alignment::Across => Pos2::new(at, area.min.y),
            _ => Pos2::new(area.min.x, at),
        };
        places.push((*item, corner));
        at += along(area.size()) + gap;
    }
    places
}
