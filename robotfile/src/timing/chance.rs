//! How probable it is that a limit is kept, and that two robots meet: the mission is computed many times,
//! each time with another speed for each drive.
//!
//! The mean speed of a drive is its speed times a factor with a triangular distribution: from 1 less the
//! tolerance of the route to 1 more it, most often near 1. Factors are independent of each other. The same
//! seed gives the same result on every host.

use std::num::NonZeroU32;

use crate::timing::course::CourseLimit;
use crate::timing::encounter::do_meet;
use crate::timing::extremes::{TimeWait, time_moments};
use crate::timing::motion::RobotMotion;
use crate::timing::preview::MissionPreview;

/// The draws that are usual: a share is then exact to 3 points of a hundred or better.
pub const CHANCE_DRAWS: NonZeroU32 = match NonZeroU32::new(1_000) {
    Some(draws) => draws,
    None => NonZeroU32::MIN,
};
/// 97.5 % of a normal distribution are below this many standard deviations: both sides leave 95 %.
const Z: f64 = 1.959_963_984_540_054;

/// How many times of many something has happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawnChance {
    /// How many times it has.
    pub count: u32,
    /// Of how many.
    pub draws: NonZeroU32,
}

impl DrawnChance {
    /// The share, from 0 to 1.
    pub fn share(self) -> f64 {
        f64::from(self.count) / f64::from(self.draws.get())
    }

    /// The interval that has the true share in 95 % of cases, from 0 to 1 (Wilson, "Probable inference, the
    /// law of succession, and statistical inference", Journal of the American Statistical Association 22,
    /// 1927).
    pub fn interval(self) -> [f64; 2] {
        let (share, draws) = (self.share(), f64::from(self.draws.get()));
        let weight = 1.0 / (1.0 + Z * Z / draws);
        let middle = weight * (share + Z * Z / (2.0 * draws));
        let spread = share * (1.0 - share) / draws + Z * Z / (4.0 * draws * draws);
        let half = weight * Z * spread.sqrt();
        let low = if self.count == 0 { 0.0 } else { (middle - half).max(0.0) };
        let high = if self.count == self.draws.get() { 1.0 } else { (middle + half).min(1.0) };
        [low, high]
    }
}

/// The chances of a mission, as it is drawn: after a limit that is missed, the robot continues.
#[derive(Clone, Debug, PartialEq)]
pub struct MissionChances {
    /// That each limit is kept, in the order of [`MissionPreview::limits`]; none where a time that it depends
    /// on is not known.
    pub limits: Vec<Option<DrawnChance>>,
    /// That all limits are kept; none if a chance is not known, or there is no limit.
    pub all: Option<DrawnChance>,
    /// That two robots come closer than their radii allow: their numbers, and of those that ever do.
    pub encounters: Vec<([usize; 2], DrawnChance)>,
}

/// Computes the chances of a mission. `is_cancelled` is asked before each draw; then there is no result.
pub(super) fn draw_chances(
    preview: &MissionPreview,
    seed: u64,
    draws: NonZeroU32,
    is_cancelled: &dyn Fn() -> bool,
) -> Option<MissionChances> {
    let pairs = preview.pairs_in_reach();
    let limits = preview.course_limits();
    let mut kept = vec![Some(0_u32); limits.len()];
    let (mut all_kept, mut met) = (0, vec![0_u32; pairs.len()]);
    let mut dice = Dice(seed);
    let tolerances = preview.tolerances();
    for _ in 0..draws.get() {
        if is_cancelled() {
            return None;
        }
        let factors: Vec<f64> = tolerances.iter().map(|it| dice.speed_factor(*it)).collect();
        let draw = Draw::new(preview, &factors);
        let mut are_all_kept = true;
        for (limit, kept) in limits.iter().zip(&mut kept) {
            match (draw.is_kept(limit), kept.as_mut()) {
                (Some(is_kept), Some(kept)) => {
                    *kept += u32::from(is_kept);
                    are_all_kept &= is_kept;
                }
                // What is known does not depend on the speeds.
                _ => *kept = None,
            }
        }
        all_kept += u32::from(are_all_kept);
        if !pairs.is_empty() {
            let motions = preview.list_motions(&draw.times);
            for (pair, met) in pairs.iter().zip(&mut met) {
                let both = pair.robots.map(|robot| &motions[robot]);
                *met += u32::from(do_meet(both, pair.reach_m));
            }
        }
    }
    let chance = |count| DrawnChance { count, draws };
    let is_known = !kept.is_empty() && kept.iter().all(Option::is_some);
    let met = pairs.iter().zip(met).filter(|(_, count)| *count > 0);
    Some(MissionChances {
        limits: kept.iter().map(|count| count.map(chance)).collect(),
        all: is_known.then_some(chance(all_kept)),
        encounters: met.map(|(pair, count)| (pair.robots, chance(count))).collect(),
    })
}

