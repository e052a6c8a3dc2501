//! What `armor net check` found, as it is printed: one JSON object, or lines for people.

use std::collections::BTreeMap;

use std::fmt::Write;

use serde::Serialize;

/// All that was found. What is missing was not decided, or not asked.
#[derive(Debug, Default, Serialize)]
pub struct NetReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounded: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pumping: Option<PumpingReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub states: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edges: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dead_transitions: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadlocks: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadlock: Option<FiringSequence>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub components: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reversible: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home_states: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal: Option<GoalReport>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub exclusive: Vec<ExclusiveReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invariants: Option<Invariants>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undecided: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classes: Option<ClassReport>,
    /// What makes the check fail.
    pub errors: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct PumpingReport {
    pub prefix: Vec<String>,
    pub cycle: Vec<String>,
    pub growing: Vec<String>,
}

/// A state and the shortest firing sequence to it.
#[derive(Debug, Serialize)]
pub struct FiringSequence {
    pub sequence: Vec<String>,
    pub marking: BTreeMap<String, u32>,
}

#[derive(Debug, Serialize)]
pub struct GoalReport {
    pub place: String,
    pub always_reachable: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost: Option<FiringSequence>,
}

#[derive(Debug, Serialize)]
pub struct ExclusiveReport {
    pub places: [String; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub holds: Option<bool>,
    /// "invariant" or "states".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub together: Option<FiringSequence>,
}

/// The timed net.
#[derive(Debug, Default, Serialize)]
pub struct ClassReport {
    pub classes: u64,
    pub edges: u64,
    pub markings: u64,
    pub dead_transitions: Vec<String>,
    pub deadlocks: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadlock: Option<FiringSequence>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shortest: Option<TimedSequence>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest: Option<TimedSequence>,
    /// Why there is no longest time to the goal, with a firing sequence that shows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub no_longest: Option<NoLongest>,
}

#[derive(Debug, Serialize)]
pub struct TimedSequence {
    pub seconds: f64,
    pub sequence: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct NoLongest {
    pub why: &'static str,
    pub sequence: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub circle: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct Invariants {
    pub complete: bool,
    pub places: Vec<BTreeMap<String, u64>>,
    pub transitions: Vec<BTreeMap<String, u64>>,
}

impl NetReport {
    /// The report in lines.
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.untimed(&mut out);
        if let Some(classes) = &self.classes {
            classes.text(&mut out);
        }
        if let Some(invariants) = &self.invariants {
            invariants.text(&mut out);
        }
        for error in &self.errors {
            row(&mut out, "error", error);
        }
        out
    }

    fn untimed(&self, out: &mut String) {
        if let Some(bounded) = self.bounded {
            row(out, "bounded", yes(bounded));
        }
        if let Some(pumping) = &self.pumping {
            row(out, "  growing", sequence(&pumping.growing));
            row(out, "  after", sequence(&pumping.prefix));
            row(out, "  again and again", sequence(&pumping.cycle));
        }
        if let (Some(states), Some(edges)) = (self.states, self.edges) {
            row(out, "states", format!("{states}, {edges} edges"));
        }
        if let Some(dead) = &self.dead_transitions {
            row(out, "dead transitions", listed(dead));
        }
        if let Some(deadlocks) = self.deadlocks {
            row(out, "deadlocks", deadlocks);
        }
        write_sequence(out, self.deadlock.as_ref());
        if let (Some(reversible), Some(home)) = (self.reversible, self.home_states) {
            row(out, "reversible", yes(reversible));
            row(out, "home states", home);
        }
        if let Some(goal) = &self.goal {
            let reachable = if goal.always_reachable { "always" } else { "not always" };
            row(out, "goal reachable", format!("{}: {reachable}", goal.place));
            write_sequence(out, goal.lost.as_ref());
        }
        for exclusive in &self.exclusive {
            let [one, other] = &exclusive.places;
            let verdict = match (exclusive.holds, exclusive.by) {
                (Some(true), Some(by)) => format!("never together, by {by}"),
                (Some(false), _) => "together".into(),
                _ => "not decided".into(),
            };
            row(out, "exclusive", format!("{one} {other}: {verdict}"));
            write_sequence(out, exclusive.together.as_ref());
        }
    }
}

impl ClassReport {
    fn text(&self, out: &mut String) {
        row(out, "state classes", format!("{}, {} edges", self.classes, self.edges));
        row(out, "timed markings", self.markings);
        row(out, "timed dead", listed(&self.dead_transitions));
        row(out, "timed deadlocks", self.deadlocks);
        write_sequence(out, self.deadlock.as_ref());
        for (name, timed) in [("shortest", &self.shortest), ("longest", &self.longest)] {
            if let Some(timed) = timed {
                let fired = sequence(&timed.sequence);
                row(out, name, format!("{} s: {fired}", timed.seconds));
            }
        }
        if let Some(no) = &self.no_longest {
            row(out, "longest", no.why);
            row(out, "  after", sequence(&no.sequence));
            if !no.circle.is_empty() {
                row(out, "  again and again", sequence(&no.circle));
            }
        }
    }
}

impl Invariants {
    fn text(&self, out: &mut String) {
        for (name, semiflows) in
            [("place semiflows", &self.places), ("transition semiflows", &self.transitions)]
        {
            row(out, name, semiflows.len());
            for semiflow in semiflows {
                let term = |(name, weight): (&String, &u64)| match weight {
                    1 => name.clone(),
                    _ => format!("{weight} {name}"),
                };
                row(out, "", semiflow.iter().map(term).collect::<Vec<_>>().join(" + "));
            }
        }
        if !self.complete {
            row(out, "", "there are more: too many to list");
        }
    }
}

fn row(out: &mut String, name: &str, value: impl std::fmt::Display) {
    let _ = writeln!(out, "{name:20} {value}");
}

fn write_sequence(out: &mut String, found: Option<&FiringSequence>) {
    if let Some(found) = found {
        row(out, "  after", sequence(&found.sequence));
        let places: Vec<_> = found
            .marking
            .iter()
            .map(
                |(place, tokens)| {
                    if *tokens == 1 { place.clone() } else { format!("{tokens} {place}") }
                },
            )
            .collect();
        row(out, "  marked", listed(&places));
    }
}

fn sequence(names: &[String]) -> String {
    if names.is_empty() { "(nothing)".into() } else { names.join(" ") }
}

fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(" ") }
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}
