//! Tokens that an operator moves during a pause. What would be wrong afterwards is found before
//! anything is moved; then the move is proven from where the tokens would be, as a new version of
//! the file is. A proof takes its time, so it is a question that another thread answers, and the
//! order is answered after it.

use super::context::Context;
use super::operators::unknown_name;
use crate::event::ControllerAction;
use crate::incoming_order::IncomingOrder;
use crate::judging::MoveQuestion;
use crate::ledger::Ledger;
use crate::order::{MissionOrder, MovedTokens};
use armor_petri::PlaceId;
use armor_plan::{Plan, Stand};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// An order that is being proven.
#[derive(Clone, Debug)]
pub(super) struct MoveProof {
    given: IncomingOrder,
    /// Names the answer.
    serial: u64,
    before: Stand,
    after: Stand,
}

impl MoveProof {
    pub(super) fn given(&self) -> &IncomingOrder {
        &self.given
    }

    /// Whether the mission still stands where the proof began.
    pub(super) fn is_still_about(&self, cx: &Context) -> bool {
        let MissionOrder::Move(moves) = &self.given.order else {
            return false;
        };
        stand_after(cx, &[]) == self.before && stand_after(cx, moves) == self.after
    }
}

/// The move that is being proven; one at a time.
#[derive(Clone, Debug, Default)]
pub(super) struct MoveProofs {
    proving: Option<MoveProof>,
    /// Moves that this process was asked about.
    asked: u64,
}

impl MoveProofs {
    pub(super) fn is_proving(&self) -> bool {
        self.proving.is_some()
    }

    pub(super) fn move_question(&self, plan: &Arc<Plan>) -> Option<MoveQuestion> {
        let MoveProof { serial, before, after, .. } = self.proving.clone()?;
        Some(MoveQuestion { serial, plan: Arc::clone(plan), before, after })
    }

    /// Whether the same order is being proven already; its answer then goes to the newest
    /// connection.
    pub(super) fn is_repeated(&mut self, given: &IncomingOrder) -> bool {
        let Some(proof) = &mut self.proving else {
            return false;
        };
        let known = &mut proof.given;
        let same = known.request == given.request && known.by.author == given.by.author;
        if same {
            known.connection = given.connection;
        }
        same
    }

    pub(super) fn begin_proof(
        &mut self,
        cx: &mut Context,
        given: &IncomingOrder,
        moves: &[MovedTokens],
    ) {
        self.asked += 1;
        let (before, after) = (stand_after(cx, &[]), stand_after(cx, moves));
        let (given, serial) = (given.clone(), self.asked);
        self.proving = Some(MoveProof { given, serial, before, after });
        cx.add_action(ControllerAction::JudgeMove);
    }

    /// Ends the proof that an answer is about; none if it was overtaken.
    pub(super) fn end_proof(&mut self, serial: u64) -> Option<MoveProof> {
        self.proving.take_if(|proof| proof.serial == serial)
    }
}

/// Returns where the mission stands after some moves; tokens on their way count as put.
fn stand_after(cx: &Context, moves: &[MovedTokens]) -> Stand {
    let mut marking = cx.ledger().marking().to_vec();
    for it in moves {
        // A move that cannot be carried out was refused before.
        _ = move_one(cx.plan(), it, &mut marking);
    }
    for (place, tokens) in tokens_arriving(cx.ledger()) {
        let there = &mut marking[place.index()];
        *there = there.saturating_add(u32::try_from(tokens).unwrap_or(u32::MAX));
    }
    Stand { marking, counters: cx.ledger().counters().to_vec() }
}

/// Judges whether these tokens may be moved, all of them in one step. Returns what follows, or all
/// that is wrong.
pub(super) fn judge_moves(cx: &Context, moves: &[MovedTokens]) -> Result<String, String> {
    let names = moves.iter().flat_map(|it| [&it.from, &it.to]);
    let unknown: Vec<_> = names.filter_map(|name| find_place(cx.plan(), name).err()).collect();
    if !unknown.is_empty() {
        return Err(unknown.join("; "));
    }
    if cx.ledger().pause().is_none() {
        return Err("tokens are moved only while the mission is paused: pause it first".into());
    }
    let mut wrong = Vec::new();
    let mut marking = cx.ledger().marking().to_vec();
    let mut touched = BTreeSet::new();
    for it in moves {
        match move_one(cx.plan(), it, &mut marking) {
            Ok(place) => _ = touched.insert(place),
            Err(why) => wrong.push(why),
        }
    }
    let arriving = tokens_arriving(cx.ledger());
    let of = |place: PlaceId| {
        let coming = arriving.get(&place).copied().unwrap_or(0);
        u64::from(marking[place.index()]) + coming
    };
    for place in touched {
        if !cx.plan().place(place).components.is_empty() && of(place) > 1 {
            let (name, tokens) = (cx.plan().net().place(place), of(place));
            let on_the_way = if arriving.contains_key(&place) { ", some on their way" } else { "" };
            wrong.push(format!(
                "`{name}` would hold {tokens} tokens{on_the_way}; a place with components holds one"
            ));
        }
    }
    wrong.extend(cx.plan().clashes(&|place| of(place) > 0));
    if !wrong.is_empty() {
        return Err(wrong.join("; "));
    }
    let count: u64 = moves.iter().map(|it| u64::from(it.tokens)).sum();
    let tokens = if count == 1 { "1 token is".into() } else { format!("{count} tokens are") };
    Ok(format!("{tokens} moved; what they activate starts when the mission continues"))
}

fn find_place(plan: &Plan, name: &str) -> Result<PlaceId, String> {
    plan.place_named(name)
        .ok_or_else(|| unknown_name("place", name, plan.net().places().iter().map(String::as_str)))
}

/// Carries out one move in `marking`; returns the place it leads to.
fn move_one(plan: &Plan, it: &MovedTokens, marking: &mut [u32]) -> Result<PlaceId, String> {
    let (from, to) = (find_place(plan, &it.from)?, find_place(plan, &it.to)?);
    if it.tokens == 0 || from == to {
        return Err(format!("from `{}` to `{}` nothing would move", it.from, it.to));
    }
    let there = marking[from.index()];
    marking[from.index()] = there
        .checked_sub(it.tokens)
        .ok_or_else(|| format!("`{}` holds {there} tokens, not {}", it.from, it.tokens))?;
    let sum = marking[to.index()].checked_add(it.tokens);
    marking[to.index()] = sum.ok_or_else(|| format!("`{}` cannot hold so many tokens", it.to))?;
    Ok(to)
}

/// Returns the tokens on their way into places.
fn tokens_arriving(ledger: &Ledger) -> BTreeMap<PlaceId, u64> {
    let mut arriving = BTreeMap::new();
    for &(place, tokens) in ledger.firings().values().flat_map(|firing| &firing.to) {
        *arriving.entry(place).or_insert(0) += u64::from(tokens);
    }
    arriving
}
