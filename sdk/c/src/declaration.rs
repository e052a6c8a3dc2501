//! The structs that C fills in: parameters, events, and the tables of messages; and small ones that it gets.
//! Numbers that C gives are plain integers, checked where they are read.

use std::ffi::{c_char, c_int, c_void};

/// The type of a field of a struct.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmorFieldKind {
    /// `bool`
    Bool = 0,
    /// `uint8_t`
    U8 = 1,
    /// `int8_t`
    I8 = 2,
    /// `uint16_t`
    U16 = 3,
    /// `int16_t`
    I16 = 4,
    /// `uint32_t`
    U32 = 5,
    /// `int32_t`
    I32 = 6,
    /// `uint64_t`
    U64 = 7,
    /// `int64_t`
    I64 = 8,
    /// `float`
    F32 = 9,
    /// `double`
    F64 = 10,
    /// `armor_string`
    Text = 11,
    /// A struct or an enum with a table of its own.
    Nested = 12,
}

/// How many values a field has.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmorFieldForm {
    /// One.
    One = 0,
    /// A fixed number: an array in the struct.
    Fixed = 1,
    /// Any number: a pointer and a length in the struct.
    List = 2,
}

/// A text: UTF-8 and its length in bytes. A received one has a NUL after it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorText {
    /// The bytes; may be NULL if the length is 0.
    pub data: *const c_char,
    /// How many.
    pub len: usize,
}

/// One field of a struct that is sent as a message. Use the macros `ARMOR_FIELD` and others.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorField {
    /// Its name in the schema.
    pub name: *const c_char,
    /// The unit of its number, such as `m/s`; NULL or empty without.
    pub unit: *const c_char,
    /// One of `armor_field_kind`.
    pub kind: c_int,
    /// One of `armor_field_form`.
    pub form: c_int,
    /// Where it is in the struct.
    pub offset: usize,
    /// The number of values of a fixed array.
    pub count: usize,
    /// The table of a nested type; else NULL.
    pub of: *const ArmorType,
    /// Whether it may be absent.
    pub is_optional: bool,
    /// Where the `bool is_present` of an optional field is in the struct.
    pub presence: usize,
}

/// A type of messages: a struct with a table of its fields, or an enum with the names of its values.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorType {
    /// Its name in the schema.
    pub name: *const c_char,
    /// `sizeof` of the struct.
    pub size: usize,
    /// `_Alignof` of the struct, at most 8.
    pub alignment: usize,
    /// The fields, in the order of the schema; NULL of an enum.
    pub fields: *const ArmorField,
    /// How many.
    pub field_count: usize,
    /// The names of the values of an enum, which count from 0; NULL of a struct.
    pub variants: *const *const c_char,
    /// How many.
    pub variant_count: usize,
}

/// One piece of an encoded message.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorPiece {
    /// Its bytes; may be NULL if the length is 0.
    pub data: *const c_void,
    /// How many.
    pub len: usize,
}

/// The type of a parameter.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmorParameterType {
    /// A number; the file may give it in any unit of the same dimension, the component gets SI.
    Number = 0,
    /// A whole number.
    Integer = 1,
    /// Any text.
    Text = 2,
    /// One of the choices.
    Choice = 3,
    /// A file or folder; a relative one is relative to the file that assigns it.
    Path = 4,
    /// `true` or `false`.
    Flag = 5,
    /// `#rrggbb`.
    Colour = 6,
}

/// A parameter, as `docs/manifest.md` explains its members. A member that is 0 or NULL is not given.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorParameter {
    /// Its name in a file.
    pub name: *const c_char,
    /// One of `armor_parameter_type`.
    pub kind: c_int,
    /// The unit of a number.
    pub unit: *const c_char,
    /// Its value if the file assigns none, written as in a file; NULL: the file must assign one.
    pub default_value: *const c_char,
    /// The smallest value of a number, in SI; `-INFINITY` for none. Not used if equal to `maximum`.
    pub minimum: f64,
    /// The largest value of a number, in SI; `INFINITY` for none.
    pub maximum: f64,
    /// The choices, with spaces between them.
    pub choices: *const c_char,
    /// The form of a text or path, such as `frame`; see `docs/manifest.md`.
    pub format: *const c_char,
    /// What it does, in one line.
    pub doc: *const c_char,
    /// Whether a change in the file reaches the running component.
    pub live: bool,
    /// Of a path: whether the component writes there.
    pub written: bool,
}

/// An event that the component reports.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorEvent {
    /// Its name: `on="component.name"` in a mission.
    pub name: *const c_char,
    /// When it is reported, in one line.
    pub doc: *const c_char,
    /// Whether its value is a number.
    pub has_value: bool,
    /// The unit of the value.
    pub unit: *const c_char,
}

/// What a port carries, in one line.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorPortText {
    /// The name of the port.
    pub port: *const c_char,
    /// What it carries.
    pub doc: *const c_char,
    /// Of an input: the age from which on the component takes its data for missing, such as `0.5s`, or
    /// the name of the parameter that states it; else NULL.
    pub stale_after: *const c_char,
}

/// Why `exec` is called.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmorCall {
    /// The component has been activated.
    Started = 0,
    /// Its period is over.
    Tick = 1,
    /// It has received data, and the file gives it no rate.
    Data = 2,
    /// The last call before it is frozen or ended: bring actuators to rest.
    Stopping = 3,
}

/// What `exec` reports.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmorOutcomeKind {
    /// Nothing.
    CarryOn = 0,
    /// The task is over; no more calls in this activation, except `ARMOR_CALL_STOPPING`.
    Done = 1,
    /// The task has failed, with the text of `armor_fail`; no more calls, as after `DONE`.
    Failed = 2,
    /// Something happened that the mission may wait for.
    Event = 3,
}

/// What `exec` returns: by `armor_carry_on`, `armor_done`, `armor_failed` or `armor_report_event`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorOutcome {
    /// One of `armor_outcome_kind`.
    pub kind: c_int,
    /// The name of the event; else NULL.
    pub event: *const c_char,
    /// The value of the event.
    pub value: f64,
}

/// Where data comes from, when it was created, and what is missing before it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorHeader {
    /// Local name of the input.
    pub id: *const c_char,
    /// System-wide name of the data, `component.output`.
    pub data: *const c_char,
    /// Counts what the output has published, from 0.
    pub sequence: u64,
    /// When it was created: system time in seconds.
    pub stamp_s: f64,
    /// Process start that published it.
    pub instance: u64,
    /// How many messages were lost immediately before it.
    pub lost: u64,
}

/// A message of a history: when it was created, and what is missing before it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorPast {
    /// Counts what the output has published, from 0.
    pub sequence: u64,
    /// When it was created: system time in seconds.
    pub stamp_s: f64,
    /// Process start that published it.
    pub instance: u64,
    /// How many messages were lost immediately before it.
    pub lost: u64,
    /// Whether the message before it in the history is not the one that was published before it.
    pub follows_gap: bool,
}

/// A parameter's value for a component under test, as in a file.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorSetting {
    /// The parameter.
    pub name: *const c_char,
    /// Its value, with its unit.
    pub value: *const c_char,
}
