//! The threads around a [`Picture`]: they bring it what happens and do what it says.
//!
//! An observer disturbs nothing: it holds one control connection per process, in the role that may
//! only look, and asks one small question a second on it. It links to no data.

use std::collections::HashMap;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use armor_sdk::control::{Command, ControlConnection, ControlEvent, Role};
use armor_sdk::directory::Directory;
use armor_wire::registry::ComponentEntry;

use crate::Wake;
use crate::observation::{Action, Event, Picture};

/// Processes connected to at once, so that some that hang do not hold up the others.
const CONNECTING_AT_ONCE: usize = 16;
/// A new picture is shown at most this often: no eye sees more.
const SHOW_EVERY: Duration = Duration::from_millis(100);

/// Where nobody listens.
const NOWHERE: &str = "127.0.0.1:1";

/// A running system that is watched until this is dropped.
pub struct Watch {
    shared: Arc<Shared>,
    directory: Directory,
}

struct Shared {
    picture: Mutex<Arc<Picture>>,
    is_closing: AtomicBool,
    wake: Wake,
}

/// What reaches the loop.
enum Happening {
    Told(Event),
    Connected(String, u64, ControlConnection),
}

struct Loop {
    shared: Arc<Shared>,
    picture: Picture,
    start: Instant,
    connections: HashMap<(String, u64), ControlConnection>,
    connect: Sender<ComponentEntry>,
    requests: u64,
    /// There is something that was not shown yet.
    is_new: bool,
    shown: Option<Instant>,
}

