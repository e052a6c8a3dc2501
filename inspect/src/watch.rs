//! The threads around a [`SystemPicture`]: they deliver events to it and carry out its actions.
//!
//! A watch does not disturb the system: it has one control connection per process, as an observer,
//! and sends one small request per second on it. It links to no data.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use armor_sdk::control::{Command, ControlConnection, ControlEvent, Role};
use armor_sdk::directory::Directory;
use armor_wire::registry::ComponentEntry;
use parking_lot::Mutex;

use crate::observation::{ASK_EVERY, ObserverAction, SystemEvent, SystemPicture};
use crate::run_control::{self, RunRequest};
use crate::systems::RunRecord;
use crate::wake::{WakeCallback, spawn_detached};

/// Threads that connect in parallel, so that processes that hang do not delay the others.
const CONNECTING_AT_ONCE: usize = 16;
/// Least time between two pictures: the eye sees no more than ten a second.
const SHOW_EVERY: Duration = Duration::from_millis(100);

/// An address without a registry.
const NOWHERE: &str = "127.0.0.1:1";

/// Watches a running system until it is dropped.
pub struct SystemWatch {
    shared: Arc<SharedPicture>,
    directory: Directory,
    /// None without a system.
    inputs: Option<Sender<WatchInput>>,
}

struct SharedPicture {
    picture: Mutex<Arc<SystemPicture>>,
    is_closing: AtomicBool,
    wake: WakeCallback,
}

/// An input of the loop.
#[expect(clippy::large_enum_variant, reason = "almost every input is an event")]
enum WatchInput {
    Event(SystemEvent),
    Connected(String, u64, ControlConnection),
}

struct WatchLoop {
    shared: Arc<SharedPicture>,
    picture: SystemPicture,
    start: Instant,
    connections: HashMap<(String, u64), ControlConnection>,
    connect: Sender<ComponentEntry>,
    requests: u64,
    /// The picture has changed since it was last shown.
    is_new: bool,
    shown: Option<Instant>,
}

impl SystemWatch {
    /// Begins to watch the system whose registry listens at `registry`; `tool` names the
    /// observer, and `wake` is called when there is a new picture.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(registry: &str, tool: &str, wake: WakeCallback) -> io::Result<Self> {
        let name = format!("{tool}-{}", std::process::id());
        let directory = Directory::observer(registry, &name);
        let shared = Arc::new(SharedPicture {
            picture: Mutex::default(),
            is_closing: AtomicBool::new(false),
            wake,
        });
        let (inputs, received) = mpsc::channel();
        let changes = directory.watch_changes();
        let registry = inputs.clone();
        spawn_detached("look-registry", move || {
            for change in changes {
                if registry.send(WatchInput::Event(SystemEvent::Registry(change))).is_err() {
                    return;
                }
            }
        })?;
        let connect = start_connectors(&name, &inputs)?;
        let looping = WatchLoop {
            shared: Arc::clone(&shared),
            picture: SystemPicture::default(),
            start: Instant::now(),
            connections: HashMap::new(),
            connect,
            requests: 0,
            is_new: false,
            shown: None,
        };
        spawn_detached("look", move || looping.handle_inputs(&received))?;
        Ok(Self { shared, directory, inputs: Some(inputs) })
    }

    /// Returns a watch that always shows `picture`, without a system: for tests of displays.
    pub fn still(picture: SystemPicture) -> Self {
        let directory = Directory::observer(NOWHERE, "still");
        directory.close();
        let picture = Mutex::new(Arc::new(picture));
        let wake: WakeCallback = Arc::new(|| {});
        let shared = Arc::new(SharedPicture { picture, is_closing: AtomicBool::new(true), wake });
        Self { shared, directory, inputs: None }
    }

    /// Asks the launcher of the system for its other hosts, again and again. A system that has none is not
    /// asked.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn follow_hosts(&self, record: &RunRecord) -> io::Result<()> {
        let Some(inputs) = self.inputs.clone().filter(|_| record.place.is_some()) else {
            return Ok(());
        };
        let (shared, record) = (Arc::downgrade(&self.shared), record.clone());
        spawn_detached("look-hosts", move || {
            while let Some(shared) = shared.upgrade()
                && !shared.is_closing.load(Ordering::Relaxed)
            {
                drop(shared);
                // A launcher that has died reports nothing.
                let reply = run_control::request(&record, &RunRequest::List);
                let hosts = reply.map(|reply| reply.hosts).unwrap_or_default();
                if inputs.send(WatchInput::Event(SystemEvent::Hosts(hosts))).is_err() {
                    return;
                }
                thread::sleep(ASK_EVERY);
            }
        })
    }

    /// Returns the present picture.
    pub fn picture(&self) -> Arc<SystemPicture> {
        Arc::clone(&self.shared.picture.lock())
    }

    /// Returns its registry.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// Returns system time, in seconds.
    pub fn timestamp(&self) -> f64 {
        self.directory.clock().timestamp()
    }

    /// Stops watching a system that has ended for good: the picture shows that.
    pub fn rest_as_ended(&self) {
        let mut picture = self.shared.picture.lock();
        Arc::make_mut(&mut picture).mark_ended();
        // Under the lock, so that the loop does not replace the picture.
        self.rest();
    }

    /// Stops watching; the picture stays as it is, even if another system starts at the same
    /// address.
    pub fn rest(&self) {
        self.shared.is_closing.store(true, Ordering::Relaxed);
        self.directory.close();
    }
}

