//! What a frame costs, in CPU time of the thread that draws it, without a GPU: with everything
//! linked, at the rates of a robot that explores. Printed, not asserted.

use armor_grid::Pose2;
use armor_picture::Stage;
use eframe::egui::Context;
use rustix::time::{ClockId, clock_gettime};

use super::{Screen, apply_theme};
use crate::console::Console;
use crate::links::{ClockTimes, InputLink, SequenceNumber};
use crate::map::{MapChange, MapLayout};
use crate::mission::MissionState;
use crate::photo::Photo;
use crate::readings::BatteryReading;
use crate::scene::{LaserPlace, LocatedPose, Rays};

/// Frames that are measured.
const FRAMES: u32 = 200;
/// Frames between two images: ten images a second.
const FRAMES_PER_IMAGE: u32 = 3;
/// Frames between two changes of the map: five a second, as of the mapper.
const FRAMES_PER_CHANGE: u32 = 6;
/// Size of the window, in points.
const SIZE: [usize; 2] = [1280, 800];

const INPUTS: [&str; 14] = [
    "map",
    "map_updates",
    "pose",
    "scan",
    "odometry",
    "truth",
    "trajectory",
    "particles",
    "path",
    "image",
    "battery",
    "progress",
    "diagnostics",
    "goal",
];

fn full_console() -> Console {
    let mut console = Console { robot_radius_m: 0.2, ..Console::default() };
    for input in INPUTS {
        console.links.push(InputLink::new(input, format!("robot.{input}"), true));
    }
    let corner = Pose2::new(-20.0, -20.0, 0.0);
    let layout = MapLayout { corner, resolution_m: 0.05, width: 800, height: 800 };
    let cells = (0..640_000).map(|n| if n % 97 == 0 { 100 } else { 0 }).collect();
    console.scene.map.replace(0.0, layout, cells).unwrap();
    console.mission = Some(MissionState {
        name: "survey".into(),
        stage: "playing".into(),
        places: vec!["explore".into()],
        is_running: true,
        ..MissionState::default()
    });
    let charge = Some(0.7);
    console.readings.store(BatteryReading { charge, volts: Some(12.1), is_charging: false });
    let trajectory =
        (0..5000).map(|n| Pose2::new(f64::from(n) * 0.002, (f64::from(n) * 0.01).sin(), 0.0));
    console.scene.set_trajectory(0.0, trajectory.collect::<Vec<_>>().into_iter());
    let path = (0..300).map(|n| Pose2::new(f64::from(n) * 0.03, 1.0, 0.0));
    console.scene.set_path(path.collect::<Vec<_>>().into_iter());
    console
}

/// Everything that arrives between two frames.
fn change(console: &mut Console, frame: u32) -> ClockTimes {
    let at_s = f64::from(frame) / 30.0;
    let now = ClockTimes { host_s: at_s, system_s: at_s };
    let scene = &mut console.scene;
    let pose = Pose2::new(at_s, 0.0, at_s);
    let located = LocatedPose { stamp_s: at_s, pose, covariance_m2: [0.02, 0.0, 0.01] };
    scene.set_located(located).unwrap();
    scene.add_odometry(at_s, pose, (0.5, 0.1)).unwrap();
    scene.add_truth(at_s, pose).unwrap();
    let ranges_m = vec![4.0; 720];
    let rays = Rays {
        stamp_s: at_s,
        first_rad: -3.0,
        step_rad: 0.008,
        range_m: [0.1, 10.0],
        ranges_m: &ranges_m,
    };
    scene.robot_from_laser = LaserPlace::Known(Pose2::IDENTITY);
    scene.set_scan(&rays).unwrap();
    scene.set_particles(vec![Pose2::IDENTITY; 200].into_iter());
    if frame.is_multiple_of(FRAMES_PER_IMAGE) {
        let rgb = vec![(frame % 255) as u8; 320 * 240 * 3];
        scene.set_photo(Photo { size: [320, 240], rgb });
    }
    if frame.is_multiple_of(FRAMES_PER_CHANGE) {
        let corner = [(frame % 600) as usize, 300];
        let cells = vec![(frame % 100) as i8; 100 * 100];
        let change = MapChange { stamp_s: at_s, corner, size: [100, 100], cells };
        scene.map.change(change).unwrap();
    }
    let number = SequenceNumber { instance: 1, sequence: frame.into() };
    for input in INPUTS {
        console.record_arrival(input, now, at_s, number, Ok(()));
    }
    now
}

fn cpu_ms() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

#[test]
#[ignore = "a measurement: it prints"]
fn cost_of_frames_with_everything_linked() {
    let context = Context::default();
    apply_theme(&context);
    let mut stage = Stage::new(context, SIZE[0], SIZE[1], 1.0);
    let mut screen = Screen::new(crate::ports::make_panels());
    let mut console = full_console();
    let mut first = Vec::new();
    let mut costs = Vec::new();
    for frame in 0..2 * FRAMES {
        let now = change(&mut console, frame);
        let start = cpu_ms();
        stage.frame(Vec::new(), |ui| {
            screen.show_frame(ui, &mut console, now);
        });
        stage.triangles();
        let cost = cpu_ms() - start;
        if frame == 0 {
            first.push(cost);
        } else if frame >= FRAMES {
            costs.push(cost);
        }
    }
    costs.sort_by(f64::total_cmp);
    let share = |share: f64| costs[((costs.len() - 1) as f64 * share) as usize];
    let (p50, p95, longest) = (share(0.5), share(0.95), share(1.0));
    println!("CPU time per frame in ms, {FRAMES} frames of {SIZE:?}:");
    println!("first {:.1}, p50 {p50:.2}, p95 {p95:.2}, longest {longest:.2}", first[0]);
}
