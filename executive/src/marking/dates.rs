//! What the marking shows of absolute dates.

use crate::controller::Controller;
use crate::record::DatePhase;
use armor_petri::TransitionId;
use armor_robotfile::Date;
use armor_robotfile::mission::Missed;
use armor_sdk::Message;

/// A transition with dates, and where they stand.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct DateStand {
    /// The transition.
    pub transition: String,
    /// Its first date, in UTC, such as `2026-11-21T14:30:00Z`.
    pub not_before: Option<String>,
    /// Its last date, in UTC.
    pub not_after: Option<String>,
    /// What becomes of it if the last date passes unused: `fire`, `skip` or `fail`.
    pub missed: String,
    /// `early`, `open`, or `past`.
    pub phase: String,
    /// Whether it has fired.
    pub used: bool,
    /// When the next of its dates comes, by the clock as it is now.
    #[message(unit = "s")]
    pub next_at_s: Option<f64>,
}

impl Controller {
    pub(super) fn dates(&self) -> Vec<DateStand> {
        let ids = self.plan.net.transition_ids();
        ids.filter_map(|id| self.date_stand(id)).collect()
    }

    fn date_stand(&self, id: TransitionId) -> Option<DateStand> {
        let dates = self.plan.transition(id).dates?;
        let stand = self.ledger.dates[id.index()];
        let next = match stand.phase {
            DatePhase::Early => dates.first,
            DatePhase::Open => dates.last,
            DatePhase::Past => None,
        };
        let text = |date: Option<Date>| date.map(|date| date.to_string());
        Some(DateStand {
            transition: self.plan.net.transition(id).name.clone(),
            not_before: text(dates.first),
            not_after: text(dates.last),
            missed: match dates.missed {
                Missed::Fire => "fire",
                Missed::Skip => "skip",
                Missed::Fail => "fail",
            }
            .to_owned(),
            phase: match stand.phase {
                DatePhase::Early => "early",
                DatePhase::Open => "open",
                DatePhase::Past => "past",
            }
            .to_owned(),
            used: stand.used,
            next_at_s: next
                .zip(self.utc_at_start)
                .map(|(next, start)| next.after(start).map_or(0.0, |at| at.as_secs_f64())),
        })
    }
}
