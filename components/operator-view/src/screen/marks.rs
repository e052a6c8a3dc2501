//! Everything drawn on the map: trajectories, scan, particles, the robot with its uncertainty, the
//! goal.

use armor_picture::theme;
use std::f64::consts::TAU;

use armor_grid::{Point2, Pose2};
use eframe::egui::{Color32, Mesh, Painter, Pos2, Rect, Shape, Stroke, Vec2, vec2};

use super::layers::{Layer, Layers};
use super::map_viewport::MapViewport;
use crate::console::Console;
use crate::scene::LocatedPose;

/// Standard deviations of an ellipse that contains the robot with 95 %, in two dimensions.
const ELLIPSE: f64 = 2.448;
/// Smallest robot on the screen, in points.
const MIN_ROBOT: f32 = 6.0;
/// Further off the screen nothing is dashed, in points.
const MARGIN: f32 = 4000.0;
/// Length of a dash and of a gap, in points.
const DASHES: (f32, f32) = (6.0, 4.0);

/// Paints everything but the map itself.
pub(super) fn paint_marks(
    painter: &Painter,
    look: &MapViewport,
    console: &Console,
    layers: &Layers,
) {
    let scene = &console.scene;
    let draw_line = |points: Vec<Pos2>, width: f32, colour: Color32| {
        painter.add(Shape::line(points, Stroke::new(width, colour)));
    };
    if layers.is_shown(Layer::Truth) {
        draw_line(look.line(scene.truth.line()), 3.0, theme::map::TRUTH.gamma_multiply(0.6));
    }
    if layers.is_shown(Layer::Odometry) {
        let stroke = Stroke::new(1.5, theme::map::ODOMETRY);
        for points in near(&look.line(scene.odometry.line()), look.rect) {
            painter.extend(Shape::dashed_line(points, stroke, DASHES.0, DASHES.1));
        }
    }
    if layers.is_shown(Layer::Trajectory) {
        draw_line(look.line(scene.trajectory_points()), 2.0, theme::map::TRAJECTORY);
    }
    if layers.is_shown(Layer::Particles) {
        paint_particles(painter, look, &scene.particles);
    }
    if layers.is_shown(Layer::Path) && console.is_linked("path") {
        draw_line(look.line(scene.path.iter().copied()), 3.0, theme::map::PATH);
    }
    if layers.is_shown(Layer::Scan)
        && let Some(robot) = scene.robot_at(scene.scan.stamp_s)
    {
        let points = scene.scan.points.iter().map(|point| robot.apply(*point));
        paint_dots(painter, look, points, 3.0, theme::map::SCAN);
    }
    if let Some(located) = &scene.located {
        paint_ellipse(painter, look, located, scene.robot().unwrap_or(located.pose));
    }
    if let Some(robot) = scene.robot() {
        self::robot(painter, look, robot, console.robot_radius_m);
    }
    if let Some(goal) = console.orders.goal() {
        paint_goal(painter, look, goal.place);
    }
}

/// Returns the parts of a line on or near the screen: a very long line would give an unbounded
/// number of dashes.
fn near(line: &[Pos2], rect: Rect) -> impl Iterator<Item = &[Pos2]> {
    let around = rect.expand(MARGIN);
    line.split(move |at| !around.contains(*at)).filter(|points| points.len() > 1)
}

/// Squares of one size, as one mesh: there may be thousands.
fn paint_dots(
    painter: &Painter,
    look: &MapViewport,
    points: impl Iterator<Item = Point2>,
    size: f32,
    colour: Color32,
) {
    let mut mesh = Mesh::default();
    for at in points.map(|point| look.on_screen(point)) {
        if look.rect.contains(at) {
            mesh.add_colored_rect(Rect::from_center_size(at, Vec2::splat(size)), colour);
        }
    }
    painter.add(Shape::mesh(mesh));
}

