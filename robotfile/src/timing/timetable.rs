//! The times of a mission's steps, and what is wrong with them.

use std::time::Duration;

use crate::date::Date;
use crate::mission::Mission;
use crate::model::System;
use crate::source::Location;
use crate::timing::course::{BEGIN, Course, CourseLimit, DATES};
use crate::timing::drive::DriveLengths;
use crate::timing::extremes::{least_after, most_after, sort_moments, time_moments};
use crate::timing::network::{TimeBound, find_negative_cycle};

/// Long before every moment, in nanoseconds.
const LONG_BEFORE_NS: i128 = -(1 << 100);

/// When the steps of a mission's routes end, as they are drawn: no step ends early.
#[derive(Clone, Debug, Default)]
pub struct Timetable {
    /// The ends of the steps, in the order of the file.
    pub steps: Vec<StepTime>,
    /// The latest date at which the mission may begin so that every date is kept, even at the slowest;
    /// none if no date depends on it.
    pub begin_by: Option<Date>,
    pub(crate) conflict: Option<TimeConflict>,
    pub(crate) circle: Vec<(String, Location)>,
    pub(crate) shortages: Vec<TimeShortage>,
}

/// When a step of a route ends: from the begin of the mission.
#[derive(Clone, Debug)]
pub struct StepTime {
    /// The route.
    pub route: String,
    /// The step: `l1`, or `l1 to green` for the part of a leg up to a phase line.
    pub step: String,
    /// The earliest time.
    pub earliest: Option<Duration>,
    /// The time at exactly the speeds of the file; none where there is no latest time.
    pub nominal: Option<Duration>,
    /// The latest time; none if something without a longest time comes before.
    pub latest: Option<Duration>,
    /// Its limits.
    pub limits: Vec<StepLimit>,
}

/// A limit of a step.
#[derive(Clone, Debug)]
pub struct StepLimit {
    /// `by 1 min`, `not after 2026-…`, `patience 9 s`.
    pub words: String,
    /// How much time is left at the slowest, in nanoseconds; negative if it may be missed, none if this is
    /// not known.
    pub slack_ns: Option<i128>,
}

/// Limits that cannot be kept together.
#[derive(Clone, Debug)]
pub(crate) struct TimeConflict {
    /// What excludes each other: each in words, and where it is drawn.
    pub(crate) parts: Vec<(String, Location)>,
    /// By how much.
    pub(crate) excess_ns: i128,
    /// The number of the part that is a limit.
    pub(crate) limit: usize,
}

/// A limit that may be missed.
#[derive(Clone, Debug)]
pub(crate) struct TimeShortage {
    /// `red.l1`.
    pub(crate) step: String,
    /// The limit in words.
    pub(crate) words: String,
    /// How much time is missing at the slowest.
    pub(crate) lacking_ns: i128,
    /// Where the limit is.
    pub(crate) at: Location,
    /// Where the step is.
    pub(crate) step_at: Location,
}

impl Timetable {
    /// Of a mission; with the date at which it begins, if this is known.
    pub fn of_mission(
        mission: &Mission,
        system: &System,
        lengths: &dyn DriveLengths,
        begin: Option<Date>,
    ) -> Self {
        let course = Course::of_mission(mission, system, lengths, begin);
        let order = match sort_moments(&course.waits) {
            Ok(order) => order,
            Err(circle) => {
                return Self { circle: name_circle(&course, &circle), ..Self::default() };
            }
        };
        let mut table = Self { conflict: find_conflict(&course), ..Self::default() };
        let times = CourseTimes::new(&course, &order, begin);
        let slacks: Vec<_> = course.limits.iter().map(|limit| times.slack_ns(limit)).collect();
        for (number, end) in course.ends.iter().enumerate() {
            let own = course.limits.iter().zip(&slacks).filter(|(limit, _)| limit.end == number);
            table.steps.push(StepTime {
                route: end.route.clone(),
                step: end.step.clone(),
                earliest: times.earliest[end.moment].and_then(as_duration),
                nominal: times.nominal[end.moment].and_then(as_duration),
                latest: times.latest[end.moment].and_then(as_duration),
                limits: own
                    .map(|(limit, slack_ns)| StepLimit {
                        words: limit.words.clone(),
                        slack_ns: *slack_ns,
                    })
                    .collect(),
            });
        }
        if table.conflict.is_none() {
            for (limit, slack_ns) in course.limits.iter().zip(&slacks) {
                let Some(slack_ns) = slack_ns.filter(|slack_ns| *slack_ns < 0) else { continue };
                let end = &course.ends[limit.end];
                table.shortages.push(TimeShortage {
                    step: format!("{}.{}", end.route, end.step),
                    words: limit.words.clone(),
                    lacking_ns: -slack_ns,
                    at: limit.at.clone(),
                    step_at: end.at.clone(),
                });
            }
            if begin.is_none() {
                let by = course.limits.iter().filter_map(|limit| times.begin_by_ns(limit)).min();
                table.begin_by = by.map(Date::after_1970_ns);
            }
        }
        table
    }

