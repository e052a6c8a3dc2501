//! The values of one output, as they arrive.

use armor_inspect::{ValueLook, WatchedValues};
use armor_wire::schema::{Glimpse, GlimpsedValue, Scalar};
use eframe::egui::{self, Grid};

use super::plots::Plots;
use super::preview;
use super::words::printable;
use armor_picture::theme::ThemeColours;

/// Most values shown of one message.
const MOST_LINES: usize = 60;
/// Most values in a tooltip.
const FEW_LINES: usize = 12;

/// Shows an output with a box for each number that can be plotted.
pub fn show(ui: &mut egui::Ui, values: &WatchedValues, plots: &mut Plots, data: &str) {
    let look = values.look(data);
    heading(ui, &look);
    let is_pictured = show_preview(ui, data, &look);
    let mut lines = look.glance(MOST_LINES).unwrap_or_default();
    if is_pictured {
        lines.retain(|glimpse| !glimpse.path.contains('['));
    }
    Grid::new(("values", data)).num_columns(3).striped(true).show(ui, |ui| {
        for glimpse in &lines {
            let text = printable(ui, &in_words(glimpse));
            ui.label(if glimpse.path.is_empty() { "value" } else { &glimpse.path });
            ui.label(text);
            if can_be_plotted(glimpse) {
                let mut is_plotted = plots.has(data, &glimpse.path);
                let name = format!("plot {data} {}", glimpse.path);
                let plot = ui.checkbox(&mut is_plotted, "plot").accessible_name(name);
                if plot.changed() {
                    plots.set(values, data, &glimpse.path, glimpse.unit.as_deref(), is_plotted);
                }
            }
            ui.end_row();
        }
    });
    if lines.len() == MOST_LINES {
        ui.weak("and more; `armor echo` prints everything");
    }
}

/// Shows maps, images, scans and paths as pictures. Returns whether there is one.
fn show_preview(ui: &mut egui::Ui, name: &str, look: &ValueLook) -> bool {
    let (Some(schema), Some(data)) = (&look.schema, &look.data) else { return false };
    let make = |colours: &ThemeColours| preview::preview(schema, &data.payload, colours);
    preview::show(ui, name, data.header.sequence, make)
}

fn heading(ui: &mut egui::Ui, look: &ValueLook) {
    let colours = ThemeColours::of(ui.visuals());
    ui.horizontal_wrapped(|ui| {
        ui.weak(&look.type_name);
        if let Some(data) = &look.data {
            ui.weak(super::blocks::rate(look.rate_hz));
            ui.weak(format!("no. {}", data.header.sequence));
        } else if look.problem.is_empty() {
            ui.weak("nothing published since watching began");
        }
        if look.lost > 0 {
            ui.weak(format!("{} not seen here", look.lost)).on_hover_text(
                "This window reads only the newest data; other subscribers lose nothing.",
            );
        }
    });
    if !look.problem.is_empty() {
        ui.colored_label(colours.warning, printable(ui, &look.problem));
    }
}

/// The newest data of an output in a few lines.
pub fn in_brief(look: &ValueLook) -> String {
    if look.data.is_none() {
        let nothing = "nothing published since watching began";
        return if look.problem.is_empty() { nothing.into() } else { look.problem.clone() };
    }
    let lines = match look.glance(FEW_LINES) {
        Ok(lines) => lines,
        Err(error) => return format!("it does not match its schema: {error}"),
    };
    let line = |glimpse: &Glimpse| match glimpse.path.as_str() {
        "" => in_words(glimpse),
        path => format!("{path}  {}", in_words(glimpse)),
    };
    let mut text: Vec<_> = lines.iter().map(line).collect();
    if lines.len() == FEW_LINES {
        text.push("…".into());
    }
    text.join("\n")
}

fn can_be_plotted(glimpse: &Glimpse) -> bool {
    matches!(glimpse.seen, GlimpsedValue::Value(Scalar::Number(_) | Scalar::Flag(_)))
}

fn in_words(glimpse: &Glimpse) -> String {
    match &glimpse.seen {
        GlimpsedValue::Value(Scalar::Number(value)) => match &glimpse.unit {
            Some(unit) => format!("{} {unit}", number(*value)),
            None => number(*value),
        },
        GlimpsedValue::Value(Scalar::Flag(flag)) => if *flag { "yes" } else { "no" }.into(),
        GlimpsedValue::Value(Scalar::Text(text)) => crate::text::short(text, 60).into_owned(),
        GlimpsedValue::Many(count) => format!("{count} values"),
        GlimpsedValue::Nothing => "none".into(),
    }
}

/// A number with its significant digits.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if value == value.trunc() && size < 1e12 {
        format!("{value:.0}")
    } else if (1e6..1e12).contains(&size) {
        format!("{value:.2}")
    } else if (1e-3..1e6).contains(&size) {
        let digits = (5 - size.log10().floor() as i32).clamp(0, 8);
        let text = format!("{value:.*}", usize::try_from(digits).unwrap_or_default());
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.4e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_long_as_they_say_something() {
        let check = |value: f64, expected: &str| assert_eq!(number(value), expected);
        check(0.0, "0");
        check(-3.0, "-3");
        check(1_732_000_000.25, "1732000000.25");
        check(1.234_567_8, "1.23457");
        check(0.001_234_567_8, "0.00123457");
        check(-12.5, "-12.5");
        check(1e-9, "1.0000e-9");
        check(f64::NAN, "NaN");
        check(f64::INFINITY, "inf");
    }
}
