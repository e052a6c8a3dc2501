//! What ends a step of a route early: the transitions from its place, and the drive to a rally point.

use std::time::Duration;

use crate::date::Date;
use crate::drawn_route::{ExitCause, RouteExit, RoutePort};
use crate::mission::{Autonomy, LostLink, ReportRef};
use crate::route::exits::{ExitTarget, find_exit_target};
use crate::route::net::{RouteNet, suffix};
use crate::route::pieces::RoutePiece;
use crate::site_map::DrawnPoint;
use crate::source::Spanned;

/// Guards of exits and breaches go before what else ends a step.
const FIRST_PRIORITY: i32 = 1;

/// The times of a step.
#[derive(Clone, Copy, Default)]
pub(super) struct Limits<'a> {
    pub(super) by: Option<&'a Spanned<Duration>>,
    pub(super) not_after: Option<&'a Spanned<Date>>,
}

impl<'a> RouteNet<'a> {
    /// The transitions of all exits from a place, and the places that they lead to.
    pub(super) fn add_exits(
        &mut self,
        here: &Spanned<String>,
        piece: &RoutePiece<'a>,
        limits: Limits<'_>,
        blocks: Option<&RoutePort>,
    ) {
        let route = self.route;
        for exit in &route.exits {
            for cause in &exit.causes {
                self.add_exit(here, piece, limits, blocks, cause.value, Some(exit));
            }
            if let Some(when) = &exit.when {
                let target = self.name_target(here, piece, Some(exit));
                if let Some(target) = target {
                    let guarded = self.add(suffix(here, &exit.name.value), here, &target);
                    guarded.when = Some(when.clone());
                    guarded.priority = FIRST_PRIORITY;
                }
            }
        }
        for cause in [ExitCause::Blocked, ExitCause::Late, ExitCause::Breach] {
            let mut causes = route.exits.iter().flat_map(|exit| &exit.causes);
            if !causes.any(|given| given.value == cause) {
                self.add_exit(here, piece, limits, blocks, cause, None);
            }
        }
    }

    fn add_exit(
        &mut self,
        here: &Spanned<String>,
        piece: &RoutePiece<'a>,
        limits: Limits<'_>,
        blocks: Option<&RoutePort>,
        cause: ExitCause,
        exit: Option<&RouteExit>,
    ) {
        let can_happen = match cause {
            ExitCause::Blocked => blocks.is_some(),
            ExitCause::Late => limits.by.is_some() || limits.not_after.is_some(),
            ExitCause::LostLink | ExitCause::Recall => true,
            ExitCause::Breach => self.route.fence.is_some(),
        };
        if !can_happen {
            return;
        }
        let Some(target) = self.name_target(here, piece, exit) else { return };
        match cause {
            ExitCause::Blocked => {
                if let Some(port) = blocks {
                    self.add_on(here, cause.word(), port, "failed", &target);
                }
            }
            ExitCause::Late => {
                if let Some(by) = limits.by {
                    self.add_timed(here, cause.word(), by, &target);
                }
                if let Some(date) = limits.not_after {
                    let late = self.add(suffix(here, "too-late"), here, &target);
                    late.not_before = Some(date.clone());
                }
            }
            ExitCause::Breach => self.add_breach(here, &target),
            ExitCause::LostLink | ExitCause::Recall => {
                let order = self.add(suffix(here, cause.word()), here, &target);
                order.autonomy = Autonomy::Operator;
                if cause == ExitCause::LostLink {
                    order.lost_link = Some(here.with(LostLink::Fire));
                }
            }
        }
    }

    /// The place that an exit leads to; the drive to a point is added if it is not there yet.
    fn name_target(
        &mut self,
        here: &Spanned<String>,
        piece: &RoutePiece<'a>,
        exit: Option<&RouteExit>,
    ) -> Option<Spanned<String>> {
        let target = exit.map(|exit| find_exit_target(self.route, exit, piece, &mut self.paths));
        match target {
            None | Some(ExitTarget::Safe) => self.safe.clone(),
            Some(ExitTarget::Missing) => None,
            Some(ExitTarget::NextStep) => Some(self.name_after_step(piece.step)),
            Some(ExitTarget::Point(point)) => Some(self.add_rally(here, point)),
        }
    }

    /// The drive to a rally point, and the wait there for the operator to resume the piece.
    fn add_rally(&mut self, here: &Spanned<String>, point: &DrawnPoint) -> Spanned<String> {
        let drive = suffix(here, &format!("to-{}", point.name.value));
        if self.places.iter().any(|place| place.name.value == drive.value) {
            return drive;
        }
        let route = self.route;
        let there = point.position.value.point;
        self.add_driven_place(drive.clone(), Some(there), &[], None, &point.name);
        let Some(safe) = self.safe.clone() else { return drive };
        let after = match &route.patience {
            None => safe.clone(),
            Some(patience) => {
                let waiting = suffix(here, &format!("at-{}", point.name.value));
                self.add_place(waiting.clone(), Vec::new(), Vec::new());
                let resume = self.add(suffix(&waiting, "resume"), &waiting, here);
                resume.autonomy = Autonomy::Operator;
                self.add_timed(&waiting, "over", patience, &safe);
                self.add_breach(&waiting, &safe);
                waiting
            }
        };
        self.add_on(&drive, "done", &route.mover, "done", &after);
        self.add_on(&drive, "blocked", &route.mover, "failed", &safe);
        if let Some(by) = &route.rally_by {
            self.add_timed(&drive, "late", by, &safe);
        }
        self.add_breach(&drive, &safe);
        drive
    }

    /// What follows when the fence of the route reports a breach.
    fn add_breach(&mut self, here: &Spanned<String>, target: &Spanned<String>) {
        let Some(fence) = &self.route.fence else { return };
        let word = ExitCause::Breach.word();
        let on = ReportRef { component: fence.clone(), event: fence.with(word.to_owned()) };
        let breach = self.add(suffix(here, word), here, target);
        breach.on = Some(on);
        breach.priority = FIRST_PRIORITY;
    }
}