    /// Returns whether there is no route.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// The meetings that wait for each other in a circle; none if there are none.
    pub fn circle(&self) -> impl Iterator<Item = &str> {
        self.circle.iter().map(|(name, _)| name.as_str())
    }
}

/// The steps of a circle of waits, without those that only lead from one meeting to the next.
fn name_circle(course: &Course, circle: &[usize]) -> Vec<(String, Location)> {
    let is_of = |moment: usize| course.ends.iter().filter(move |end| end.moment == moment);
    let mut named = Vec::new();
    for moment in circle {
        let mut ends = is_of(*moment);
        // Both routes of a meeting have its moment.
        if let (Some(one), Some(other)) = (ends.next(), ends.next()) {
            let name = format!("{}.{} with {}.{}", one.route, one.step, other.route, other.step);
            named.push((name, one.at.clone()));
        }
    }
    named
}

/// All bounds as a simple temporal network.
fn find_conflict(course: &Course) -> Option<TimeConflict> {
    let (mut bounds, mut parts, mut limits) = (Vec::new(), Vec::new(), Vec::new());
    for (moment, (waits, reasons)) in course.waits.iter().zip(&course.reasons).enumerate() {
        for (wait, reason) in waits.iter().zip(reasons) {
            let (from, to) = (moment, wait.after);
            bounds.push(TimeBound { from, to, at_most_ns: -wait.least_ns });
            parts.push((
                reason.describe_least(wait.least_ns),
                reason.at.clone(),
                wait.least_ns == 0,
            ));
            // A robot that waits for one thing only does not delay.
            if let (Some(at_most_ns), [_]) = (wait.most_ns, waits.as_slice()) {
                let (from, to) = (wait.after, moment);
                bounds.push(TimeBound { from, to, at_most_ns });
                parts.push((reason.describe_most(at_most_ns), reason.at.clone(), at_most_ns == 0));
            }
        }
    }
    for limit in &course.limits {
        let CourseLimit { from, to, at_most_ns, .. } = *limit;
        limits.push(bounds.len());
        bounds.push(TimeBound { from, to, at_most_ns });
        let end = &course.ends[limit.end];
        let words = format!("{}.{} has {}", end.route, end.step, limit.words);
        parts.push((words, limit.at.clone(), false));
    }
    let cycle = find_negative_cycle(course.waits.len(), &bounds)?;
    let mut kept = Vec::new();
    let mut limit = 0;
    for number in &cycle.bounds {
        if limits.contains(number) {
            limit = kept.len();
        }
        let (words, at, is_nothing) = &parts[*number];
        if !is_nothing {
            kept.push((words.clone(), at.clone()));
        }
    }
    (!kept.is_empty()).then_some(TimeConflict { parts: kept, excess_ns: cycle.excess_ns, limit })
}

/// A time of each moment, where there is one.
type Times = Vec<Option<i128>>;

/// The extremes of all moments.
struct CourseTimes<'a> {
    course: &'a Course,
    order: &'a [usize],
    earliest: Vec<Option<i128>>,
    nominal: Vec<Option<i128>>,
    latest: Vec<Option<i128>>,
    /// The latest without what dates delay, from the begin; and what dates alone delay, from 1970.
    from_begin: Vec<Option<i128>>,
    from_dates: Vec<Option<i128>>,
    /// The latest after each moment that two routes wait for, with the earliest after it.
    meetings: Vec<(Times, Times)>,
    is_begin_known: bool,
}

