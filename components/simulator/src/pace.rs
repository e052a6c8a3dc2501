//! How fast simulated time passes compared with the host's. It reads no clock: the caller passes
//! the host's time.

/// Relates the host's time to simulated time.
#[derive(Clone, Copy, Debug)]
pub struct SimulationPace {
    speed: f64,
    /// Host time and simulated time of one moment.
    origin: (f64, f64),
}

impl SimulationPace {
    /// Both clocks agree at `host_s`; from then on simulated time passes `speed` times as fast.
    pub fn new(speed: f64, host_s: f64) -> Self {
        Self { speed, origin: (host_s, host_s) }
    }

    /// Simulated time, in seconds.
    pub fn time_s(&self, host_s: f64) -> f64 {
        self.origin.1 + (host_s - self.origin.0) * self.speed
    }

    /// Simulated seconds per second.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Changes the speed from now on; at 0 simulated time stands still.
    pub fn set_speed(&mut self, speed: f64, host_s: f64) {
        self.origin = (host_s, self.time_s(host_s));
        self.speed = speed;
    }

    /// Sets simulated time to `time_s`; the speed is unchanged.
    pub fn set_time(&mut self, time_s: f64, host_s: f64) {
        self.origin = (host_s, time_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_passes_at_its_speed_stands_and_continues() {
        let mut pace = SimulationPace::new(5.0, 100.0);
        assert_eq!(pace.time_s(102.0), 110.0);
        pace.set_speed(0.0, 102.0);
        assert_eq!(pace.time_s(1000.0), 110.0);
        pace.set_speed(0.5, 1000.0);
        assert_eq!(pace.time_s(1004.0), 112.0);
        pace.set_time(50.0, 1004.0);
        assert_eq!(pace.time_s(1006.0), 51.0);
    }
}
