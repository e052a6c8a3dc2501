//! Paths that sweep an area lane by lane, or go up and down along a line.

use thiserror::Error;

use crate::clearance::Clearance;
use crate::error::ShapeError;
use crate::map_point::MapPoint;
use crate::polygon::MapPolygon;
use crate::polyline::MapPolyline;
use crate::shift::{exact_sin_cos, offset_line};

/// The most points of a pattern: each becomes a point and a leg of a file.
pub const MAX_PATTERN_POINTS: usize = 1_000;

/// Why an area is not swept.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PatternError {
    /// A distance between lanes, or a width, that is none.
    #[error("{what} is {metres} m; it must be at least 0.01 m and finite")]
    Distance {
        /// Which one.
        what: &'static str,
        /// What was given.
        metres: f64,
    },
    /// A direction that is no number.
    #[error("the direction of the lanes must be a finite angle")]
    Direction,
    /// Nothing of the area is far enough from its boundary.
    #[error("nothing of the area is {inset_m} m from its boundary")]
    TooNarrow {
        /// The distance from the boundary.
        inset_m: f64,
    },
    /// A lane in this direction would leave the area and enter it again.
    #[error(
        "a lane in this direction leaves the area and enters it again: choose another direction, \
         or divide the area"
    )]
    Divided,
    /// More points than a pattern may have.
    #[error(
        "it would have {points} points, more than {MAX_PATTERN_POINTS}: put the lanes farther apart"
    )]
    TooManyPoints {
        /// How many.
        points: usize,
    },
    /// A line that cannot be offset.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

/// How an area is swept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurveyLanes {
    /// The largest distance between two lanes; the outer ones are half as far from the boundary.
    pub spacing_m: f64,
    /// The direction of the lanes, anticlockwise from x.
    pub direction_rad: f64,
    /// What every part of the path keeps from the boundary.
    pub inset: Clearance,
    /// Where the robot comes from: the pattern begins at the nearest of its four corners.
    pub from: Option<MapPoint>,
}

/// The points of a path that sweeps an area in parallel lanes, each in the opposite direction of the one
/// before (boustrophedon). The whole path lies within the area.
///
/// # Errors
/// If a lane would have to leave the area, the area is too narrow, or there are too many lanes.
pub fn sweep_area(area: &MapPolygon, lanes: SurveyLanes) -> Result<Vec<MapPoint>, PatternError> {
    check_distance("the distance between lanes", lanes.spacing_m)?;
    if !lanes.direction_rad.is_finite() {
        return Err(PatternError::Direction);
    }
    let (sin, cos) = exact_sin_cos(lanes.direction_rad);
    let turned = |point: &MapPoint| {
        let (x, y) = (point.x_m(), point.y_m());
        [x * cos + y * sin, y * cos - x * sin]
    };
    // In a frame in which lanes are horizontal.
    let corners: Vec<[f64; 2]> = area.corners().iter().map(turned).collect();
    let chains = Chains::of(&corners)?;
    let heights = lane_heights(&chains, lanes.spacing_m, lanes.inset.metres())?;
    let from = lanes.from.as_ref().map(turned);
    let mut best: Option<Vec<[f64; 2]>> = None;
    for (is_reversed, starts_right) in [(false, false), (false, true), (true, false), (true, true)]
    {
        let mut heights = heights.clone();
        if is_reversed {
            heights.reverse();
        }
        let path = chains.path(&heights, starts_right, lanes.inset.metres())?;
        let cost = |path: &[[f64; 2]]| {
            from.zip(path.first())
                .map_or(0.0, |(from, at)| (from[0] - at[0]).hypot(from[1] - at[1]))
        };
        if best.as_ref().is_none_or(|best| cost(&path) < cost(best)) {
            best = Some(path);
        }
    }
    let path = best.unwrap_or_default();
    let back = path.into_iter().map(|[x, y]| MapPoint::new(x * cos - y * sin, x * sin + y * cos));
    Ok(back.collect::<Result<_, _>>()?)
}

