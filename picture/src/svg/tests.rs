use super::*;
use crate::Stage;
use egui::{Align2, Context, FontId, Painter, StrokeKind, Vec2};

/// What a drawing of 100 × 50 points is as an SVG.
fn drawn(draw: impl Fn(&Painter)) -> String {
    let mut stage = Stage::new(Context::default(), 100, 50, 1.0);
    stage.settle(2, |ui| draw(ui.painter()));
    let area = Rect::from_min_size(Pos2::ZERO, Vec2::new(100.0, 50.0));
    let text = svg(stage.shapes(), area, Color32::WHITE);
    let path = std::path::Path::new("drawing.svg");
    armor_robotfile::parse_tree(path, text.as_bytes()).expect("an SVG is well-formed XML");
    text
}

#[track_caller]
fn check(draw: impl Fn(&Painter), expected: &str) {
    let text = drawn(draw);
    assert!(text.contains(expected), "no {expected} in\n{text}");
}

#[test]
fn shapes_stay_what_they_are() {
    let red = Color32::from_rgb(255, 0, 0);
    let rect = Rect::from_min_max(Pos2::new(10.0, 10.0), Pos2::new(30.0, 20.0));
    check(
        |painter| {
            painter.rect(rect, 4.0, red, (2.0, Color32::BLACK), StrokeKind::Middle);
        },
        "<rect x=\"10\" y=\"10\" width=\"20\" height=\"10\" rx=\"4\" fill=\"#ff0000\" \
         stroke=\"#000000\" stroke-width=\"2\"/>",
    );
    check(
        |painter| {
            painter.circle_filled(Pos2::new(5.0, 6.0), 3.5, red);
        },
        "<circle cx=\"5\" cy=\"6\" r=\"3.5\" fill=\"#ff0000\"/>",
    );
    let curve = [(0.0, 0.0), (10.0, 0.0), (20.0, 30.0), (40.0, 30.0)].map(Pos2::from);
    let curve = CubicBezierShape::from_points_stroke(
        curve,
        false,
        Color32::TRANSPARENT,
        Stroke::new(1.5, red),
    );
    check(
        |painter| {
            painter.add(curve.clone());
        },
        "<path d=\"M0,0 C10,0 20,30 40,30\" fill=\"none\" stroke=\"#ff0000\" stroke-width=\"1.5\"/>",
    );
}

#[test]
fn text_stays_text_of_its_own_colour() {
    let draw = |painter: &Painter| {
        let at = Pos2::new(50.0, 25.0);
        painter.text(
            at,
            Align2::CENTER_CENTER,
            "a < b & c",
            FontId::monospace(10.0),
            Color32::BLUE,
        );
    };
    let text = drawn(draw);
    for expected in [">a &lt; b &amp; c</text>", "fill=\"#0000ff\"", "monospace", "textLength=\""] {
        assert!(text.contains(expected), "no {expected} in\n{text}");
    }
}

#[test]
fn what_is_clipped_stays_clipped() {
    let part = Rect::from_min_max(Pos2::ZERO, Pos2::new(20.0, 50.0));
    check(
        |painter| {
            painter.with_clip_rect(part).circle_filled(Pos2::new(20.0, 6.0), 9.0, Color32::RED);
        },
        "<g clip-path=\"url(#clip1)\">",
    );
}

#[test]
fn what_shines_through_has_an_opacity() {
    check(
        |painter| {
            let colour = Color32::from_rgba_unmultiplied(0, 0, 0, 51);
            painter.circle_filled(Pos2::new(5.0, 6.0), 3.0, colour);
        },
        "fill=\"#000000\" fill-opacity=\"0.2\"",
    );
}
