//! Orders of operators: who may give them, which can be carried out, and what becomes of the
//! lease when the link to its holder breaks.

use crate::authority::{Consent, Lease};
use crate::controller::Controller;
use crate::event::Action;
use crate::ledger::Stage;
use crate::order::{Giver, Judged, Order};
use crate::record::Entry;
use armor_petri::{Class, TransitionId};
use armor_robotfile::mission::Autonomy;
use armor_sdk::orders::GivenOrder;
use std::time::Duration;

/// How many refused orders are written down within a time.
const REFUSALS: usize = 10;
/// That time.
const REFUSALS_WITHIN: Duration = Duration::from_secs(1);

/// An order as it arrives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Given {
    /// The connection it came on, for the answer.
    pub connection: u64,
    /// Names it, wherever it is repeated.
    pub request: u64,
    /// Who gives it.
    pub by: Giver,
    /// Whether to take the command over from whoever holds it.
    pub take: bool,
    /// What is to be done.
    pub order: Order,
}

impl From<GivenOrder> for Given {
    fn from(given: GivenOrder) -> Self {
        let GivenOrder { connection, from, instance, request, author, take, order } = given;
        let by = Giver { author, from, instance };
        Self { connection, request, by, take, order: order.into() }
    }
}

/// The connection of whoever holds the lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Link {
    /// Up; it has this number.
    Up(u64),
    /// Down since then.
    Down(Duration),
}

impl Controller {
    /// Judges an order, writes it down, and answers. One that is repeated gets its answer again.
    pub(crate) fn order(&mut self, given: Given) {
        if self.is_being_proven(&given) {
            return;
        }
        let mut past = self.ledger.authority.orders.iter().rev();
        let known = past
            .find(|past| past.0.request == given.request && past.0.by.author == given.by.author);
        let known = known.map(|known| (known.0.accepted, known.0.text.clone()));
        if known.is_none() && self.has_to_be_proven(&given) {
            return;
        }
        let (accepted, text) = known.unwrap_or_else(|| self.judge_and_record(&given));
        let holder = self.ledger.authority.lease.as_ref().map(|lease| lease.by.instance);
        let holds = matches!(given.order, Order::Lease | Order::Rejoin);
        if holds && holder == Some(given.by.instance) {
            self.link = Link::Up(given.connection);
        }
        let Given { connection, request, .. } = given;
        self.actions.push(Action::Answer { connection, request, accepted, text });
    }

    /// The connection of an operator has ended.
    pub(crate) fn operator_left(&mut self, connection: u64) {
        if self.link == Link::Up(connection) {
            self.link = Link::Down(self.host);
        }
    }

    /// When a lease whose holder is not connected runs out.
    pub(crate) fn lease_due(&self) -> Option<Duration> {
        match (self.ledger.lease(), self.link) {
            (Some(_), Link::Down(since)) if !self.stopping => {
                Some(since + self.plan.limits().lease)
            }
            _ => None,
        }
    }

    pub(crate) fn notice_lost_link(&mut self) {
        if self.lease_due().is_some_and(|due| due <= self.host)
            && let Some(Lease { by, .. }) = self.ledger.lease().cloned()
        {
            self.record(Entry::LinkLost { author: by.author });
        }
    }

    /// Whether so many refused orders were written down lately that one more is only counted: who
    /// asks for what cannot be had does not fill the journal.
    fn has_refused_enough(&self) -> bool {
        let orders = self.ledger.authority.orders.iter().rev();
        let lately = orders.take_while(|past| past.1 + REFUSALS_WITHIN > self.now);
        lately.filter(|past| !past.0.accepted).count() >= REFUSALS
    }

    fn judge_and_record(&mut self, given: &Given) -> (bool, String) {
        let judged = self.allow(given).and_then(|()| self.judge(&given.order));
        self.write_down(given, judged)
    }

    /// Writes down what has become of an order; what is too many is only counted.
    pub(crate) fn write_down(
        &mut self,
        given: &Given,
        judged: Result<String, String>,
    ) -> (bool, String) {
        let ousted = self.ledger.lease().map(|lease| lease.by.clone());
        let ousted = ousted.filter(|by| given.take && by.instance != given.by.instance);
        let (accepted, text) = match (judged, &ousted) {
            (Ok(text), Some(by)) => {
                (true, format!("{text}; the command is taken from {}", by.author))
            }
            (Ok(text), None) => (true, text),
            (Err(text), _) => (false, text),
        };
        if !accepted && self.has_refused_enough() {
            self.dropped.orders += 1;
            return (accepted, text);
        }
        let Given { request, by, take, order, .. } = given.clone();
        let text_kept = text.clone();
        let taker = by.author.clone();
        self.record(Entry::Ordered(Judged { request, by, take, order, accepted, text }));
        if let (true, Some(_), Link::Up(connection)) = (accepted, ousted, self.link) {
            // Whoever held it is told at once, and not when the next order is refused.
            let text = format!("{taker} has taken the command over");
            self.actions.push(Action::Answer { connection, request: 0, accepted: false, text });
        }
        (accepted, text_kept)
    }

