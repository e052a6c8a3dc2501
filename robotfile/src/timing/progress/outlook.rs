//! From what is observed to the progress: which pieces are done, what is left of the present one, and when
//! the others end. Robots wait for each other at meetings, so all routes are computed together.

use armor_geo::{MapPoint, MapSegment};

use crate::date::Date;
use crate::timing::nearby::{distance_from_m, find_zones};
use crate::timing::progress::followed::{FollowedMission, FollowedPiece, FollowedRoute, PieceWork};
use crate::timing::progress::{
    LimitOutlook, MissionSighting, RobotSighting, RouteProgress, RouteStand, StepProgress,
    StepStand,
};

/// A pace is taken from drives that should have taken at least this long together, in seconds.
const LEAST_COMPARED_S: f64 = 2.0;
/// Drives count as at most this many times as slow, or as fast, as they should be.
const MOST_STRETCH: f64 = 5.0;
/// A published path is one of the present leg if it ends this near its point, in metres.
const PATH_END_M: f64 = 1.0;

/// Where a route stands.
struct Standing {
    stand: RouteStand,
    /// The piece that is under way; the number of all pieces if the route has ended.
    piece: usize,
    /// Whether the robot has arrived at the end of the piece, and waits for a date.
    has_arrived: bool,
    /// When each piece began last, and when it ended.
    begun_s: Vec<Option<f64>>,
    ended_s: Vec<Option<f64>>,
}

/// What is left of the present piece.
#[derive(Default)]
struct Rest {
    left_m: Option<f64>,
    /// The time of the file for it.
    drive_s: Option<f64>,
}

/// From which piece on a route continues, and when.
struct Continuation {
    piece: usize,
    /// When; none if that is not known.
    from_s: Option<f64>,
    /// How long the rest of this piece takes, if it is not the whole.
    first_s: Option<Option<f64>>,
    stretch: f64,
}

impl FollowedMission {
    /// How far each route has come.
    pub fn progress(&self, seen: &MissionSighting<'_>) -> Vec<RouteProgress> {
        let standings: Vec<_> = self.routes.iter().map(|route| stand_of(route, seen)).collect();
        let unseen = RobotSighting::default();
        let robots: Vec<_> = (0..self.routes.len())
            .map(|number| seen.robots.get(number).unwrap_or(&unseen))
            .collect();
        let mut rests = Vec::new();
        let mut continuations = Vec::new();
        for ((route, standing), robot) in self.routes.iter().zip(&standings).zip(&robots) {
            let rest = self.rest_of(route, standing, robot);
            let stretch = stretch_of(route, standing, &rest, seen);
            continuations.push(continue_from(route, standing, &rest, stretch, seen));
            rests.push(rest);
        }
        let expected = self.ends_from(&continuations, seen);
        let nominal: Vec<_> = self
            .routes
            .iter()
            .zip(&standings)
            .map(|(route, standing)| {
                let from_s = route
                    .drawn
                    .enter
                    .as_ref()
                    .map_or(Some(0.0), |_| standing.begun_s.first().copied().flatten());
                Continuation { piece: 0, from_s, first_s: None, stretch: 1.0 }
            })
            .collect();
        let nominal = self.ends_from(&nominal, seen);
        let all = self.routes.iter().enumerate();
        all.map(|(number, route)| {
            let standing = &standings[number];
            let ends = (expected[number].as_slice(), nominal[number].as_slice());
            let mut progress = RouteProgress {
                route: route.drawn.name.value.clone(),
                stand: standing.stand.clone(),
                steps: steps_of(route, standing, ends, seen),
                current: (standing.piece < route.pieces.len()
                    && standing.stand != RouteStand::Waiting
                    && standing.stand != RouteStand::Left)
                    .then_some(standing.piece),
                done_m: 0.0,
                total_m: 0.0,
                left_m: rests[number].left_m,
                off_leg_m: None,
                speed_mps: None,
                stretch: continuations[number].stretch,
                zones: Vec::new(),
            };
            add_distances(&mut progress, route, standing, robots[number], seen);
            if let (Some(map), Some(at)) = (&self.map, robots[number].at) {
                progress.zones = find_zones(map, at, route.radius_m);
            }
            progress
        })
        .collect()
    }

