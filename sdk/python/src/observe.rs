//! A running system, observed from Python: its data, its parameters, and orders to its mission.

use std::net::ToSocketAddrs;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use armor_inspect::{ObservedSystem, find_own_registry, systems, this_user};
use armor_sdk::configuration::{ConfigdConnection, Questions, SetOutcome};
use armor_sdk::control::{Order, TokenMove};
use armor_sdk::foreign::KeptMessage;
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_sdk::operator::Operator;
use armor_sdk::tap::{Tap, TapData, TapError};
use armor_sdk::wire::keep::Keep;
use armor_sdk::wire::schema::{self, Schema};
use armor_sdk::{AnyMessage, Latched};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use crate::decode::MessageReader;
use crate::encode::EncodedMessage;
use crate::fault::{ArmorError, EndedError, MessageError, SendError};
use crate::header::PythonHeader;
use crate::layout::Layout;

/// How long configd and the registry may take to answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(3);
/// How long an order may wait for its answer.
const ORDERED_WITHIN: Duration = Duration::from_secs(5);
/// Time between two looks at the signals of Python, such as Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// Most messages that wait for a reader which is slower than the publisher.
const MAX_KEEP: u32 = 65_536;

/// A parameter: component, name, type, value, unit, origin, whether it is live, range, documentation.
type ParameterText = (String, String, String, String, String, String, bool, String, String);

/// A process: its name, its kind, its process id, its state, and its last error.
type ProcessText = (String, String, u32, String, String);

fn refused(error: impl std::fmt::Display) -> PyErr {
    ArmorError::new_err(error.to_string())
}

/// The registry at `host:port`, or of the running system with this name. Without either, that of the
/// system of which this process is a component, and else of the only one of this host.
fn find_registry(address: &str) -> PyResult<String> {
    if address.is_empty()
        && let Some(own) = find_own_registry()
    {
        // It may name another host, to which the router of this one leads.
        return Ok(own);
    }
    if address.contains(':') {
        let mut found = address.to_socket_addrs().map_err(|error| {
            PyValueError::new_err(format!(
                "`{address}` is no address such as 127.0.0.1:7411: {error}"
            ))
        })?;
        return found
            .next()
            .map(|found| found.to_string())
            .ok_or_else(|| PyValueError::new_err(format!("`{address}` has no address")));
    }
    let directory = systems::record_directory().map_err(refused)?;
    let records = systems::list_running(&directory).map_err(refused)?;
    let named: Vec<_> =
        records.iter().filter(|record| address.is_empty() || record.system == address).collect();
    let known: Vec<_> =
        records.iter().map(|it| format!("{} at {}", it.system, it.registry)).collect();
    let known = if known.is_empty() { "none".into() } else { known.join(", ") };
    match named.as_slice() {
        [only] => Ok(only.registry.to_string()),
        [] => {
            Err(ArmorError::new_err(format!("no such system runs on this host (running: {known})")))
        }
        _ => Err(ArmorError::new_err(format!(
            "several systems run; name one, or its address: {known}"
        ))),
    }
}

/// The connection to a running system.
#[pyclass(module = "armor._armor", frozen)]
pub struct SystemObserver {
    observed: ObservedSystem,
    registry: String,
}

#[pymethods]
impl SystemObserver {
    #[new]
    fn new(py: Python<'_>, address: &str) -> PyResult<Self> {
        let registry = find_registry(address)?;
        py.detach(|| {
            if let Ok(registry) = registry.parse() {
                systems::adopt_place(registry);
            }
            let observed = ObservedSystem::at(&registry, "python");
            observed.list().map(|_| Self { observed, registry })
        })
        .map_err(refused)
    }

    /// The address of its registry.
    #[getter]
    fn registry(&self) -> &str {
        &self.registry
    }

    fn timestamp(&self) -> f64 {
        self.observed.timestamp()
    }

    /// Each output: its name, its type, its schema, and whether it is latched.
    fn list_data(&self, py: Python<'_>) -> PyResult<Vec<(String, String, String, bool)>> {
        let listing = py.detach(|| self.observed.list()).map_err(refused)?;
        let entries = listing.data.into_iter();
        Ok(entries.map(|it| (it.data, it.type_name, it.schema, it.latched)).collect())
    }

