//! The live view as a component: no data is linked to it, since it reads what each viewer shows; what
//! a person orders is published.

mod bridge;
mod channel;
mod channel_table;
mod commander;
mod fixed_frames;
mod mission_services;
mod parameter_desk;
mod published_message;
mod session;
mod viewer_messages;
mod viewer_server;

#[cfg(test)]
mod layout_tests;

use std::net::SocketAddr;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_inspect::{DriveLimits, this_user};
use armor_recording::OutputSelection;
use armor_sdk::prelude::*;
use armor_wire::acting::KeyRole;

use bridge::Bridge;
use commander::{Commander, CommanderSettings, ViewerEvent};
use fixed_frames::make_transforms;
use viewer_messages::ViewerClients;
use viewer_server::ViewerServer;

/// The variable with the address of the registry, which the launcher sets.
const REGISTRY_VARIABLE: &str = "ARMOR_REGISTRY";
/// Time between two attempts to listen, while another program uses the port.
const RETRY: Duration = Duration::from_secs(2);
/// Time between two publications of the clients.
const DESCRIBE_EVERY: Duration = Duration::from_secs(1);

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct FoxgloveParameters {
    /// where viewers connect, on loopback
    #[parameter(default = "127.0.0.1:8765", format = "address")]
    listen: String,
    /// web pages that may connect, besides programs: their origins, with spaces between them
    #[parameter(default = "https://app.foxglove.dev")]
    origins: String,
    /// what is shown: names of data, component.* for all of a component; empty for everything
    #[parameter(default = "")]
    outputs: String,
    /// what is not shown, written the same way
    #[parameter(default = "")]
    hidden: String,
    /// what viewers may do: look; also drive and command the mission; also set parameters
    #[parameter(
        default = "operator",
        choices(
            "observer" = KeyRole::Observer,
            "operator" = KeyRole::Operator,
            "engineer" = KeyRole::Engineer,
        )
    )]
    role: KeyRole,
    /// the frames of the file, which viewers place scans and images with
    #[parameter(default = "", format = "frames", live)]
    frames: Vec<FixedFrame>,
    /// fastest speed by hand
    #[parameter(unit = "m/s", default = "0.4m/s", range = 0.01..=5.0, live)]
    speed_mps: f64,
    /// fastest turn by hand
    #[parameter(unit = "rad/s", default = "1rad/s", range = 0.1..=10.0, live)]
    turn_radps: f64,
    /// a robot at this distance from a viewer's goal has arrived
    #[parameter(unit = "m", default = "0.3m", range = 0.01..=10.0, live)]
    tolerance_m: f64,
}

/// Serves viewers, and publishes what a person orders with them.
pub struct Foxglove {
    armor: Armor,
    parameters: FoxgloveParameters,
    commander: Arc<Commander>,
    served: Option<(Arc<Bridge>, ViewerServer)>,
    tried: Option<Instant>,
    described: Option<Instant>,
    /// The frames of the file are published.
    has_frames: bool,
}

/// Runs the component, as the program does.
pub fn run() -> ExitCode {
    armor_sdk::run::<Foxglove>()
}

