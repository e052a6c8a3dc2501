//! The connections to configd: a component's, for how it is connected and its parameters; and a
//! tool's.

pub(crate) mod client;
mod connection;
mod given_values;
mod questions;
pub(crate) mod requests;

pub use connection::ConfigdConnection;
pub use questions::{ConfigdError, Differences, ParameterList, Questions, SetOutcome};
