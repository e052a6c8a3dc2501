//! A new version of the file while the mission runs: read, proven from where the mission stands,
//! and taken at a moment with nothing in flight; or refused, and the old one stays in force.
//! Reading and proving take time, so they are questions that another thread answers.

use super::context::Context;
use crate::answer::{VersionAnswer, VersionFinding, VersionOffer};
use crate::event::ControllerAction;
use crate::judging::VersionQuestion;
use crate::ledger::transfer::{components_with_other_values, find_obstacle};
use crate::record::JournalEntry;
use armor_petri::PlaceId;
use armor_plan::{ComponentId, Plan, Stand, Version};
use std::collections::BTreeSet;
use std::sync::Arc;

/// How many markings that a version has been proven from are remembered.
const MARKINGS: usize = 256;

/// A version that is there and not played.
#[derive(Clone, Debug)]
pub(super) struct PendingChange {
    pub(super) version: Arc<Version>,
    /// Counts the versions offered to this process: what an answer is about.
    serial: u64,
    pub(super) progress: ChangeProgress,
}

/// How far it has come.
#[derive(Clone, Debug)]
pub(super) enum ChangeProgress {
    /// It is being read.
    Reading,
    /// It can be played; it waits for its moment, or is being proven.
    Waiting {
        offer: VersionOffer,
        /// The marking that it is being proven from.
        proving: Option<Stand>,
        /// Those from which nothing bad was found.
        proven: BTreeSet<Stand>,
        /// What it waits for, in words.
        why: String,
    },
    /// It will not be played.
    Refused(String),
}

/// The versions of the file as far as they concern this process.
#[derive(Clone, Debug)]
pub(super) struct FileChanges {
    /// A version that is not in force.
    change: Option<PendingChange>,
    /// Versions offered to this process.
    offers: u64,
    /// The number of the newest version with the mission in force.
    known_as: u64,
}

impl FileChanges {
    /// Begins with the version whose mission is in force.
    pub(super) fn new(known_as: u64) -> Self {
        Self { change: None, offers: 0, known_as }
    }

    /// Returns the version that is not in force.
    pub(super) fn pending_change(&self) -> Option<&PendingChange> {
        self.change.as_ref()
    }

    /// Returns the number of the newest version with the mission in force.
    pub(super) fn known_as(&self) -> u64 {
        self.known_as
    }

    /// Returns the question that [`crate::ControllerAction::Judge`] asks; none if it has been
    /// overtaken.
    pub(super) fn question(&self, plan: &Arc<Plan>) -> Option<VersionQuestion> {
        let PendingChange { version, serial, progress } = self.change.as_ref()?;
        let (serial, running) = (*serial, Arc::clone(plan));
        match progress {
            ChangeProgress::Reading => {
                Some(VersionQuestion::Read { serial, version: Arc::clone(version), running })
            }
            ChangeProgress::Waiting { offer, proving: Some(stand), .. } => {
                Some(VersionQuestion::Prove {
                    serial,
                    running,
                    next: Arc::clone(&offer.plan),
                    stand: stand.clone(),
                })
            }
            ChangeProgress::Waiting { .. } | ChangeProgress::Refused(_) => None,
        }
    }

    /// Takes up a version of the file.
    pub(super) fn take_offer(&mut self, cx: &mut Context, version: Arc<Version>) {
        if version.is_same(cx.plan().version()) {
            self.known_as = version.number;
            if self.change.take().is_some() {
                tracing::info!("the file is again what is played");
            }
            return;
        }
        if self.change.as_ref().is_some_and(|change| change.version.is_same(&version)) {
            return;
        }
        self.offers += 1;
        let (serial, progress) = (self.offers, ChangeProgress::Reading);
        self.change = Some(PendingChange { version, serial, progress });
        cx.add_action(ControllerAction::Judge);
    }

    /// Takes the answer to a question.
    pub(super) fn take_answer(&mut self, cx: &mut Context, answer: VersionAnswer) {
        let Some(change) = self.change.as_mut().filter(|it| it.serial == answer.serial) else {
            return;
        };
        match (answer.found, &mut change.progress) {
            (VersionFinding::Read(Ok(offer)), ChangeProgress::Reading) => {
                if offer.plan.fingerprint() == cx.plan().fingerprint() {
                    // The file differs in what does not concern the mission.
                    self.known_as = change.version.number;
                    self.change = None;
                    return;
                }
                let (proving, proven, why) = (None, BTreeSet::new(), String::new());
                change.progress = ChangeProgress::Waiting { offer, proving, proven, why };
            }
            (
                VersionFinding::Proven { stand, verdict: Ok(()) },
                ChangeProgress::Waiting { proven, proving, .. },
            ) => {
                *proving = None;
                if proven.len() < MARKINGS {
                    proven.insert(stand);
                }
            }
            (
                VersionFinding::Read(Err(why)) | VersionFinding::Proven { verdict: Err(why), .. },
                _,
            ) => {
                self.refuse_change(cx, why);
            }
            (VersionFinding::Read(_) | VersionFinding::Proven { .. }, _) => {}
        }
    }

