//! The last messages of an input, for Python: kept one by one as they arrive, because Python may hold
//! them longer than the call in which the SDK lends them.

use std::collections::VecDeque;

use armor_sdk::foreign::KeptMessage;
use armor_sdk::{AnyMessage, Data, Header};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use crate::any::PythonAnyMessage;
use crate::decode::MessageReader;
use crate::fault::ArmorError;
use crate::header::PythonHeader;
use crate::layout::Layout;

/// A message of a history.
struct KeptPast {
    header: Py<PythonHeader>,
    stamp_s: f64,
    instance: u64,
    lost: u64,
    message: KeptMessage,
}

impl KeptPast {
    fn clone_ref(&self, py: Python<'_>) -> Self {
        Self { header: self.header.clone_ref(py), message: self.message.clone(), ..*self }
    }
}

/// The messages of one source of an input, oldest first.
struct SourceHistory {
    input: String,
    source: String,
    /// The name and the schema of the messages of an input of any type.
    any: Option<(String, String)>,
    messages: VecDeque<KeptPast>,
}

/// The histories of a component's inputs.
#[derive(Default)]
pub struct Histories {
    sources: Vec<SourceHistory>,
    /// The message that is being received.
    current: Option<Py<PythonHeader>>,
}

impl Histories {
    /// Adds a message that arrives, if the link of its input keeps a history.
    pub fn add_message(
        &mut self,
        header: &Header<'_>,
        data: &Data<'_>,
        in_python: &Py<PythonHeader>,
        py: Python<'_>,
    ) {
        self.current = Some(in_python.clone_ref(py));
        // That of the SDK has this message already, and forgets by the limits of the file.
        let Some(kept) = data.kept_count() else { return };
        let (input, source) = (header.id(), header.data());
        let place = match self.find_place(input, source) {
            Some(place) => place,
            None => {
                let (input, source) = (input.into(), source.into());
                let any = AnyMessage::received(header, data).ok();
                let any = any.map(|it| (it.type_name().to_owned(), it.schema().to_owned()));
                self.sources.push(SourceHistory { input, source, any, messages: VecDeque::new() });
                self.sources.len() - 1
            }
        };
        let messages = &mut self.sources[place].messages;
        messages.push_back(KeptPast {
            header: in_python.clone_ref(py),
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost: header.lost,
            message: data.keep(),
        });
        while messages.len() > kept {
            messages.pop_front();
        }
    }

    /// No message is being received any more.
    pub fn end_message(&mut self) {
        self.current = None;
    }

    /// Forgets all messages: they are those of another activation.
    pub fn clear(&mut self) {
        self.sources.clear();
    }

    fn find_place(&self, input: &str, source: &str) -> Option<usize> {
        self.sources.iter().position(|it| it.input == input && it.source == source)
    }

    /// The history of an input, of the source of the message that is being received if it has several.
    pub fn open(
        &self,
        py: Python<'_>,
        input: &str,
        source: Option<&str>,
        layout: Py<Layout>,
    ) -> PyResult<PythonHistory> {
        let current = self.current.as_ref().map(|header| header.get().names(py)).transpose()?;
        let current = current.filter(|(own, _)| own == input);
        let source = source.or(current.as_ref().map(|(_, source)| source.as_ref()));
        let of_input: Vec<_> = self.sources.iter().filter(|it| it.input == input).collect();
        let found = match (source, of_input.as_slice()) {
            (Some(source), of_input) => of_input.iter().find(|it| it.source == source).copied(),
            (None, []) => None,
            (None, [only]) => Some(*only),
            (None, several) => {
                let names: Vec<_> = several.iter().map(|it| it.source.as_str()).collect();
                return Err(ArmorError::new_err(format!(
                    "input `{input}` has several sources: self.history(\"{input}\", source=…) names one \
                     of {}",
                    names.join(", ")
                )));
            }
        };
        // A message is being received, and its link keeps none.
        if found.is_none() && current.is_some() {
            return Err(ArmorError::new_err(format!(
                "input `{input}` keeps no history; write history=\"n\" on its link in the file"
            )));
        }
        let any = found.and_then(|it| it.any.clone());
        let messages = found.into_iter().flat_map(|it| &it.messages);
        Ok(PythonHistory { layout, any, messages: messages.map(|it| it.clone_ref(py)).collect() })
    }
}

