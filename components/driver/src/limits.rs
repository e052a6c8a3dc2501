//! Velocities, and what the base can do about them.

/// What passes between a scan and the wheels, in seconds.
pub(crate) const REACTION_S: f64 = 0.2;
/// The longest time from one choice to the next that is reckoned with, in seconds.
pub(crate) const LONGEST_S: f64 = 0.2;

/// How fast to drive and turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Forward speed, in metres per second.
    pub speed_mps: f64,
    /// Turn rate, counter-clockwise, in radians per second.
    pub turn_radps: f64,
}

impl Velocity {
    /// Standing still.
    pub const ZERO: Self = Self { speed_mps: 0.0, turn_radps: 0.0 };

    /// Turning on the spot.
    pub const fn spin(turn_radps: f64) -> Self {
        Self { speed_mps: 0.0, turn_radps }
    }
}

/// What the base can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLimits {
    /// Fastest forward speed, in metres per second.
    pub speed_mps: f64,
    /// Fastest turn rate, in radians per second.
    pub turn_radps: f64,
    /// Change of speed, in metres per second squared.
    pub acceleration_mps2: f64,
    /// Change of turn rate, in radians per second squared.
    pub turn_acceleration_radps2: f64,
}

impl DriveLimits {
    /// Returns how far ahead the base must look at full speed, in metres: as far as it goes at that
    /// speed in the time it takes to stop.
    pub(crate) fn stopping_m(&self) -> f64 {
        self.speed_mps * (REACTION_S + LONGEST_S + self.speed_mps / self.acceleration_mps2)
    }

    /// Returns the velocity nearest to `wanted` that can be reached within `interval_s`.
    pub(crate) fn approach_velocity(
        &self,
        now: Velocity,
        wanted: Velocity,
        interval_s: f64,
    ) -> Velocity {
        let speed = self.acceleration_mps2 * interval_s;
        let turn = self.turn_acceleration_radps2 * interval_s;
        Velocity {
            speed_mps: wanted.speed_mps.clamp(now.speed_mps - speed, now.speed_mps + speed),
            turn_radps: wanted.turn_radps.clamp(now.turn_radps - turn, now.turn_radps + turn),
        }
    }

    /// Returns the velocity nearest to `wanted` that the base can have, backwards as fast as
    /// forward.
    pub(crate) fn limit_velocity(&self, wanted: Velocity) -> Velocity {
        Velocity {
            speed_mps: wanted.speed_mps.clamp(-self.speed_mps, self.speed_mps),
            turn_radps: wanted.turn_radps.clamp(-self.turn_radps, self.turn_radps),
        }
    }

    /// Returns the velocity after braking for `interval_s` on the same arc.
    pub(crate) fn brake_velocity(&self, now: Velocity, interval_s: f64) -> Velocity {
        let less_mps = (self.acceleration_mps2 * interval_s).min(now.speed_mps.abs());
        let speed_mps = now.speed_mps - less_mps.copysign(now.speed_mps);
        let left = if speed_mps == 0.0 { 0.0 } else { speed_mps / now.speed_mps };
        Velocity { speed_mps, turn_radps: left * now.turn_radps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: DriveLimits = DriveLimits {
        speed_mps: 0.6,
        turn_radps: 1.2,
        acceleration_mps2: 0.8,
        turn_acceleration_radps2: 3.0,
    };

    #[test]
    fn braking_stays_on_the_arc() {
        let now = Velocity { speed_mps: -0.4, turn_radps: 0.6 };
        let next = LIMITS.brake_velocity(now, 0.1);
        assert!((next.speed_mps + 0.32).abs() < 1e-9 && (next.turn_radps - 0.48).abs() < 1e-9);
        assert_eq!(LIMITS.brake_velocity(now, 1.0), Velocity::ZERO);
        assert_eq!(LIMITS.brake_velocity(Velocity::spin(1.0), 0.1), Velocity::ZERO);
    }
}