    fn rest_of(&self, route: &FollowedRoute, standing: &Standing, robot: &RobotSighting) -> Rest {
        let piece = route.pieces.get(standing.piece);
        let Some(piece) = piece.filter(|_| standing.stand == RouteStand::Underway) else {
            return Rest::default();
        };
        if !matches!(piece.work, PieceWork::Drive(_)) {
            return Rest::default();
        }
        if standing.has_arrived {
            return Rest { left_m: Some(0.0), drive_s: Some(0.0) };
        }
        let (Some(at), Some(to)) = (robot.at, piece.to) else { return Rest::default() };
        let straight_m = at.distance_m(to);
        let left_m = path_left_m(&robot.path, at, to).unwrap_or(straight_m).max(straight_m);
        let straight_s = route.drive_s(piece, at, self.map.as_ref());
        let longer = if straight_m > 0.0 { left_m / straight_m } else { 1.0 };
        Rest { left_m: Some(left_m), drive_s: straight_s.map(|straight_s| straight_s * longer) }
    }

    /// When the pieces of each route end, from where it continues; none of those before and where it is
    /// not known.
    fn ends_from(
        &self,
        continuations: &[Continuation],
        seen: &MissionSighting<'_>,
    ) -> Vec<Vec<Option<f64>>> {
        let mut ends: Vec<_> =
            self.routes.iter().map(|route| vec![None; route.pieces.len()]).collect();
        // Each round brings at least one more meeting.
        let is_meeting = |piece: &&FollowedPiece| matches!(piece.work, PieceWork::Meet(_));
        let rounds = self.routes.iter().flat_map(|route| &route.pieces).filter(is_meeting).count();
        for _ in 0..=rounds {
            let before = ends.clone();
            for (number, route) in self.routes.iter().enumerate() {
                ends[number] = ends_of(route, &continuations[number], &before, continuations, seen);
            }
            if ends == before {
                break;
            }
        }
        ends
    }
}

fn stand_of(route: &FollowedRoute, seen: &MissionSighting<'_>) -> Standing {
    let last_of = |names: &[String]| {
        let fired = seen.fired.iter().rev().find(|(name, _)| names.iter().any(|it| it == name));
        fired.map(|fired| fired.1)
    };
    let pieces = &route.pieces;
    let begun_s: Vec<_> = pieces
        .iter()
        .map(|piece| last_of(&piece.begins).or(piece.is_initial.then_some(0.0)))
        .collect();
    let ended_s: Vec<_> = pieces.iter().map(|piece| last_of(&piece.ends)).collect();
    let mut standing =
        Standing { stand: RouteStand::Waiting, piece: 0, has_arrived: false, begun_s, ended_s };
    // The longest name: that of a part behind a line begins with that of the leg.
    let of_piece = |piece: &FollowedPiece, place: &str| {
        place == piece.place
            || place.strip_prefix(piece.place.as_str()).is_some_and(|rest| rest.starts_with('.'))
    };
    let of_route = |place: &&&str| {
        let rest = place.strip_prefix(route.drawn.name.value.as_str());
        rest.is_some_and(|rest| rest.starts_with('.'))
    };
    let marked = seen.places.iter().filter(of_route).filter_map(|place| {
        let found = pieces.iter().enumerate().filter(|(_, piece)| of_piece(piece, place));
        let (number, piece) = found.max_by_key(|(_, piece)| piece.place.len())?;
        Some((number, piece, *place))
    });
    if let Some((number, piece, place)) = marked.max_by_key(|it| it.0) {
        standing.piece = number;
        // The place of a detour from a phase line has the names of both.
        let is_own = place == piece.place;
        let rest = place.rsplit('.').next().filter(|_| !is_own).unwrap_or_default();
        standing.has_arrived = piece.waits_in.as_deref() == Some(place);
        standing.stand = match (rest.strip_prefix("to-"), rest.strip_prefix("at-")) {
            (Some(point), _) => RouteStand::Detour { point: point.to_owned(), is_there: false },
            (_, Some(point)) if !standing.has_arrived => {
                RouteStand::Detour { point: point.to_owned(), is_there: true }
            }
            _ => RouteStand::Underway,
        };
        return standing;
    }
    let last = pieces.len().checked_sub(1);
    if last.is_some_and(|last| standing.ended_s[last].is_some()) {
        (standing.stand, standing.piece) = (RouteStand::Ended, pieces.len());
    } else if let Some(last) = standing.begun_s.iter().rposition(Option::is_some)
        && (!seen.places.is_empty() || !seen.fired.is_empty())
    {
        (standing.stand, standing.piece) = (RouteStand::Left, last);
    }
    standing
}

