//! The parameters of a running system, listed and set through its configd, which writes the file.
//! A connection is made for each question and let go after it.

use std::io;
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use armor_sdk::configuration::{
    ConfigdConnection, ConfigdError, Parameters, Questions, SetOutcome,
};
use armor_sdk::directory::Directory;
use armor_wire::config::FindingRecord;

use crate::Wake;
use crate::watch::spawn;

/// How long the registry and configd have to answer.
const FOUND_WITHIN: Duration = Duration::from_secs(3);

/// What became of a wish to set a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// `component.parameter`.
    pub parameter: String,
    /// What it was to be; `None` if its default.
    pub value: Option<String>,
    /// Whether it is in the file, and in force.
    pub is_set: bool,
    /// What changed and when that takes effect, or why nothing was written.
    pub text: String,
    /// What is wrong with the file as it would be, or as it is.
    pub findings: Vec<FindingRecord>,
}

/// Where parameters are asked for and set.
pub struct ParameterDesk {
    wishes: Sender<Wish>,
    shared: Arc<Shared>,
}

enum Wish {
    List,
    Set { component: String, parameter: String, value: Option<String> },
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    listed: Option<Arc<Result<Parameters, String>>>,
    told: Option<Told>,
    is_asking: bool,
    /// Values were written into the file, and nobody has been told yet.
    has_written: bool,
}

impl ParameterDesk {
    /// Opens it; `from` says who asks, and `wake` is called at every answer.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn open(directory: &Directory, from: &str, wake: Wake) -> io::Result<Self> {
        let (wishes, asked) = mpsc::channel();
        let shared = Arc::<Shared>::default();
        let clerk = Clerk {
            directory: directory.clone(),
            from: format!("{from}-{}", std::process::id()),
            shared: Arc::clone(&shared),
            wake,
        };
        spawn("look-parameters", move || clerk.run(&asked))?;
        Ok(Self { wishes, shared })
    }

    /// Parameters that stay as they are, with no system behind them: for tests of what shows them.
    /// Whatever is wished is heard by nobody.
    pub fn still(listed: Parameters, told: Option<Told>) -> Self {
        let has_written = told.as_ref().is_some_and(|told| told.is_set);
        let listed = Some(Arc::new(Ok(listed)));
        let state = State { listed, told, is_asking: false, has_written };
        Self { wishes: mpsc::channel().0, shared: Arc::new(Shared { state: Mutex::new(state) }) }
    }

    /// Asks for all parameters; [`ParameterDesk::listed`] has them when they have come.
    pub fn list(&self) {
        let mut state = self.shared.lock();
        if !std::mem::replace(&mut state.is_asking, true) {
            drop(state);
            let _ = self.wishes.send(Wish::List);
        }
    }

    /// Writes a value into the file; `None` takes it out, so that the default holds. Then lists
    /// again.
    pub fn set(&self, component: &str, parameter: &str, value: Option<&str>) {
        let (component, parameter) = (component.into(), parameter.into());
        let value = value.map(Into::into);
        let _ = self.wishes.send(Wish::Set { component, parameter, value });
    }

    /// The parameters as they were when they were listed last, or why they could not be.
    pub fn listed(&self) -> Option<Arc<Result<Parameters, String>>> {
        self.shared.lock().listed.clone()
    }

    /// Whether a wish has changed the file since this was asked last.
    pub fn has_written(&self) -> bool {
        std::mem::take(&mut self.shared.lock().has_written)
    }

    /// What became of the last wish to set one.
    pub fn told(&self) -> Option<Told> {
        self.shared.lock().told.clone()
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

struct Clerk {
    directory: Directory,
    from: String,
    shared: Arc<Shared>,
    wake: Wake,
}

impl Clerk {
    fn run(self, asked: &Receiver<Wish>) {
        while let Ok(wish) = asked.recv() {
            if let Wish::Set { component, parameter, value } = &wish {
                let told = self.set(component, parameter, value.as_deref());
                self.shared.lock().told = Some(told);
            }
            let listed = self.connect().and_then(|mut configd| configd.parameters(None));
            let listed = listed.map_err(|error| error.to_string());
            let mut state = self.shared.lock();
            (state.listed, state.is_asking) = (Some(Arc::new(listed)), false);
            drop(state);
            (self.wake)();
        }
    }

    fn connect(&self) -> Result<ConfigdConnection, ConfigdError> {
        ConfigdConnection::open(&self.directory, &self.from, FOUND_WITHIN)
    }

    fn set(&self, component: &str, parameter: &str, value: Option<&str>) -> Told {
        let name = format!("{component}.{parameter}");
        let told = |is_set, text| Told {
            parameter: name.clone(),
            value: value.map(Into::into),
            is_set,
            text,
            findings: vec![],
        };
        let done = self.connect().and_then(|mut configd| configd.set(component, parameter, value));
        match done {
            Ok(SetOutcome::Set { changes, .. }) if changes.is_empty() => {
                told(true, format!("{name} is so already; nothing was written"))
            }
            Ok(SetOutcome::Set { version, changes }) => {
                self.shared.lock().has_written = true;
                let words = changes.iter().map(|change| match change.effect.as_str() {
                    "" => change.text.clone(),
                    effect => format!("{}; it {effect}", change.text),
                });
                told(true, format!("version {version}: {}", words.collect::<Vec<_>>().join("; ")))
            }
            Ok(SetOutcome::Rejected { text, findings, .. }) => {
                Told { findings, ..told(false, text) }
            }
            Err(error @ ConfigdError::Ended(_)) => {
                told(false, format!("{error}; whether it was written is not known"))
            }
            Err(error) => told(false, error.to_string()),
        }
    }
}