/// The points of a path that goes up and down along a line, in lanes that together cover a width around it.
///
/// # Errors
/// If the line is so bent that a lane next to it cannot be drawn, or there are too many points.
pub fn sweep_corridor(
    line: &MapPolyline,
    width_m: f64,
    spacing_m: f64,
) -> Result<Vec<MapPoint>, PatternError> {
    check_distance("the distance between lanes", spacing_m)?;
    check_distance("the width", width_m)?;
    // A width of three lanes is three lanes, although its quotient may be a little more.
    let count = (width_m / spacing_m - 1e-9).ceil().max(1.0);
    check_points(count * line.points().len() as f64)?;
    let apart_m = width_m / count;
    let mut path = Vec::new();
    for number in 0..count as usize {
        let left_m = (number as f64 - (count - 1.0) / 2.0) * apart_m;
        let mut lane = match left_m {
            0.0 => line.points().to_vec(),
            left_m => offset_line(line.points(), false, left_m)?,
        };
        if number % 2 == 1 {
            lane.reverse();
        }
        path.extend(lane);
    }
    Ok(path)
}

fn check_distance(what: &'static str, metres: f64) -> Result<(), PatternError> {
    // Written so that what is no number is refused.
    if metres >= 0.01 && metres.is_finite() {
        Ok(())
    } else {
        Err(PatternError::Distance { what, metres })
    }
}

fn check_points(points: f64) -> Result<(), PatternError> {
    if points > MAX_PATTERN_POINTS as f64 {
        return Err(PatternError::TooManyPoints { points: points as usize });
    }
    Ok(())
}

/// The heights of the lanes, from the lowest one up.
fn lane_heights(chains: &Chains, spacing_m: f64, inset_m: f64) -> Result<Vec<f64>, PatternError> {
    let [low, high] = chains.range();
    let edge_m = inset_m.max(spacing_m / 2.0);
    let between_m = high - low - 2.0 * edge_m;
    if high - low < 2.0 * inset_m {
        return Err(PatternError::TooNarrow { inset_m });
    }
    if between_m <= 0.0 {
        return Ok(vec![(low + high) / 2.0]);
    }
    let gaps = (between_m / spacing_m - 1e-9).ceil().max(1.0);
    check_points(2.0 * (gaps + 1.0))?;
    Ok((0..=gaps as usize).map(|n| low + edge_m + between_m * n as f64 / gaps).collect())
}

/// The left and the right side of an area of which every horizontal line has at most one piece: points from
/// the lowest to the highest.
struct Chains {
    sides: [Vec<[f64; 2]>; 2],
}

const LEFT: usize = 0;
const RIGHT: usize = 1;

impl Chains {
    fn of(corners: &[[f64; 2]]) -> Result<Self, PatternError> {
        let count = corners.len();
        let by_height = |one: &usize, other: &usize| {
            let (one, other) = (corners[*one], corners[*other]);
            one[1].total_cmp(&other[1]).then(one[0].total_cmp(&other[0]))
        };
        let (Some(lowest), Some(highest)) =
            ((0..count).min_by(by_height), (0..count).max_by(by_height))
        else {
            return Err(PatternError::Divided);
        };
        let walk = |step: usize| {
            let mut chain = vec![corners[lowest]];
            let mut at = lowest;
            while at != highest {
                at = (at + step) % count;
                chain.push(corners[at]);
            }
            chain
        };
        let mut sides = [walk(1), walk(count - 1)];
        let climbs = |chain: &Vec<[f64; 2]>| chain.windows(2).all(|pair| pair[0][1] <= pair[1][1]);
        if !sides.iter().all(climbs) {
            return Err(PatternError::Divided);
        }
        let middle = (corners[lowest][1] + corners[highest][1]) / 2.0;
        if reach(&sides[0], middle, middle, false) > reach(&sides[1], middle, middle, false) {
            sides.swap(LEFT, RIGHT);
        }
        // The level sides at the top and the bottom belong to neither: they would limit lanes that are as
        // far from them as the inset.
        let [left, right] = &mut sides;
        while left.len() > 2 && left[left.len() - 1][1] == left[left.len() - 2][1] {
            left.pop();
        }
        while right.len() > 2 && right[0][1] == right[1][1] {
            right.remove(0);
        }
        Ok(Self { sides })
    }

