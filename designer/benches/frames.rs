//! What a frame of the window costs, in CPU time of the thread that draws it: the whole window, its
//! shapes and their triangles, at 1920 × 1080, without a GPU. `cargo bench -p armor-designer
//! --bench frames`.

#[path = "../tests/ui/still_system.rs"]
mod still_system;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use armor_designer::export::Stage;
use armor_designer::{Command, Designer, Kinds, Settings, Start, View};
use armor_inspect::{MissionLook, ParameterClient};
use armor_marking::{MarkedPlace, Marking};
use armor_picture::canvas::RgbCanvas;
use armor_sdk::configuration::ParameterList;
use armor_sdk::messages::{
    Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, TrackedObject, Tracks,
    Vector3,
};
use armor_wire::manifest::{Manifest, PortManifest};
use eframe::egui::{
    Context, Event, Modifiers, MouseWheelSource, MouseWheelUnit, Pos2, TouchPhase, Vec2,
};
use rustix::time::{ClockId, clock_gettime};
use still_system::{playing, radar};

/// Blocks and links of the large robot.
const BLOCKS: usize = 1000;
const LINKS: usize = 1500;
/// Places of the large mission, with as many transitions.
const PLACES: usize = 500;
/// What is drawn on the large map.
const ROUTES: usize = 8;
const LEGS: usize = 50;
const SYMBOLS: usize = 1000;
/// Pixels of each side of the picture beneath it, a quarter of a metre each.
const PICTURE: usize = 4000;
/// What is watched on it: the tracks of others, and the poses of each robot's trail.
const TRACKS: usize = 200;
const TRAIL: usize = 300;
/// Frames that are measured, after as many that are not.
const FRAMES: usize = 200;

