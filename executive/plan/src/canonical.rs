//! The canonical text of a plan: one spelling for all plans of the same mission, independent of the
//! Rust types that hold them. The fingerprint of a plan is a hash of it, and journals of earlier
//! builds are read by it: a word or an order changed here makes them unreadable.

use crate::counters::{PlannedCounter, PlannedSet};
use crate::dates::PlannedDates;
use crate::guards::{Operand, PlannedGuard, PlannedVariable, Watch, WatchId};
use crate::limits::OnResume;
use crate::plan::Plan;
use crate::planned::{ComponentId, PlannedComponent, PlannedPlace, PlannedTransition};
use crate::values::GivenValue;
use armor_petri::{FiringClass, FiringInterval, NetTransition, PlaceId, TransitionId};
use armor_robotfile::Date;
use armor_robotfile::mission::{Autonomy, Counts, LostLink, Missed};
use std::fmt::Display;
use std::time::Duration;

/// Returns the canonical text of a plan.
///
/// One fact per line, ids replaced by names. Places and transitions are in the order of the file,
/// which decides between equal priorities and between values for one parameter; everything else is
/// sorted by name. Not part of it: the version of the file, where something is written in it, the
/// waiting times, and under which number a field of data is watched, which depends on the versions
/// before.
pub(crate) fn canonical_text(plan: &Plan) -> String {
    write_plan(plan, true)
}

/// Returns the same without the values that places give.
pub(crate) fn text_without_values(plan: &Plan) -> String {
    write_plan(plan, false)
}

fn write_plan(plan: &Plan, has_values: bool) -> String {
    let mut writer = CanonicalWriter { plan, has_values, text: String::new() };
    writer.mission();
    writer.components();
    plan.place_ids().for_each(|id| writer.place(id));
    writer.variables();
    writer.counters();
    plan.net.transition_ids().for_each(|id| writer.transition(id));
    writer.text
}

struct CanonicalWriter<'a> {
    plan: &'a Plan,
    has_values: bool,
    text: String,
}

