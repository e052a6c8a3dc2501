//! `armor-operator-view --watch FILE`: a window of its own, which no run starts and none ends. The
//! screen of each run of the file finds it, and hands over what it receives. When the run has ended,
//! the window keeps the last picture, marked as old, with the reason, and waits for the next run.

use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use armor_grid::Pose2;
use armor_inspect::systems::{list_running, record_directory};
use parking_lot::Mutex;

use super::panels::{HostsReading, make_panels};
use super::port_list::all_inputs;
use super::watch_messages::{
    MessageWriter, ToComponent, ToWindow, check_owner, read_message, socket_of, subject_of,
};
use crate::connection::{SystemConnection, find_end};
use crate::console::Console;
use crate::links::{ClockTimes, InputLink, SequenceNumber};
use crate::mission::{MissionQuestion, MissionState};
use crate::orders::{OrderLimits, RobotCommand};
use crate::picture::Painter;
use crate::window::{ViewWindow, WindowEnd, WindowHooks};

const USAGE: &str = "\
usage: armor-operator-view --watch FILE|HOST:PORT [--picture PNG] [--light]
  --watch FILE        show every run of this file, and stay open when it has ended
  --watch HOST:PORT   the same for the system whose registry has this address
  --picture PNG       no window: paint the screen as this file, twice per second
  --light             begin with the light theme, for sunlight";

/// Time between two pictures.
const PICTURE_PERIOD: Duration = Duration::from_millis(500);
/// Time between two looks at whether the launcher of a run has ended.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Size of the window, in points.
const SIZE: [usize; 2] = [1280, 800];

/// What the command line asks for.
#[derive(Debug, Default, PartialEq)]
struct StationOptions {
    watched: String,
    picture: Option<PathBuf>,
    is_light: bool,
}

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

