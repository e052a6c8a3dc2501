//! The values of the plotted fields over time. Pure.

use armor_inspect::Series;

use super::sources::{PlottedField, SourceEvent};

/// Curves, in the order of the command line.
#[derive(Debug)]
pub struct PlotCurves {
    curves: Vec<PlotCurve>,
}

/// One field over time.
#[derive(Debug)]
pub struct PlotCurve {
    pub label: String,
    /// Empty if it has none.
    pub unit: String,
    pub series: Series,
}

impl PlotCurves {
    /// Curves without values.
    pub fn new(fields: &[PlottedField]) -> Self {
        let curve = |field: &PlottedField| PlotCurve {
            label: field.label(),
            unit: String::new(),
            series: Series::default(),
        };
        Self { curves: fields.iter().map(curve).collect() }
    }

    /// Adds what a source reports.
    pub fn add_event(&mut self, event: SourceEvent) {
        match event {
            SourceEvent::Unit { field, unit } => self.curves[field].unit = unit,
            SourceEvent::Value { field, stamp_s, value } => {
                self.curves[field].series.push(stamp_s, value);
            }
            SourceEvent::Failed(_) => {}
        }
    }

    /// Returns the number of values.
    pub fn len(&self) -> usize {
        self.curves.iter().map(|curve| curve.series.len()).sum()
    }

    /// Returns how many earlier values were forgotten: memory is bounded.
    pub fn forgotten(&self) -> u64 {
        self.curves.iter().map(|curve| curve.series.forgotten()).sum()
    }

    /// Returns whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the curves that share a chart, by unit, in the order of their first one.
    pub fn group_by_unit(&self) -> Vec<Vec<&PlotCurve>> {
        let mut groups: Vec<Vec<&PlotCurve>> = Vec::new();
        for curve in &self.curves {
            match groups.iter_mut().find(|group| group[0].unit == curve.unit) {
                Some(group) => group.push(curve),
                None => groups.push(vec![curve]),
            }
        }
        groups
    }

    /// Returns the times of the first and the last value, in seconds; none without a value.
    pub fn time_span(&self) -> Option<[f64; 2]> {
        let series = || self.curves.iter().map(|curve| &curve.series);
        let first = series().filter_map(|it| it.thin_points(f64::MIN, 1).first().map(|it| it[0]));
        let last = series().filter_map(|it| it.last().map(|it| it[0]));
        let span = [first.reduce(f64::min)?, last.reduce(f64::max)?];
        Some(span)
    }
}

/// Returns the least and the greatest of these values, a little apart if they are equal.
pub fn find_bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) =
        values.fold((f64::MAX, f64::MIN), |(low, high), it| (low.min(it), high.max(it)));
    if low > high {
        return [0.0, 1.0];
    }
    let least = (high.abs().max(low.abs()) * 1e-6).max(1e-9);
    if high - low < least { [low - least, high + least] } else { [low, high] }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Two curves in metres and one in radians, over two seconds.
    pub fn curves() -> PlotCurves {
        let field = |path: &str| PlottedField { data: "arm.pose".into(), path: path.into() };
        let mut curves = PlotCurves::new(&[field("x"), field("yaw"), field("y")]);
        for (field, unit) in [(0, "m"), (1, "rad"), (2, "m")] {
            curves.add_event(SourceEvent::Unit { field, unit: unit.into() });
        }
        for step in 0..=20 {
            let stamp_s = 100.0 + f64::from(step) * 0.1;
            curves.add_event(SourceEvent::Value { field: 0, stamp_s, value: f64::from(step) });
            curves.add_event(SourceEvent::Value { field: 1, stamp_s, value: 0.5 });
        }
        curves
    }

    #[test]
    fn curves_of_one_unit_share_a_chart() {
        let curves = curves();
        let groups = curves.group_by_unit();
        let labels: Vec<Vec<&str>> =
            groups.iter().map(|group| group.iter().map(|it| it.label.as_str()).collect()).collect();
        assert_eq!(labels, [vec!["arm.pose.x", "arm.pose.y"], vec!["arm.pose.yaw"]]);
        assert_eq!((curves.len(), curves.is_empty()), (42, false));
        assert_eq!(curves.time_span(), Some([100.0, 102.0]));
        assert_eq!(PlotCurves::new(&[]).time_span(), None);
    }

    #[test]
    fn bounds_of_a_constant_are_apart() {
        assert_eq!(find_bounds([1.0, -2.0, 3.0].into_iter()), [-2.0, 3.0]);
        let [low, high] = find_bounds([5.0, 5.0].into_iter());
        assert!(low < 5.0 && high > 5.0 && high - low < 0.1);
        assert_eq!(find_bounds(std::iter::empty()), [0.0, 1.0]);
    }
}
