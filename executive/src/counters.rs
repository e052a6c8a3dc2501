//! Variables that transitions set, called counters: part of the ledger. They change with the taking of
//! a firing, in its record.

use crate::ledger::{Ledger, LedgerError};
use crate::record::{GuardTurned, ValueSet};
use armor_plan::PlannedCounter;

impl Ledger {
    /// The variables that transitions set, and their values.
    pub fn values(&self) -> impl Iterator<Item = (&str, i64)> {
        let names = self.plan.counters().iter().map(|counter| counter.name.as_str());
        names.zip(self.counters.iter().copied())
    }

    /// Variables are set with the taking: what is decided next is decided by their new values.
    pub(crate) fn set_values(
        &mut self,
        sets: &[ValueSet],
        guards: &[GuardTurned],
    ) -> Result<(), LedgerError> {
        for set in sets {
            let named = |counter: &PlannedCounter| counter.name == set.variable;
            let index = self.plan.counters().iter().position(named);
            let index = index.ok_or_else(|| LedgerError::UnknownName(set.variable.clone()))?;
            self.counters[index] = set.value;
        }
        guards.iter().try_for_each(|turned| self.weighed(&turned.transition, turned.holds))
    }
}