/// The last messages of an input since the component was activated, newest first.
#[pyclass(name = "History", module = "armor", frozen, sequence)]
pub struct PythonHistory {
    layout: Py<Layout>,
    /// The name and the schema of messages of any type.
    any: Option<(String, String)>,
    /// Oldest first.
    messages: Vec<KeptPast>,
}

/// A message of a history.
#[pyclass(name = "Past", module = "armor", frozen)]
pub struct PythonPast {
    /// Its header; `lost` counts the messages that are missing before it.
    #[pyo3(get)]
    header: Py<PythonHeader>,
    /// Its content.
    #[pyo3(get)]
    data: Py<PyAny>,
    /// Whether the message before it in the history is not the one that was published before it.
    #[pyo3(get)]
    follows_gap: bool,
}

#[pymethods]
impl PythonPast {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let header = self.header.bind(py).repr()?;
        Ok(format!("Past(header={header}, data={})", self.data.bind(py).repr()?))
    }
}

impl PythonHistory {
    fn message(&self, age: usize) -> Option<&KeptPast> {
        self.messages.iter().rev().nth(age)
    }

    fn stamp(&self, age: usize) -> f64 {
        self.message(age).map_or(f64::NAN, |it| it.stamp_s)
    }

    fn open_message(&self, py: Python<'_>, age: usize) -> PyResult<PythonPast> {
        let past = self.message(age).ok_or_else(|| {
            let len = self.messages.len();
            PyIndexError::new_err(format!(
                "the history has {len} messages, and none of the age {age}"
            ))
        })?;
        let before = self.message(age + 1);
        let restarted = before.is_some_and(|before| before.instance != past.instance);
        let data = match &self.any {
            Some((name, schema)) => {
                let bytes = past.message.to_vec();
                let message = AnyMessage::encoded(name, schema, past.stamp_s, bytes);
                Bound::new(py, PythonAnyMessage::new(message))?.into_any()
            }
            None => {
                let keep = || past.message.clone();
                MessageReader::new(py, &past.message, &keep).read_all(self.layout.get())?
            }
        };
        Ok(PythonPast {
            header: past.header.clone_ref(py),
            data: data.unbind(),
            follows_gap: past.lost > 0 || restarted,
        })
    }
}

#[pymethods]
impl PythonHistory {
    fn __len__(&self) -> usize {
        self.messages.len()
    }

    fn __getitem__(&self, py: Python<'_>, age: isize) -> PyResult<PythonPast> {
        let len = self.messages.len();
        let from_end = || len.checked_sub(age.unsigned_abs()).unwrap_or(len);
        let age = usize::try_from(age).unwrap_or_else(|_| from_end());
        self.open_message(py, age)
    }

    /// The message whose stamp is nearest to a time; of several the newest.
    fn nearest(&self, py: Python<'_>, stamp_s: f64) -> PyResult<Option<PythonPast>> {
        let distance = |age: usize| (self.stamp(age) - stamp_s).abs();
        let ages = (0..self.messages.len()).filter(|age| distance(*age).is_finite());
        let nearest = ages.min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        nearest.map(|age| self.open_message(py, age)).transpose()
    }

    /// The two messages between which a time lies, the earlier one first.
    fn around(&self, py: Python<'_>, stamp_s: f64) -> PyResult<Option<(PythonPast, PythonPast)>> {
        let instance = |age| self.message(age).map(|it| it.instance);
        for age in 0..self.messages.len() {
            let earlier = if self.stamp(age) == stamp_s { age } else { age + 1 };
            let is_between = self.stamp(earlier) < stamp_s
                && stamp_s < self.stamp(age)
                && instance(earlier) == instance(age);
            if earlier == age || is_between {
                let pair = (self.open_message(py, earlier)?, self.open_message(py, age)?);
                return Ok(Some(pair));
            }
        }
        Ok(None)
    }
}
