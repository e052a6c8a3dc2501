//! The values that the next file of a recording begins with, so that it is complete in itself: what
//! latched outputs hold, and the parameters.

use std::collections::BTreeMap;

use armor_wire::codec;

use crate::taps::TappedMessage;
use crate::trail::{PARAMETERS, RecordedParameter};
use crate::writer::OutputType;

/// Whether each file begins with what an output holds.
pub(crate) fn is_repeated(data: &str, output_type: &OutputType) -> bool {
    output_type.latched || data == PARAMETERS
}

/// The newest message of each output, and of each parameter.
#[derive(Default)]
pub(crate) struct RepeatedValues(BTreeMap<(String, String), TappedMessage>);

impl RepeatedValues {
    /// Takes a message, if the next file repeats it.
    pub fn take(&mut self, message: &TappedMessage) {
        if !is_repeated(&message.data, &message.output_type) {
            return;
        }
        let mut kept = message.clone();
        // The file before has counted what is missing.
        kept.head.lost = 0;
        self.0.insert((message.data.clone(), find_part(message)), kept);
    }

    /// The messages, in the order in which they were published.
    pub fn messages(&self) -> Vec<&TappedMessage> {
        let mut messages: Vec<_> = self.0.values().collect();
        messages.sort_by(|a, b| {
            let key = |it: &TappedMessage| (it.data.clone(), it.head.sequence);
            a.head.stamp_s.total_cmp(&b.head.stamp_s).then_with(|| key(a).cmp(&key(b)))
        });
        messages
    }
}

/// What of its output a message replaces: all of it, or one parameter.
fn find_part(message: &TappedMessage) -> String {
    if message.data != PARAMETERS {
        return String::new();
    }
    let parameter = codec::decode::<RecordedParameter>(&message.payload);
    parameter.map_or_else(|_| String::new(), |it| format!("{}.{}", it.component, it.parameter))
}
