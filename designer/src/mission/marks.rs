//! The findings of each item of the mission, and the word by which the drawing shows them.

use std::collections::BTreeMap;
use std::sync::Arc;

use armor_proof::time_in_words as time;
use armor_robotfile::{Code, Finding, Findings, Location, MissionDuration, Severity};

use crate::canvas::{Badge, Mark};
use crate::item::Item;

/// The findings of a revision, by what they are about.
#[derive(Debug, Default)]
pub struct Marks {
    findings: Arc<Findings>,
    by_item: BTreeMap<Item, Vec<usize>>,
}

impl Marks {
    /// Sorts findings by what stands where they are about.
    pub fn of(findings: Arc<Findings>, item_at: &dyn Fn(&Location) -> Option<Item>) -> Self {
        let mut by_item: BTreeMap<Item, Vec<usize>> = BTreeMap::new();
        for (number, finding) in findings.iter().enumerate() {
            let mut about: Vec<_> = finding.at.iter().filter_map(item_at).collect();
            if finding.code == Code::MarkedTogether {
                // The other one of the two is as much concerned.
                about.extend(finding.related.iter().filter_map(|(at, _)| item_at(at)));
            }
            about.dedup();
            about.into_iter().for_each(|item| by_item.entry(item).or_default().push(number));
        }
        Self { findings, by_item }
    }

    /// All of them.
    pub fn all(&self) -> &Findings {
        &self.findings
    }

    /// Those about an item.
    pub fn found(&self, item: &Item) -> impl Iterator<Item = &Finding> {
        let numbers = self.by_item.get(item).map_or(&[][..], Vec::as_slice);
        numbers.iter().filter_map(|number| self.findings.iter().nth(*number))
    }

    /// The most severe finding of an item.
    pub fn mark(&self, item: &Item) -> Mark {
        let marks = self.found(item).map(|finding| match finding.severity() {
            Severity::Error => Mark::Error,
            Severity::Warning => Mark::Warning,
            Severity::Note => Mark::None,
        });
        marks.max().unwrap_or_default()
    }

    /// What was found of an item, a line for each.
    pub fn messages(&self, item: &Item) -> String {
        self.found(item).map(|found| format!("\n{}", found.message)).collect()
    }

    /// What a proof states of an item, in a word.
    pub fn badge(&self, item: &Item) -> Option<Badge> {
        let (word, finding) =
            self.found(item).find_map(|found| Some((word(found.code)?, found)))?;
        Some(Badge { text: word.to_owned(), doc: finding.message.clone(), tint: None })
    }

    /// What stands at the goal if it can never be reached: the finding is where the mission stays.
    pub fn badge_of_goal(&self) -> Option<Badge> {
        let never = self.findings.iter().find(|found| found.code == Code::GoalNeverReached)?;
        Some(Badge { text: "never reached".into(), doc: never.message.clone(), tint: None })
    }

    /// How long the mission takes, if that is known.
    pub fn takes(&self) -> Option<&MissionDuration> {
        self.findings.iter().find_map(|found| found.takes.as_ref())
    }
}

/// What the drawing writes next to what a proof speaks of.
fn word(code: Code) -> Option<&'static str> {
    Some(match code {
        Code::NeverFires => "dead",
        Code::Standstill => "deadlock",
        Code::GoalLost => "goal lost",
        Code::FillsWithoutEnd => "fills",
        Code::TwoTokens | Code::TooManyTokens => "two tokens",
        Code::MarkedTogether | Code::ExclusiveTogether => "excluded",
        Code::UnreachablePlace => "not reached",
        _ => return None,
    })
}

/// How long it takes to the goal, in a line.
pub fn takes_words(takes: &MissionDuration) -> String {
    let seconds = |s: f64| time(std::time::Duration::try_from_secs_f64(s).unwrap_or_default());
    let least = seconds(takes.shortest_s);
    match takes.longest_s.map(seconds) {
        Some(most) if takes.always_goal && most == least => format!("after {least}"),
        Some(most) if takes.always_goal => format!("after {least} to {most}"),
        _ => format!("after {least} or later"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_robotfile::{Source, Span};

    #[test]
    fn findings_stand_at_both_places_that_they_are_about() {
        let source = Source::new("a.xml", "one other");
        let at = |start, end| Location::new(&source, Span::new(start, end));
        let together = Finding::new(Code::MarkedTogether, &at(0, 3), "both are marked")
            .related(&at(4, 9), "together with this one");
        let mut findings = Findings::default();
        findings.push(together);
        findings.push(Finding::new(Code::NeverFires, &at(4, 9), "it never fires"));
        let item = |name: &str| Item::place(name);
        let marks = Marks::of(Arc::new(findings), &|at| Some(item(at.text())));
        assert_eq!(
            (marks.mark(&item("one")), marks.mark(&item("none"))),
            (Mark::Warning, Mark::None)
        );
        assert_eq!(marks.messages(&item("other")), "\nboth are marked\nit never fires");
        let badge = |name: &str| marks.badge(&item(name)).map(|badge| badge.text);
        assert_eq!((badge("one"), badge("none")), (Some("excluded".into()), None));
    }

    #[test]
    fn a_goal_that_is_never_reached_is_marked_and_not_where_the_mission_stays() {
        let source = Source::new("a.xml", "look");
        let at = Location::new(&source, Span::new(0, 4));
        let mut findings = Findings::default();
        findings.push(Finding::new(Code::GoalNeverReached, &at, "over is never reached"));
        let marks = Marks::of(Arc::new(findings), &|at| Some(Item::place(at.text())));
        assert_eq!(marks.badge(&Item::place("look")), None);
        assert_eq!(marks.mark(&Item::place("look")), Mark::Error);
        assert_eq!(marks.badge_of_goal().map(|badge| badge.text), Some("never reached".into()));
    }

    #[test]
    fn a_time_without_end_is_shown_as_such() {
        let takes = |longest_s, always_goal| MissionDuration {
            shortest_s: 5.0,
            shortest_trace: Vec::new(),
            longest_s,
            longest_trace: Vec::new(),
            longest_circle: Vec::new(),
            always_goal,
        };
        assert_eq!(takes_words(&takes(Some(90.0), true)), "after 5 s to 1 min 30 s");
        assert_eq!(takes_words(&takes(Some(5.0), true)), "after 5 s");
        assert_eq!(takes_words(&takes(None, true)), "after 5 s or later");
        assert_eq!(takes_words(&takes(Some(90.0), false)), "after 5 s or later");
    }
}
