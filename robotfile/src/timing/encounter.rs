//! Where two robots come closer than the sum of their radii. On two straight pieces at constant speed the
//! square of their distance is a quadratic of the time, so that each interval is found in closed form.

use armor_geo::MapPoint;

use crate::timing::motion::{MotionPiece, RobotMotion};

/// Intervals that are this close to each other are one: a piece ends where the next begins.
const SAME_S: f64 = 1e-9;

/// Two robots are closer than their radii allow.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotEncounter {
    /// The numbers of the robots.
    pub robots: [usize; 2],
    /// When it begins, in seconds from the begin of the mission.
    pub from_s: f64,
    /// When it ends.
    pub to_s: f64,
    /// When they are nearest to each other: the first time, if they stay so.
    pub nearest_s: f64,
    /// How near that is: between their centres.
    pub nearest_m: f64,
    /// The sum of their radii.
    pub reach_m: f64,
    /// Where they are then.
    pub at: [MapPoint; 2],
    /// The steps that they are in then; none before the first and after the last.
    pub steps: [Option<usize>; 2],
}

/// A part of an encounter, within one piece of each robot.
struct ClosePart {
    from_s: f64,
    to_s: f64,
    nearest_s: f64,
    nearest_m: f64,
}

/// Returns the encounters of two robots, in the order of time.
pub(super) fn find_encounters(
    robots: [usize; 2],
    motions: [&RobotMotion; 2],
    reach_m: f64,
) -> Vec<RobotEncounter> {
    let mut found: Vec<RobotEncounter> = Vec::new();
    visit_common_pieces(motions, |one, other| {
        let Some(part) = find_close_part(one, other, reach_m) else { return true };
        let at_nearest = || [one, other].map(|piece| piece.position_at(part.nearest_s));
        match found.last_mut().filter(|last| part.from_s <= last.to_s + SAME_S) {
            Some(last) => {
                last.to_s = part.to_s;
                if part.nearest_m < last.nearest_m {
                    last.at = at_nearest();
                    last.steps = [one.step, other.step];
                    (last.nearest_s, last.nearest_m) = (part.nearest_s, part.nearest_m);
                }
            }
            None => found.push(RobotEncounter {
                robots,
                from_s: part.from_s,
                to_s: part.to_s,
                nearest_s: part.nearest_s,
                nearest_m: part.nearest_m,
                reach_m,
                at: at_nearest(),
                steps: [one.step, other.step],
            }),
        }
        true
    });
    found
}

/// Returns whether two robots ever come closer than `reach_m`.
pub(super) fn do_meet(motions: [&RobotMotion; 2], reach_m: f64) -> bool {
    let mut is_found = false;
    visit_common_pieces(motions, |one, other| {
        is_found = find_close_part(one, other, reach_m).is_some();
        !is_found
    });
    is_found
}

/// Visits each two pieces that have a time in common, in the order of time, until `visit` returns false.
fn visit_common_pieces(
    [one, other]: [&RobotMotion; 2],
    mut visit: impl FnMut(&MotionPiece, &MotionPiece) -> bool,
) {
    let (mut first, mut second) = (0, 0);
    while let (Some(left), Some(right)) = (one.pieces.get(first), other.pieces.get(second)) {
        if !visit(left, right) {
            return;
        }
        if left.end_s <= right.end_s {
            first += 1;
        } else {
            second += 1;
        }
    }
}

