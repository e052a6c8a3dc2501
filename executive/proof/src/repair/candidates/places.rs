//! Other places: of transitions, of sub-missions, of the start and the end.

use armor_robotfile::tree::Element;
use armor_robotfile::{Code, Span};

use super::words::{add_word, remove_word, replace_word};
use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;
use crate::repair::likeness::{MOST_CLOSE, are_related};

/// Ranks of edits, without what makes one likelier at its place. Small ones come first: an attribute
/// that is missing, two that are exchanged, a wrong name, then lists that are too long or too short.
const MISSING: i32 = 16;
const EXCHANGED: i32 = 19;
const REPLACED: i32 = 20;
const REMOVED: i32 = 22;
const ADDED: i32 = 28;
/// The rank of a second mark, which is more often a slip than meant.
const SECOND_MARK: i32 = 12;
/// How much likelier a place is after which the transition is named.
const NAMED_AFTER: i32 = 6;
/// How much likelier a place is which the neighbours have.
const AS_NEIGHBOUR: i32 = 3;
/// How much likelier a place is from which nothing leads on, or to which nothing leads.
const LOOSE: i32 = 4;
/// The same of a place that is added to the places that a transition takes tokens from: a branch that
/// was not joined. And of one that is added to the places that it leads to.
const LOOSE_TO_JOIN: i32 = 10;
const LOOSE_TO_FORK: i32 = 5;
/// How much less likely a place without components is where one with components is waited for.
const WORKLESS: i32 = 2;
/// How much less likely it is that a timeout to the safe place is wrong, and how much likelier that it
/// is meant.
const TIMEOUT_FROM_SAFE: i32 = 4;
const TIMEOUT_TO_SAFE: i32 = 3;
/// How much likelier an end of the mission is one too many in a list, as the other places count
/// for nothing then.
const END_IN_LIST: i32 = 8;
/// How much likelier a place of a fork is from which the next transition of the file leads on.
const FOLLOWED: i32 = 4;
/// How much likelier the goal is where nothing leads to it, and still likelier in place of the safe place.
const LOOSE_GOAL: i32 = 6;
const GOAL_FOR_SAFE: i32 = 6;
/// How much likelier the goal is after a place that only this transition leads on from.
const ONLY_EXIT_TO_GOAL: i32 = 3;
/// The rank of the mark in a place that nothing leads to, and how much less likely it is in another one.
const MOVED_MARK: i32 = 10;
const MARK_ELSEWHERE: i32 = 14;
/// The rank of a place after a failure that is missing, after another place of a transition.
const NO_REFUGE: i32 = 24;
/// The rank of an attribute that has no effect, removed.
const NO_EFFECT: i32 = 8;
/// How much likelier a place is one too few of those that a transition takes tokens from, where the
/// token that it leaves there is the fault.
const LEFT_MARKED: i32 = 8;
/// How much likelier a place is one too many of a transition that never has all of its tokens.
const NEVER_TOGETHER: i32 = 6;
/// How much likelier a place is wrong to which a transition leads back.
const LEADS_BACK: i32 = 4;
/// How much likelier a place is wrong of which the token does not come back.
const NOT_PUT_BACK: i32 = 1;
/// How much likelier an edit is per degree of closeness to the faults.
pub(super) const CLOSE: i32 = 2;

