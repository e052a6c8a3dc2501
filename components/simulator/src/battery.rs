//! The battery: drains with time and with the distance driven, linearly.

/// What the battery lasts for; the two drains add up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryModel {
    /// Charge at the start, 0 to 1 of the capacity.
    pub initial_level: f64,
    /// Time from full to empty standing still, in seconds.
    pub endurance_s: f64,
    /// Distance from full to empty if driving were all that drains it, in metres.
    pub range_m: f64,
}

impl Default for BatteryModel {
    fn default() -> Self {
        Self { initial_level: 1.0, endurance_s: 7200.0, range_m: 5000.0 }
    }
}

/// A battery and what is left in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Battery {
    model: BatteryModel,
    level: f64,
}

impl Battery {
    /// Charge of a full battery, in ampere-hours (what a robot of this size carries).
    pub const CAPACITY_AH: f64 = 5.0;
    /// Voltage when empty, in volts (a 12 V lead battery).
    pub const EMPTY_V: f64 = 10.5;
    /// Voltage when full, in volts.
    pub const FULL_V: f64 = 12.6;

    /// Makes a battery at its initial level.
    pub fn new(model: BatteryModel) -> Self {
        Self { level: model.initial_level.clamp(0.0, 1.0), model }
    }

    /// Drains for a step of `step_s` seconds in which the base drove `distance_m` metres.
    pub fn drain(&mut self, step_s: f64, distance_m: f64) {
        let used = step_s / self.model.endurance_s + distance_m.abs() / self.model.range_m;
        self.level = (self.level - used).clamp(0.0, 1.0);
    }

    /// What is left, 0 to 1 of the capacity.
    pub fn level(&self) -> f64 {
        self.level
    }

    /// Whether nothing is left: the base can no longer drive.
    pub fn is_empty(&self) -> bool {
        self.level <= 0.0
    }

    /// Voltage now, in volts: a straight line from empty to full.
    pub fn voltage_v(&self) -> f64 {
        Self::EMPTY_V + (Self::FULL_V - Self::EMPTY_V) * self.level
    }

    /// Current at a speed, in amperes; negative, as sensor_msgs/BatteryState has it for
    /// discharging.
    pub fn current_a(&self, speed_mps: f64) -> f64 {
        let level_per_s = 1.0 / self.model.endurance_s + speed_mps.abs() / self.model.range_m;
        -level_per_s * Self::CAPACITY_AH * 3600.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: BatteryModel =
        BatteryModel { initial_level: 0.8, endurance_s: 1000.0, range_m: 100.0 };

    #[test]
    fn time_and_distance_both_drain_it() {
        let mut battery = Battery::new(MODEL);
        battery.drain(100.0, 0.0);
        assert!((battery.level() - 0.7).abs() < 1e-12);
        battery.drain(0.0, -20.0);
        assert!((battery.level() - 0.5).abs() < 1e-12, "driving backwards costs as much");
    }

    #[test]
    fn it_ends_empty_and_not_below() {
        let mut battery = Battery::new(MODEL);
        battery.drain(10_000.0, 0.0);
        assert_eq!(battery.level(), 0.0);
        assert!(battery.is_empty());
        assert_eq!(battery.voltage_v(), Battery::EMPTY_V);
    }

    #[test]
    fn the_current_empties_the_capacity_in_the_endurance() {
        let battery = Battery::new(MODEL);
        let used_ah = -battery.current_a(0.0) * MODEL.endurance_s / 3600.0;
        assert!((used_ah - Battery::CAPACITY_AH).abs() < 1e-9);
    }
}
