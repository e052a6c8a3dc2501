//! Orders of operators: who may give them, which can be carried out, and what follows for the lease
//! when the link to its holder breaks.

use super::context::Context;
use super::hindrances::firing_hindrance;
use super::mission_dates::MissionDates;
use super::token_moves::{MoveProofs, judge_moves};
use crate::event::ControllerAction;
use crate::incoming_order::IncomingOrder;
use crate::judging::MoveQuestion;
use crate::ledger::{Consent, Lease, MissionStage};
use crate::order::{Giver, Judged, MissionOrder};
use crate::record::JournalEntry;
use armor_petri::{FiringClass, TransitionId};
use armor_plan::Plan;
use armor_robotfile::advise_similar;
use armor_robotfile::mission::Autonomy;
use armor_sdk::orders::Repeats;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Most refused orders that are written down within [`REFUSALS_WITHIN`].
const REFUSALS: usize = 10;
/// See [`REFUSALS`].
const REFUSALS_WITHIN: Duration = Duration::from_secs(1);

/// Most orders in [`Operators::passed_over`]: as many as the ledger remembers of those written down.
const PASSED_OVER: usize = 64;

/// Most names that a refusal lists.
const MAX_LISTED: usize = 20;

/// The connection of the holder of the lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HolderLink {
    /// Up; it has this number.
    Up(u64),
    /// Down since then.
    Down(Duration),
}

/// Takes orders. The lease itself is part of the ledger; the link to its holder is observed here.
#[derive(Clone, Debug)]
pub(super) struct Operators {
    link: HolderLink,
    /// Tokens to be moved once that is proven to be safe.
    moves: MoveProofs,
    /// Orders that were refused or changed nothing and, as there were too many, not written down.
    unwritten: u64,
    /// By author and order: accepted orders since the last one that changed anything.
    repeats: Repeats<(String, String)>,
    /// The last accepted orders that were not written down, the oldest first: author, request and
    /// answer. One that is sent again must not be taken for a new one: it would pause a mission that was
    /// resumed meanwhile.
    passed_over: VecDeque<(String, u64, String)>,
}

impl Operators {
    /// Begins without a connection to the holder.
    pub(super) fn new(host: Duration) -> Self {
        Self {
            link: HolderLink::Down(host),
            moves: MoveProofs::default(),
            unwritten: 0,
            repeats: Repeats::default(),
            passed_over: VecDeque::new(),
        }
    }

    /// Returns how many orders were not written down.
    pub(super) fn unwritten(&self) -> u64 {
        self.unwritten
    }

    /// Whether the holder of the lease is connected.
    pub(super) fn is_holder_connected(&self) -> bool {
        matches!(self.link, HolderLink::Up(_))
    }

    /// Returns the question that [`crate::ControllerAction::JudgeMove`] asks; none if it has been
    /// answered.
    pub(super) fn move_question(&self, plan: &Arc<Plan>) -> Option<MoveQuestion> {
        self.moves.move_question(plan)
    }

    /// Judges an order, writes it down, and answers. An order that is repeated gets the same
    /// answer.
    pub(super) fn take_order(
        &mut self,
        cx: &mut Context,
        dates: &MissionDates,
        given: IncomingOrder,
    ) {
        if self.moves.is_repeated(&given) {
            return;
        }
        let is_known = |past: &&(Judged, Duration)| {
            past.0.request == given.request && past.0.by.author == given.by.author
        };
        let known = cx.ledger().authority().orders().rev().find(is_known);
        let known = known.map(|known| (known.0.accepted, known.0.text.clone()));
        let known = known.or_else(|| self.find_passed_over(&given));
        if known.is_none() && self.has_to_be_proven(cx, dates, &given) {
            return;
        }
        let (accepted, text) = known.unwrap_or_else(|| self.judge_and_record(cx, dates, &given));
        let holder = cx.ledger().lease().map(|lease| lease.by.instance);
        let holds = matches!(given.order, MissionOrder::Lease | MissionOrder::Rejoin);
        if holds && holder == Some(given.by.instance) {
            self.link = HolderLink::Up(given.connection);
        }
        let IncomingOrder { connection, request, .. } = given;
        cx.add_action(ControllerAction::Answer { connection, request, accepted, text });
    }