fn paint_particles(painter: &Painter, look: &MapViewport, poses: &[Pose2]) {
    // One mesh: as lines of their own they cost most of a frame.
    let mut mesh = Mesh::default();
    for pose in poses {
        let at = look.on_screen(pose.point());
        if look.rect.contains(at) {
            let ahead = direction(pose.yaw_rad) * 9.0;
            let aside = ahead.rot90() / 18.0;
            let first = mesh.vertices.len() as u32;
            for corner in [at - aside, at + aside, at + ahead + aside, at + ahead - aside] {
                mesh.colored_vertex(corner, theme::map::PARTICLES);
            }
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first, first + 2, first + 3);
        }
    }
    painter.add(Shape::mesh(mesh));
    let points = poses.iter().map(|pose| pose.point());
    paint_dots(painter, look, points, 3.0, theme::map::PARTICLES);
}

/// Returns a direction on the screen, whose y points down.
fn direction(yaw_rad: f64) -> Vec2 {
    let (sin, cos) = yaw_rad.sin_cos();
    vec2(cos as f32, -sin as f32)
}

/// Paints the ellipse that contains the robot with 95 %, from the eigenvectors of the covariance.
fn paint_ellipse(painter: &Painter, look: &MapViewport, located: &LocatedPose, robot: Pose2) {
    let [xx, xy, yy] = located.covariance_m2;
    let (mean, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
    let spread = half.hypot(xy);
    let (long_m, short_m) = ((mean + spread).sqrt(), (mean - spread).max(0.0).sqrt());
    if !(long_m.is_finite() && short_m.is_finite()) || long_m == 0.0 {
        return;
    }
    let (sin, cos) = (0.5 * xy.atan2(half)).sin_cos();
    let points = (0..32).map(|n| {
        let (up, along) = (TAU * f64::from(n) / 32.0).sin_cos();
        let (along, up) = (ELLIPSE * long_m * along, ELLIPSE * short_m * up);
        look.on_screen(Point2::new(
            robot.x_m + cos * along - sin * up,
            robot.y_m + sin * along + cos * up,
        ))
    });
    let stroke = Stroke::new(1.5, theme::map::ROBOT.gamma_multiply(0.8));
    painter.add(Shape::closed_line(points.collect(), stroke));
}

fn robot(painter: &Painter, look: &MapViewport, robot: Pose2, radius_m: f64) {
    let radius = (radius_m as f32 * look.scale).max(MIN_ROBOT);
    let (at, ahead) = (look.on_screen(robot.point()), direction(robot.yaw_rad));
    painter.circle(
        at,
        radius,
        theme::map::ROBOT.gamma_multiply(0.25),
        Stroke::new(2.0, theme::map::ROBOT),
    );
    let aside = ahead.rot90() * radius * 0.5;
    let points = vec![
        at + ahead * radius,
        at - ahead * radius * 0.5 + aside,
        at - ahead * radius * 0.5 - aside,
    ];
    painter.add(Shape::convex_polygon(points, theme::map::ROBOT, Stroke::NONE));
}

/// A ring with an arrow.
pub(super) fn paint_goal(painter: &Painter, look: &MapViewport, place: Pose2) {
    let stroke = Stroke::new(2.5, theme::map::GOAL);
    let (at, ahead) = (look.on_screen(place.point()), direction(place.yaw_rad));
    painter.circle_stroke(at, 7.0, stroke);
    painter.arrow(at + ahead * 7.0, ahead * 22.0, stroke);
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::pos2;

    #[test]
    fn a_line_to_the_other_end_of_the_world_is_not_dashed() {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let line =
            [pos2(0.0, 0.0), pos2(9.0, 9.0), pos2(1e12, 0.0), pos2(20.0, 9.0), pos2(40.0, 9.0)];
        let stretches: Vec<_> = near(&line, rect).map(<[Pos2]>::len).collect();
        assert_eq!(stretches, [2, 2]);
    }
}