    /// Each process: its name, its kind, its process id, its state, and its last error.
    fn list_processes(&self, py: Python<'_>) -> PyResult<Vec<ProcessText>> {
        let sightings = py.detach(|| self.observed.ask_statuses()).map_err(refused)?;
        let processes = sightings.into_iter().map(|sighting| {
            let (state, last_error) = match sighting.status {
                Ok(status) => (status.state.to_string(), status.last_error),
                Err(_) => (String::new(), String::new()),
            };
            (sighting.entry.name, sighting.entry.kind, sighting.entry.pid, state, last_error)
        });
        Ok(processes.collect())
    }

    /// Links to the data of one output.
    fn open_feed(
        &self,
        py: Python<'_>,
        data: &str,
        keep: u32,
        timeout_s: f64,
    ) -> PyResult<DataFeed> {
        if !(1..=MAX_KEEP).contains(&keep) {
            return Err(PyValueError::new_err(format!(
                "keep is 1 to {MAX_KEEP} messages, not {keep}"
            )));
        }
        let keep = if keep == 1 { Keep::Latest } else { Keep::Last { count: keep } };
        let timeout = Duration::try_from_secs_f64(timeout_s)
            .map_err(|_| PyValueError::new_err(format!("{timeout_s} s is no time to wait")))?;
        let opened = py.detach(|| Tap::open(self.observed.directory(), data, keep, timeout));
        let tap = opened.map_err(refused)?;
        let schema = tap.schema().clone();
        let (observed, tap) = (self.observed.clone(), Mutex::new(Some(tap)));
        Ok(DataFeed {
            observed,
            data: data.into(),
            keep,
            schema,
            tap,
            is_closed: AtomicBool::default(),
        })
    }

    /// Registers this process as a publisher of one output.
    fn open_publisher(
        &self,
        py: Python<'_>,
        data: &str,
        layout: Py<Layout>,
        latched: bool,
    ) -> PyResult<DataPublisher> {
        let Some((name, output)) = data.split_once('.') else {
            return Err(PyValueError::new_err(format!("`{data}` is no name of data: NAME.OUTPUT")));
        };
        let registry = self.registry.clone();
        let options = NodeOptions { name: name.into(), kind: "python".into(), registry };
        let node = py.detach(|| {
            SystemNode::start(&options, ANSWER_WITHIN, |armor| {
                match latched {
                    true => armor.provide::<Latched<AnyMessage>>(output)?,
                    false => armor.provide::<AnyMessage>(output)?,
                }
                Ok(())
            })
        });
        let node = node.map_err(refused)?;
        let port_type = &layout.get().port_type;
        node.give_outputs_type(port_type.name(), port_type.text());
        Ok(DataPublisher { node: Mutex::new(Some(node)), output: output.into(), layout })
    }

    /// The parameters of one component, or of all.
    fn parameters(&self, py: Python<'_>, component: Option<&str>) -> PyResult<Vec<ParameterText>> {
        let listed =
            py.detach(|| self.connect_to_configd()?.parameters(component).map_err(refused));
        let parameters = listed?.parameters.into_iter();
        Ok(parameters
            .map(|it| {
                let kind = it.kind.to_string();
                let (origin, live) = (it.origin, it.live);
                (it.component, it.name, kind, it.value, it.unit, origin, live, it.range, it.doc)
            })
            .collect())
    }

    /// Writes a value into the file of the system; returns what changed, and when it takes effect.
    fn set_parameter(
        &self,
        py: Python<'_>,
        component: &str,
        parameter: &str,
        value: Option<&str>,
    ) -> PyResult<Vec<String>> {
        let set = py.detach(|| {
            self.connect_to_configd()?.set(component, parameter, value).map_err(refused)
        });
        match set? {
            SetOutcome::Set { changes, .. } => Ok(changes
                .into_iter()
                .map(|it| {
                    if it.effect.is_empty() {
                        it.text
                    } else {
                        format!("{}; it {}", it.text, it.effect)
                    }
                })
                .collect()),
            SetOutcome::Rejected { text, findings, .. } => {
                let findings = findings.iter().map(|it| format!("\n  {}: {}", it.code, it.message));
                Err(ArmorError::new_err(text + &findings.collect::<String>()))
            }
        }
    }

