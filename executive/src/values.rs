//! Values that places give parameters. They belong to an activation: decided when it begins, by the
//! places that are marked then or about to be, and handed over before its first call. A component that
//! needs other values is stopped and started again.

use crate::ledger::Ledger;
use armor_petri::PlaceId;
use armor_plan::{ComponentId, GivenValue};
use std::collections::BTreeSet;

impl Ledger {
    /// The values of an activation that begins now.
    pub(crate) fn values_for(&self, component: ComponentId) -> Vec<GivenValue> {
        self.values_with(component, &[], None)
    }

    /// The components of a firing's places that run and have to be started afresh: those that have
    /// finished, and those that get other values. `firing` is its number, if it is in flight.
    pub(crate) fn to_renew(
        &self,
        to: &[(PlaceId, u32)],
        firing: Option<u64>,
    ) -> BTreeSet<ComponentId> {
        let mut renewed = self.finished_in(to);
        let components = to.iter().flat_map(|arc| &self.plan.place(arc.0).components);
        renewed.extend(components.filter(|component| {
            let last = &self.activations[component.index()];
            let is_same = |values: &[GivenValue]| {
                let terms = values.iter().map(GivenValue::terms);
                terms.eq(last.values.iter().map(GivenValue::terms))
            };
            let runs = last.open && self.plan.component(**component).is_controlled();
            runs && last.number > 0 && !is_same(&self.values_with(**component, to, firing))
        }));
        renewed
    }

    /// By the places that are marked, those that firings lead to (but for `except`), and `to`.
    fn values_with(
        &self,
        component: ComponentId,
        to: &[(PlaceId, u32)],
        except: Option<u64>,
    ) -> Vec<GivenValue> {
        let flights = self.firings.iter().filter(|(number, _)| Some(**number) != except);
        let arriving: BTreeSet<_> =
            flights.flat_map(|(_, firing)| &firing.to).chain(to).map(|arc| arc.0).collect();
        let is_marked = |place: PlaceId| self.state.tokens(place) > 0 || arriving.contains(&place);
        self.plan.values_in(component, is_marked)
    }
}
