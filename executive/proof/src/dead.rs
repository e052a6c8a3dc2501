//! Transitions that no sequence of firings contains, and why: they lead on from the safe place, or
//! their guard is false whenever their places are marked.

use std::collections::BTreeSet;

use armor_petri::analysis::classes::is_possible;
use armor_petri::{NetTransition, PlaceId, TransitionId};
use armor_plan::Operand;
use armor_robotfile::guard::Scalar;
use armor_robotfile::mission::Autonomy;
use armor_robotfile::{Code, Finding, Findings};

use crate::precedence::find_preceding;
use crate::proof::Proof;

/// Most transitions whose values are looked at: each costs a pass through all states.
const MOST_EXPLAINED: usize = 8;
/// Most values of a variable that a message names one by one.
const MOST_NAMED: usize = 3;

impl Proof<'_> {
    pub(super) fn dead_transitions(&self, findings: &mut Findings) {
        let timed = self.dead_with_times();
        let dead: BTreeSet<_> = match &timed {
            Some(timed) if self.times_bound_it() => timed.clone(),
            _ => self.exploration.space.dead_transitions().collect(),
        };
        // One that fires would take a variable out of its domain, which is a finding of its own.
        let leaves_domain = |source: TransitionId| {
            self.analysed.outside.iter().any(|(copy, of)| *of == source && !dead.contains(copy))
        };
        let mut explained = 0;
        let mut late = Vec::new();
        for source in self.plan.net().transition_ids() {
            let arcs = self.plan.net().transition(source);
            let is_in = |dead: &BTreeSet<_>| self.copies(source).iter().all(|it| dead.contains(it));
            if leaves_domain(source) {
                continue;
            }
            if !is_in(&dead) {
                if timed.as_ref().is_some_and(is_in) && self.is_always_too_late(source) {
                    late.push(source);
                }
                continue;
            }
            // Where a place is never marked, the finding is about that place, or about a transition
            // that leads to it.
            let after_safe = self.leads_on_from_safe(arcs);
            let mut needed = arcs.inputs.iter().chain(&arcs.reads);
            if after_safe.is_none() && needed.any(|(place, _)| self.most_in(*place) == 0) {
                continue;
            }
            let finding = after_safe.or_else(|| self.find_preferred(source)).or_else(|| {
                explained += usize::from(self.plan.transition(source).guard.is_some());
                (explained <= MOST_EXPLAINED).then(|| self.guard_decides(source))?
            });
            findings.push(finding.unwrap_or_else(|| {
                let message =
                    format!("{} never fires: no sequence of firings contains it", arcs.name);
                let finding =
                    Finding::new(Code::NeverFires, self.at_transition(&arcs.name), message);
                explained += 1;
                let apart = (explained <= MOST_EXPLAINED).then(|| self.advise_apart(arcs));
                finding.remedy(apart.flatten().unwrap_or_else(|| {
                    "add transitions that lead to its places, or remove it".into()
                }))
            }));
        }
        self.report_late(&late, findings);
    }

    /// The transitions that never fire in time, where that is cheap to find out.
    fn dead_with_times(&self) -> Option<BTreeSet<TransitionId>> {
        let space = &self.exploration.space;
        if self.is_whole() {
            // Mostly the nearest firing of each is in time; otherwise all states with times decide.
            let mut unseen: BTreeSet<_> = self.net.transition_ids().collect();
            for id in space.dead_transitions() {
                unseen.remove(&id);
            }
            let mut is_in_time = true;
            for state in 0..space.states() as u32 {
                for (id, _) in space.successors(state) {
                    if is_in_time && unseen.remove(&id) {
                        let mut path = space.path_to(state).unwrap_or_default();
                        path.push(id);
                        is_in_time = is_possible(self.net, &path) == Ok(true);
                    }
                }
                if unseen.is_empty() || !is_in_time {
                    break;
                }
            }
            if unseen.is_empty() && is_in_time {
                return Some(space.dead_transitions().collect());
            }
        }
        let classes = self.timed_if_small()?;
        let all = (0..classes.classes() as u32).flat_map(|class| classes.successors(class));
        let fire: BTreeSet<_> = all.map(|firing| firing.0).collect();
        Some(self.net.transition_ids().filter(|id| !fire.contains(id)).collect())
    }

    /// A transition in whose place another one fires on the same report, wherever its own guard is true.
    fn find_preferred(&self, source: TransitionId) -> Option<Finding> {
        let preceding = find_preceding(self.plan, source);
        let arcs = self.plan.net().transition(source);
        let is_open = |id: TransitionId, marking: &[u32]| {
            let Some(guard) = &self.plan.transition(id).guard else { return true };
            let counters: Vec<_> = self.analysed.values(marking).map(|(_, value)| value).collect();
            let of = |operand: &Operand| Some(Scalar::Number(counters[operand.counter()?] as f64));
            let known: Vec<_> = guard.operands.iter().map(of).collect();
            let open: Vec<_> =
                guard.operands.iter().map(|operand| operand.counter().is_none()).collect();
            guard.guard.holds_whatever(&known, &open) != Some(false)
        };
        if preceding.is_empty() || self.analysed.open.is_some() {
            return None;
        }
        let seen = self.find_witness(&|marking| {
            let mut needed = arcs.inputs.iter().chain(&arcs.reads);
            needed.all(|(place, count)| marking[place.index()] >= *count)
                && is_open(source, marking)
        })?;
        let first = preceding.into_iter().find(|other| is_open(*other, &seen.marking))?;
        let (first, name) = (self.plan.net().transition(first), &arcs.name);
        let rank = if first.class == arcs.class { "priority" } else { "class" };
        let message = format!(
            "{name} never fires: {} has the higher {rank}, and the same report lets it fire first",
            first.name
        );
        let finding = Finding::new(Code::NeverFires, self.at_transition(name), message)
            .related(self.at_transition(&first.name), "this one fires first");
        let own_guard = self.plan.transition(source).guard.is_some();
        Some(finding.remedy(match rank {
            "priority" if own_guard => {
                format!("give {name} a higher priority than {}", first.name)
            }
            _ => format!("write when=\"…\" on {}, or another report", first.name),
        }))
    }

    /// Whether a transition has its tokens in some run, but never until its time has come. The
    /// examination of times leaves out that a person declines a question which fires without an
    /// answer: what competes with such a question may fire then.
    fn is_always_too_late(&self, transition: TransitionId) -> bool {
        let arcs = self.plan.net().transition(transition);
        let has_tokens = |marking: &[u32]| {
            arcs.inputs.iter().chain(&arcs.reads).all(|(place, n)| marking[place.index()] >= *n)
        };
        let competes = self.mission.transitions.iter().any(|other| {
            let shares =
                |place: &str| arcs.inputs.iter().any(|(id, _)| self.plan.net().place(*id) == place);
            other.name.value != arcs.name
                && matches!(other.autonomy, Autonomy::Confirm { fire_unanswered: true, .. })
                && other.inputs().any(|arc| shares(&arc.place.value))
        });
        !competes && self.find_witness(&has_tokens).is_some()
    }

    /// What to do about a transition that takes tokens from several places of which never all have
    /// theirs: from was probably taken for a choice.
    fn advise_apart(&self, transition: &NetTransition) -> Option<String> {
        let has_all = |marking: &[u32]| {
            transition.inputs.iter().all(|(place, count)| marking[place.index()] >= *count)
        };
        let names: Vec<_> =
            transition.inputs.iter().map(|(place, _)| self.net.place(*place)).collect();
        let (last, first) = names.split_last().filter(|(_, first)| !first.is_empty())?;
        self.find_witness(&has_all).is_none().then(|| {
            format!(
                "from takes a token from each of {} and {last}, which are never marked together: \
                 write one transition for each",
                first.join(", ")
            )
        })
    }

    /// A transition that takes a token from the safe place.
    fn leads_on_from_safe(&self, transition: &NetTransition) -> Option<Finding> {
        let safe = self.plan.safe()?;
        if !transition.inputs.iter().any(|(place, _)| *place == safe) {
            return None;
        }
        let (name, place) = (&transition.name, self.net.place(safe));
        let message = format!(
            "{name} never fires: it leads on from {place}, the safe place, and the mission is over \
             when {place} is marked"
        );
        let mut finding = Finding::new(Code::NeverFires, self.at_transition(name), message);
        if let Some(safe) = &self.mission.safe {
            finding = finding.related(&safe.at, "the safe place");
        }
        let remedy = "name another place as safe, or remove what leads on from it";
        Some(finding.remedy(match self.find_exchanged(transition, safe) {
            Some(to) => {
                let to = self.net.place(to);
                format!("did you mean from=\"{to}\" to=\"{place}\"? Otherwise {remedy}")
            }
            None => remedy.to_owned(),
        }))
    }

    /// Returns the place that a transition leads to from the safe place, if it is not the goal and no
    /// other transition leads from there to the safe place: from and to may be exchanged.
    fn find_exchanged(&self, transition: &NetTransition, safe: PlaceId) -> Option<PlaceId> {
        let ([_], [(to, _)]) = (&transition.inputs[..], &transition.outputs[..]) else {
            return None;
        };
        let net = self.plan.net();
        let mut others = net.transition_ids().map(|id| net.transition(id));
        let leads_back = others.any(|other| {
            other.inputs.iter().any(|(place, _)| place == to)
                && other.outputs.iter().any(|(place, _)| *place == safe)
        });
        (self.plan.goal() != Some(*to) && *to != safe && !leads_back).then_some(*to)
    }

    /// A transition whose places are marked, but whose guard is false for all values that its
    /// variables have there.
    fn guard_decides(&self, source: TransitionId) -> Option<Finding> {
        let guard = self.plan.transition(source).guard.as_ref()?;
        let counters: BTreeSet<_> =
            guard.operands.iter().filter_map(|operand| operand.counter()).collect();
        let arcs = self.plan.net().transition(source);
        let needed = || arcs.inputs.iter().chain(&arcs.reads);
        let mut values = vec![BTreeSet::new(); self.plan.counters().len()];
        let is_kept = |marking: &[u32]| {
            arcs.inhibitors.iter().any(|(place, count)| marking[place.index()] >= *count)
        };
        let mut note_values = |marking: &[u32]| {
            let has_all = needed().all(|(place, count)| marking[place.index()] >= *count);
            if has_all && !is_kept(marking) {
                for (seen, (_, value)) in values.iter_mut().zip(self.analysed.values(marking)) {
                    seen.insert(value);
                }
            }
        };
        if self.times_bound_it() {
            let (classes, _) = self.timed_so_far();
            (0..classes.classes() as u32).for_each(|class| note_values(classes.marking(class)));
        } else {
            self.exploration.space.find(|marking| {
                note_values(marking);
                false
            });
        }
        let names = counters.iter().map(|index| self.plan.counters()[*index].name.as_str());
        let seen: Vec<_> = names
            .clone()
            .zip(counters.iter().map(|index| &values[*index]))
            .filter(|(_, values)| !values.is_empty())
            .map(|(name, values)| format!("{name} is {}", values_in_words(values)))
            .collect();
        if seen.is_empty() {
            return None;
        }
        let name = &arcs.name;
        let written = self.mission.transitions.iter().find(|it| it.name.value == *name)?;
        let when = written.when.as_ref()?;
        let message = format!(
            "{name} never fires: `{}` is false whenever its places are marked, because {} there",
            when.value,
            seen.join(" and ")
        );
        let names: Vec<_> = names.collect();
        let finding = Finding::new(Code::NeverFires, self.at_transition(name), message);
        Some(finding.related(&when.at, "this guard").remedy(format!(
            "compare {} with a value that it has there, or let a transition before set it",
            names.join(" and ")
        )))
    }
}

/// "0", "0 or 1", "0 to 9".
pub(super) fn values_in_words(values: &BTreeSet<i64>) -> String {
    let shown: Vec<_> = values.iter().map(i64::to_string).collect();
    match shown.as_slice() {
        [first, .., last] if shown.len() > MOST_NAMED => format!("{first} to {last}"),
        all => all.join(" or "),
    }
}
