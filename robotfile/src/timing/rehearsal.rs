//! A mission that was played, compared with its times: when each step ended, whether that was within its
//! earliest and latest time, and how good the prediction was.

use std::time::Duration;

use crate::drawn_route::{DrawnRoute, RouteStep};
use crate::mission::Mission;
use crate::route::{RoutePiece, divide_into_pieces, name_piece, name_wait};
use crate::timing::timetable::{StepTime, Timetable};

/// Times differ by this from what they would be on a clock without steps: a mission's clock may move in
/// steps of 0.1 s.
const CLOCK_STEP: Duration = Duration::from_millis(100);

/// A firing of the journal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JournalFiring {
    /// Mission time.
    pub at: Duration,
    /// The name of the transition; none of the start, of a failed component and of a retreat.
    pub transition: Option<String>,
    /// The places that it has taken tokens from.
    pub from: Vec<String>,
}

/// A mission that was played, step by step.
#[derive(Clone, Debug, PartialEq)]
pub struct Rehearsal {
    /// The steps, in the order of the timetable.
    pub steps: Vec<RehearsedStep>,
}

/// A step that was played.
#[derive(Clone, Debug, PartialEq)]
pub struct RehearsedStep {
    /// The route.
    pub route: String,
    /// The step, as the timetable names it.
    pub step: String,
    /// Whether it is a drive.
    pub is_leg: bool,
    /// The earliest time of its end.
    pub earliest: Option<Duration>,
    /// The time of its end at exactly the speeds of the file.
    pub nominal: Option<Duration>,
    /// The latest time of its end.
    pub latest: Option<Duration>,
    /// The time that it takes at exactly the speeds of the file.
    pub nominal_length: Option<Duration>,
    /// How it ended.
    pub end: RehearsedEnd,
    /// How long it took; none if it did not end as drawn.
    pub length: Option<Duration>,
}

/// How a step ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RehearsedEnd {
    /// As it is drawn, at this time.
    Done(Duration),
    /// Otherwise.
    Left {
        /// When.
        at: Duration,
        /// By which transition; none if the mission was given up for its safe place, or a component failed.
        by: Option<String>,
    },
    /// It did not begin, or had not ended when the mission was over.
    Open,
}

/// Where the end of a step is, compared with its earliest and latest time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepBounds {
    /// Between them, as far as they are known.
    Within,
    /// So much before the earliest time.
    Early(Duration),
    /// So much after the latest time.
    Late(Duration),
    /// It did not end as it is drawn.
    NotDone,
}

/// How wrong the predictions of legs were.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegError {
    /// How many legs were driven whose nominal time is known.
    pub legs: usize,
    /// The share by which the time of nine of ten legs differed from its prediction at most.
    pub p90: f64,
    /// The mean of the signed shares: positive if legs took longer than predicted.
    pub mean: f64,
}

impl RehearsedStep {
    /// Compares its end with its bounds.
    pub fn bounds(&self) -> StepBounds {
        let RehearsedEnd::Done(at) = self.end else { return StepBounds::NotDone };
        if let Some(earliest) = self.earliest.filter(|earliest| at + CLOCK_STEP < *earliest) {
            return StepBounds::Early(earliest - at);
        }
        match self.latest.filter(|latest| *latest + CLOCK_STEP < at) {
            Some(latest) => StepBounds::Late(at - latest),
            None => StepBounds::Within,
        }
    }

    /// By which share of its nominal time its end was later; negative if earlier.
    pub fn difference(&self) -> Option<f64> {
        let RehearsedEnd::Done(at) = self.end else { return None };
        share(at, self.nominal?)
    }

    /// By which share of its nominal length it took longer; negative if shorter.
    pub fn length_difference(&self) -> Option<f64> {
        share(self.length?, self.nominal_length?)
    }
}

fn share(driven: Duration, nominal: Duration) -> Option<f64> {
    let nominal_s = nominal.as_secs_f64();
    (nominal_s > 0.0).then(|| driven.as_secs_f64() / nominal_s - 1.0)
}

