//! Medians over the rounds, ratios within a round, and the table.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::figure::{Contender, Figure, FigureGoal};
use crate::machine;
use crate::options::BenchOptions;

/// All readings, in the order of their first appearance.
#[derive(Default)]
pub struct ResultTable {
    rows: Vec<TableRow>,
}

struct TableRow {
    name: String,
    unit: &'static str,
    goal: FigureGoal,
    values: BTreeMap<(Contender, usize), f64>,
    foreign_percent: Vec<f64>,
}

impl ResultTable {
    /// Adds the figures of a round.
    pub fn add_figures(
        &mut self,
        round: usize,
        side: Contender,
        foreign_percent: f64,
        figures: Vec<Figure>,
    ) {
        for Figure { name, unit, value, goal } in figures {
            let at = self.rows.iter().position(|row| row.name == name).unwrap_or_else(|| {
                let (values, foreign_percent) = (BTreeMap::new(), Vec::new());
                self.rows.push(TableRow { name, unit, goal, values, foreign_percent });
                self.rows.len() - 1
            });
            self.rows[at].values.insert((side, round), value);
            self.rows[at].foreign_percent.push(foreign_percent);
        }
    }

    /// The table, and under it what it was measured on.
    pub fn to_markdown(&self, options: &BenchOptions) -> String {
        let mut text = String::from(
            "| | unit | std TCP | Armor | Armor / std | goal | met | foreign load |\n\
             | --- | --- | ---: | ---: | ---: | --- | --- | ---: |\n",
        );
        for row in &self.rows {
            row.write_row(&mut text);
        }
        let cores = if options.same_core {
            "All processes are on core 0"
        } else {
            "The publisher is on core 0, the others on core 1"
        };
        let _ = writeln!(
            text,
            "\nMedians of {} rounds of {} s; ratios are medians of those within a round; foreign load is \
             the share of all cores that other programs used meanwhile (median). {cores}. {}.",
            options.rounds,
            options.window.as_secs_f64(),
            machine::describe_machine()
        );
        text
    }
}

impl TableRow {
    fn write_row(&self, text: &mut String) {
        let of = |side| self.values.iter().filter(move |((s, _), _)| *s == side);
        let value = |side| median(of(side).map(|(_, value)| *value).collect());
        let ratios = of(Contender::Armor).filter_map(|((_, round), ours)| {
            Some(ours / self.values.get(&(Contender::Std, *round))?)
        });
        let (std, ours, ratio) =
            (value(Contender::Std), value(Contender::Armor), median(ratios.collect()));
        let (goal, met) = match self.goal {
            FigureGoal::None => (String::new(), None),
            FigureGoal::TimesStdAtMost(most) => (format!("≤ {most} ×"), ratio.map(|r| r <= most)),
            FigureGoal::TimesStdAtLeast(least) => {
                (format!("≥ {least} ×"), ratio.map(|r| r >= least))
            }
            FigureGoal::AtMost(most) => (format!("≤ {most}"), ours.map(|ours| ours <= most)),
            FigureGoal::AtLeast(least) => (format!("≥ {least}"), ours.map(|ours| ours >= least)),
        };
        let met = met.map_or("", |met| if met { "yes" } else { "**no**" });
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {goal} | {met} | {} % |",
            self.name,
            self.unit,
            format_number(std),
            format_number(ours),
            ratio.map_or(String::from("–"), |ratio| format!("{ratio:.2}")),
            median(self.foreign_percent.clone()).map_or(0.0, f64::round),
        );
    }
}

/// The middle value, or the mean of the two in the middle.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    Some((values[(values.len() - 1) / 2] + upper) / 2.0)
}

/// Formats a number with three digits.
fn format_number(value: Option<f64>) -> String {
    match value {
        None => "–".into(),
        Some(value) if value >= 100.0 => format!("{value:.0}"),
        Some(value) if value >= 10.0 => format!("{value:.1}"),
        Some(value) => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }

    #[test]
    fn ratios_are_taken_within_a_round() {
        let mut table = ResultTable::default();
        let figures = |value| {
            vec![Figure {
                name: "x".into(),
                unit: "µs",
                value,
                goal: FigureGoal::TimesStdAtMost(1.5),
            }]
        };
        // The second round was disturbed, on both sides.
        for (round, std, ours) in [(0, 10.0, 12.0), (1, 100.0, 130.0), (2, 10.0, 14.0)] {
            table.add_figures(round, Contender::Std, 3.0, figures(std));
            table.add_figures(round, Contender::Armor, 5.0, figures(ours));
        }
        let mut text = String::new();
        table.rows[0].write_row(&mut text);
        assert_eq!(text, "| x | µs | 10.0 | 14.0 | 1.30 | ≤ 1.5 × | yes | 4 % |\n");
    }
}