    /// Notes that the connection of an operator has ended.
    pub(super) fn operator_left(&mut self, cx: &Context, connection: u64) {
        if self.link == HolderLink::Up(connection) {
            self.link = HolderLink::Down(cx.host());
        }
    }

    /// Returns when a lease whose holder is not connected runs out, in host time.
    pub(super) fn lease_due(&self, cx: &Context) -> Option<Duration> {
        match (cx.ledger().lease(), self.link) {
            (Some(_), HolderLink::Down(since)) if !cx.is_stopping() => {
                Some(since + cx.plan().limits().lease)
            }
            _ => None,
        }
    }

    pub(super) fn notice_lost_link(&self, cx: &mut Context) {
        if self.lease_due(cx).is_some_and(|due| due <= cx.host())
            && let Some(Lease { by, .. }) = cx.ledger().lease().cloned()
        {
            cx.record_entry(JournalEntry::LinkLost { author: by.author });
        }
    }

    /// Whether so many refused orders were written down lately that one more is only counted: a
    /// client that repeats an impossible order must not fill the journal.
    fn has_refused_enough(cx: &Context) -> bool {
        let orders = cx.ledger().authority().orders().rev();
        let lately = orders.take_while(|past| past.1 + REFUSALS_WITHIN > cx.now());
        lately.filter(|past| !past.0.accepted).count() >= REFUSALS
    }

    /// Returns the answer to an accepted order that was not written down.
    fn find_passed_over(&self, given: &IncomingOrder) -> Option<(bool, String)> {
        let mut passed_over = self.passed_over.iter().rev();
        let is_same =
            |past: &&(String, u64, String)| past.1 == given.request && past.0 == given.by.author;
        passed_over.find(is_same).map(|past| (true, past.2.clone()))
    }

    fn judge_and_record(
        &mut self,
        cx: &mut Context,
        dates: &MissionDates,
        given: &IncomingOrder,
    ) -> (bool, String) {
        let judged =
            self.check_allowed(cx, given).and_then(|()| self.judge_order(cx, dates, &given.order));
        self.write_down(cx, given, judged)
    }

    /// Writes down the verdict on an order; refusals beyond the limit are only counted, and so are
    /// most repetitions of an order that changes nothing.
    fn write_down(
        &mut self,
        cx: &mut Context,
        given: &IncomingOrder,
        judged: Result<String, String>,
    ) -> (bool, String) {
        let ousted = cx.ledger().lease().map(|lease| lease.by.clone());
        let ousted = ousted.filter(|by| given.take && by.instance != given.by.instance);
        let (accepted, text) = match (judged, &ousted) {
            (Ok(text), Some(by)) => {
                (true, format!("{text}; the command is taken from {}", by.author))
            }
            (Ok(text), None) => (true, text),
            (Err(text), _) => (false, text),
        };
        if !accepted && Self::has_refused_enough(cx) {
            self.unwritten += 1;
            return (accepted, text);
        }
        let mut text = text;
        if accepted && ousted.is_none() && changes_nothing(cx, &given.order) {
            // Any observer may give such an order, as often as they like.
            match self.repeats.note((given.by.author.clone(), given.order.to_string())) {
                None => {
                    self.unwritten += 1;
                    if self.passed_over.len() >= PASSED_OVER {
                        self.passed_over.pop_front();
                    }
                    let author = given.by.author.clone();
                    self.passed_over.push_back((author, given.request, text.clone()));
                    return (accepted, text);
                }
                Some(1) => {}
                Some(count) => text = format!("{text}; ordered {count} times meanwhile"),
            }
        } else if accepted {
            self.repeats.clear();
        }
        let text_kept = text.clone();
        let IncomingOrder { request, by, take, order, .. } = given.clone();
        let taker = by.author.clone();
        cx.record_entry(JournalEntry::Ordered(Judged { request, by, take, order, accepted, text }));
        if let (true, Some(_), HolderLink::Up(connection)) = (accepted, ousted, self.link) {
            // The former holder learns it now, and not when its next order is refused.
            let text = format!("{taker} has taken the command over");
            cx.add_action(ControllerAction::Answer {
                connection,
                request: 0,
                accepted: false,
                text,
            });
        }
        (accepted, text_kept)
    }

