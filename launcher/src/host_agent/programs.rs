//! Which program runs a component here: a kind of this host, or the executable that the launcher has
//! sent.

use std::path::PathBuf;
use std::sync::Arc;

use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::remote_process::RemoteStart;

use super::executables::ExecutableStore;
use crate::kinds::build::{find_build, fingerprint_manifest};
use crate::kinds::{Catalogue, Origin, describe_executable};

/// What runs a component.
#[derive(Debug)]
pub(super) struct FoundProgram {
    pub(super) origin: Origin,
    /// What a person should know of it, such as that it is another build.
    pub(super) notice: String,
}

/// Finds programs in the folders of this host and among those that were received.
pub(super) struct ProgramFinder {
    /// The folders that the agent was started with.
    pub(super) directories: Vec<PathBuf>,
    /// What the launcher has sent, if that is accepted.
    pub(super) executables: Option<ExecutableStore>,
    /// The name of this host.
    pub(super) host: String,
    /// The host of the launcher.
    pub(super) from: String,
}

/// What there is for a component.
enum ProgramChoice {
    Found(FoundProgram),
    /// The launcher has sent it earlier.
    Received(PathBuf),
    /// The launcher must send it.
    Wanted,
}

impl ProgramFinder {
    /// Whether the launcher must send the executable first.
    pub(super) async fn wants_executable(
        self: &Arc<Self>,
        start: &RemoteStart,
    ) -> Result<bool, Refusal> {
        if self.executables.is_none() {
            return Ok(false);
        }
        let choice = self.run_blocking(start, Self::choose_program).await;
        let choice = choice.map_err(|text| Refusal::new(RefusalCode::WrongPurpose, text))?;
        Ok(matches!(choice, ProgramChoice::Wanted))
    }

    /// Finds the program of a component, and checks that it is of the kind for which the file was
    /// checked.
    pub(super) async fn find_program(
        self: &Arc<Self>,
        start: &RemoteStart,
    ) -> Result<FoundProgram, String> {
        self.run_blocking(start, Self::find_checked).await
    }

    /// Reading executables takes long enough to be silent meanwhile.
    async fn run_blocking<T: Send + 'static>(
        self: &Arc<Self>,
        start: &RemoteStart,
        find: fn(&Self, &RemoteStart) -> Result<T, String>,
    ) -> Result<T, String> {
        let (finder, start) = (Arc::clone(self), start.clone());
        let finding = tokio::task::spawn_blocking(move || find(&finder, &start));
        finding.await.map_err(|error| error.to_string())?
    }

    fn find_checked(&self, start: &RemoteStart) -> Result<FoundProgram, String> {
        let (own, kind) = (&self.host, &start.kind);
        let path = match self.choose_program(start)? {
            ProgramChoice::Found(found) => return Ok(found),
            ProgramChoice::Received(path) => path,
            ProgramChoice::Wanted => {
                return Err(format!("the executable of {kind} is missing on {own} again"));
            }
        };
        let manifest = describe_executable(&path)
            .map_err(|why| format!("the executable of {kind} does not work on {own}: {why}"))?;
        if manifest.kind != *kind || fingerprint_manifest(&manifest) != start.manifest {
            return Err(format!(
                "the executable of {kind} describes itself differently on {own}: its ports, \
                 parameters or events depend on the host"
            ));
        }
        Ok(FoundProgram { origin: Origin::Executable(path), notice: String::new() })
    }

    fn choose_program(&self, start: &RemoteStart) -> Result<ProgramChoice, String> {
        let gathered =
            Catalogue::gather(&self.directories, []).map_err(|error| format!("{error:#}"))?;
        let mut kinds = gathered.kinds;
        let known = kinds.remove(&start.kind).filter(|kind| kind.rivals.is_empty());
        let is_same = known.as_ref().is_some_and(|kind| find_build(&kind.origin) == start.build);
        if let Some(store) = &self.executables
            && start.executable_len > 0
            && !is_same
        {
            return Ok(match store.find(&start.kind, &start.build) {
                Some(path) => ProgramChoice::Received(path),
                None => ProgramChoice::Wanted,
            });
        }
        let (own, from, kind) = (&self.host, &self.from, &start.kind);
        let Some(known) = known else {
            return Err(format!(
                "the host {own} has no kind {kind}, or several; copy its executable into a folder \
                 there that `armor host --components FOLDER` names, or start the agent with \
                 --accept-executables"
            ));
        };
        if fingerprint_manifest(&known.manifest) != start.manifest {
            return Err(format!(
                "the kind {kind} on {own} has other ports, parameters or events than on {from}; \
                 copy the same executable to both, or start the agent with --accept-executables"
            ));
        }
        let notice = match is_same {
            true => String::new(),
            false => format!(
                "the kind {kind} on {own} is another build than on {from}, with the same ports and \
                 parameters"
            ),
        };
        Ok(ProgramChoice::Found(FoundProgram { origin: known.origin, notice }))
    }
}
