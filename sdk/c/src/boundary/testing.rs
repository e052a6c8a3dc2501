//! Components under test: no socket, no thread; the test advances the time.

use std::time::Duration;

use armor_sdk::testing::{ReportKind, RunState, TestedComponent};

use super::received::decode_into;
use super::*;
use crate::declaration::ArmorSetting;

/// The state of a component.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmorState {
    /// It is being built.
    Starting = 0,
    /// It gets no calls.
    Frozen = 1,
    /// It works.
    Active = 2,
    /// It has reported that it is done.
    Done = 3,
    /// It has failed.
    Failed = 4,
}

/// What a component has reported.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ArmorReport {
    /// One of `armor_outcome_kind`.
    pub kind: c_int,
    /// The name of an event, or why it has failed; empty of `ARMOR_OUTCOME_KIND_DONE`. Valid until the
    /// next call with this test.
    pub text: *const c_char,
    /// The value of an event.
    pub value: f64,
}

/// A component under test. One thread may use it. Time begins at 1000 s and passes only in
/// `armor_test_tick_after` and `armor_test_pass_time`.
pub struct ArmorTest {
    tested: TestedComponent,
    handle: Arc<ArmorHandle>,
    outputs: Vec<Vec<u8>>,
    arena: Arena,
    text: CString,
}

/// Builds a component for a test; the parameters that are not given have their defaults. It is frozen
/// until `armor_test_start`. NULL if it cannot be built, with the reason in `armor_last_error`. Free it
/// with `armor_test_free`.
///
/// # Safety
/// The pointers are NULL or valid; `component` and all that it leads to live as long as the test.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_build(
    component: *const ArmorComponent,
    settings: *const ArmorSetting,
    setting_count: usize,
) -> *mut ArmorTest {
    guard_value(std::ptr::null_mut(), || {
        let component = unsafe { read_pointer(component, "component") }?;
        let kind = unsafe { read_kind(component) }?;
        let settings = unsafe { read_slice(settings, setting_count, "settings") }?;
        let read = |setting: &ArmorSetting| unsafe {
            let name = read_text(setting.name, "the name of a parameter")?;
            Ok((name, read_text(setting.value, "the value of a parameter")?))
        };
        let settings = settings.iter().map(read).collect::<Result<Vec<_>, Failure>>()?;
        let functions = CFunctions(*component);
        let mut created = None;
        let tested = TestedComponent::build_foreign(&kind, &settings, |armor| {
            let (component, handle) = create_component(functions, armor)?;
            created = Some(handle);
            Ok(Box::new(component))
        })?;
        let handle = created.ok_or_else(|| Failure::null("handle"))?;
        let (outputs, arena, text) = (Vec::new(), Arena::default(), CString::default());
        Ok(Box::into_raw(Box::new(ArmorTest { tested, handle, outputs, arena, text })))
    })
}

/// Frees a component under test; NULL is allowed.
///
/// # Safety
/// `test` is NULL, or from `armor_test_build` and not freed yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_free(test: *mut ArmorTest) {
    guard(|| {
        if !test.is_null() {
            drop(unsafe { Box::from_raw(test) });
        }
        Ok(())
    });
}

/// Runs a step of a test.
///
/// # Safety
/// `test` is NULL or valid, and no other thread uses it.
unsafe fn take_step(
    test: *mut ArmorTest,
    step: impl FnOnce(&mut ArmorTest) -> Result<(), Failure>,
) -> c_int {
    guard(|| step(unsafe { test.as_mut() }.ok_or_else(|| Failure::null("test"))?))
}

/// Activates the component: `exec` with `ARMOR_CALL_STARTED`. As every step of a test, it returns
/// `ARMOR_ERROR_FAILED` if the component fails, with the reason in `armor_last_error`.
///
/// # Safety
/// `test` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_start(test: *mut ArmorTest) -> c_int {
    unsafe { take_step(test, |test| Ok(test.tested.start()?)) }
}

