//! The component's own code behind one type, and the guard around every call of it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use armor_wire::manifest::{EventManifest, RESERVED_EVENTS};
use armor_wire::name::is_name;

use crate::call::{Call, Fault, Outcome};
use crate::calls::CalledFunction;
use crate::component::Component;
use crate::data::{Data, Header};
use crate::parameter::Value;
use crate::participant::Participant;

/// The reason of a failure whose code gives none.
const NO_REASON: &str = "it has failed and gives no reason; return one with the failure";

/// A component without its type.
pub(crate) trait UserCode: Send {
    fn receive_parameter(&mut self, name: &str, value: &Value) -> Result<(), Fault>;
    fn receive_data(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault>;
    fn execute(&mut self, call: Call) -> Result<Outcome, Fault>;

    /// As of [`ForeignComponent`](crate::foreign::ForeignComponent).
    fn receive_data_then_execute(
        &mut self,
        header: &Header<'_>,
        data: &Data<'_>,
        enter_exec: &dyn Fn(),
    ) -> Result<Outcome, Fault> {
        self.receive_data(header, data)?;
        enter_exec();
        self.execute(Call::Data)
    }
}

impl<C: Component> UserCode for C {
    fn receive_parameter(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameter_received(name, value)
    }

    fn receive_data(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.data_received(header, data)
    }

    fn execute(&mut self, call: Call) -> Result<Outcome, Fault> {
        self.exec(call)
    }
}

/// Runs user code, first `function`, and writes what it has gathered for its links. A panic becomes an error; the main
/// loop then ends the process, after the report.
///
/// # Errors
/// The fault of the code, in words.
pub(crate) fn run_user_code(
    participant: &Participant,
    function: CalledFunction,
    code: impl FnOnce() -> Result<Outcome, Fault>,
) -> Result<Outcome, String> {
    let running = participant.calls.begin_call(function);
    participant.ports.trace.begin_call(function.name());
    let result = catch_unwind(AssertUnwindSafe(code));
    drop(running);
    participant.ports.flush_gathered();
    participant.ports.trace.end_call(!matches!(result, Ok(Ok(_))));
    match result {
        Ok(outcome) => outcome.map_err(|fault| or_no_reason(fault.to_string())),
        Err(panic) => {
            let text = describe_panic(panic.as_ref());
            participant.lifecycle.set_crashed();
            Err(format!("panicked: {text}"))
        }
    }
}

/// The reason of a failure, or that none is given: a report without words would explain nothing.
fn or_no_reason(reason: String) -> String {
    if reason.trim().is_empty() { NO_REASON.into() } else { reason }
}

/// The text of a panic; empty if it has none.
pub(crate) fn describe_panic(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}

/// Returns the outcome if the component may report it: an event only if it is one that a mission can wait for: its name has no other
/// meaning there, and it is among those that the component declares.
///
/// # Errors
/// In words, what is wrong with it.
pub(crate) fn check_outcome(
    outcome: Outcome,
    participant: &Participant,
) -> Result<Outcome, String> {
    if let Outcome::Failed(reason) = outcome {
        return Ok(Outcome::Failed(or_no_reason(reason)));
    }
    let declared = &participant.events;
    if matches!(outcome, Outcome::Done) && !participant.reports_done {
        return Err(
            "it is done, but declares `REPORTS_DONE` as false; remove that constant (in C \
                    `never_done`, in C++ set_never_done)"
                .into(),
        );
    }
    let Outcome::Event { name, .. } = &outcome else { return Ok(outcome) };
    if !is_name(name) || RESERVED_EVENTS.contains(&name.as_str()) {
        return Err(format!(
            "`{name}` is not a name for an event; `done` and `failed` are reports of their own"
        ));
    }
    // Which words a parameter has is the file's; `armor check` compares them.
    let is_declared = |event: &EventManifest| event.name == *name || !event.named_by.is_empty();
    if declared.iter().any(is_declared) {
        return Ok(outcome);
    }
    if declared.is_empty() {
        return Err(format!(
            "the event `{name}` is not declared: the component declares none; add `const EVENTS: \
             &'static [DeclaredEvent] = E::DECLARED;`, where E is its enum with `#[derive(Events)]` \
             (in C, add it to `events` of armor_component; in C++, declare_event(\"{name}\"))"
        ));
    }
    let declared: Vec<_> = declared.iter().map(|event| event.name.as_str()).collect();
    let declared = declared.join(", ");
    Err(format!("the event `{name}` is not declared, only: {declared}; add it to its events"))
}
