//! The server over real connections, with a registry and a component in this process.

mod attacks;
mod commands;
mod data;
mod metrics;
mod remote;
mod remote_attacks;
mod remote_scene;

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_registry::{BackgroundRegistry, RegistryOptions};
use armor_sdk::prelude::*;
use parking_lot::Mutex;
use serde_json::Value as Json;
use tungstenite::WebSocket;

use crate::{DriveLimits, RobotCommands, WebOptions, WebServer};

/// Only a hang takes this long.
const DEADLINE: Duration = Duration::from_secs(60);

/// Publishes a count, a map and long data at each tick.
struct Base {
    armor: Armor,
    count: u64,
}

impl Component for Base {
    const KIND: &'static str = "base";
    const SUMMARY: &'static str = "Publishes a count, a map and long data.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Number>("count")?;
        armor.provide::<Text>("long")?;
        armor.provide::<Latched<OccupancyGrid>>("map")?;
        Ok(Self { armor, count: 0 })
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.count += 1;
        self.armor.send_data("count", &Number { data: self.count as f64 })?;
        self.armor.send_data("long", &Text { data: "x".repeat(200_000) })?;
        let info = MapMetaData { width: 2, height: 1, resolution: 0.1, ..MapMetaData::default() };
        let data = Array::from(vec![0, 100]);
        let map = OccupancyGrid { stamp: 0.0, frame: "map".into(), info, data };
        self.armor.send_data("map", &map)?;
        Ok(Outcome::CarryOn)
    }
}

/// A robot that notes its commands.
#[derive(Default)]
struct NotingRobot {
    velocities: Mutex<Vec<(f64, f64)>>,
    stops: Mutex<Vec<bool>>,
}

impl RobotCommands for NotingRobot {
    fn limits(&self) -> DriveLimits {
        DriveLimits { speed_mps: 0.5, turn_radps: 1.0 }
    }

    fn drive(&self, forward_mps: f64, turn_radps: f64) -> Result<usize, String> {
        self.velocities.lock().push((forward_mps, turn_radps));
        Ok(1)
    }

    fn stop(&self, is_stopped: bool) -> Result<usize, String> {
        self.stops.lock().push(is_stopped);
        Ok(1)
    }
}

/// A server with its system.
struct Scene {
    server: WebServer,
    robot: Arc<NotingRobot>,
    _registry: BackgroundRegistry,
}

impl Scene {
    /// Starts a server whose process publishes commands; without a component.
    fn begin() -> Self {
        let robot = Arc::new(NotingRobot::default());
        let commands: Arc<dyn RobotCommands> = Arc::clone(&robot) as _;
        Self::start_server(robot, Some(commands))
    }

    /// As [`Self::begin`], but the process publishes no commands, as `armor web`.
    fn begin_without_robot() -> Self {
        Self::start_server(Arc::default(), None)
    }

    fn start_server(robot: Arc<NotingRobot>, commands: Option<Arc<dyn RobotCommands>>) -> Self {
        let listen = "127.0.0.1:0".parse().unwrap();
        let options = RegistryOptions { listen, ..RegistryOptions::default() };
        let registry = BackgroundRegistry::start(options).unwrap();
        let address = registry.address().to_string();
        let options = WebOptions { listen, keys: None, registry: address, author: "ruth".into() };
        let server = WebServer::start(&options, commands).unwrap();
        Self { server, robot, _registry: registry }
    }

    /// As [`Self::begin`], with a component.
    fn begin_with_base() -> Self {
        let scene = Self::begin();
        let registry = scene._registry.address().to_string();
        let rest = ["--alone", "--name", "base", "--rate", "50Hz", "--registry", &registry];
        let arguments: Vec<_> = rest.iter().map(Into::into).collect();
        // It ends with the test's process.
        std::thread::spawn(move || armor_sdk::run_with::<Base>(arguments));
        scene
    }

    fn address(&self) -> SocketAddr {
        self.server.address()
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address()).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        stream.set_write_timeout(Some(DEADLINE)).unwrap();
        stream
    }

    /// Sends a request as it is, and returns the status and the whole response.
    fn send(&self, request: &str) -> (u16, String) {
        let mut stream = self.connect();
        stream.write_all(request.as_bytes()).unwrap();
        let mut response = Vec::new();
        let _ = stream.read_to_end(&mut response);
        let response = String::from_utf8_lossy(&response).into_owned();
        let status = response.split(' ').nth(1).and_then(|status| status.parse().ok());
        (status.unwrap_or(0), response)
    }

    fn get(&self, path: &str) -> (u16, String) {
        let host = self.address();
        self.send(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"))
    }

    fn send_json(&self, method: &str, path: &str, body: &str) -> (u16, Json) {
        let (host, len) = (self.address(), body.len());
        let (status, response) = self.send(&format!(
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n\
             Content-Length: {len}\r\nConnection: close\r\n\r\n{body}"
        ));
        (status, body_json(&response))
    }

    /// Opens a WebSocket, or returns the status of the refusal.
    fn open(&self, path: &str) -> Result<WebSocket<TcpStream>, u16> {
        let address = format!("ws://{}{path}", self.address());
        tungstenite::client(address, self.connect()).map(|(socket, _)| socket).map_err(|error| {
            match error {
                tungstenite::HandshakeError::Failure(tungstenite::Error::Http(response)) => {
                    response.status().as_u16()
                }
                error => panic!("{error}"),
            }
        })
    }
}

fn body_json(response: &str) -> Json {
    let body = response.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    serde_json::from_str(body).unwrap_or(Json::Null)
}

fn read_json(socket: &mut WebSocket<TcpStream>) -> Json {
    loop {
        if let tungstenite::Message::Text(text) = socket.read().unwrap() {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

fn write_json(socket: &mut WebSocket<TcpStream>, message: &str) {
    socket.send(tungstenite::Message::text(message)).unwrap();
}

/// Waits until `find` returns something.
fn wait_for<T>(what: &str, mut find: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = find() {
            return found;
        }
        assert!(begin.elapsed() < DEADLINE, "{what} has not happened");
        std::thread::sleep(Duration::from_millis(5));
    }
}
