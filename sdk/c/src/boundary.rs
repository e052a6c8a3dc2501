//! What C calls. This module is the only one with `unsafe` code.
//!
//! # Safety argument
//! Each function states what its pointers must be; a header cannot check it, so the contract of every
//! function is C's: a pointer is NULL or valid, a text ends with a NUL, and nothing that is given
//! changes during the call. A NULL is an error, not a crash. Rust keeps nothing that C has given beyond
//! the call, but for the functions of a component and its `user`, which live as long as the component.
//! What Rust gives to C is stated to be valid for a call, or until it is freed. No panic leaves a
//! function.

#![allow(unsafe_code)]

mod any;
mod handles;
mod history;
mod process;
mod read;
mod testing;

use std::cell::{Cell, RefCell};
use std::ffi::{CStr, CString, OsString, c_char, c_int, c_void};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Arc;

use armor_sdk::Fault;
use armor_sdk::foreign::{ForeignArmor, KeptMessage, PortType, run};

pub use any::*;
pub use handles::*;
pub use history::*;
pub(crate) use process::flush_printed;
use process::{print_by_lines, survive_broken_pipes};
pub use testing::*;

use crate::codec::{Arena, EncodedMessage, KeptBytes, decode_struct};
use crate::component::{CComponent, ComponentParts, DeclaredPort, UsedType, check_type};
use crate::declaration::{ArmorOutcomeKind, ArmorPiece, ArmorType};
use crate::failure::{ArmorError, Failure, keep_last_error, to_c_text, with_last_error};
use crate::layout::Layout;
use read::{MessageMemory, read_bytes, read_kind, read_pointer, read_slice, read_text, read_type};
pub(crate) use read::{check_utf8, read_outcome};

/// An output keeps its last message for late subscribers.
pub const ARMOR_LATCHED: u32 = 1;
/// The file need not feed an input.
pub const ARMOR_OPTIONAL: u32 = 2;
/// Any number of links may feed an input.
pub const ARMOR_MANY: u32 = 4;

/// Runs the body of a function: its failure, or a panic, is an error code and a text.
fn guard(body: impl FnOnce() -> Result<(), Failure>) -> c_int {
    match panic::catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => ArmorError::None as c_int,
        Ok(Err(Failure { code, text })) => {
            keep_last_error(&text);
            code as c_int
        }
        Err(_) => {
            keep_last_error("libarmor has panicked; the reason is in the log");
            ArmorError::Internal as c_int
        }
    }
}

/// As [`guard`], for a function that returns a value; `otherwise` after a failure.
fn guard_value<T>(otherwise: T, body: impl FnOnce() -> Result<T, Failure>) -> T {
    let result = Cell::new(None);
    guard(|| {
        result.set(Some(body()?));
        Ok(())
    });
    result.into_inner().unwrap_or(otherwise)
}

/// Runs a component as this process, by its command line, and returns the exit code of the process:
/// `return armor_run(argc, argv, &component);`. It handles SIGINT and SIGTERM, and takes SIGPIPE away.
///
/// # Safety
/// `argv` has `argc` texts. `component` and all that it leads to are valid until the process ends.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_run(
    argc: c_int,
    argv: *const *mut c_char,
    component: *const ArmorComponent,
) -> c_int {
    let fails = 1;
    let code = guard_value(None, || {
        let arguments = unsafe {
            let count = usize::try_from(argc).unwrap_or(0);
            read_slice(argv, count, "argv")?
                .iter()
                .skip(1)
                .take_while(|argument| !argument.is_null())
                .map(|argument| CStr::from_ptr(*argument).to_bytes().to_vec())
                .map(OsString::from_vec)
                .collect::<Vec<_>>()
        };
        let component = unsafe { read_pointer(component, "component") }?;
        let kind = unsafe { read_kind(component) }?;
        let functions = CFunctions(*component);
        survive_broken_pipes()?;
        print_by_lines();
        Ok(Some(c_int::from(run(&kind, arguments, |armor| {
            Ok(Box::new(create_component(functions, armor)?.0))
        }))))
    });
    code.unwrap_or_else(|| {
        with_last_error(|text| eprintln!("armor_run: {}", text.to_string_lossy()));
        fails
    })
}

/// Lets C create its component.
fn create_component(
    functions: CFunctions,
    armor: ForeignArmor,
) -> Result<(CComponent, Arc<ArmorHandle>), Fault> {
    let handle = Arc::new(ArmorHandle(ComponentParts::new(armor)));
    Ok((CComponent::create(functions, Arc::clone(&handle))?, handle))
}

/// Returns the meaning of an error code. The text is never freed.
#[unsafe(no_mangle)]
pub extern "C" fn armor_error_text(error: c_int) -> *const c_char {
    ArmorError::of_code(error).text().as_ptr()
}

