//! Whether the commands of the operator reach a subscriber.

use super::Console;
use super::order_check::OrderRefusal;
use crate::links::ClockTimes;
use crate::orders::RobotCommand;

impl Console {
    /// Records the number of links that accepted a command.
    pub fn record_sent(&mut self, command: &RobotCommand, to: usize, now: ClockTimes) {
        match command {
            RobotCommand::Stop(is_on) => self.record_stop(*is_on, to, now),
            command => {
                if let Some(output) = command.output() {
                    self.record_delivery(output, to);
                }
            }
        }
    }

    /// Records the number of links that accepted a command on an output.
    pub fn record_delivery(&mut self, output: &str, to: usize) {
        let Some(output) = ["goal", "velocity", "stop"].into_iter().find(|it| *it == output) else {
            return;
        };
        self.unheard.remove(output);
        if to > 0 {
            return;
        }
        if output == "goal"
            && let Some((place, at_s)) = self.orders.drop_unheard_goal()
        {
            // It is refused: nothing remains that a subscriber could still receive.
            let why = "nothing receives goals: what is linked to `goal` does not run".into();
            self.refusal = Some(OrderRefusal { place, why, at_s });
        } else {
            self.unheard.insert(output);
        }
    }

    /// Returns a warning if an order reaches no subscriber; STOP has priority.
    pub fn delivery_warning(&self) -> Option<String> {
        let output =
            ["stop", "velocity", "goal"].into_iter().find(|of| self.unheard.contains(of))?;
        Some(format!("no subscriber: no link accepts `{output}`"))
    }
}

#[cfg(test)]
mod tests {
    use armor_grid::Pose2;

    use super::*;
    use crate::console::tests::now;
    use crate::orders::OperatorOrder;

    #[test]
    fn an_order_without_subscriber_gives_a_warning() {
        let mut console = Console::default();
        console.record_sent(&RobotCommand::Stop(true), 0, now(0.0));
        // The zero velocity of the same moment is delivered, but STOP is not.
        console.record_sent(
            &RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 },
            1,
            now(0.0),
        );
        assert_eq!(
            console.delivery_warning().as_deref(),
            Some("no subscriber: no link accepts `stop`")
        );
        console.record_sent(&RobotCommand::Stop(true), 1, now(0.0));
        assert_eq!(console.delivery_warning(), None);
    }

    #[test]
    fn a_goal_without_subscriber_is_refused_once_and_leaves_no_warning() {
        let mut console = Console::default();
        let order = OperatorOrder::Goal { place: Pose2::IDENTITY, has_heading: false };
        for command in console.handle_order(order, now(1.0)) {
            console.record_sent(&command, 0, now(1.0));
        }
        assert!(console.orders.goal().is_none());
        let refusal = console.recent_refusal(now(1.1)).expect("it is refused");
        assert!(refusal.why.contains("nothing receives goals"), "{}", refusal.why);
        assert_eq!(console.delivery_warning(), None, "nothing is left to deliver");
        // One that was received stays: its subscriber may return.
        let order = OperatorOrder::Goal { place: Pose2::IDENTITY, has_heading: false };
        for command in console.handle_order(order, now(2.0)) {
            console.record_sent(&command, 1, now(2.0));
        }
        let repeated = console.orders.repeat_order(9.0).expect("it is repeated");
        console.record_sent(&repeated, 0, now(9.0));
        assert!(console.orders.goal().is_some());
        let warning = console.delivery_warning();
        assert_eq!(warning.as_deref(), Some("no subscriber: no link accepts `goal`"));
    }
}
