//! The last messages of an input, as C reads them.

use armor_sdk::{History, PastMessage};

use super::any::take_any;
use super::*;
use crate::declaration::ArmorPast;

/// What the search of a history returns if it finds no message.
///
/// cbindgen:ignore
pub const ARMOR_NO_AGE: usize = usize::MAX;

/// Opens the history of an input; NULL stands for the input of the data, and for its source.
///
/// # Safety
/// The pointers are NULL or valid.
unsafe fn open_history<'a>(
    data: *const ArmorData<'a>,
    input: *const c_char,
    source: *const c_char,
) -> Result<History<'a>, Failure> {
    let data = unsafe { read_pointer(data, "data") }?;
    let input = if input.is_null() { data.input } else { unsafe { read_text(input, "input") }? };
    Ok(if source.is_null() {
        data.data.history(input)?
    } else {
        data.data.history_from(input, unsafe { read_text(source, "source") }?)?
    })
}

fn message_of_age<'a>(history: &History<'a>, age: usize) -> Result<PastMessage<'a>, Failure> {
    history.get(age).ok_or_else(|| {
        let why = format!("the history has {} messages, and none of the age {age}", history.len());
        Failure::new(ArmorError::NoMessage, why)
    })
}

/// Reads how many messages the history of an input has: those since the component was activated, at
/// most as many as `history="n"` of its link. `ARMOR_ERROR_NO_MESSAGE` if the link keeps no history.
///
/// `input`: NULL for the input of `data`. `source`: the data of which the history is, `component.output`;
/// NULL for that of `data`, or for the only one of another input.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_history_len(
    data: *const ArmorData<'_>,
    input: *const c_char,
    source: *const c_char,
    len: *mut usize,
) -> c_int {
    guard(|| unsafe { write_value(len, open_history(data, input, source)?.len()) })
}

/// Describes the message of that age in a history: 0 is the newest, which is the one that is being
/// received if `data` is of this input. `ARMOR_ERROR_NO_MESSAGE` if there is none.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_history_get(
    data: *const ArmorData<'_>,
    input: *const c_char,
    source: *const c_char,
    age: usize,
    past: *mut ArmorPast,
) -> c_int {
    guard(|| unsafe {
        let message = message_of_age(&open_history(data, input, source)?, age)?;
        let header = message.header;
        let described = ArmorPast {
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost: header.lost,
            follows_gap: message.follows_gap(),
        };
        write_value(past, described)
    })
}

/// Returns the bytes of the message of that age; valid during the call of `data_received`. NULL if there
/// is none.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_history_bytes(
    data: *const ArmorData<'_>,
    input: *const c_char,
    source: *const c_char,
    age: usize,
    len: *mut usize,
) -> *const u8 {
    guard_value(std::ptr::null(), || unsafe {
        let message = message_of_age(&open_history(data, input, source)?, age)?;
        let bytes = message.data.bytes();
        write_value(len, bytes.len())?;
        Ok(bytes.as_ptr())
    })
}

/// Decodes the message of that age, as `armor_decode`; `ARMOR_HISTORY_DECODE` checks the type of the
/// struct.
///
/// # Safety
/// As [`armor_decode`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_history_decode(
    data: *const ArmorData<'_>,
    input: *const c_char,
    source: *const c_char,
    age: usize,
    table: *const ArmorType,
    message: *mut c_void,
) -> c_int {
    guard(|| unsafe {
        let past = message_of_age(&open_history(data, input, source)?, age)?;
        let data = read_pointer(data, "data")?;
        let (parts, input) = (&data.handle.0, past.header.id());
        let read = || read_layout(table);
        parts.with_input_type(input, table.addr(), read, |used| {
            let arena = &mut data.arena.borrow_mut();
            decode_into(&used.layout, past.data.bytes(), message, arena)
        })
    })
}

/// Takes the message of that age, of an input with the schema `ARMOR_ANY`, as `armor_any_received` takes the
/// one that has arrived: with its type, its schema and its stamp, to be passed on in this call or later.
/// NULL if there is none, or the input has a type of its own. Free it with `armor_any_free`.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_history_any(
    data: *const ArmorData<'_>,
    input: *const c_char,
    source: *const c_char,
    age: usize,
) -> *mut ArmorAny {
    guard_value(std::ptr::null_mut(), || {
        let past = message_of_age(&unsafe { open_history(data, input, source) }?, age)?;
        take_any(&past.header, &past.data)
    })
}

/// Returns the age of the message whose stamp is nearest to a time; of several, of the newest.
/// `ARMOR_NO_AGE` if there are no messages.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_history_nearest(
    data: *const ArmorData<'_>,
    input: *const c_char,
    source: *const c_char,
    stamp_s: f64,
) -> usize {
    guard_value(ARMOR_NO_AGE, || {
        let history = unsafe { open_history(data, input, source) }?;
        Ok(history.nearest_age(stamp_s).unwrap_or(ARMOR_NO_AGE))
    })
}

/// Returns the age of the later one of the two messages between which a time lies, to interpolate; that
/// of the earlier one, if `earlier_age` is not NULL, is written there. Both are the same if the stamp of a
/// message is that time exactly. `ARMOR_NO_AGE` if the time lies between no two messages of the same
/// process start of the publisher.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_history_around(
    data: *const ArmorData<'_>,
    input: *const c_char,
    source: *const c_char,
    stamp_s: f64,
    earlier_age: *mut usize,
) -> usize {
    guard_value(ARMOR_NO_AGE, || unsafe {
        let ages = open_history(data, input, source)?.ages_around(stamp_s);
        let (earlier, later) = ages.unwrap_or((ARMOR_NO_AGE, ARMOR_NO_AGE));
        if !earlier_age.is_null() {
            write_value(earlier_age, earlier)?;
        }
        Ok(later)
    })
}