    /// Whether this operator may give this order now.
    pub(crate) fn allow(&self, given: &Given) -> Result<(), String> {
        if self.stopping {
            return Err("the executive is being stopped; the mission can be resumed later".into());
        }
        let needs_own = matches!(given.order, Order::Release | Order::Rejoin);
        let Some(lease) = self.ledger.lease() else {
            let why = "nobody holds the command";
            return if needs_own { Err(why.into()) } else { Ok(()) };
        };
        let own = lease.by.instance == given.by.instance;
        if own || given.order.is_open_to_all() || (given.take && !needs_own) {
            return Ok(());
        }
        let Giver { author, from, .. } = &lease.by;
        let link = match self.link {
            Link::Up(_) => String::new(),
            Link::Down(since) => {
                let for_s = self.host.saturating_sub(since).as_secs_f64();
                format!(", whose link has been down for {for_s:.1} s")
            }
        };
        Err(format!(
            "{author} commands this mission ({from}{link}): ask for the command, or take it over"
        ))
    }

    /// Whether an order can be carried out, and what follows from it.
    pub(crate) fn judge(&self, order: &Order) -> Result<String, String> {
        if self.ledger.stage != Stage::Playing {
            return match order {
                Order::Safe if self.ledger.stage == Stage::Retreating => {
                    Ok("the mission is on its way to its safe place".into())
                }
                Order::Lease | Order::Release | Order::Rejoin => Ok(in_command(order)),
                _ => Err("the mission is ending".into()),
            };
        }
        match order {
            Order::Lease | Order::Release | Order::Rejoin => Ok(in_command(order)),
            Order::Fire(name) => self.judge_firing(name),
            Order::Pause => Ok(match self.ledger.pause() {
                Some(pause) => format!("the mission is paused already, by {}", pause.by),
                None => "the mission is paused".into(),
            }),
            Order::Resume => match self.ledger.pause() {
                Some(_) => Ok("the mission goes on".into()),
                None => Err("the mission is not paused".into()),
            },
            Order::Safe => Ok(match self.plan.safe() {
                Some(place) => format!("the mission goes to `{}`", self.plan.net().place(place)),
                None => "the mission is given up: it has no safe place".into(),
            }),
            Order::Move(_) if self.moving.is_some() => {
                Err("another move is being proven: wait for what comes of it".into())
            }
            Order::Move(moves) => self.judge_moves(moves),
            Order::Confirm(name) => {
                self.judge_answer(name)?;
                let held = self.ledger.pause().is_some();
                Ok(format!("`{name}` fires{}", if held { " when the mission goes on" } else { "" }))
            }
            Order::Decline(name) => {
                self.judge_answer(name)?;
                Ok(format!("`{name}` does not fire, and asks again when it is newly enabled"))
            }
        }
    }

    fn judge_firing(&self, name: &str) -> Result<String, String> {
        let id = self.transition_ordered(name)?;
        let (net, state) = (self.plan.net(), &self.ledger.state);
        if self.plan.transition(id).autonomy == Autonomy::Auto {
            return Err(format!("`{name}` is not the operator's: it fires by itself"));
        }
        let Some(earliest) = state.earliest(id).filter(|_| !self.waits_for_utc(id)) else {
            return Err(format!("`{name}` is not enabled: {}", self.hindrance(id)));
        };
        if net.transition(id).class == Class::Ordinary
            && let Some(pause) = self.ledger.pause()
        {
            return Err(format!("the mission is paused, by {}: resume it first", pause.by));
        }
        if earliest > self.now {
            let left_s = (earliest - self.now).as_secs_f64();
            return Err(format!("`{name}` may not fire yet: its time comes in {left_s:.1} s"));
        }
        Ok(format!("`{name}` fires"))
    }

    fn judge_answer(&self, name: &str) -> Result<(), String> {
        let id = self.transition_ordered(name)?;
        match self.ledger.authority.consents.get(&id) {
            Some(Consent::Asked(_)) => Ok(()),
            Some(Consent::Granted) => Err(format!("`{name}` has been confirmed already")),
            Some(Consent::Declined) => Err(format!("`{name}` has been declined already")),
            None => Err(format!("`{name}` asks nothing now")),
        }
    }

    fn transition_ordered(&self, name: &str) -> Result<TransitionId, String> {
        self.plan
            .transition_named(name)
            .ok_or_else(|| format!("the mission has no transition called `{name}`"))
    }

    /// Why a transition is not enabled, in words.
    fn hindrance(&self, id: TransitionId) -> String {
        let (net, state) = (self.plan.net(), &self.ledger.state);
        let transition = net.transition(id);
        let needs = transition.inputs.iter().chain(&transition.reads);
        if let Some((place, weight)) = needs.clone().find(|arc| state.tokens(arc.0) < arc.1) {
            let (place, tokens) = (net.place(*place), state.tokens(*place));
            return format!("`{place}` holds {tokens} of the {weight} tokens it needs");
        }
        let inhibited = transition.inhibitors.iter().find(|arc| state.tokens(arc.0) >= arc.1);
        if let Some((place, _)) = inhibited {
            return format!("a token in `{}` keeps it from firing", net.place(*place));
        }
        if let Some(why) = self.date_against(id) {
            return why;
        }
        match &self.plan.transition(id).on {
            Some((component, report)) => {
                let component = &self.plan.component(*component).name;
                format!("it waits for `{component}.{report}`")
            }
            None => "its condition does not hold".into(),
        }
    }
}

fn in_command(order: &Order) -> String {
    match order {
        Order::Release => "the command is given back".into(),
        _ => "the command is yours".into(),
    }
}