/// Returns when two robots are closer than `reach_m` within their pieces; to touch is not closer.
fn find_close_part(one: &MotionPiece, other: &MotionPiece, reach_m: f64) -> Option<ClosePart> {
    let start_s = one.start_s.max(other.start_s);
    let length_s = one.end_s.min(other.end_s) - start_s;
    if length_s <= 0.0 {
        return None;
    }
    let (a, b) = (one.position_at(start_s), other.position_at(start_s));
    let (u, v) = (one.velocity_mps(), other.velocity_mps());
    let apart = [b.x_m() - a.x_m(), b.y_m() - a.y_m()];
    let drift = [v[0] - u[0], v[1] - u[1]];
    let dot = |p: [f64; 2], q: [f64; 2]| p[0] * q[0] + p[1] * q[1];
    // |apart + drift t|² - reach² = square t² + 2 half t + rest
    let (square, half) = (dot(drift, drift), dot(apart, drift));
    let rest = dot(apart, apart) - reach_m * reach_m;
    let (from, to) = match square > 0.0 {
        false if rest < 0.0 => (0.0, length_s),
        false => return None,
        true => {
            let root = half * half - square * rest;
            if root <= 0.0 {
                return None;
            }
            // The root of the same sign is added, so that nothing cancels.
            let sum = -(half + root.sqrt().copysign(half));
            let ends = [sum / square, rest / sum];
            (ends[0].min(ends[1]).max(0.0), ends[0].max(ends[1]).min(length_s))
        }
    };
    if to <= from {
        return None;
    }
    let nearest = if square > 0.0 { (-half / square).clamp(from, to) } else { from };
    let there = [apart[0] + drift[0] * nearest, apart[1] + drift[1] * nearest];
    Some(ClosePart {
        from_s: start_s + from,
        to_s: start_s + to,
        nearest_s: start_s + nearest,
        nearest_m: there[0].hypot(there[1]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, y_m: f64) -> MapPoint {
        MapPoint::new(x_m, y_m).expect("a position")
    }

    /// A motion through positions at times.
    fn motion(stops: &[(f64, f64, f64)]) -> RobotMotion {
        let mut pieces: Vec<MotionPiece> = Vec::new();
        for pair in stops.windows(2) {
            let (from, to) = (at(pair[0].1, pair[0].2), at(pair[1].1, pair[1].2));
            let from_m = pieces.last().map_or(0.0, |piece| piece.to_m);
            let to_m = from_m + from.distance_m(to);
            let (start_s, end_s) = (pair[0].0, pair[1].0);
            pieces.push(MotionPiece { start_s, end_s, from, to, from_m, to_m, step: None });
        }
        RobotMotion { pieces, open_step: None }
    }

    /// `from..to nearest at` of each encounter.
    fn check(one: &[(f64, f64, f64)], other: &[(f64, f64, f64)], reach_m: f64, expected: &[&str]) {
        let motions = [motion(one), motion(other)];
        let found = find_encounters([0, 1], [&motions[0], &motions[1]], reach_m);
        let found: Vec<_> = found
            .iter()
            .map(|it| {
                let (from, to, when) = (it.from_s, it.to_s, it.nearest_s);
                format!("{from:.3}..{to:.3} {:.3} at {when:.3}", it.nearest_m)
            })
            .collect();
        assert_eq!(found, expected);
        assert_eq!(do_meet([&motions[0], &motions[1]], reach_m), !expected.is_empty());
    }

    #[test]
    fn two_lines_that_cross_are_close_around_the_crossing() {
        // Both are at the crossing after 5 s: closer than √2 m while both are within 1 m of it.
        let across = [(0.0, 0.0, 0.0), (10.0, 10.0, 0.0)];
        let up = [(0.0, 5.0, -5.0), (10.0, 5.0, 5.0)];
        check(&across, &up, 2.0_f64.sqrt(), &["4.000..6.000 0.000 at 5.000"]);
        // Head on, 1 m apart sideways: closer than 2 m within √3 m along, at 2 m/s.
        let back = [(0.0, 10.0, 1.0), (10.0, 0.0, 1.0)];
        check(&across, &back, 2.0, &["4.134..5.866 1.000 at 5.000"]);
        check(&across, &back, 1.0, &[]);
        // In convoy 1 m behind: all the time closer than 1.5 m, never than 1 m.
        let behind = [(0.0, -1.0, 0.0), (10.0, 9.0, 0.0)];
        check(&across, &behind, 1.5, &["0.000..10.000 1.000 at 0.000"]);
        check(&across, &behind, 1.0, &[]);
    }

    #[test]
    fn an_encounter_over_several_pieces_is_one_and_a_second_one_is_another() {
        let stands = [(0.0, 0.0, 0.0), (100.0, 0.0, 0.0)];
        let visits = [
            (0.0, -10.0, 0.0),
            (10.0, 0.0, 0.0),
            (20.0, 0.0, 0.0),
            (30.0, 10.0, 0.0),
            (50.0, -10.0, 0.0),
        ];
        let expected = ["9.000..21.000 0.000 at 10.000", "39.000..41.000 0.000 at 40.000"];
        check(&stands, &visits, 1.0, &expected);
        // A robot of which nothing more is known meets no other one.
        check(&stands[..1], &visits, 1.0, &[]);
    }

    /// Random motions are compared with a dense sampling: no encounter is missed, none invented.
    #[test]
    fn encounters_are_those_of_a_dense_sampling() {
        let mut random = fastrand::Rng::with_seed(8_192);
        let (mut samples_close, mut samples_apart) = (0, 0);
        for _ in 0..300 {
            let mut draw = || {
                let mut time_s = 0.0;
                let mut stops = vec![(0.0, random.f64() * 8.0, random.f64() * 8.0)];
                for _ in 0..random.usize(1..8) {
                    time_s += random.f64() * 5.0;
                    let (_, x_m, y_m) = stops[stops.len() - 1];
                    match random.bool() {
                        true => stops.push((time_s, x_m, y_m)),
                        false => stops.push((time_s, random.f64() * 8.0, random.f64() * 8.0)),
                    }
                }
                motion(&stops)
            };
            let motions = [draw(), draw()];
            let reach_m = 0.2 + random.f64() * 2.0;
            let found = find_encounters([0, 1], [&motions[0], &motions[1]], reach_m);
            for pair in found.windows(2) {
                assert!(pair[0].to_s < pair[1].from_s);
            }
            let end_s = motions.iter().filter_map(RobotMotion::end_s).fold(f64::INFINITY, f64::min);
            let mut least_m = vec![f64::INFINITY; found.len()];
            for number in 0..=2_000 {
                let time_s = (end_s * f64::from(number) / 2_000.0).min(end_s);
                let position = |motion: &RobotMotion| motion.position_at(time_s).expect("known");
                let apart_m = position(&motions[0]).distance_m(position(&motions[1]));
                let inside = found.iter().position(|it| (it.from_s..=it.to_s).contains(&time_s));
                // At the very ends of an interval both may be.
                if apart_m < reach_m - 1e-6 {
                    samples_close += 1;
                    let inside = inside.expect("an encounter that was missed");
                    least_m[inside] = least_m[inside].min(apart_m);
                } else if apart_m > reach_m + 1e-6 {
                    samples_apart += 1;
                    assert!(inside.is_none(), "invented at {time_s}: {found:?}");
                }
            }
            for (encounter, least_m) in found.iter().zip(least_m) {
                assert!(encounter.nearest_m <= least_m + 1e-9, "{encounter:?} {least_m}");
                let apart_m = encounter.at[0].distance_m(encounter.at[1]);
                assert!((apart_m - encounter.nearest_m).abs() < 1e-9, "{encounter:?}");
            }
        }
        assert!(samples_close > 20_000 && samples_apart > 20_000, "{samples_close}");
    }
}
