//! What C receives: messages and the values of parameters.

use super::*;

/// Writes a value to where C wants it.
///
/// # Safety
/// `place` is NULL or a place for a value.
pub(super) unsafe fn write_value<T>(place: *mut T, value: T) -> Result<(), Failure> {
    if place.is_null() {
        return Err(Failure::null("the place for the result"));
    }
    unsafe { place.write(value) };
    Ok(())
}

/// Decodes a message into the memory of a struct.
///
/// # Safety
/// `message` is NULL, or a struct of the type of this layout.
pub(super) unsafe fn decode_into(
    layout: &Layout,
    bytes: &[u8],
    message: *mut c_void,
    arena: &mut Arena,
) -> Result<(), Failure> {
    if message.is_null() {
        return Err(Failure::null("message"));
    }
    let content = unsafe {
        message.cast::<u8>().write_bytes(0, layout.size);
        std::slice::from_raw_parts_mut(message.cast::<u8>(), layout.size)
    };
    decode_struct(layout, bytes, content, arena)
}

/// Decodes received data into `message`, a struct of the type that the table describes. Its texts and
/// lists are valid during the call of `data_received`. A list of numbers is not copied if it has arrived
/// aligned; bytes always are. `ARMOR_DECODE` checks the type of the struct.
///
/// # Safety
/// The pointers are NULL or valid; `message` is a struct of the type that the table describes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_decode(
    data: *const ArmorData<'_>,
    table: *const ArmorType,
    message: *mut c_void,
) -> c_int {
    guard(|| unsafe {
        let data = read_pointer(data, "data")?;
        let parts = &data.handle.0;
        let read = || read_layout(table);
        parts.with_input_type(data.input, table.addr(), read, |used| {
            let arena = &mut data.arena.borrow_mut();
            decode_into(&used.layout, data.data.bytes(), message, arena)
        })
    })
}

/// Returns the encoded message, as it has arrived; valid during the call of `data_received`.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_data_bytes(
    data: *const ArmorData<'_>,
    len: *mut usize,
) -> *const u8 {
    guard_value(std::ptr::null(), || unsafe {
        let bytes = read_pointer(data, "data")?.data.bytes();
        write_value(len, bytes.len())?;
        Ok(bytes.as_ptr())
    })
}

/// Keeps received data beyond the call: a large message stays in the shared memory in which it came,
/// unless the component keeps so many that the publisher would lack memory; others are copied once.
/// NULL if `data` is NULL. Free it with `armor_kept_free`.
///
/// # Safety
/// `data` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_keep(data: *const ArmorData<'_>) -> *mut ArmorKept {
    guard_value(std::ptr::null_mut(), || {
        let data = unsafe { read_pointer(data, "data") }?;
        let message: KeptMessage = data.data.keep();
        let bytes = RefCell::new(KeptBytes { message, arena: Arena::default() });
        let port = data.handle.0.find_input(data.input);
        Ok(Box::into_raw(Box::new(ArmorKept { bytes, port, input: data.input.into() })))
    })
}

/// Decodes a kept message, as `armor_decode`; its texts and lists are valid until it is freed. One thread
/// at a time may use a kept message.
///
/// # Safety
/// As [`armor_decode`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_decode_kept(
    kept: *const ArmorKept,
    table: *const ArmorType,
    message: *mut c_void,
) -> c_int {
    guard(|| unsafe {
        let kept = read_pointer(kept, "kept")?;
        let layout = Layout::of_table(&read_type(table, 0)?)?;
        let of = PortType::of_schema(layout.schema.clone())?;
        if let Some(port) = &kept.port {
            check_type("input", &kept.input, port, &of)?;
        }
        let bytes = &mut *kept.bytes.borrow_mut();
        decode_into(&layout, &bytes.message, message, &mut bytes.arena)
    })
}

/// Returns the bytes of a kept message; valid until it is freed.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_kept_bytes(kept: *const ArmorKept, len: *mut usize) -> *const u8 {
    guard_value(std::ptr::null(), || unsafe {
        let bytes = read_pointer(kept, "kept")?.bytes.borrow();
        write_value(len, bytes.message.len())?;
        Ok(bytes.message.as_ptr())
    })
}

/// Frees a kept message; NULL is allowed.
///
/// # Safety
/// `kept` is NULL, or from `armor_keep` and not freed yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_kept_free(kept: *mut ArmorKept) {
    guard(|| {
        if !kept.is_null() {
            drop(unsafe { Box::from_raw(kept) });
        }
        Ok(())
    });
}

/// Reads a number, in SI; of a ratio in its unit.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_value_number(
    value: *const ArmorValue<'_>,
    number: *mut f64,
) -> c_int {
    guard(|| unsafe { write_value(number, read_pointer(value, "value")?.value.number()?) })
}

/// Reads a whole number.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_value_integer(
    value: *const ArmorValue<'_>,
    number: *mut i64,
) -> c_int {
    guard(|| unsafe { write_value(number, read_pointer(value, "value")?.value.integer()?) })
}

/// Reads a flag.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_value_flag(value: *const ArmorValue<'_>, flag: *mut bool) -> c_int {
    guard(|| unsafe { write_value(flag, read_pointer(value, "value")?.value.flag()?) })
}

/// Returns a text, a choice or a colour, as written in the file; NULL if the parameter is a number or a
/// flag. Valid until the next call with this value.
///
/// # Safety
/// `value` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_value_text(value: *const ArmorValue<'_>) -> *const c_char {
    guard_value(std::ptr::null(), || {
        let value = unsafe { read_pointer(value, "value") }?;
        *value.text.borrow_mut() = to_c_text(value.value.text()?);
        Ok(value.text.borrow().as_ptr())
    })
}

/// Returns a path, resolved against the folder of the file that assigns it; NULL if the parameter is a
/// number or a flag. Valid until the next call with this value.
///
/// # Safety
/// `value` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_value_path(value: *const ArmorValue<'_>) -> *const c_char {
    guard_value(std::ptr::null(), || {
        let value = unsafe { read_pointer(value, "value") }?;
        let path = value.value.path()?;
        *value.text.borrow_mut() = CString::new(path.as_os_str().as_bytes()).unwrap_or_default();
        Ok(value.text.borrow().as_ptr())
    })
}