    fn range(&self) -> [f64; 2] {
        let side = &self.sides[LEFT];
        [side[0][1], side[side.len() - 1][1]]
    }

    /// How far a path may go to the left or right between two heights.
    fn limit(&self, side: usize, low: f64, high: f64, inset_m: f64) -> f64 {
        let [least, most] = self.range();
        let (low, high) = ((low - inset_m).max(least), (high + inset_m).min(most));
        match side {
            LEFT => reach(&self.sides[LEFT], low, high, true) + inset_m,
            _ => reach(&self.sides[RIGHT], low, high, false) - inset_m,
        }
    }

    /// The path along lanes at these heights.
    fn path(
        &self,
        heights: &[f64],
        starts_right: bool,
        inset_m: f64,
    ) -> Result<Vec<[f64; 2]>, PatternError> {
        let mut path: Vec<[f64; 2]> = Vec::new();
        for (number, height) in heights.iter().enumerate() {
            let goes_left = starts_right ^ (number % 2 == 1);
            let (first, last) = if goes_left { (RIGHT, LEFT) } else { (LEFT, RIGHT) };
            let mut ends = [first, last].map(|side| self.limit(side, *height, *height, inset_m));
            let [left, right] = if goes_left { [ends[1], ends[0]] } else { ends };
            if left > right {
                // Near an acute corner nothing of this height is far enough from the boundary.
                continue;
            }
            if let Some(before) = path.last().copied()
                && !self.is_within(before, [ends[0], *height], first, inset_m)
            {
                // Between the lanes the boundary comes nearer: both end where it is nearest.
                let (low, high) = (before[1].min(*height), before[1].max(*height));
                let limit = self.limit(first, low, high, inset_m);
                let is_beyond = if first == LEFT { limit > right } else { limit < left };
                if is_beyond {
                    return Err(PatternError::Divided);
                }
                ends[0] = limit;
                if let Some(last) = path.last_mut() {
                    last[0] = limit;
                }
            }
            path.extend(ends.map(|x| [x, *height]));
        }
        if path.is_empty() { Err(PatternError::TooNarrow { inset_m }) } else { Ok(path) }
    }

    /// Whether the connection of two lanes keeps its distance from the side that it is at.
    fn is_within(&self, from: [f64; 2], to: [f64; 2], side: usize, inset_m: f64) -> bool {
        let (low, high) = if from[1] <= to[1] { (from, to) } else { (to, from) };
        let x_at = |height: f64| {
            let share = ((height - low[1]) / (high[1] - low[1])).clamp(0.0, 1.0);
            low[0] + (high[0] - low[0]) * share
        };
        // The boundary within the inset of a height limits the connection there.
        let corners = self.sides[side].iter().map(|corner| corner[1]);
        let heights = corners.flat_map(|height| [height - inset_m, height, height + inset_m]);
        let heights = heights.filter(|height| (low[1]..=high[1]).contains(height));
        heights.chain([low[1], high[1]]).all(|height| {
            let limit = self.limit(side, height, height, inset_m);
            let x = x_at(height);
            if side == LEFT { x >= limit - 1e-9 } else { x <= limit + 1e-9 }
        })
    }
}

/// The largest or smallest x of a chain between two heights.
fn reach(chain: &[[f64; 2]], low: f64, high: f64, is_largest: bool) -> f64 {
    let at = |height: f64| {
        chain.windows(2).filter_map(move |pair| {
            let [from, to] = [pair[0], pair[1]];
            if !(from[1]..=to[1]).contains(&height) {
                return None;
            }
            let rise = to[1] - from[1];
            // Both ends of a level part: each is at this height.
            let share = if rise > 0.0 { (height - from[1]) / rise } else { 0.0 };
            Some(from[0] + (to[0] - from[0]) * share)
        })
    };
    let corners = chain.iter().filter(|corner| (low..=high).contains(&corner[1]));
    let all = corners.map(|corner| corner[0]).chain(at(low)).chain(at(high));
    if is_largest {
        all.fold(f64::NEG_INFINITY, f64::max)
    } else {
        all.fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests;
