//! Watches the mission for the screen, and answers its questions in the operator's name.

use std::collections::BTreeMap;
use std::sync::Arc;

use armor_inspect::{MissionLook, MissionWatch, OrderSender, SentOrder, this_user};
use armor_sdk::control::Order;
use armor_sdk::directory::Directory;

use crate::mission::{MissionQuestion, MissionState};

/// The name by which the executive knows this observer.
const TOOL: &str = "operator-view";

/// Watches the mission of the system that this process belongs to.
pub(super) struct MissionLookout {
    directory: Directory,
    watch: MissionWatch,
    answers: AnswerSender,
    shown: MissionLook,
    /// The report that each transition waits for, as far as it was seen waiting.
    reports: BTreeMap<String, String>,
    reported: usize,
}

/// Answers questions of the mission, and ends its pauses.
#[derive(Clone)]
pub(super) struct AnswerSender(Arc<OrderSender>);

impl AnswerSender {
    /// Ends a pause of the mission.
    pub(super) fn resume_mission(&self) {
        self.0.give(&this_user(), false, Order::Resume);
    }

    /// Answers the question of a transition.
    pub(super) fn give_answer(&self, transition: &str, is_confirmed: bool) {
        let transition = transition.to_owned();
        let order = if is_confirmed {
            Order::Confirm { transition }
        } else {
            Order::Decline { transition }
        };
        self.0.give(&this_user(), false, order);
    }
}

impl MissionLookout {
    /// Begins to watch the mission of the system whose registry is at `registry`.
    pub(super) fn begin(registry: &str) -> Option<Self> {
        let name = format!("{TOOL}-{}", std::process::id());
        let directory = Directory::observer(registry, &name);
        let watch = MissionWatch::begin(&directory, Arc::new(|| {})).ok()?;
        let orders = OrderSender::open(&directory, TOOL, Arc::new(|| {})).ok()?;
        let answers = AnswerSender(Arc::new(orders));
        let (shown, reports) = (MissionLook::default(), BTreeMap::new());
        Some(Self { directory, watch, answers, shown, reports, reported: 0 })
    }

    /// What answers questions.
    pub(super) fn answers(&self) -> AnswerSender {
        self.answers.clone()
    }

    /// Returns the state of the mission if it has changed. `host_s`: now, by the host's clock.
    pub(super) fn take_change(&mut self, host_s: f64) -> Option<MissionState> {
        let look = self.watch.look();
        if look.marking == self.shown.marking {
            return None;
        }
        let waiting = look.marking.iter().flat_map(|marking| &marking.waiting);
        let waiting = waiting.filter(|one| !one.report.is_empty());
        self.reports.extend(waiting.map(|one| (one.transition.clone(), one.report.clone())));
        self.shown = look;
        self.state(host_s)
    }

    /// Returns the state of the mission.
    pub(super) fn state(&self, host_s: f64) -> Option<MissionState> {
        let marking = self.shown.marking.as_ref()?;
        let questions = marking.confirmations.iter().map(|question| MissionQuestion {
            transition: question.transition.clone(),
            answer_by_at_s: question.answer_by_at_s.filter(|_| !question.put_off),
            unanswered: question.unanswered.as_str().into(),
        });
        Some(MissionState {
            name: marking.mission.clone(),
            stage: marking.stage.as_str().into(),
            why: marking.why.clone(),
            now_at_s: self.shown.now_at_s(self.directory.clock().timestamp()),
            is_running: !marking.stage.has_ended() && marking.pause.is_none(),
            paused_by: marking.pause.as_ref().map(|pause| pause.by.clone()).unwrap_or_default(),
            frozen: marking
                .components
                .iter()
                .filter(|component| component.state.as_str() == "frozen")
                .map(|component| component.component.clone())
                .collect(),
            places: marking.places.iter().map(|marked| marked.place.clone()).collect(),
            last_cause: self.last_cause(),
            questions: questions.collect(),
            received_s: host_s,
        })
    }

    /// Returns the report that the last transition to fire has waited for, or its name.
    fn last_cause(&self) -> String {
        let last = self.shown.marking.as_ref().and_then(|marking| marking.history.last());
        let name = last.map(|fired| fired.transition.clone()).unwrap_or_default();
        self.reports.get(&name).cloned().unwrap_or(name)
    }

    /// Returns the answers that have been accepted or refused since the last call.
    pub(super) fn take_results(&mut self) -> Vec<SentOrder> {
        let given = self.answers.0.given();
        let answered = given.iter().take_while(|order| order.accepted.is_some()).count();
        // The list forgets the oldest.
        self.reported = self.reported.min(answered);
        let new = given[self.reported..answered].to_vec();
        self.reported = answered;
        new
    }
}
