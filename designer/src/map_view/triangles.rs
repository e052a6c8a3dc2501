//! A polygon cut into triangles, by cutting off ears (Meisters, American Mathematical Monthly 82,
//! 1975). A polygon that crosses itself gets as many triangles as have been found.

use eframe::egui::Vec2;

/// The corners of the triangles, by their numbers.
pub fn triangulate(points: &[Vec2]) -> Vec<[u32; 3]> {
    let mut left: Vec<usize> = (0..points.len()).collect();
    if area(points) < 0.0 {
        left.reverse();
    }
    let mut triangles = Vec::new();
    while left.len() >= 3 {
        let count = left.len();
        let ear = (0..count).find(|at| {
            let [a, b, c] = [count - 1, 0, 1].map(|n| left[(at + n) % count]);
            let corner = [points[a], points[b], points[c]];
            let others = left.iter().filter(|n| ![a, b, c].contains(n));
            turn(corner) > 0.0 && !others.clone().any(|n| contains(corner, points[*n]))
        });
        // Without an ear it is flat or crosses itself: any corner without a turn is left out.
        let Some(at) = ear.or_else(|| {
            (0..count)
                .find(|at| turn([count - 1, 0, 1].map(|n| points[left[(at + n) % count]])) == 0.0)
        }) else {
            break;
        };
        if ear.is_some() {
            triangles.push([count - 1, 0, 1].map(|n| left[(at + n) % count] as u32));
        }
        left.remove(at);
    }
    triangles
}

/// Twice the area, positive if the points turn left.
fn area(points: &[Vec2]) -> f32 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a.x * b.y - b.x * a.y).sum()
}

fn turn([a, b, c]: [Vec2; 3]) -> f32 {
    (b - a).x * (c - b).y - (b - a).y * (c - b).x
}

fn contains([a, b, c]: [Vec2; 3], point: Vec2) -> bool {
    let is_corner = point == a || point == b || point == c;
    !is_corner
        && [[a, b], [b, c], [c, a]].into_iter().all(|[from, to]| turn([from, to, point]) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covered(points: &[(f32, f32)]) -> (usize, f32) {
        let points: Vec<_> = points.iter().map(|(x, y)| Vec2::new(*x, *y)).collect();
        let triangles = triangulate(&points);
        let areas = triangles.iter().map(|corners| turn(corners.map(|n| points[n as usize])) / 2.0);
        (triangles.len(), areas.sum())
    }

    #[test]
    fn the_triangles_cover_the_polygon_once() {
        let notched = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)];
        assert_eq!(covered(&notched), (3, 10.0));
        let mut turned = notched;
        turned.reverse();
        assert_eq!(covered(&turned), (3, 10.0));
        let on_a_line = [(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        assert_eq!(covered(&on_a_line).1, 16.0);
    }

    #[test]
    fn what_is_no_polygon_ends() {
        assert_eq!(covered(&[]), (0, 0.0));
        assert_eq!(covered(&[(0.0, 0.0), (1.0, 1.0)]).0, 0);
        assert_eq!(covered(&[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]).0, 0);
        covered(&[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)]);
    }
}
