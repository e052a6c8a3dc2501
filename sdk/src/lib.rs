//! The interface for components: twelve functions, the standard messages, and links that carry data
//! directly from one process to another.
//!
//! ```no_run
//! use armor_sdk::prelude::*;
//!
//! struct Blinker {
//!     armor: Armor,
//!     on: bool,
//! }
//!
//! impl Component for Blinker {
//!     const KIND: &'static str = "blinker";
//!     const SUMMARY: &'static str = "Switches a light on and off.";
//!
//!     fn new(armor: Armor) -> Result<Self, Fault> {
//!         armor.provide::<Flag>("light")?;
//!         Ok(Self { armor, on: false })
//!     }
//!
//!     fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
//!         self.on = !self.on;
//!         self.armor.send_data("light", &Flag { data: self.on })?;
//!         Ok(Outcome::CarryOn)
//!     }
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     armor_sdk::run::<Blinker>()
//! }
//! ```
//!
//! Start reading with [`Component`] and [`Armor`]. Tools (the executive, the launcher, the command
//! line) use [`directory`], [`control`], [`configuration`], [`tap`] and [`node`]; bindings of other
//! languages use [`foreign`].

// Derived code names this crate by its public path, also inside the crate itself.
extern crate self as armor_sdk;

mod any_message;
mod armor;
mod background_thread;
mod call;
mod call_gate;
mod call_watch;
mod calls;
mod clock;
mod component;
mod counter;
mod data;
mod declared;
mod describe;
mod dial;
mod effect;
mod event;
mod faults;
mod fed_input;
mod following;
mod history;
mod identity;
mod kind_declaration;
mod launch;
mod lifecycle;
mod link;
mod message_type;
mod parameter;
mod participant;
mod playback_orders;
mod port_table;
mod ports;
mod progress;
mod reports;
mod running_component;
mod runtime;
mod service;
mod session;
mod stdout_aside;
mod thread_panics;
mod tick_watch;
mod timeline;
mod user_code;
mod wake;

pub mod call_trace;
pub mod configuration;
pub mod control;
pub mod directory;
pub mod foreign;
pub mod log;
pub mod messages;
pub mod node;
pub mod operator;
pub mod orders;
pub mod parameters;
pub mod stand_in;
pub mod tap;
pub mod testing;

pub use any_message::AnyMessage;
pub use armor::Armor;
pub use armor_sdk_derive::{Events, Parameters};
pub use armor_wire as wire;
pub use armor_wire::text_format::FixedFrame;
pub use armor_wire::{Array, Message};
pub use call::{Call, Fault, Outcome};
pub use clock::SystemClock;
pub use component::Component;
pub use data::{Data, DataError, Header};
pub use describe::manifest_of;
pub use dial::ConnectError;
pub use effect::ParameterEffect;
pub use event::{DeclaredEvent, Events};
pub use following::time_link;
pub use history::{History, PastMessage};
pub use launch::{run, run_with};
pub use link::memory_out::count_slots;
pub use link::output::Sent;
pub use parameter::{Parameter, Value, ValueError};
pub use parameters::{FromValue, ParameterError, Parameters};
pub use playback_orders::GivenPlaybackOrder;
pub use port_table::{DeclareError, SendError};
pub use ports::{InputType, Latched, Many, Optional, OutputType};
pub use timeline::{ClockReading, Passage, Timeline};

/// Everything a component's source file needs.
pub mod prelude {
    pub use crate::messages::*;
    pub use crate::{
        AnyMessage, Armor, Array, Call, Component, Data, DeclaredEvent, Events, Fault, FixedFrame,
        Header, Latched, Many, Message, Optional, Outcome, Parameter, ParameterEffect, Parameters,
        Value,
    };
}