/// Returns the details of the last error on this thread; empty without one. Valid until the next call of
/// a function of this header on this thread.
#[unsafe(no_mangle)]
pub extern "C" fn armor_last_error() -> *const c_char {
    with_last_error(CStr::as_ptr)
}

/// Keeps `text` as the last error of this thread, for a function that then returns
/// `ARMOR_ERROR_FAILED`. Returns that; `armor_fail` formats the text.
///
/// # Safety
/// `text` is NULL or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_fail_with(text: *const c_char) -> c_int {
    guard(|| {
        let text = unsafe { CStr::from_ptr(non_null(text, "the text of a failure")?) };
        Err(Failure::new(ArmorError::Failed, text.to_string_lossy()))
    })
}

fn non_null(text: *const c_char, what: &str) -> Result<*const c_char, Failure> {
    if text.is_null() { Err(Failure::null(what)) } else { Ok(text) }
}

/// Writes a line into the component's log. Levels: 10 debug, 20 info, 30 warning, 40 error.
/// `armor_write_log` formats the text.
///
/// # Safety
/// `text` is NULL or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_log_text(level: c_int, text: *const c_char) {
    guard(|| {
        let text = unsafe { CStr::from_ptr(non_null(text, "the text of a log")?) };
        let text = text.to_string_lossy();
        match level {
            ..=10 => tracing::debug!("{text}"),
            11..=20 => tracing::info!("{text}"),
            21..=30 => tracing::warn!("{text}"),
            _ => tracing::error!("{text}"),
        }
        Ok(())
    });
}

/// Uses the type with this table.
///
/// # Safety
/// `table` is NULL, or it and all that it leads to are valid and never change.
unsafe fn with_type<T>(
    handle: &ArmorHandle,
    table: *const ArmorType,
    work: impl FnOnce(&Arc<UsedType>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    handle.0.with_type(table.addr(), || unsafe { read_layout(table) }, work)
}

/// Reads the layout of a type from its table.
///
/// # Safety
/// As [`with_type`].
unsafe fn read_layout(table: *const ArmorType) -> Result<Layout, Failure> {
    Layout::of_table(&unsafe { read_type(table, 0) }?)
}

/// Declares an output. Only in `create`. `flags`: 0 or `ARMOR_LATCHED`: a late subscriber immediately
/// gets the last message.
///
/// # Safety
/// The pointers are NULL or valid; the table and all that it leads to live as long as the component.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_provide(
    handle: *const ArmorHandle,
    id: *const c_char,
    table: *const ArmorType,
    flags: u32,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let id = read_text(id, "id")?;
        with_type(handle, table, |used| {
            handle.0.provide(id, DeclaredPort::of_table(used), flags & ARMOR_LATCHED != 0)
        })
    })
}

/// Declares an output by its schema, such as `Count{count:u64}`, for messages that are encoded by the
/// caller; see `armor_send_bytes`. With `ARMOR_ANY` it passes messages on, and has the type of the input
/// of any type; see `armor_send_any`.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_provide_schema(
    handle: *const ArmorHandle,
    id: *const c_char,
    schema: *const c_char,
    flags: u32,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let port = DeclaredPort::of_schema(PortType::parse(read_text(schema, "schema")?)?);
        handle.0.provide(read_text(id, "id")?, port, flags & ARMOR_LATCHED != 0)
    })
}

/// Declares an input. Only in `create`. `flags`: 0, or `ARMOR_OPTIONAL` and `ARMOR_MANY`, added.
///
/// # Safety
/// As [`armor_provide`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_subscribe(
    handle: *const ArmorHandle,
    id: *const c_char,
    table: *const ArmorType,
    flags: u32,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let id = read_text(id, "id")?;
        with_type(handle, table, |used| subscribe(handle, id, DeclaredPort::of_table(used), flags))
    })
}

/// Declares an input by its schema, for messages that are decoded by the caller; see `armor_data_bytes`.
/// With `ARMOR_ANY` it takes the type of its first link; see `armor_any_received`.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_subscribe_schema(
    handle: *const ArmorHandle,
    id: *const c_char,
    schema: *const c_char,
    flags: u32,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let port = DeclaredPort::of_schema(PortType::parse(read_text(schema, "schema")?)?);
        subscribe(handle, read_text(id, "id")?, port, flags)
    })
}

fn subscribe(
    handle: &ArmorHandle,
    id: &str,
    port: DeclaredPort,
    flags: u32,
) -> Result<(), Failure> {
    let many = flags & ARMOR_MANY != 0;
    handle.0.subscribe(id, port, flags & (ARMOR_OPTIONAL | ARMOR_MANY) == 0, many)
}

thread_local! {
    static NAME: RefCell<CString> = RefCell::default();
}

/// Gives C a text until the next one on this thread; NULL for none.
fn lend_name(name: Option<String>) -> *const c_char {
    let Some(name) = name else { return std::ptr::null() };
    NAME.with(|lent| {
        *lent.borrow_mut() = to_c_text(&name);
        lent.borrow().as_ptr()
    })
}

