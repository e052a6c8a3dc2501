//! `armor-operator-view --watch FILE`: a window of its own, which no run starts and none ends. The
//! screen of each run of the file finds it, and hands over what it receives. When the run has ended,
//! the window keeps the last picture, marked as old, with the reason, and waits for the next run.

use std::collections::HashMap;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use armor_grid::Pose2;
use parking_lot::Mutex;

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
/// One in this many looks asks the launcher for its component.
const LOOKS_PER_HINT: u32 = 10;
/// So many looks a system whose mission is over may take to end; then its connection counts as lost.
const LOOKS_OF_ENDING: u32 = 30;
/// Time between two looks at the ends of the processes of a run.
const LOOK_FOR_CRASHES_EVERY: Duration = Duration::from_secs(1);
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

    fn begin_run(
        &self,
        system: &str,
        robot: String,
        run: &str,
        links: Vec<super::watch_messages::LinkedInput>,
    ) {
        let now = self.now();
        let mut console = self.console.lock();
        // Without a number, it is the same as long as it has not been seen to end.
        let is_cut = matches!(&console.connection, SystemConnection::Cut { system: cut, .. } if cut == system);
        let is_same = *self.run.lock() == run && (!run.is_empty() || is_cut);
        if !is_same {
            // What is on the screen is of another run: nothing of it may be taken for this one.
            let before = std::mem::take(&mut *console);
            let is_light = before.is_light;
            let map = before.scene.map.emptied();
            let mut alerts = before.alerts;
            alerts.end_conditions();
            *console = Console { is_light, alerts, ..Console::default() };
            console.scene.map = map;
            run.clone_into(&mut self.run.lock());
            self.ended.lock().clear();
        }
        console.connection = SystemConnection::Live { system: system.into() };
        console.robot_name = robot;
        console.refusal = None;
        let linked = links.into_iter().filter_map(|link| {
            let input = all_inputs().find(|input| input.id == link.input)?;
            Some(InputLink::new(input.id, link.data, input.is_steady))
        });
        console.links = linked.collect();
        console.scene.is_localised = console.is_linked("pose");
        // Before anything else, and under the lock, so that a Release is sent after it.
        if let Some(is_on) = console.stop.begin_again(now.host_s) {
            self.send(&ToComponent::Stop { is_on });
        }
    }

    /// Raises an alert for each process of the run that dies.
    fn watch_crashes(&self, number: u64, run: &WatchedRun) {
        let (station, run) = (self.clone(), run.clone());
        let watch = move || {
            while station.is_newest(number) && station.look_for_crashes(&run) {
                std::thread::sleep(LOOK_FOR_CRASHES_EVERY);
            }
        };
        // Without a thread only these alerts are missing.
        let _ = std::thread::Builder::new().name("crashes".into()).spawn(watch);
    }

    /// Raises an alert for each process that has died since the last look. Returns whether the run
    /// can be asked further.
    fn look_for_crashes(&self, run: &WatchedRun) -> bool {
        let Some(record) = run.find_record() else { return false };
        // What was before this window is no news.
        let is_first = self.ended.lock().is_empty();
        for name in run.list_processes() {
            let Some(history) = find_history(&record, &name) else { continue };
            let before = self.ended.lock().insert(name.clone(), history.ended);
            let is_new = !is_first && history.ended > before.unwrap_or(0);
            if is_new && is_crash(&history.last_end) {
                let text = format!("{name} {}", history.last_end);
                eprintln!("alert: {text}");
                self.console.lock().alerts.raise(text, self.now().host_s);
                self.request_frame();
            }
        }
        true
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
                no_laser,
                buttons,
                is_light,
            } => {
                let mut console = self.console.lock();
                console.orders.limits = OrderLimits { speed_mps, turn_radps, tolerance_m };
                console.robot_radius_m = robot_radius_m;
                console.scene.robot_from_laser = match laser[..] {
                    [x_m, y_m, yaw_rad] => LaserPlace::Known(Pose2::new(x_m, y_m, yaw_rad)),
                    _ => LaserPlace::Unknown(no_laser),
                };
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
            ToWindow::StopState { is_on, to } => {
                let to = usize::try_from(to).unwrap_or(usize::MAX);
                self.console.lock().record_stop(is_on, to, now);
            }
            ToWindow::Mission {
                name,
                stage,
                why,
                now_at_s,
                is_running,
                paused_by,
                frozen,
                places,
                last_cause,
                questions,
            } => {
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
                    paused_by,
                    frozen,
                    places,
                    last_cause,
                    questions,
                    received_s,
                };
                self.console.lock().set_mission(mission, now);
            }
            ToWindow::Hosts { hosts } => {
                self.console.lock().readings.store(HostsReading::of_shown(hosts));
            }
            ToWindow::Links { links } => {
                self.console.lock().readings.store(LinksReading::of_reports(links));
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

    /// Keeps the last picture, and finds out whether the run has ended, and why.
    fn end_connection(&self, number: u64, run: &WatchedRun, why: &str) {
        let change = |change: &dyn Fn(&mut Console, &str)| {
            let mut console = self.console.lock();
            if !self.is_newest(number) {
                return;
            }
            let robot = console.robot_name.clone();
            change(&mut console, &robot);
            drop(console);
            self.request_frame();
        };
        let cut = |text: &str| {
            change(&|console, robot| console.cut_connection(robot, text, self.now()));
        };
        let system = &run.system;
        if run.launcher == 0 {
            let host = "its launcher is not on this host, so whether it runs is not known";
            let text = if why.is_empty() { host.into() } else { format!("{host}: {why}") };
            eprintln!("{CUT}, to {system}: {text}");
            return cut(&text);
        }
        let is_ending = self.console.lock().mission.as_ref().is_some_and(MissionState::is_over);
        let lost = "the component is started again, or the system ends";
        match is_ending {
            true => change(&|console, robot| console.await_end(robot, self.now())),
            false => cut(lost),
        }
        let mut looks = 0_u32;
        while run.is_running() {
            if !self.is_newest(number) {
                return;
            }
            looks += 1;
            if is_ending && looks < LOOKS_OF_ENDING {
                std::thread::sleep(LOOK_EVERY);
                continue;
            }
            if is_ending && looks == LOOKS_OF_ENDING {
                cut(lost);
            }
            if looks.is_multiple_of(LOOKS_PER_HINT)
                && let Some(hint) = run.find_hint()
            {
                cut(&hint);
            }
            std::thread::sleep(LOOK_EVERY);
        }
        let mut end = find_end(system, &run.read_log());
        let mission = self.console.lock().mission.clone();
        if let Some(why) = mission.map(|mission| mission.why).filter(|why| !why.is_empty()) {
            end.why = format!("{}: {why}", end.why);
        }
        eprintln!("{system} has ended: {}", end.why);
        change(&|console, robot| console.end_system(robot, end.clone(), self.now()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orders::OperatorOrder;
    use crate::stop_delivery::StopStatus;

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
        let run = WatchedRun {
            system: "rover".into(),
            component: "view".into(),
            launcher: 0,
            log: String::new(),
            log_begin: 0,
        };
        station.end_connection(0, &run, "");
        assert!(station.console.lock().connection.is_cut(), "that it has ended is not proven");
        station.begin_run("rover", "rover".into(), "run 1", Vec::new());
        assert!(station.console.lock().orders.is_stopped(), "only its component was restarted");
        station.begin_run("rover", "rover".into(), "run 2", Vec::new());
        let console = station.console.lock();
        assert!(!console.orders.is_stopped() && console.mission.is_none() && console.is_light);
        assert_eq!(console.connection, SystemConnection::Live { system: "rover".into() });
    }

    /// Connects a component to the window, as that of a run; returns its end.
    fn connect(station: &Station, run: &str) -> UnixStream {
        let (near, far) = UnixStream::pair().unwrap();
        let serving = station.clone();
        std::thread::spawn(move || serving.serve(far));
        let hello = ToWindow::Hello {
            component: "view".into(),
            system: "rover".into(),
            robot: "rover".into(),
            run: run.into(),
            launcher: 0,
            log: String::new(),
            links: Vec::new(),
        };
        MessageWriter::new(&near).unwrap().send(&hello).unwrap();
        let mut reading = near.try_clone().unwrap();
        let welcome = read_message::<ToComponent>(&mut reading).unwrap();
        assert!(matches!(welcome, Some(ToComponent::Welcome { is_accepted: true })));
        near
    }

    /// Waits until the console is in a state.
    #[track_caller]
    fn until(station: &Station, is_so: impl Fn(&Console) -> bool) {
        let begin = Instant::now();
        while !is_so(&station.console.lock()) {
            assert!(begin.elapsed() < Duration::from_secs(30), "never");
            std::thread::yield_now();
        }
    }

    /// Gives an order as the window does.
    fn order(station: &Station, order: OperatorOrder) {
        let commands = station.console.lock().handle_order(order, station.now());
        commands.iter().for_each(|command| station.send_command(command));
    }

    #[test]
    fn a_stop_without_a_connection_is_the_first_that_the_restarted_component_receives() {
        let station = Station::new("127.0.0.1:7411", false);
        drop(connect(&station, "run 1"));
        until(&station, |console| console.connection.is_cut());
        order(&station, OperatorOrder::Stop);
        let status = || station.console.lock().stop_status(station.now());
        assert_eq!(status(), Some(StopStatus::NotDelivered));
        let mut component = connect(&station, "run 1");
        let first = read_message::<ToComponent>(&mut component).unwrap();
        assert!(matches!(first, Some(ToComponent::Stop { is_on: true })), "{first:?}");
        let writer = MessageWriter::new(&component).unwrap();
        writer.send(&ToWindow::StopState { is_on: true, to: 1 }).unwrap();
        until(&station, |console| {
            console.stop_status(station.now()) == Some(StopStatus::Unmeasured)
        });
        drop((component, writer));
        until(&station, |console| console.connection.is_cut());
        let _other = connect(&station, "run 2");
        until(&station, |console| !console.connection.is_old());
        assert!(!station.console.lock().orders.is_stopped(), "of another run");
    }

    #[test]
    fn a_window_that_is_opened_during_stop_shows_it_and_drives_nothing() {
        let station = Station::new("127.0.0.1:7411", false);
        let mut component = connect(&station, "run 1");
        let writer = MessageWriter::new(&component).unwrap();
        writer.send(&ToWindow::StopState { is_on: true, to: 1 }).unwrap();
        until(&station, |console| console.orders.is_stopped());
        order(&station, OperatorOrder::Drive { forward: 1.0, turn: 0.0 });
        assert!(!station.console.lock().orders.is_driving());
        assert_eq!(station.console.lock().orders.take_event(), None, "it was ordered before");
        order(&station, OperatorOrder::Release);
        let released = read_message::<ToComponent>(&mut component).unwrap();
        assert!(matches!(released, Some(ToComponent::Stop { is_on: false })), "{released:?}");
    }

    #[test]
    fn only_a_death_is_a_crash() {
        assert!(is_crash("killed by signal 9; it starts again in 0.1 s"));
        assert!(is_crash("ended with code 7; it is given up after 5 starts in 1.6 s"));
        assert!(is_crash("ended with code 7; it is not started again"));
        assert!(!is_crash("ended with code 0; it is not started again"));
        assert!(!is_crash("ended with code 0"));
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
