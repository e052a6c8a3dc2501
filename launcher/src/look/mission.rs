//! `armor mission show`: where the mission stands, from what the executive publishes.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_executive::{EnabledTransition, InFlight, MarkedPlace, Marking, MissionComponent};
use armor_sdk::tap::Tap;
use armor_wire::WireType;
use armor_wire::codec;
use armor_wire::schema::{Schema, to_json};

use super::{Observed, printed, say};
use crate::arguments::{Format, Running};
use crate::exit::Ending;
use crate::print;

/// What the executive publishes, latched, at every change.
const MARKING: &str = "executive.marking";
/// How long a latched value may take to come.
const FIRST_WITHIN: Duration = Duration::from_secs(3);
/// How often to look whether the link still is; changes come at once.
const LOOK_EVERY: Duration = Duration::from_secs(3600);

/// Prints the marking, and again at every change if it is followed.
///
/// # Errors
/// If no mission runs.
pub fn show(running: &Running, follow: bool, format: Format) -> Result<Ending> {
    let observed = Observed::find(running, "mission")?;
    let tap = observed.tap(MARKING).context("no mission runs in this system")?;
    printed(follow_marking(&observed, tap, follow, format))
}

fn follow_marking(observed: &Observed, mut tap: Tap, follow: bool, format: Format) -> Result<()> {
    let mut shown = Shown { observed, schema: tap.schema().clone(), format, before: false };
    let Some(first) = tap.next(FIRST_WITHIN)? else {
        bail!("the executive has not said its marking within {} s", FIRST_WITHIN.as_secs());
    };
    shown.show(&first.payload)?;
    if !follow {
        return Ok(());
    }
    loop {
        if let Some(next) = tap.next(LOOK_EVERY)? {
            shown.show(&next.payload)?;
        }
    }
}

struct Shown<'a> {
    observed: &'a Observed,
    schema: Schema,
    format: Format,
    before: bool,
}

impl Shown<'_> {
    fn show(&mut self, payload: &[u8]) -> Result<()> {
        if self.format == Format::Json {
            let value = to_json(&self.schema, payload);
            return say(value.with_context(|| format!("{MARKING} does not fit its own schema"))?);
        }
        if self.schema.hash() != Marking::schema().hash() {
            bail!("this executive is of another version; --format json shows what it says");
        }
        if std::mem::replace(&mut self.before, true) {
            say("")?;
        }
        let marking: Marking = codec::decode(payload)?;
        // It was said when it changed, and its clocks have run since.
        let age_s = (self.observed.timestamp() - marking.stamp).max(0.0);
        say(in_words(&marking, age_s).trim_end())
    }
}

fn in_words(marking: &Marking, age_s: f64) -> String {
    let now_s = marking.now_at_s + age_s;
    let mut out = format!(
        "mission {}: {}, {} after its start, {} fired\n",
        marking.mission,
        marking.stage,
        print::duration(now_s),
        marking.fired
    );
    if !marking.why.is_empty() {
        out += &format!("because {}\n", marking.why);
    }
    let mut rows = Vec::new();
    let mut section = |name: &str, lines: Vec<String>| {
        let lines = if lines.is_empty() { vec!["none".into()] } else { lines };
        for (number, line) in lines.into_iter().enumerate() {
            rows.push((if number == 0 { name.to_owned() } else { String::new() }, line));
        }
    };
    section("marked", marking.places.iter().map(place).collect());
    section("in flight", marking.in_flight.iter().map(flight).collect());
    section("can fire", marking.enabled.iter().map(|it| transition(it, now_s)).collect());
    section("components", marking.components.iter().map(component).collect());
    let history = marking.history.iter();
    section(
        "fired",
        history.map(|it| format!("{} at {:.1} s", it.transition, it.fired_at_s)).collect(),
    );
    for (name, line) in rows {
        out += &format!("{name:10}  {line}\n");
    }
    if marking.late_reports + marking.unheard_reports > 0 {
        out += &format!(
            "reports that changed nothing: {} too late, {} that no transition waits for\n",
            marking.late_reports, marking.unheard_reports
        );
    }
    out
}

fn place(place: &MarkedPlace) -> String {
    let tokens = if place.tokens == 1 { String::new() } else { format!(" x {}", place.tokens) };
    let active = if place.active { "" } else { "  (not all of its components run yet)" };
    format!("{}{tokens}{active}", place.place)
}

fn flight(flight: &InFlight) -> String {
    let waits = if flight.waits_for.is_empty() {
        String::new()
    } else {
        format!(", waits for {}", flight.waits_for.join(" "))
    };
    let (from, to) = (flight.from.join(" "), flight.to.join(" "));
    format!("{}: {from} -> {to}, {}{waits}", flight.cause, flight.phase)
}

fn transition(transition: &EnabledTransition, now_s: f64) -> String {
    let in_s = |at_s: f64| match at_s - now_s {
        left_s if left_s <= 0.0 => "now".into(),
        left_s => format!("in {}", print::duration(left_s)),
    };
    let (first, last) = (transition.earliest_at_s, transition.latest_at_s);
    let until = match last {
        Some(last) if last > first => format!(", at the latest {}", in_s(last)),
        _ => String::new(),
    };
    format!("{} {}{until}", transition.transition, in_s(first))
}

fn component(component: &MissionComponent) -> String {
    let always = if component.controlled { "" } else { "  (not controlled by the mission)" };
    format!("{} {}{always}", component.component, component.state)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marking_in_words() {
        let marking = Marking {
            stamp: 1.7e9,
            mission: "survey".into(),
            now_at_s: 11.5,
            stage: "playing".into(),
            why: String::new(),
            places: vec![MarkedPlace { place: "explore".into(), tokens: 1, active: true }],
            in_flight: Vec::new(),
            enabled: vec![EnabledTransition {
                transition: "late".into(),
                enabled_at_s: 0.0,
                earliest_at_s: 150.0,
                latest_at_s: Some(150.0),
                by: "mission".into(),
                held: false,
            }],
            components: vec![MissionComponent {
                component: "explorer".into(),
                controlled: true,
                state: "active".into(),
                activation: 1,
            }],
            fired: 0,
            history: Vec::new(),
            late_reports: 0,
            unheard_reports: 2,
            pause: None,
            holder: None,
            link_lost_at_s: None,
            confirmations: Vec::new(),
            orders: Vec::new(),
        };
        let expected = "\
mission survey: playing, 12.0 s after its start, 0 fired
marked      explore
in flight   none
can fire    late in 2 min 18 s
components  explorer active
fired       none
reports that changed nothing: 0 too late, 2 that no transition waits for
";
        assert_eq!(in_words(&marking, 0.5), expected);
    }
}
