//! Reads one line of a CARMEN log. Nothing a line may hold makes it panic or allocate without
//! bound.

use crate::record::{Beams, LogRecord, Mount, RecordedOdometry, RecordedPose, RecordedScan};
use std::f64::consts::TAU;
use std::str::{FromStr, SplitAsciiWhitespace};
use thiserror::Error;

/// Most beams a scan may have: four times what the densest planar scanners send.
pub const MAX_BEAMS: usize = 16_384;

/// Why a line that begins like a known one cannot be understood.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum LineFault {
    /// The line ends before the named field.
    #[error("ends before {0}")]
    Missing(&'static str),
    /// The named field is not a finite number, or not a count where one is due.
    #[error("{field} is not a number: {text:?}")]
    NotANumber {
        /// What should have been there.
        field: &'static str,
        /// What was there, cut to 24 characters.
        text: String,
    },
    /// A scan states no beams, or more than [`MAX_BEAMS`].
    #[error("{0} beams (1 to {MAX_BEAMS} can be)")]
    BeamCount(usize),
    /// The geometry of a scan is not one a scanner can have.
    #[error("beams every {0} rad cannot be")]
    Geometry(String),
}

/// Reads a line: `Ok(None)` for comments, empty lines and messages of other kinds.
pub fn parse_line(line: &str) -> Result<Option<LogRecord>, LineFault> {
    let mut fields = LineFields(line.split_ascii_whitespace());
    let record = match fields.0.next() {
        Some("FLASER") => LogRecord::Scan(fields.old_laser(Mount::Front)?),
        Some("RLASER") => LogRecord::Scan(fields.old_laser(Mount::Rear)?),
        Some("ROBOTLASER1") => LogRecord::Scan(fields.robot_laser(Mount::Front)?),
        Some("ROBOTLASER2") => LogRecord::Scan(fields.robot_laser(Mount::Rear)?),
        Some("ODOM") => LogRecord::Odometry(fields.read_odometry()?),
        Some("PARAM") => LogRecord::Parameter(
            fields.read_text("parameter name")?,
            fields.read_text("parameter value")?,
        ),
        _ => return Ok(None),
    };
    Ok(Some(record))
}

/// Returns whether a line carries no data: empty, or a comment.
pub fn is_silent(line: &str) -> bool {
    let line = line.trim_start();
    line.is_empty() || line.starts_with('#')
}

struct LineFields<'a>(SplitAsciiWhitespace<'a>);

impl LineFields<'_> {
    /// `n r1…rn x y theta odom_x odom_y odom_theta ipc_timestamp …`
    fn old_laser(&mut self, mount: Mount) -> Result<RecordedScan, LineFault> {
        let ranges_m = self.read_counted("range")?;
        let laser = self.read_pose("laser pose")?;
        let odometry = self.read_pose("odometry")?;
        let stamp_s = self.read_finite("timestamp")?;
        let beams = Beams::half_circle(ranges_m.len());
        Ok(RecordedScan { stamp_s, mount, beams, ranges_m, laser, odometry })
    }

    /// `type start_angle field_of_view resolution max_range accuracy remission_mode n r1…rn m e1…em
    /// laser_pose robot_pose tv rv forward_safety side_safety turn_axis timestamp …`
    fn robot_laser(&mut self, mount: Mount) -> Result<RecordedScan, LineFault> {
        self.read_finite("laser type")?;
        let angle_min_rad = self.read_finite("start angle")?;
        let field_rad = self.read_finite("field of view")?;
        let resolution_rad = self.read_finite("angular resolution")?;
        let range_max_m = self.read_finite("maximum range")?;
        self.read_finite("accuracy")?;
        self.read_finite("remission mode")?;
        let ranges_m = self.read_counted("range")?;
        self.skip_remissions()?;
        let laser = self.read_pose("laser pose")?;
        let odometry = self.read_pose("robot pose")?;
        for field in ["speed", "turning speed", "forward safety", "side safety", "turn axis"] {
            self.read_finite(field)?;
        }
        let stamp_s = self.read_finite("timestamp")?;
        let increment_rad = choose_increment(resolution_rad, field_rad, ranges_m.len())?;
        let beams = Beams { angle_min_rad, increment_rad, range_max_m: Some(range_max_m) };
        Ok(RecordedScan { stamp_s, mount, beams, ranges_m, laser, odometry })
    }

    /// `x y theta tv rv accel ipc_timestamp …`
    fn read_odometry(&mut self) -> Result<RecordedOdometry, LineFault> {
        let pose = self.read_pose("odometry")?;
        let speed_mps = self.read_finite("speed")?;
        let turn_radps = self.read_finite("turning speed")?;
        self.read_finite("acceleration")?;
        Ok(RecordedOdometry {
            pose,
            speed_mps,
            turn_radps,
            stamp_s: self.read_finite("timestamp")?,
        })
    }

    fn read_counted(&mut self, field: &'static str) -> Result<Vec<f32>, LineFault> {
        let count: usize = self.read_number("number of readings")?;
        if count == 0 || count > MAX_BEAMS {
            return Err(LineFault::BeamCount(count));
        }
        // A reading may be "nan" or "inf": the scanner's value for a beam without an echo.
        (0..count).map(|_| self.read_number(field)).collect()
    }

    fn skip_remissions(&mut self) -> Result<(), LineFault> {
        let count: usize = self.read_number("number of remissions")?;
        if count > MAX_BEAMS {
            return Err(LineFault::BeamCount(count));
        }
        (0..count).try_for_each(|_| self.read_number::<f32>("remission").map(drop))
    }

    fn read_pose(&mut self, field: &'static str) -> Result<RecordedPose, LineFault> {
        Ok(RecordedPose {
            x_m: self.read_finite(field)?,
            y_m: self.read_finite(field)?,
            yaw_rad: self.read_finite(field)?,
        })
    }

    fn read_finite(&mut self, field: &'static str) -> Result<f64, LineFault> {
        let text = self.0.next().ok_or(LineFault::Missing(field))?;
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(not_a_number(field, text)),
        }
    }

    fn read_number<T: FromStr>(&mut self, field: &'static str) -> Result<T, LineFault> {
        let text = self.0.next().ok_or(LineFault::Missing(field))?;
        text.parse().map_err(|_| not_a_number(field, text))
    }

    fn read_text(&mut self, field: &'static str) -> Result<String, LineFault> {
        self.0.next().map(str::to_owned).ok_or(LineFault::Missing(field))
    }
}

