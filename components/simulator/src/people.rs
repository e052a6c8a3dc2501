//! People who walk to and fro along drawn ways, and what they do when a robot is before them.

use crate::scene::{Body, Kind};

/// How much room a person takes, in metres.
pub const RADIUS_M: f64 = 0.25;

/// A person who watches out stops this far before a robot, in metres.
const RESPECT_M: f64 = 0.5;

/// What people do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Manners {
    /// They stop before a robot and let it pass.
    #[default]
    Stop,
    /// They walk into it, and push on when it is gone.
    Bump,
    /// There are none.
    Absent,
}

/// A way that somebody walks: from end to end and back, or round if it ends where it begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Its corners, in metres; two at least, and not all in one place.
    pub points: Vec<(f64, f64)>,
    /// How fast it is walked, in metres per second.
    pub speed_mps: f64,
}

impl Route {
    /// The same way in another frame.
    #[must_use]
    pub(crate) fn moved(&self, point: impl Fn((f64, f64)) -> (f64, f64)) -> Self {
        Self { points: self.points.iter().map(|&p| point(p)).collect(), ..*self }
    }

    pub(crate) fn length_m(&self) -> f64 {
        self.pieces().map(|(from, to)| length_m(from, to)).sum()
    }

    fn is_round(&self) -> bool {
        self.points.first() == self.points.last()
    }

    fn pieces(&self) -> impl Iterator<Item = ((f64, f64), (f64, f64))> {
        self.points.windows(2).map(|pair| (pair[0], pair[1]))
    }

    /// Where one is after a way along it.
    fn place(&self, along_m: f64) -> (f64, f64) {
        let mut left_m = along_m;
        let mut last = self.points.first().copied().unwrap_or_default();
        for (from, to) in self.pieces() {
            let piece_m = length_m(from, to);
            if left_m < piece_m {
                let share = left_m / piece_m;
                return (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share);
            }
            left_m -= piece_m;
            last = to;
        }
        last
    }
}

fn length_m(from: (f64, f64), to: (f64, f64)) -> f64 {
    libm::hypot(to.0 - from.0, to.1 - from.1)
}

/// Everybody in a world.
#[derive(Clone, Debug)]
pub(crate) struct Crowd {
    manners: Manners,
    walkers: Vec<Walker>,
}

#[derive(Clone, Debug)]
struct Walker {
    route: Route,
    length_m: f64,
    along_m: f64,
    is_returning: bool,
}

impl Crowd {
    pub(crate) fn new(routes: &[Route], manners: Manners) -> Self {
        let routes = if manners == Manners::Absent { &[] } else { routes };
        let walkers = routes.iter().map(|route| Walker {
            length_m: route.length_m(),
            route: route.clone(),
            along_m: 0.0,
            is_returning: false,
        });
        Self { manners, walkers: walkers.collect() }
    }

    /// Everybody's body now, in the order in which their ways are drawn.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = Body> {
        self.walkers.iter().map(|walker| body(walker.route.place(walker.along_m)))
    }

    /// All walk on for `step_s` seconds but those with a robot before them.
    pub(crate) fn walk(&mut self, step_s: f64, robots: &[Body]) {
        let keep_m = RADIUS_M + if self.manners == Manners::Stop { RESPECT_M } else { 0.0 };
        for walker in &mut self.walkers {
            let away_m = |along_m: f64| {
                let Body { x_m, y_m, .. } = body(walker.route.place(along_m));
                robots.iter().map(|robot| robot.clearance_m(x_m, y_m)).fold(f64::INFINITY, f64::min)
            };
            let way_m = walker.route.speed_mps * step_s;
            let (free_m, next) = (away_m(walker.along_m) - keep_m, walker.after(way_m));
            let is_blocked = free_m < way_m && away_m(next.0) < away_m(walker.along_m);
            // Up to the robot, and no further.
            let next = if is_blocked { walker.after(free_m.max(0.0)) } else { next };
            (walker.along_m, walker.is_returning) = next;
        }
    }
}

impl Walker {
    /// How far along, and which way, after another piece of the way.
    fn after(&self, way_m: f64) -> (f64, bool) {
        if self.route.is_round() {
            let along_m = self.along_m + way_m;
            let rounds = libm::floor(along_m / self.length_m);
            return (along_m - rounds * self.length_m, false);
        }
        let along_m = if self.is_returning { self.along_m - way_m } else { self.along_m + way_m };
        if along_m < 0.0 {
            ((-along_m).min(self.length_m), false)
        } else if along_m > self.length_m {
            ((2.0 * self.length_m - along_m).max(0.0), true)
        } else {
            (along_m, self.is_returning)
        }
    }
}

fn body((x_m, y_m): (f64, f64)) -> Body {
    Body { x_m, y_m, radius_m: RADIUS_M, kind: Kind::Person }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crowd(points: &[(f64, f64)], manners: Manners) -> Crowd {
        Crowd::new(&[Route { points: points.to_vec(), speed_mps: 1.0 }], manners)
    }

    /// Walks for a time in steps of 10 ms and says where the person is.
    fn walked(crowd: &mut Crowd, seconds: f64, robots: &[Body]) -> (f64, f64) {
        for _ in 0..(seconds * 100.0) as u32 {
            crowd.walk(0.01, robots);
        }
        let body = crowd.bodies().next().expect("a person");
        (body.x_m, body.y_m)
    }

    #[track_caller]
    fn check(place: (f64, f64), expected: (f64, f64)) {
        assert!(length_m(place, expected) < 0.011, "{place:?}, expected {expected:?}");
    }

    #[test]
    fn an_open_way_is_walked_back_and_forth() {
        let mut crowd = crowd(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0)], Manners::Stop);
        check(walked(&mut crowd, 1.0, &[]), (1.0, 0.0));
        check(walked(&mut crowd, 1.5, &[]), (2.0, 0.5));
        check(walked(&mut crowd, 1.0, &[]), (2.0, 0.5));
        check(walked(&mut crowd, 2.5, &[]), (0.0, 0.0));
        check(walked(&mut crowd, 0.5, &[]), (0.5, 0.0));
    }

    #[test]
    fn a_closed_way_is_walked_round() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
        let mut crowd = crowd(&square, Manners::Stop);
        check(walked(&mut crowd, 3.5, &[]), (0.0, 0.5));
        check(walked(&mut crowd, 1.0, &[]), (0.5, 0.0));
    }

    #[test]
    fn they_stop_before_a_robot_or_walk_into_it_and_go_on_when_it_is_gone() {
        let robot = Body { x_m: 3.0, y_m: 0.0, radius_m: 0.18, kind: Kind::Robot };
        for (manners, stop_m) in [(Manners::Stop, 2.07), (Manners::Bump, 2.57)] {
            let mut crowd = crowd(&[(0.0, 0.0), (9.0, 0.0)], manners);
            check(walked(&mut crowd, 5.0, &[robot]), (stop_m, 0.0));
            check(walked(&mut crowd, 1.0, &[]), (stop_m + 1.0, 0.0));
        }
    }

    #[test]
    fn nobody_is_there_if_nobody_is_wanted() {
        assert_eq!(crowd(&[(0.0, 0.0), (1.0, 0.0)], Manners::Absent).bodies().count(), 0);
    }
}
