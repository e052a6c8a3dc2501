//! The program itself, without a display: data through real links become a picture, data that make
//! no sense are survived, and it ends in order.

#![allow(clippy::unwrap_used, reason = "all of it is a test")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use armor_registry::{BackgroundRegistry, RegistryOptions};
use armor_sdk::prelude::*;
use rustix::process::{Pid, Signal, kill_process};

/// Only a hang takes this long.
const DEADLINE: Duration = Duration::from_secs(60);

const VIEW: &str = env!("CARGO_BIN_EXE_armor-operator-view");

/// Publishes a map, poses, and much that is no map, pose, scan or image.
struct Robot {
    armor: Armor,
    ticks: u32,
}

impl Component for Robot {
    const KIND: &'static str = "robot";
    const SUMMARY: &'static str = "Publishes valid and invalid data.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<OccupancyGrid>("map")?;
        armor.provide::<OccupancyGridUpdate>("map_updates")?;
        armor.provide::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<LaserScan>("scan")?;
        armor.provide::<Odometry>("odometry")?;
        armor.provide::<CompressedImage>("image")?;
        Ok(Self { armor, ticks: 0 })
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.ticks += 1;
        let is_odd = self.ticks.is_multiple_of(2);
        let (width, height) = if is_odd { (40, 30) } else { (u32::MAX, 3) };
        let info = MapMetaData { resolution: 0.1, width, height, ..MapMetaData::default() };
        let data = vec![0; 1200].into();
        self.armor.send_data("map", &OccupancyGrid { info, data, ..Default::default() })?;
        let data = vec![100; 4].into();
        let (x, width, height) = (if is_odd { 7 } else { -7 }, 2, 2);
        let update = OccupancyGridUpdate { x, width, height, data, ..Default::default() };
        self.armor.send_data("map_updates", &update)?;
        let mut pose = PoseWithCovarianceStamped::default();
        pose.pose.covariance = [if is_odd { 0.1 } else { f64::NAN }; 36];
        pose.pose.pose.position.x = if is_odd { 2.0 } else { f64::INFINITY };
        pose.stamp = f64::from(self.ticks);
        self.armor.send_data("pose", &pose)?;
        let angle_min = if is_odd { 0.0 } else { f32::NAN };
        let ranges = vec![1.0, f32::NAN, -1.0].into();
        let scan = LaserScan { angle_min, range_max: 9.0, ranges, ..Default::default() };
        self.armor.send_data("scan", &scan)?;
        self.armor.send_data("odometry", &Odometry { stamp: f64::NAN, ..Default::default() })?;
        let image = CompressedImage { format: "jpeg".into(), ..Default::default() };
        self.armor.send_data("image", &image)?;
        Ok(Outcome::CarryOn)
    }
}

/// The program, and the folder that it writes into.
struct View {
    child: Child,
    folder: PathBuf,
    stderr_text: Arc<Mutex<String>>,
}

impl View {
    fn start(name: &str, registry: &str, arguments: &[&str]) -> Self {
        let folder = std::env::temp_dir().join(format!("{name}-{}", std::process::id()));
        let mut command = Command::new(VIEW);
        command.args(["--alone", "--name", name, "--registry", registry, "--rate", "20Hz"]);
        command.args(arguments).env("ARMOR_OUT", &folder).stderr(Stdio::piped());
        for display in ["DISPLAY", "WAYLAND_DISPLAY", "ARMOR_HEADLESS", "ARMOR_LOG"] {
            command.env_remove(display);
        }
        let mut child = command.spawn().unwrap();
        let stderr_text = Arc::new(Mutex::new(String::new()));
        let (heard, stderr) = (Arc::clone(&stderr_text), child.stderr.take().unwrap());
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                *heard.lock().unwrap() += &(line + "\n");
            }
        });
        Self { child, folder, stderr_text }
    }

    fn stderr_text(&self) -> String {
        self.stderr_text.lock().unwrap().clone()
    }

    /// Ends it as a launcher does: its exit code.
    fn end(&mut self) -> Option<i32> {
        kill_process(Pid::from_child(&self.child), Signal::TERM).unwrap();
        until("it ends", || self.child.try_wait().unwrap().is_some());
        self.child.wait().unwrap().code()
    }
}

impl Drop for View {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[track_caller]
fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < DEADLINE, "never: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn registry() -> (BackgroundRegistry, String) {
    let listen = "127.0.0.1:0".parse().unwrap();
    let registry =
        BackgroundRegistry::start(RegistryOptions { listen, ..RegistryOptions::default() })
            .unwrap();
    let address = registry.address().to_string();
    (registry, address)
}

/// How many pixels of a picture are as bright as free ground.
fn free_pixels(path: &Path) -> Option<usize> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(std::fs::read(path).ok()?))
        .read_info()
        .expect("a picture is written whole or not at all");
    let mut samples = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut samples).unwrap();
    Some(samples.chunks_exact(3).filter(|pixel| *pixel == [236; 3]).count())
}

#[test]
fn what_comes_through_links_is_pictured_and_nonsense_is_survived() {
    let (_registry, address) = registry();
    let arguments = ["--alone", "--registry", &address, "--rate", "50Hz"];
    let arguments: Vec<_> = arguments.iter().map(Into::into).collect();
    // It ends with the test's process.
    std::thread::spawn(move || armor_sdk::run_with::<Robot>(arguments));
    let inputs = ["map", "map_updates", "pose", "scan", "odometry", "image"];
    let links = inputs.map(|input| format!("--link={input}=robot.{input},keep=50"));
    let mut arguments: Vec<&str> = links.iter().map(String::as_str).collect();
    arguments.extend(["--set", "picture=view.png", "--set", "picture_period=0.1s"]);
    arguments.extend(["--set", "window=false", "--set", "width=500", "--set", "height=400"]);
    let mut view = View::start("view", &address, &arguments);
    let picture = view.folder.join("view.png");
    until("the map is in the picture", || free_pixels(&picture).is_some_and(|n| n > 3000));
    std::fs::remove_file(&picture).unwrap();
    assert_eq!(view.end(), Some(0), "{}", view.stderr_text());
    assert!(picture.exists(), "the last one is made at the end");
    let stderr_text = view.stderr_text();
    assert!(!stderr_text.contains("panicked") && !stderr_text.contains("ERROR"), "{stderr_text}");
}

#[test]
fn without_a_display_it_reports_what_to_do() {
    let (_registry, address) = registry();
    let mut view = View::start("blind", &address, &[]);
    let report = "there is no display: neither DISPLAY nor WAYLAND_DISPLAY is set; set `window`";
    until(report, || view.stderr_text().contains(report));
    assert_eq!(view.end(), Some(0), "{}", view.stderr_text());
}
