//! The path of messages through a running system: from the calls that each component reports to
//! traces, one for each message that begins one. Pure.
//!
//! A call belongs to the trace of the message that it was for. A component that stores its data and
//! publishes in its next tick continues the trace of what it received last since the tick before; the
//! others that it received meanwhile are linked. A robot is a closed loop: a trace ends where a tick of
//! the component that began it would continue it, and where the data are published again with which
//! traces are to begin. The next trace is then linked to it. Calls are put together a second after they began,
//! because the reports of different processes arrive in any order.

mod call_taps;
mod ids;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::Arc;

use armor_sdk::call_trace::{TracedCall, TracedInput};

pub use call_taps::{CallReport, CallTaps};

use ids::{SpanPart, span_id, trace_id};

/// Time after the beginning of a call at which it is put into its trace. Components report every
/// 0.2 s.
const SETTLED_AFTER_S: f64 = 1.0;
/// How long a published message can be continued by a call that receives it.
const CONTINUED_WITHIN_S: f64 = 30.0;
/// A tick later than this after the beginning of a trace begins another: a loop that does not lead
/// through the first component must end, too.
const LONGEST_TRACE_S: f64 = 10.0;
/// Most published messages that are remembered, and most calls that wait.
const MAX_REMEMBERED: usize = 200_000;

/// Where a part of a trace is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TracePlace {
    /// The trace.
    pub trace: u128,
    /// The span in it.
    pub span: u64,
}

/// Why a component's code was called.
#[derive(Clone, Debug, PartialEq)]
pub enum CallCause {
    /// The trace begins here.
    Origin {
        /// The calls of other traces that may have led to this one.
        after: Vec<TracePlace>,
    },
    /// This message.
    Message(ReceivedMessage),
    /// Messages that the component has received since its tick before.
    Held {
        /// The call that received the last of them.
        last: TracePlace,
        /// The data of that message.
        data: String,
        /// When that call had ended.
        since_s: f64,
        /// The calls that received the others.
        others: Vec<TracePlace>,
    },
}

/// A message that was handed to a component.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedMessage {
    /// The span from its publication to the end of the call.
    pub hop_span: u64,
    /// The span of the call that published it, and when that was; `None` if that call is not known.
    pub published: Option<(u64, f64)>,
    /// The message.
    pub input: TracedInput,
}

impl ReceivedMessage {
    /// When the message was published or, if that is not known, had arrived.
    pub fn begin_s(&self, call_began_s: f64) -> f64 {
        let known_s = self.published.map(|(_, at_s)| at_s).or(self.arrived_s());
        known_s.unwrap_or(call_began_s).min(call_began_s)
    }

    /// When it had arrived, if that is known.
    pub fn arrived_s(&self) -> Option<f64> {
        Some(self.input.arrived_s).filter(|at_s| *at_s > 0.0)
    }

    /// How long it was on its way, in seconds.
    pub fn transport_s(&self) -> Option<f64> {
        Some((self.arrived_s()? - self.published?.1).max(0.0))
    }
}

/// One call in its trace.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceStep {
    /// The component.
    pub component: String,
    /// Its process start.
    pub instance: u64,
    /// The trace, and the span of the call.
    pub place: TracePlace,
    /// When the trace began.
    pub trace_began_s: f64,
    /// Why it was called.
    pub cause: CallCause,
    /// The call as the component has reported it.
    pub call: TracedCall,
}

/// See the module.
#[derive(Debug, Default)]
pub struct TraceAssembly {
    /// Traces begin with these data; with all if it is empty.
    wanted: Vec<String>,
    waiting: Vec<WaitingCall>,
    published: HashMap<MessageKey, PublishedMessage>,
    /// The keys of `published`, oldest first, with the time.
    order: VecDeque<(f64, MessageKey)>,
    /// Of each component, its process start and the newest of each data since its last tick.
    held: BTreeMap<String, (u64, Vec<HeldMessage>)>,
    missed: u64,
}

/// Data, process start, sequence.
type MessageKey = (String, u64, u64);

/// How a trace began.
#[derive(Clone, Debug)]
struct TraceBegin {
    trace: u128,
    component: Arc<str>,
    at_s: f64,
}

#[derive(Clone, Debug)]
struct PublishedMessage {
    span: u64,
    begin: TraceBegin,
    at_s: f64,
}

#[derive(Debug)]
struct HeldMessage {
    span: u64,
    begin: TraceBegin,
    data: String,
    since_s: f64,
}

impl HeldMessage {
    fn place(&self) -> TracePlace {
        TracePlace { trace: self.begin.trace, span: self.span }
    }
}

#[derive(Debug)]
struct WaitingCall {
    component: String,
    instance: u64,
    call: TracedCall,
}

impl TraceAssembly {
    /// Traces that begin with one of these data, `component.output`; all traces if there are none.
    pub fn new(wanted: Vec<String>) -> Self {
        Self { wanted, ..Self::default() }
    }

    /// Takes a report of a component.
    pub fn add_report(&mut self, report: CallReport) {
        let CallReport { component, instance, calls, missed } = report;
        self.missed += missed;
        for call in calls {
            if self.waiting.len() >= MAX_REMEMBERED {
                self.missed += 1;
                continue;
            }
            self.waiting.push(WaitingCall { component: component.clone(), instance, call });
        }
    }

