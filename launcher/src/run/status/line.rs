//! The text of the status line of a running system.

use armor_inspect::words::format_duration;

use super::rates::FallenRate;

/// Most fallen rates that are named; more are counted.
const MAX_RATES: usize = 2;

/// What a component reports of its task.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskStatus {
    /// The component.
    pub component: String,
    /// What it is doing.
    pub task: String,
    /// Share of the task that is done, 0 … 1, if it is known.
    pub fraction: Option<f32>,
    /// Details for people; may be empty.
    pub detail: String,
}

/// The status of a running system at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunStatus {
    /// Time since the start of the run, in seconds.
    pub elapsed_s: f64,
    /// The data that the time of the system follows, if it stands still.
    pub standing_clock: Option<String>,
    /// The marked places; empty without a mission, and while a firing is under way.
    pub places: Vec<String>,
    /// What the mission asks of a person, or that one has paused it.
    pub orders: Vec<String>,
    /// The tasks of the active components.
    pub tasks: Vec<TaskStatus>,
    /// Calls of user code that hang, each with its component: `tank in exec for 12.0 s`.
    pub hanging_calls: Vec<String>,
    /// Links whose rate has fallen.
    pub fallen_rates: Vec<FallenRate>,
    /// Processes that were started again.
    pub restarts: u32,
}

impl RunStatus {
    /// Returns whether there is anything to show but the time.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
            && self.orders.is_empty()
            && self.standing_clock.is_none()
            && self.tasks.is_empty()
            && self.hanging_calls.is_empty()
            && self.fallen_rates.is_empty()
            && self.restarts == 0
    }

    /// Returns the status as one line without control characters.
    pub fn to_line(&self) -> String {
        let mut parts = vec![format_duration(self.elapsed_s)];
        if !self.places.is_empty() {
            parts.push(self.places.join(", "));
        }
        let clock = self.standing_clock.as_ref();
        parts.extend(clock.map(|clock| format!("time stands still, it follows {clock}")));
        parts.extend(self.orders.iter().cloned());
        parts.extend(self.hanging_calls.iter().cloned());
        parts.extend(self.tasks.iter().map(format_task));
        parts.extend(self.fallen_rates.iter().take(MAX_RATES).map(|rate| {
            let FallenRate { link, rate_hz, usual_hz } = rate;
            format!("slow: {link} {rate_hz:.1} Hz instead of {usual_hz:.1}")
        }));
        if let more @ 1.. = self.fallen_rates.len().saturating_sub(MAX_RATES) {
            parts.push(format!("{more} more slow"));
        }
        match self.restarts {
            0 => {}
            1 => parts.push("1 restart".into()),
            restarts => parts.push(format!("{restarts} restarts")),
        }
        // A component's text must not be able to move the cursor.
        parts.join(" | ").chars().filter(|c| !c.is_control()).collect()
    }
}

fn format_task(status: &TaskStatus) -> String {
    let TaskStatus { component, task, fraction, detail } = status;
    let percent = fraction.map(|fraction| format!("{:.0} %", 100.0 * fraction));
    // The detail usually states the fraction, in better words.
    let percent = percent.filter(|_| detail.is_empty());
    let parts = [Some(task.clone()), percent, Some(detail.clone()).filter(|it| !it.is_empty())];
    format!("{component}: {}", parts.into_iter().flatten().collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(fraction: Option<f32>, detail: &str) -> TaskStatus {
        let (component, task) = ("explorer".into(), "exploring".into());
        TaskStatus { component, task, fraction, detail: detail.into() }
    }

    fn slow(link: &str) -> FallenRate {
        FallenRate { link: link.into(), rate_hz: 3.12, usual_hz: 10.0 }
    }

    #[test]
    fn a_line_has_time_places_tasks_slow_links_and_restarts() {
        let status = RunStatus {
            elapsed_s: 12.34,
            standing_clock: Some("sim.clock".into()),
            orders: vec!["paused by anna".into()],
            places: vec!["explore".into(), "watch".into()],
            hanging_calls: vec!["tank in exec for 12.0 s".into()],
            tasks: vec![task(Some(0.84), "84 % explored, 3.2 m to the goal")],
            fallen_rates: vec![slow("laser.scan -> mapper.scan")],
            restarts: 1,
        };
        assert_eq!(
            status.to_line(),
            "12.3 s | explore, watch | time stands still, it follows sim.clock | paused by anna | tank in exec for 12.0 s | explorer: exploring, 84 % \
             explored, 3.2 m to the goal | slow: laser.scan -> mapper.scan 3.1 Hz instead of 10.0 | 1 restart"
        );
    }

    #[test]
    fn only_what_is_known_is_shown() {
        let status = RunStatus { elapsed_s: 83.0, ..RunStatus::default() };
        assert!(status.is_empty());
        assert_eq!(status.to_line(), "1 min 23 s");
        let status = RunStatus { tasks: vec![task(Some(0.5), ""), task(None, "")], ..status };
        assert_eq!(
            status.to_line(),
            "1 min 23 s | explorer: exploring, 50 % | explorer: exploring"
        );
    }

    #[test]
    fn many_slow_links_are_counted_and_control_characters_are_removed() {
        let fallen_rates = ["a\x1b[2J", "b", "c", "d"].map(slow).to_vec();
        let line = RunStatus { fallen_rates, restarts: 2, ..RunStatus::default() }.to_line();
        assert!(line.ends_with(" | 2 more slow | 2 restarts"), "{line}");
        assert!(!line.contains('\x1b'), "{line:?}");
    }
}
