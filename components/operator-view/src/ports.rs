//! The operator's screen as a component: data of the robot in, orders of the operator out.

mod input;
mod mission_lookout;
mod panel_kind;
mod panels;
mod port_list;
mod relay;
mod robot_commands;
mod scene_inputs;
mod settings;
mod station;
mod system_lookout;
mod watch_messages;
mod watched_run;

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use armor_sdk::prelude::*;
use parking_lot::Mutex;
use rustix::process::{Signal, getpid, kill_process};

use crate::console::Console;
use crate::links::{ClockTimes, InputLink, SequenceNumber};
use crate::orders::{OperatorOrder, RobotCommand};
use crate::picture::{Painter, ScreenPictureError};
use crate::scene::LaserPlace;
use crate::window::{ViewWindow, WindowEnd, WindowHooks};
use mission_lookout::MissionLookout;
use port_list::{PORTS, all_inputs};
use relay::{Relay, ToWindowLinks};
use robot_commands::send_command;
use settings::{PARAMETERS, ViewSettings};
use system_lookout::{SystemChange, SystemLookout};
use watch_messages::{LinkedInput, ToWindow, find_record};

pub(crate) use panels::{HostsReading, LinksReading, make_panels};

/// Either is set if there is a display.
const DISPLAYS: [&str; 2] = ["DISPLAY", "WAYLAND_DISPLAY"];
/// Set by a run that wants no windows.
const HEADLESS_VARIABLE: &str = "ARMOR_HEADLESS";
/// The folder of the run.
const OUT_VARIABLE: &str = "ARMOR_OUT";
/// The variable with the address of the registry, which the launcher sets.
const REGISTRY_VARIABLE: &str = "ARMOR_REGISTRY";
/// The names are those of [`OperatorEvent`](crate::orders::OperatorEvent).
const EVENTS: &[DeclaredEvent] = &[
    DeclaredEvent::new("stopped").doc("STOP was ordered"),
    DeclaredEvent::new("released").doc("STOP was released"),
    DeclaredEvent::new("goal").doc("a goal was set"),
    DeclaredEvent::new("arrived").doc("the robot is at the goal"),
    DeclaredEvent::new("driving").doc("the operator has begun to drive by hand"),
    DeclaredEvent::new("frame_changed")
        .doc("the map frame has another origin: goal, tracks and path of before are removed"),
    DeclaredEvent::new("button").doc("a button of the mission was pressed").named_by("buttons"),
];

/// Runs the program: a component like any, by its command line.
pub fn run() -> ExitCode {
    let arguments: Vec<String> =
        std::env::args_os().skip(1).map(|it| it.to_string_lossy().into_owned()).collect();
    station::run_if_wanted(&arguments).unwrap_or_else(armor_sdk::run::<OperatorView>)
}

/// Shows an operator what the robot sees and does, and takes orders.
pub struct OperatorView {
    armor: Armor,
    console: Arc<Mutex<Console>>,
    settings: ViewSettings,
    started: Instant,
    window: Option<ViewWindow>,
    /// Why there is no window.
    failure: Arc<Mutex<Option<WindowEnd>>>,
    painter: Option<Painter>,
    pictured_s: f64,
    system: Option<SystemLookout>,
    mission: Option<MissionLookout>,
    relay: Relay,
}

impl Component for OperatorView {
    const KIND: &'static str = "operator-view";
    const SUMMARY: &'static str = "The operator's screen: map, scan, trajectories, camera and state; goals, driving by hand, STOP.";
    const REPORTS_DONE: bool = false;
    const FRAMES: &'static [(&'static str, &'static str)] = &[("scan", "laser_frame")];
    const PARAMETERS: &'static [Parameter] = PARAMETERS;
    const PORTS: &'static [(&'static str, &'static str)] = &PORTS;
    const EVENTS: &'static [DeclaredEvent] = EVENTS;

