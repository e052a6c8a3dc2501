//! Two operators who send any order at any time, lose their connections, and repeat orders; and
//! what must be true whatever they do.

use super::Play;
use crate::event::{ControllerAction, ControllerEvent};
use crate::incoming_order::IncomingOrder;
use crate::order::{Giver, MissionOrder, MovedTokens};
use crate::record::{JournalEntry, JournalRecord};
use armor_petri::{FiringClass, PlaceId};
use std::collections::BTreeMap;
use std::time::Duration;

/// The orders that the operators still have to send, and the answers they received.
#[derive(Default)]
pub(super) struct Operators {
    /// Orders still to be sent.
    left: usize,
    next_at: Option<Duration>,
    requests: u64,
    connections: u64,
    /// The last order, which an operator may send again.
    last: Option<IncomingOrder>,
    /// The answer to each order, by request number.
    answers: BTreeMap<u64, (bool, String)>,
}

impl Operators {
    pub(super) fn new(orders: usize) -> Self {
        Self { left: orders, next_at: Some(Duration::ZERO), ..Self::default() }
    }

    pub(super) fn next_at(&self) -> Option<Duration> {
        self.next_at.filter(|_| self.left > 0)
    }

    /// Checks that an order gets the same answer each time it is sent.
    pub(super) fn note_answer(&mut self, request: u64, accepted: bool, text: &str) {
        if request == 0 {
            // Not the answer to an order: the former holder of the lease learns that it lost it.
            assert!(!accepted, "{text}");
            return;
        }
        let answer = (accepted, text.to_owned());
        let before = self.answers.entry(request).or_insert_with(|| answer.clone());
        assert_eq!(*before, answer, "order {request} is answered otherwise than before");
    }
}

impl Play {
    /// Draws the next action of an operator.
    pub(super) fn operators_act(&mut self) -> ControllerEvent {
        let dice = &mut self.world.dice;
        self.operators.left -= 1;
        // Without intervals between orders no mission would get anywhere.
        self.operators.next_at = Some(self.world.now + dice.up_to_ms(6000));
        self.operators.connections += 1;
        let connection = self.operators.connections;
        if dice.one_in(8) {
            return ControllerEvent::OperatorLeft {
                connection: dice.roll(connection as usize + 1) as u64,
            };
        }
        if dice.one_in(6)
            && let Some(last) = self.operators.last.clone()
        {
            return ControllerEvent::Ordered(IncomingOrder { connection, ..last });
        }
        self.operators.requests += 1;
        let request = self.operators.requests;
        let instance = 1 + dice.roll(2) as u64;
        let (author, take) = (format!("operator-{instance}"), dice.one_in(4));
        let by = Giver { author, from: "simulated".to_owned(), instance };
        let order = self.random_order();
        let given = IncomingOrder { connection, request, by, take, order };
        self.operators.last = Some(given.clone());
        ControllerEvent::Ordered(given)
    }

    fn random_order(&mut self) -> MissionOrder {
        let (dice, net) = (&mut self.world.dice, self.plan.net());
        let transition = net.transitions()[dice.roll(net.transitions().len())].name.clone();
        let place = |dice: &mut super::Dice| net.places()[dice.roll(net.places().len())].clone();
        let marked: Vec<_> = self.plan.place_ids().filter(|p| self.oracle[p.index()] > 0).collect();
        // Mostly a marked place: from an empty one every move is refused.
        let filled = |dice: &mut super::Dice| match marked.len() {
            some if some > 0 && !dice.one_in(8) => net.place(marked[dice.roll(some)]).to_owned(),
            _ => place(dice),
        };
        // Tokens can be moved only in a pause, so moves are drawn mostly then.
        if dice.one_in(if self.paused { 2 } else { 12 }) {
            let count = 1 + dice.roll(2);
            let moves = (0..count).map(|_| MovedTokens {
                from: filled(dice),
                to: place(dice),
                tokens: 1 + u32::from(dice.one_in(6)),
            });
            return MissionOrder::Move(moves.collect());
        }
        match dice.roll(14) {
            0..3 => MissionOrder::Fire(transition),
            3..5 => MissionOrder::Confirm(transition),
            5 => MissionOrder::Decline(transition),
            6..8 => MissionOrder::Pause,
            8..11 => MissionOrder::Resume,
            11 | 12 => MissionOrder::Lease,
            _ if dice.one_in(8) => MissionOrder::Rejoin,
            _ if dice.one_in(8) => MissionOrder::Safe,
            _ => MissionOrder::Release,
        }
    }

    /// Applies an accepted order to the oracle's marking.
    pub(super) fn note_order(&mut self, record: &JournalRecord) {
        match &record.entry {
            JournalEntry::Ordered(judged) if judged.accepted => match &judged.order {
                MissionOrder::Safe => self.give_up(),
                MissionOrder::Pause => self.paused = true,
                MissionOrder::Resume => self.paused = false,
                MissionOrder::Move(moves) => self.note_moves(moves),
                _ => {}
            },
            JournalEntry::Held { .. } => self.paused = true,
            JournalEntry::Retreated { .. } => self.give_up(),
            _ => {}
        }
    }

    fn give_up(&mut self) {
        // A retreat that is already under way continues.
        if !self.gave_up {
            self.oracle.fill(0);
            self.in_flight.clear();
        }
        (self.gave_up, self.paused) = (true, false);
    }

    fn note_moves(&mut self, moves: &[MovedTokens]) {
        assert!(self.paused, "tokens are moved only in a pause");
        for it in moves {
            let (from, to) = (self.plan.place_named(&it.from), self.plan.place_named(&it.to));
            self.oracle[from.unwrap().index()] -= i64::from(it.tokens);
            self.oracle[to.unwrap().index()] += i64::from(it.tokens);
        }
        let marked = |place: &PlaceId| self.oracle[place.index()] > 0;
        for component in self.plan.component_ids() {
            let planned = self.plan.component(component);
            let clash = planned.places.iter().any(marked)
                && planned.peers.iter().any(|p| self.plan.component(*p).places.iter().any(marked));
            assert!(!clash, "tokens were moved to where {} clashes", planned.name);
        }
        for it in moves {
            let place = self.plan.place_named(&it.to).unwrap();
            let tokens = self.oracle[place.index()];
            assert!(self.plan.place(place).components.is_empty() || tokens <= 1, "{}", it.to);
        }
    }

    /// Checks that in a pause only transitions of the safety class fire and only components of
    /// safety places start.
    pub(super) fn check_pause(&self, action: &ControllerAction) {
        if !self.paused {
            return;
        }
        match action {
            ControllerAction::Activate { component, .. } => {
                let places = &self.plan.component(*component).places;
                let safety = places.iter().any(|place| self.plan.place(*place).safety);
                let name = &self.plan.component(*component).name;
                assert!(safety, "{name} is activated in a pause");
            }
            ControllerAction::Journal(JournalRecord {
                entry: JournalEntry::Took { cause, .. },
                ..
            }) => {
                let crate::terms::Cause::Transition(name) = cause else {
                    return;
                };
                let id = self.plan.transition_named(name).unwrap();
                let class = self.plan.net().transition(id).class;
                assert_eq!(class, FiringClass::Safety, "{name} fires in a pause");
            }
            _ => {}
        }
    }
}
