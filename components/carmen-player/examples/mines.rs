//! Writes a log of the rover of Mines ParisTech (Steux and El Hamzaoui, *tinySLAM*, ICARCV 2010) as
//! a CARMEN log: `mines mines-exp2.dat.gz > mines.log`. A line has microseconds, ticks of the left
//! and the right wheel, and from column 24 on 682 ranges in millimetres over 240 degrees.

use anyhow::{Context, Result};
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};

const WHEEL_M: f64 = 0.077;
const HALF_AXLE_M: f64 = 0.165;
/// Ticks of a whole turn of a wheel. With twice as many, as some read them, the room is not square
/// and the scans see twice the distance.
const TICKS: f64 = 2000.0;
const LASER_AHEAD_M: f64 = 0.145;
const RANGES: std::ops::Range<usize> = 24..24 + 682;
/// Readings at either side that see the rover itself.
const BLIND: usize = 70;
const FIELD_DEG: f64 = 240.0;
const RANGE_MAX_M: f64 = 5.6;

fn main() -> Result<()> {
    let path = std::env::args().nth(1).context("which file?")?;
    let file = File::open(&path).with_context(|| path.clone())?;
    let mut out = std::io::stdout().lock();
    let mut rover = Rover::default();
    for line in BufReader::new(MultiGzDecoder::new(BufReader::new(file))).lines() {
        let line = line?;
        let numbers: Option<Vec<f64>> = line.split_whitespace().map(|n| n.parse().ok()).collect();
        let numbers = numbers.filter(|n| n.len() >= RANGES.end);
        let numbers = numbers.with_context(|| format!("{path}: no numbers in `{line}`"))?;
        rover.drive([numbers[2], numbers[3]]);
        writeln!(out, "{}", rover.scan(numbers[0] * 1e-6, &numbers[RANGES]))?;
    }
    Ok(())
}

/// Where the middle of the axle is, by its wheels.
#[derive(Default)]
struct Rover {
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
    ticks: Option<[f64; 2]>,
}

impl Rover {
    fn drive(&mut self, ticks: [f64; 2]) {
        let before = self.ticks.replace(ticks).unwrap_or(ticks);
        let metres =
            |wheel: usize| (ticks[wheel] - before[wheel]) / TICKS * std::f64::consts::TAU * WHEEL_M;
        let (left_m, right_m) = (metres(0), metres(1));
        let (way_m, turn_rad) =
            ((left_m + right_m) / 2.0, (right_m - left_m) / (2.0 * HALF_AXLE_M));
        let (sin, cos) = (self.yaw_rad + turn_rad / 2.0).sin_cos();
        self.x_m += way_m * cos;
        self.y_m += way_m * sin;
        self.yaw_rad += turn_rad;
    }

    /// A ROBOTLASER1 line; the pose is the laser's, so that the mapper need not know where it sits.
    fn scan(&self, stamp_s: f64, ranges_mm: &[f64]) -> String {
        let (sin, cos) = self.yaw_rad.sin_cos();
        let (x_m, y_m) = (self.x_m + LASER_AHEAD_M * cos, self.y_m + LASER_AHEAD_M * sin);
        let pose = format!("{x_m:.5} {y_m:.5} {:.6}", self.yaw_rad);
        let field_rad = FIELD_DEG.to_radians();
        let range = |(number, &mm): (usize, &f64)| {
            let is_blind = number < BLIND || number >= ranges_mm.len() - BLIND;
            if is_blind || mm < 20.0 { "nan".into() } else { format!("{:.3}", mm / 1000.0) }
        };
        let ranges: Vec<String> = ranges_mm.iter().enumerate().map(range).collect();
        let (count, begin_rad) = (ranges.len(), -field_rad / 2.0);
        let step_rad = field_rad / (count - 1) as f64;
        format!(
            "ROBOTLASER1 0 {begin_rad:.6} {field_rad:.6} {step_rad:.8} {RANGE_MAX_M} 0.01 0 {count} {} \
             0 {pose} {pose} 0 0 0 0 0 {stamp_s:.6} mines {stamp_s:.6}",
            ranges.join(" ")
        )
    }
}
