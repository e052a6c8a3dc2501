//! Reports of components: which of them are worth a record. Each is acknowledged.

use super::context::Context;
use crate::event::ControllerAction;
use crate::record::JournalEntry;
use crate::terms::ComponentReport;
use armor_plan::ComponentId;
use std::collections::BTreeMap;

/// Takes reports, and counts those that change nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Reports {
    late: u64,
    repeated: u64,
    /// By the component's name: another version of the file gives them other numbers.
    unheard: BTreeMap<String, u64>,
}

impl Reports {
    /// Returns the reports of activations that are over.
    pub(super) fn late(&self) -> u64 {
        self.late
    }

    /// Returns the reports that were received again.
    pub(super) fn repeated(&self) -> u64 {
        self.repeated
    }

    /// Returns the reports that no transition waits for.
    pub(super) fn unheard(&self) -> u64 {
        self.unheard.values().sum()
    }

    /// Returns those of a component.
    pub(super) fn unheard_of(&self, component: &str) -> u64 {
        self.unheard.get(component).copied().unwrap_or_default()
    }

    /// Takes a report; `source` is the process start and the number of the report in it.
    pub(super) fn take_report(
        &mut self,
        cx: &mut Context,
        component: ComponentId,
        source: (u64, u64),
        activation: u64,
        report: ComponentReport,
    ) {
        let (instance, serial) = source;
        let planned = cx.plan().component(component);
        let last = cx.ledger().activation(component);
        let current = last.open && (activation == last.number || !planned.is_controlled());
        let repeated = instance == last.heard.0 && serial <= last.heard.1;
        let ends = matches!(report, ComponentReport::Done | ComponentReport::Failed { .. });
        let listened = !cx.plan().listeners(component, report.name()).is_empty();
        if repeated {
            self.repeated += 1;
        } else if !current {
            self.late += 1;
        } else if !ends && !listened {
            *self.unheard.entry(planned.name.clone()).or_default() += 1;
        } else {
            let component = planned.name.clone();
            cx.record_entry(JournalEntry::Heard { component, instance, serial, report });
        }
        cx.add_action(ControllerAction::Acknowledge { component, serial });
    }
}
