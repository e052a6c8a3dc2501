//! The transition after which a check does not hold: the last firing of the shortest trace to there, or the
//! firing before it that put a token too many.

use armor_petri::{NetTransition, PlaceId, TransitionId};
use armor_robotfile::Location;

use crate::proof::Proof;
use crate::verdict::ClaimVerdict;

/// What comes behind the name of a place whose component fails.
const ON_FAILURE: &str = "/on-failure";

/// A firing that a check fails by, if one is known.
pub(super) struct Blame(Option<BlamedFiring>);

struct BlamedFiring {
    name: String,
    at: Location,
    label: String,
}

impl Blame {
    /// Adds the firing to a verdict.
    pub(super) fn explain(self, verdict: ClaimVerdict) -> ClaimVerdict {
        match (self.0, verdict) {
            (Some(BlamedFiring { name, at, label }), ClaimVerdict::Fails(mut failure)) => {
                failure.remedy = format!(
                    "lead {name} to another place, or change the rest of the mission or what the check \
                     asks of it"
                );
                failure.blamed = Some((at, label));
                ClaimVerdict::Fails(failure)
            }
            (_, verdict) => verdict,
        }
    }
}

impl Proof<'_> {
    /// The firing by which a marking comes that must not.
    pub(super) fn blame(&self, path: &[TransitionId]) -> Blame {
        let Some((last, before)) = path.split_last() else { return Blame(None) };
        let net = self.net.transition(*last);
        let surplus = net.inputs.iter().find_map(|(place, _)| {
            let producer = before.iter().rev().find(|id| self.puts_into(**id, *place))?;
            self.is_surplus(*producer, *place).then_some((*producer, *place))
        });
        let Some((producer, place)) = surplus else {
            return Blame(self.blamed_firing(*last, self.marked_by(net)));
        };
        let arcs = self.net.transition(producer);
        let label = match arcs.inputs.is_empty() {
            true => format!("this one puts a token into {} and takes none", self.net.place(place)),
            false => format!("this one puts a token into {}, too", self.net.place(place)),
        };
        Blame(self.blamed_firing(producer, label))
    }

    /// The only firing of a circle.
    pub(super) fn blame_circle(&self, circle: &[TransitionId]) -> Blame {
        let mut named = circle.iter().filter(|id| !self.name(**id).is_empty());
        let (Some(only), None) = (named.next(), named.next()) else { return Blame(None) };
        Blame(self.blamed_firing(*only, "this one fires again and again".into()))
    }

    fn puts_into(&self, id: TransitionId, place: PlaceId) -> bool {
        self.net.transition(id).outputs.iter().any(|arc| arc.0 == place)
    }

    /// Whether a firing puts a token into the place that no other token was taken for: it takes none, or
    /// puts more than it takes into a place that another transition fills.
    fn is_surplus(&self, id: TransitionId, place: PlaceId) -> bool {
        let arcs = self.net.transition(id);
        let source = self.analysed.sources[id.index()];
        let is_other = |other: &TransitionId| {
            self.analysed.sources[other.index()] != source && self.puts_into(*other, place)
        };
        let weight = |arcs: &[(PlaceId, u32)]| arcs.iter().map(|arc| u64::from(arc.1)).sum::<u64>();
        let is_fork = weight(&arcs.outputs) > weight(&arcs.inputs);
        is_fork && (arcs.inputs.is_empty() || self.net.transition_ids().any(|it| is_other(&it)))
    }

    fn marked_by(&self, transition: &NetTransition) -> String {
        let places = self.plan.places().len();
        let marked = transition.outputs.iter().filter(|arc| arc.0.index() < places);
        let marked: Vec<_> = marked.map(|arc| self.net.place(arc.0)).collect();
        format!("this one leads there: it puts a token into {}", marked.join(" and "))
    }

    fn blamed_firing(&self, id: TransitionId, label: String) -> Option<BlamedFiring> {
        let name = self.name(id).to_owned();
        let at = match name.strip_suffix(ON_FAILURE) {
            Some(place) => {
                let written = self.mission.places.iter().find(|it| it.name.value == place)?;
                written.on_failure.as_ref()?.at.clone()
            }
            None => {
                let written = self.mission.transitions.iter().find(|it| it.name.value == name)?;
                written.name.at.clone()
            }
        };
        Some(BlamedFiring { name, at, label })
    }
}
