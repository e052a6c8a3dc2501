//! The probe of a next version: its message has one more field. It shows what a recording of the
//! probe is to a system whose components have changed since.

use armor_sdk::prelude::*;

/// What a probe publishes, and a number that it did not have before.
#[derive(Clone, Debug, PartialEq, Message)]
struct Numbered {
    /// Counts from 0 in each process.
    count: u64,
    bulk: Array<u8>,
    /// The field that is new.
    load: f64,
}

const INPUTS: [&str; 5] = ["a", "b", "c", "d", "e"];

pub struct NextProbe;

impl Component for NextProbe {
    const KIND: &'static str = "probe";
    const SUMMARY: &'static str = "Has the ports of a probe, with one more field.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::path("trace").default("").doc("not used"),
        Parameter::integer("event").default("0").doc("not used"),
        Parameter::number("work", "s").default("0s").doc("not used"),
    ];

    const EVENTS: &'static [DeclaredEvent] = &[DeclaredEvent::new("ticked")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Numbered>("numbers")?;
        for input in INPUTS {
            armor.subscribe::<Optional<Numbered>>(input)?;
        }
        armor.synchronize()?;
        Ok(Self)
    }

    fn data_received(&mut self, _: &Header, data: &Data) -> Result<(), Fault> {
        data.decode::<Numbered>()?;
        Ok(())
    }
}