/// Some loggers leave the resolution at 0: then the field of view is shared out evenly.
fn choose_increment(resolution_rad: f64, field_rad: f64, count: usize) -> Result<f64, LineFault> {
    let shared_rad = field_rad / (count.max(2) - 1) as f64;
    let increment_rad = if resolution_rad > 0.0 { resolution_rad } else { shared_rad };
    let sweep_rad = increment_rad * (count - 1) as f64;
    if increment_rad > 0.0 && sweep_rad <= TAU + increment_rad {
        Ok(increment_rad)
    } else {
        Err(LineFault::Geometry(increment_rad.to_string()))
    }
}

fn not_a_number(field: &'static str, text: &str) -> LineFault {
    LineFault::NotANumber { field, text: text.chars().take(24).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(line: &str) -> RecordedScan {
        match parse_line(line) {
            Ok(Some(LogRecord::Scan(scan))) => scan,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn flaser_carries_ranges_odometry_and_stamp() {
        let scan = scan("FLASER 3 1.5 2 81.9 1 2 0.5 1.1 2.1 0.6 12.25 host 12.3");
        assert_eq!((scan.mount, scan.stamp_s), (Mount::Front, 12.25));
        assert_eq!(scan.odometry, RecordedPose { x_m: 1.1, y_m: 2.1, yaw_rad: 0.6 });
        assert_eq!(scan.ranges_within(50.0), [1.5, 2.0, f32::INFINITY]);
        assert_eq!(scan.beams.angle_rad(2), std::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn half_circle_includes_the_left_end_only_when_the_count_is_odd() {
        for (count, last_deg) in [(180, 89.0), (181, 90.0), (360, 89.5), (361, 90.0)] {
            let last_rad = Beams::half_circle(count).angle_rad(count - 1);
            assert!((last_rad.to_degrees() - last_deg).abs() < 1e-9, "{count}: {last_rad}");
        }
    }

    #[test]
    fn robot_laser_brings_its_own_geometry() {
        let line = "ROBOTLASER1 4 -1.0 2.0 1.0 20.0 0.01 0 3 1 2 3 1 9 \
                    1 1 1 2 2 0.2 0.1 0.1 0 0 0 7.5 host 7.6";
        let scan = scan(line);
        assert_eq!((scan.beams.angle_min_rad, scan.beams.increment_rad), (-1.0, 1.0));
        assert_eq!(scan.beams.range_max_m, Some(20.0));
        assert_eq!((scan.odometry.yaw_rad, scan.stamp_s), (0.2, 7.5));
    }

    #[test]
    fn robot_laser_without_resolution_shares_out_its_field() {
        let line = "ROBOTLASER1 0 -1 2 0 20 0 0 3 1 2 3 0 1 1 1 2 2 0.2 0 0 0 0 0 7.5 h 7.6";
        assert_eq!(scan(line).beams.increment_rad, 1.0);
    }

    #[test]
    fn odometry_and_parameters_are_read() {
        let odometry = parse_line("ODOM 1 2 3 0.5 0.1 0 9.5 host 9.6");
        assert!(matches!(odometry, Ok(Some(LogRecord::Odometry(o))) if o.stamp_s == 9.5));
        let expected = LogRecord::Parameter("robot_front_laser_max".into(), "10".into());
        assert_eq!(parse_line("PARAM robot_front_laser_max 10 nohost 0"), Ok(Some(expected)));
    }

    #[test]
    fn bad_lines_are_faults_and_other_lines_are_nothing() {
        use LineFault::*;
        let check =
            |line: &str, fault: LineFault| assert_eq!(parse_line(line), Err(fault), "{line}");
        check("FLASER", Missing("number of readings"));
        check("FLASER 0 1 2", BeamCount(0));
        check("FLASER 99999999999 1", BeamCount(99_999_999_999));
        check("FLASER 2 1.0", Missing("range"));
        check("FLASER 1 1.0 0 0 0 0 0 0", Missing("timestamp"));
        check("ODOM 1 2 inf", not_a_number("odometry", "inf"));
        check("FLASER -3", not_a_number("number of readings", "-3"));
        check("ROBOTLASER1 0 0 0 0 9 0 0 2 1 1 0 0 0 0 0 0 0 0 0 0 0 0 1", Geometry("0".into()));
        for line in ["", "# FLASER", "TRUEPOS 1 2 3", "flaser 1"] {
            assert_eq!(parse_line(line), Ok(None), "{line}");
        }
    }
}