    /// How many calls are missing since the last time that this was asked.
    pub fn take_missed(&mut self) -> u64 {
        std::mem::take(&mut self.missed)
    }

    /// Puts the calls into their traces that began more than a second before `now_s`.
    pub fn settle(&mut self, now_s: f64) -> Vec<TraceStep> {
        let is_settled = |waiting: &WaitingCall| waiting.call.began_s <= now_s - SETTLED_AFTER_S;
        let (mut settled, rest) =
            std::mem::take(&mut self.waiting).into_iter().partition::<Vec<_>, _>(is_settled);
        self.waiting = rest;
        settled.sort_by(|a, b| a.call.began_s.total_cmp(&b.call.began_s));
        let steps = settled.into_iter().filter_map(|call| self.place_call(call)).collect();
        while let Some((at_s, _)) = self.order.front() {
            if *at_s >= now_s - CONTINUED_WITHIN_S && self.order.len() <= MAX_REMEMBERED {
                break;
            }
            if let Some((_, key)) = self.order.pop_front() {
                self.published.remove(&key);
            }
        }
        steps
    }

    fn place_call(&mut self, waiting: WaitingCall) -> Option<TraceStep> {
        let WaitingCall { component, instance, call } = waiting;
        let span = |part| span_id(instance, call.number, part);
        let (mut cause, mut begin) = self.find_cause(&component, instance, &call);
        let begins_again = self.publishes_wanted(&component, &call);
        if let CallCause::Held { last, others, .. } = &cause
            && let Some(of) = &begin
            && (*of.component == *component
                || call.began_s - of.at_s > LONGEST_TRACE_S
                || begins_again)
        {
            let after = others.iter().chain([last]).copied().collect();
            (cause, begin) = (CallCause::Origin { after }, None);
        }
        let begin = match begin.filter(|_| !begins_again) {
            Some(known) => known,
            None if self.begins_trace(&call) || begins_again => {
                let at_s = match &mut cause {
                    CallCause::Message(message) => {
                        if begins_again {
                            // The call that published it is of another trace.
                            message.published = None;
                        }
                        message.begin_s(call.began_s)
                    }
                    _ => call.began_s,
                };
                let component = match &cause {
                    CallCause::Message(message) if !begins_again => &message.input.data,
                    _ => &component,
                };
                // Of data, the component that publishes them.
                let component = component.split('.').next().unwrap_or(component).into();
                TraceBegin { trace: trace_id(instance, call.number), component, at_s }
            }
            None => return None,
        };
        let place = TracePlace { trace: begin.trace, span: span(SpanPart::Call) };
        for message in &call.published {
            let key = (format!("{component}.{}", message.output), instance, message.sequence);
            self.order.push_back((message.at_s, key.clone()));
            let (at_s, begin) = (message.at_s, begin.clone());
            self.published.insert(key, PublishedMessage { span: place.span, begin, at_s });
        }
        let trace_began_s = begin.at_s;
        if let Some(input) = &call.input {
            let (data, since_s) = (input.data.clone(), call.ended_s);
            let (of, held) = self.held.entry(component.clone()).or_default();
            held.retain(|it| *of == instance && it.data != data);
            *of = instance;
            held.push(HeldMessage { span: place.span, begin, data, since_s });
        }
        Some(TraceStep { component, instance, place, trace_began_s, cause, call })
    }

    /// Finds why a component was called, and the trace that this continues.
    fn find_cause(
        &mut self,
        component: &str,
        instance: u64,
        call: &TracedCall,
    ) -> (CallCause, Option<TraceBegin>) {
        if let Some(input) = &call.input {
            let key = (input.data.clone(), input.instance, input.sequence);
            let before = self.published.get(&key);
            let message = ReceivedMessage {
                hop_span: span_id(instance, call.number, SpanPart::Hop),
                published: before.map(|it| (it.span, it.at_s)),
                input: input.clone(),
            };
            return (CallCause::Message(message), before.map(|it| it.begin.clone()));
        }
        let held = (call.function == "exec").then(|| self.held.remove(component)).flatten();
        let held = held.filter(|(of, _)| *of == instance);
        let Some((last, others)) = held.and_then(|(_, mut held)| Some((held.pop()?, held))) else {
            return (CallCause::Origin { after: Vec::new() }, None);
        };
        let (place, others) = (last.place(), others.iter().map(HeldMessage::place).collect());
        let HeldMessage { begin, data, since_s, .. } = last;
        (CallCause::Held { last: place, data, since_s, others }, Some(begin))
    }

    fn is_wanted(&self, data: &str) -> bool {
        self.wanted.iter().any(|name| name == data)
    }

    /// Whether a call publishes data with which traces are to begin.
    fn publishes_wanted(&self, component: &str, call: &TracedCall) -> bool {
        let is_wanted = |output: &str| self.is_wanted(&format!("{component}.{output}"));
        !self.wanted.is_empty() && call.published.iter().any(|it| is_wanted(&it.output))
    }

    /// Whether a call that continues no trace begins one. A call that receives and publishes nothing
    /// would be a trace of its own.
    fn begins_trace(&self, call: &TracedCall) -> bool {
        if self.wanted.is_empty() {
            return call.input.is_some() || !call.published.is_empty();
        }
        call.input.as_ref().is_some_and(|input| self.is_wanted(&input.data))
    }
}