fn parse_options(arguments: &[String]) -> Result<StationOptions, String> {
    let mut options = StationOptions::default();
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        let mut value = || {
            let value = arguments.next().filter(|value| !value.starts_with("--"));
            value.cloned().ok_or_else(|| format!("{argument} needs a value"))
        };
        match argument.as_str() {
            "--watch" => options.watched = value()?,
            "--picture" => options.picture = Some(value()?.into()),
            "--light" => options.is_light = true,
            other => return Err(format!("unknown argument `{other}`")),
        }
    }
    let is_address = options.watched.parse::<std::net::SocketAddr>().is_ok();
    if !is_address && !Path::new(&options.watched).is_file() {
        return Err(format!("{} is no file, and no HOST:PORT", options.watched));
    }
    Ok(options)
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
            send: Box::new(move |command| sending.send_command(command)),
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

    fn send_command(&self, command: &RobotCommand) -> usize {
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
            RobotCommand::Answer { transition, is_confirmed } => {
                ToComponent::Answer { transition: transition.clone(), is_confirmed: *is_confirmed }
            }
        };
        usize::from(self.send(&message))
    }

    fn send(&self, message: &ToComponent) -> bool {
        let writer = self.writer.lock().clone();
        writer.is_some_and(|writer| writer.send(message).is_ok())
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
        let why = loop {
            self.request_frame();
            match read_message::<ToWindow>(&mut stream) {
                Ok(Some(message)) => self.handle_message(message),
                Ok(None) => break String::new(),
                Err(error) => break error.to_string(),
            }
        };
        self.shown.lock().take_if(|(_, shown)| *shown == number);
        self.end_run(number, &system, launcher, &log, &why);
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

    fn begin_run(
        &self,
        system: &str,
        robot: String,
        run: &str,
        links: Vec<super::watch_messages::LinkedInput>,
    ) {
        let mut console = self.console.lock();
        let is_same = !run.is_empty() && *self.run.lock() == run;
        if !is_same {
            // What is on the screen is of another run: nothing of it may be taken for this one.
            let before = std::mem::take(&mut *console);
            let is_light = before.is_light;
            let map = before.scene.map.emptied();
            *console = Console { is_light, ..Console::default() };
            console.scene.map = map;
            run.clone_into(&mut self.run.lock());
        }
        console.connection = SystemConnection::Live { system: system.into() };
        console.robot_name = robot;
        let linked = links.into_iter().filter_map(|link| {
            let input = all_inputs().find(|input| input.id == link.input)?;
            Some(InputLink::new(input.id, link.data, input.is_steady))
        });
        console.links = linked.collect();
        console.scene.is_localised = console.is_linked("pose");
        let is_stopped = console.orders.is_stopped();
        drop(console);
        // A component that was restarted may not know it.
        if is_stopped {
            self.send(&ToComponent::Stop { is_on: true });
        }
    }

    fn handle_message(&self, message: ToWindow) {
        let now = self.now();
        match message {
            ToWindow::Hello { .. } => {}
            ToWindow::Settings {
                speed_mps,
                turn_radps,
                tolerance_m,
                robot_radius_m,
                laser,
                buttons,
                is_light,
            } => {
                let mut console = self.console.lock();
                console.orders.limits = OrderLimits { speed_mps, turn_radps, tolerance_m };
                console.robot_radius_m = robot_radius_m;
                if let [x_m, y_m, yaw_rad] = laser[..] {
                    console.scene.robot_from_laser = Pose2::new(x_m, y_m, yaw_rad);
                }
                console.buttons = buttons;
                console.is_light |= is_light;
            }
            ToWindow::Data { input, instance, sequence, stamp_s, bytes } => {
                let Some(input) = all_inputs().find(|known| known.id == input) else { return };
                let update = input.read_bytes(&bytes);
                let number = SequenceNumber { instance, sequence };
                let mut console = self.console.lock();
                let outcome = update.and_then(|update| update(&mut console));
                console.record_arrival(input.id, now, stamp_s, number, outcome);
            }
            ToWindow::Tick { system_s } => {
                self.system_time.store(system_s.to_bits(), Ordering::Relaxed);
                self.report_orders(now);
            }
            ToWindow::Sent { output, to } => {
                let to = usize::try_from(to).unwrap_or(usize::MAX);
                self.console.lock().record_delivery(&output, to);
            }
            ToWindow::Mission { name, stage, why, now_at_s, is_running, places, questions } => {
                let questions = questions.into_iter().map(|question| MissionQuestion {
                    transition: question.transition,
                    answer_by_at_s: question.answer_by_at_s,
                    unanswered: question.unanswered,
                });
                let questions = questions.collect();
                let received_s = now.host_s;
                let mission = MissionState {
                    name,
                    stage,
                    why,
                    now_at_s,
                    is_running,
                    places,
                    questions,
                    received_s,
                };
                self.console.lock().set_mission(mission, now);
            }
            ToWindow::Hosts { hosts } => {
                self.console.lock().readings.store(HostsReading::of_shown(hosts));
            }
            ToWindow::Answered { order, is_accepted, text } => {
                self.console.lock().record_answer(&order, is_accepted, &text, now);
            }
        }
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

    /// Keeps the last picture, and finds out why nothing more comes.
    fn end_run(&self, number: u64, system: &str, launcher: u32, log: &str, why: &str) {
        let lose = |text: String| {
            let mut console = self.console.lock();
            if !self.is_newest(number) {
                return;
            }
            let robot = console.robot_name.clone();
            console.lose_system(&robot, &text, self.now());
            drop(console);
            self.request_frame();
        };
        if launcher == 0 {
            let link = "the connection to it is lost";
            let text = if why.is_empty() { link.to_owned() } else { format!("{link}: {why}") };
            eprintln!("{system} has ended: {text}");
            return lose(text);
        }
        lose("its screen sends nothing: it ends, or the screen is started again".into());
        while is_running(launcher) {
            if !self.is_newest(number) {
                return;
            }
            std::thread::sleep(LOOK_EVERY);
        }
        let mut text = find_end(system, &std::fs::read_to_string(log).unwrap_or_default());
        let mission = self.console.lock().mission.clone();
        if let Some(why) = mission.map(|mission| mission.why).filter(|why| !why.is_empty()) {
            text = format!("{text}: {why}");
        }
        eprintln!("{system} has ended: {text}");
        lose(text);
    }
}

/// Returns whether a launcher on this host has not ended: it holds the lock on its record.
fn is_running(launcher: u32) -> bool {
    let records = record_directory().and_then(|directory| list_running(&directory));
    records.is_ok_and(|records| records.iter().any(|record| record.pid == launcher))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orders::OperatorOrder;

    fn parse(arguments: &[&str]) -> Result<StationOptions, String> {
        let arguments: Vec<_> = arguments.iter().map(ToString::to_string).collect();
        parse_options(&arguments)
    }

    #[test]
    fn it_shows_a_system_by_one_component_which_may_return() {
        let station = Station::new("127.0.0.1:7411", false);
        assert_eq!(station.accept_component("view"), Some(1));
        assert_eq!(station.accept_component("second"), None);
        assert_eq!(station.accept_component("view"), Some(2), "it was restarted");
        station.shown.lock().take();
        assert_eq!(station.accept_component("second"), Some(3));
    }

    #[test]
    fn nothing_of_a_run_is_shown_as_that_of_the_next_one_but_stop_stays_in_the_same_run() {
        let station = Station::new("127.0.0.1:7411", true);
        let now = station.now();
        station.begin_run("rover", "rover".into(), "run 1", Vec::new());
        station.console.lock().handle_order(OperatorOrder::Stop, now);
        station.console.lock().set_mission(MissionState::default(), now);
        station.end_run(0, "rover", 0, "", "");
        station.begin_run("rover", "rover".into(), "run 1", Vec::new());
        assert!(station.console.lock().orders.is_stopped(), "only its component was restarted");
        station.begin_run("rover", "rover".into(), "run 2", Vec::new());
        let console = station.console.lock();
        assert!(!console.orders.is_stopped() && console.mission.is_none() && console.is_light);
        assert_eq!(console.connection, SystemConnection::Live { system: "rover".into() });
    }

    #[test]
    fn it_watches_a_file_or_an_address_and_nothing_else() {
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
        assert_eq!(parse(&["--watch", manifest]).unwrap().watched, manifest);
        let light = parse(&["--watch", "127.0.0.1:7411", "--light"]).unwrap();
        assert!(light.is_light && light.picture.is_none());
        for wrong in [&["--watch", "none.xml"][..], &["--watch"], &["--watch", manifest, "-x"]] {
            assert!(parse(wrong).is_err(), "{wrong:?}");
        }
        assert!(run_if_wanted(&["--name".into(), "view".into()]).is_none(), "a component");
    }
}
