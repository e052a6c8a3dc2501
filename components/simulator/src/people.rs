//! People who walk to and fro along drawn routes, and what they do in front of a robot.

use armor_drawn_world::WalkedRoute;

use crate::scene::{Body, BodyKind};

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

/// All people of a world.
#[derive(Clone, Debug)]
pub(crate) struct Crowd {
    manners: Manners,
    walkers: Vec<Walker>,
}

#[derive(Clone, Debug)]
struct Walker {
    route: WalkedRoute,
    length_m: f64,
    along_m: f64,
    is_returning: bool,
}

impl Crowd {
    pub(crate) fn new(routes: &[WalkedRoute], manners: Manners) -> Self {
        let routes = if manners == Manners::Absent { &[] } else { routes };
        let walkers = routes.iter().map(|route| Walker {
            length_m: route.length_m(),
            route: route.clone(),
            along_m: 0.0,
            is_returning: false,
        });
        Self { manners, walkers: walkers.collect() }
    }

    /// Returns the bodies of all people, in the order in which their routes are drawn.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = Body> {
        self.walkers.iter().map(|walker| person_body(walker.route.point_along(walker.along_m)))
    }

    /// All walk on for `step_s` seconds but those with a robot before them.
    pub(crate) fn walk_on(&mut self, step_s: f64, robots: &[Body]) {
        let keep_m = RADIUS_M + if self.manners == Manners::Stop { RESPECT_M } else { 0.0 };
        for walker in &mut self.walkers {
            let away_m = |along_m: f64| {
                let Body { x_m, y_m, .. } = person_body(walker.route.point_along(along_m));
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
    /// The distance along the route and the direction, after another piece of it.
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

fn person_body((x_m, y_m): (f64, f64)) -> Body {
    Body { x_m, y_m, radius_m: RADIUS_M, kind: BodyKind::Person }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crowd(points: &[(f64, f64)], manners: Manners) -> Crowd {
        Crowd::new(&[WalkedRoute { points: points.to_vec(), speed_mps: 1.0 }], manners)
    }

    /// Walks for a time in steps of 10 ms and returns where the person is.
    fn walked(crowd: &mut Crowd, seconds: f64, robots: &[Body]) -> (f64, f64) {
        for _ in 0..(seconds * 100.0) as u32 {
            crowd.walk_on(0.01, robots);
        }
        let body = crowd.bodies().next().expect("a person");
        (body.x_m, body.y_m)
    }

    #[track_caller]
    fn check(place: (f64, f64), expected: (f64, f64)) {
        let off_m = libm::hypot(expected.0 - place.0, expected.1 - place.1);
        assert!(off_m < 0.011, "{place:?}, expected {expected:?}");
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
        let robot = Body { x_m: 3.0, y_m: 0.0, radius_m: 0.18, kind: BodyKind::Robot };
        for (manners, stop_m) in [(Manners::Stop, 2.07), (Manners::Bump, 2.57)] {
            let mut crowd = crowd(&[(0.0, 0.0), (9.0, 0.0)], manners);
            check(walked(&mut crowd, 5.0, &[robot]), (stop_m, 0.0));
            check(walked(&mut crowd, 1.0, &[]), (stop_m + 1.0, 0.0));
        }
    }

    #[test]
    fn no_people_walk_if_none_are_wanted() {
        assert_eq!(crowd(&[(0.0, 0.0), (1.0, 0.0)], Manners::Absent).bodies().count(), 0);
    }
}