impl Rehearsal {
    /// Compares the firings of a journal, in their order, with the times of the mission.
    pub fn compare(mission: &Mission, table: &Timetable, firings: &[JournalFiring]) -> Self {
        let mut steps = Vec::new();
        let mut predicted = table.steps.iter();
        for route in &mission.routes {
            let pieces = divide_into_pieces(route, mission.map.as_ref());
            let mut before = find_begin(route, &pieces, firings);
            let mut nominal_before = Some(Duration::ZERO);
            for piece in &pieces {
                let Some(step) = predicted.next() else { break };
                let end = find_end(route, piece, firings);
                let length = match (before, &end) {
                    (Some(before), RehearsedEnd::Done(at)) => Some(at.saturating_sub(before)),
                    _ => None,
                };
                let nominal_length = step
                    .nominal
                    .zip(nominal_before)
                    .map(|(nominal, before)| nominal.saturating_sub(before));
                let is_leg = matches!(route.steps[piece.step], RouteStep::Leg(_));
                before = match end {
                    RehearsedEnd::Done(at) => Some(at),
                    _ => None,
                };
                nominal_before = step.nominal;
                let StepTime { route, step: name, earliest, nominal, latest, .. } = step.clone();
                steps.push(RehearsedStep {
                    route,
                    step: name,
                    is_leg,
                    earliest,
                    nominal,
                    latest,
                    nominal_length,
                    end,
                    length,
                });
            }
        }
        Self { steps }
    }

    /// The steps whose end was not within its bounds.
    pub fn list_outside(&self) -> impl Iterator<Item = &RehearsedStep> {
        self.steps.iter().filter(|step| step.bounds() != StepBounds::Within)
    }

    /// How wrong the predictions of its legs were; none without a leg that was driven.
    pub fn leg_error(&self) -> Option<LegError> {
        let legs = self.steps.iter().filter(|step| step.is_leg);
        LegError::of_shares(legs.filter_map(RehearsedStep::length_difference).collect())
    }

    /// Of each route, by which share the time that remained at half of its nominal time was longer than
    /// predicted there: from the step that ended next to that time, with the nominal times of what follows
    /// stretched as the steps before were.
    pub fn half_way_errors(&self) -> Vec<f64> {
        let mut errors = Vec::new();
        for steps in self.steps.chunk_by(|one, other| one.route == other.route) {
            let ends: Option<Vec<_>> = steps
                .iter()
                .map(|step| match step.end {
                    RehearsedEnd::Done(at) => Some((at.as_secs_f64(), step.nominal?.as_secs_f64())),
                    _ => None,
                })
                .collect();
            let Some(ends) = ends.filter(|ends| ends.len() > 1) else { continue };
            let Some(&(end_s, nominal_end_s)) = ends.last() else { continue };
            let from_half_s = |end: &&(f64, f64)| (end.1 - nominal_end_s / 2.0).abs();
            let before_last = ends[..ends.len() - 1].iter();
            let half = before_last.min_by(|a, b| from_half_s(a).total_cmp(&from_half_s(b)));
            let Some(&(at_s, nominal_s)) = half.filter(|half| half.1 > 0.0) else { continue };
            let predicted_s = (nominal_end_s - nominal_s) * at_s / nominal_s;
            if predicted_s > 0.0 {
                errors.push((end_s - at_s) / predicted_s - 1.0);
            }
        }
        errors
    }
}