/// Returns the system-wide name of what an output publishes, `component.output`; NULL if there is no
/// such output. Valid until the next call of this function or `armor_subscribed_data` on this thread.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_provided_data(
    handle: *const ArmorHandle,
    id: *const c_char,
) -> *const c_char {
    guard_value(std::ptr::null(), || unsafe {
        let handle = read_pointer(handle, "handle")?;
        Ok(lend_name(handle.0.armor.provided_data(read_text(id, "id")?)))
    })
}

/// Returns the system-wide names of what feeds an input, with spaces between them; NULL if nothing does.
/// Known from the first call of `exec` on. Valid as that of `armor_provided_data`.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_subscribed_data(
    handle: *const ArmorHandle,
    id: *const c_char,
) -> *const c_char {
    guard_value(std::ptr::null(), || unsafe {
        let handle = read_pointer(handle, "handle")?;
        Ok(lend_name(handle.0.armor.subscribed_data(read_text(id, "id")?)))
    })
}

/// Requests a parameter; its value arrives in `parameter_received`, before the first call of `exec`.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_get_parameter(
    handle: *const ArmorHandle,
    name: *const c_char,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let requested = handle.0.armor.get_parameter(read_text(name, "name")?);
        requested.map_err(|fault| Failure::new(ArmorError::Name, fault.to_string()))
    })
}

/// Waits until every requested parameter has arrived, for at most ten seconds.
///
/// # Safety
/// `handle` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_synchronize(handle: *const ArmorHandle) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let arrived = handle.0.armor.synchronize();
        arrived.map_err(|fault| Failure::new(ArmorError::Parameter, fault.to_string()))
    })
}

/// Publishes a message: encoded once, and on its way to every subscriber that can take it when this
/// returns. Arrays are sent from where they are. `ARMOR_SEND` checks the type of the struct.
///
/// A thread that the component has started itself may publish while the component is active.
///
/// # Safety
/// The pointers are NULL or valid; `message` is a struct of the type that the table describes, and each
/// pointer in it whose length is not 0 leads to as many values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_send_data(
    handle: *const ArmorHandle,
    id: *const c_char,
    table: *const ArmorType,
    message: *const c_void,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let read = || read_layout(table);
        handle.0.with_output_type(read_bytes(id, "id")?, table.addr(), read, |id, used| {
            let content = read_slice(message.cast::<u8>(), used.layout.size, "message")?;
            if let Some(bytes) = used.layout.find_encoded(content) {
                handle.0.armor.send_data(id, &[bytes])?;
                return Ok(());
            }
            let memory = MessageMemory::of_message();
            let message = EncodedMessage::of_struct(&used.layout, content, &memory)?;
            message.with_pieces(|pieces| handle.0.armor.send_data(id, pieces))?;
            Ok(())
        })
    })
}

/// Publishes an encoded message (`docs/protocol.md`, Values), given in the pieces in which it lies in
/// memory. It is not checked against the schema.
///
/// # Safety
/// The pointers are NULL or valid; each piece has as many bytes as it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_send_bytes(
    handle: *const ArmorHandle,
    id: *const c_char,
    pieces: *const ArmorPiece,
    count: usize,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let id = handle.0.read_output_id(read_bytes(id, "id")?)?;
        let pieces = read_slice(pieces, count, "pieces")?;
        let bytes = |piece: &ArmorPiece| read_slice(piece.data.cast(), piece.len, "a piece");
        // Most messages have one piece, or three with an array.
        if let [one] = pieces {
            handle.0.armor.send_data(id, &[bytes(one)?])?;
        } else if let [head, array, tail] = pieces {
            handle.0.armor.send_data(id, &[bytes(head)?, bytes(array)?, bytes(tail)?])?;
        } else {
            let pieces = pieces.iter().map(bytes).collect::<Result<Vec<_>, _>>()?;
            handle.0.armor.send_data(id, &pieces)?;
        }
        Ok(())
    })
}

/// Returns the current time of the whole system in seconds since the Unix epoch; in a system with a
/// `<clock>` the last value of that clock. NaN if `handle` is NULL.
///
/// # Safety
/// `handle` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_timestamp(handle: *const ArmorHandle) -> f64 {
    guard_value(f64::NAN, || Ok(unsafe { read_pointer(handle, "handle") }?.0.armor.timestamp()))
}

/// Forbids the executive to freeze this component. Only in `create`: `ARMOR_ERROR_DECLARATION` after it.
///
/// # Safety
/// `handle` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_set_non_controllable(handle: *const ArmorHandle) -> c_int {
    guard(|| {
        unsafe { read_pointer(handle, "handle") }?.0.armor.set_non_controllable()?;
        Ok(())
    })
}

mod received;
pub use received::*;