/// How much longer drives take than they should.
fn stretch_of(
    route: &FollowedRoute,
    standing: &Standing,
    rest: &Rest,
    seen: &MissionSighting<'_>,
) -> f64 {
    let (mut taken_s, mut planned_s) = (0.0, 0.0);
    for (number, piece) in route.pieces.iter().enumerate().take(standing.piece + 1) {
        let PieceWork::Drive(Some(whole_s)) = piece.work else { continue };
        let Some(begun_s) = standing.begun_s[number] else { continue };
        if number < standing.piece {
            // The end of a wait for a date is not the end of the drive.
            let ended_s = standing.ended_s[number].filter(|_| piece.not_before.is_none());
            if let Some(ended_s) = ended_s.filter(|ended_s| *ended_s >= begun_s) {
                taken_s += seen.moved_s(begun_s, ended_s);
                planned_s += whole_s;
            }
        } else if let Some(left_s) = rest.drive_s.filter(|_| !standing.has_arrived) {
            let done_s = whole_s - left_s;
            if done_s >= LEAST_COMPARED_S {
                taken_s += seen.moved_s(begun_s, seen.now_s);
                planned_s += done_s;
            }
        }
    }
    if planned_s < LEAST_COMPARED_S {
        return 1.0;
    }
    (taken_s / planned_s).clamp(1.0 / MOST_STRETCH, MOST_STRETCH)
}

fn continue_from(
    route: &FollowedRoute,
    standing: &Standing,
    rest: &Rest,
    stretch: f64,
    seen: &MissionSighting<'_>,
) -> Continuation {
    let (piece, now_s) = (standing.piece, seen.now_s);
    let whole = |from_s| Continuation { piece, from_s, first_s: None, stretch };
    match standing.stand {
        // When the place that begins it gets its token is not known.
        RouteStand::Waiting if route.drawn.enter.is_some() => whole(None),
        RouteStand::Waiting => whole(Some(now_s)),
        RouteStand::Underway => {
            let begun_s = standing.begun_s[piece];
            let first_s = match route.pieces[piece].work {
                PieceWork::Drive(_) => rest.drive_s,
                PieceWork::Stay(time) => time.map(|time_s| {
                    let since_s = begun_s.map_or(0.0, |begun_s| seen.moved_s(begun_s, now_s));
                    (time_s - since_s).max(0.0)
                }),
                PieceWork::Meet(_) => Some(0.0),
            };
            Continuation { piece, from_s: Some(now_s), first_s: Some(first_s), stretch }
        }
        // An operator decides when, and whether, it is resumed.
        RouteStand::Detour { .. } | RouteStand::Ended | RouteStand::Left => whole(None),
    }
}

fn ends_of(
    route: &FollowedRoute,
    continuation: &Continuation,
    others: &[Vec<Option<f64>>],
    continuations: &[Continuation],
    seen: &MissionSighting<'_>,
) -> Vec<Option<f64>> {
    let mut ends = vec![None; route.pieces.len()];
    let mut at_s = continuation.from_s;
    for (number, piece) in route.pieces.iter().enumerate().skip(continuation.piece) {
        let rest_s = continuation.first_s.filter(|_| number == continuation.piece);
        at_s = at_s.and_then(|from_s| match piece.work {
            PieceWork::Drive(whole_s) => {
                Some(from_s + rest_s.unwrap_or(whole_s)? * continuation.stretch)
            }
            PieceWork::Stay(whole_s) => Some(from_s + rest_s.unwrap_or(whole_s)?),
            PieceWork::Meet(with) => {
                let [other, piece] = with?;
                let theirs = &continuations[other];
                let there_s = match piece.checked_sub(1) {
                    Some(before) if piece > theirs.piece => others[other][before],
                    _ => theirs.from_s,
                };
                Some(from_s.max(there_s?))
            }
        });
        if let Some(date) = piece.not_before {
            at_s = at_s.zip(seen.time_of(date)).map(|(at_s, date_s)| at_s.max(date_s));
        }
        ends[number] = at_s;
    }
    ends
}

fn steps_of(
    route: &FollowedRoute,
    standing: &Standing,
    (expected, nominal): (&[Option<f64>], &[Option<f64>]),
    seen: &MissionSighting<'_>,
) -> Vec<StepProgress> {
    let pieces = route.pieces.iter().enumerate();
    pieces
        .map(|(number, piece)| {
            let is_begun = standing.stand != RouteStand::Waiting;
            let is_left = standing.stand == RouteStand::Left;
            let stand = match number.cmp(&standing.piece) {
                std::cmp::Ordering::Less => StepStand::Done,
                std::cmp::Ordering::Equal if is_begun && !is_left => StepStand::Current,
                _ => StepStand::Coming,
            };
            let end_s = match stand {
                StepStand::Done => standing.ended_s[number],
                StepStand::Current | StepStand::Coming => expected[number],
            };
            let begins_s = match stand {
                StepStand::Done => None,
                StepStand::Current => standing.begun_s[number],
                StepStand::Coming => number.checked_sub(1).and_then(|before| expected[before]),
            };
            StepProgress {
                step: piece.label.clone(),
                stand,
                ends_at: [piece.from, piece.to],
                end_s,
                nominal_s: nominal[number],
                limit: limit_of(piece, stand, begins_s, end_s, seen),
            }
        })
        .collect()
}

