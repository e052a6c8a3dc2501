//! What a test cannot do, and why.

use std::fmt;

use armor_wire::codec::{DecodeError, EncodeError};
use thiserror::Error;

use crate::call::Fault;

/// Why a test cannot do what it asks for. `Debug` is the message, too: it is what a failed test shows.
#[derive(Error)]
pub enum TestError {
    /// The component cannot be built.
    #[error("`{kind}` cannot be built: {fault}")]
    NotBuilt {
        /// The kind of component.
        kind: String,
        /// Why.
        fault: Fault,
    },
    /// The component has no port of that name.
    #[error("`{kind}` has no {noun} `{id}`{}", list_ports(existing))]
    NoPort {
        /// The kind of component.
        kind: String,
        /// `input` or `output`.
        noun: &'static str,
        /// The name given.
        id: String,
        /// The names of those that it has.
        existing: Vec<String>,
    },
    /// The port has another type.
    #[error("{noun} `{id}` is declared as {declared}, but the test uses it as {given}")]
    OtherType {
        /// `input` or `output`.
        noun: &'static str,
        /// The port.
        id: String,
        /// The type that it was declared with.
        declared: String,
        /// The type that the test gives or asks for.
        given: String,
    },
    /// A second source for an input that takes one.
    #[error(
        "input `{input}` of `{kind}` takes one source; for several, declare it as `Many<…>` (in Python with many=True, in C and C++ with ARMOR_MANY)"
    )]
    OneSource {
        /// The kind of component.
        kind: String,
        /// The input.
        input: String,
    },
    /// The data do not feed the input.
    #[error("`{source_data}` does not feed input `{input}`; add it with `link_from`")]
    UnknownSource {
        /// The input.
        input: String,
        /// The data that were to be sent.
        source_data: String,
    },
    /// The component is not active, so it gets no calls.
    #[error("`{kind}` gets no calls: {why}")]
    NotActive {
        /// The kind of component.
        kind: String,
        /// Its state, and what led to it.
        why: String,
    },
    /// The component has failed in this step.
    #[error("`{kind}` has failed: {reason}")]
    Failed {
        /// The kind of component.
        kind: String,
        /// Why, as it is reported.
        reason: String,
    },
    /// The component refuses the new value of a parameter, or an input that takes any type a second
    /// type.
    #[error("{problem}")]
    Refused {
        /// The parameter or the input, and why.
        problem: String,
    },
    /// A parameter cannot be set.
    #[error("parameter `{name}`: {problem}")]
    Parameter {
        /// The parameter.
        name: String,
        /// Why.
        problem: String,
    },
    /// Nothing has been published.
    #[error("nothing has been published on output `{output}`{why}")]
    NothingPublished {
        /// The output.
        output: String,
        /// `: `, and why the component publishes nothing; empty if it could.
        why: String,
    },
    /// The message is too large to be sent.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// What was published cannot be read as its type.
    #[error(transparent)]
    Decode(#[from] DecodeError),
}

impl fmt::Debug for TestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

fn list_ports(existing: &[String]) -> String {
    match existing {
        [] => "; it has none".into(),
        existing => format!(", only: {}", existing.join(", ")),
    }
}
