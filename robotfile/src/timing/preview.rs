//! The mission as its routes are drawn, before it runs: where each robot is at each time, where two come
//! too close to each other, and how probable it is that the limits are kept.

use std::num::NonZeroU32;

use crate::date::Date;
use crate::mission::Mission;
use crate::model::System;
use crate::timing::chance::{MissionChances, PairInReach, are_in_reach, draw_chances};
use crate::timing::course::{Course, CourseLimit};
use crate::timing::drive::DriveLengths;
use crate::timing::encounter::{RobotEncounter, find_encounters};
use crate::timing::extremes::{TimeWait, sort_moments, time_moments};
use crate::timing::motion::{RobotMotion, as_seconds};
use crate::timing::timetable::anchor_begin;

/// The speeds at which a mission is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpeedChoice {
    /// All drives at their fastest: the earliest times.
    Fastest,
    /// All drives at exactly their speeds.
    #[default]
    Nominal,
    /// All drives at their slowest: the latest times.
    Slowest,
}

impl SpeedChoice {
    /// Each with the word for its times.
    pub const NAMED: [(&str, Self); 3] =
        [("earliest", Self::Fastest), ("nominal", Self::Nominal), ("latest", Self::Slowest)];

    /// The word for its times.
    pub fn word(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// A mission as it is drawn, at each choice of speeds.
#[derive(Clone, Debug)]
pub struct MissionPreview {
    /// The robots, one for each route, in the order of the file.
    pub robots: Vec<PreviewRobot>,
    /// The limits of the steps, in the order of the file.
    pub limits: Vec<PreviewLimit>,
    /// The meetings, and the arrivals that have a limit: each once for each robot.
    pub appointments: Vec<Appointment>,
    /// By [`SpeedChoice`].
    schedules: [PreviewSchedule; 3],
    course: Course,
    order: Vec<usize>,
    begin_ns: Option<i128>,
}

/// A robot, as its route is drawn.
#[derive(Clone, Debug)]
pub struct PreviewRobot {
    /// The name of its route.
    pub route: String,
    /// Its radius: that of the route; else the largest `radius` that the file gives to a component that the
    /// route names; else 0.18 m.
    pub radius_m: f64,
    /// The names of its steps, as in the timetable.
    pub steps: Vec<String>,
}

/// A limit of a step.
#[derive(Clone, Debug)]
pub struct PreviewLimit {
    /// The number of the robot.
    pub robot: usize,
    /// The step.
    pub step: String,
    /// `by 1 min`, `not after 2026-…`, `patience 9 s`.
    pub words: String,
}

/// A moment that matters to others: a meeting, or an arrival that has a limit.
#[derive(Clone, Debug)]
pub struct Appointment {
    /// The number of the robot.
    pub robot: usize,
    /// The step.
    pub step: String,
    /// The other route of a meeting.
    pub with: Option<String>,
    /// The numbers of its limits.
    pub limits: Vec<usize>,
    moment: usize,
}

/// A mission at one choice of speeds.
#[derive(Clone, Debug)]
pub struct PreviewSchedule {
    /// Where the robots are.
    pub motions: Vec<RobotMotion>,
    /// Where two are closer than their radii allow, in the order of time.
    pub encounters: Vec<RobotEncounter>,
    /// When each appointment is kept, in seconds from the begin of the mission; none where this is not known.
    pub appointments_s: Vec<Option<f64>>,
    /// When the last robot has ended, as far as is known.
    pub end_s: f64,
}

impl MissionPreview {
    /// Of a mission; with the date at which it begins, if this is known. None if its meetings wait for each
    /// other in a circle, which is a finding.
    pub fn of_mission(
        mission: &Mission,
        system: &System,
        lengths: &dyn DriveLengths,
        begin: Option<Date>,
    ) -> Option<Self> {
        let course = Course::of_mission(mission, system, lengths, begin);
        let order = sort_moments(&course.waits).ok()?;
        let robots: Vec<_> = course
            .tracks
            .iter()
            .map(|track| {
                let mut steps: Vec<_> = track.stretches.iter().map(|it| it.step.clone()).collect();
                steps.dedup();
                PreviewRobot { route: track.route.clone(), radius_m: track.radius_m, steps }
            })
            .collect();
        let robot_of = |route: &str| robots.iter().position(|robot| robot.route == route);
        let limits = course.limits.iter().map(|limit| {
            let end = &course.ends[limit.end];
            let robot = robot_of(&end.route).unwrap_or_default();
            PreviewLimit { robot, step: end.step.clone(), words: limit.words.clone() }
        });
        let limits = limits.collect();
        let appointments = course.ends.iter().enumerate().filter_map(|(number, end)| {
            let own = course.limits.iter().enumerate().filter(|(_, limit)| limit.end == number);
            let limits: Vec<_> = own.map(|(limit, _)| limit).collect();
            if limits.is_empty() && end.with.is_none() {
                return None;
            }
            let (step, with) = (end.step.clone(), end.with.clone());
            Some(Appointment {
                robot: robot_of(&end.route)?,
                step,
                with,
                limits,
                moment: end.moment,
            })
        });
        let appointments = appointments.collect();
        let begin_ns = begin.map(Date::since_1970_ns);
        let schedules = std::array::from_fn(|_| PreviewSchedule::empty());
        let mut preview = Self { robots, limits, appointments, schedules, course, order, begin_ns };
        preview.schedules = SpeedChoice::NAMED.map(|(_, speeds)| preview.schedule_at(speeds));
        Some(preview)
    }

    /// The mission at a choice of speeds.
    pub fn schedule(&self, speeds: SpeedChoice) -> &PreviewSchedule {
        &self.schedules[speeds as usize]
    }

    /// Draws the speed of each drive `draws` times, and counts; none if `is_cancelled` returns true, which is
    /// asked before each draw. The same seed gives the same result.
    pub fn draw_chances(
        &self,
        seed: u64,
        draws: NonZeroU32,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Option<MissionChances> {
        draw_chances(self, seed, draws, is_cancelled)
    }

    fn schedule_at(&self, speeds: SpeedChoice) -> PreviewSchedule {
        // Without a longest time the times after it are not known, whatever the shortest is.
        let duration = |_, wait: &TimeWait| match speeds {
            SpeedChoice::Fastest => wait.most_ns.map(|_| wait.least_ns),
            SpeedChoice::Nominal => wait.nominal_ns,
            SpeedChoice::Slowest => wait.most_ns,
        };
        let times = time_moments(&self.anchors(), &self.order, &self.course.waits, duration);
        let motions = self.list_motions(&times);
        let mut encounters = Vec::new();
        for one in 0..motions.len() {
            for other in one + 1..motions.len() {
                let both = [&motions[one], &motions[other]];
                encounters.extend(find_encounters([one, other], both, self.reach_m([one, other])));
            }
        }
        encounters.sort_by(|one, other| one.from_s.total_cmp(&other.from_s));
        let appointments_s =
            self.appointments.iter().map(|it| times[it.moment].map(as_seconds)).collect();
        let end_s = motions.iter().filter_map(RobotMotion::end_s).fold(0.0, f64::max);
        PreviewSchedule { motions, encounters, appointments_s, end_s }
    }

    /// The distance that the centres of two robots keep.
    fn reach_m(&self, robots: [usize; 2]) -> f64 {
        robots.iter().map(|robot| self.robots[*robot].radius_m).sum()
    }

    /// The motions of all robots; each stays where its route ends until the last one has ended.
    pub(super) fn list_motions(&self, times: &[Option<i128>]) -> Vec<RobotMotion> {
        let tracks = self.course.tracks.iter().zip(&self.robots);
        let mut motions: Vec<_> = tracks
            .map(|(track, robot)| {
                let mut number = 0;
                let steps = track.stretches.iter().map(|stretch| {
                    if robot.steps.get(number).is_none_or(|step| *step != stretch.step) {
                        number += 1;
                    }
                    number
                });
                RobotMotion::of_track(track, times, &steps.collect::<Vec<_>>())
            })
            .collect();
        let end_s = motions.iter().filter_map(RobotMotion::end_s).fold(0.0, f64::max);
        for motion in &mut motions {
            motion.stay_until(end_s);
        }
        motions
    }

    /// The pairs of robots whose routes come close to each other at whatever times.
    pub(super) fn pairs_in_reach(&self) -> Vec<PairInReach> {
        let motions = &self.schedule(SpeedChoice::Nominal).motions;
        let numbers = 0..motions.len();
        let pairs = numbers.flat_map(|one| (one + 1..motions.len()).map(move |other| [one, other]));
        let pairs = pairs.map(|robots| PairInReach { robots, reach_m: self.reach_m(robots) });
        let are_near = |pair: &PairInReach| {
            let [one, other] = pair.robots.map(|robot| &motions[robot]);
            are_in_reach(one, other, pair.reach_m)
        };
        pairs.filter(are_near).collect()
    }

    /// Of each moment at which a drive ends, the tolerance of its speed.
    pub(super) fn tolerances(&self) -> Vec<Option<f64>> {
        let mut tolerances = vec![None; self.course.waits.len()];
        for stretch in self.course.tracks.iter().flat_map(|track| &track.stretches) {
            if stretch.tolerance.is_some() {
                tolerances[stretch.ends] = stretch.tolerance;
            }
        }
        tolerances
    }

    pub(super) fn course_limits(&self) -> &[CourseLimit] {
        &self.course.limits
    }

    pub(super) fn anchors(&self) -> Vec<(usize, i128)> {
        anchor_begin(self.begin_ns)
    }

    pub(super) fn order(&self) -> &[usize] {
        &self.order
    }

    pub(super) fn waits(&self) -> &[Vec<TimeWait>] {
        &self.course.waits
    }
}

impl PreviewSchedule {
    fn empty() -> Self {
        Self { motions: Vec::new(), encounters: Vec::new(), appointments_s: Vec::new(), end_s: 0.0 }
    }

    /// The numbers of the robots whose times are not known to the end.
    pub fn open_robots(&self) -> impl Iterator<Item = (usize, usize)> {
        let numbered = self.motions.iter().enumerate();
        numbered.filter_map(|(robot, motion)| Some((robot, motion.open_step?)))
    }
}