/// Freezes the component: `exec` with `ARMOR_CALL_STOPPING`.
///
/// # Safety
/// `test` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_stop(test: *mut ArmorTest) -> c_int {
    unsafe { take_step(test, |test| Ok(test.tested.stop()?)) }
}

/// Calls `exec` after each message from now on, as in a file that gives the component no rate.
///
/// # Safety
/// `test` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_execute_on_data(test: *mut ArmorTest) -> c_int {
    unsafe {
        take_step(test, |test| {
            test.tested.execute_on_data();
            Ok(())
        })
    }
}

fn duration(seconds: f64) -> Result<Duration, Failure> {
    Duration::try_from_secs_f64(seconds)
        .map_err(|why| Failure::new(ArmorError::Test, format!("{seconds} s: {why}")))
}

/// Lets time pass, then calls `exec` with `ARMOR_CALL_TICK`.
///
/// # Safety
/// `test` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_tick_after(test: *mut ArmorTest, seconds: f64) -> c_int {
    unsafe { take_step(test, |test| Ok(test.tested.tick_after(duration(seconds)?)?)) }
}

/// Lets time pass without a call.
///
/// # Safety
/// `test` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_pass_time(test: *mut ArmorTest, seconds: f64) -> c_int {
    unsafe {
        take_step(test, |test| {
            test.tested.pass_time(duration(seconds)?);
            Ok(())
        })
    }
}

/// Changes a live parameter; the value as in a file.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_set_parameter(
    test: *mut ArmorTest,
    name: *const c_char,
    value: *const c_char,
) -> c_int {
    unsafe {
        take_step(test, |test| {
            let (name, value) = (read_text(name, "name")?, read_text(value, "value")?);
            Ok(test.tested.set_parameter(name, value)?)
        })
    }
}

/// Hands a message, created now, to the component as data of an input.
///
/// # Safety
/// As [`armor_send_data`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_send(
    test: *mut ArmorTest,
    input: *const c_char,
    table: *const ArmorType,
    message: *const c_void,
) -> c_int {
    unsafe {
        take_step(test, |test| {
            let input = read_text(input, "input")?;
            let (of, bytes) = with_type(&test.handle, table, |used| {
                let content = read_slice(message.cast::<u8>(), used.layout.size, "message")?;
                let memory = MessageMemory::of_message();
                let message = EncodedMessage::of_struct(&used.layout, content, &memory)?;
                Ok((used.of.clone(), message.with_pieces(|pieces| pieces.concat())))
            })?;
            // Not within the use of the type: the component uses its types, too.
            Ok(test.tested.send_encoded(input, None, &of, &bytes)?)
        })
    }
}

/// Hands an encoded message of the type with this schema to the component as data of an input.
///
/// # Safety
/// As [`armor_send_bytes`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_send_bytes(
    test: *mut ArmorTest,
    input: *const c_char,
    schema: *const c_char,
    pieces: *const ArmorPiece,
    count: usize,
) -> c_int {
    unsafe {
        take_step(test, |test| {
            let of = PortType::parse(read_text(schema, "schema")?)?;
            let pieces = read_slice(pieces, count, "pieces")?;
            let bytes = |piece: &ArmorPiece| read_slice(piece.data.cast(), piece.len, "a piece");
            let pieces = pieces.iter().map(bytes).collect::<Result<Vec<_>, _>>()?;
            let input = read_text(input, "input")?;
            Ok(test.tested.send_encoded(input, None, &of, &pieces.concat())?)
        })
    }
}

/// Returns the number of messages that have been published on an output; 0 if there is no such output.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_output_count(
    test: *const ArmorTest,
    output: *const c_char,
) -> usize {
    guard_value(0, || unsafe {
        let test = read_pointer(test, "test")?;
        Ok(test.tested.encoded_outputs(read_text(output, "output")?)?.1.len())
    })
}

fn find_output(test: &ArmorTest, output: &str, index: usize) -> Result<(String, Vec<u8>), Failure> {
    let (schema, mut messages) = test.tested.encoded_outputs(output)?;
    if index >= messages.len() {
        let why =
            format!("`{output}` has {} messages, none with the index {index}", messages.len());
        return Err(Failure::new(ArmorError::Test, why));
    }
    Ok((schema, messages.swap_remove(index)))
}