// Each struct is taken apart without `..`: a field that is added has to be written or left out
// here.
impl CanonicalWriter<'_> {
    fn mission(&mut self) {
        self.fact("mission", [quoted(&self.plan.mission)]);
        self.optional_place("goal", self.plan.goal);
        self.optional_place("safe", self.plan.safe);
        if let Some(period) = self.plan.period {
            self.fact("period-ns", [nanoseconds(period)]);
        }
        let on_resume = match self.plan.on_resume {
            OnResume::Continue => "continue",
            OnResume::Hold => "hold",
            OnResume::Safe => "safe",
        };
        self.fact("resume", [on_resume]);
    }

    fn components(&mut self) {
        let mut components: Vec<_> = self.plan.components.iter().collect();
        components.sort_by_key(|component| &component.name);
        for component in components {
            // The places that activate it are written with the places.
            let PlannedComponent { name, controllable, places: _, peers, returns, return_within } =
                component;
            self.fact("component", [quoted(name)]);
            self.fact(" controllable", [controllable]);
            self.fact(" returns", [returns]);
            if *return_within != self.plan.limits.return_within {
                self.fact(" within", [return_within.as_millis()]);
            }
            for peer in self.sorted_components(peers) {
                self.fact(" excludes", [peer]);
            }
        }
    }

    fn place(&mut self, id: PlaceId) {
        let PlannedPlace { components, on_failure, safety, values } = self.plan.place(id);
        self.fact("place", [self.place_name(id)]);
        self.fact(" tokens", [self.plan.net.initial()[id.index()]]);
        self.fact(" safety", [safety]);
        self.optional_place(" on-failure", *on_failure);
        for component in self.sorted_components(components) {
            self.fact(" activates", [component]);
        }
        let mut given: Vec<_> = values.iter().filter(|_| self.has_values).collect();
        // Stable: of two values for one parameter the first one counts.
        given.sort_by_key(|(component, value)| {
            (&self.plan.component(*component).name, &value.parameter)
        });
        for (component, value) in given {
            let GivenValue { parameter, text, folder, origin: _ } = value;
            let component = self.component_name(*component);
            let folder = quoted(&folder.to_string_lossy());
            self.fact(" gives", [component, quoted(parameter), quoted(text), folder]);
        }
    }

    fn variables(&mut self) {
        let mut variables: Vec<_> = self.plan.variables.iter().collect();
        variables.sort_by_key(|variable| &variable.name);
        for variable in variables {
            let PlannedVariable { name, source, minimum, maximum } = variable;
            self.fact("variable", [quoted(name)]);
            self.fact(" source", self.field_names(*source));
            self.fact(" domain", [minimum, maximum]);
        }
    }

    fn counters(&mut self) {
        let mut counters: Vec<_> = self.plan.counters.iter().collect();
        counters.sort_by_key(|counter| &counter.name);
        for counter in counters {
            let PlannedCounter { name, counts: Counts { minimum, maximum, initial } } = counter;
            self.fact("counter", [quoted(name)]);
            self.fact(" domain", [minimum, maximum]);
            self.fact(" initial", [initial]);
        }
    }

    fn transition(&mut self, id: TransitionId) {
        let NetTransition {
            name,
            inputs,
            outputs,
            reads,
            inhibitors,
            resets,
            class,
            priority,
            interval: FiringInterval { earliest, latest },
            gated,
        } = self.plan.net.transition(id);
        self.fact("transition", [quoted(name)]);
        self.arcs(" takes", inputs);
        self.arcs(" puts", outputs);
        self.arcs(" reads", reads);
        self.arcs(" inhibited-by", inhibitors);
        let mut emptied: Vec<_> = resets.iter().map(|place| self.place_name(*place)).collect();
        emptied.sort_unstable();
        emptied.into_iter().for_each(|place| self.fact(" empties", [place]));
        let class = match class {
            FiringClass::Safety => "safety",
            FiringClass::Ordinary => "ordinary",
        };
        self.fact(" class", [class]);
        self.fact(" priority", [priority]);
        let latest = latest.map_or("none".to_owned(), nanoseconds);
        self.fact(" interval-ns", [nanoseconds(*earliest), latest]);
        self.fact(" gated", [gated]);
        self.conditions(self.plan.transition(id));
    }

    fn conditions(&mut self, planned: &PlannedTransition) {
        let PlannedTransition {
            on,
            guard,
            sets,
            dates,
            on_stop_fail,
            on_start_fail,
            overrun,
            autonomy,
            lost_link,
        } = planned;
        if let Some((component, report)) = on {
            self.fact(" on", [self.component_name(*component), quoted(report)]);
        }
        if let Some(guard) = guard {
            self.guard(guard);
        }
        for PlannedSet { counter, value, operands } in sets {
            self.fact(" sets", [self.counter_name(*counter), quoted(&value.to_string())]);
            for (name, counter) in value.names().iter().zip(operands) {
                self.fact("  counter", [quoted(name.as_str()), self.counter_name(*counter)]);
            }
        }
        if let Some(dates) = dates {
            self.dates(dates);
        }
        self.optional_place(" on-stop-fail", *on_stop_fail);
        self.optional_place(" on-start-fail", *on_start_fail);
        self.optional_place(" overrun", *overrun);
        match autonomy {
            Autonomy::Auto => self.fact(" autonomy", ["auto"]),
            Autonomy::Operator => self.fact(" autonomy", ["operator"]),
            Autonomy::Confirm { within, fire_unanswered } => {
                self.fact(" autonomy", ["confirm"]);
                let within = within.map_or("none".to_owned(), nanoseconds);
                self.fact("  answer-within-ns", [within]);
                self.fact("  fires-unanswered", [fire_unanswered]);
            }
        }
        match lost_link {
            None => {}
            Some(LostLink::Fire) => self.fact(" lost-link", ["fire"]),
            Some(LostLink::Wait) => self.fact(" lost-link", ["wait"]),
        }
    }

    fn guard(&mut self, guard: &PlannedGuard) {
        let PlannedGuard { guard, operands } = guard;
        self.fact(" when", [quoted(&guard.to_string())]);
        for (name, operand) in guard.names().iter().zip(operands) {
            let name = quoted(name.as_str());
            match operand {
                Operand::Field(watch) => {
                    let field = self.field_names(*watch);
                    self.fact("  field", std::iter::once(name).chain(field));
                }
                Operand::Variable(index) => {
                    let variable = quoted(&self.plan.variables[*index].name);
                    self.fact("  variable", [name, variable]);
                }
                Operand::Counter(index) => {
                    self.fact("  counter", [name, self.counter_name(*index)]);
                }
            }
        }
    }

    fn dates(&mut self, dates: &PlannedDates) {
        let PlannedDates { first, last, missed } = dates;
        let text = |date: &Option<Date>| date.map_or("none".to_owned(), |date| date.to_string());
        self.fact(" dates", [text(first), text(last)]);
        let missed = match missed {
            Missed::Fire => "fire",
            Missed::Skip => "skip",
            Missed::Fail => "fail",
        };
        self.fact("  missed", [missed]);
    }

    fn arcs(&mut self, kind: &str, arcs: &[(PlaceId, u32)]) {
        let mut named: Vec<_> = arcs.iter().map(|arc| (self.place_name(arc.0), arc.1)).collect();
        named.sort_unstable();
        for (place, weight) in named {
            self.fact(kind, [place, weight.to_string()]);
        }
    }

    fn optional_place(&mut self, kind: &str, place: Option<PlaceId>) {
        if let Some(place) = place {
            self.fact(kind, [self.place_name(place)]);
        }
    }

    /// Writes one line.
    fn fact(&mut self, kind: &str, values: impl IntoIterator<Item = impl Display>) {
        self.text.push_str(kind);
        for value in values {
            self.text.push(' ');
            self.text.push_str(&value.to_string());
        }
        self.text.push('\n');
    }

    fn place_name(&self, id: PlaceId) -> String {
        quoted(self.plan.net.place(id))
    }

    fn component_name(&self, id: ComponentId) -> String {
        quoted(&self.plan.component(id).name)
    }

    fn counter_name(&self, index: usize) -> String {
        quoted(&self.plan.counters[index].name)
    }

    fn sorted_components(&self, ids: &[ComponentId]) -> Vec<String> {
        let mut names: Vec<_> = ids.iter().map(|id| self.component_name(*id)).collect();
        names.sort_unstable();
        names
    }

    /// Returns the data, then the fields that lead to the value.
    fn field_names(&self, watch: WatchId) -> Vec<String> {
        let Watch { data, field } = &self.plan.watches[watch.index()];
        std::iter::once(data).chain(field).map(|name| quoted(name)).collect()
    }
}

/// Puts a name between quotes, so that no name can be read as two, or as the next line.
fn quoted(name: &str) -> String {
    let escaped = name.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
    format!("\"{escaped}\"")
}

fn nanoseconds(duration: Duration) -> String {
    duration.as_nanos().to_string()
}

#[cfg(test)]
mod tests;