impl Drop for SystemWatch {
    fn drop(&mut self) {
        self.rest();
    }
}

/// Starts the threads that connect; they end when the returned sender is dropped.
fn start_connectors(name: &str, inputs: &Sender<WatchInput>) -> io::Result<Sender<ComponentEntry>> {
    let (connect, wanted) = mpsc::channel::<ComponentEntry>();
    let wanted = Arc::new(Mutex::new(wanted));
    for _ in 0..CONNECTING_AT_ONCE {
        let (wanted, inputs, name) = (Arc::clone(&wanted), inputs.clone(), name.to_owned());
        spawn_detached("look-connect", move || {
            loop {
                // A binding of its own, so that the lock is not held while connecting.
                let next = wanted.lock().recv();
                let Ok(entry) = next else { return };
                if inputs.send(connect_to(&entry, &name, &inputs)).is_err() {
                    return;
                }
            }
        })?;
    }
    Ok(connect)
}

fn connect_to(entry: &ComponentEntry, name: &str, inputs: &Sender<WatchInput>) -> WatchInput {
    let (whose, instance) = (entry.name.clone(), entry.instance);
    let sink = {
        let (inputs, whose) = (inputs.clone(), whose.clone());
        move |event| {
            let event = match event {
                ControlEvent::Answer(answer) => {
                    SystemEvent::Answered(whose.clone(), instance, answer)
                }
                ControlEvent::Closed(reason) => {
                    SystemEvent::Closed(whose.clone(), instance, reason)
                }
            };
            // Fails once the watch has ended.
            let _ = inputs.send(WatchInput::Event(event));
        }
    };
    match ControlConnection::connect(entry, Role::Observer, name, sink) {
        Ok(connection) => WatchInput::Connected(whose, instance, connection),
        Err(error) => WatchInput::Event(SystemEvent::Closed(whose, instance, error.to_string())),
    }
}

impl WatchLoop {
    fn handle_inputs(mut self, received: &Receiver<WatchInput>) {
        while !self.shared.is_closing.load(Ordering::Relaxed) {
            match received.recv_timeout(self.time_to_wait()) {
                Ok(input) => self.handle_input(input),
                Err(RecvTimeoutError::Timeout) => self.handle_event(SystemEvent::Tick),
                Err(RecvTimeoutError::Disconnected) => return,
            }
            // Handle everything that has arrived before showing one picture.
            while let Ok(input) = received.try_recv() {
                self.handle_input(input);
            }
            if self.picture.next_tick() <= self.start.elapsed() {
                self.handle_event(SystemEvent::Tick);
            }
            self.show_picture();
        }
    }

    fn time_to_wait(&self) -> Duration {
        let tick = self.picture.next_tick().saturating_sub(self.start.elapsed());
        match self.shown {
            Some(shown) if self.is_new => tick.min(SHOW_EVERY.saturating_sub(shown.elapsed())),
            _ => tick,
        }
    }

    fn handle_input(&mut self, input: WatchInput) {
        match input {
            WatchInput::Event(event) => self.handle_event(event),
            WatchInput::Connected(name, instance, connection) => {
                self.connections.insert((name.clone(), instance), connection);
                self.handle_event(SystemEvent::Connected(name, instance));
            }
        }
    }

    fn handle_event(&mut self, event: SystemEvent) {
        if let SystemEvent::Closed(name, instance, _) = &event {
            self.connections.remove(&(name.clone(), *instance));
        }
        let (changed, actions) = self.picture.handle_event(event, self.start.elapsed());
        self.is_new |= changed;
        for action in actions {
            match action {
                // The connecting threads live as long as this loop.
                ObserverAction::Connect(entry) => drop(self.connect.send(entry)),
                ObserverAction::Ask(name, instance) => {
                    self.requests += 1;
                    let ask = Command::Status { request: self.requests };
                    if let Some(connection) = self.connections.get(&(name, instance)) {
                        // A failure closes the connection, which arrives as an event.
                        let _ = connection.send(&ask);
                    }
                }
                ObserverAction::Drop(name, instance) => {
                    self.connections.remove(&(name, instance));
                }
            }
        }
    }

    fn show_picture(&mut self) {
        if !self.is_new || self.shown.is_some_and(|shown| shown.elapsed() < SHOW_EVERY) {
            return;
        }
        (self.is_new, self.shown) = (false, Some(Instant::now()));
        self.picture.rebuild_links();
        let picture = Arc::new(self.picture.clone());
        let mut shown = self.shared.picture.lock();
        if self.shared.is_closing.load(Ordering::Relaxed) {
            return;
        }
        *shown = picture;
        drop(shown);
        (self.shared.wake)();
    }
}
