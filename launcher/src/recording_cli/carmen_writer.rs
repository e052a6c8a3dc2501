//! Writes a log of CARMEN: the scans and the odometry of a recording, as lines of text.

use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use armor_recording::{CopiedPart, LeftOutMessages, RecordedOutput, Recording};
use armor_sdk::messages::{LaserScan, Odometry, Quaternion};
use armor_wire::message::Message;

use super::convert::create;

/// What a log has as the host that has recorded a line.
const HOST: &str = "armor";
/// A laser that is of no type of CARMEN's table.
const OTHER_LASER: u32 = 99;

/// Where the robot was by its odometry, and how it moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct OdometryReading {
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
    speed_mps: f64,
    turn_radps: f64,
}

/// Writes the scans of one output, each with the odometry of that time, and the odometry. Returns how
/// many messages were written.
///
/// # Errors
/// If the recording cannot be read, or does not have one output with scans and at most one with
/// odometry; `part` chooses them.
pub fn write_carmen(
    file: &Path,
    copy: &Path,
    part: &CopiedPart,
) -> Result<(u64, LeftOutMessages, u64)> {
    let mut recording = Recording::open(file)?;
    let chosen: Vec<_> =
        recording.summary().outputs.iter().filter(|it| part.outputs.holds(&it.data)).collect();
    let shown = file.display();
    let scans = only_output::<LaserScan>(&chosen)?.ok_or_else(|| {
        anyhow!(
            "{shown} has no LaserScan there: a log of CARMEN is scans of a laser, with odometry"
        )
    })?;
    let moves = only_output::<Odometry>(&chosen)?;
    let mut sink = create(copy)?;
    writeln!(sink, "# CARMEN Logfile")?;
    writeln!(sink, "# {shown}: {scans}, and {}", moves.as_deref().unwrap_or("no odometry"))?;
    let begin_s = recording.summary().begin_s().unwrap_or_default();
    let (mut reading, mut written) = (OdometryReading::default(), 0);
    let mut left_out = LeftOutMessages::default();
    while let Some(message) = recording.next_message()? {
        let stamp_s = message.head.stamp_s;
        if part.to_s.is_some_and(|to_s| stamp_s >= to_s) {
            continue;
        }
        let is_before = part.from_s.is_some_and(|from_s| stamp_s < from_s);
        let logged_s = (stamp_s - begin_s).max(0.0);
        let written_now = if message.data == scans && !is_before {
            let scan = message.decode_as::<LaserScan>();
            scan.and_then(|scan| write_scan(&mut sink, &scan, &reading, logged_s))
        } else if moves.as_deref() == Some(&message.data) {
            message.decode_as::<Odometry>().and_then(|odometry| {
                reading = OdometryReading::of(&odometry);
                if is_before {
                    return Ok(false);
                }
                write_odometry(&mut sink, odometry.stamp, &reading, logged_s)
            })
        } else {
            continue;
        };
        match written_now {
            Ok(is_written) => written += u64::from(is_written),
            Err(reason) => left_out.add(&message.data, &reason),
        }
    }
    finish(sink).with_context(|| copy.display().to_string())?;
    Ok((written, left_out, recording.damaged_chunks()))
}

fn finish(sink: BufWriter<std::fs::File>) -> std::io::Result<()> {
    sink.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()
}

/// The only one of these outputs that has this type.
fn only_output<T: Message>(outputs: &[&RecordedOutput]) -> Result<Option<String>> {
    let schema = T::schema().to_string();
    let found: Vec<_> = outputs.iter().filter(|it| it.schema == schema).collect();
    if let [_, _, ..] = &found[..] {
        let names: Vec<_> = found.iter().map(|it| it.data.as_str()).collect();
        bail!(
            "{} are {}: a log of CARMEN has one; choose with --data",
            names.join(" and "),
            T::NAME
        );
    }
    Ok(found.first().map(|it| it.data.clone()))
}

