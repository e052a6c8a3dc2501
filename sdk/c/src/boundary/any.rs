//! Messages of any type, which a component of C passes on and does not read.

use armor_sdk::{AnyMessage, Data, Header};

use super::received::write_value;
use super::*;

/// A message of any type that has been received; valid until it is freed. One thread at a time may use
/// it.
pub struct ArmorAny {
    message: AnyMessage,
    type_name: CString,
    schema: CString,
}

/// Takes received data of an input with the schema `ARMOR_ANY`, to be passed on, in this call or later: a
/// large message stays in the shared memory in which it came, others are copied once. NULL if the input
/// has a type of its own, with the reason in `armor_last_error`. Free it with `armor_any_free`.
///
/// # Safety
/// `data` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_any_received(data: *const ArmorData<'_>) -> *mut ArmorAny {
    guard_value(std::ptr::null_mut(), || {
        let data = unsafe { read_pointer(data, "data") }?;
        take_any(data.header, data.data)
    })
}

/// Gives C a received message of an input of any type.
pub(super) fn take_any(header: &Header<'_>, data: &Data<'_>) -> Result<*mut ArmorAny, Failure> {
    let received = AnyMessage::received(header, data);
    let message =
        received.map_err(|error| Failure::new(ArmorError::OtherType, error.to_string()))?;
    let (type_name, schema) = (to_c_text(message.type_name()), to_c_text(message.schema()));
    Ok(Box::into_raw(Box::new(ArmorAny { message, type_name, schema })))
}

/// Passes a message on, on an output with the schema `ARMOR_ANY`: its bytes and its stamp stay as they
/// are.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_send_any(
    handle: *const ArmorHandle,
    id: *const c_char,
    any: *const ArmorAny,
) -> c_int {
    guard(|| unsafe {
        let handle = read_pointer(handle, "handle")?;
        let message = &read_pointer(any, "any")?.message;
        handle.0.armor.send_any(read_text(id, "id")?, message)?;
        Ok(())
    })
}

/// Returns the name of the type of a message; NULL if `any` is. Valid until it is freed.
///
/// # Safety
/// `any` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_any_type(any: *const ArmorAny) -> *const c_char {
    guard_value(std::ptr::null(), || Ok(unsafe { read_pointer(any, "any") }?.type_name.as_ptr()))
}

/// Returns the schema of a message; NULL if `any` is. Valid until it is freed.
///
/// # Safety
/// `any` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_any_schema(any: *const ArmorAny) -> *const c_char {
    guard_value(std::ptr::null(), || Ok(unsafe { read_pointer(any, "any") }?.schema.as_ptr()))
}

/// Returns when a message was created, in seconds; NaN if `any` is NULL.
///
/// # Safety
/// `any` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_any_stamp(any: *const ArmorAny) -> f64 {
    guard_value(f64::NAN, || Ok(unsafe { read_pointer(any, "any") }?.message.stamp_s()))
}

/// Returns the bytes of a message; NULL if `any` is. Valid until it is freed.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_any_bytes(any: *const ArmorAny, len: *mut usize) -> *const u8 {
    guard_value(std::ptr::null(), || unsafe {
        let bytes = read_pointer(any, "any")?.message.bytes();
        write_value(len, bytes.len())?;
        Ok(bytes.as_ptr())
    })
}

/// Frees a message; NULL is allowed.
///
/// # Safety
/// `any` is NULL, or from `armor_any_received` or `armor_history_any`, and not freed yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_any_free(any: *mut ArmorAny) {
    guard(|| {
        if !any.is_null() {
            drop(unsafe { Box::from_raw(any) });
        }
        Ok(())
    });
}
