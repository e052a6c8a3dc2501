//! An input of a component at work, with what it stores.

use std::fmt;
use std::sync::Arc;

use crate::history::HistoryStore;
use crate::link::input::InputPort;

/// An input, the data that feeds it, and its last messages; one for each source of an input that takes
/// several.
pub(crate) struct FedInput {
    pub port: Arc<InputPort>,
    /// System-wide name of the data; empty if nothing feeds it.
    pub data: String,
    pub history: HistoryStore,
}

impl FedInput {
    /// The input as the file connects it.
    pub fn new(port: Arc<InputPort>) -> Self {
        let settings = port.settings();
        let history = HistoryStore::new(settings.as_ref().map_or(1, |it| it.history));
        let data = settings.map(|settings| settings.data).unwrap_or_default();
        Self { port, data, history }
    }
}

impl fmt::Debug for FedInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} from {}", self.port.id, self.data)
    }
}