/// The limit that is over first.
fn limit_of(
    piece: &FollowedPiece,
    stand: StepStand,
    begins_s: Option<f64>,
    end_s: Option<f64>,
    seen: &MissionSighting<'_>,
) -> Option<LimitOutlook> {
    if stand == StepStand::Done {
        return None;
    }
    let by = piece.by.as_ref().zip(begins_s).map(|((time_s, words), begins_s)| {
        // Its clock stands during a pause.
        let stood_s = (seen.now_s - begins_s).max(0.0) - seen.moved_s(begins_s, seen.now_s);
        (begins_s + time_s + stood_s, words.clone())
    });
    let date =
        piece.not_after.and_then(|date| Some((seen.time_of(date)?, format!("not after {date}"))));
    let (at_s, words) =
        by.into_iter().chain(date).min_by(|one, other| one.0.total_cmp(&other.0))?;
    Some(LimitOutlook { words, at_s, left_s: end_s.map(|end_s| at_s - end_s) })
}

fn add_distances(
    progress: &mut RouteProgress,
    route: &FollowedRoute,
    standing: &Standing,
    robot: &RobotSighting,
    seen: &MissionSighting<'_>,
) {
    for (number, piece) in route.pieces.iter().enumerate() {
        let (Some(from), Some(to), PieceWork::Drive(_)) = (piece.from, piece.to, piece.work) else {
            continue;
        };
        let leg = MapSegment::new(from, to);
        progress.total_m += leg.length_m();
        if number < standing.piece {
            progress.done_m += leg.length_m();
        }
        if progress.current != Some(number) || standing.stand != RouteStand::Underway {
            continue;
        }
        let Some(at) = robot.at else { continue };
        let done_m = if standing.has_arrived {
            leg.length_m()
        } else {
            leg.length_m() * leg.share_nearest_to(at)
        };
        progress.done_m += done_m;
        progress.off_leg_m = Some(distance_from_m(leg, at));
        let since_s = standing.begun_s[number].map(|begun_s| seen.moved_s(begun_s, seen.now_s));
        progress.speed_mps = since_s
            .filter(|since_s| *since_s > 0.0 && !standing.has_arrived)
            .map(|since_s| done_m / since_s);
    }
}

/// What is left of a path that leads to a point: from where it is nearest to the robot.
fn path_left_m(path: &[MapPoint], at: MapPoint, to: MapPoint) -> Option<f64> {
    let end = path.last().filter(|end| end.distance_m(to) <= PATH_END_M)?;
    let pieces = path.iter().zip(path.iter().skip(1));
    let pieces: Vec<_> = pieces.map(|(one, other)| MapSegment::new(*one, *other)).collect();
    let apart_m = |piece: &MapSegment| distance_from_m(*piece, at);
    let (number, nearest) = pieces
        .iter()
        .enumerate()
        .min_by(|one, other| apart_m(one.1).total_cmp(&apart_m(other.1)))?;
    let from = nearest.point_at(nearest.share_nearest_to(at));
    let rest_m: f64 = pieces[number + 1..].iter().map(|piece| piece.length_m()).sum();
    Some(at.distance_m(from) + from.distance_m(nearest.end()) + rest_m + end.distance_m(to))
}

impl MissionSighting<'_> {
    /// The seconds between two times in which the mission did not stand still.
    fn moved_s(&self, from_s: f64, to_s: f64) -> f64 {
        let stood = self
            .pauses
            .iter()
            .map(|[begin_s, end_s]| (end_s.min(to_s) - begin_s.max(from_s)).max(0.0));
        (to_s - from_s - stood.sum::<f64>()).max(0.0)
    }

    /// Mission time at a date.
    fn time_of(&self, date: Date) -> Option<f64> {
        let utc = self.utc?;
        let apart_s = (date.since_1970_ns() - utc.since_1970_ns()) as f64 / 1e9;
        Some(self.now_s + apart_s)
    }
}
