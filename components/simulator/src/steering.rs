//! Steering like a car's (Ackermann): the front wheels turn by a limited angle at a limited rate,
//! and the base turns about a point on the line of its rear axle. Its middle is that of the axle.

/// How the front wheels steer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteeringModel {
    /// From the rear axle to the front one, in metres.
    pub wheelbase_m: f64,
    /// The largest angle to either side, in radians.
    pub limit_rad: f64,
    /// The largest change of the angle, in radians per second.
    pub rate_radps: f64,
}

impl Default for SteeringModel {
    fn default() -> Self {
        Self { wheelbase_m: 0.3, limit_rad: 35f64.to_radians(), rate_radps: 2.0 }
    }
}

/// Slower than this a turn rate asks for no angle, in metres per second.
const STANDING_MPS: f64 = 0.01;

impl SteeringModel {
    /// The angle that gives a turn rate at a speed, within the limit; to the stop for a turn on the
    /// spot, which there is none of; nothing if neither is wanted.
    pub(crate) fn wanted_rad(&self, speed_mps: f64, turn_radps: f64) -> Option<f64> {
        let angle_rad = if speed_mps.abs() >= STANDING_MPS {
            libm::atan(self.wheelbase_m * turn_radps / speed_mps)
        } else if turn_radps != 0.0 {
            self.limit_rad.copysign(turn_radps)
        } else {
            return None;
        };
        Some(angle_rad.clamp(-self.limit_rad, self.limit_rad))
    }

    /// The turn rate at a speed with the wheels at an angle, in radians per second.
    pub(crate) fn turn_radps(&self, speed_mps: f64, angle_rad: f64) -> f64 {
        speed_mps * libm::tan(angle_rad) / self.wheelbase_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_gives_the_turn_that_is_wanted_forward_and_back() {
        let model = SteeringModel { wheelbase_m: 0.5, limit_rad: 0.6, rate_radps: 1.0 };
        for (speed_mps, turn_radps) in [(1.0, 0.5), (-1.0, 0.5), (0.4, -0.3)] {
            let angle_rad = model.wanted_rad(speed_mps, turn_radps).expect("an angle");
            assert!((model.turn_radps(speed_mps, angle_rad) - turn_radps).abs() < 1e-12);
        }
        assert_eq!(model.wanted_rad(0.1, 5.0), Some(0.6), "within the limit");
        assert_eq!(model.wanted_rad(0.0, -1.0), Some(-0.6), "made ready to turn");
        assert_eq!(model.wanted_rad(0.0, 0.0), None);
    }
}
