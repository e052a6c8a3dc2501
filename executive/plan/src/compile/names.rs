//! Names of the file looked up, and findings about those that lead nowhere.

use armor_petri::PlaceId;
use armor_robotfile::{Code, Finding, Location, Spanned};

use super::Compiler;
use crate::planned::ComponentId;

impl Compiler {
    pub(super) fn idle(&self, component: &str, at: &Location) {
        let message = format!("{component} does not run: it was not in the file at the start");
        let finding = Finding::new(Code::UnknownComponent, at, message);
        let remedy = "run the system again, or leave it out of the mission";
        self.findings.borrow_mut().push(finding.remedy(remedy));
    }

    /// A fault that [`armor_robotfile::check`] reports in more detail; a file that it refuses is
    /// not compiled.
    pub(super) fn report(&self, code: Code, at: &Location, message: &str) {
        let finding = Finding::new(code, at, message).remedy("correct it; armor check shows how");
        self.findings.borrow_mut().push(finding);
    }

    /// A component that may be excluded from running: one that something starts and stops.
    pub(super) fn exclusive(&self, name: &Spanned<String>) -> Option<ComponentId> {
        let id = self.find_component(name)?;
        if !self.plan.components[id.index()].is_controlled() {
            let message = format!("{} is in no place, so it is always active", name.value);
            let finding = Finding::new(Code::NotControllable, &name.at, message);
            let remedy = "put it into a place, or take it out of here";
            self.findings.borrow_mut().push(finding.remedy(remedy));
        }
        Some(id)
    }

    pub(super) fn find_place(&self, name: &Spanned<String>) -> Option<PlaceId> {
        let id = self.places.get(&name.value).copied();
        if id.is_none() {
            self.unknown(Code::UnknownPlace, name, "place");
        }
        id
    }

    pub(super) fn find_component(&self, name: &Spanned<String>) -> Option<ComponentId> {
        let id = self.components.get(&name.value).copied();
        if self.idle.contains(&name.value) {
            self.idle(&name.value, &name.at);
        } else if id.is_none() {
            self.unknown(Code::UnknownComponent, name, "component");
        }
        id
    }

    fn unknown(&self, code: Code, name: &Spanned<String>, what: &str) {
        let message = format!("there is no {what} called {}", name.value);
        let finding = Finding::new(code, &name.at, message).remedy("correct the name");
        self.findings.borrow_mut().push(finding);
    }
}
