//! The `<set>`s of transitions: whether the variable is one that they may set, and whether the
//! value is a whole number that it can be.

use std::collections::{BTreeMap, BTreeSet};

use super::{known_variable, within};
use crate::check::names::listed;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::{Count, Meaning, range_of};
use crate::mission::{Mission, SetVariable, Transition, Variable};
use crate::suggestion::suggest_similar;

/// Returns whether all could be read. Adds the variables in their values to `used`.
pub(super) fn check(
    mission: &Mission,
    variables: &BTreeMap<&str, Meaning>,
    used: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> bool {
    let mut sets = Sets { mission, variables, used, findings, all_read: true };
    mission.transitions.iter().for_each(|transition| sets.check_transition(transition));
    sets.all_read
}

/// Whether it follows data, or some transition sets it.
pub(super) fn is_set(mission: &Mission, variable: &Variable) -> bool {
    let mut sets = mission.transitions.iter().flat_map(|transition| &transition.sets);
    variable.source.is_some() || sets.any(|set| set.variable.value == variable.name.value)
}

struct Sets<'a> {
    mission: &'a Mission,
    variables: &'a BTreeMap<&'a str, Meaning>,
    used: &'a mut BTreeSet<String>,
    findings: &'a mut Findings,
    all_read: bool,
}

impl Sets<'_> {
    fn check_transition(&mut self, transition: &Transition) {
        let mut before = BTreeMap::new();
        for set in &transition.sets {
            let name = set.variable.value.as_str();
            if let Some(first) = before.insert(name, &set.variable.at) {
                let message = format!("{} sets {name} twice", transition.name.value);
                let finding = Finding::new(Code::NotSettable, &set.variable.at, message);
                self.findings.push(finding.remedy("keep one of them").related(first, "first here"));
            }
            self.check_set(set);
        }
    }

    fn check_set(&mut self, set: &SetVariable) {
        let before = self.findings.total();
        let target = self.find_target(set);
        let is_refused = self.findings.total() > before;
        let count = match Count::parse(&set.value.value) {
            Ok(count) => count,
            Err(error) => {
                self.all_read = false;
                // A reference that XML does not know is a finding already.
                let mut of_xml = Findings::default();
                crate::start_tag::unescape(&set.value.at, &mut of_xml);
                if of_xml.is_empty() {
                    let at = within(&set.value, error.at);
                    let finding = Finding::new(Code::CountSyntax, &at, error.message);
                    self.findings.push(finding.remedy(error.remedy));
                }
                return;
            }
        };
        let mut meanings = Vec::new();
        for name in count.names() {
            let meaning = known_variable(name, &set.value, self.variables, self.findings);
            let Some(meaning) = meaning else {
                self.all_read = false;
                return;
            };
            if name.as_str() != set.variable.value {
                self.used.insert(name.as_str().to_owned());
            }
            if self.find_variable(name.as_str()).is_some_and(|variable| variable.source.is_some()) {
                // The same variable cannot be set either, which is a finding already.
                if is_refused && name.as_str() == set.variable.value {
                    return;
                }
                let message = format!("{name} follows data, which a value that is set may not use");
                let at = within(&set.value, name.at.clone());
                let finding = Finding::new(Code::CountSyntax, &at, message);
                self.findings.push(finding.remedy("use variables that transitions set"));
                return;
            }
            meanings.push(meaning);
        }
        if let Some(target) = target {
            self.expect_inside(set, target, &count, &meanings);
        }
    }

    /// The variable that is set, if it can be.
    fn find_target(&mut self, set: &SetVariable) -> Option<Meaning> {
        let name = set.variable.value.as_str();
        let Some(variable) = self.find_variable(name) else {
            let names = || self.variables.keys().copied();
            if !self.mission.unreadable.may_contain(name) {
                let message = format!("there is no variable called {name}");
                let remedy = suggest_similar(name, names()).unwrap_or_else(|| {
                    format!("declare a <variable>; variables: {}", listed(names()))
                });
                let finding = Finding::new(Code::UnknownVariable, &set.variable.at, message);
                self.findings.push(finding.remedy(remedy));
            }
            return None;
        };
        if let Some(source) = &variable.source {
            let message = format!("{name} follows {}, so no transition may set it", source.value);
            let finding = Finding::new(Code::NotSettable, &set.variable.at, message);
            let remedy = "remove the source of the variable, or set another one";
            self.findings.push(finding.remedy(remedy).related(&source.at, "its source"));
            return None;
        }
        self.variables.get(name).cloned()
    }

    fn find_variable(&self, name: &str) -> Option<&Variable> {
        self.mission.variables.iter().find(|variable| variable.name.value == name)
    }

    /// Only a value that is always outside the domain is a finding here. The proof finds those that
    /// may be outside, because it knows the reachable values.
    fn expect_inside(
        &mut self,
        set: &SetVariable,
        target: Meaning,
        count: &Count,
        meanings: &[Meaning],
    ) {
        let (low, high) = range_of(count, meanings);
        if low <= target.within.1 && high >= target.within.0 {
            return;
        }
        let (name, is) = (&set.variable.value, target.domain);
        let message = format!("{name} is {is}, and `{}` is always outside", set.value.value);
        let finding = Finding::new(Code::CountSyntax, &set.value.at, message);
        self.findings.push(finding.remedy("set it to a value in its domain, or widen the domain"));
    }
}