impl Component for Foxglove {
    const KIND: &'static str = "foxglove";
    const SUMMARY: &'static str =
        "A live view for Foxglove: data, parameters, connections, driving by hand and goals.";
    const REPORTS_DONE: bool = false;
    const READS_ALL: bool = true;
    const PARAMETERS: &'static [Parameter] = FoxgloveParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("pose", "where the robot is, to recognise that it has reached a viewer's goal"),
        ("velocity", "driving by hand: while a viewer publishes /cmd_vel, then once zero"),
        ("stop", "true: the robot must stand, whatever else is ordered; until false"),
        ("goal", "a viewer's goal, again at every tick until the robot is there"),
        ("transforms", "where the fixed frames of the file are"),
        ("clients", "the viewers that are connected, and what was dropped for each"),
    ];
    const EVENTS: &'static [DeclaredEvent] = ViewerEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Optional<PoseWithCovarianceStamped>>("pose")?;
        armor.provide::<Twist>("velocity")?;
        armor.provide::<Latched<Flag>>("stop")?;
        armor.provide::<PoseStamped>("goal")?;
        armor.provide::<Latched<FrameTransforms>>("transforms")?;
        armor.provide::<Latched<ViewerClients>>("clients")?;
        let parameters = FoxgloveParameters::request(&armor)?;
        // People need the view whatever the mission does.
        armor.set_non_controllable()?;
        let commander = Arc::new(Commander::new(armor.clone(), parameters.settings()));
        let (served, tried, described) = Default::default();
        Ok(Self { armor, parameters, commander, served, tried, described, has_frames: false })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        self.has_frames &= name != "frames";
        self.commander.set(self.parameters.settings());
        Ok(())
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let pose: PoseWithCovarianceStamped = data.decode()?;
        self.commander.take_pose(&pose.pose.pose);
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Stopping {
            self.served = None;
            return Ok(Outcome::CarryOn);
        }
        if !std::mem::replace(&mut self.has_frames, true) {
            let transforms = make_transforms(&self.parameters.frames, self.armor.timestamp());
            self.armor.send_data("transforms", &transforms)?;
        }
        self.serve_viewers()?;
        self.commander.repeat_goal();
        self.describe_clients()?;
        Ok(self.commander.take_event().map_or(Outcome::CarryOn, ViewerEvent::into))
    }
}

impl FoxgloveParameters {
    fn settings(&self) -> CommanderSettings {
        CommanderSettings {
            limits: DriveLimits { speed_mps: self.speed_mps, turn_radps: self.turn_radps },
            role: self.role,
            tolerance_m: self.tolerance_m,
        }
    }

    fn selection(&self) -> OutputSelection {
        let split = |text: &str| text.split_whitespace().map(str::to_owned).collect();
        OutputSelection { include: split(&self.outputs), exclude: split(&self.hidden) }
    }
}

impl Foxglove {
    /// Starts the server if it does not run. A port in use is no reason to end a mission: it is
    /// tried again.
    fn serve_viewers(&mut self) -> Result<(), Fault> {
        if self.served.is_some() || self.tried.is_some_and(|tried| tried.elapsed() < RETRY) {
            return Ok(());
        }
        let listen: SocketAddr = self.parameters.listen.parse().map_err(|_| {
            let listen = &self.parameters.listen;
            format!("listen=\"{listen}\" is no address with a port: write 127.0.0.1:8765")
        })?;
        let registry = find_registry().ok_or("it runs without a registry, so it has no system")?;
        let is_first = self.tried.replace(Instant::now()).is_none();
        match self.start_server(listen, &registry) {
            Ok(served) => {
                tracing::info!("viewers connect to ws://{}", served.1.address());
                self.served = Some(served);
            }
            Err(error) if is_first => tracing::warn!("there is no live view: {error}"),
            Err(_) => {}
        }
        Ok(())
    }

    fn start_server(
        &self,
        listen: SocketAddr,
        registry: &str,
    ) -> Result<(Arc<Bridge>, ViewerServer), String> {
        let component = self.armor.provided_data("velocity").unwrap_or_default();
        let component = component.split('.').next().unwrap_or_default().to_owned();
        let author = format!("{} by foxglove", this_user());
        let (selection, commander) = (self.parameters.selection(), Arc::clone(&self.commander));
        let bridge = Bridge::begin(registry, component, &author, selection, commander)
            .map_err(|error| error.to_string())?;
        let origins = self.parameters.origins.split_whitespace().map(str::to_owned).collect();
        let server = ViewerServer::start(listen, origins, Arc::clone(&bridge));
        Ok((bridge, server.map_err(|error| error.to_string())?))
    }

    fn describe_clients(&mut self) -> Result<(), Fault> {
        let Some((bridge, _)) = &self.served else { return Ok(()) };
        let is_due = self.described.is_none_or(|at| at.elapsed() >= DESCRIBE_EVERY);
        if is_due {
            self.described = Some(Instant::now());
            self.armor.send_data("clients", &bridge.describe_clients())?;
        }
        Ok(())
    }
}

fn find_registry() -> Option<String> {
    let given = std::env::args().skip_while(|argument| argument != "--registry").nth(1);
    given.or_else(|| std::env::var(REGISTRY_VARIABLE).ok()).filter(|address| !address.is_empty())
}
