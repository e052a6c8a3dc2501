//! The page as a component: no inputs, since the server follows what each page shows; the orders of
//! the operator out.

use std::collections::{BTreeSet, VecDeque};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_inspect::{find_own_registry, this_user};
use armor_sdk::prelude::*;
use armor_web::{DriveLimits, RobotCommands, WebOptions, WebServer, find_keys_folder};
use parking_lot::Mutex;

/// Time between two attempts to listen, while another program uses the port.
const RETRY: Duration = Duration::from_secs(2);
/// Events that no tick has reported yet; more are the same few again.
const MAX_EVENTS: usize = 16;
/// Most kinds of failures that are logged until the page is served; they are a handful.
const MAX_FAILURES: usize = 32;

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct WebViewParameters {
    /// where the page is served; beyond loopback with HTTPS, keys and invitations
    #[parameter(default = "127.0.0.1:8080", format = "address")]
    listen: String,
    /// fastest speed by hand
    #[parameter(unit = "m/s", default = "0.4m/s", range = 0.01..=5.0)]
    speed_mps: f64,
    /// fastest turn by hand
    #[parameter(unit = "rad/s", default = "1rad/s", range = 0.1..=10.0)]
    turn_radps: f64,
}

/// What it reports to the mission.
#[derive(Clone, Copy, Debug, Events, PartialEq)]
enum WebViewEvent {
    /// STOP was ordered
    Stopped,
    /// STOP was released
    Released,
    /// the operator has begun to drive by hand
    Driving,
}

/// Serves the operator's page, and publishes STOP and velocities.
pub struct WebView {
    parameters: WebViewParameters,
    commands: Arc<PublishedCommands>,
    server: Option<WebServer>,
    tried: Option<Instant>,
    failures: StartFailures,
}

/// Why the page is not served, each reason logged once although it is tried again and again.
#[derive(Debug, Default)]
struct StartFailures(BTreeSet<String>);

/// Publishes on the threads of the server, because an operator must not wait for the next tick.
struct PublishedCommands {
    armor: Armor,
    state: Mutex<CommandState>,
}

struct CommandState {
    limits: DriveLimits,
    is_driving: bool,
    events: VecDeque<WebViewEvent>,
}

impl Component for WebView {
    const KIND: &'static str = "web-view";
    const SUMMARY: &'static str =
        "The operator's page for browsers: state, map, mission, STOP and driving by hand.";
    const REPORTS_DONE: bool = false;
    const READS_ALL: bool = true;
    const PARAMETERS: &'static [Parameter] = WebViewParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("velocity", "driving by hand: while the stick is held, then once zero"),
        ("stop", "true: the robot must stand, whatever else is ordered; until false"),
    ];
    const EVENTS: &'static [DeclaredEvent] = WebViewEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Twist>("velocity")?;
        armor.provide::<Latched<Flag>>("stop")?;
        let parameters = WebViewParameters::request(&armor)?;
        // The operator needs the page whatever the mission does.
        armor.set_non_controllable()?;
        let limits = parameters.limits();
        let state = CommandState { limits, is_driving: false, events: VecDeque::new() };
        let commands = PublishedCommands { armor, state: Mutex::new(state) };
        Ok(Self {
            parameters,
            commands: Arc::new(commands),
            server: None,
            tried: None,
            failures: StartFailures::default(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        self.commands.state.lock().limits = self.parameters.limits();
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Stopping {
            self.server = None;
            return Ok(Outcome::CarryOn);
        }
        self.serve_page()?;
        let event = self.commands.state.lock().events.pop_front();
        Ok(event.map_or(Outcome::CarryOn, WebViewEvent::into))
    }
}

impl WebViewParameters {
    fn limits(&self) -> DriveLimits {
        DriveLimits { speed_mps: self.speed_mps, turn_radps: self.turn_radps }
    }
}

impl WebView {
    /// Starts the server if it does not run. A port in use is no reason to end a mission: it is
    /// tried again.
    fn serve_page(&mut self) -> Result<(), Fault> {
        if self.server.is_some() || self.tried.is_some_and(|tried| tried.elapsed() < RETRY) {
            return Ok(());
        }
        let listen: SocketAddr = self.parameters.listen.parse().map_err(|_| {
            let listen = &self.parameters.listen;
            format!("listen=\"{listen}\" is no address with a port: write 127.0.0.1:8080")
        })?;
        let registry =
            find_own_registry().ok_or("it runs without a registry, so it has no system")?;
        let author = format!("{} by web", this_user());
        let options = WebOptions { listen, keys: find_keys_folder(), registry, author };
        self.tried = Some(Instant::now());
        match WebServer::start(&options, Some(Arc::clone(&self.commands) as _)) {
            Ok(server) => {
                let again = self.failures.end();
                match server.remote() {
                    None => tracing::info!("the page is{again} at http://{}", server.address()),
                    Some(facts) => tracing::info!(
                        "the page is{again} at {}; its certificate has the fingerprint {}",
                        facts.urls.join(" and "),
                        facts.fingerprint
                    ),
                }
                self.server = Some(server);
            }
            Err(error) => {
                let error = error.to_string();
                if self.failures.note(&error) {
                    tracing::warn!("there is no page: {error}; it is tried again");
                }
            }
        }
        Ok(())
    }
}

impl StartFailures {
    /// Notes a failure; returns whether it is to be logged.
    fn note(&mut self, error: &str) -> bool {
        self.0.len() < MAX_FAILURES && self.0.insert(error.to_owned())
    }

    /// Notes that the page is served; returns what the log line adds.
    fn end(&mut self) -> &'static str {
        if std::mem::take(&mut self.0).is_empty() { "" } else { " now" }
    }
}

