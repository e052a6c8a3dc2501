//! A time in seconds as ROS writes it: whole seconds and nanoseconds.

const NANOSECONDS: f64 = 1e9;

/// `builtin_interfaces/Time`: the nearest one. A time that it cannot express is 0 or its first or last.
pub(super) fn to_ros_time(seconds: f64) -> (i32, u32) {
    let whole = seconds.floor();
    let nanoseconds = ((seconds - whole) * NANOSECONDS).round();
    // Conversions saturate, and NaN becomes 0.
    if nanoseconds >= NANOSECONDS {
        ((whole as i32).saturating_add(1), 0)
    } else {
        (whole as i32, nanoseconds as u32)
    }
}

/// The nearest time in seconds.
pub(super) fn from_ros_time((seconds, nanoseconds): (i32, u32)) -> f64 {
    f64::from(seconds) + f64::from(nanoseconds) / NANOSECONDS
}

/// Whether a time survives the way to ROS and back.
pub(super) fn is_exact(seconds: f64) -> bool {
    from_ros_time(to_ros_time(seconds)).to_bits() == seconds.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_rounded_to_the_nearest_nanosecond() {
        for (seconds, time) in [
            (0.0, (0, 0)),
            (1.5, (1, 500_000_000)),
            (-0.25, (-1, 750_000_000)),
            (0.999_999_999_9, (1, 0)),
            (f64::NAN, (0, 0)),
        ] {
            assert_eq!(to_ros_time(seconds), time, "{seconds}");
        }
        assert!(is_exact(1.5) && is_exact(1_795_000_000.25));
        assert!(!is_exact(0.1 + 0.2) && !is_exact(f64::NAN) && !is_exact(1e12) && !is_exact(-0.0));
        assert_eq!(to_ros_time(1e12).0, i32::MAX);
    }
}