    /// Notes that the mission has ended, so that a version that is not in force will not be played.
    pub(super) fn end(&mut self) {
        let Some(PendingChange { version, progress, .. }) = &mut self.change else {
            return;
        };
        let was = match progress {
            ChangeProgress::Reading => "it was being read",
            ChangeProgress::Waiting { why, .. } => why,
            ChangeProgress::Refused(_) => return,
        };
        let why = format!("the mission ended before it was played: {was}");
        tracing::warn!("version {} of the file is not played: {why}", version.number);
        *progress = ChangeProgress::Refused(why);
    }

    fn refuse_change(&mut self, cx: &mut Context, why: String) {
        let Some(change) = &mut self.change else {
            return;
        };
        change.progress = ChangeProgress::Refused(why.clone());
        let version = change.version.number;
        if cx.is_playing() {
            cx.record_entry(JournalEntry::Refused { version, why });
        }
    }

    /// Takes the pending version if its moment has come: nothing is in flight, and it is proven
    /// from where the mission stands. Returns the plan that was in force before.
    pub(super) fn consider_change(&mut self, cx: &mut Context) -> Option<Arc<Plan>> {
        let Some(PendingChange {
            progress: ChangeProgress::Waiting { offer, proving, proven, why },
            ..
        }) = &self.change
        else {
            return None;
        };
        let next = Arc::clone(&offer.plan);
        let hindrance = find_obstacle(cx.ledger(), &next).or_else(|| may_meet(cx, &next));
        if let Some(hindrance) = hindrance {
            if hindrance != *why {
                self.wait_for(cx, hindrance, None);
            }
            return None;
        }
        let marking = cx.plan().marking_in(&next, cx.ledger().marking());
        let marking = marking.expect("nothing keeps it from being taken");
        let counters = cx.plan().counters_in(&next, cx.ledger().counters());
        let counters = counters.expect("nothing keeps it from being taken");
        let clashes = next.clashes(&|place: PlaceId| marking[place.index()] > 0);
        let stand = Stand { marking, counters };
        if !clashes.is_empty() {
            self.refuse_change(cx, format!("{}; both are marked now", clashes.join("; ")));
        } else if offer.is_proven || proven.contains(&stand) {
            return self.take_change(cx);
        } else if proving.is_none() {
            self.wait_for(cx, "it is being proven".to_owned(), Some(stand));
            cx.add_action(ControllerAction::Judge);
        }
        None
    }

    fn wait_for(&mut self, cx: &mut Context, what: String, prove_from: Option<Stand>) {
        if let Some(PendingChange {
            progress: ChangeProgress::Waiting { why, proving, .. }, ..
        }) = &mut self.change
        {
            *why = what;
            if prove_from.is_some() {
                *proving = prove_from;
            }
            cx.publish_marking();
        }
    }

    /// Takes the version that waits; returns the plan that was in force before.
    fn take_change(&mut self, cx: &mut Context) -> Option<Arc<Plan>> {
        let PendingChange { version, progress, .. } = self.change.take()?;
        let ChangeProgress::Waiting { offer, .. } = progress else {
            return None;
        };
        let before = Arc::clone(cx.plan());
        let restarts = components_with_other_values(cx.ledger(), &offer.plan);
        let name = |component: ComponentId| before.component(component).name.clone();
        cx.record_entry(JournalEntry::Changed {
            version: (*version).clone(),
            fingerprint: offer.plan.fingerprint(),
            changes: offer.changes,
            restarts: restarts.into_iter().map(name).collect(),
        });
        self.known_as = version.number;
        cx.add_action(ControllerAction::Changed);
        Some(before)
    }
}

/// Returns why the plan that follows has to wait: two components that exclude each other only
/// there, and that may both be running.
fn may_meet(cx: &Context, next: &Plan) -> Option<String> {
    let may_run = |component: ComponentId| cx.roster.of(component).may_be_active();
    for one in next.component_ids().filter(|component| may_run(*component)) {
        let known = &cx.plan().component(one).peers;
        let mut peers = next.component(one).peers.iter();
        if let Some(other) = peers.find(|peer| !known.contains(peer) && may_run(**peer)) {
            let (one, other) = (&next.component(one).name, &next.component(*other).name);
            return Some(format!(
                "the new file lets `{one}` and `{other}` exclude each other, and both may run"
            ));
        }
    }
    None
}
