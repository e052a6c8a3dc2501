//! Whether the inputs that the file links to data have received them.

use std::fmt;
use std::thread;
use std::time::{Duration, Instant};

use armor_inspect::ObservedSystem;
use armor_sdk::node::SystemNode;
use armor_wire::control::{LinkStatus, Status};
use serde::Serialize;

use super::super::message_types::MessageTypes;

const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Time between two questions to a component.
const ASK_EVERY: Duration = Duration::from_millis(100);

/// An input that the file links to the data.
#[derive(Clone, Debug)]
pub struct ExpectedInput {
    pub component: String,
    /// `COMPONENT.INPUT`.
    pub port: String,
    /// The type that its kind declares; empty if that is not known.
    pub type_name: String,
    pub schema: Option<String>,
    /// Data that it had received or dropped before.
    pub received: u64,
}

/// What an input has got.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Delivery {
    pub input: String,
    pub outcome: DeliveryOutcome,
    /// Why it has received nothing, in words.
    pub problem: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeliveryOutcome {
    /// The component has been handed data.
    Received,
    /// The component is frozen, and asks for no data.
    Paused,
    /// The link is up, but nothing has been taken from it.
    NotTaken,
    /// There is no link.
    NotLinked,
}

impl ExpectedInput {
    /// Returns the inputs of all components that the file links to `data`.
    pub fn list(statuses: &[Status], types: &MessageTypes, data: &str) -> Vec<Self> {
        let inputs = statuses.iter().flat_map(|status| {
            let own = status.inputs.iter().filter(|input| input.data == data);
            own.map(|input| {
                let declared = types.find_input(&status.kind, &input.id);
                let declared = declared.filter(|port| !port.is_any());
                Self {
                    component: status.name.clone(),
                    port: format!("{}.{}", status.name, input.id),
                    type_name: declared.map(|port| port.type_name.clone()).unwrap_or_default(),
                    schema: declared.map(|port| port.schema.clone()),
                    received: input.received + input.dropped,
                }
            })
        });
        inputs.collect()
    }

    /// What its component reports of it now.
    fn judge(
        &self,
        status: Result<Status, String>,
        data: &str,
        link: Option<&LinkStatus>,
    ) -> Delivery {
        let named = |outcome, problem: &str| Delivery {
            input: self.port.clone(),
            outcome,
            problem: problem.into(),
        };
        let status = match status {
            Ok(status) => status,
            Err(problem) => return named(DeliveryOutcome::NotLinked, &problem),
        };
        let is_it = |id: &str| self.port.split_once('.').is_some_and(|(_, own)| own == id);
        let input = status.inputs.iter().find(|input| input.data == data && is_it(&input.id));
        match (input, link) {
            (Some(input), _) if input.received + input.dropped > self.received => {
                named(DeliveryOutcome::Received, "")
            }
            (_, Some(link)) if link.paused => {
                named(DeliveryOutcome::Paused, "its component is frozen")
            }
            (Some(input), None) => named(DeliveryOutcome::NotLinked, &input.problem),
            (_, Some(_)) => named(DeliveryOutcome::NotTaken, "its component is busy, or ends"),
            (None, None) => named(DeliveryOutcome::NotLinked, "the file no longer links it"),
        }
    }
}

impl fmt::Display for Delivery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { input, outcome, problem } = self;
        let outcome = match outcome {
            DeliveryOutcome::Received => "received",
            DeliveryOutcome::Paused => "paused",
            DeliveryOutcome::NotTaken => "not taken",
            DeliveryOutcome::NotLinked => "not linked",
        };
        match problem.as_str() {
            "" => write!(f, "{input}: {outcome}"),
            problem => write!(f, "{input}: {outcome}: {problem}"),
        }
    }
}

/// Waits until the node is linked to all inputs, at most for `limit`.
pub fn await_links(node: &SystemNode, inputs: &[ExpectedInput], limit: Duration) {
    let start = Instant::now();
    while start.elapsed() < limit {
        let outputs = node.outputs();
        let is_linked = |input: &ExpectedInput| find_link(&outputs, &input.component).is_some();
        if inputs.iter().all(is_linked) {
            return;
        }
        thread::sleep(LOOK_EVERY);
    }
}

/// Waits until every input has received data or cannot, at most for `limit`. Returns the result of each.
pub fn await_deliveries(
    observed: &ObservedSystem,
    node: &SystemNode,
    inputs: &[ExpectedInput],
    limit: Duration,
) -> Vec<Delivery> {
    let start = Instant::now();
    loop {
        let outputs = node.outputs();
        let data = outputs.first().map_or("", |output| output.data.as_str());
        let judged = inputs.iter().map(|input| {
            let link = find_link(&outputs, &input.component);
            input.judge(observed.ask_component(&input.component), data, link)
        });
        let deliveries: Vec<_> = judged.collect();
        // What waits for a reader that is not linked by the file, such as a tool.
        let waits = outputs.iter().flat_map(|it| &it.links).any(|link| link.queued > 0);
        let is_open = |it: &Delivery| it.outcome == DeliveryOutcome::NotTaken;
        if (!waits && !deliveries.iter().any(is_open)) || start.elapsed() > limit {
            return deliveries;
        }
        thread::sleep(ASK_EVERY);
    }
}

fn find_link<'a>(
    outputs: &'a [armor_wire::control::OutputStatus],
    component: &str,
) -> Option<&'a LinkStatus> {
    outputs.iter().flat_map(|output| &output.links).find(|link| link.to == component)
}