impl RobotCommands for PublishedCommands {
    fn limits(&self) -> DriveLimits {
        self.state.lock().limits
    }

    fn drive(&self, forward_mps: f64, turn_radps: f64) -> Result<usize, String> {
        let is_moving = forward_mps != 0.0 || turn_radps != 0.0;
        let mut state = self.state.lock();
        if is_moving && !std::mem::replace(&mut state.is_driving, is_moving) {
            state.note_event(WebViewEvent::Driving);
        }
        state.is_driving = is_moving;
        drop(state);
        let sent = self.armor.send_data("velocity", &Twist::planar(forward_mps, turn_radps));
        sent.map(|sent| sent.to).map_err(|error| error.to_string())
    }

    fn stop(&self, is_stopped: bool) -> Result<usize, String> {
        let sent = self.armor.send_data("stop", &Flag { data: is_stopped });
        let event = if is_stopped { WebViewEvent::Stopped } else { WebViewEvent::Released };
        self.state.lock().note_event(event);
        sent.map(|sent| sent.to).map_err(|error| error.to_string())
    }
}

impl CommandState {
    fn note_event(&mut self, event: WebViewEvent) {
        if self.events.len() < MAX_EVENTS && self.events.back() != Some(&event) {
            self.events.push_back(event);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_can_be_built_with_its_defaults() {
        armor_sdk::testing::TestedComponent::build::<WebView>(&[]).expect("it is built");
    }

    #[test]
    fn each_reason_for_no_page_is_logged_once_until_there_is_one() {
        let mut failures = StartFailures::default();
        assert_eq!(failures.end(), "");
        let logged = ["no key", "no key", "port in use", "no key", "port in use"];
        let logged: Vec<_> = logged.into_iter().filter(|error| failures.note(error)).collect();
        assert_eq!(logged, ["no key", "port in use"]);
        assert_eq!(failures.end(), " now", "the recovery is logged as one");
        assert!(failures.note("no key"), "the next failure is another one");
        let noted = (0..100).filter(|number| failures.note(&number.to_string())).count();
        assert_eq!(noted, MAX_FAILURES - 1);
    }

    #[test]
    fn an_event_is_noted_once_until_another_follows() {
        let limits = DriveLimits { speed_mps: 1.0, turn_radps: 1.0 };
        let mut state = CommandState { limits, is_driving: false, events: VecDeque::new() };
        for event in [WebViewEvent::Stopped, WebViewEvent::Stopped, WebViewEvent::Released] {
            state.note_event(event);
        }
        assert_eq!(state.events, [WebViewEvent::Stopped, WebViewEvent::Released]);
    }
}
