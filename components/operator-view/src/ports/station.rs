//! `armor-operator-view --watch FILE`: a window of its own, which no run starts and none ends. The
//! screen of each run of the file finds it, and hands over what it receives. When the run has ended,
//! the window keeps the last picture, marked as old, with the reason, and waits for the next run.

mod messages;
mod options;
mod runs;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use armor_grid::Pose2;
use parking_lot::Mutex;

use options::{StationOptions, USAGE, parse_options};

use super::panels::{HostsReading, LinksReading, make_panels};
use super::port_list::all_inputs;
use super::watch_messages::{
    MessageWriter, ToComponent, ToWindow, check_owner, read_message, socket_of, subject_of,
};
use super::watched_run::{WatchedRun, file_len, find_history, is_crash};
use crate::connection::{CUT, SystemConnection, find_end};
use crate::console::Console;
use crate::links::{ClockTimes, InputLink, SequenceNumber};
use crate::mission::{MissionQuestion, MissionState};
use crate::orders::{OrderLimits, RobotCommand};
use crate::picture::Painter;
use crate::scene::LaserPlace;
use crate::window::{ViewWindow, WindowEnd, WindowHooks};

/// Time between two pictures.
const PICTURE_PERIOD: Duration = Duration::from_millis(500);
/// Size of the window, in points.
const SIZE: [usize; 2] = [1280, 800];

/// Runs the window if the command line asks for it.
pub(super) fn run_if_wanted(arguments: &[String]) -> Option<ExitCode> {
    if arguments.iter().any(|argument| argument == "--help") {
        println!("{USAGE}\nor, as a component of a run:");
    }
    if !arguments.iter().any(|argument| argument == "--watch") {
        return None;
    }
    let options = match parse_options(arguments) {
        Ok(options) => options,
        Err(error) => {
            eprintln!("{error}\n{USAGE}");
            return Some(ExitCode::from(2));
        }
    };
    Some(match run_station(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("armor-operator-view: {error}");
            ExitCode::FAILURE
        }
    })
}

fn run_station(options: &StationOptions) -> Result<(), String> {
    let subject = subject_of(&options.watched);
    let path = socket_of(&subject).ok_or("the folder of the running systems cannot be used")?;
    let listener = listen(&path, &options.watched)?;
    let station = Station::new(&options.watched, options.is_light);
    let accepting = station.clone();
    std::thread::Builder::new()
        .name("station".into())
        .spawn(move || accepting.accept(&listener))
        .map_err(|error| format!("no thread can be started: {error}"))?;
    eprintln!("waiting for a run of {}", options.watched);
    let outcome = match &options.picture {
        Some(picture) => station.paint_pictures(picture),
        None => station.show_window(&options.watched),
    };
    let _ = std::fs::remove_file(&path);
    outcome
}

