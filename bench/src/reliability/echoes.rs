//! Data of a running system as `armor echo` prints them, each with the time of its arrival.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use parking_lot::Mutex;
use serde_json::Value;

/// The place that is the goal of the mission.
const HOME: &str = "home";

/// `armor echo` of one output, read by a thread.
pub struct EchoFollower<T> {
    echo: Child,
    seen: Arc<Mutex<Vec<T>>>,
    reading: std::thread::JoinHandle<()>,
}

impl<T: Clone + Send + 'static> EchoFollower<T> {
    /// Starts to follow; nothing if there is no such data yet.
    pub fn start(
        program: &Path,
        registry: &str,
        data: &str,
        read: fn(&str) -> Option<T>,
    ) -> Result<Option<Self>> {
        let mut echo = Command::new(program)
            .args(["echo", data, "--format", "json", "--registry", registry])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let mut lines = BufReader::new(echo.stdout.take().context("a pipe")?);
        let mut first = String::new();
        lines.read_line(&mut first)?;
        let Some(first) = read(&first) else {
            let _ = echo.kill();
            echo.wait()?;
            return Ok(None);
        };
        let seen = Arc::new(Mutex::new(vec![first]));
        let list = Arc::clone(&seen);
        let reading = std::thread::spawn(move || read_on(lines, &list, read));
        Ok(Some(Self { echo, seen, reading }))
    }

    /// Whether the system has ended, and `armor echo` with it.
    pub fn has_ended(&self) -> bool {
        self.reading.is_finished()
    }

    /// What was received so far.
    pub fn list(&self) -> Vec<T> {
        self.seen.lock().clone()
    }
}

impl<T> Drop for EchoFollower<T> {
    fn drop(&mut self) {
        let _ = self.echo.kill();
        let _ = self.echo.wait();
    }
}

fn read_on<T>(lines: BufReader<ChildStdout>, seen: &Mutex<Vec<T>>, read: fn(&str) -> Option<T>) {
    for line in lines.lines().map_while(Result::ok) {
        if let Some(one) = read(&line) {
            seen.lock().push(one);
        }
    }
}

/// A message with a frame, and a place if it is a pose.
#[derive(Clone, Debug)]
pub struct SeenFrame {
    pub at: Instant,
    pub stamp_s: f64,
    pub frame: String,
    pub x: f64,
    pub y: f64,
}

impl SeenFrame {
    pub fn read(line: &str) -> Option<Self> {
        let message: Value = serde_json::from_str(line).ok()?;
        let value = &message["value"];
        let position = &value["pose"]["pose"]["position"];
        Some(Self {
            at: Instant::now(),
            stamp_s: value["stamp"].as_f64()?,
            frame: value["frame"].as_str()?.to_owned(),
            x: position["x"].as_f64().unwrap_or(f64::NAN),
            y: position["y"].as_f64().unwrap_or(f64::NAN),
        })
    }
}

/// A marking of the mission.
#[derive(Clone, Copy, Debug)]
pub struct SeenMarking {
    pub at: Instant,
    /// Whether the mission is at its goal. The processes end later.
    pub is_home: bool,
}

impl SeenMarking {
    pub fn read(line: &str) -> Option<Self> {
        let message: Value = serde_json::from_str(line).ok()?;
        let mut places = message["value"]["places"].as_array()?.iter();
        Some(Self { at: Instant::now(), is_home: places.any(|it| it["place"] == HOME) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mission_is_over_when_its_goal_is_marked() {
        let is_home = |places: &str| {
            let line = format!(r#"{{"value":{{"stage":"ending","places":{places}}}}}"#);
            SeenMarking::read(&line).map(|marking| marking.is_home)
        };
        assert_eq!(is_home(r#"[{"place":"return"}]"#), Some(false));
        assert_eq!(is_home(r#"[{"place":"home"}]"#), Some(true));
        assert_eq!(is_home(r#"[{"place":"hold"}]"#), Some(false));
        assert_eq!(is_home("null"), None);
    }
}
