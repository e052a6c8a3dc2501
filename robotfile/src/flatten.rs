//! Sub-missions put into their mission: one net, the names inside qualified by the sub-mission's.
//!
//! `<submission ref="dock.xml" in="at-dock" out="docked"/>`: a token in `at-dock` is taken and the
//! sub-mission's initial places are marked; when its goal is marked, all its other tokens are taken
//! and a token put into `docked`; when its safe place is marked, the whole mission goes to its own.
//! Without `in` it is marked from the start, without `out` nothing follows its goal.

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{Arc, ArcKind, Class, Mission, Submission, Transition, Variable};
use crate::model::Configuration;
use crate::read::MAX_ELEMENTS;
use crate::source::Spanned;

impl Configuration {
    /// Returns the mission with its sub-missions included; none without a mission. What a
    /// sub-mission has to prove or to do on resuming counts in its own file only.
    ///
    /// # Errors
    /// A finding if the whole is larger than a mission may be.
    pub fn flattened(&self) -> Result<Option<Mission>, Findings> {
        self.mission.as_ref().map(|mission| self.flatten(mission)).transpose()
    }

    /// The same of any of its missions.
    ///
    /// # Errors
    /// As [`Self::flattened`].
    pub(crate) fn flatten(&self, mission: &Mission) -> Result<Mission, Findings> {
        let mut whole = mission.clone();
        let wanted = std::mem::take(&mut whole.submissions);
        let mut names = Vec::new();
        for submission in &wanted {
            let name = self.name_of(submission, &mut names);
            self.put_in(&mut whole, submission, &name)?;
        }
        Ok(whole)
    }

    /// Returns the name of a sub-mission: that of its mission, or else of its file; the second of a
    /// name gets `-2`.
    fn name_of(&self, submission: &Submission, names: &mut Vec<String>) -> String {
        let named = self.included.get(&submission.path).and_then(|inner| inner.name.as_ref());
        let stem = || submission.path.file_stem().unwrap_or_default().to_string_lossy().into();
        let name: String = named.map_or_else(stem, |name| name.value.clone());
        let unique = submission_prefix(&name, names);
        names.push(unique.clone());
        unique
    }

    fn put_in(&self, whole: &mut Mission, by: &Submission, name: &str) -> Result<(), Findings> {
        // One that could not be read is a finding already.
        let Some(inner) = self.included.get(&by.path) else { return Ok(()) };
        let mut inner = inner.clone();
        let wanted = std::mem::take(&mut inner.submissions);
        let mut names = Vec::new();
        for submission in &wanted {
            let nested = self.name_of(submission, &mut names);
            self.put_in(&mut inner, submission, &nested)?;
        }
        qualify_names(&mut inner, name);
        join_mission(whole, &inner, by, name);
        for place in &mut inner.places {
            if by.enter.is_some() {
                place.initial = 0;
            }
        }
        whole.places.append(&mut inner.places);
        whole.transitions.append(&mut inner.transitions);
        whole.exclusives.append(&mut inner.exclusives);
        whole.variables.append(&mut inner.variables);
        if whole.places.len() > MAX_ELEMENTS || whole.transitions.len() > MAX_ELEMENTS {
            let message =
                format!("with its sub-missions, the mission has more than {MAX_ELEMENTS}");
            let message = message + " places or transitions";
            let mut findings = Findings::default();
            let finding = Finding::new(Code::TooMany, &by.file.at, message);
            findings.push(finding.remedy("include fewer of them: this is the format's limit"));
            return Err(findings);
        }
        Ok(())
    }
}

/// Returns what precedes the names of a sub-mission with this name in the mission that includes it,
/// where `before` are the prefixes of the sub-missions before it.
pub fn submission_prefix(name: &str, before: &[String]) -> String {
    let of_name = |known: &&String| {
        known.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
    };
    match before.iter().filter(of_name).count() {
        0 => name.to_owned(),
        count => format!("{name}-{}", count + 1),
    }
}

/// Puts `name.` before every name of the mission's own: places, transitions and variables. Guards
/// and values stay as written: a variable in them is that of the mission whose transition it is.
fn qualify_names(inner: &mut Mission, name: &str) {
    let qualify = |own: &mut Spanned<String>| own.value = format!("{name}.{}", own.value);
    let Mission { goal, safe, places, transitions, variables, .. } = inner;
    goal.iter_mut().chain(safe).for_each(qualify);
    variables.iter_mut().for_each(|variable| qualify(&mut variable.name));
    for place in places {
        qualify(&mut place.name);
        place.on_failure.iter_mut().for_each(qualify);
    }
    for transition in transitions {
        qualify(&mut transition.name);
        transition.arcs.iter_mut().for_each(|arc| qualify(&mut arc.place));
        transition.sets.iter_mut().for_each(|set| qualify(&mut set.variable));
        let Transition { on_stop_fail, on_start_fail, overrun, .. } = transition;
        on_stop_fail.iter_mut().chain(on_start_fail).chain(overrun).for_each(qualify);
    }
}

