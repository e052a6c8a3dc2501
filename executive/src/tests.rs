//! Tests of the whole controller: scenarios step by step, and random missions against random
//! worlds.

mod scenarios;
pub(crate) mod simulation;