impl MissionElements<'_> {
    /// Other places in `from` and `to`. Only those are listed for which something speaks: a name, a
    /// neighbour, a place that lacks a transition, or a fault at the transition.
    pub(super) fn places_of_transition(&self, number: usize, edits: &mut Vec<FileEdit>) {
        let transition = self.transitions[number];
        let closeness = self.closeness(transition);
        let close = CLOSE * closeness;
        if let (Some(from), Some(to)) = (value(transition, "from"), value(transition, "to")) {
            let fit = self.fit(number, "from", Some(from), Some(to))
                + self.fit(number, "to", Some(to), Some(from));
            let fit = fit - self.loosened(from, "to") - self.loosened(to, "from");
            let exchanged = self.exchanged(transition, "from", "to");
            let exchanged = exchanged.filter(|_| closeness > 0 || fit < 0);
            edits.extend(exchanged.map(|edit| edit.ranked(EXCHANGED - close + fit)));
        }
        for attribute in ["from", "to"] {
            let Some(list) = transition.attribute(attribute) else {
                let has_other = transition.attribute(if attribute == "to" { "from" } else { "to" });
                for new in self.place_names().filter(|_| has_other.is_some() && closeness > 0) {
                    let rank = MISSING + self.fit(number, attribute, None, Some(new)) - close;
                    let edit = self.with_attribute(transition, attribute, new);
                    edits.extend(edit.map(|edit| edit.ranked(rank)));
                }
                continue;
            };
            // Where the mission is over, no other branch of it continues.
            let is_end = |place: &str| self.ends().contains(&Some(place));
            // An edit with which the mission only does less removes almost any fault, wherever the
            // mistake is. It is tried only where a fault is.
            let mut push =
                |new: Option<String>, base: i32, fit: i32, (place, evades): (&str, bool)| {
                    let is_likely = closeness == MOST_CLOSE || (fit < 0 && !evades);
                    let Some(new) = new.filter(|_| is_likely) else { return };
                    let edit = self.with_value(transition, list, &new).ranked(base + fit - close);
                    let distance = self.distance(transition, attribute, place);
                    edits.push(FileEdit { distance, ..edit });
                };
            for (at, old) in list.value.split_whitespace().enumerate() {
                let leads_back = attribute == "to"
                    && has(transition, "from", old)
                    && list.value.trim().contains(' ');
                for new in self.place_names() {
                    let fit = self.fit(number, attribute, Some(old), Some(new));
                    let is_next = attribute == "to"
                        && self.is_followed_by(number, new)
                        && !has(transition, "from", new);
                    let next =
                        if is_next && list.value.trim().contains(' ') { FOLLOWED } else { 0 };
                    let fit = fit - next - if leads_back { LEADS_BACK } else { 0 };
                    // A mission that fails must not end as if it had succeeded.
                    if attribute == "to" && self.hides_failure(transition, old, new) {
                        continue;
                    }
                    let ends = attribute == "to" && is_end(new) && !is_end(old);
                    let evades = ends && !self.is_loose("to", new);
                    push(replace_word(&list.value, at, new), REPLACED, fit, (new, evades));
                }
                // A list of several names is seldom enough that each of them may be too many.
                let fit = self.fit(number, attribute, Some(old), None);
                let end = if is_end(old) { END_IN_LIST } else { 0 };
                let is_joined = attribute == "from" && !is_end(old);
                let evades = is_joined && self.is_only_one(number, "from", old);
                let lost = is_joined && !has(transition, "to", old);
                let rank = match is_joined && self.is_never_together(transition) {
                    true => REMOVED + 1 - NEVER_TOGETHER,
                    false => REMOVED + 1 - end + fit - if lost { NOT_PUT_BACK } else { 0 },
                };
                push(remove_word(&list.value, at), rank, -1, (old, evades));
            }
            if list.value.split_whitespace().any(is_end) {
                continue;
            }
            for new in self.place_names().filter(|new| !is_end(new)) {
                let is_loose = self.is_loose(attribute, new);
                let added = if attribute == "from" { LOOSE_TO_JOIN } else { LOOSE_TO_FORK };
                let loose = if is_loose { added - LOOSE } else { 0 };
                let followed = if attribute == "to" && self.is_followed_by(number, new) {
                    FOLLOWED
                } else {
                    0
                };
                let left = attribute == "from" && self.is_left_marked(transition, new);
                let left = if left { LEFT_MARKED } else { 0 };
                let fit = self.fit(number, attribute, None, Some(new)) - loose - followed - left;
                push(add_word(&list.value, new), ADDED, fit, (new, false));
            }
        }
    }

    /// How much less likely it is, by names, neighbours and the rest of the mission, that `old` is
    /// wrong and `new` is meant.
    fn fit(&self, number: usize, attribute: &str, old: Option<&str>, new: Option<&str>) -> i32 {
        let transition = self.transitions[number];
        let name = value(transition, "name").unwrap_or("");
        let before = number.checked_sub(1).and_then(|before| self.transitions.get(before));
        let neighbours = [before, self.transitions.get(number + 1)];
        let is_usual =
            |place: &str| neighbours.into_iter().flatten().any(|it| has(it, attribute, place));
        // As `unload` begins unload.xml.
        let begins_namesake = |place: &str| {
            self.submissions().any(|it| {
                value(it, "in") == Some(place) && are_related(name, value(it, "ref").unwrap_or(""))
            })
        };
        let likeness = |place: &str| {
            let is_named = match attribute {
                "from" => are_related(name, place),
                _ => begins_namesake(place),
            };
            let named = if is_named { NAMED_AFTER } else { 0 };
            named + if is_usual(place) { AS_NEIGHBOUR } else { 0 }
        };
        // Without this transition, nothing would lead on from the old place, or to it.
        let loosens = |place: &&str| self.is_only_one(number, attribute, place);
        let is_timeout_to_safe = |place: &&str| {
            attribute == "to"
                && (value(transition, "timeout").is_some()
                    || value(transition, "class") == Some("safety"))
                && value(self.element, "safe") == Some(*place)
        };
        let works = |place: &str| {
            let written = self.places.iter().find(|it| value(it, "name") == Some(place));
            written.is_some_and(|it| value(it, "components").is_some())
        };
        let stops_work = matches!((old, new), (Some(old), Some(new)) if works(old) && !works(new));
        let is_single = value(transition, "from").is_some_and(|it| !it.trim().contains(' '));
        let mut fit = old.map_or(0, likeness) - new.map_or(0, likeness);
        fit += if old.as_ref().is_some_and(loosens) { LOOSE } else { 0 };
        fit += if old.as_ref().is_some_and(is_timeout_to_safe) { TIMEOUT_FROM_SAFE } else { 0 };
        fit -= if new.as_ref().is_some_and(is_timeout_to_safe) { TIMEOUT_TO_SAFE } else { 0 };
        fit += if attribute == "from" && stops_work && is_single { WORKLESS } else { 0 };
        let is_goal = |place: &str| attribute == "to" && value(self.element, "goal") == Some(place);
        let is_loose = |place: &&str| self.is_loose(attribute, place);
        if new.as_ref().is_some_and(|it| is_loose(it) && is_goal(it)) {
            let is_from_safe = old.is_some() && old == value(self.element, "safe");
            fit -= LOOSE_GOAL + if is_from_safe { GOAL_FOR_SAFE } else { 0 };
            let from = value(transition, "from").filter(|_| is_single);
            let is_only_exit = from.is_some_and(|it| self.is_only_one(number, "from", it.trim()));
            fit -= if is_only_exit { ONLY_EXIT_TO_GOAL } else { 0 };
        }
        fit - if new.as_ref().is_some_and(is_loose) { LOOSE } else { 0 }
    }

    /// Whether an exit to the safe place, after a failure or because something takes too long, would lead
    /// to the goal.
    fn hides_failure(&self, transition: &Element, old: &str, new: &str) -> bool {
        let [goal, safe] = self.ends();
        let from = value(transition, "from").unwrap_or("");
        let waits = ["on", "when", "operator", "autonomy"];
        let is_rival = |it: &&&Element| {
            value(it, "name") != value(transition, "name")
                && from.split_whitespace().any(|place| has(it, "from", place))
                && waits.iter().any(|by| it.attribute(by).is_some())
        };
        let is_timeout = value(transition, "timeout").is_some()
            && waits.iter().all(|by| transition.attribute(by).is_none())
            && self.transitions.iter().any(|it| is_rival(&it));
        let is_failure = value(transition, "on").is_some_and(|on| on.ends_with(".failed"))
            || value(transition, "class") == Some("safety");
        goal == Some(new) && safe == Some(old) && goal != safe && (is_timeout || is_failure)
    }

    /// Whether a fault is that the transition never has all tokens together.
    fn is_never_together(&self, transition: &Element) -> bool {
        let name = value(transition, "name").unwrap_or("");
        let begin = format!("{name} never fires: ");
        self.faults.iter().any(|fault| {
            fault.message.starts_with(&begin) && fault.remedy.contains("never marked together")
        })
    }

    /// Whether a check fails after the transition has fired, and this place has a token then.
    fn is_left_marked(&self, transition: &Element, place: &str) -> bool {
        let name = value(transition, "name").unwrap_or("");
        self.faults.iter().any(|fault| {
            let last = fault.trace.as_ref().and_then(|trace| trace.firings.last());
            let tokens = fault.message.split_once("tokens in ").map_or("", |it| it.1);
            fault.code == Code::CheckFails
                && last.is_some_and(|last| last == name)
                && tokens.split([',', ' ']).any(|word| word == place)
        })
    }

    /// How far an element is from the nearest one that leads on from the place, or to it, where its
    /// `attribute` names the place.
    fn distance(&self, element: &Element, attribute: &str, place: &str) -> usize {
        let others = if matches!(attribute, "to" | "out") { ["from", "in"] } else { ["to", "out"] };
        let all = self.transitions.iter().copied().chain(self.submissions());
        let leading = all.filter(|it| others.iter().any(|name| has(it, name, place)));
        let from_here = |it: &Element| it.span.start().abs_diff(element.span.start());
        leading.map(from_here).min().unwrap_or(usize::MAX)
    }

    /// Whether the next transition of the file leads on from the place.
    fn is_followed_by(&self, number: usize, place: &str) -> bool {
        self.transitions.get(number + 1).is_some_and(|next| has(next, "from", place))
    }

    /// Whether no transition or sub-mission has the place in its `from`, or in its `to`.
    pub(super) fn is_loose(&self, attribute: &str, place: &str) -> bool {
        let is_outer = |outer: &Element| {
            value(outer, if attribute == "from" { "in" } else { "out" }) == Some(place)
        };
        let is_end = attribute == "from" && self.ends().contains(&Some(place));
        let written = self.places.iter().find(|it| value(it, "name") == Some(place));
        let is_marked = attribute == "to"
            && written.is_some_and(|it| value(it, "initial").is_some_and(|it| it != "false"));
        let in_arc = self
            .transitions
            .iter()
            .flat_map(|it| it.elements())
            .any(|arc| value(arc, attribute) == Some(place));
        !is_end
            && !is_marked
            && !in_arc
            && !self.transitions.iter().any(|it| has(it, attribute, place))
            && !self.submissions().any(is_outer)
    }

    /// How much likelier a list of places is in `from` or `to` because some of them are loose there.
    fn loosened(&self, list: &str, attribute: &str) -> i32 {
        let loose = list.split_whitespace().filter(|place| self.is_loose(attribute, place));
        if list.split_whitespace().nth(1).is_some() {
            LOOSE * i32::from(loose.count() > 0)
        } else {
            0
        }
    }

    fn ends(&self) -> [Option<&str>; 2] {
        ["goal", "safe"].map(|end| value(self.element, end))
    }

    /// Whether the place would be loose without a transition.
    fn is_only_one(&self, number: usize, attribute: &str, place: &str) -> bool {
        let others = self.transitions.iter().enumerate().filter(|(other, _)| *other != number);
        let others = Self { transitions: others.map(|it| *it.1).collect(), ..self.clone() };
        others.is_loose(attribute, place)
    }

    /// Other places before and after a sub-mission.
    pub(super) fn places_of_submission(&self, submission: &Element, edits: &mut Vec<FileEdit>) {
        let close = CLOSE * self.closeness(submission);
        let file = value(submission, "ref").unwrap_or("").to_owned();
        let mut push = |edit: Option<FileEdit>, rank| {
            edits.extend(edit.map(|it| FileEdit { element: file.clone(), ..it.ranked(rank) }));
        };
        push(self.exchanged(submission, "in", "out"), EXCHANGED - close);
        for (attribute, arcs) in [("in", "from"), ("out", "to")] {
            for new in self.place_names() {
                let loose = if self.is_loose(arcs, new) { LOOSE } else { 0 };
                match submission.attribute(attribute) {
                    Some(old) if old.value == new => {}
                    Some(old) => {
                        let edit = self.with_value(submission, old, new);
                        let others = Self { no_submissions: true, ..self.clone() };
                        let kept = if others.is_loose(arcs, &old.value) { LOOSE } else { 0 };
                        let distance = self.distance(submission, attribute, new);
                        let edit = FileEdit { distance, ..edit };
                        push(Some(edit), REPLACED - loose + kept - close);
                    }
                    None => {
                        let edit = self.with_attribute(submission, attribute, new);
                        push(edit, MISSING - loose - close);
                    }
                }
            }
        }
    }

    /// Other marks at the start, and other places after a failure.
    pub(super) fn marks(&self, edits: &mut Vec<FileEdit>) {
        let is_marked = |place: &&&Element| {
            value(place, "initial").is_some_and(|it| it != "false" && it != "0")
        };
        let marked: Vec<_> = self.places.iter().filter(is_marked).collect();
        let names: Vec<_> = marked.iter().filter_map(|it| value(it, "name")).collect();
        for place in &marked {
            let (Some(initial), Some(name)) = (place.attribute("initial"), value(place, "name"))
            else {
                continue;
            };
            if marked.len() > 1 {
                let edit = self.with_value(place, initial, "false").ranked(SECOND_MARK);
                let question = format!("the mission begins in {}", names.join(" and "));
                let instead = format!("remove initial=\"{}\" from {name}", initial.value);
                edits.push(FileEdit { question: Some((question, instead)), ..edit });
            }
            if initial.value != "true" && initial.value != "1" {
                let edit = self.with_value(place, initial, "true").ranked(SECOND_MARK);
                let tokens = &initial.value;
                let question = format!("the mission begins with {tokens} tokens in {name}");
                let instead = format!("write initial=\"true\" on {name}");
                edits.push(FileEdit { question: Some((question, instead)), ..edit });
            }
        }
        if let [marked] = marked[..] {
            self.move_mark(marked, edits);
        }
        for place in &self.places {
            let Some(failure) = place.attribute("on-failure") else {
                self.missing_refuges(place, edits);
                continue;
            };
            let close = CLOSE * self.closeness(place);
            if value(place, "components").is_none() {
                edits.push(self.without_attribute(place, failure).ranked(NO_EFFECT));
            }
            for new in self.place_names().filter(|new| *new != failure.value) {
                let fit = if self.leads_to(place, new) { AS_NEIGHBOUR } else { 0 };
                let rank = REPLACED + 2 - fit - close;
                edits.push(self.with_value(place, failure, new).ranked(rank));
            }
        }
    }

    /// The place that nothing leads to, as the one after a failure.
    fn missing_refuges(&self, place: &Element, edits: &mut Vec<FileEdit>) {
        let works = |name: &str| {
            let written = self.places.iter().find(|it| value(it, "name") == Some(name));
            written.is_some_and(|it| value(it, "components").is_some())
        };
        if value(place, "components").is_none() {
            return;
        }
        let is_entered = |name: &str| self.submissions().any(|it| value(it, "in") == Some(name));
        let loose = self.place_names().filter(|it| self.is_loose("to", it) && !works(it));
        for refuge in loose.filter(|it| !is_entered(it)) {
            let edit = self.with_attribute(place, "on-failure", refuge);
            edits.extend(edit.map(|edit| edit.ranked(NO_REFUGE)));
        }
    }

    /// The only mark in another place.
    fn move_mark(&self, marked: &Element, edits: &mut Vec<FileEdit>) {
        let (Some(initial), Some(name)) = (marked.attribute("initial"), value(marked, "name"))
        else {
            return;
        };
        for place in self.places.iter().filter(|it| value(it, "name") != Some(name)) {
            let Some(new) = value(place, "name") else { continue };
            let Some(edit) = self.with_attribute(place, "initial", "true") else { continue };
            let mut edit = edit;
            let span = Span::new(initial.name_span.start(), initial.value_span.end() + 1);
            edit.replaced.push((span, String::new()));
            edit.element = format!("{new}, and not in {name}");
            let elsewhere = if self.is_loose("to", new) { 0 } else { MARK_ELSEWHERE };
            edits.push(edit.ranked(MOVED_MARK + elsewhere));
        }
    }

    /// Whether a transition leads from one place to the other.
    fn leads_to(&self, from: &Element, to: &str) -> bool {
        let from = value(from, "name").unwrap_or("");
        self.transitions.iter().any(|it| has(it, "from", from) && has(it, "to", to))
    }
}

/// Whether the list in the attribute has the name.
fn has(element: &Element, attribute: &str, name: &str) -> bool {
    value(element, attribute).is_some_and(|it| it.split_whitespace().any(|it| it == name))
}