impl<'a> CourseTimes<'a> {
    fn new(course: &'a Course, order: &'a [usize], begin: Option<Date>) -> Self {
        let waits = &course.waits;
        let most = |anchors: &[(usize, i128)]| most_after(anchors, order, waits);
        let begin_ns = begin.map(Date::since_1970_ns);
        let anchors = anchor_begin(begin_ns);
        let (earliest, latest) = match begin_ns {
            Some(begin_ns) => {
                // The date of the begin is known: so are all dates from it.
                let dated = |times: Vec<Option<i128>>| -> Vec<Option<i128>> {
                    times.into_iter().map(|time| Some(time? - begin_ns)).collect()
                };
                let earliest = least_after(DATES, order, waits);
                (dated(earliest), dated(most(&[(DATES, 0)])))
            }
            None => (least_after(BEGIN, order, waits), most(&[(BEGIN, 0)])),
        };
        let is_meeting = |moment: &usize| waits[*moment].len() > 1;
        let meetings = (0..waits.len())
            .filter(is_meeting)
            .map(|moment| (most(&[(moment, 0)]), least_after(moment, order, waits)));
        Self {
            course,
            order,
            earliest,
            nominal: time_moments(&anchors, order, waits, |_, wait| wait.nominal_ns),
            latest,
            from_begin: most(&[(BEGIN, 0), (DATES, LONG_BEFORE_NS)]),
            from_dates: most(&[(BEGIN, LONG_BEFORE_NS), (DATES, 0)]),
            meetings: meetings.collect(),
            is_begin_known: begin.is_some(),
        }
    }

    /// The time that is left of a limit at the slowest: less, rather than more.
    fn slack_ns(&self, limit: &CourseLimit) -> Option<i128> {
        if limit.from == DATES {
            let latest = match self.is_begin_known {
                true => most_after(&[(DATES, 0)], self.order, &self.course.waits)[limit.to],
                // If the mission begins early enough, only dates delay it.
                false => self.from_dates[limit.to].filter(|ns| *ns > LONG_BEFORE_NS / 2),
            };
            return Some(limit.at_most_ns - latest?);
        }
        Some(limit.at_most_ns - self.most_between(limit.from, limit.to)?)
    }

    /// The longest time between two moments: that of the wait that is over last. A wait for the first of
    /// them is exact; the others are compared over each moment that both come after.
    fn most_between(&self, from: usize, to: usize) -> Option<i128> {
        let own = most_after(&[(from, 0)], self.order, &self.course.waits);
        let bound = |after: usize| {
            let between =
                |most: &[Option<i128>], least: &[Option<i128>]| Some(most[after]? - least[from]?);
            let from_begin = between(&self.latest, &self.earliest);
            let from_meetings = self.meetings.iter().map(|(most, least)| between(most, least));
            [own[after], from_begin].into_iter().chain(from_meetings).flatten().min()
        };
        let waits = self.course.waits[to].iter();
        let each: Option<Vec<i128>> =
            waits.map(|wait| Some(bound(wait.after)? + wait.most_ns?)).collect();
        each?.into_iter().max()
    }

    /// The latest begin with which a date is kept.
    fn begin_by_ns(&self, limit: &CourseLimit) -> Option<i128> {
        let takes_ns = self.from_begin[limit.to].filter(|ns| *ns > LONG_BEFORE_NS / 2)?;
        (limit.from == DATES).then_some(limit.at_most_ns - takes_ns)
    }
}

/// The moments whose times are known from the begin: the begin, and 1970 if the date of the begin is known.
pub(super) fn anchor_begin(begin_ns: Option<i128>) -> Vec<(usize, i128)> {
    let dates = begin_ns.map(|begin_ns| (DATES, -begin_ns));
    [(BEGIN, 0)].into_iter().chain(dates).collect()
}

fn as_duration(ns: i128) -> Option<Duration> {
    u64::try_from(ns.max(0)).ok().map(Duration::from_nanos)
}
