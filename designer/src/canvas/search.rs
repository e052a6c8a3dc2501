//! The shortest line between two points that keeps clear of rectangles: a search (A*) over their
//! corners.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use eframe::egui::{Pos2, Rect};

/// Distance between a rectangle and a line that turns at its corner.
const CLEARANCE: f32 = 12.0;
/// Distance that a line keeps from every rectangle.
const KEPT: f32 = 7.0;
/// A turn counts as much as this distance, so that a line has few of them.
const TURN: f32 = 40.0;
/// Most rectangles that are considered: those nearest to the line between the points.
const MAX_RECTS: usize = 32;

/// Returns the turns of the line; `lane` is added to its distance from the corners. None if there
/// is no line.
pub(super) fn find_path(
    start: Pos2,
    goal: Pos2,
    mut rects: Vec<Rect>,
    lane: f32,
) -> Option<Vec<Pos2>> {
    if rects.len() > MAX_RECTS {
        rects.sort_by(|a, b| {
            distance(start, goal, a.center()).total_cmp(&distance(start, goal, b.center()))
        });
        rects.truncate(MAX_RECTS);
    }
    let kept = |rect: &Rect| {
        let wide = rect.expand(KEPT);
        // What is so near to an end leaves less room there.
        if wide.contains(start) || wide.contains(goal) { rect.shrink(1.0) } else { wide }
    };
    let kept: Vec<Rect> = rects.iter().map(kept).collect();
    let mut points = vec![start, goal];
    for rect in &rects {
        let wide = rect.expand(CLEARANCE + lane);
        let corners = [wide.left_top(), wide.right_top(), wide.left_bottom(), wide.right_bottom()];
        points.extend(corners.into_iter().filter(|at| !kept.iter().any(|it| it.contains(*at))));
    }
    let is_clear = |a: Pos2, b: Pos2| !kept.iter().any(|rect| segment_meets(a, b, *rect));
    let mut best = vec![f32::INFINITY; points.len()];
    let mut before = vec![0; points.len()];
    let mut is_done = vec![false; points.len()];
    best[0] = 0.0;
    // Lengths are positive, so that their bits are in their order.
    let mut open = BinaryHeap::from([(Reverse(0_u32), 0_usize)]);
    while let Some((_, at)) = open.pop() {
        if at == 1 {
            let mut turns = Vec::new();
            let mut last = before[1];
            while last != 0 {
                turns.push(points[last]);
                last = before[last];
            }
            turns.reverse();
            return Some(turns);
        }
        if std::mem::replace(&mut is_done[at], true) {
            continue;
        }
        for next in 1..points.len() {
            let cost = best[at] + points[at].distance(points[next]) + TURN;
            if !is_done[next] && cost < best[next] && is_clear(points[at], points[next]) {
                best[next] = cost;
                before[next] = at;
                let least = cost + points[next].distance(goal);
                open.push((Reverse(least.to_bits()), next));
            }
        }
    }
    None
}

/// Whether the line between two points meets a rectangle (Liang and Barsky 1984).
pub(super) fn segment_meets(a: Pos2, b: Pos2, rect: Rect) -> bool {
    if !rect.is_positive() {
        return false;
    }
    let way = b - a;
    let (mut enters, mut leaves) = (0.0_f32, 1.0_f32);
    let sides = [
        (-way.x, a.x - rect.min.x),
        (way.x, rect.max.x - a.x),
        (-way.y, a.y - rect.min.y),
        (way.y, rect.max.y - a.y),
    ];
    for (step, room) in sides {
        if step == 0.0 {
            if room < 0.0 {
                return false;
            }
        } else if step < 0.0 {
            enters = enters.max(room / step);
        } else {
            leaves = leaves.min(room / step);
        }
    }
    enters <= leaves
}

/// How far a point is from the line between two others.
fn distance(a: Pos2, b: Pos2, at: Pos2) -> f32 {
    let along = b - a;
    let share = ((at - a).dot(along) / along.length_sq().max(1.0)).clamp(0.0, 1.0);
    (at - (a + along * share)).length()
}

#[cfg(test)]
mod tests {
    use eframe::egui::{pos2, vec2};

    use super::*;

    #[test]
    fn a_line_turns_at_the_corners_of_what_is_between_its_ends() {
        let wall = Rect::from_min_size(pos2(100.0, -50.0), vec2(40.0, 200.0));
        let turns = find_path(pos2(0.0, 0.0), pos2(300.0, 0.0), vec![wall], 0.0).unwrap();
        assert_eq!(turns, [pos2(88.0, -62.0), pos2(152.0, -62.0)]);
        assert_eq!(find_path(pos2(0.0, 0.0), pos2(90.0, 0.0), vec![wall], 0.0), Some(Vec::new()));
    }

    #[test]
    fn an_end_that_is_walled_in_has_no_line() {
        let around = [
            Rect::from_min_size(pos2(-60.0, -60.0), vec2(120.0, 20.0)),
            Rect::from_min_size(pos2(-60.0, 40.0), vec2(120.0, 20.0)),
            Rect::from_min_size(pos2(-60.0, -60.0), vec2(20.0, 120.0)),
            Rect::from_min_size(pos2(40.0, -60.0), vec2(20.0, 120.0)),
        ];
        assert_eq!(find_path(Pos2::ZERO, pos2(300.0, 0.0), around.to_vec(), 0.0), None);
    }

    #[test]
    fn a_line_meets_a_rectangle_that_it_passes_or_is_in() {
        let rect = Rect::from_min_size(pos2(10.0, 10.0), vec2(10.0, 10.0));
        for (a, b, meets) in [
            (pos2(0.0, 15.0), pos2(30.0, 15.0), true),
            (pos2(15.0, 15.0), pos2(16.0, 15.0), true),
            (pos2(0.0, 5.0), pos2(30.0, 5.0), false),
            (pos2(0.0, 25.0), pos2(25.0, 50.0), false),
            (pos2(0.0, 0.0), pos2(30.0, 30.0), true),
        ] {
            assert_eq!(segment_meets(a, b, rect), meets, "{a} {b}");
        }
    }
}