    /// Gives an order to the mission; returns its consequence.
    fn order(
        &self,
        py: Python<'_>,
        word: &str,
        names: Vec<String>,
        take: bool,
    ) -> PyResult<String> {
        let order = read_order(word, &names)?;
        let verdict = py.detach(|| {
            let from = format!("python, process {}", std::process::id());
            let mut operator =
                Operator::new(self.observed.directory().clone(), &from, &this_user());
            operator.order(take, &order, ORDERED_WITHIN)
        });
        let verdict = verdict.map_err(refused)?;
        if verdict.accepted { Ok(verdict.text) } else { Err(ArmorError::new_err(verdict.text)) }
    }
}

impl SystemObserver {
    fn connect_to_configd(&self) -> PyResult<ConfigdConnection> {
        let from = format!("python-{}", std::process::id());
        ConfigdConnection::open(self.observed.directory(), &from, ANSWER_WITHIN).map_err(refused)
    }
}

fn read_order(word: &str, names: &[String]) -> PyResult<Order> {
    let transition = || {
        let name = names.first().cloned();
        name.ok_or_else(|| PyValueError::new_err(format!("{word} needs the name of a transition")))
    };
    Ok(match (word, names) {
        ("pause", _) => Order::Pause,
        ("resume", _) => Order::Resume,
        ("safe", _) => Order::Safe,
        ("fire", _) => Order::Fire { transition: transition()? },
        ("confirm", _) => Order::Confirm { transition: transition()? },
        ("decline", _) => Order::Decline { transition: transition()? },
        ("move", [from, to, tokens]) => {
            let tokens = tokens.parse().map_err(|_| PyValueError::new_err("a number of tokens"))?;
            Order::Move { moves: vec![TokenMove { from: from.clone(), to: to.clone(), tokens }] }
        }
        _ => return Err(PyValueError::new_err(format!("`{word}` is no order"))),
    })
}

/// The messages of one output, for as long as the system runs: it links to the next process that provides
/// it.
#[pyclass(module = "armor._armor", frozen)]
pub struct DataFeed {
    observed: ObservedSystem,
    data: String,
    keep: Keep,
    schema: Schema,
    /// None while no process provides the data.
    tap: Mutex<Option<Tap>>,
    is_closed: AtomicBool,
}

/// What a look at a feed has found.
enum Look {
    Message(Box<TapData>),
    Nothing,
    Ended(String),
}

impl DataFeed {
    fn look(&self, wait: Duration) -> Look {
        let mut tap = self.tap.lock().unwrap_or_else(PoisonError::into_inner);
        if self.is_closed.load(Ordering::Relaxed) {
            *tap = None;
            return Look::Ended("the observer has closed it".into());
        }
        let Some(linked) = &mut *tap else {
            match Tap::open(self.observed.directory(), &self.data, self.keep, wait) {
                Ok(other) if *other.schema() != self.schema => {
                    return Look::Ended(format!(
                        "{} has another type now; read it again",
                        self.data
                    ));
                }
                Ok(next) => *tap = Some(next),
                Err(_) if self.observed.list().is_ok() => {}
                Err(_) => {
                    return Look::Ended(format!(
                        "the system that provided {} has ended",
                        self.data
                    ));
                }
            }
            return Look::Nothing;
        };
        match linked.next(wait) {
            Ok(Some(data)) => Look::Message(Box::new(data)),
            Ok(None) => Look::Nothing,
            Err(TapError::Ended(_)) => {
                *tap = None;
                Look::Nothing
            }
            Err(error) => Look::Ended(error.to_string()),
        }
    }
}

#[pymethods]
impl DataFeed {
    /// The schema of its messages.
    #[getter]
    fn schema(&self) -> String {
        self.schema.to_string()
    }

