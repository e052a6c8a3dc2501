//! The parameters of a running system, listed and set through its configd, which writes the file.
//! Each request opens a connection and closes it afterwards.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;

use armor_sdk::configuration::{
    ConfigdConnection, ConfigdError, ParameterList, Questions, SetOutcome,
};
use armor_sdk::directory::Directory;
use armor_wire::config::FindingRecord;
use parking_lot::Mutex;

use crate::wake::{WakeCallback, spawn_detached};

/// Time within which the registry and configd must answer.
const FOUND_WITHIN: Duration = Duration::from_secs(3);

/// The result of a request to set a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SetReport {
    /// `component.parameter`.
    pub parameter: String,
    /// The requested value; `None` for the default.
    pub value: Option<String>,
    /// Whether the value is in the file and in force.
    pub is_set: bool,
    /// What changed and when that takes effect, or why nothing was written.
    pub text: String,
    /// Findings about the file as it would be, or as it is.
    pub findings: Vec<FindingRecord>,
}

/// Lists and sets parameters.
pub struct ParameterClient {
    requests: Sender<ParameterRequest>,
    shared: Arc<SharedParameters>,
}

enum ParameterRequest {
    List,
    Set { component: String, parameter: String, value: Option<String> },
}

#[derive(Default)]
struct SharedParameters {
    state: Mutex<ParameterState>,
}

#[derive(Default)]
struct ParameterState {
    listed: Option<Arc<Result<ParameterList, String>>>,
    last_result: Option<SetReport>,
    is_asking: bool,
    /// Values were written into the file since [`ParameterClient::has_written`] was last called.
    has_written: bool,
}

impl ParameterClient {
    /// Starts the thread that asks configd; `from` names the client, and `wake` is called at every
    /// answer.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn open(directory: &Directory, from: &str, wake: WakeCallback) -> io::Result<Self> {
        let (requests, asked) = mpsc::channel();
        let shared = Arc::<SharedParameters>::default();
        let thread = ParameterThread {
            directory: directory.clone(),
            from: format!("{from}-{}", std::process::id()),
            shared: Arc::clone(&shared),
            wake,
        };
        spawn_detached("look-parameters", move || thread.serve_requests(&asked))?;
        Ok(Self { requests, shared })
    }

    /// Returns a client that always shows these parameters and ignores requests: for tests of
    /// displays.
    pub fn still(listed: ParameterList, last_result: Option<SetReport>) -> Self {
        let has_written = last_result.as_ref().is_some_and(|result| result.is_set);
        let listed = Some(Arc::new(Ok(listed)));
        let state = ParameterState { listed, last_result, is_asking: false, has_written };
        Self {
            requests: mpsc::channel().0,
            shared: Arc::new(SharedParameters { state: Mutex::new(state) }),
        }
    }

    /// Requests all parameters; [`ParameterClient::listed`] returns them once they have arrived.
    pub fn list(&self) {
        let mut state = self.shared.state.lock();
        if !std::mem::replace(&mut state.is_asking, true) {
            drop(state);
            let _ = self.requests.send(ParameterRequest::List);
        }
    }

    /// Writes a value into the file; `None` removes it, so that the default applies. Then lists all
    /// parameters again.
    pub fn set(&self, component: &str, parameter: &str, value: Option<&str>) {
        let (component, parameter) = (component.into(), parameter.into());
        let value = value.map(Into::into);
        let _ = self.requests.send(ParameterRequest::Set { component, parameter, value });
    }

    /// Returns the parameters as last listed, or why they could not be listed.
    pub fn listed(&self) -> Option<Arc<Result<ParameterList, String>>> {
        self.shared.state.lock().listed.clone()
    }

    /// Returns whether a request has changed the file since the last call.
    pub fn has_written(&self) -> bool {
        std::mem::take(&mut self.shared.state.lock().has_written)
    }

    /// Returns the result of the last request to set a parameter.
    pub fn last_result(&self) -> Option<SetReport> {
        self.shared.state.lock().last_result.clone()
    }
}

struct ParameterThread {
    directory: Directory,
    from: String,
    shared: Arc<SharedParameters>,
    wake: WakeCallback,
}

impl ParameterThread {
    fn serve_requests(self, asked: &Receiver<ParameterRequest>) {
        while let Ok(request) = asked.recv() {
            if let ParameterRequest::Set { component, parameter, value } = &request {
                let report = self.set_parameter(component, parameter, value.as_deref());
                self.shared.state.lock().last_result = Some(report);
            }
            let listed = self.connect_to_configd().and_then(|mut configd| configd.parameters(None));
            let listed = listed.map_err(|error| error.to_string());
            let mut state = self.shared.state.lock();
            (state.listed, state.is_asking) = (Some(Arc::new(listed)), false);
            drop(state);
            (self.wake)();
        }
    }

    fn connect_to_configd(&self) -> Result<ConfigdConnection, ConfigdError> {
        ConfigdConnection::open(&self.directory, &self.from, FOUND_WITHIN)
    }

    fn set_parameter(&self, component: &str, parameter: &str, value: Option<&str>) -> SetReport {
        let name = format!("{component}.{parameter}");
        let report = |is_set, text| SetReport {
            parameter: name.clone(),
            value: value.map(Into::into),
            is_set,
            text,
            findings: vec![],
        };
        let done = self
            .connect_to_configd()
            .and_then(|mut configd| configd.set(component, parameter, value));
        match done {
            Ok(SetOutcome::Set { changes, .. }) if changes.is_empty() => {
                report(true, format!("{name} already has this value; nothing was written"))
            }
            Ok(SetOutcome::Set { version, changes, findings }) => {
                self.shared.state.lock().has_written = true;
                let words = changes.iter().map(|change| match change.effect.as_str() {
                    "" => change.text.clone(),
                    effect => format!("{}; it {effect}", change.text),
                });
                let text = format!("version {version}: {}", words.collect::<Vec<_>>().join("; "));
                SetReport { findings, ..report(true, text) }
            }
            Ok(SetOutcome::Rejected { text, findings, .. }) => {
                SetReport { findings, ..report(false, text) }
            }
            Err(error @ ConfigdError::Ended(_)) => {
                report(false, format!("{error}; it is unknown whether the value was written"))
            }
            Err(error) => report(false, error.to_string()),
        }
    }
}
