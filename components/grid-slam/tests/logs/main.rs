//! Maps real logs and measures the result against relations between poses that are known: mean
//! absolute errors, as in Kümmerle et al., Autonomous Robots 27, 2009.
//!
//! Prints the figures (`--nocapture`); writes maps as PNG and time and memory per scan as CSV into
//! the folder `ARMOR_MAPS`, if set. `ARMOR_PARTICLES` and `ARMOR_SEED` replace the defaults.

// A test that cannot continue may panic.
#![allow(clippy::unwrap_used)]

mod killed;
mod pairs;
mod recorded;
mod worse;

use armor_evaluation::relations::{judge_relations, summarize_by_kind};
use armor_evaluation::trajectory::ScanTrajectory;
use armor_grid_slam::config::Config;
use armor_grid_slam::slam::Slam;
use recorded::{Recorded, recorded};
use rustix::time::{ClockId, clock_gettime};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn write_map(mapper: &Slam, poses: &ScanTrajectory, path: &Path) {
    let map = mapper.snapshot();
    let shade = |&cell: &i8| if cell < 0 { 160 } else { 255 - (f64::from(cell) * 2.5) as u8 };
    let mut pixels: Vec<[u8; 3]> = map.cells.iter().map(|c| [shade(c); 3]).collect();
    for (_, pose) in poses.values() {
        let column = ((pose.x_m - map.origin.x_m) / map.resolution_m) as usize;
        let row = ((pose.y_m - map.origin.y_m) / map.resolution_m) as usize;
        pixels[row * map.width + column] = [220, 40, 40];
    }
    let rows = pixels.chunks(map.width).rev();
    let bytes: Vec<u8> = rows.flatten().flatten().copied().collect();
    let file = std::fs::File::create(path).unwrap();
    let mut encoder = png::Encoder::new(file, map.width as u32, map.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

/// Processor time of this process until now, seconds: more reliable than the clock on a shared
/// machine.
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Maps a log; gives all poses, the map, and a line for each scan: seconds it took, tiles in
/// memory.
fn mapped(scans: &[Recorded], config: Config) -> (ScanTrajectory, Slam, String) {
    let mut slam = Slam::new(config);
    let mut curve =
        String::from("scan,seconds,cpu_seconds,tiles,tiles_unshared,effective,closures\n");
    for Recorded { number, odometry, scan } in scans {
        let (begun, before_s) = (Instant::now(), cpu_s());
        let estimate = slam.add(*odometry, scan);
        let (seconds, cpu_s) = (begun.elapsed().as_secs_f64(), cpu_s() - before_s);
        let ((own, all), effective, closures) = (slam.tiles(), estimate.effective, slam.closures());
        writeln!(curve, "{number},{seconds:.6},{cpu_s:.6},{own},{all},{effective:.2},{closures}")
            .unwrap();
    }
    (recorded::numbered(scans, &slam), slam, curve)
}

/// The default configuration, with ARMOR_PARTICLES and ARMOR_SEED instead of its particles and seed
/// if they are set.
fn config() -> Config {
    let asked = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let default = Config::default();
    let particles = asked("ARMOR_PARTICLES").map_or(default.particles, |count| count as usize);
    Config { particles, seed: asked("ARMOR_SEED").unwrap_or(default.seed), ..default }
}

/// Bounds on the mean errors: `next` metres and degrees, `revisit` metres and degrees.
fn check(name: &str, bounds: [f64; 4]) {
    let Some((scans, relations)) = recorded(name) else { return };
    let (begun, before_s) = (Instant::now(), cpu_s());
    let (poses, slam, curve) = mapped(&scans, config());
    let processor_s = cpu_s() - before_s;
    let (seconds, span) = (begun.elapsed().as_secs_f64(), poses.values().map(|(stamp, _)| *stamp));
    let recorded_s = span.clone().fold(f64::MIN, f64::max) - span.fold(f64::MAX, f64::min);
    let kinds = summarize_by_kind(&judge_relations(&poses, &relations).unwrap());
    let found = ["next", "revisit"].map(|kind| [kinds[kind].metres.mean, kinds[kind].degrees.mean]);
    println!(
        "{name:>13}: next {:.4} m {:.3} deg, revisit {:.4} m {:.3} deg; {} closures, \
         {} of {} tiles, {seconds:.1} s ({processor_s:.1} s of processor time), \
         {:.0} times as fast as recorded",
        found[0][0],
        found[0][1],
        found[1][0],
        found[1][1],
        slam.closures(),
        slam.tiles().0,
        slam.tiles().1,
        recorded_s / seconds,
    );
    if let Some(maps) = std::env::var_os("ARMOR_MAPS").map(PathBuf::from) {
        write_map(&slam, &poses, &maps.join(format!("{name}.png")));
        std::fs::write(maps.join(format!("{name}.curve.csv")), curve).unwrap();
    }
    let found = found.concat();
    assert!(found.iter().zip(bounds).all(|(f, b)| *f <= b), "{name}: {found:?} beyond {bounds:?}");
}

#[test]
fn intel() {
    check("intel", [0.04, 0.6, 0.07, 0.7]);
}

#[test]
fn aces() {
    check("aces", [0.05, 0.5, 0.09, 0.6]);
}

#[test]
fn freiburg_079() {
    check("freiburg-079", [0.03, 0.7, 0.08, 0.9]);
}

#[test]
fn edmonton() {
    check("edmonton", [0.06, 0.5, 0.08, 0.5]);
}

#[test]
fn acapulco() {
    check("acapulco", [0.07, 0.4, 0.15, 0.6]);
}
