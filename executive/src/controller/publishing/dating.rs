//! What the marking shows of absolute dates.

use crate::controller::Controller;
use armor_marking::{DateStand, DateWindow, MissedAction};
use armor_petri::TransitionId;
use armor_plan::DatePhase;
use armor_robotfile::Date;
use armor_robotfile::mission::Missed;

impl Controller {
    pub(super) fn date_stands(&self) -> Vec<DateStand> {
        let ids = self.plan().net().transition_ids();
        ids.filter_map(|id| self.date_stand(id)).collect()
    }

    fn date_stand(&self, id: TransitionId) -> Option<DateStand> {
        let dates = self.plan().transition(id).dates?;
        let stand = self.ledger().date(id);
        let next = match stand.phase {
            DatePhase::Early => dates.first,
            DatePhase::Open => dates.last,
            DatePhase::Past => None,
        };
        let text = |date: Option<Date>| date.map(|date| date.to_string());
        Some(DateStand {
            transition: self.plan().net().transition(id).name.clone(),
            not_before: text(dates.first),
            not_after: text(dates.last),
            missed: match dates.missed {
                Missed::Fire => MissedAction::Fire,
                Missed::Skip => MissedAction::Skip,
                Missed::Fail => MissedAction::Fail,
            },
            phase: match stand.phase {
                DatePhase::Early => DateWindow::Early,
                DatePhase::Open => DateWindow::Open,
                DatePhase::Past => DateWindow::Past,
            },
            used: stand.used,
            next_at_s: next
                .zip(self.dates.utc_at_start())
                .map(|(next, start)| next.after(start).map_or(0.0, |at| at.as_secs_f64())),
        })
    }
}