/// Lists what the names of the variables that a transition reads and sets may begin with, the
/// longest first: the name of its sub-mission with a dot, or nothing. The names of a route and of
/// its step, which come before that of the transition too, lead to no variable.
pub fn list_scopes(transition: &str) -> impl Iterator<Item = &str> {
    let dots = transition.rmatch_indices('.').map(|(dot, _)| &transition[..=dot]);
    dots.chain(std::iter::once(""))
}

impl Mission {
    /// Returns the variable that a transition of this flattened mission means by a name.
    pub fn variable_of(&self, transition: &str, name: &str) -> Option<&Variable> {
        list_scopes(transition).find_map(|scope| {
            let is_it =
                |variable: &&Variable| variable.name.value.strip_prefix(scope) == Some(name);
            self.variables.iter().find(is_it)
        })
    }
}

/// The transitions between a mission and the sub-mission `inner`, whose names are qualified.
fn join_mission(whole: &mut Mission, inner: &Mission, by: &Submission, name: &str) {
    let transition = |what: &str, class, arcs| Transition {
        class,
        ..Transition::new(by.file.with(format!("{name}.{what}")), arcs)
    };
    let arc = |kind, place: &Spanned<String>, weight| Arc { kind, place: place.clone(), weight };
    if let Some(enter) = &by.enter {
        let marked = inner.places.iter().filter(|place| place.initial > 0);
        let mut arcs = vec![arc(ArcKind::Take, enter, 1)];
        arcs.extend(marked.map(|place| arc(ArcKind::Put, &place.name, place.initial)));
        whole.transitions.push(transition("enter", Class::Normal, arcs));
    }
    let ends = [
        ("leave", &inner.goal, &by.leave, Class::Normal),
        ("fail", &inner.safe, &whole.safe.clone(), Class::Safety),
    ];
    for (what, from, to, class) in ends {
        let (Some(from), Some(to)) = (from, to) else { continue };
        let mut arcs = vec![arc(ArcKind::Take, from, 1), arc(ArcKind::Put, to, 1)];
        if !is_state_machine(inner) {
            let others = inner.places.iter().filter(|place| place.name.value != from.value);
            arcs.extend(others.map(|place| arc(ArcKind::Reset, &place.name, 1)));
        }
        whole.transitions.push(transition(what, class, arcs));
    }
}

