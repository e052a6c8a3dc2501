//! Maps real logs and measures the result against relations between poses that are known: mean
//! absolute errors, as in Kümmerle et al., Autonomous Robots 27, 2009.
//!
//! Prints the figures (`--nocapture`); writes maps as PNG into the folder `ARMOR_MAPS`, if set.

// A test that cannot go on may panic.
#![allow(clippy::unwrap_used)]

use armor_carmen_player::log::Log;
use armor_carmen_player::record::{self, Record};
use armor_grid_mapper::mapper::{Config, Estimate, Mapper};
use armor_grid_mapper::pose::Pose;
use armor_grid_mapper::scan::Scan;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Folder with `laser/`; without `ARMOR_DATA` the tests are skipped, except under CI.
fn laser_logs() -> Option<PathBuf> {
    let data = std::env::var_os("ARMOR_DATA");
    assert!(data.is_some() || std::env::var_os("CI").is_none(), "ARMOR_DATA is not set");
    data.map(|folder| PathBuf::from(folder).join("laser"))
}

fn scans(path: &Path) -> Vec<(Pose, Scan)> {
    let scan = |scan: record::Scan| {
        let odometry = Pose::new(scan.odometry.x_m, scan.odometry.y_m, scan.odometry.yaw_rad);
        let sweep = Scan {
            stamp_s: scan.stamp_s,
            angle_min_rad: scan.beams.angle_min_rad,
            increment_rad: scan.beams.increment_rad,
            range_min_m: 0.02,
            range_max_m: 50.0,
            ranges_m: scan.ranges_within(50.0),
        };
        (odometry, sweep)
    };
    let records = Log::open(path).unwrap().map(Result::unwrap);
    let found = records.filter_map(|r| if let Record::Scan(s) = r { Some(scan(s)) } else { None });
    found.collect()
}

/// Mean absolute errors over relations: metres, degrees, and how many there were.
#[derive(Debug, Default)]
struct Errors {
    metres: f64,
    degrees: f64,
    count: usize,
}

fn errors(poses: &[Pose], relations: &Path, kind: &str) -> Errors {
    let text = std::fs::read_to_string(relations).unwrap();
    let mut sum = Errors::default();
    for line in text.lines().skip(1) {
        let fields: Vec<_> = line.split(',').collect();
        if fields[2] != kind {
            continue;
        }
        let index = |i: usize| fields[i].parse::<usize>().unwrap();
        let number = |i: usize| fields[i].parse::<f64>().unwrap();
        let truth = Pose::new(number(3), number(4), number(5));
        let error = truth.inverse() * (poses[index(0)].inverse() * poses[index(1)]);
        sum.metres += error.x_m.hypot(error.y_m);
        sum.degrees += error.yaw_rad.abs().to_degrees();
        sum.count += 1;
    }
    let count = sum.count as f64;
    Errors { metres: sum.metres / count, degrees: sum.degrees / count, ..sum }
}

fn write_map(mapper: &Mapper, poses: &[Pose], path: &Path) {
    let map = mapper.snapshot();
    let shade = |&cell: &i8| if cell < 0 { 160 } else { 255 - (f64::from(cell) * 2.5) as u8 };
    let mut pixels: Vec<[u8; 3]> = map.cells.iter().map(|c| [shade(c); 3]).collect();
    for pose in poses {
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

/// Bounds on the mean errors: `next` metres and degrees, `revisit` metres and degrees.
fn check(name: &str, bounds: [f64; 4]) {
    let Some(folder) = laser_logs() else {
        println!("skipped: ARMOR_DATA is not set");
        return;
    };
    let scans = scans(&folder.join(format!("{name}.log.gz")));
    let mut mapper = Mapper::new(Config::default());
    let begun = Instant::now();
    let estimates: Vec<Estimate> =
        scans.iter().map(|(odom, scan)| mapper.add(*odom, scan)).collect();
    let seconds = begun.elapsed().as_secs_f64();
    let poses: Vec<Pose> = estimates.iter().map(|estimate| estimate.pose).collect();
    let relations = folder.join(format!("{name}.relations.csv"));
    let (next, revisit) =
        (errors(&poses, &relations, "next"), errors(&poses, &relations, "revisit"));
    println!(
        "{name:>13}: next {:.3} m {:.2} deg, revisit {:.3} m {:.2} deg; {} drawn of {}, {seconds:.1} s",
        next.metres,
        next.degrees,
        revisit.metres,
        revisit.degrees,
        estimates.iter().filter(|e| e.drawn).count(),
        poses.len(),
    );
    if let Some(maps) = std::env::var_os("ARMOR_MAPS") {
        write_map(&mapper, &poses, &PathBuf::from(maps).join(format!("{name}.png")));
    }
    let found = [next.metres, next.degrees, revisit.metres, revisit.degrees];
    assert!(found.iter().zip(bounds).all(|(f, b)| *f <= b), "{name}: {found:?} beyond {bounds:?}");
}

#[test]
fn intel() {
    check("intel", [0.05, 0.8, 0.1, 1.0]);
}

#[test]
fn aces() {
    check("aces", [0.06, 0.6, 1.5, 4.0]);
}

#[test]
fn freiburg_079() {
    check("freiburg-079", [0.04, 0.8, 0.15, 1.2]);
}

#[test]
fn edmonton() {
    check("edmonton", [0.08, 0.6, 0.12, 0.8]);
}

#[test]
fn acapulco() {
    check("acapulco", [0.09, 0.6, 0.25, 0.9]);
}
