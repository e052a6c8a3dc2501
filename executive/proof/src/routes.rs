//! Routes proven one by one: each drawn route is a state machine with one token, and the others are
//! taken as arbitrary. So the product of many routes need not be explored. README.md argues why what is
//! shown so holds.

mod apart;
mod decided;
mod free;
mod joined;
mod machines;
mod trace;

pub(crate) use decided::RouteProof;
pub(crate) use machines::RouteMachines;
