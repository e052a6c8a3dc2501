//! ArMoR's rules of links (4.1): an output to an input, of one type, and an input once
//! unless it takes many.

use armor_wire::manifest::PortManifest;
use armor_wire::schema::{ANY_SCHEMA, difference};

use crate::canvas::{Direction, JoinRules, PortAt};

/// What is to be known of the ports of a drawing, by node and port.
#[derive(Clone, Debug, Default)]
pub struct Joints {
    /// By node and port.
    pub ports: Vec<Vec<Joint>>,
}

/// What is to be known of one port.
#[derive(Clone, Debug)]
pub struct Joint {
    /// The component's name.
    pub component: String,
    /// The port's own.
    pub port: String,
    /// Which way its data goes.
    pub direction: Direction,
    /// Name, hash and text of its type; none if the kind has no such port.
    pub message: Option<(String, u64, String)>,
    /// Of an input: whether any number of wires may feed it.
    pub takes_many: bool,
    /// Of an input: whether it has the type of what feeds it.
    pub takes_any: bool,
    /// Of an input: the wires that feed it, each with the output that it is from.
    pub fed_by: Vec<(usize, String)>,
    /// How many wires end there.
    pub wires: usize,
}

impl Joint {
    pub(super) fn new(
        component: &str,
        port: &str,
        direction: Direction,
        manifest: Option<&PortManifest>,
    ) -> Self {
        let message =
            manifest.map(|port| (port.type_name.clone(), port.schema_hash, port.schema.clone()));
        Self {
            component: component.to_owned(),
            port: port.to_owned(),
            direction,
            message,
            takes_many: manifest.is_some_and(|port| port.many),
            takes_any: false,
            fed_by: Vec::new(),
            wires: 0,
        }
    }

    /// `component.port`.
    pub fn data(&self) -> String {
        format!("{}.{}", self.component, self.port)
    }
}

impl Joints {
    /// One port.
    pub fn joint(&self, at: PortAt) -> Option<&Joint> {
        self.ports.get(at.node)?.get(at.port)
    }

    /// The output and the input of two ports that may be joined, whichever was first.
    ///
    /// # Errors
    /// Why they may not be.
    pub fn ends(&self, one: PortAt, other: PortAt) -> Result<(&Joint, &Joint), String> {
        self.ends_without(None, one, other)
    }

    /// The same for a wire that is led elsewhere: what it feeds so far is free for it.
    ///
    /// # Errors
    /// Why they may not be.
    pub fn ends_without(
        &self,
        wire: Option<usize>,
        one: PortAt,
        other: PortAt,
    ) -> Result<(&Joint, &Joint), String> {
        let (Some(first), Some(second)) = (self.joint(one), self.joint(other)) else {
            return Err("no such port".into());
        };
        let (output, input) = match (first.direction, second.direction) {
            (Direction::Out, Direction::In) => (first, second),
            (Direction::In, Direction::Out) => (second, first),
            (Direction::Out, _) => return Err("two outputs cannot be linked".into()),
            _ => return Err("two inputs cannot be linked".into()),
        };
        let mut others = input.fed_by.iter().filter(|(other, _)| Some(*other) != wire);
        if !input.takes_any || others.clone().next().is_some() {
            types_fit(output, input)?;
        }
        let data = output.data();
        match others.clone().find(|(_, from)| *from == data).or_else(|| others.next()) {
            Some((_, from)) if *from == data => {
                Err(format!("{data} already feeds {}", input.data()))
            }
            Some((_, from)) if !input.takes_many => {
                Err(format!("{} is already fed by {from}", input.data()))
            }
            _ => Ok((output, input)),
        }
    }
}

/// Whether the data of an output is what an input takes.
pub fn types_fit(output: &Joint, input: &Joint) -> Result<(), String> {
    let there = |joint: &Joint| format!("{} no longer exists", joint.data());
    let (name, hash, schema) = output.message.as_ref().ok_or_else(|| there(output))?;
    let (wanted, wanted_hash, wanted_schema) =
        input.message.as_ref().ok_or_else(|| there(input))?;
    // A port that takes any type has none until it is linked.
    if schema == ANY_SCHEMA || wanted_schema == ANY_SCHEMA {
        return Ok(());
    }
    if name != wanted {
        return Err(format!("{} is {name}, {} takes {wanted}", output.data(), input.data()));
    }
    if hash != wanted_hash {
        let apart = difference((&output.data(), schema), (&input.data(), wanted_schema));
        return Err(format!("two versions of {name}: {apart}"));
    }
    Ok(())
}

impl JoinRules for Joints {
    fn may_join(&self, from: PortAt, to: PortAt) -> Result<(), String> {
        self.ends(from, to).map(|_| ())
    }

    fn may_lead(&self, wire: usize, stays: PortAt, to: PortAt) -> Result<(), String> {
        self.ends_without(Some(wire), stays, to).map(|_| ())
    }

    /// A wire is taken by its end at an input that has only one. From an input that takes many, a drag
    /// begins a new one; its wires are led elsewhere by their grips.
    fn taken_by(&self, port: PortAt) -> Option<usize> {
        let joint = self.joint(port)?;
        let (wire, _) = joint.fed_by.first()?;
        (joint.direction == Direction::In && !joint.takes_many).then_some(*wire)
    }
}
