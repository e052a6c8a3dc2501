//! Tokens that an operator wants moved: proven from where they would be before anything is moved, as
//! a new version of the file is. That takes its time, so it is a question that somebody answers
//! elsewhere, and the order is answered then.

use crate::controller::Controller;
use crate::event::{Action, Event};
use crate::judging::judge_move;
use crate::operator::Given;
use crate::order::{Order, TokenMove};
use armor_plan::{Plan, Stand};
use std::sync::Arc;

/// An order that is being proven.
#[derive(Clone, Debug)]
pub(crate) struct Moving {
    given: Given,
    /// Counts the moves that were asked about.
    serial: u64,
    before: Stand,
    after: Stand,
}

/// Whether it is safe to move tokens: nothing bad follows from where they would be that does not
/// follow from where they are.
#[derive(Clone, Debug)]
pub struct MoveQuestion {
    /// Names the answer.
    pub serial: u64,
    plan: Arc<Plan>,
    before: Stand,
    after: Stand,
}

impl MoveQuestion {
    /// Finds the answer, which may take seconds.
    pub fn answer(&self) -> Event {
        let verdict = judge_move(&self.plan, &self.before, &self.after);
        Event::MoveJudged { serial: self.serial, verdict }
    }
}

impl Controller {
    /// The question that [`Action::JudgeMove`] asks; none if it has been answered.
    pub fn move_question(&self) -> Option<MoveQuestion> {
        let Moving { serial, before, after, .. } = self.moving.clone()?;
        Some(MoveQuestion { serial, plan: Arc::clone(&self.plan), before, after })
    }

    /// Whether the same order is being proven already; it is answered where it was given last.
    pub(crate) fn is_being_proven(&mut self, given: &Given) -> bool {
        let Some(moving) = &mut self.moving else { return false };
        let (known, author) = (moving.given.request, &moving.given.by.author);
        let same = known == given.request && *author == given.by.author;
        if same {
            moving.given.connection = given.connection;
        }
        same
    }

    /// Takes an order up that has to be proven first, if it is one and could be carried out.
    pub(crate) fn has_to_be_proven(&mut self, given: &Given) -> bool {
        let Order::Move(moves) = &given.order else { return false };
        if self.allow(given).and_then(|()| self.judge(&given.order)).is_err() {
            return false;
        }
        self.moves += 1;
        let (before, after) = (self.stand_after(&[]), self.stand_after(moves));
        self.moving = Some(Moving { given: given.clone(), serial: self.moves, before, after });
        self.actions.push(Action::JudgeMove);
        true
    }

    /// What came of a question: the order is carried out if nothing speaks against it by now.
    pub(crate) fn move_judged(&mut self, serial: u64, verdict: Result<(), String>) {
        let Some(moving) = self.moving.take_if(|moving| moving.serial == serial) else { return };
        let Moving { given, before, after, .. } = moving;
        let Order::Move(moves) = &given.order else { return };
        let judged = verdict
            .and_then(|()| self.allow(&given))
            .and_then(|()| self.judge(&given.order))
            .and_then(|text| {
                let same = self.stand_after(&[]) == before && self.stand_after(moves) == after;
                let moved_on =
                    "the mission has gone on while this was proven: look, and move again";
                if same { Ok(text) } else { Err(moved_on.to_owned()) }
            });
        let (accepted, text) = self.write_down(&given, judged);
        let Given { connection, request, .. } = given;
        self.actions.push(Action::Answer { connection, request, accepted, text });
    }

    /// Where the mission stands after some moves; tokens on their way count as put.
    fn stand_after(&self, moves: &[TokenMove]) -> Stand {
        let mut marking = self.ledger.marking().to_vec();
        for it in moves {
            // What cannot be moved is refused before.
            _ = self.move_one(it, &mut marking);
        }
        for (place, tokens) in self.arriving() {
            let there = &mut marking[place.index()];
            *there = there.saturating_add(u32::try_from(tokens).unwrap_or(u32::MAX));
        }
        Stand { marking, counters: self.ledger.counters.clone() }
    }
}
