//! Samples and counts of a job, and the table of them against the goals.

use std::fmt::Write;

use super::diary::LinkAccount;

/// What a job has measured.
#[derive(Default)]
pub struct FaultReport {
    rows: Vec<ReportRow>,
}

enum ReportRow {
    Times { name: String, samples_s: Vec<f64>, goal: Option<TimeGoal> },
    Distances { name: String, samples_m: Vec<f64>, most: Option<f64> },
    Value { name: String, value: f64, unit: &'static str, most: Option<f64> },
}

/// The goal of a row of times.
#[derive(Clone, Copy, Debug)]
pub enum TimeGoal {
    /// 95 of 100 are at most this, in seconds.
    P95(f64),
    /// 99 of 100 are at most this, in seconds.
    P99(f64),
    /// All are at most this, in seconds.
    Max(f64),
}

impl FaultReport {
    /// Adds a sample to the row called `name`.
    pub fn add_time(&mut self, name: &str, seconds: f64, goal: Option<TimeGoal>) {
        let samples = self.rows.iter_mut().find_map(|row| match row {
            ReportRow::Times { name: own, samples_s, .. } if own == name => Some(samples_s),
            _ => None,
        });
        match samples {
            Some(samples) => samples.push(seconds),
            None => {
                let (name, samples_s) = (name.to_owned(), vec![seconds]);
                self.rows.push(ReportRow::Times { name, samples_s, goal });
            }
        }
    }

    /// Adds a sample, of which none is to exceed `most`, to the row called `name`.
    pub fn add_distance(&mut self, name: &str, metres: f64, most: Option<f64>) {
        for row in &mut self.rows {
            if let ReportRow::Distances { name: own, samples_m, .. } = row
                && own == name
            {
                samples_m.push(metres);
                return;
            }
        }
        let (name, samples_m) = (name.to_owned(), vec![metres]);
        self.rows.push(ReportRow::Distances { name, samples_m, most });
    }

    /// Adds to the count called `name`, of which at most `most` are allowed.
    pub fn add_count(&mut self, name: &str, count: u64, most: Option<u64>) {
        for row in &mut self.rows {
            if let ReportRow::Value { name: own, value, .. } = row
                && own == name
            {
                *value += count as f64;
                return;
            }
        }
        self.add_value(name, count as f64, "", most.map(|most| most as f64));
    }

    /// Adds a row with one value.
    pub fn add_value(&mut self, name: &str, value: f64, unit: &'static str, most: Option<f64>) {
        self.rows.push(ReportRow::Value { name: name.to_owned(), value, unit, most });
    }

    /// Adds what was counted over all links.
    pub fn add_account(&mut self, account: LinkAccount) {
        let LinkAccount { received, counted, uncounted, repeated, twice } = account;
        self.add_count("messages received", received, None);
        self.add_count("messages lost, counted by the receiver", counted, None);
        self.add_count("messages lost and not counted", uncounted, Some(0));
        self.add_count("messages received twice", repeated, Some(0));
        self.add_count("components that ran twice, or next to one they exclude", twice, Some(0));
    }

    /// Whether every goal is met.
    pub fn meets_goals(&self) -> bool {
        self.rows.iter().all(|row| row.goal().is_none_or(|(_, is_met)| is_met))
    }

    /// The table.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from(
            "| | n | p50 | p99 | max | goal | met |\n| --- | ---: | ---: | ---: | ---: | --- | --- |\n",
        );
        for row in &self.rows {
            row.write_row(&mut text);
        }
        text
    }
}

impl ReportRow {
    fn goal(&self) -> Option<(String, bool)> {
        match self {
            Self::Times { samples_s, goal, .. } => {
                let sorted = sort(samples_s);
                goal.map(|goal| match goal {
                    TimeGoal::P95(most) => {
                        (format!("p95 ≤ {most:.2} s"), find_share(&sorted, 0.95) <= most)
                    }
                    TimeGoal::P99(most) => {
                        (format!("p99 ≤ {most:.2} s"), find_share(&sorted, 0.99) <= most)
                    }
                    TimeGoal::Max(most) => {
                        (format!("max ≤ {most:.2} s"), find_share(&sorted, 1.0) <= most)
                    }
                })
            }
            Self::Distances { samples_m, most, .. } => most.map(|most| {
                (format!("max ≤ {most:.2} m"), find_share(&sort(samples_m), 1.0) <= most)
            }),
            Self::Value { value, unit, most, .. } => {
                most.map(|most| (format!("≤ {most} {unit}").trim_end().to_owned(), *value <= most))
            }
        }
    }

    fn write_row(&self, text: &mut String) {
        let (goal, is_met) = self.goal().unwrap_or_default();
        let met = match (goal.is_empty(), is_met) {
            (true, _) => "",
            (_, true) => "yes",
            (_, false) => "**no**",
        };
        let _ = match self {
            Self::Times { name, samples_s, .. } => {
                let sorted = sort(samples_s);
                let share = |share| find_share(&sorted, share);
                let (p50, p99, most) = (share(0.5), share(0.99), share(1.0));
                let count = sorted.len();
                writeln!(
                    text,
                    "| {name}, s | {count} | {p50:.3} | {p99:.3} | {most:.3} | {goal} | {met} |"
                )
            }
            Self::Distances { name, samples_m, .. } => {
                let sorted = sort(samples_m);
                let [p50, p99, most] = [0.5, 0.99, 1.0].map(|share| find_share(&sorted, share));
                let count = sorted.len();
                writeln!(
                    text,
                    "| {name}, m | {count} | {p50:.3} | {p99:.3} | {most:.3} | {goal} | {met} |"
                )
            }
            Self::Value { name, value, unit: "", .. } => {
                writeln!(text, "| {name} | {value} | | | | {goal} | {met} |")
            }
            Self::Value { name, value, unit, .. } => {
                writeln!(text, "| {name} | | | | {value:.2} {unit} | {goal} | {met} |")
            }
        };
    }
}

fn sort(samples: &[f64]) -> Vec<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The smallest sample that this share of the sorted ones does not exceed.
fn find_share(sorted: &[f64], share: f64) -> f64 {
    let at = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(at.max(1) - 1).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_met_only_if_its_goal_is() {
        let mut report = FaultReport::default();
        for sample in 1..=200 {
            let seconds = if sample == 200 { 9.0 } else { 0.5 };
            report.add_time("back", seconds, Some(TimeGoal::P99(1.0)));
        }
        report.add_count("lost", 0, Some(0));
        assert!(report.meets_goals(), "{}", report.to_markdown());
        report.add_time("noticed", 2.1, Some(TimeGoal::Max(2.0)));
        assert!(!report.meets_goals());
        let text = report.to_markdown();
        assert!(
            text.contains("| back, s | 200 | 0.500 | 0.500 | 9.000 | p99 ≤ 1.00 s | yes |"),
            "{text}"
        );
        assert!(
            text.contains("| noticed, s | 1 | 2.100 | 2.100 | 2.100 | max ≤ 2.00 s | **no** |")
        );
        assert!(text.contains("| lost | 0 | | | | ≤ 0 | yes |"));
    }
}
