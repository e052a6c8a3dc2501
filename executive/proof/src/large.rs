//! What is proven of a mission with more states than can be looked at: deadlocks by stubborn sets,
//! exclusions and second tokens by sums of tokens. What neither decides is reported as open.

use armor_petri::PlaceId;
use armor_petri::analysis::Exhausted;
use armor_petri::analysis::invariants::{PlaceBounds, excluding_sum};
use armor_petri::analysis::rules::FiringRules;
use armor_petri::analysis::stubborn::find_wanted_deadlocks;
use armor_robotfile::{Code, Finding, Findings};

use crate::analysed::Analysed;
use crate::proof::Proof;
use crate::routes::RouteProof;
use crate::witness::Witness;

/// Open questions of one sort that are named.
const MAX_NAMED: usize = 3;

const PROVE_PARTS: &str =
    "prove its parts as missions of their own, or count fewer tokens where it counts";

/// The result of the reduced search for standstills.
enum Standstill {
    Never,
    After(Witness),
    Open,
}

impl Proof<'_> {
    pub(super) fn too_large(&self, why: Exhausted, findings: &mut Findings) {
        let reason = match &self.routes {
            Ok(routes) => return self.report_one_by_one(routes, findings),
            Err(reason) => reason.as_ref(),
        };
        // What the states seen show is so, whatever the others are.
        self.tokens_of_active_places(findings);
        self.find_meetings(findings);
        self.contradictions(findings);
        self.values_outside(findings);
        let (mut proven, mut open) = (Vec::new(), vec!["that the goal stays in reach".to_owned()]);
        match self.standstill() {
            Standstill::Never => proven.push("it never stands still".to_owned()),
            Standstill::After(seen) => findings.push(self.lost_at(&seen, true)),
            Standstill::Open => open.push("that it never stands still".into()),
        }
        self.places_by_sums(&mut proven, &mut open);
        let states = self.exploration.space.states();
        if !self.analysed.outside.is_empty() {
            open.push("that variables stay within their domains".into());
        }
        let mut message =
            format!("the mission is too large to be proven whole: {why} ({states} states seen)");
        if !proven.is_empty() {
            message += &format!("; proven all the same: {}", proven.join(", "));
        }
        message += &format!("; open: {}", open.join(", "));
        if let Some(reason) = reason {
            message += &format!("; its routes are not proven one by one: {reason}");
        }
        findings.push(Finding::new(Code::NotProven, &self.mission.at, message).remedy(PROVE_PARTS));
    }

    /// A mission whose routes are proven one by one: what is shown, and the faults that were found.
    fn report_one_by_one(&self, routes: &RouteProof<'_>, findings: &mut Findings) {
        self.tokens_of_active_places(findings);
        self.find_meetings(findings);
        self.contradictions(findings);
        self.values_outside(findings);
        let (mut proven, mut open) = (Vec::new(), Vec::new());
        if let Some(seen) = &routes.lost {
            let rules = FiringRules::new(self.net);
            let mut others = self.net.transition_ids();
            let fires = others.any(|id| {
                !self.analysed.emergencies.contains(&id) && rules.enabled(&seen.marking, id)
            });
            findings.push(self.lost_at(seen, !fires));
        } else if !routes.met.is_empty() {
            open.push("that the goal stays in reach where a component waits for another".into());
        } else if self.plan.goal().is_some() {
            proven.push("goal or safe place stays in reach".to_owned());
            proven.push("it never stands still".into());
        }
        self.places_by_sums(&mut proven, &mut open);
        if !self.analysed.outside.is_empty() {
            open.push("that variables stay within their domains".into());
        }
        let mut message = format!(
            "{} routes proven one by one, each with the others at any of their places ({} states; \
             together they could have {})",
            routes.machines.count(),
            routes.states,
            number_in_words(routes.machines.product()),
        );
        if !proven.is_empty() {
            message += &format!(": {}", proven.join(", "));
        }
        if open.is_empty() {
            let finding = Finding::new(Code::ProvenByRoutes, &self.mission.at, message);
            return findings.push(finding.remedy("nothing is to be done"));
        }
        message += &format!("; open: {}", open.join(", "));
        findings.push(Finding::new(Code::NotProven, &self.mission.at, message).remedy(PROVE_PARTS));
    }

    /// What holds of places without looking at states: they are apart, and have no second token.
    fn places_by_sums(&self, proven: &mut Vec<String>, open: &mut Vec<String>) {
        let exclusive = self.exclusive_places().into_iter().map(|pair| pair.1).collect();
        let what = "exclusive components are never wanted together";
        self.apart_by_sums(exclusive, what, proven, open);
        let contradicting = self.plan.contradictions().iter().map(|it| it.places).collect();
        let what = "no component is given two values for one parameter";
        self.apart_by_sums(contradicting, what, proven, open);
        self.bounds_by_sums(proven, open);
    }

    /// Without the end at goal and safe place the net has no inhibitor arcs of ours, does all that
    /// it does with it, and more. So what never stands still without the end never does.
    fn standstill(&self) -> Standstill {
        let Ok(endless) = Analysed::endless(self.plan, self.apart) else { return Standstill::Open };
        let bounds = PlaceBounds::of_net(&endless.net, self.stop);
        let budget = self.untimed_budget();
        let not_over = |marking: &[u32]| !self.is_over(marking);
        let Ok(Some(found)) = find_wanted_deadlocks(&endless.net, &bounds, &not_over, &budget)
        else {
            return Standstill::Open;
        };
        let Some((path, marking)) = found.first else { return Standstill::Never };
        // The path may lead past the end: both nets have the same transitions.
        match FiringRules::new(self.net).play(self.net.initial(), &path) {
            Some(_) => Standstill::After(Witness { path, marking }),
            None => Standstill::Open,
        }
    }

    /// Whether sums keep the places of each pair apart, which proves `what`.
    fn apart_by_sums(
        &self,
        pairs: Vec<[PlaceId; 2]>,
        what: &str,
        proven: &mut Vec<String>,
        open: &mut Vec<String>,
    ) {
        let is_excluded = |places: &[_; 2]| {
            let routes = self.routes.as_ref();
            routes.is_ok_and(|it| it.machines.are_apart(places[0], places[1]))
                || excluding_sum(self.token_sums(), self.net, places[0], places[1]).is_some()
        };
        let unproven: Vec<_> = pairs.iter().filter(|places| !is_excluded(places)).collect();
        // Those that were seen together are findings already.
        let is_seen = |places: &[_; 2]| {
            let routes = self.one_by_one();
            routes.is_some_and(|it| it.met.iter().any(|met| met.places == *places))
        };
        let is_open = |places: &&&[_; 2]| {
            let together = self.nearest_together(places[0], places[1]);
            together.is_none() && !is_seen(places)
        };
        let names = unproven.iter().filter(is_open);
        let name = |[one, other]: &&[_; 2]| {
            format!(
                "that {} and {} are never marked together",
                self.net.place(*one),
                self.net.place(*other)
            )
        };
        let names: Vec<_> = names.map(name).collect();
        if unproven.is_empty() && !pairs.is_empty() {
            proven.push(what.into());
        } else if !names.is_empty() {
            open.push(some_of(&names));
        }
    }

    fn bounds_by_sums(&self, proven: &mut Vec<String>, open: &mut Vec<String>) {
        let active: Vec<_> = self
            .plan
            .place_ids()
            .filter(|id| !self.plan.place(*id).components.is_empty())
            .collect();
        let is_bounded =
            |place: &PlaceId| self.bounds.of(place.index()).is_some_and(|most| most < 2);
        let unproven: Vec<_> = active.iter().filter(|place| !is_bounded(place)).collect();
        let is_open = |place: &&&PlaceId| self.exploration.space.most_in(***place) < 2;
        let name =
            |place: &&PlaceId| format!("that {} gets no second token", self.net.place(**place));
        let names: Vec<_> = unproven.iter().filter(is_open).map(name).collect();
        if unproven.is_empty() && !active.is_empty() {
            proven.push("no place with components gets a second token".into());
        } else if !names.is_empty() {
            open.push(some_of(&names));
        }
    }
}

/// A number that may be too large to be counted.
fn number_in_words(number: u64) -> String {
    let most = || format!("more than {}", u64::MAX);
    if number == u64::MAX { most() } else { number.to_string() }
}

fn some_of(names: &[String]) -> String {
    let more = names.len().saturating_sub(MAX_NAMED);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    names[..names.len().min(MAX_NAMED)].join(", ") + &rest
}
