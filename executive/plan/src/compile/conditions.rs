//! Guards, variables and what transitions set, resolved to the data and counters they speak of.

use armor_robotfile::guard::{Count, Guard, Name};
use armor_robotfile::mission::{SetVariable, Transition, Variable};
use armor_robotfile::{Code, Location, Spanned};

use super::Compiler;
use crate::counters::{PlannedCounter, PlannedSet};
use crate::guards::{PlannedGuard, PlannedVariable};

impl Compiler {
    pub(super) fn variable(&mut self, variable: &Variable) {
        let Some(source) = &variable.source else {
            let name = variable.name.value.clone();
            match variable.counts() {
                Some(counts) => self.plan.counters.push(PlannedCounter { name, counts }),
                None => self.report(Code::BadValue, &variable.name.at, "it has no whole numbers"),
            }
            return;
        };
        let Some(name) = Name::of_data(&source.value) else {
            return self.report(Code::BadValue, &source.at, "this is not a field of data");
        };
        self.expect_data(&name, &source.at);
        let source = self.plan.watch(name.data().unwrap_or_default(), &name.fields());
        let end = |end: &Option<Spanned<f64>>| end.as_ref().map(|end| end.value);
        self.plan.variables.push(PlannedVariable {
            name: variable.name.value.clone(),
            source,
            minimum: end(&variable.minimum).unwrap_or(f64::NEG_INFINITY),
            maximum: end(&variable.maximum).unwrap_or(f64::INFINITY),
        });
    }

    pub(super) fn guard(
        &mut self,
        transition: &str,
        when: &Spanned<String>,
    ) -> Option<PlannedGuard> {
        let guard = match Guard::parse(&when.value) {
            Ok(guard) => guard,
            Err(error) => {
                self.report(Code::GuardSyntax, &when.at, &error.to_string());
                return None;
            }
        };
        for name in guard.names().iter().filter(|name| name.data().is_some()) {
            self.expect_data(name, &when.at);
        }
        let planned = self.plan.guard(transition, guard);
        if let Err(name) = &planned {
            let message = format!("there is no variable called {name}");
            self.report(Code::UnknownVariable, &when.at, &message);
        }
        planned.ok()
    }

    pub(super) fn sets(&self, transition: &Transition) -> Vec<PlannedSet> {
        let mut planned = Vec::new();
        for SetVariable { variable, value } in &transition.sets {
            let counters = &self.plan.counters;
            let counter = counters.iter().position(|counter| counter.name == variable.value);
            let Some(counter) = counter else {
                let message = format!("no transition can set {}", variable.value);
                self.report(Code::UnknownVariable, &variable.at, &message);
                continue;
            };
            let count = match Count::parse(&value.value) {
                Ok(count) => count,
                Err(error) => {
                    self.report(Code::CountSyntax, &value.at, &error.to_string());
                    continue;
                }
            };
            match self.plan.set(&transition.name, counter, count) {
                Ok(set) => planned.push(set),
                Err(name) => {
                    let message = format!("there is no variable called {name}");
                    self.report(Code::UnknownVariable, &value.at, &message);
                }
            }
        }
        planned
    }

    fn expect_data(&self, name: &Name, at: &Location) {
        let component = name.as_str().split('.').next().unwrap_or_default();
        if self.idle.contains(component) {
            self.idle(component, at);
        } else if !self.components.contains_key(component) {
            let message = format!("there is no component called {component}");
            self.report(Code::UnknownComponent, at, &message);
        }
    }
}