fn main() {
    let folder = std::env::temp_dir().join(format!("armor-frames-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    println!("CPU time per frame in ms, {FRAMES} frames of 1920 x 1080");
    println!("{:52} {:>6} {:>6} {:>6} {:>10}", "", "p50", "p95", "max", "triangles");
    let robot = folder.join("robot.xml");
    std::fs::write(&robot, a_robot()).expect("written");
    measure(&format!("{BLOCKS} blocks, {LINKS} links"), robot, View::System, None);
    let mission = folder.join("mission.xml");
    std::fs::write(&mission, a_mission()).expect("written");
    measure(&format!("{PLACES} places, {PLACES} transitions"), mission, View::Mission, None);
    write_picture(&folder);
    let map = folder.join("map.xml");
    std::fs::write(&map, a_map()).expect("written");
    let name = format!("{ROUTES} routes of {LEGS} legs, {SYMBOLS} symbols");
    measure(&name, map.clone(), View::Map, None);
    measure(&format!("{name}, times"), map.clone(), View::Map, Some(Command::ToggleTimes));
    measure_live(&format!("{name}, live"), map);
    let _ = std::fs::remove_dir_all(&folder);
}

/// One file in one view, after a command: all of it and at actual size, at rest and moving.
fn measure(name: &str, file: PathBuf, view: View, first: Option<Command>) {
    let context = Context::default();
    let (mut designer, mut stage) = open(&context, file, view);
    if let Some(first) = first {
        designer.run(first, &context);
        stage.settle(FRAMES, |ui| designer.show(ui));
        // What a thread computes is shown from the next frame on.
        std::thread::sleep(Duration::from_secs(2));
    }
    measure_views(name, &context, (&mut designer, &mut stage), &mut |_| {});
    // Until the tip for what is under the pointer has come up.
    stage.settle(60, |ui| designer.show(ui));
    let next = stage.next_frame();
    println!("{:52} {}", format!("{name}, nothing happens"), frame_rate(next));
}

fn open(context: &Context, file: PathBuf, view: View) -> (Designer, Stage) {
    let start = Start { file: Some(file), view, kinds: Some(kinds()), ..Start::default() };
    let mut designer = Designer::new(context, start, Settings::default());
    designer.workspace().project.settle();
    let stage = Stage::new(context.clone(), 1920, 1080, 1.0);
    (designer, stage)
}

/// The map with a robot on each route, its trail, and tracks; all robots have moved before each frame.
fn measure_live(name: &str, file: PathBuf) {
    let context = Context::default();
    let (mut designer, mut stage) = open(&context, file, View::Map);
    let parameters = ParameterClient::still(
        ParameterList { version: 1, refused: false, parameters: Vec::new() },
        None,
    );
    let live = &mut designer.workspace().live;
    live.show_still(radar(), MissionLook::of(a_marking()), parameters).expect("a thread");
    designer.run(Command::ToggleProgress, &context);
    let mut step = 0;
    let mut drive = |designer: &mut Designer| {
        step += 1;
        let live = &designer.workspace().live;
        let values = &live.watched().expect("a system").values;
        for route in 0..ROUTES {
            values.show_still(&format!("eye{route}.pose"), &a_pose(route, step));
        }
        values.show_still("radar.tracks", &some_tracks(step));
    };
    for _ in 0..TRAIL {
        drive(&mut designer);
        stage.frame(Vec::new(), |ui| designer.show(ui));
    }
    measure_views(name, &context, (&mut designer, &mut stage), &mut drive);
}

fn measure_views(
    name: &str,
    context: &Context,
    (designer, stage): (&mut Designer, &mut Stage),
    before_each: &mut dyn FnMut(&mut Designer),
) {
    for (zoom, command) in [("all of it", Command::ZoomFit), ("actual size", Command::ZoomActual)] {
        designer.run(command, context);
        stage.settle(FRAMES, |ui| designer.show(ui));
        // Tiles are decoded on threads, and shown from the next frame on.
        std::thread::sleep(Duration::from_secs(2));
        stage.settle(FRAMES, |ui| designer.show(ui));
        report(&format!("{name}, {zoom}, at rest"), || {
            before_each(designer);
            stage.frame(Vec::new(), |ui| designer.show(ui));
            stage.triangles()
        });
        let mut way = 0.0_f32;
        report(&format!("{name}, {zoom}, moving"), || {
            way += 0.2;
            before_each(designer);
            stage.frame(moving(way), |ui| designer.show(ui));
            stage.triangles()
        });
    }
}

/// The view is moved about as two fingers on a trackpad do, under the pointer.
fn moving(way: f32) -> Vec<Event> {
    let at = Pos2::new(960.0 + 100.0 * way.cos(), 540.0 + 100.0 * way.sin());
    vec![
        Event::PointerMoved(at),
        Event::MouseWheel {
            unit: MouseWheelUnit::Point,
            delta: Vec2::new(8.0 * way.cos(), 8.0 * way.sin()),
            phase: TouchPhase::Move,
            source: MouseWheelSource::Unknown,
            modifiers: Modifiers::NONE,
        },
    ]
}

fn report(what: &str, mut frame: impl FnMut() -> usize) {
    let mut triangles = 0;
    let mut costs: Vec<Duration> = (0..FRAMES)
        .map(|_| {
            let before = cpu_time();
            triangles = frame();
            cpu_time() - before
        })
        .collect();
    costs.sort();
    let at = |share: usize| costs[(FRAMES - 1) * share / 100].as_secs_f64() * 1e3;
    println!("{what:52} {:6.2} {:6.2} {:6.2} {triangles:10}", at(50), at(95), at(100));
}

/// Of this thread alone: others of the machine do not count.
fn cpu_time() -> Duration {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    let (seconds, nanoseconds) = (u64::try_from(now.tv_sec), u32::try_from(now.tv_nsec));
    Duration::new(seconds.unwrap_or_default(), nanoseconds.unwrap_or_default())
}

fn frame_rate(next: Duration) -> String {
    if next == Duration::MAX {
        "no frame is drawn".to_owned()
    } else {
        format!("a frame every {next:?}")
    }
}

/// A kind with three inputs and three outputs of one type.
fn kinds() -> Kinds {
    let port = |id: String| PortManifest {
        id,
        type_name: "Scan".into(),
        schema: "Scan{value:f64}".into(),
        schema_hash: 1,
        doc: String::new(),
        required: false,
        many: false,
        latched: false,
        stale_after: String::new(),
    };
    let kind = Manifest {
        armor_manifest: 1,
        kind: "block".into(),
        summary: "Takes and gives.".into(),
        controllable: true,
        protocol: None,
        reports_done: true,
        ends_by_itself: false,
        needs_rate: false,
        reads_all: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
        inputs: (0..3).map(|n| port(format!("in{n}"))).collect(),
        outputs: (0..3).map(|n| port(format!("out{n}"))).collect(),
        parameters: Vec::new(),
        events: None,
    };
    Kinds::of([kind], "stock")
}

/// Blocks in rows of forty, each linked to the next and to one of the next row.
fn a_robot() -> String {
    let mut out = String::from("<armor version=\"1\">\n  <system name=\"large\">\n");
    let mut blocks = String::new();
    for n in 0..BLOCKS {
        let _ = writeln!(out, "    <component name=\"block-{n}\" kind=\"block\"/>");
        let (x, y) = (n % 40 * 240, n / 40 * 160);
        let _ = writeln!(blocks, "      <block of=\"block-{n}\" x=\"{x}\" y=\"{y}\"/>");
    }
    for n in 0..LINKS {
        let (from, to) = match n {
            0..BLOCKS => (n, (n + 1) % BLOCKS),
            _ => (n - BLOCKS, (n - BLOCKS + 41) % BLOCKS),
        };
        let port = n / BLOCKS;
        let _ =
            writeln!(out, "    <link from=\"block-{from}.out{port}\" to=\"block-{to}.in{port}\"/>");
    }
    let _ = write!(out, "    <layout>\n{blocks}    </layout>\n  </system>\n</armor>\n");
    out
}

/// A ring of places.
fn a_mission() -> String {
    let mut out = String::from(
        "<armor version=\"1\">\n  <system name=\"small\">\n    <component name=\"block\" \
         kind=\"block\"/>\n  </system>\n  <mission name=\"large\" goal=\"place-0\" safe=\"place-1\">\n",
    );
    let mut blocks = String::new();
    for n in 0..PLACES {
        let initial = if n == 2 { " initial=\"true\"" } else { "" };
        let _ = writeln!(out, "    <place name=\"place-{n}\"{initial}/>");
        let (x, y) = (n % 25 * 300, n / 25 * 160);
        let _ = writeln!(blocks, "      <block of=\"place-{n}\" x=\"{x}\" y=\"{y}\"/>");
        let _ =
            writeln!(blocks, "      <block transition=\"go-{n}\" x=\"{}\" y=\"{y}\"/>", x + 150);
    }
    for n in 0..PLACES {
        let to = (n + 1) % PLACES;
        let _ = writeln!(
            out,
            "    <transition name=\"go-{n}\" from=\"place-{n}\" to=\"place-{to}\" timeout=\"{}s\"/>",
            n + 1
        );
    }
    let _ = write!(out, "    <layout>\n{blocks}    </layout>\n  </mission>\n</armor>\n");
    out
}

/// A picture that lies from 0 0 to 1000 1000.
fn write_picture(folder: &Path) {
    let mut picture = RgbCanvas::new(PICTURE, PICTURE, [230, 226, 214]);
    for number in 0..400 {
        let (x, y) = (number * 37 % 1000 * 4, number * 91 % 1000 * 4);
        let shade = 90 + (number % 120) as u8;
        picture.fill_rectangle(x, y, 120, 90, [shade, 160, 255 - shade]);
    }
    std::fs::write(folder.join("site.png"), picture.encode_png().expect("a picture"))
        .expect("written");
    std::fs::write(folder.join("site.pgw"), "0.25\n0\n0\n-0.25\n0.125\n999.875\n")
        .expect("written");
}

/// Routes in rows between zones, and symbols all over.
fn a_map() -> String {
    let mut out = String::from(
        "<armor version=\"1\">\n  <system name=\"small\">\n    <component name=\"block\" \
         kind=\"block\"/>\n  </system>\n  <mission name=\"large\" goal=\"over\" safe=\"hold\">\n    \
         <map picture=\"site.png\">\n",
    );
    for route in 0..ROUTES {
        for point in 0..=LEGS {
            let (x, y) = (point * 20, route * 100 + point % 2 * 15);
            let _ = writeln!(out, "      <point name=\"P{route}-{point}\" at=\"{x} {y}\"/>");
        }
        let y = route * 100 + 50;
        let shape = format!("0,{y} 1000,{y} 1000,{} 0,{}", y + 25, y + 25);
        let _ =
            writeln!(out, "      <zone name=\"zone{route}\" kind=\"no-go\" shape=\"{shape}\"/>");
        let _ = writeln!(out, "      <rally name=\"R{route}\" at=\"500 {}\"/>", route * 100 + 30);
    }
    for number in 0..SYMBOLS {
        let (x, y) = (number % 40 * 25, number / 40 * 32);
        let identity = number % 4 + 3;
        let _ =
            writeln!(out, "      <symbol at=\"{x} {y}\" sidc=\"100{identity}1000001211000000\"/>");
    }
    out += "    </map>\n";
    for route in 0..ROUTES {
        let _ = writeln!(
            out,
            "    <route name=\"r{route}\" mover=\"block.route\" pose=\"eye{route}.pose\" \
             start=\"P{route}-0\" out=\"over\">"
        );
        for leg in 1..=LEGS {
            let _ = writeln!(
                out,
                "      <leg name=\"l{leg}\" to=\"P{route}-{leg}\" speed=\"1m/s\" by=\"25s\"/>"
            );
        }
        out += "      <otherwise on=\"blocked\" do=\"rally\"/>\n    </route>\n";
    }
    out += "    <place name=\"over\"/>\n    <place name=\"hold\"/>\n  </mission>\n</armor>\n";
    out
}

/// Each robot is in its second leg.
fn a_marking() -> Marking {
    let place = |route| MarkedPlace {
        place: format!("r{route}.l2"),
        tokens: 1,
        active: true,
        waits_for: Vec::new(),
    };
    Marking { places: (0..ROUTES).map(place).collect(), ..playing("large", 25.0) }
}

/// Along the first legs of a route, with turns.
fn a_pose(route: usize, step: usize) -> PoseWithCovarianceStamped {
    let along = step as f64 / 10.0;
    let position =
        Point { x: along % 40.0, y: (route * 100) as f64 + 8.0 + 8.0 * along.sin(), z: 0.0 };
    let orientation = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
    let pose = PoseWithCovariance { pose: Pose { position, orientation }, ..Default::default() };
    PoseWithCovarianceStamped { frame: "map".into(), pose, ..Default::default() }
}

fn some_tracks(step: usize) -> Tracks {
    let track = |number: usize| TrackedObject {
        id: format!("t{number}"),
        sidc: format!("100{}1000001211000000", number % 4 + 3),
        position: Point {
            x: (number % 20 * 50) as f64 + step as f64 / 10.0,
            y: (number / 20 * 80) as f64,
            z: 0.0,
        },
        velocity: Vector3 { x: 3.0, y: 1.0, z: 0.0 },
        stamp: 0.0,
    };
    Tracks { stamp: 0.0, frame: "map".into(), tracks: (0..TRACKS).map(track).collect() }
}
