//! The `<check>`s of missions: whether each can be read, and whether everything that it names
//! exists, also in sub-missions. The executive proves them.

use std::collections::BTreeSet;
use std::path::Path;

use crate::check::graph::CheckGraph;
use crate::check::guards::within;
use crate::check::names::listed;
use crate::claim::{Claim, Name, Relation, Sort, Sum};
use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::mission::{Mission, Variable};
use crate::model::Configuration;
use crate::source::Spanned;
use crate::suggestion::suggest_similar;
use crate::unreadable::UnreadableParts;

pub(super) fn check(configuration: &Configuration, findings: &mut Findings) {
    for mission in configuration.missions().filter(|mission| !mission.checks.is_empty()) {
        if contains_itself(configuration, mission) {
            continue;
        }
        // If it is too large with its sub-missions, the executive reports that.
        let Ok(whole) = configuration.flatten(mission) else { continue };
        let known = ClaimNames::of(configuration, mission, &whole);
        mission.checks.iter().for_each(|text| check_one(text, &known, findings));
    }
}

/// Returns whether the mission has a sub-mission that contains itself. That is a finding already,
/// and such a mission cannot be flattened.
fn contains_itself(configuration: &Configuration, mission: &Mission) -> bool {
    let included = || configuration.included.iter().map(|(path, inner)| (path.as_path(), inner));
    let nodes = std::iter::once(None).chain(included().map(|(path, _)| Some(path)));
    let inner = included().flat_map(|(path, inner)| submission_edges(Some(path), inner));
    let edges = submission_edges(None, mission).chain(inner);
    CheckGraph::new(nodes, edges).has_circle_below(None)
}

/// Returns the edges from a mission to its sub-missions; `file` is none for the one that is checked.
fn submission_edges<'a>(
    file: Option<&'a Path>,
    mission: &'a Mission,
) -> impl Iterator<Item = (Option<&'a Path>, Option<&'a Path>, ())> {
    let submissions = mission.submissions.iter();
    submissions.map(move |submission| (file, Some(submission.path.as_path()), ()))
}

fn check_one(text: &Spanned<String>, known: &ClaimNames<'_>, findings: &mut Findings) {
    let claim = match Claim::parse(&text.value) {
        Ok(claim) => claim,
        Err(error) => {
            // An unknown XML entity is a finding already.
            let mut of_xml = Findings::default();
            crate::start_tag::unescape(&text.at, &mut of_xml);
            if of_xml.is_empty() {
                let at = within(text, error.at);
                findings
                    .push(Finding::new(Code::CheckSyntax, &at, error.message).remedy(error.remedy));
            }
            return;
        }
    };
    let names = claim.names();
    let bare: Vec<_> =
        names.iter().filter(|(sort, name)| known.is_bare_component(*sort, name)).collect();
    if let [(_, first), others @ ..] = &bare[..] {
        known.report_bare_components(first, others.iter().map(|(_, name)| *name), text, findings);
    }
    for (sort, name) in names.iter().filter(|(sort, name)| !known.is_bare_component(*sort, name)) {
        known.expect(*sort, name, text, findings);
    }
    for (name, number, is) in find_constant(&claim, known.variables) {
        let (variable, at) = (name.as_str(), within(text, name.at.clone()));
        let message = format!(
            "this comparison with {number} is always {is}: {variable} is {}",
            known.domain(variable)
        );
        let finding = Finding::new(Code::GuardConstant, &at, message);
        findings.push(
            finding.remedy(format!("compare {variable} with a value of its domain, or widen it")),
        );
    }
}

/// Returns the comparisons of a claim between one variable and a number outside of its domain, which
/// decides them.
fn find_constant<'a>(claim: &'a Claim, variables: &[Variable]) -> Vec<(&'a Name, u64, bool)> {
    let range = |sum: &'a Sum| match sum.places.as_slice() {
        [] => Some((None, sum.number as i64, sum.number as i64)),
        [name] if sum.number == 0 => {
            let variable = variables.iter().find(|it| it.name.value == name.as_str())?;
            let counts = variable.counts()?;
            Some((Some(name), counts.minimum, counts.maximum))
        }
        _ => None,
    };
    let decide = |(left, relation, right): (&'a Sum, Relation, &'a Sum)| {
        let ((one, low, high), (other, least, most)) = (range(left)?, range(right)?);
        let (name, number) = match (one, other) {
            (Some(name), None) => (name, right.number),
            (None, Some(name)) => (name, left.number),
            _ => return None,
        };
        let (is_below, is_above) = (high < least, low > most);
        if !is_below && !is_above {
            return None;
        }
        Some((
            name,
            number,
            match relation {
                Relation::Less | Relation::LessOrEqual => is_below,
                Relation::Greater | Relation::GreaterOrEqual => is_above,
                Relation::Equal => false,
                Relation::Unequal => true,
            },
        ))
    };
    claim.comparisons().into_iter().filter_map(decide).collect()
}