    /// Whether this operator may give this order now.
    fn check_allowed(&self, cx: &Context, given: &IncomingOrder) -> Result<(), String> {
        // A pause is in the journal, so it applies to the executive that resumes the mission. If it were
        // refused, that one would set the robot in motion although an operator has ordered STOP.
        if cx.is_stopping() && given.order != MissionOrder::Pause {
            return Err("the executive is being stopped; the mission can be resumed later".into());
        }
        let needs_own = matches!(given.order, MissionOrder::Release | MissionOrder::Rejoin);
        let Some(lease) = cx.ledger().lease() else {
            let why = "no operator holds the command";
            return if needs_own { Err(why.into()) } else { Ok(()) };
        };
        let own = lease.by.instance == given.by.instance;
        if own || given.order.is_open_to_all() || (given.take && !needs_own) {
            return Ok(());
        }
        let Giver { author, from, .. } = &lease.by;
        let link = match self.link {
            HolderLink::Up(_) => String::new(),
            HolderLink::Down(since) => {
                let for_s = cx.host().saturating_sub(since).as_secs_f64();
                format!(", whose link has been down for {for_s:.1} s")
            }
        };
        Err(format!(
            "{author} commands this mission ({from}{link}): ask for the command, or take it over"
        ))
    }

    /// Whether an order can be carried out, and what follows from it.
    fn judge_order(
        &self,
        cx: &Context,
        dates: &MissionDates,
        order: &MissionOrder,
    ) -> Result<String, String> {
        if cx.ledger().stage() != MissionStage::Playing {
            return match order {
                MissionOrder::Safe if cx.ledger().stage() == MissionStage::Retreating => {
                    Ok("the mission is on its way to its safe place".into())
                }
                MissionOrder::Lease | MissionOrder::Release | MissionOrder::Rejoin => {
                    Ok(in_command(order))
                }
                _ => Err("the mission is ending".into()),
            };
        }
        match order {
            MissionOrder::Lease | MissionOrder::Release | MissionOrder::Rejoin => {
                Ok(in_command(order))
            }
            MissionOrder::Fire(name) => judge_firing(cx, dates, name),
            MissionOrder::Pause => Ok(match cx.ledger().pause() {
                Some(pause) => format!("the mission is paused already, by {}", pause.by),
                None => "the mission is paused".into(),
            }),
            MissionOrder::Resume => match cx.ledger().pause() {
                Some(_) => Ok("the mission continues".into()),
                None => Err("the mission is not paused".into()),
            },
            MissionOrder::Safe => Ok(match cx.plan().safe() {
                Some(place) => format!("the mission goes to `{}`", cx.plan().net().place(place)),
                None => "the mission is given up: it has no safe place".into(),
            }),
            MissionOrder::Move(_) if self.moves.is_proving() => {
                Err("another move is being proven: wait for what comes of it".into())
            }
            MissionOrder::Move(moves) => judge_moves(cx, moves),
            MissionOrder::Confirm(name) => {
                judge_answer(cx, name)?;
                let held = cx.ledger().pause().is_some();
                Ok(format!(
                    "`{name}` fires{}",
                    if held { " when the mission continues" } else { "" }
                ))
            }
            MissionOrder::Decline(name) => {
                judge_answer(cx, name)?;
                Ok(format!("`{name}` does not fire, and asks again when it is newly enabled"))
            }
        }
    }

    /// Takes up an order that has to be proven first, if it is one and could be carried out.
    fn has_to_be_proven(
        &mut self,
        cx: &mut Context,
        dates: &MissionDates,
        given: &IncomingOrder,
    ) -> bool {
        let MissionOrder::Move(moves) = &given.order else {
            return false;
        };
        if self
            .check_allowed(cx, given)
            .and_then(|()| self.judge_order(cx, dates, &given.order))
            .is_err()
        {
            return false;
        }
        self.moves.begin_proof(cx, given, moves);
        true
    }