/// Decodes the message with this index, from 0, of those that have been published on an output. Its texts
/// and lists are valid until the test is freed.
///
/// # Safety
/// As [`armor_decode`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_output(
    test: *mut ArmorTest,
    output: *const c_char,
    index: usize,
    table: *const ArmorType,
    message: *mut c_void,
) -> c_int {
    unsafe {
        take_step(test, |test| {
            let id = read_text(output, "output")?;
            let (schema, bytes) = find_output(test, id, index)?;
            let port = DeclaredPort::of_schema(PortType::parse(&schema)?);
            let ArmorTest { handle, outputs, arena, .. } = test;
            outputs.push(bytes);
            let bytes = outputs.last().map(Vec::as_slice).unwrap_or_default();
            with_type(handle, table, |used| {
                check_type("output", id, &port, &used.of)?;
                decode_into(&used.layout, bytes, message, arena)
            })
        })
    }
}

/// Returns the bytes of a message of an output of the type with this schema, as `armor_test_output`;
/// NULL if there is none. Valid until the test is freed.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_output_bytes(
    test: *mut ArmorTest,
    output: *const c_char,
    index: usize,
    schema: *const c_char,
    len: *mut usize,
) -> *const u8 {
    guard_value(std::ptr::null(), || unsafe {
        let test = test.as_mut().ok_or_else(|| Failure::null("test"))?;
        let id = read_text(output, "output")?;
        let (declared, bytes) = find_output(test, id, index)?;
        let used = PortType::parse(read_text(schema, "schema")?)?;
        let port = DeclaredPort::of_schema(PortType::parse(&declared)?);
        check_type("output", id, &port, &used)?;
        if len.is_null() {
            return Err(Failure::null("len"));
        }
        len.write(bytes.len());
        test.outputs.push(bytes);
        Ok(test.outputs.last().map_or(std::ptr::null(), |bytes| bytes.as_ptr()))
    })
}

/// Returns the state of the component, one of `armor_state`; -1 if `test` is NULL.
///
/// # Safety
/// `test` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_state(test: *const ArmorTest) -> c_int {
    guard_value(-1, || {
        let state = match unsafe { read_pointer(test, "test") }?.tested.state() {
            RunState::Starting => ArmorState::Starting,
            RunState::Frozen => ArmorState::Frozen,
            RunState::Active => ArmorState::Active,
            RunState::Done => ArmorState::Done,
            RunState::Failed => ArmorState::Failed,
        };
        Ok(state as c_int)
    })
}

/// Returns the number of reports so far.
///
/// # Safety
/// `test` is NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_report_count(test: *const ArmorTest) -> usize {
    guard_value(0, || Ok(unsafe { read_pointer(test, "test") }?.tested.reports().len()))
}

/// Reads the report with this index, from 0.
///
/// # Safety
/// The pointers are NULL or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armor_test_report(
    test: *mut ArmorTest,
    index: usize,
    report: *mut ArmorReport,
) -> c_int {
    unsafe {
        take_step(test, |test| {
            let given = test.tested.reports().get(index).ok_or_else(|| {
                let why = format!("there is no report with the index {index}");
                Failure::new(ArmorError::Test, why)
            })?;
            let (kind, text, value) = match given {
                ReportKind::Done => (ArmorOutcomeKind::Done, "", 0.0),
                ReportKind::Failed { reason } => (ArmorOutcomeKind::Failed, reason.as_str(), 0.0),
                ReportKind::Event { name, value } => {
                    (ArmorOutcomeKind::Event, name.as_str(), *value)
                }
            };
            test.text = to_c_text(text);
            if report.is_null() {
                return Err(Failure::null("report"));
            }
            report.write(ArmorReport { kind: kind as c_int, text: test.text.as_ptr(), value });
            Ok(())
        })
    }
}
