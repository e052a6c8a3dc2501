//! Trajectories as map-writer writes them.

use std::collections::BTreeMap;

use armor_grid_slam::pose::Pose;

use crate::columns::number_lines;
use crate::error::EvaluationError;

/// Poses by the number of their scan: the stamp in seconds and `world_from_robot`.
pub type ScanTrajectory = BTreeMap<usize, (f64, Pose)>;

/// Reads `scan,timestamp_s,x_m,y_m,theta_rad`, with a line of titles.
///
/// # Errors
/// If a line has other fields.
pub fn read_trajectory(text: &str) -> Result<ScanTrajectory, EvaluationError> {
    let expected = "scan,timestamp_s,x_m,y_m,theta_rad";
    let read_line = |(line, text): (usize, &str)| {
        let numbers: Option<Vec<f64>> = text.split(',').map(|f| f.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[scan, stamp_s, x_m, y_m, yaw_rad]) if scan >= 0.0 => {
                Ok((scan as usize, (stamp_s, Pose::new(x_m, y_m, yaw_rad))))
            }
            _ => Err(EvaluationError::BadLine { line, expected, text: text.into() }),
        }
    };
    number_lines(text).map(read_line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_read_and_a_bad_line_is_named() {
        let titles = "scan,timestamp_s,x_m,y_m,theta_rad\n";
        let read = read_trajectory(&format!("{titles}0,1.5,1,2,0.5\n\n7,2,1,2,3\n")).unwrap();
        assert_eq!(read[&7], (2.0, Pose::new(1.0, 2.0, 3.0)));
        let error = read_trajectory(&format!("{titles}0,1.5,1\n")).unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("0,1.5,1"), "{error}");
    }
}