    /// The next message with its header; `None` if none arrives within the time.
    fn next<'py>(
        &self,
        py: Python<'py>,
        layout: &Bound<'py, Layout>,
        timeout_s: Option<f64>,
    ) -> PyResult<Option<(Py<PythonHeader>, Bound<'py, PyAny>)>> {
        let timeout = timeout_s.and_then(|it| Duration::try_from_secs_f64(it.max(0.0)).ok());
        let deadline = timeout.and_then(|timeout| Instant::now().checked_add(timeout));
        loop {
            py.check_signals()?;
            let left = deadline.map(|it| it.saturating_duration_since(Instant::now()));
            let wait = left.map_or(LOOK_EVERY, |left| left.min(LOOK_EVERY));
            match py.detach(|| self.look(wait)) {
                Look::Message(data) => {
                    let keep = || KeptMessage::copy_of(&data.payload);
                    let message =
                        MessageReader::new(py, &data.payload, &keep).read_all(layout.get())?;
                    let header = PythonHeader::of_tap(py, &self.data, &data)?;
                    return Ok(Some((header, message)));
                }
                Look::Nothing if left.is_some_and(|left| left.is_zero()) => return Ok(None),
                Look::Nothing => {}
                Look::Ended(why) => return Err(EndedError::new_err(why)),
            }
        }
    }

    /// Ends the link; a thread that waits in `next` notices it at its next look.
    fn close(&self) {
        self.is_closed.store(true, Ordering::Relaxed);
        if let Ok(mut tap) = self.tap.try_lock() {
            *tap = None;
        }
    }
}

/// An output that this process publishes, until it is closed.
#[pyclass(module = "armor._armor", frozen)]
pub struct DataPublisher {
    node: Mutex<Option<SystemNode>>,
    output: String,
    layout: Py<Layout>,
}

#[pymethods]
impl DataPublisher {
    /// Publishes a message; returns the number of subscribers that it was sent to.
    fn send(&self, py: Python<'_>, message: &Bound<'_, PyAny>) -> PyResult<usize> {
        let layout = self.layout.get();
        let class = layout.class.bind(py);
        if !message.is_instance(class)? {
            let (declared, given) = (layout.port_type.name(), message.get_type().name()?);
            return Err(PyTypeError::new_err(format!(
                "a {declared} is published here, not a {given}"
            )));
        }
        let bytes = EncodedMessage::of(layout, message)?.pieces().concat();
        let port_type = &layout.port_type;
        let sent = py.detach(|| {
            let node = self.node.lock().unwrap_or_else(PoisonError::into_inner);
            let node = node.as_ref()?;
            let armor = node.armor();
            let stamp_s = armor.timestamp();
            let message = AnyMessage::encoded(port_type.name(), port_type.text(), stamp_s, bytes);
            Some(armor.send_data(&self.output, &message))
        });
        match sent {
            None => Err(SendError::new_err("this publisher is closed")),
            Some(sent) => {
                sent.map(|it| it.to).map_err(|error| SendError::new_err(error.to_string()))
            }
        }
    }

    /// Leaves the system.
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.node.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}

/// The parts of a schema, for the package to make classes of: the name of a primitive, or a tuple of a word
/// and parts.
#[pyfunction]
pub fn schema_parts<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    let schema = schema::parse(text);
    describe_schema(py, &schema.map_err(|error| MessageError::new_err(error.to_string()))?)
}

fn describe_schema<'py>(py: Python<'py>, schema: &Schema) -> PyResult<Bound<'py, PyAny>> {
    let tuple = |word: &str, item: &Schema| -> PyResult<Bound<'py, PyAny>> {
        let items = [word.into_pyobject(py)?.into_any(), describe_schema(py, item)?];
        Ok(PyTuple::new(py, items)?.into_any())
    };
    match schema {
        Schema::Option(item) => tuple("optional", item),
        Schema::List(item) => tuple("list", item),
        Schema::Fixed(item, count) => {
            let parts = ("fixed", describe_schema(py, item)?, *count);
            Ok(parts.into_pyobject(py)?.into_any())
        }
        Schema::Struct { name, fields } => {
            let list = PyList::empty(py);
            for field in fields {
                list.append((&field.name, &field.unit, describe_schema(py, &field.schema)?))?;
            }
            Ok(("struct", name, schema.to_string(), list).into_pyobject(py)?.into_any())
        }
        Schema::Enum { name, variants } => {
            let list = PyList::empty(py);
            for variant in variants {
                if !variant.fields.is_empty() {
                    let why = format!("{name}.{} has fields, which only Rust reads", variant.name);
                    return Err(MessageError::new_err(why));
                }
                list.append(&variant.name)?;
            }
            Ok(("enum", name, schema.to_string(), list).into_pyobject(py)?.into_any())
        }
        plain => Ok(plain.to_string().into_pyobject(py)?.into_any()),
    }
}
