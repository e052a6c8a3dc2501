//! Which program runs a component here: a kind of this host, or the executable that the launcher has
//! sent.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::{io, thread};

use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::remote_process::RemoteStart;
use tokio::sync::oneshot;

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
    /// Where it searches.
    pub(super) searches: SearchThread,
}

type Search = Box<dyn FnOnce() + Send>;

/// The thread on which all programs are searched, one after the other: each search describes all
/// kinds, and an allocator that serves several threads would keep that memory once per thread.
pub(super) struct SearchThread(std::sync::mpsc::Sender<Search>);

impl SearchThread {
    /// Starts it. It ends with this handle.
    ///
    /// # Errors
    /// If the host allows no more threads.
    pub(super) fn start() -> io::Result<Self> {
        let (sender, searches) = std::sync::mpsc::channel::<Search>();
        thread::Builder::new().name("search".into()).spawn(move || {
            for search in searches {
                // The one who waits for it learns of the panic by its missing answer.
                let _ = catch_unwind(AssertUnwindSafe(search));
            }
        })?;
        Ok(Self(sender))
    }

    /// Runs a search after those that wait.
    ///
    /// # Errors
    /// If it panics.
    async fn run<T: Send + 'static>(
        &self,
        search: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, String> {
        let (sender, found) = oneshot::channel();
        let search = Box::new(move || drop(sender.send(search())));
        let panicked = || "the search for the program has panicked; see the agent's log".to_owned();
        self.0.send(search).map_err(|_| panicked())?;
        found.await.map_err(|_| panicked())
    }
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
        let choice = self.run_search(start, Self::choose_program).await;
        let choice = choice.map_err(|text| Refusal::new(RefusalCode::WrongPurpose, text))?;
        Ok(matches!(choice, ProgramChoice::Wanted))
    }

    /// Finds the program of a component, and checks that it is of the kind for which the file was
    /// checked.
    pub(super) async fn find_program(
        self: &Arc<Self>,
        start: &RemoteStart,
    ) -> Result<FoundProgram, String> {
        self.run_search(start, Self::find_checked).await
    }

    /// Reading executables takes long enough to be silent meanwhile.
    async fn run_search<T: Send + 'static>(
        self: &Arc<Self>,
        start: &RemoteStart,
        find: fn(&Self, &RemoteStart) -> Result<T, String>,
    ) -> Result<T, String> {
        let (finder, start) = (Arc::clone(self), start.clone());
        self.searches.run(move || find(&finder, &start)).await?
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searches_run_on_one_thread_and_survive_a_panic() {
        let searches = SearchThread::start().expect("starts");
        let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
        runtime.block_on(async {
            let run = || searches.run(|| thread::current().id());
            let (first, panicked) = (run().await, searches.run(|| panic!("a damaged file")).await);
            let panicked: Result<(), String> = panicked;
            assert!(panicked.is_err_and(|text| text.contains("panicked")));
            assert!(first.is_ok() && first == run().await);
        });
    }
}
