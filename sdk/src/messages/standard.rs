//! Single values (`std_msgs`), log records (`rcl_interfaces/Log`) and the progress of a task.

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
    /// The process that logs it.
    pub name: String,
    /// The text.
    pub msg: String,
    /// Source file.
    pub file: String,
    /// Function.
    pub function: String,
    /// Line in the file.
    pub line: u32,
}

/// How far a component's task has come (our own; ROS has no such message).
///
/// A component whose task takes long may publish it, by convention on an output named `progress`,
/// at about once per second and whenever `task` changes (`ProgressPace`). `armor run` shows the
/// newest one.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Progress {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// What is being done, such as `exploring`; empty while no task is active.
    pub task: String,
    /// Share of the task that is done, 0 … 1 (no unit); NaN if unknown.
    pub fraction: f32,
    /// Details for people, such as `84 % explored, 3.2 m to the goal`; may be empty.
    pub detail: String,
}

impl Default for Progress {
    /// No task, and an unknown fraction.
    fn default() -> Self {
        Self { stamp: 0.0, task: String::new(), fraction: f32::NAN, detail: String::new() }
    }
}

impl Progress {
    /// The fraction limited to 0..=1; `None` if unknown.
    pub fn known_fraction(&self) -> Option<f32> {
        self.fraction.is_finite().then(|| self.fraction.clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fraction_of_a_task_is_limited_and_may_be_unknown() {
        let known = |fraction| Progress { fraction, ..Progress::default() }.known_fraction();
        assert_eq!(Progress::default().known_fraction(), None);
        assert_eq!((known(0.25), known(1.5), known(-0.1)), (Some(0.25), Some(1.0), Some(0.0)));
        assert_eq!(known(f32::INFINITY), None);
    }
}