/// The names that a check may use.
struct ClaimNames<'a> {
    mission: &'a Mission,
    /// Those of the mission and its sub-missions.
    variables: &'a [Variable],
    places: BTreeSet<&'a str>,
    /// Places, and variables that transitions set.
    counts: BTreeSet<&'a str>,
    transitions: BTreeSet<&'a str>,
    /// Components that at least one place activates.
    components: BTreeSet<&'a str>,
    /// The unreadable parts of the system.
    unreadable: &'a UnreadableParts,
    /// Whether a place names a component that does not exist, which may be any of them.
    is_component_unknown: bool,
    /// Whether the file of a sub-mission could not be read, so that its names are not known.
    has_unread: bool,
}

impl<'a> ClaimNames<'a> {
    fn of(configuration: &'a Configuration, mission: &'a Mission, whole: &'a Mission) -> Self {
        let active = whole.places.iter().flat_map(|place| &place.components);
        let existing = configuration.system.components.iter();
        let existing: BTreeSet<_> = existing.map(|it| it.name.value.as_str()).collect();
        let is_component_unknown =
            !active.clone().all(|name| existing.contains(name.value.as_str()));
        let places: BTreeSet<_> =
            whole.places.iter().map(|place| place.name.value.as_str()).collect();
        let counted = whole.variables.iter().filter(|variable| variable.source.is_none());
        let counted = counted.map(|variable| variable.name.value.as_str());
        Self {
            mission,
            variables: &whole.variables,
            counts: counted.chain(places.iter().copied()).collect(),
            places,
            transitions: whole.transitions.iter().map(|t| t.name.value.as_str()).collect(),
            components: active.map(|name| name.value.as_str()).collect(),
            unreadable: &configuration.system.unreadable,
            is_component_unknown,
            has_unread: configuration
                .missions()
                .flat_map(|mission| &mission.submissions)
                .any(|inner| !configuration.included.contains_key(&inner.path)),
        }
    }

    /// The domain of a variable, in words.
    fn domain(&self, name: &str) -> String {
        let variable = self.variables.iter().find(|variable| variable.name.value == name);
        let counts = variable.and_then(Variable::counts);
        counts.map_or_else(String::new, |it| format!("{} to {}", it.minimum, it.maximum))
    }

    fn expect(&self, sort: Sort, name: &Name, text: &Spanned<String>, findings: &mut Findings) {
        let (known, code) = match sort {
            Sort::Place => (&self.places, Code::UnknownPlace),
            Sort::Count => (&self.counts, Code::UnknownPlace),
            Sort::Transition => (&self.transitions, Code::UnknownTransition),
            Sort::Component => (&self.components, Code::UnknownComponent),
        };
        let own = name.as_str();
        let is_doubtful = match sort {
            Sort::Place => self.mission.unreadable.may_contain(own),
            // That a variable which transitions set does not exist is a finding already.
            Sort::Count => {
                let mut sets = self.mission.transitions.iter().flat_map(|it| &it.sets);
                self.mission.unreadable.may_contain(own)
                    || sets.any(|set| set.variable.value == own)
            }
            Sort::Transition => self.mission.unreadable.in_moves,
            Sort::Component => {
                self.is_component_unknown
                    || self.unreadable.may_contain(own)
                    || self.mission.unreadable.in_start
            }
        };
        let is_of_unread = self.has_unread && (own.contains('.') || sort == Sort::Component);
        if known.contains(own) || is_doubtful || is_of_unread {
            return;
        }
        let message = match sort {
            Sort::Component => format!("no place activates a component called {}", short(own)),
            Sort::Count if self.counts.len() == self.places.len() => {
                format!("there is no place called {}", short(own))
            }
            _ => format!("there is no {} called {}", sort.noun(), short(own)),
        };
        let all = || known.iter().copied();
        let guess = match self.is_other_sort(sort, own) {
            true => None,
            false => suggest_inner(own, all()).or_else(|| suggest_similar(own, all())),
        };
        let guess = guess.or_else(|| self.suggest_submission(own));
        let remedy = guess.unwrap_or_else(|| self.suggest_remedy(sort, own, listed(all())));
        let at = within(text, name.at.clone());
        findings.push(Finding::new(code, &at, message).remedy(remedy));
    }

