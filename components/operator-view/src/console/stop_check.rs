//! Whether STOP has arrived, and whether the robot is at rest.

use super::Console;
use crate::links::{ClockTimes, Freshness};
use crate::readings::TaskReading;
use crate::stop_delivery::StopStatus;

/// Slower than this the robot is at rest: in m/s, and in rad/s.
const REST: (f64, f64) = (0.02, 0.03);
/// Progress older than this shows nothing, in seconds: it is published once per second.
const PROGRESS_VALID_S: f64 = 3.0;

impl Console {
    /// Takes what the component has published on `stop`, and how many links have accepted it. STOP
    /// that an earlier window has ordered becomes that of this one.
    pub fn record_stop(&mut self, is_on: bool, to: usize, now: ClockTimes) {
        if self.stop.confirm(is_on, to, now.host_s) {
            self.orders.adopt_stop();
        }
        self.record_delivery("stop", to);
    }

    /// Returns what is known of STOP, while it is active.
    pub fn stop_status(&self, now: ClockTimes) -> Option<StopStatus> {
        if !self.orders.is_stopped() || self.connection.has_ended() {
            return None;
        }
        let problem = self.stop.problem(now.host_s, self.connection.is_cut());
        Some(problem.unwrap_or_else(|| self.find_rest(now)))
    }

    /// Returns whether the robot is at rest since STOP, by its odometry and the driver's report.
    fn find_rest(&self, now: ClockTimes) -> StopStatus {
        let since_s = now.host_s - self.stop.ordered_s();
        let age_s = |input: &str| self.link(input).and_then(|link| link.age_s(now));
        let is_fresh =
            self.link("odometry").is_some_and(|link| link.freshness(now) == Freshness::Fresh);
        let velocity = self.scene.velocity.filter(|_| is_fresh);
        let is_moving = |(mps, radps): (f64, f64)| mps.abs() > REST.0 || radps.abs() > REST.1;
        // It may have been measured before the robot received STOP.
        if let Some(velocity) = velocity.filter(|velocity| is_moving(*velocity)) {
            return StopStatus::Moving(velocity.0.abs());
        }
        let is_measured = age_s("odometry").is_some_and(|age_s| age_s <= since_s);
        let task = self.readings.newest::<TaskReading>().is_some_and(TaskReading::is_stopped);
        let reported = age_s("progress")
            .is_some_and(|age_s| age_s <= since_s && age_s < PROGRESS_VALID_S)
            && task;
        match velocity {
            _ if reported => StopStatus::Stands,
            Some(_) if is_measured => StopStatus::Stands,
            Some(_) => StopStatus::Sent,
            None if self.is_linked("odometry") => StopStatus::OldData,
            None => StopStatus::Unmeasured,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connection::RunEnd;
    use crate::console::tests::{FIRST, now};
    use crate::links::InputLink;
    use crate::orders::{OperatorOrder, RobotCommand};

    #[test]
    fn the_robot_stands_only_when_its_odometry_or_its_driver_shows_it_after_stop() {
        let mut console = Console::default();
        console.links.push(InputLink::new("odometry", "base.odometry".into(), true));
        console.links.push(InputLink::new("progress", "driver.progress".into(), false));
        let status = |console: &Console, host_s| console.stop_status(now(host_s));
        let mut number = FIRST;
        let mut arrive = |console: &mut Console, input: &str, host_s| {
            number.sequence += 1;
            console.record_arrival(input, now(host_s), host_s, number, Ok(()));
        };
        console.scene.velocity = Some((0.0, 0.0));
        arrive(&mut console, "odometry", 0.9);
        assert_eq!(status(&console, 1.0), None);
        console.handle_order(OperatorOrder::Stop, now(1.0));
        assert_eq!(status(&console, 1.0), Some(StopStatus::Sent));
        console.record_stop(true, 0, now(1.1));
        assert_eq!(status(&console, 1.1), Some(StopStatus::NoSubscriber));
        console.record_stop(true, 1, now(1.1));
        assert_eq!(status(&console, 1.1), Some(StopStatus::Sent), "measured before STOP");
        console.scene.velocity = Some((0.3, 0.0));
        arrive(&mut console, "odometry", 1.2);
        console.readings.store(TaskReading { task: "stopped".into() });
        arrive(&mut console, "progress", 1.2);
        assert_eq!(status(&console, 1.2), Some(StopStatus::Moving(0.3)), "it brakes");
        console.scene.velocity = Some((0.0, 0.0));
        arrive(&mut console, "odometry", 1.3);
        assert_eq!(status(&console, 1.3), Some(StopStatus::Stands));
        assert_eq!(status(&console, 8.0), Some(StopStatus::OldData));
        console.links.remove(0);
        assert_eq!(status(&console, 1.3), Some(StopStatus::Stands), "the driver reports it");
        assert_eq!(status(&console, 8.0), Some(StopStatus::Unmeasured));
    }

    #[test]
    fn stop_without_a_connection_is_remembered_and_other_orders_are_not() {
        let mut console = Console::default();
        console.cut_connection("rover", "", now(1.0));
        console.handle_order(OperatorOrder::Drive { forward: 1.0, turn: 0.0 }, now(1.0));
        console.handle_order(OperatorOrder::Press("home".into()), now(1.0));
        assert!(console.orders.pressed().is_none() && console.refusal.is_none());
        let commands = console.handle_order(OperatorOrder::Stop, now(2.0));
        assert_eq!(commands, [RobotCommand::Stop(true)]);
        assert_eq!(console.stop_status(now(2.0)), Some(StopStatus::NotDelivered));
        console.handle_order(OperatorOrder::Release, now(3.0));
        assert!(console.orders.is_stopped(), "nothing is known of the robot");
        assert_eq!(console.stop.begin_again(4.0), Some(true));
        let end = RunEnd { why: String::new(), is_normal: true };
        console.end_system("rover", end, now(9.0));
        assert_eq!(console.run_time(now(99.0)).host_s, 1.0, "when its data ended");
        console.watch_conditions(now(99.0));
        assert_eq!(console.alerts.count_new(), 0);
    }
}
