//! Where a token went that is missing or too many elsewhere: a firing that took it instead of reading
//! it, and one that put several.

use armor_petri::{NetTransition, PlaceId, TransitionId};

use crate::proof::Proof;

impl Proof<'_> {
    /// What to do if the last firing took the token from a place with components that other transitions
    /// lead on from, and nothing leads on from where it put it: it was perhaps only to read.
    pub(super) fn advise_read(&self, path: &[TransitionId]) -> Option<String> {
        let last = self.analysed.sources.get(path.last()?.index()).copied().flatten()?;
        let net = self.plan.net();
        let arcs = net.transition(last);
        if let Some(emptied) = self.find_emptied(arcs) {
            return Some(emptied);
        }
        let [(from, _)] = arcs.inputs.as_slice() else { return None };
        // A timeout leads on from its place.
        let mut written = self.mission.transitions.iter().filter(|it| it.name.value == arcs.name);
        written.next().filter(|it| it.interval.is_none())?;
        let others = net.transition_ids().filter(|id| *id != last).map(|id| net.transition(id));
        let others: Vec<_> = others.collect();
        let takes = |it: &NetTransition, place: PlaceId| {
            it.inputs.iter().chain(&it.reads).any(|arc| arc.0 == place)
        };
        let leads_on = others
            .iter()
            .any(|other| takes(other, *from) && !other.outputs.iter().all(|arc| arc.0 == *from));
        let stays = arcs.outputs.iter().all(|arc| {
            self.plan.place(arc.0).components.is_empty()
                && !others.iter().any(|it| takes(it, arc.0))
        });
        let is_active = !self.plan.place(*from).components.is_empty();
        (is_active && leads_on && stays && !arcs.outputs.is_empty()).then(|| {
            let (place, name) = (net.place(*from), &arcs.name);
            format!(
                "; if {name} is only to look whether {place} is marked, write <read place=\"{place}\"/> in \
                 it instead of from=\"{place}\""
            )
        })
    }

    /// What to do if the last firing empties a place from which a later transition needs a token, together
    /// with the one that this firing puts.
    fn find_emptied(&self, last: &NetTransition) -> Option<String> {
        let net = self.plan.net();
        let puts = |place: PlaceId| last.outputs.iter().any(|arc| arc.0 == place);
        net.transition_ids().map(|id| net.transition(id)).find_map(|join| {
            let emptied = last
                .resets
                .iter()
                .find(|reset| join.inputs.iter().any(|arc| arc.0 == **reset))
                .filter(|_| join.inputs.iter().any(|arc| puts(arc.0)))?;
            let (place, name) = (net.place(*emptied), &last.name);
            Some(format!(
                "; {name} takes the token from {place} that {} needs: did you mean <read \
                 place=\"{place}\"/> in {name}?",
                join.name
            ))
        })
    }

    /// The last firing that put more tokens than it took: where branches of the mission begin.
    pub(super) fn find_fork(&self, path: &[TransitionId]) -> Option<&str> {
        let net = self.plan.net();
        let sources = path.iter().rev().filter_map(|id| self.analysed.sources[id.index()]);
        let mut forks = sources
            .map(|id| net.transition(id))
            .filter(|it| !it.inputs.is_empty() && it.outputs.len() > it.inputs.len());
        forks.next().map(|it| it.name.as_str())
    }
}