impl LegError {
    /// Of the shares by which legs took longer than predicted; none without any.
    pub fn of_shares(shares: Vec<f64>) -> Option<Self> {
        let mut sizes: Vec<f64> = shares.iter().map(|share| share.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // The nearest rank: the smallest that nine of ten are not above.
        let rank = (sizes.len() * 9).div_ceil(10);
        let p90 = *sizes.get(rank.checked_sub(1)?)?;
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        Some(Self { legs: shares.len(), p90, mean })
    }
}

/// When the route began: when its first step did, which is the start of the mission unless a place leads to
/// it.
fn find_begin(
    route: &DrawnRoute,
    pieces: &[RoutePiece<'_>],
    firings: &[JournalFiring],
) -> Option<Duration> {
    pieces.first()?;
    if route.enter.is_none() {
        return Some(Duration::ZERO);
    }
    let begin = format!("{}.begin", route.name.value);
    firings.iter().find(|firing| firing.transition.as_ref() == Some(&begin)).map(|it| it.at)
}

/// The last firing that took the token from a piece decides: an operator may have resumed it.
fn find_end(route: &DrawnRoute, piece: &RoutePiece<'_>, firings: &[JournalFiring]) -> RehearsedEnd {
    let here = name_piece(route, piece).value;
    let waits = piece.ends_at.map(|line| format!("{here}.{}", name_wait(line)));
    let reached = format!("{here}.reached");
    let is_here = |place: &String| *place == here || waits.as_ref() == Some(place);
    let mut leaves = firings.iter().filter(|firing| {
        // At a phase line the piece is not over.
        firing.from.iter().any(is_here) && firing.transition.as_ref() != Some(&reached)
    });
    let Some(last) = leaves.next_back() else { return RehearsedEnd::Open };
    let ends = |transition: &String| match (&route.steps[piece.step], &waits) {
        (RouteStep::Leg(_), Some(waits)) => *transition == format!("{waits}.crosses"),
        (RouteStep::Leg(_), None) => *transition == format!("{here}.done"),
        (RouteStep::Stay(_), _) => {
            *transition == format!("{here}.done") || *transition == format!("{here}.over")
        }
        // It is named after the step of the route that is drawn first.
        (RouteStep::Meet(_), _) => transition.ends_with(".met"),
    };
    match &last.transition {
        Some(transition) if ends(transition) => RehearsedEnd::Done(last.at),
        by => RehearsedEnd::Left { at: last.at, by: by.clone() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(nominal_s: u64, end: RehearsedEnd) -> RehearsedStep {
        let time = |s| Some(Duration::from_secs(s));
        RehearsedStep {
            route: "red".into(),
            step: "l1".into(),
            is_leg: true,
            earliest: time(nominal_s - 2),
            nominal: time(nominal_s),
            latest: time(nominal_s + 2),
            nominal_length: time(nominal_s),
            end,
            length: None,
        }
    }

    fn done(ms: u64) -> RehearsedEnd {
        RehearsedEnd::Done(Duration::from_millis(ms))
    }

    #[test]
    fn an_end_is_within_its_bounds_up_to_a_step_of_the_clock() {
        let bounds = |ms| step(10, done(ms)).bounds();
        assert_eq!([bounds(7_900), bounds(10_000), bounds(12_100)], [StepBounds::Within; 3]);
        assert_eq!(bounds(7_800), StepBounds::Early(Duration::from_millis(200)));
        assert_eq!(bounds(13_000), StepBounds::Late(Duration::from_secs(1)));
        assert_eq!(step(10, RehearsedEnd::Open).bounds(), StepBounds::NotDone);
        let difference = step(10, done(11_000)).difference().expect("it has ended");
        assert!((difference - 0.1).abs() < 1e-9, "{difference}");
    }

    #[test]
    fn nine_of_ten_legs_are_at_most_as_wrong() {
        let shares: Vec<_> = (1..=20).map(|number| f64::from(number) / -100.0).collect();
        let error = LegError::of_shares(shares).expect("twenty legs");
        assert!((error.p90 - 0.18).abs() < 1e-9 && (error.mean + 0.105).abs() < 1e-9, "{error:?}");
        assert_eq!(LegError::of_shares(Vec::new()), None);
        assert_eq!(LegError::of_shares(vec![0.5]).map(|error| error.p90), Some(0.5));
    }

    #[test]
    fn what_remains_at_half_way_is_stretched_as_what_was_driven() {
        // Half way is nearest to 11 s of 20, which took 22 s: 9 s more should take 18 s, and took 9 s.
        let steps = vec![step(4, done(4_000)), step(11, done(22_000)), step(20, done(31_000))];
        let errors = Rehearsal { steps }.half_way_errors();
        assert!(errors.len() == 1 && (errors[0] + 0.5).abs() < 1e-9, "{errors:?}");
        let steps = vec![step(4, done(4_000)), step(11, RehearsedEnd::Open)];
        assert!(Rehearsal { steps }.half_way_errors().is_empty(), "it has not ended");
    }
}