/// Writes a scan; `Err` if it has no lines in such a log.
fn write_scan(
    sink: &mut impl Write,
    scan: &LaserScan,
    reading: &OdometryReading,
    logged_s: f64,
) -> Result<bool, String> {
    let ranges = scan.ranges.iter().copied();
    let mut ranges: Vec<f32> = ranges
        .map(
            |range_m| {
                if range_m.is_finite() { range_m.min(scan.range_max) } else { scan.range_max }
            },
        )
        .collect();
    if ranges.is_empty() || !scan.range_max.is_finite() {
        return Err("it has no ranges, or no largest one".into());
    }
    let mut start_rad = f64::from(scan.angle_min);
    let step_rad = f64::from(scan.angle_increment);
    let field_rad = step_rad * (ranges.len() - 1) as f64;
    if step_rad < 0.0 {
        // Such a log has the beam at the right first.
        ranges.reverse();
        start_rad += field_rad;
    }
    let mut line = format!(
        "ROBOTLASER1 {OTHER_LASER} {start_rad} {} {} {} 0 0 {}",
        field_rad.abs(),
        step_rad.abs(),
        scan.range_max,
        ranges.len()
    );
    for range_m in ranges {
        line += &format!(" {range_m}");
    }
    let OdometryReading { x_m, y_m, yaw_rad, speed_mps, turn_radps } = reading;
    let pose = format!("{x_m} {y_m} {yaw_rad}");
    // No remissions; the laser where the robot is; no distances of safety.
    line += &format!(" 0 {pose} {pose} {speed_mps} {turn_radps} 0 0 0");
    write_line(sink, &line, scan.stamp, logged_s)
}

fn write_odometry(
    sink: &mut impl Write,
    stamp_s: f64,
    reading: &OdometryReading,
    logged_s: f64,
) -> Result<bool, String> {
    let OdometryReading { x_m, y_m, yaw_rad, speed_mps, turn_radps } = reading;
    let line = format!("ODOM {x_m} {y_m} {yaw_rad} {speed_mps} {turn_radps} 0");
    write_line(sink, &line, stamp_s, logged_s)
}

fn write_line(
    sink: &mut impl Write,
    line: &str,
    stamp_s: f64,
    logged_s: f64,
) -> Result<bool, String> {
    writeln!(sink, "{line} {stamp_s} {HOST} {logged_s}").map_err(|error| error.to_string())?;
    Ok(true)
}

impl OdometryReading {
    fn of(odometry: &Odometry) -> Self {
        let (pose, twist) = (&odometry.pose.pose, &odometry.twist.twist);
        Self {
            x_m: pose.position.x,
            y_m: pose.position.y,
            yaw_rad: yaw_of(&pose.orientation),
            speed_mps: twist.linear.x,
            turn_radps: twist.angular.z,
        }
    }
}

/// The heading of an orientation.
fn yaw_of(turn: &Quaternion) -> f64 {
    let across = 2.0 * (turn.w * turn.z + turn.x * turn.y);
    across.atan2(1.0 - 2.0 * (turn.y * turn.y + turn.z * turn.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line_of(scan: &LaserScan) -> Result<String, String> {
        let reading = OdometryReading { x_m: 1.0, yaw_rad: 0.5, ..OdometryReading::default() };
        let mut sink = Vec::new();
        write_scan(&mut sink, scan, &reading, 0.25)?;
        Ok(String::from_utf8(sink).expect("text"))
    }

    #[test]
    fn a_scan_is_a_line_with_the_beam_at_the_right_first() {
        let mut scan = LaserScan {
            stamp: 7.5,
            angle_min: -1.0,
            angle_increment: 1.0,
            range_max: 20.0,
            ranges: vec![1.5, f32::INFINITY, 30.0].into(),
            ..LaserScan::default()
        };
        let expected =
            "ROBOTLASER1 99 -1 2 1 20 0 0 3 1.5 20 20 0 1 0 0.5 1 0 0.5 0 0 0 0 0 7.5 armor 0.25\n";
        assert_eq!(line_of(&scan).as_deref(), Ok(expected));
        (scan.angle_min, scan.angle_increment) = (1.0, -1.0);
        let turned = line_of(&scan).expect("a line");
        assert!(turned.starts_with("ROBOTLASER1 99 -1 2 1 20 0 0 3 20 20 1.5"), "{turned}");
        scan.ranges = Vec::new().into();
        assert!(line_of(&scan).is_err());
    }
}
