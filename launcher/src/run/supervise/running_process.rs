//! A process that the launcher has started, on this host or through the agent of another.

use crate::run::component_link::ComponentLink;
use crate::run::process::ProcessGroup;
use crate::run::remote::RemoteProcess;

/// A running process.
pub(super) struct RunningProcess {
    pub(super) process: ProcessHandle,
    pub(super) link: Option<ComponentLink>,
}

/// A process of this host or of another.
pub(super) enum ProcessHandle {
    Here(ProcessGroup),
    There(RemoteProcess),
}

/// Distinguishes the starts of one component.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ProcessId {
    Here(ProcessGroup),
    There(u64),
}

impl ProcessHandle {
    pub(super) fn id(&self) -> ProcessId {
        match self {
            Self::Here(group) => ProcessId::Here(*group),
            Self::There(process) => ProcessId::There(process.id),
        }
    }

    pub(super) fn terminate(&self) {
        match self {
            Self::Here(group) => group.terminate(),
            Self::There(process) => process.terminate(),
        }
    }

    pub(super) fn kill(&self) {
        match self {
            Self::Here(group) => group.kill(),
            Self::There(process) => process.kill(),
        }
    }
}