fn listen(path: &Path, watched: &str) -> Result<UnixListener, String> {
    if UnixStream::connect(path).is_ok() {
        return Err(format!("a window for {watched} is open already"));
    }
    // The socket of a window that was killed.
    let _ = std::fs::remove_file(path);
    UnixListener::bind(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// The window, and the connection to the screen of the present run.
#[derive(Clone)]
struct Station {
    console: Arc<Mutex<Console>>,
    writer: Arc<Mutex<Option<MessageWriter>>>,
    /// The component by which the system is shown, and the number of its connection.
    shown: Arc<Mutex<Option<(String, u64)>>>,
    /// Counts connections: one that has been replaced changes nothing any more.
    connections: Arc<AtomicU64>,
    /// The bits of the system time, in seconds.
    system_time: Arc<AtomicU64>,
    run: Arc<Mutex<String>>,
    window: Arc<Mutex<Option<ViewWindow>>>,
    /// How many processes of each component of the run have ended.
    ended: Arc<Mutex<HashMap<String, u32>>>,
    started: Instant,
}

impl Station {
    fn new(watched: &str, is_light: bool) -> Self {
        let what = if Path::new(watched).is_file() {
            format!("armor run {watched}")
        } else {
            format!("a system with its registry at {watched}")
        };
        let connection = SystemConnection::Awaited { what };
        let console = Console { connection, is_light, ..Console::default() };
        Self {
            console: Arc::new(Mutex::new(console)),
            writer: Arc::default(),
            shown: Arc::default(),
            connections: Arc::default(),
            system_time: Arc::default(),
            run: Arc::default(),
            window: Arc::default(),
            ended: Arc::default(),
            started: Instant::now(),
        }
    }

    fn now(&self) -> ClockTimes {
        let system_s = f64::from_bits(self.system_time.load(Ordering::Relaxed));
        ClockTimes { host_s: self.started.elapsed().as_secs_f64(), system_s }
    }

    fn show_window(&self, watched: &str) -> Result<(), String> {
        let (tell, gone) = channel();
        let (clock, sending) = (self.clone(), self.clone());
        let hooks = WindowHooks {
            console: Arc::clone(&self.console),
            // The component reports to how many links it has published it.
            send: Box::new(move |command| {
                sending.send_command(command);
                None
            }),
            panels: make_panels(),
            now: Box::new(move || clock.now()),
            gone: Box::new(move |end| {
                let _ = tell.send(end);
            }),
        };
        let title = format!("{watched} - Armor");
        let window = ViewWindow::open(title, SIZE.map(|side| side as f32), hooks)
            .map_err(|error| format!("no thread can be started: {error}"))?;
        *self.window.lock() = Some(window);
        match gone.recv() {
            Ok(WindowEnd::Failed(why)) => Err(why),
            Ok(WindowEnd::Panicked(panic)) => std::panic::resume_unwind(panic),
            Ok(WindowEnd::Closed) | Err(_) => Ok(()),
        }
    }

    fn paint_pictures(&self, path: &Path) -> Result<(), String> {
        let mut painter = Painter::new(path.to_owned(), SIZE, 1.0, make_panels());
        loop {
            let console = self.console.lock().clone();
            painter.begin_painting(console, self.now()).map_err(|error| error.to_string())?;
            std::thread::sleep(PICTURE_PERIOD);
        }
    }

    fn request_frame(&self) {
        if let Some(window) = self.window.lock().as_ref() {
            window.request_frame();
        }
    }

    fn send_command(&self, command: &RobotCommand) {
        let message = match command {
            RobotCommand::Goal { place, frame } => ToComponent::Goal {
                frame: frame.to_string(),
                x_m: place.x_m,
                y_m: place.y_m,
                yaw_rad: place.yaw_rad,
            },
            &RobotCommand::Velocity { forward_mps, turn_radps } => {
                ToComponent::Velocity { forward_mps, turn_radps }
            }
            &RobotCommand::Stop(is_on) => ToComponent::Stop { is_on },
            RobotCommand::Resume => ToComponent::Resume,
            RobotCommand::Answer { transition, is_confirmed } => {
                ToComponent::Answer { transition: transition.clone(), is_confirmed: *is_confirmed }
            }
        };
        self.send(&message);
    }

    /// Sends a message. If it is lost, the reader notices the end of the connection; STOP stays
    /// without confirmation and is sent again.
    fn send(&self, message: &ToComponent) {
        let writer = self.writer.lock().clone();
        if let Some(writer) = writer {
            let _ = writer.send(message);
        }
    }

    fn accept(&self, listener: &UnixListener) {
        for stream in listener.incoming().filter_map(Result::ok) {
            let station = self.clone();
            let serve = move || station.serve(stream);
            // Without a thread there is no connection; the screen tries it again.
            let _ = std::thread::Builder::new().name("screen".into()).spawn(serve);
        }
    }

    fn is_newest(&self, number: u64) -> bool {
        self.connections.load(Ordering::SeqCst) == number
    }

    /// Shows what one screen sends, and then how its run has ended.
    fn serve(&self, mut stream: UnixStream) {
        if let Err(error) = check_owner(&stream) {
            eprintln!("a connection is refused: {error}");
            return;
        }
        let Ok(writer) = MessageWriter::new(&stream) else { return };
        let hello = read_message::<ToWindow>(&mut stream);
        let Ok(Some(ToWindow::Hello { component, system, robot, run, launcher, log, links })) =
            hello
        else {
            return;
        };
        let Some(number) = self.accept_component(&component) else {
            let _ = writer.send(&ToComponent::Welcome { is_accepted: false });
            return;
        };
        if writer.send(&ToComponent::Welcome { is_accepted: true }).is_err() {
            return;
        }
        if let Some(old) = self.writer.lock().replace(writer) {
            old.close();
        }
        eprintln!("shows {system}, by its component {component}");
        self.begin_run(&system, robot, &run, links);
        let run = WatchedRun { system, component, launcher, log_begin: file_len(&log), log };
        self.watch_crashes(number, &run);
        let why = loop {
            self.request_frame();
            match read_message::<ToWindow>(&mut stream) {
                Ok(Some(message)) => self.handle_message(message),
                Ok(None) => break String::new(),
                Err(error) => break error.to_string(),
            }
        };
        self.shown.lock().take_if(|(_, shown)| *shown == number);
        self.end_connection(number, &run, &why);
    }

    /// Returns the number of the connection of a component, unless another one shows the system: two
    /// screens of a file must not take the window from each other.
    fn accept_component(&self, component: &str) -> Option<u64> {
        let mut shown = self.shown.lock();
        if shown.as_ref().is_some_and(|(other, _)| other != component) {
            return None;
        }
        let number = self.connections.fetch_add(1, Ordering::SeqCst) + 1;
        *shown = Some((component.to_owned(), number));
        Some(number)
    }

    /// Sends the active goal again, and the events that the operator has caused.
    fn report_orders(&self, now: ClockTimes) {
        let mut console = self.console.lock();
        let goal = console.orders.repeat_order(now.host_s);
        let events: Vec<_> = std::iter::from_fn(|| console.orders.take_event()).collect();
        drop(console);
        if let Some(goal) = goal {
            self.send_command(&goal);
        }
        for event in events {
            self.send(&ToComponent::Event { name: event.name().into() });
        }
    }
}