/// Whether there is always one token: then its goal is marked alone.
pub(crate) fn is_state_machine(mission: &Mission) -> bool {
    let tokens: u32 = mission.places.iter().map(|place| place.initial).sum();
    let moves = |transition: &Transition| {
        let count = |kind| transition.arcs.iter().filter(|arc| arc.kind == kind).count();
        let single = transition.arcs.iter().all(|arc| arc.weight == 1);
        single && count(ArcKind::Take) == 1 && count(ArcKind::Put) == 1
    };
    tokens == 1 && mission.transitions.iter().all(moves)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::mission::{ArcKind, Mission};
    use crate::{Findings, check, read};

    const DOCK: &str = "<armor version='1'><mission name='dock' goal='docked' safe='away'>
        <place name='near' initial='true' components='crawler'/><place name='docked'/>
        <place name='away' class='safety'/>
        <transition name='contact' from='near' to='docked' on='crawler.done'/>
        <transition name='missed' from='near' to='away' timeout='30s'/></mission></armor>";

    fn flattened(mission: &str, others: &[(&str, String)]) -> Result<Mission, Findings> {
        let system = "<system><component name='crawler' kind='crawler'/></system>";
        let main = format!("<armor version='1'>{system}{mission}</armor>");
        let reading = read(Path::new("main.xml"), &mut |path| {
            let other = others.iter().find(|(name, _)| Path::new(name) == path);
            Ok(other.map_or_else(|| main.clone(), |(_, text)| text.clone()).into_bytes())
        });
        let reading = check(reading, &[], None);
        assert!(reading.is_valid(), "{:?}", reading.findings);
        let configuration = reading.configuration.unwrap();
        configuration.flattened().map(|mission| mission.unwrap())
    }

    fn arcs(mission: &Mission, transition: &str) -> Vec<(ArcKind, String)> {
        let found = mission.transitions.iter().find(|t| t.name.value == transition);
        let found = found.unwrap_or_else(|| panic!("no {transition}"));
        found.arcs.iter().map(|arc| (arc.kind, arc.place.value.clone())).collect()
    }

    #[test]
    fn a_sub_mission_becomes_part_of_the_net_under_its_name() {
        let main = "<mission name='trip' goal='over' safe='hold'>
            <place name='drive' initial='true'/><place name='at-dock'/><place name='over'/>
            <place name='hold'/>
            <transition name='there' from='drive' to='at-dock' timeout='5s'/>
            <submission ref='dock.xml' in='at-dock' out='over'/></mission>";
        let whole = flattened(main, &[("dock.xml", DOCK.into())]).unwrap();
        let names: Vec<_> = whole.places.iter().map(|place| place.name.value.as_str()).collect();
        let expected =
            ["drive", "at-dock", "over", "hold", "dock.near", "dock.docked", "dock.away"];
        assert_eq!(names, expected);
        assert_eq!(whole.places.iter().map(|place| place.initial).sum::<u32>(), 1);
        let take = |place: &str| (ArcKind::Take, place.to_owned());
        let put = |place: &str| (ArcKind::Put, place.to_owned());
        assert_eq!(arcs(&whole, "dock.enter"), [take("at-dock"), put("dock.near")]);
        assert_eq!(arcs(&whole, "dock.contact"), [take("dock.near"), put("dock.docked")]);
        assert_eq!(arcs(&whole, "dock.leave"), [take("dock.docked"), put("over")]);
        assert_eq!(arcs(&whole, "dock.fail"), [take("dock.away"), put("hold")]);
        assert!(whole.submissions.is_empty());
    }

    #[test]
    fn the_same_file_twice_is_two_and_one_in_another_is_named_by_both() {
        let main = "<mission goal='over' safe='hold'>
            <place name='a' initial='true'/><place name='b'/><place name='over'/><place name='hold'/>
            <submission ref='dock.xml' in='a' out='b'/>
            <submission ref='outer.xml' in='b' out='over'/></mission>";
        let outer = "<armor version='1'><mission name='outer' goal='g' safe='s'>
            <place name='p' initial='true'/><place name='q'/><place name='g'/><place name='s'/>
            <submission ref='dock.xml' in='p' out='q'/><submission ref='dock.xml' in='q' out='g'/>
            </mission></armor>";
        let files = [("dock.xml", DOCK.into()), ("outer.xml", outer.into())];
        let whole = flattened(main, &files).unwrap();
        assert_eq!(arcs(&whole, "dock.enter")[0].1, "a");
        assert_eq!(arcs(&whole, "outer.dock.leave")[1].1, "outer.q");
        assert_eq!(arcs(&whole, "outer.dock-2.leave")[1].1, "outer.g");
        assert_eq!(arcs(&whole, "outer.dock.fail")[1].1, "outer.s");
    }

    #[test]
    fn tokens_left_in_a_sub_mission_at_its_goal_are_taken() {
        let main = "<mission goal='over' safe='hold'><place name='a' initial='true'/>
            <place name='over'/><place name='hold'/>
            <submission ref='two.xml' in='a' out='over'/></mission>";
        let two = "<armor version='1'><mission name='two' goal='g' safe='s'>
            <place name='p' initial='true'/><place name='q' initial='true'/><place name='g'/>
            <place name='s'/><transition name='t' from='p' to='g' timeout='1s'/>
            <transition name='u' from='q' to='s' timeout='9s'/></mission></armor>";
        let whole = flattened(main, &[("two.xml", two.into())]).unwrap();
        let resets =
            |name| arcs(&whole, name).into_iter().filter(|arc| arc.0 == ArcKind::Reset).count();
        assert_eq!((resets("two.leave"), resets("two.fail")), (3, 3));
    }

    #[test]
    fn files_that_double_at_each_level_end_at_the_limit() {
        let level = |next: &str| {
            format!(
                "<armor version='1'><mission goal='g' safe='s'><place name='p' initial='true'/>
                 <place name='q'/><place name='g'/><place name='s'/>
                 <submission ref='{next}' in='p' out='q'/><submission ref='{next}' in='q' out='g'/>
                 </mission></armor>"
            )
        };
        let names: Vec<_> = (0..20).map(|number| format!("l{number}.xml")).collect();
        let mut files: Vec<_> =
            names.windows(2).map(|pair| (pair[0].as_str(), level(&pair[1]))).collect();
        files.push((names[19].as_str(), DOCK.into()));
        let main = "<mission goal='over' safe='hold'><place name='a' initial='true'/>
            <place name='over'/><place name='hold'/>
            <submission ref='l0.xml' in='a' out='over'/></mission>";
        let findings = flattened(main, &files).unwrap_err();
        assert!(findings.iter().any(|finding| finding.code.as_str() == "E0008"), "{findings:?}");
    }
}