impl Watch {
    /// Begins to watch the system whose registry listens at `registry`; `tool` says who watches,
    /// and `wake` is called when there is a new picture.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(registry: &str, tool: &str, wake: Wake) -> io::Result<Self> {
        let name = format!("{tool}-{}", std::process::id());
        let directory = Directory::observer(registry, &name);
        let shared = Arc::new(Shared {
            picture: Mutex::default(),
            is_closing: AtomicBool::new(false),
            wake,
        });
        let (told, happenings) = mpsc::channel();
        let changes = directory.watch();
        let registry = told.clone();
        spawn("look-registry", move || {
            for change in changes {
                if registry.send(Happening::Told(Event::Registry(change))).is_err() {
                    return;
                }
            }
        })?;
        let connect = connectors(&name, &told)?;
        let looping = Loop {
            shared: Arc::clone(&shared),
            picture: Picture::default(),
            start: Instant::now(),
            connections: HashMap::new(),
            connect,
            requests: 0,
            is_new: false,
            shown: None,
        };
        spawn("look", move || looping.run(&happenings))?;
        Ok(Self { shared, directory })
    }

    /// A picture that stays as it is, with no system behind it: for tests of what shows it.
    pub fn still(picture: Picture) -> Self {
        let directory = Directory::observer(NOWHERE, "still");
        directory.close();
        let picture = Mutex::new(Arc::new(picture));
        let wake: Wake = Arc::new(|| {});
        let shared = Arc::new(Shared { picture, is_closing: AtomicBool::new(true), wake });
        Self { shared, directory }
    }

    /// The system as it looks now.
    pub fn picture(&self) -> Arc<Picture> {
        Arc::clone(&self.shared.picture.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Its registry.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// System time, in seconds.
    pub fn timestamp(&self) -> f64 {
        self.directory.clock().timestamp()
    }

    /// Looks no longer: the picture stays as it is, also if another system comes to the same place.
    pub fn rest(&self) {
        self.shared.is_closing.store(true, Ordering::Relaxed);
        self.directory.close();
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.rest();
    }
}

/// Starts what makes connections; it ends with the sender that it is asked through.
fn connectors(name: &str, told: &Sender<Happening>) -> io::Result<Sender<ComponentEntry>> {
    let (connect, wanted) = mpsc::channel::<ComponentEntry>();
    let wanted = Arc::new(Mutex::new(wanted));
    for _ in 0..CONNECTING_AT_ONCE {
        let (wanted, told, name) = (Arc::clone(&wanted), told.clone(), name.to_owned());
        spawn("look-connect", move || {
            loop {
                // A binding of its own, so that the lock is not held while connecting.
                let next = wanted.lock().unwrap_or_else(PoisonError::into_inner).recv();
                let Ok(entry) = next else { return };
                if told.send(dial(&entry, &name, &told)).is_err() {
                    return;
                }
            }
        })?;
    }
    Ok(connect)
}

fn dial(entry: &ComponentEntry, name: &str, told: &Sender<Happening>) -> Happening {
    let (whose, instance) = (entry.name.clone(), entry.instance);
    let sink = {
        let (told, whose) = (told.clone(), whose.clone());
        move |event| {
            let event = match event {
                ControlEvent::Answer(answer) => Event::Said(whose.clone(), instance, answer),
                ControlEvent::Closed(reason) => Event::Closed(whose.clone(), instance, reason),
            };
            // Nobody watches any more.
            let _ = told.send(Happening::Told(event));
        }
    };
    match ControlConnection::connect(entry, Role::Observer, name, sink) {
        Ok(connection) => Happening::Connected(whose, instance, connection),
        Err(error) => Happening::Told(Event::Closed(whose, instance, error.to_string())),
    }
}

impl Loop {
    fn run(mut self, happenings: &Receiver<Happening>) {
        while !self.shared.is_closing.load(Ordering::Relaxed) {
            match happenings.recv_timeout(self.wait()) {
                Ok(happening) => self.take(happening),
                Err(RecvTimeoutError::Timeout) => self.tell(Event::Tick),
                Err(RecvTimeoutError::Disconnected) => return,
            }
            // All that has come meanwhile belongs to one picture.
            while let Ok(happening) = happenings.try_recv() {
                self.take(happening);
            }
            if self.picture.next_tick() <= self.start.elapsed() {
                self.tell(Event::Tick);
            }
            self.show();
        }
    }

    fn wait(&self) -> Duration {
        let tick = self.picture.next_tick().saturating_sub(self.start.elapsed());
        match self.shown {
            Some(shown) if self.is_new => tick.min(SHOW_EVERY.saturating_sub(shown.elapsed())),
            _ => tick,
        }
    }

    fn take(&mut self, happening: Happening) {
        match happening {
            Happening::Told(event) => self.tell(event),
            Happening::Connected(name, instance, connection) => {
                self.connections.insert((name.clone(), instance), connection);
                self.tell(Event::Connected(name, instance));
            }
        }
    }

    fn tell(&mut self, event: Event) {
        if let Event::Closed(name, instance, _) = &event {
            self.connections.remove(&(name.clone(), *instance));
        }
        let (changed, actions) = self.picture.handle(event, self.start.elapsed());
        self.is_new |= changed;
        for action in actions {
            match action {
                // Its threads live as long as this does.
                Action::Connect(entry) => drop(self.connect.send(entry)),
                Action::Ask(name, instance) => {
                    self.requests += 1;
                    let ask = Command::Status { request: self.requests };
                    if let Some(connection) = self.connections.get(&(name, instance)) {
                        // A failure ends the connection, which is told.
                        let _ = connection.send(&ask);
                    }
                }
                Action::Drop(name, instance) => {
                    self.connections.remove(&(name, instance));
                }
            }
        }
    }

    fn show(&mut self) {
        if !self.is_new || self.shown.is_some_and(|shown| shown.elapsed() < SHOW_EVERY) {
            return;
        }
        (self.is_new, self.shown) = (false, Some(Instant::now()));
        self.picture.link();
        let picture = Arc::new(self.picture.clone());
        *self.shared.picture.lock().unwrap_or_else(PoisonError::into_inner) = picture;
        (self.shared.wake)();
    }
}

/// Starts a thread that nobody waits for.
pub(crate) fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name.into()).stack_size(512 << 10).spawn(work).map(drop)
}