    fn new(armor: Armor) -> Result<Self, Fault> {
        for input in all_inputs() {
            input.subscribe(&armor)?;
        }
        armor.provide::<PoseStamped>("goal")?;
        armor.provide::<Twist>("velocity")?;
        armor.provide::<Latched<Flag>>("stop")?;
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        // The operator needs the screen whatever the mission does.
        armor.set_non_controllable()?;
        Ok(Self {
            armor,
            console: Arc::default(),
            settings: ViewSettings::default(),
            started: Instant::now(),
            window: None,
            failure: Arc::default(),
            painter: None,
            pictured_s: f64::NEG_INFINITY,
            system: None,
            mission: None,
            relay: Relay::new(find_registry().as_deref()),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.settings.take_parameter(&mut self.console.lock(), name, value)?;
        self.relay.send(&self.compose_settings());
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let Some(input) = all_inputs().find(|input| input.id == header.id()) else {
            return Ok(());
        };
        let is_sent = self.relay.hand_over(header, data.bytes(), input.is_steady);
        // The window decodes them; here they are needed only for pictures.
        if is_sent && self.settings.picture.is_none() {
            return Ok(());
        }
        let update = input.read(data);
        let now = read_clocks(self.started, &self.armor);
        let number = SequenceNumber { instance: header.instance, sequence: header.sequence };
        let mut console = self.console.lock();
        let outcome = update.and_then(|update| update(&mut console));
        console.record_arrival(header.id(), now, header.stamp_s, number, outcome);
        drop(console);
        if let Some(window) = &self.window {
            window.request_frame();
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => {
                self.mission = find_registry().as_deref().and_then(MissionLookout::begin);
                self.open_screen()?;
                self.system = find_registry()
                    .and_then(|registry| SystemLookout::begin(&registry, self.name()));
            }
            Call::Stopping => {
                self.close_screen()?;
                return Ok(Outcome::CarryOn);
            }
            Call::Tick | Call::Data => {}
        }
        let failure = self.failure.lock().take();
        match failure {
            Some(WindowEnd::Failed(why)) => return Ok(Outcome::Failed(why)),
            // A panic of the window is one of the component: it is reported, and the process
            // restarted.
            Some(WindowEnd::Panicked(panic)) => resume_unwind(panic),
            Some(WindowEnd::Closed) | None => {}
        }
        self.update_system();
        let now = read_clocks(self.started, &self.armor);
        self.update_mission(now);
        self.update_relay(now);
        let again = self.console.lock().orders.repeat_order(now.host_s);
        if let Some(command) = again {
            self.send_and_record(command)?;
        }
        if now.host_s - self.pictured_s >= self.settings.picture_period_s {
            self.take_picture();
        }
        let event = self.console.lock().orders.take_event();
        let event = event.map(|event| event.name().to_owned()).or_else(|| self.relay.take_event());
        Ok(event.map_or(Outcome::CarryOn, |event| Outcome::event(&event, 1.0)))
    }
}

impl OperatorView {
    fn open_screen(&mut self) -> Result<(), Fault> {
        let linked = all_inputs().filter_map(|input| {
            Some(InputLink::new(input.id, self.armor.subscribed_data(input.id)?, input.is_steady))
        });
        let mut console = self.console.lock();
        console.links = linked.collect();
        console.scene.is_localised = console.is_linked("pose");
        let record = find_registry().as_deref().and_then(find_record);
        let robot = record.and_then(|record| record.file_names.last().cloned());
        console.robot_name = robot.unwrap_or_else(|| self.name());
        drop(console);
        // A window that watches this system shows it; there is no second one.
        let now = read_clocks(self.started, &self.armor);
        if self.update_relay(now) {
            return Ok(());
        }
        let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        if self.settings.window && !is_set(HEADLESS_VARIABLE) && self.window.is_none() {
            if !DISPLAYS.into_iter().any(is_set) {
                let why = "there is no display: neither DISPLAY nor WAYLAND_DISPLAY is set; set \
                           `window` to false to run without a window";
                return Err(why.into());
            }
            let title = format!("{} - Armor", self.name());
            let size = self.settings.size.map(|side| side as f32);
            self.window = Some(ViewWindow::open(title, size, self.make_hooks())?);
        }
        Ok(())
    }

    /// Returns the name of this component.
    fn name(&self) -> String {
        let stop = self.armor.provided_data("stop").unwrap_or_default();
        stop.trim_end_matches(".stop").to_owned()
    }

    /// Takes what has changed of the hosts and links.
    fn update_system(&mut self) {
        let Some(lookout) = &mut self.system else { return };
        let SystemChange { hosts, links } = lookout.take_change();
        if hosts.is_none() && links.is_none() {
            return;
        }
        // Each is sent before the console is locked: a window must not wait for a slow reader.
        if let Some(hosts) = hosts {
            self.relay.send(&ToWindow::Hosts { hosts: hosts.hosts().to_vec() });
            self.console.lock().readings.store(hosts);
        }
        if let Some(links) = links {
            self.relay.send(&ToWindow::Links { links: links.reports().to_vec() });
            self.console.lock().readings.store(links);
        }
        if let Some(window) = &self.window {
            window.request_frame();
        }
    }

    /// Takes the state of the mission, and the executive's replies to answers.
    fn update_mission(&mut self, now: ClockTimes) {
        let Some(lookout) = &mut self.mission else { return };
        let (change, results) = (lookout.take_change(now.host_s), lookout.take_results());
        if change.is_none() && results.is_empty() {
            return;
        }
        if let Some(mission) = change {
            self.relay.send_mission(&mission);
            self.console.lock().set_mission(mission, now);
        }
        for result in results {
            let is_accepted = result.accepted == Some(true);
            let (order, text) = (result.order, result.text);
            self.console.lock().record_answer(&order, is_accepted, &text, now);
            self.relay.send(&ToWindow::Answered { order, is_accepted, text });
        }
        if let Some(window) = &self.window {
            window.request_frame();
        }
    }

    /// Looks for a window that watches this system, and hands the screen over to it. Returns whether
    /// there is one.
    fn update_relay(&mut self, now: ClockTimes) -> bool {
        let links = || ToWindowLinks {
            component: self.name(),
            links: all_inputs()
                .filter_map(|input| {
                    let data = self.armor.subscribed_data(input.id)?;
                    Some(LinkedInput { input: input.id.into(), data })
                })
                .collect(),
        };
        let links = links();
        if self.relay.look_for_window(&self.armor, self.mission.as_ref(), || links) {
            self.relay.send(&self.compose_settings());
            let mission = self.mission.as_ref().and_then(|lookout| lookout.state(now.host_s));
            if let Some(mission) = mission {
                self.relay.send_mission(&mission);
            }
            let readings = self.console.lock().readings.clone();
            if let Some(hosts) = readings.newest::<HostsReading>() {
                self.relay.send(&ToWindow::Hosts { hosts: hosts.hosts().to_vec() });
            }
            if let Some(links) = readings.newest::<LinksReading>() {
                self.relay.send(&ToWindow::Links { links: links.reports().to_vec() });
            }
            self.console.lock().is_over = true;
            if let Some(window) = self.window.take() {
                tracing::info!("a window that watches this system shows it from now on");
                window.close();
            }
        }
        if let Err(fault) = self.relay.repeat_stop(&self.armor) {
            tracing::error!("STOP was not sent: {fault}");
        }
        self.relay.send(&ToWindow::Tick { system_s: now.system_s });
        self.relay.is_connected()
    }

    /// Returns what a window that watches this system needs of the parameters.
    fn compose_settings(&self) -> ToWindow {
        let console = self.console.lock();
        let limits = console.orders.limits;
        let (laser, no_laser) = match &console.scene.robot_from_laser {
            LaserPlace::Known(pose) => (vec![pose.x_m, pose.y_m, pose.yaw_rad], String::new()),
            LaserPlace::Unknown(why) => (Vec::new(), why.clone()),
        };
        ToWindow::Settings {
            speed_mps: limits.speed_mps,
            turn_radps: limits.turn_radps,
            tolerance_m: limits.tolerance_m,
            robot_radius_m: console.robot_radius_m,
            laser,
            no_laser,
            buttons: console.buttons.clone(),
            is_light: console.is_light,
        }
    }

    /// Returns the hooks of the window. It sends commands itself, because an operator must not wait
    /// for the component's next tick.
    fn make_hooks(&self) -> WindowHooks {
        let (armor, clock, started) = (self.armor.clone(), self.armor.clone(), self.started);
        let failure = Arc::clone(&self.failure);
        let stop = self.relay.stop();
        let (console, answers) =
            (Arc::clone(&self.console), self.mission.as_ref().map(MissionLookout::answers));
        WindowHooks {
            console: Arc::clone(&self.console),
            panels: make_panels(),
            send: Box::new(move |command| {
                match (command, &answers) {
                    (RobotCommand::Answer { transition, is_confirmed }, Some(answers)) => {
                        answers.give_answer(transition, *is_confirmed);
                    }
                    (RobotCommand::Resume, Some(answers)) => answers.resume_mission(),
                    _ => {}
                }
                let mut stop = stop.lock();
                let to = send_command(&armor, command).unwrap_or_else(|fault| {
                    tracing::error!("an order was not sent: {fault}");
                    0
                });
                if let &RobotCommand::Stop(is_on) = command {
                    *stop = Some((is_on, to));
                }
                Some(to)
            }),
            now: Box::new(move || read_clocks(started, &clock)),
            gone: Box::new(move |gone| match gone {
                // The same as Ctrl-C in a terminal: the component ends in order, with code 0.
                WindowEnd::Closed if console.lock().is_over => {}
                WindowEnd::Closed => {
                    let _ = kill_process(getpid(), Signal::TERM);
                }
                gone => *failure.lock() = Some(gone),
            }),
        }
    }

    /// Ends driving by hand, makes the last picture, and closes the window.
    fn close_screen(&mut self) -> Result<(), Fault> {
        let now = read_clocks(self.started, &self.armor);
        let mut console = self.console.lock();
        let commands = console.orders.handle_order(OperatorOrder::LetGo, now.host_s);
        drop(console);
        for command in commands {
            self.send_and_record(command)?;
        }
        let console = self.console.lock().clone();
        if let Some(mut painter) = self.painter.take() {
            warn_of(painter.finish_painting(console, now));
        }
        if self.window.is_some() && self.settings.picture.is_none() {
            self.save_last_picture(now);
        }
        self.console.lock().is_over = true;
        if let Some(window) = self.window.take() {
            window.close();
        }
        self.relay.close();
        Ok(())
    }

    /// Saves what the window shows, which closes with the run.
    fn save_last_picture(&self, now: ClockTimes) {
        let Some(folder) = std::env::var_os(OUT_VARIABLE).filter(|folder| !folder.is_empty())
        else {
            return;
        };
        let path = PathBuf::from(folder).join(format!("{}-last.png", self.name()));
        let mut painter = Painter::new(path.clone(), self.settings.size, 1.0, make_panels());
        let console = self.console.lock().clone();
        match painter.finish_painting(console, now) {
            Ok(()) => {
                let record = find_registry().as_deref().and_then(find_record);
                tracing::info!(
                    "{}",
                    describe_end(&path, record.map(|record| record.file.display().to_string()))
                );
            }
            error => warn_of(error),
        }
    }

    fn send_and_record(&self, command: RobotCommand) -> Result<(), Fault> {
        let to = send_command(&self.armor, &command)?;
        let now = read_clocks(self.started, &self.armor);
        self.console.lock().record_sent(&command, to, now);
        Ok(())
    }

    /// Begins to paint a picture on another thread, so that neither data nor STOP wait for it.
    fn take_picture(&mut self) {
        let Some(path) = &self.settings.picture else { return };
        let now = read_clocks(self.started, &self.armor);
        let ([width, height], scale) = (self.settings.size, self.settings.scale as f32);
        let painter = self.painter.get_or_insert_with(|| {
            Painter::new(path.clone(), [width, height], scale, make_panels())
        });
        let console = self.console.lock().clone();
        warn_of(painter.begin_painting(console, now));
        self.pictured_s = now.host_s;
    }
}

/// What the log of a run states of its window, which has closed with it: where its last picture is,
/// and by which command a window of this file stays.
fn describe_end(picture: &Path, file: Option<String>) -> String {
    let file = file.unwrap_or_else(|| "FILE".into());
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:".contains(c);
    let file = match file.chars().all(is_plain) {
        true => file,
        false => format!("'{}'", file.replace('\'', r"'\''")),
    };
    format!(
        "the window closes with the run, as all its processes; what it showed last is in {}. A window that \
         stays, and shows why a run has ended: armor-operator-view --watch {file}",
        picture.display()
    )
}

/// Logs a failed picture: a full disk must not end the screen.
fn warn_of(picture: Result<(), ScreenPictureError>) {
    if let Err(error) = picture {
        tracing::warn!("no picture: {error}");
    }
}

/// Returns the address of the registry: that of the command line, or the one that the launcher has set.
fn find_registry() -> Option<String> {
    let given = std::env::args().skip_while(|argument| argument != "--registry").nth(1);
    given.or_else(|| std::env::var(REGISTRY_VARIABLE).ok()).filter(|address| !address.is_empty())
}

fn read_clocks(started: Instant, armor: &Armor) -> ClockTimes {
    ClockTimes { host_s: started.elapsed().as_secs_f64(), system_s: armor.timestamp() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_of_a_window_that_stays_can_be_copied_from_the_log() {
        let end = |file: Option<&str>| {
            describe_end(Path::new("out/view-last.png"), file.map(str::to_owned))
        };
        assert!(
            end(Some("/robots/a.xml")).ends_with(": armor-operator-view --watch /robots/a.xml")
        );
        assert!(end(Some("/my robots/it's.xml")).ends_with(r" --watch '/my robots/it'\''s.xml'"));
        assert!(end(None).ends_with(" --watch FILE"));
        assert!(end(None).contains("out/view-last.png"));
    }

    #[test]
    fn the_manifest_lists_all_ports() {
        let manifest = armor_sdk::manifest_of::<OperatorView>().unwrap();
        assert_eq!(manifest.inputs.len(), all_inputs().count());
        assert!(manifest.inputs.iter().all(|port| !port.required && !port.doc.is_empty()));
        assert!(all_inputs().all(|input| manifest.inputs.iter().any(|p| p.id == input.id)));
        assert_eq!(manifest.outputs.iter().filter(|port| port.latched).count(), 1, "stop");
    }
}
