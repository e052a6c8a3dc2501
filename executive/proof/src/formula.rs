//! A formula of a check over the places of a net: and, or, and counts of tokens, nothing negated.

use std::collections::BTreeMap;

use armor_petri::PlaceId;
use armor_robotfile::claim;

use crate::analysed::Analysed;
use armor_plan::Plan;

/// What holds of a marking or not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum PlaceFormula {
    /// All of them hold; true if there are none.
    All(Vec<PlaceFormula>),
    /// One of them holds; false if there are none.
    Any(Vec<PlaceFormula>),
    /// The weighted sum of tokens is at least this number.
    AtLeast(Vec<(PlaceId, i64)>, i64),
}

impl PlaceFormula {
    /// Of a check over `plan`; none if it names what is not there.
    pub fn of(formula: &claim::Formula, plan: &Plan, analysed: &Analysed) -> Option<Self> {
        use claim::Formula as F;
        Some(match formula {
            F::Truth(true) => Self::All(Vec::new()),
            F::Truth(false) => Self::Any(Vec::new()),
            F::Marked(place) => Self::at_least(plan.place_named(place.as_str())?, 1),
            F::Active(component) => {
                let component = plan.component_named(component.as_str())?;
                let places = plan.component(component).places.iter();
                Self::Any(places.map(|place| Self::at_least(*place, 1)).collect())
            }
            F::Compare(left, relation, right) => {
                Self::comparison((left, *relation, right), plan, analysed)?
            }
            F::Not(inner) => Self::of(inner, plan, analysed)?.negated(),
            F::And(left, right) => {
                Self::All(vec![Self::of(left, plan, analysed)?, Self::of(right, plan, analysed)?])
            }
            F::Or(left, right) => {
                Self::Any(vec![Self::of(left, plan, analysed)?, Self::of(right, plan, analysed)?])
            }
        })
    }

    /// A place holds so many tokens or more.
    pub fn at_least(place: PlaceId, tokens: u32) -> Self {
        Self::AtLeast(vec![(place, 1)], i64::from(tokens))
    }

    fn comparison(
        (left, relation, right): (&claim::Sum, claim::Relation, &claim::Sum),
        plan: &Plan,
        analysed: &Analysed,
    ) -> Option<Self> {
        use claim::Relation as R;
        let mut counts: BTreeMap<PlaceId, i64> = BTreeMap::new();
        // left − right ≥ 0, with the numbers on the other side.
        let mut number = i64::try_from(right.number).ok()? - i64::try_from(left.number).ok()?;
        for (sum, sign) in [(left, 1), (right, -1)] {
            for name in &sum.places {
                let (place, least) = analysed.count_named(plan, name.as_str())?;
                *counts.entry(place).or_default() += sign;
                number -= sign * least;
            }
        }
        counts.retain(|_, count| *count != 0);
        let counts: Vec<_> = counts.into_iter().collect();
        let up = |more: i64| Self::AtLeast(counts.clone(), number + more);
        let negative = || counts.iter().map(|(place, count)| (*place, -count)).collect();
        let down = |less: i64| Self::AtLeast(negative(), less - number);
        Some(match relation {
            R::GreaterOrEqual => up(0),
            R::Greater => up(1),
            R::LessOrEqual => down(0),
            R::Less => down(1),
            R::Equal => Self::All(vec![up(0), down(0)]),
            R::Unequal => Self::Any(vec![up(1), down(1)]),
        })
    }

    /// What holds where this does not. Recursion is bounded by the depth that is read.
    pub fn negated(&self) -> Self {
        let negated = |parts: &[Self]| parts.iter().map(Self::negated).collect();
        match self {
            Self::All(parts) => Self::Any(negated(parts)),
            Self::Any(parts) => Self::All(negated(parts)),
            Self::AtLeast(counts, least) => {
                let counts = counts.iter().map(|(place, count)| (*place, -count)).collect();
                Self::AtLeast(counts, 1 - least)
            }
        }
    }

    /// Whether it holds of a marking, tokens per place.
    pub fn holds(&self, marking: &[u32]) -> bool {
        match self {
            Self::All(parts) => parts.iter().all(|part| part.holds(marking)),
            Self::Any(parts) => parts.iter().any(|part| part.holds(marking)),
            Self::AtLeast(counts, least) => {
                let tokens = |(place, count): &(PlaceId, i64)| {
                    i128::from(*count) * i128::from(marking[place.index()])
                };
                counts.iter().map(tokens).sum::<i128>() >= i128::from(*least)
            }
        }
    }
}