/// The mission with one speed for each drive.
struct Draw<'a> {
    preview: &'a MissionPreview,
    factors: &'a [f64],
    times: Vec<Option<i128>>,
}

impl<'a> Draw<'a> {
    fn new(preview: &'a MissionPreview, factors: &'a [f64]) -> Self {
        let duration = |moment, wait: &TimeWait| draw_duration(factors, moment, wait);
        let times = time_moments(&preview.anchors(), preview.order(), preview.waits(), duration);
        Self { preview, factors, times }
    }

    /// Whether a limit is kept. The time of a leg is known, too, where its begin is not.
    fn is_kept(&self, limit: &CourseLimit) -> Option<bool> {
        let waits = &self.preview.waits()[limit.to];
        let passed_ns = match (self.times[limit.from], self.times[limit.to], waits.as_slice()) {
            (Some(from), Some(to), _) => to - from,
            (_, _, [wait]) if wait.after == limit.from => {
                draw_duration(self.factors, limit.to, wait)?
            }
            _ => return None,
        };
        Some(passed_ns <= limit.at_most_ns)
    }
}

/// `factors` has one for each moment.
fn draw_duration(factors: &[f64], moment: usize, wait: &TimeWait) -> Option<i128> {
    let nominal_ns = wait.nominal_ns?;
    let factor = factors[moment];
    // What is no drive takes exactly its time.
    if factor == 1.0 {
        Some(nominal_ns)
    } else {
        Some((nominal_ns as f64 / factor).round() as i128)
    }
}

/// Random numbers: the generator SplitMix64 (Steele, Lea & Flood, "Fast splittable pseudorandom number
/// generators", OOPSLA 2014).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// At least 0, less than 1: the upper 53 bits.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The factor of a drive's speed; 1 without a tolerance. By the inverse of the distribution.
    fn speed_factor(&mut self, tolerance: Option<f64>) -> f64 {
        let Some(tolerance) = tolerance.filter(|tolerance| *tolerance > 0.0) else { return 1.0 };
        let share = self.share();
        match share < 0.5 {
            true => 1.0 - tolerance + tolerance * (2.0 * share).sqrt(),
            false => 1.0 + tolerance - tolerance * (2.0 * (1.0 - share)).sqrt(),
        }
    }
}

/// Two robots whose routes come closer than their radii allow, at whatever times.
pub(super) struct PairInReach {
    pub(super) robots: [usize; 2],
    pub(super) reach_m: f64,
}

/// Whether two routes come closer to each other than `reach_m`, by the rectangles around their pieces.
pub(super) fn are_in_reach(one: &RobotMotion, other: &RobotMotion, reach_m: f64) -> bool {
    let range = |a: f64, b: f64| (a.min(b), a.max(b));
    one.pieces.iter().any(|left| {
        let x = range(left.from.x_m(), left.to.x_m());
        let y = range(left.from.y_m(), left.to.y_m());
        other.pieces.iter().any(|right| {
            let near = |ours: (f64, f64), theirs: (f64, f64)| {
                ours.0 - reach_m <= theirs.1 && theirs.0 - reach_m <= ours.1
            };
            near(x, range(right.from.x_m(), right.to.x_m()))
                && near(y, range(right.from.y_m(), right.to.y_m()))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_wilsons() {
        let interval = |count, draws| {
            let chance = DrawnChance { count, draws: NonZeroU32::new(draws).expect("draws") };
            chance.interval().map(|share| (share * 1e4).round() / 1e4)
        };
        // Calculated by hand: 8 of 10 with z² = 3.8415.
        assert_eq!(interval(8, 10), [0.4902, 0.9433]);
        assert_eq!(interval(0, 1_000), [0.0, 0.0038]);
        assert_eq!(interval(1_000, 1_000), [0.9962, 1.0]);
        assert_eq!(interval(500, 1_000), [0.4691, 0.5309]);
    }

    #[test]
    fn factors_have_the_triangular_distribution() {
        let mut dice = Dice(19);
        let draws = 200_000;
        let factors: Vec<_> = (0..draws).map(|_| dice.speed_factor(Some(0.2))).collect();
        assert!(factors.iter().all(|factor| (0.8..=1.2).contains(factor)));
        // The share below 1 - 0.2 + x is x² / (2 · 0.2²) up to the middle.
        for (below, expected) in [(0.9, 0.125), (1.0, 0.5), (1.1, 0.875)] {
            let count = factors.iter().filter(|factor| **factor < below).count();
            assert!((count as f64 / f64::from(draws) - expected).abs() < 0.004, "{below} {count}");
        }
        assert_eq!(Dice(1).speed_factor(None), 1.0);
    }

    #[test]
    fn the_generator_is_that_of_the_paper() {
        let mut dice = Dice(1_234_567);
        let first = [dice.next(), dice.next(), dice.next()];
        let expected =
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!(first, expected);
    }
}
