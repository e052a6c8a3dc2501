//! A step of a trace as a line, for people and for programs.

use anyhow::Result;
use armor_inspect::{CallCause, TracePlace, TraceStep};
use serde_json::{Value, json};

use super::hex_trace;
use crate::arguments::OutputFormat;
use crate::print::print_line;

/// How many digits of a trace's id a line for people has.
const SHORT_ID: usize = 8;

/// Prints steps; for people with a heading.
#[derive(Default)]
pub struct LinePrinter {
    has_heading: bool,
}

impl LinePrinter {
    /// Prints a step.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn print(&mut self, step: &TraceStep, format: OutputFormat) -> Result<()> {
        if format == OutputFormat::Json {
            return print_line(json_of(step));
        }
        if !std::mem::replace(&mut self.has_heading, true) {
            print_line(format_args!(
                "{:8} {:>10} {:>9} {:>9} {:>9}  CALL",
                "TRACE", "AT ms", "WAY ms", "WAIT ms", "CALL ms"
            ))?;
        }
        print_line(format_step(step))
    }
}

/// `WAY` is the time from publication to arrival, `WAIT` from there to the call.
fn format_step(step: &TraceStep) -> String {
    let call = &step.call;
    let milliseconds = |seconds: Option<f64>| match seconds {
        Some(seconds) => format!("{:.3}", seconds * 1e3),
        None => "-".into(),
    };
    let (way_s, wait_s, from) = match &step.cause {
        CallCause::Origin { .. } => (None, None, String::new()),
        CallCause::Message(message) => {
            let wait_s = message.arrived_s().map(|arrived_s| (call.began_s - arrived_s).max(0.0));
            let lost = match message.input.lost {
                0 => String::new(),
                lost => format!(", {lost} lost before it"),
            };
            let from = format!(" {} #{}{lost}", message.input.data, message.input.sequence);
            (message.transport_s(), wait_s, from)
        }
        CallCause::Held { data, since_s, others, .. } => {
            let others = match others.len() {
                0 => String::new(),
                count => format!(" and {count} more"),
            };
            (None, Some((call.began_s - since_s).max(0.0)), format!(" after {data}{others}"))
        }
    };
    let published: Vec<_> =
        call.published.iter().map(|it| format!("{} #{}", it.output, it.sequence)).collect();
    let published = match published.as_slice() {
        [] => String::new(),
        some => format!(" → {}", some.join(", ")),
    };
    format!(
        "{} {:>10.3} {:>9} {:>9} {:>9.3}  {}.{}{from}{published}{}",
        &hex_trace(step)[..SHORT_ID],
        (call.began_s - step.trace_began_s) * 1e3,
        milliseconds(way_s),
        milliseconds(wait_s),
        (call.ended_s - call.began_s) * 1e3,
        step.component,
        call.function,
        if call.has_failed { " (failed)" } else { "" },
    )
}

fn name_place(place: &TracePlace) -> Value {
    json!({
        "trace_id": format!("{:032x}", place.trace),
        "span_id": format!("{:016x}", place.span),
    })
}

fn json_of(step: &TraceStep) -> Value {
    let call = &step.call;
    let cause = match &step.cause {
        CallCause::Origin { after } => {
            let after: Vec<_> = after.iter().map(name_place).collect();
            json!({"kind": "origin", "after": after})
        }
        CallCause::Message(message) => json!({
            "kind": "message",
            "data": message.input.data,
            "input": message.input.input,
            "sequence": message.input.sequence,
            "stamp_s": message.input.stamp_s,
            "lost": message.input.lost,
            "publisher_span_id": message.published.map(|(span, _)| format!("{span:016x}")),
            "published_s": message.published.map(|(_, at_s)| at_s),
            "arrived_s": message.arrived_s(),
        }),
        CallCause::Held { last, data, since_s, others } => json!({
            "kind": "held",
            "data": data,
            "receiver_span_id": format!("{:016x}", last.span),
            "since_s": since_s,
            "others": others.iter().map(name_place).collect::<Vec<_>>(),
        }),
    };
    let published: Vec<_> = call
        .published
        .iter()
        .map(|it| {
            let data = format!("{}.{}", step.component, it.output);
            json!({"data": data, "sequence": it.sequence, "at_s": it.at_s})
        })
        .collect();
    json!({
        "trace_id": hex_trace(step),
        "span_id": format!("{:016x}", step.place.span),
        "component": step.component,
        "function": call.function,
        "cause": cause,
        "began_s": call.began_s,
        "ended_s": call.ended_s,
        "failed": call.has_failed,
        "published": published,
    })
}

#[cfg(test)]
mod tests {
    use armor_inspect::{CallReport, TraceAssembly};
    use armor_sdk::call_trace::{TracedCall, TracedInput, TracedOutput};

    use super::*;

    #[test]
    fn a_line_has_the_times_of_the_way_the_wait_and_the_call() {
        let published = vec![TracedOutput { output: "scan".into(), sequence: 5, at_s: 100.002 }];
        let scan = TracedCall {
            function: "exec".into(),
            began_s: 100.0,
            ended_s: 100.003,
            published,
            ..TracedCall::default()
        };
        let input = TracedInput {
            input: "scan".into(),
            data: "laser.scan".into(),
            instance: 1,
            sequence: 5,
            arrived_s: 100.004,
            lost: 2,
            ..TracedInput::default()
        };
        let pose = TracedCall {
            function: "data_received".into(),
            began_s: 100.010,
            ended_s: 100.030,
            has_failed: true,
            input: Some(input),
            ..TracedCall::default()
        };
        let mut assembly = TraceAssembly::default();
        for (component, instance, call) in [("laser", 1, scan), ("mapper", 2, pose)] {
            let (component, calls) = (component.into(), vec![call]);
            assembly.add_report(CallReport { component, instance, calls, missed: 0 });
        }
        let steps = assembly.settle(200.0);
        let lines: Vec<_> =
            steps.iter().map(|step| format_step(step)[SHORT_ID..].to_owned()).collect();
        assert_eq!(
            lines,
            [
                "      0.000         -         -     3.000  laser.exec → scan #5",
                "     10.000     2.000     6.000    20.000  mapper.data_received laser.scan #5, 2 lost \
                 before it (failed)",
            ]
        );
        let json = json_of(&steps[1]);
        assert_eq!(json["trace_id"], json_of(&steps[0])["trace_id"]);
        assert_eq!(json["cause"]["publisher_span_id"], json_of(&steps[0])["span_id"]);
    }
}
