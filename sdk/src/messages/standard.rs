//! Single values (`std_msgs`) and log records (`rcl_interfaces/Log`).

use armor_wire::Message;

/// Yes or no.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct Flag {
    /// The value.
    pub data: bool,
}

/// A number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Number {
    /// The value.
    pub data: f64,
}

/// Text.
#[derive(Clone, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct Text {
    /// The value.
    pub data: String,
}

/// How many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct Count {
    /// The value.
    pub count: u64,
}

/// One line of a log.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Log {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// 10 debug, 20 info, 30 warning, 40 error, 50 fatal.
    pub level: u8,
    /// Who says it.
    pub name: String,
    /// What is said.
    pub msg: String,
    /// Source file.
    pub file: String,
    /// Function.
    pub function: String,
    /// Line in the file.
    pub line: u32,
}
