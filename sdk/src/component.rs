//! A component: a type with a constructor and the three functions that the system calls.

use crate::armor::Armor;
use crate::call::{Call, Fault, Outcome};
use crate::data::{Data, Header};
use crate::effect::ParameterEffect;
use crate::event::DeclaredEvent;
use crate::parameter::{Parameter, Value};

/// One task, in one process.
///
/// `exec`, `data_received` and `parameter_received` never run at the same time: no locks are
/// needed. A frozen component gets no calls at all.
pub trait Component: Sized + Send + 'static {
    /// Name of this kind of component, as the file has it.
    const KIND: &'static str;
    /// What it does, in one line.
    const SUMMARY: &'static str;
    /// What can be set in the file.
    const PARAMETERS: &'static [Parameter] = &[];
    /// What each port carries, in one line, for `armor describe` and the designer.
    const PORTS: &'static [(&'static str, &'static str)] = &[];

    /// The events that it reports; see [`Events`](crate::Events). To report another one is a failure,
    /// and `armor check` refuses a mission that waits for another one. `done` and `failed` are reports
    /// of every component and not declared.
    const EVENTS: &'static [DeclaredEvent] = &[];

    /// Whether it ever returns [`Outcome::Done`]. A component that works until it is frozen declares
    /// `false`; `armor check` then refuses a mission that waits for its `done`.
    const REPORTS_DONE: bool = true;

    /// Whether its task comes to an end by itself, as that of an explorer does: `armor check` then warns of
    /// a place in which it works and nothing waits for its `done`.
    const ENDS_BY_ITSELF: bool = false;

    /// Whether it works at its rate, so that it does nothing without one: `armor check` then warns of a
    /// file that gives it none.
    const NEEDS_RATE: bool = false;

    /// Whether it reads data of the system to which no link leads, as a recorder does. Where the file places
    /// such a component on another host, that host may read all data.
    const READS_ALL: bool = false;

    /// Groups of inputs and parameters of which one must be fed or given, such as the sources of a
    /// camera's pictures.
    const NEEDS_ONE_OF: &'static [&'static [&'static str]] = &[];

    /// Inputs whose data it takes for missing from some age on, such as `("velocity", "0.5s")`, or
    /// with the name of the parameter that states the age, `("path", "timeout")`. `armor check` warns
    /// of a producer whose rate is too low for that.
    const STALE_AFTER: &'static [(&'static str, &'static str)] = &[];

    /// Values of parameters, allowed by their ranges, that decide whether, and when, it does what it is
    /// for: `("laps", ParameterEffect::NeverDone("0"))`. `armor check` warns where such a value makes
    /// a mission wait in vain.
    const VALUE_EFFECTS: &'static [(&'static str, ParameterEffect)] = &[];

    /// Ports whose data are taken in a frame of the robot, such as a laser's: each with the parameter of
    /// the format `frame` that names it, `("scan", "laser_frame")`. `armor check` refuses a file that
    /// links the port and does not place the frame on the robot.
    const FRAMES: &'static [(&'static str, &'static str)] = &[];

    /// Declares ports and asks for parameters. Runs for `--describe` too, so it opens no hardware
    /// or files: `exec` does, at [`Call::Started`].
    ///
    /// # Errors
    /// Any; the process then logs it and ends.
    fn new(armor: Armor) -> Result<Self, Fault>;

    /// A parameter that was asked for has arrived, or a live one has changed. A component that asks
    /// for parameters implements it; without that, each value is refused.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let _ = value;
        Err(format!(
            "its value has arrived, but `{}` does not implement `parameter_received`; implement it, \
             with `Ok(self.parameters.set(name, value)?)` if its parameters are derived; otherwise \
             do not request `{name}`",
            Self::KIND
        )
        .into())
    }

    /// Data of an input has arrived. Data of one input arrive in order, each at most once.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let _ = (header, data);
        Ok(())
    }

    /// One step of the component's work; returns what the executive should know.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let _ = call;
        Ok(Outcome::CarryOn)
    }
}
