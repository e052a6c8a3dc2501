//! What tools ask about parameters: list them, set one, list what changed. The questions do not
//! depend on the answering side, which is the configd of a running system or one over a file alone.

use armor_wire::config::{
    ChangeRecord, ConfigReply, ConfigRequest, FindingRecord, ListedParameter,
};
use armor_wire::hello::Refusal;
use thiserror::Error;

use crate::dial::ConnectError;
use crate::directory::DirectoryError;

/// Why configd gave no answer.
#[derive(Debug, Error)]
pub enum ConfigdError {
    /// The registry does not know it.
    #[error(transparent)]
    Directory(#[from] DirectoryError),
    /// It cannot be reached.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// It cannot answer that, with its reason.
    #[error("{}", .0.text)]
    Refused(Refusal),
    /// The connection ended before the answer.
    #[error("configd gave no answer: {0}")]
    Ended(String),
}

/// The parameters of a system.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterList {
    /// The version of the file that is in force.
    pub version: u64,
    /// Whether the file on the disk is another one, and refused.
    pub refused: bool,
    /// The parameters, component by component.
    pub parameters: Vec<ListedParameter>,
}

/// The result of setting a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum SetOutcome {
    /// The value is in the file, and in force.
    Set {
        /// The version that has it.
        version: u64,
        /// What changed by it, and when that takes effect; empty if the file had the value already.
        changes: Vec<ChangeRecord>,
        /// Warnings about the value and the file with it.
        findings: Vec<FindingRecord>,
    },
    /// Nothing was written.
    Rejected {
        /// Why.
        text: String,
        /// The findings of the file as it would be, or as it is.
        findings: Vec<FindingRecord>,
        /// How many more findings there are.
        left_out: u32,
    },
}

/// What changed between two versions.
#[derive(Clone, Debug, PartialEq)]
pub struct Differences {
    /// The earlier version.
    pub from: u64,
    /// The later version.
    pub to: u64,
    /// What changed, and when that takes or took effect.
    pub changes: Vec<ChangeRecord>,
    /// How many more changes there are.
    pub left_out: u32,
}

/// The questions, for any type that can send one request and return its reply.
pub trait Questions {
    /// Why there is no answer.
    type Error: From<ConfigdError>;

    /// Sends the request that `request` makes with the given number, and waits for its reply; a
    /// refusal is an error.
    ///
    /// # Errors
    /// If it is refused, or there is no reply.
    fn ask(
        &mut self,
        request: impl FnOnce(u64) -> ConfigRequest,
    ) -> Result<ConfigReply, Self::Error>;

    /// The parameters of all components, or of one.
    ///
    /// # Errors
    /// If there is no such component, or no answer.
    fn parameters(&mut self, component: Option<&str>) -> Result<ParameterList, Self::Error> {
        let mut all = ParameterList { version: 0, refused: false, parameters: Vec::new() };
        loop {
            let from = u32::try_from(all.parameters.len()).unwrap_or(u32::MAX);
            let component = component.map(Into::into);
            match self.ask(|request| ConfigRequest::List { request, component, from })? {
                ConfigReply::Listed { version, refused, parameters, total, .. } => {
                    if from > 0 && version != all.version {
                        // Pages of two versions do not fit together: begin again.
                        all.parameters.clear();
                        continue;
                    }
                    (all.version, all.refused) = (version, refused);
                    let is_last = parameters.is_empty();
                    all.parameters.extend(parameters);
                    if is_last || all.parameters.len() >= total as usize {
                        return Ok(all);
                    }
                }
                other => return Err(unexpected(&other).into()),
            }
        }
    }

    /// Writes a value into the file; `None` removes it, so that the default applies.
    ///
    /// # Errors
    /// If there is no answer; the value may have been written nevertheless.
    fn set(
        &mut self,
        component: &str,
        parameter: &str,
        value: Option<&str>,
    ) -> Result<SetOutcome, Self::Error> {
        let reply = self.ask(|request| ConfigRequest::Set {
            request,
            component: component.into(),
            parameter: parameter.into(),
            value: value.map(Into::into),
        })?;
        match reply {
            ConfigReply::Set { version, changes, findings, .. } => {
                Ok(SetOutcome::Set { version, changes, findings })
            }
            ConfigReply::Rejected { text, findings, left_out, .. } => {
                Ok(SetOutcome::Rejected { text, findings, left_out })
            }
            other => Err(unexpected(&other).into()),
        }
    }

    /// What changed from version `from` (by default the one before `to`) to version `to` (by
    /// default the one in force).
    ///
    /// # Errors
    /// If the versions are no longer kept, or there is no answer.
    fn differences(
        &mut self,
        from: Option<u64>,
        to: Option<u64>,
    ) -> Result<Differences, Self::Error> {
        match self.ask(|request| ConfigRequest::Diff { request, from, to })? {
            ConfigReply::Differences { from, to, changes, left_out, .. } => {
                Ok(Differences { from, to, changes, left_out })
            }
            other => Err(unexpected(&other).into()),
        }
    }
}

fn unexpected(reply: &ConfigReply) -> ConfigdError {
    ConfigdError::Ended(format!("it answers something else: {reply:?}"))
}