    /// Returns the remedy for a name of a sub-mission that the mission does not include.
    fn suggest_submission(&self, name: &str) -> Option<String> {
        let (inner, _) = name.split_once('.')?;
        let mut known = self.transitions.iter().chain(&self.places);
        let is_of_inner = |known: &&&str| known.split_once('.').is_some_and(|it| it.0 == inner);
        known.find(is_of_inner).is_none().then(|| {
            format!(
                "the mission includes no sub-mission {inner}: add <submission ref=\"{inner}.xml\" \
                 in=\"…\" out=\"…\"/>"
            )
        })
    }

    /// Returns whether a place is expected and a component is named, which is meant to be active.
    fn is_bare_component(&self, sort: Sort, name: &Name) -> bool {
        let own = name.as_str();
        matches!(sort, Sort::Place | Sort::Count)
            && self.components.contains(own)
            && !self.counts.contains(own)
            && !self.places.contains(own)
            && !self.transitions.contains(own)
    }

    /// Reports the components of one check that are named without `active(…)`.
    fn report_bare_components<'n>(
        &self,
        first: &'n Name,
        others: impl Iterator<Item = &'n Name> + Clone,
        text: &Spanned<String>,
        findings: &mut Findings,
    ) {
        let names: BTreeSet<_> =
            std::iter::once(first).chain(others.clone()).map(Name::as_str).collect();
        let message = match names.len() {
            1 => format!("there is no place called {0}: {0} is a component", first.as_str()),
            _ => format!(
                "there are no places called {0}: they are components",
                names.iter().copied().collect::<Vec<_>>().join(" and ")
            ),
        };
        let written: Vec<_> = names.iter().map(|name| format!("active({name})")).collect();
        let at = within(text, first.at.clone());
        let finding = Finding::new(Code::UnknownPlace, &at, message);
        let finding = finding.remedy(format!("write {}", written.join(" and ")));
        findings.push(others.fold(finding, |finding, other| {
            finding.related(&within(text, other.at.clone()), "and this one")
        }));
    }

    /// Returns whether exactly this is the name of something else, so that no similar one was meant.
    fn is_other_sort(&self, sort: Sort, name: &str) -> bool {
        match sort {
            Sort::Component => self.places.contains(name),
            Sort::Place => self.counts.contains(name) || self.transitions.contains(name),
            Sort::Count => self.transitions.contains(name),
            Sort::Transition => self.places.contains(name),
        }
    }

    /// Returns the remedy; the name may be that of another kind of thing.
    fn suggest_remedy(&self, sort: Sort, name: &str, listed: String) -> String {
        if sort == Sort::Place && self.counts.contains(name) {
            return format!("{name} is a variable: compare it, as in {name} <= 3");
        }
        let sort = if sort == Sort::Count { Sort::Place } else { sort };
        if sort == Sort::Place && self.transitions.contains(name) {
            return format!("{name} is a transition: write fires({name}) or dead({name})");
        }
        if sort == Sort::Transition && self.places.contains(name) {
            return format!("{name} is a place: write reachable({name})");
        }
        if sort == Sort::Component && self.places.contains(name) {
            return format!("{name} is a place: write {name}, without active(…)");
        }
        let minus = |known: &&&str| name.strip_prefix(**known).is_some_and(|r| r.starts_with('-'));
        if sort == Sort::Place && self.places.iter().any(|known| minus(&known)) {
            return "a minus is part of the name; compare sums instead: a + b <= 3".into();
        }
        format!("name one of: {listed}")
    }
}

/// Returns the remedy for a name without that of its sub-mission, if only one has such a name.
fn suggest_inner<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let is_inner = |it: &&str| it.rsplit_once('.').is_some_and(|(_, inner)| inner == name);
    let mut inner = known.filter(is_inner);
    let only = inner.next().filter(|_| inner.next().is_none())?;
    Some(format!("did you mean {only}?"))
}
