//! `armor mission replay FILE --fire`: firings of a mission, one by one, over the net that was
//! proven.

use std::io;

use anyhow::{Context, Result, bail};
use armor_petri::analysis::classes::is_possible;
use armor_petri::analysis::rules::FiringRules;
use armor_petri::{PlaceId, TransitionId};
use armor_plan::Plan;
use armor_proof::Analysed;
use armor_robotfile::advise_similar;
use serde_json::{Map, Value, json};

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line, print_wrapped};

/// Prints the marking at the start and after each firing.
///
/// # Errors
/// At a transition that the mission does not have, or that is not enabled there.
pub fn play(
    plan: &Plan,
    trace: &str,
    is_stepped: bool,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let analysed = Analysed::of(plan)?;
    let net = &analysed.net;
    let ends = [plan.goal(), plan.safe()];
    let separators = |c: char| c.is_whitespace() || c == ',';
    let names: Vec<_> = trace.split(separators).filter(|name| !name.is_empty()).collect();
    let walk =
        FiringWalk { analysed: &analysed, rules: FiringRules::new(net), ends, is_stepped, format };
    let marking = net.initial().to_vec();
    walk.print_step(None, &marking)?;
    let done = walk.go(&names, marking)?;
    let is_timely = is_possible(net, &done) == Ok(true);
    if !is_timely && format != OutputFormat::Json {
        return end_printing(print_line("as far as tokens go; its times do not allow this order"));
    }
    Ok(CommandEnding::Fine)
}

struct FiringWalk<'a> {
    analysed: &'a Analysed,
    rules: FiringRules,
    /// Goal and safe place.
    ends: [Option<PlaceId>; 2],
    is_stepped: bool,
    format: OutputFormat,
}

impl FiringWalk<'_> {
    fn go(&self, names: &[&str], mut marking: Vec<u32>) -> Result<Vec<TransitionId>> {
        let mut done = Vec::new();
        for (index, name) in names.iter().enumerate() {
            if self.is_stepped && io::stdin().read_line(&mut String::new())? == 0 {
                break;
            }
            let copies = self.named(name)?;
            let enabled = copies.iter().find(|id| self.rules.enabled(&marking, **id));
            let transition = *enabled.unwrap_or(&copies[0]);
            if enabled.is_none() {
                bail!(
                    "firing {} of {}: {}",
                    index + 1,
                    names.len(),
                    self.obstacle(transition, &marking)
                );
            }
            let fired = self.rules.fire(&mut marking, transition);
            fired.with_context(|| format!("{name}: a place cannot count its tokens"))?;
            done.push(transition);
            self.print_step(Some(name), &marking)?;
        }
        Ok(done)
    }

    /// The transitions of the net with this name: one for each combination of the values of
    /// variables that the mission's transition distinguishes.
    fn named(&self, name: &str) -> Result<Vec<TransitionId>> {
        let shown = (0..).map(TransitionId).zip(&self.analysed.shown);
        let found: Vec<_> = shown.filter(|it| it.1 == name).map(|it| it.0).collect();
        if found.is_empty() {
            let mut all = self.analysed.shown.clone();
            all.dedup();
            let advice = advise_similar(name, all.iter().map(String::as_str));
            bail!(
                "the mission has no transition called {name}{advice} (it has: {})",
                all.join(", ")
            );
        }
        Ok(found)
    }

    /// Why a transition is not enabled.
    fn obstacle(&self, transition: TransitionId, marking: &[u32]) -> String {
        let net = &self.analysed.net;
        let t = net.transition(transition);
        let name = &self.analysed.shown[transition.index()];
        if let Some(end) = self.ends.into_iter().flatten().find(|end| marking[end.index()] > 0) {
            return format!("{name} does not fire: the mission is over in {}", net.place(end));
        }
        let needed = t.inputs.iter().chain(&t.reads);
        let missing = needed.into_iter().find(|(place, weight)| marking[place.index()] < *weight);
        let limiting =
            t.inhibitors.iter().find(|(place, weight)| marking[place.index()] >= *weight);
        let is_of_mission = |place: PlaceId| place.index() < self.analysed.tokens(marking).len();
        let why = match (missing, limiting) {
            (Some((place, _)), _) if !is_of_mission(*place) => {
                "does not fire with these values of variables".to_owned()
            }
            (Some((place, weight)), _) => {
                let (place, there) = (net.place(*place), marking[place.index()]);
                format!("needs {weight} in {place}, which has {there}")
            }
            (None, Some((place, weight))) => {
                let (place, there) = (net.place(*place), marking[place.index()]);
                format!("wants fewer than {weight} in {place}, which has {there}")
            }
            (None, None) => "is not enabled".into(),
        };
        format!("{name} {why}; marked are {}", self.words(marking))
    }

    fn print_step(&self, fired: Option<&str>, marking: &[u32]) -> Result<()> {
        match self.format {
            OutputFormat::Json => {
                let enabled: Vec<_> = self.analysed.net.transition_ids().collect();
                let enabled = enabled.iter().filter(|id| self.rules.enabled(marking, **id));
                let enabled: Vec<_> =
                    enabled.map(|id| self.analysed.shown[id.index()].as_str()).collect();
                let marked = self.marked(marking).map(|(p, n)| (p.to_owned(), json!(n)));
                let marked: Map<String, Value> = marked.collect();
                let values =
                    self.analysed.values(marking).map(|(name, n)| (name.to_owned(), json!(n)));
                let values: Map<String, Value> = values.collect();
                print_line(json!({
                    "fired": fired, "marking": marked, "variables": values, "enabled": enabled
                }))
            }
            _ => print_wrapped(format!(
                "{:20} = {}",
                fired.unwrap_or("at the start"),
                self.words(marking)
            )),
        }
    }

    fn marked<'b>(&'b self, marking: &'b [u32]) -> impl Iterator<Item = (&'b str, u32)> {
        let tokens = self.analysed.tokens(marking).iter().copied();
        let places = self.analysed.net.places().iter().map(String::as_str).zip(tokens);
        places.filter(|(_, tokens)| *tokens > 0)
    }

    fn words(&self, marking: &[u32]) -> String {
        let place = |(name, tokens): (&str, u32)| match tokens {
            1 => name.to_owned(),
            n => format!("{n} {name}"),
        };
        let marked: Vec<_> = self.marked(marking).map(place).collect();
        let marked = if marked.is_empty() { "nothing".into() } else { marked.join(" ") };
        let values = self.analysed.values(marking).map(|(name, n)| format!("; {name} is {n}"));
        marked + &values.collect::<String>()
    }
}
