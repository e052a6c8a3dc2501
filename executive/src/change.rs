//! A new version of the file while the mission runs: read, proven from where the mission stands,
//! and taken at a moment with nothing in flight; or refused, and the old one goes on. Reading and
//! proving take time, so they are questions that somebody answers elsewhere.

use crate::controller::Controller;
use crate::event::Action;
use crate::ledger::Stage;
use crate::record::Entry;
use armor_petri::PlaceId;
use armor_plan::{ComponentId, Plan, Stand, Version};
use std::collections::BTreeSet;
use std::sync::Arc;

pub use crate::judging::{Answer, Found, Offer, Question};

/// How many markings that a version has been proven from are remembered.
const MARKINGS: usize = 256;

/// A version that is there and not played.
#[derive(Clone, Debug)]
pub(crate) struct Change {
    pub(crate) version: Arc<Version>,
    /// Counts the versions offered to this process: what an answer is about.
    serial: u64,
    pub(crate) standing: Standing,
}

/// How far it has come.
#[derive(Clone, Debug)]
pub(crate) enum Standing {
    /// It is being read.
    Reading,
    /// It can be played; it waits for its moment, or is being proven.
    Waiting {
        offer: Offer,
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

impl Controller {
    /// The question that [`Action::Judge`] asks; none if it has been overtaken.
    pub fn question(&self) -> Option<Question> {
        let Change { version, serial, standing } = self.change.as_ref()?;
        let (serial, running) = (*serial, Arc::clone(&self.plan));
        match standing {
            Standing::Reading => {
                Some(Question::Read { serial, version: Arc::clone(version), running })
            }
            Standing::Waiting { offer, proving: Some(stand), .. } => Some(Question::Prove {
                serial,
                running,
                next: Arc::clone(&offer.plan),
                stand: stand.clone(),
            }),
            Standing::Waiting { .. } | Standing::Refused(_) => None,
        }
    }

    /// The plan that is played.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }

    /// There is a version of the file.
    pub(crate) fn offered(&mut self, version: Arc<Version>) {
        if version.is_same(self.plan.version()) {
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
        let (serial, standing) = (self.offers, Standing::Reading);
        self.change = Some(Change { version, serial, standing });
        self.actions.push(Action::Judge);
    }

    /// What came of a question.
    pub(crate) fn answered(&mut self, answer: Answer) {
        let Some(change) = self.change.as_mut().filter(|it| it.serial == answer.serial) else {
            return;
        };
        match (answer.found, &mut change.standing) {
            (Found::Read(Ok(offer)), Standing::Reading) => {
                if offer.plan.fingerprint() == self.plan.fingerprint() {
                    // What else is in the file is not the mission's.
                    self.known_as = change.version.number;
                    self.change = None;
                    return;
                }
                let (proving, proven, why) = (None, BTreeSet::new(), String::new());
                change.standing = Standing::Waiting { offer, proving, proven, why };
            }
            (
                Found::Proven { stand, verdict: Ok(()) },
                Standing::Waiting { proven, proving, .. },
            ) => {
                *proving = None;
                if proven.len() < MARKINGS {
                    proven.insert(stand);
                }
            }
            (Found::Read(Err(why)) | Found::Proven { verdict: Err(why), .. }, _) => {
                self.refuse_change(why);
            }
            (Found::Read(_) | Found::Proven { .. }, _) => {}
        }
    }

    fn refuse_change(&mut self, why: String) {
        let Some(change) = &mut self.change else { return };
        change.standing = Standing::Refused(why.clone());
        let version = change.version.number;
        if self.ledger.stage == Stage::Playing {
            self.record(Entry::Refused { version, why });
        }
    }

    /// Takes the version that is there if its moment has come.
    pub(crate) fn consider_change(&mut self) {
        let Some(Change { standing: Standing::Waiting { offer, proving, proven, why }, .. }) =
            &self.change
        else {
            return;
        };
        let next = Arc::clone(&offer.plan);
        let hindrance = self.ledger.keeps_from(&next).or_else(|| self.may_meet(&next));
        if let Some(hindrance) = hindrance {
            if hindrance != *why {
                self.wait_for(hindrance, None);
            }
            return;
        }
        let marking = self.plan.marking_in(&next, self.ledger.marking());
        let marking = marking.expect("nothing keeps it from being taken");
        let counters = self.plan.counters_in(&next, &self.ledger.counters);
        let counters = counters.expect("nothing keeps it from being taken");
        let clashes = next.clashes(&|place: PlaceId| marking[place.index()] > 0);
        let stand = Stand { marking, counters };
        if !clashes.is_empty() {
            self.refuse_change(format!("{}; both are marked now", clashes.join("; ")));
        } else if proven.contains(&stand) {
            self.take_change();
        } else if proving.is_none() {
            self.wait_for("it is being proven".to_owned(), Some(stand));
            self.actions.push(Action::Judge);
        }
    }

    fn wait_for(&mut self, what: String, prove_from: Option<Stand>) {
        if let Some(Change { standing: Standing::Waiting { why, proving, .. }, .. }) =
            &mut self.change
        {
            *why = what;
            if prove_from.is_some() {
                *proving = prove_from;
            }
            self.publish();
        }
    }

    fn take_change(&mut self) {
        let Some(Change { version, standing: Standing::Waiting { offer, .. }, .. }) =
            self.change.take()
        else {
            return;
        };
        let before = Arc::clone(&self.plan);
        self.record(Entry::Changed {
            version: (*version).clone(),
            fingerprint: offer.plan.fingerprint(),
            changes: offer.changes,
        });
        self.plan = Arc::clone(&self.ledger.plan);
        self.known_as = version.number;
        self.senses.follow(&before, &self.plan);
        self.actions.push(Action::Changed);
    }

    /// Components that exclude each other only in the plan that follows, and of which it is not
    /// known that they do not both run.
    fn may_meet(&self, next: &Plan) -> Option<String> {
        let may_run = |component: ComponentId| self.roster.of(component).may_be_active();
        for one in next.component_ids().filter(|component| may_run(*component)) {
            let known = &self.plan.component(one).peers;
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
}