    /// Takes the verdict about a move: the order is carried out if nothing speaks against it now.
    pub(super) fn move_judged(
        &mut self,
        cx: &mut Context,
        dates: &MissionDates,
        serial: u64,
        verdict: Result<(), String>,
    ) {
        let Some(proof) = self.moves.end_proof(serial) else {
            return;
        };
        let given = proof.given();
        let judged = verdict
            .and_then(|()| self.check_allowed(cx, given))
            .and_then(|()| self.judge_order(cx, dates, &given.order))
            .and_then(|text| {
                let moved_on =
                    "the mission has gone on while this was proven: look, and move again";
                if proof.is_still_about(cx) { Ok(text) } else { Err(moved_on.to_owned()) }
            });
        let (accepted, text) = self.write_down(cx, given, judged);
        let IncomingOrder { connection, request, .. } = *given;
        cx.add_action(ControllerAction::Answer { connection, request, accepted, text });
    }
}

/// Whether an order that is accepted leaves the mission as it is.
fn changes_nothing(cx: &Context, order: &MissionOrder) -> bool {
    match order {
        MissionOrder::Pause => cx.ledger().pause().is_some(),
        MissionOrder::Safe => cx.ledger().stage() == MissionStage::Retreating,
        _ => false,
    }
}

fn judge_firing(cx: &Context, dates: &MissionDates, name: &str) -> Result<String, String> {
    let id = transition_ordered(cx, name)?;
    let (net, state) = (cx.plan().net(), cx.ledger().state());
    if cx.plan().transition(id).autonomy == Autonomy::Auto {
        return Err(format!("`{name}` is not the operator's: it fires by itself"));
    }
    let Some(earliest) = state.earliest(id).filter(|_| !dates.waits_for_utc(cx.plan(), id)) else {
        return Err(format!("`{name}` is not enabled: {}", firing_hindrance(cx, dates, id)));
    };
    if net.transition(id).class == FiringClass::Ordinary
        && let Some(pause) = cx.ledger().pause()
    {
        return Err(format!("the mission is paused, by {}: resume it first", pause.by));
    }
    if earliest > cx.now() {
        let left_s = (earliest - cx.now()).as_secs_f64();
        return Err(format!("`{name}` may not fire yet: its time comes in {left_s:.1} s"));
    }
    Ok(format!("`{name}` fires"))
}

fn judge_answer(cx: &Context, name: &str) -> Result<(), String> {
    let id = transition_ordered(cx, name)?;
    match cx.ledger().authority().consent(id) {
        Some(Consent::Asked(_)) => Ok(()),
        Some(Consent::Granted) => Err(format!("`{name}` has been confirmed already")),
        Some(Consent::Declined) => Err(format!("`{name}` has been declined already")),
        None => Err(format!("`{name}` asks nothing now")),
    }
}

fn transition_ordered(cx: &Context, name: &str) -> Result<TransitionId, String> {
    cx.plan().transition_named(name).ok_or_else(|| {
        let known = cx.plan().net().transitions().iter().map(|it| it.name.as_str());
        unknown_name("transition", name, known)
    })
}

/// The refusal of an order that names a part of the mission that does not exist.
pub(super) fn unknown_name<'a>(
    what: &str,
    name: &str,
    known: impl Iterator<Item = &'a str>,
) -> String {
    let known: Vec<_> = known.collect();
    let advice = advise_similar(name, known.iter().copied());
    if !advice.is_empty() || known.is_empty() {
        return format!("the mission has no {what} called `{name}`{advice}");
    }
    let more = if known.len() > MAX_LISTED { ", …" } else { "" };
    let listed = known[..known.len().min(MAX_LISTED)].join(", ");
    format!("the mission has no {what} called `{name}`; it has: {listed}{more}")
}

fn in_command(order: &MissionOrder) -> String {
    match order {
        MissionOrder::Release => "the command is given back".into(),
        _ => "the command is yours".into(),
    }
}
