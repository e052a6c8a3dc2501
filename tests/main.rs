//! Whole-system tests: the real `armor` program and real processes, from outside.

mod changes;
mod checks;
mod command_line;
mod dates;
mod dice;
mod fixture;
mod gathering;
mod guards;
mod holding;
mod launcher;
mod manifests;
mod meeting;
mod missions;
mod mutations;
mod new_component;
mod operators;
mod parameters;
mod remote;
mod resilience;
mod resuming;
mod robots;
mod simulated_time;
mod submissions;
mod tutorial;
mod watching;
mod workspace;
