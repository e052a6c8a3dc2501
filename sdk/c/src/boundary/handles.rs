//! What C holds of a component, its data and its values, and what it declares of the component.

use std::cell::RefCell;
use std::ffi::{CString, c_char, c_int, c_void};
use std::sync::Arc;

use armor_sdk::{Data, Header, Value};

use crate::codec::{Arena, KeptBytes};
use crate::component::{ComponentParts, DeclaredPort};
use crate::declaration::{ArmorEvent, ArmorHeader, ArmorOutcome, ArmorParameter, ArmorPortText};

/// The handle of a component: valid from `create` to the end of the component; its threads may share
/// it.
pub struct ArmorHandle(pub(crate) ComponentParts);

/// Received data; valid during the call of `data_received`.
pub struct ArmorData<'a> {
    pub(super) handle: &'a ArmorHandle,
    pub(super) input: &'a str,
    pub(super) header: &'a Header<'a>,
    pub(super) data: &'a Data<'a>,
    pub(super) arena: RefCell<Arena>,
}

/// The value of a parameter; valid during the call of `parameter_received`.
pub struct ArmorValue<'a> {
    pub(super) value: &'a Value,
    pub(super) text: RefCell<CString>,
}

/// A received message that is kept; valid until it is freed.
pub struct ArmorKept {
    pub(super) bytes: RefCell<KeptBytes>,
    pub(super) port: Option<Arc<DeclaredPort>>,
    pub(super) input: String,
}

impl<'a> ArmorData<'a> {
    pub(crate) fn new(handle: &'a ArmorHandle, header: &'a Header<'a>, data: &'a Data<'a>) -> Self {
        Self { handle, input: header.id(), header, data, arena: RefCell::default() }
    }
}

impl<'a> ArmorValue<'a> {
    pub(crate) fn new(value: &'a Value) -> Self {
        Self { value, text: RefCell::default() }
    }
}

/// A component: what its manifest has, and its functions. `create` declares the ports and requests
/// the parameters; it runs for `--describe` too, so it opens no hardware or files: `exec` does, at
/// `ARMOR_CALL_STARTED`.
///
/// The functions never run at the same time, but on different threads. Each gets `user`. Those that
/// return an `int` return `ARMOR_ERROR_NONE`, or the error of a function that has failed, or that of
/// `armor_fail`, which are failures of the component. A C++ exception or a `longjmp` must not leave
/// them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorComponent {
    /// Name of this kind of component, as the file has it.
    pub kind: *const c_char,
    /// What it does, in one line.
    pub summary: *const c_char,
    /// What can be set in the file.
    pub parameters: *const ArmorParameter,
    /// How many.
    pub parameter_count: usize,
    /// What the ports carry.
    pub ports: *const ArmorPortText,
    /// How many.
    pub port_count: usize,
    /// The events that it reports.
    pub events: *const ArmorEvent,
    /// How many.
    pub event_count: usize,
    /// Whether it works until it is frozen, and never reports that it is done.
    pub never_done: bool,
    /// Whether its task comes to an end by itself.
    pub ends_by_itself: bool,
    /// Whether it does nothing without a rate.
    pub needs_rate: bool,
    /// Whether it reads data of the system to which no link leads, as a recorder does. Where the file
    /// places such a component on another host, that host may read all data.
    pub reads_all: bool,
    /// Given to each function.
    pub user: *mut c_void,
    /// Declares the ports and requests the parameters.
    pub create: Option<extern "C" fn(handle: *const ArmorHandle, user: *mut c_void) -> c_int>,
    /// A parameter that was requested has arrived, or a live one has changed. NULL if the component
    /// requests none.
    pub parameter_received: Option<
        extern "C" fn(user: *mut c_void, name: *const c_char, value: *const ArmorValue) -> c_int,
    >,
    /// Data of an input have arrived. Both pointers are valid during the call. May be NULL.
    pub data_received: Option<
        extern "C" fn(
            user: *mut c_void,
            header: *const ArmorHeader,
            data: *const ArmorData,
        ) -> c_int,
    >,
    /// One step of the component's work; `call` is one of `armor_call`. May be NULL.
    pub exec: Option<extern "C" fn(user: *mut c_void, call: c_int) -> ArmorOutcome>,
}

/// The functions of a component, and what they are given.
#[derive(Clone, Copy)]
pub(crate) struct CFunctions(pub(super) ArmorComponent);

// The functions are called on the threads of the SDK, one at a time, as `armor_component` states.
unsafe impl Send for CFunctions {}

impl CFunctions {
    pub fn user(&self) -> *mut c_void {
        self.0.user
    }

    pub fn create(&self) -> Option<extern "C" fn(*const ArmorHandle, *mut c_void) -> c_int> {
        self.0.create
    }

    pub fn parameter_received(
        &self,
    ) -> Option<extern "C" fn(*mut c_void, *const c_char, *const ArmorValue<'_>) -> c_int> {
        self.0.parameter_received
    }

    pub fn data_received(
        &self,
    ) -> Option<extern "C" fn(*mut c_void, *const ArmorHeader, *const ArmorData<'_>) -> c_int> {
        self.0.data_received
    }

    pub fn exec(&self) -> Option<extern "C" fn(*mut c_void, c_int) -> ArmorOutcome> {
        self.0.exec
    }
}
