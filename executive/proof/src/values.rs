//! Places that can be marked together and give a parameter of a component different values: which
//! of them it has would depend on the order in the file.

use armor_robotfile::{Code, Finding, Findings};

use crate::proof::Proof;
use armor_plan::Contradiction;

impl Proof<'_> {
    pub(super) fn contradictions(&self, findings: &mut Findings) {
        for contradiction in self.plan.contradictions() {
            findings.extend(self.contradiction_finding(&contradiction));
        }
    }

    fn contradiction_finding(&self, contradiction: &Contradiction<'_>) -> Option<Finding> {
        let Contradiction { component, places: [place, second], values: [one, other] } =
            contradiction;
        let seen = self.find_together(*place, *second)?;
        let component = &self.plan.components()[component.index()].name;
        let message = format!(
            "{} {} and {} are marked together, and the one gives {component} {one}, the other {other}: \
             the first in the file would count",
            self.after_firings(&seen.path),
            self.net.place(*place),
            self.net.place(*second),
        );
        let finding = Finding::new(Code::ValuesContradict, self.at(*place), message);
        Some(
            finding
                .trace(self.trace_of(&seen.path, &[]))
                .related(self.at(*second), "together with this one")
                .remedy("give both the same value, or let one transition leave the one place and enter the other"),
        )
    }
}
