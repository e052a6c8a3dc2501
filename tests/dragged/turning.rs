//! Where a simulated robot truly is, as its simulator publishes it, and when it turns to a point.

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::fixture::{Folder, Run, wait_for};

/// A robot has begun to turn to a point when it faces it by so much more: about six degrees.
const TURNED_RAD: f64 = 0.1;
/// It faces a point if it would drive to it without turning on the spot.
const FACES_RAD: f64 = 0.3;

#[derive(Clone, Copy)]
struct TruePose {
    at: Instant,
    position_m: [f64; 2],
    heading_rad: f64,
}

impl TruePose {
    /// How far it must turn to face a point.
    fn turn_to(&self, [x_m, y_m]: [f64; 2]) -> f64 {
        let wanted = (y_m - self.position_m[1]).atan2(x_m - self.position_m[0]);
        let turn = wanted - self.heading_rad;
        turn.sin().atan2(turn.cos()).abs()
    }
}

/// Receives the true poses of a robot until it is dropped.
pub struct TruthFollower {
    echo: Child,
    seen: Arc<Mutex<Vec<TruePose>>>,
}

impl TruthFollower {
    /// Follows the robot of this simulator.
    pub fn of(run: &Run, folder: &Folder, simulator: &str) -> Self {
        let (data, registry) = (format!("{simulator}.truth"), run.registry().to_string());
        let mut arguments = vec!["echo", &data, "--csv", "--registry", &registry];
        for field in ["position.x", "position.y", "orientation.z", "orientation.w"] {
            arguments.extend(["--field", field]);
        }
        let paths: Vec<_> = arguments
            .iter()
            .map(|it| match it.split_once('.') {
                Some(("position" | "orientation", _)) => format!("pose.pose.{it}"),
                _ => (*it).to_owned(),
            })
            .collect();
        let arguments: Vec<_> = paths.iter().map(String::as_str).collect();
        let mut echo = folder.armor(&arguments).stdout(Stdio::piped()).spawn().expect("armor echo");
        let lines = BufReader::new(echo.stdout.take().expect("its output")).lines();
        let seen = Arc::new(Mutex::new(Vec::new()));
        let poses = Arc::clone(&seen);
        std::thread::spawn(move || {
            // The first line has the names of the columns.
            for line in lines.map_while(Result::ok).skip(1) {
                let at = Instant::now();
                let numbers = line.split(',').skip(2).map(|it| it.parse().expect("a number"));
                let [x, y, z, w] = numbers.collect::<Vec<f64>>()[..] else { panic!("{line}") };
                let heading_rad = 2.0 * z.atan2(w);
                poses.lock().expect("no panic").push(TruePose {
                    at,
                    position_m: [x, y],
                    heading_rad,
                });
            }
        });
        Self { echo, seen }
    }

    fn newest(&self) -> Option<TruePose> {
        self.seen.lock().expect("no panic").last().copied()
    }

    /// Waits until the robot faces a point.
    pub fn wait_until_it_faces(&self, to: [f64; 2]) {
        wait_for("the robot faces its point", || {
            self.newest().filter(|pose| pose.turn_to(to) < FACES_RAD)
        });
    }

    /// Waits until the robot, which faced elsewhere at `start`, turns to a point; returns how long that took.
    pub fn wait_until_it_turns(&self, start: Instant, to: [f64; 2]) -> Duration {
        let seen = || self.seen.lock().expect("no panic").clone();
        let before = seen().into_iter().rfind(|pose| pose.at <= start).expect("a pose before");
        let most_rad = before.turn_to(to) - TURNED_RAD;
        assert!(most_rad > 1.0, "the robot faced the new point already");
        let turned = wait_for("the robot turns to its new point", || {
            seen().into_iter().find(|pose| pose.at > start && pose.turn_to(to) < most_rad)
        });
        turned.at - start
    }
}

impl Drop for TruthFollower {
    fn drop(&mut self) {
        let _ = self.echo.kill();
        let _ = self.echo.wait();
    }
}
