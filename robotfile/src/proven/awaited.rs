//! What a check that fails waits for.

use crate::claim::{Claim, Statement};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::source::Location;

/// Returns whether the check that fails waits for the place.
pub(super) fn waits_for(result: &Finding, place: &str) -> bool {
    let is_it = |claim: Claim| claim.names().iter().any(|(_, name)| name.as_str() == place);
    find_awaited(result).is_some_and(is_it)
}

/// Returns the check that fails, if it waits for something to happen.
pub(super) fn find_awaited(result: &Finding) -> Option<Claim> {
    let at = result.at.as_ref().filter(|_| result.code == Code::CheckFails)?;
    let claim = read_claim(at)?;
    let is_awaited = matches!(
        claim.statement,
        Statement::Reachable(_)
            | Statement::AlwaysReachable(_)
            | Statement::Eventually(_)
            | Statement::LeadsTo(..)
            | Statement::Fires(_)
            | Statement::Duration { .. }
    );
    is_awaited.then_some(claim)
}

/// Reads the claim that is written there.
pub(super) fn read_claim(at: &Location) -> Option<Claim> {
    let mut of_xml = Findings::default();
    Claim::parse(&crate::start_tag::unescape(at, &mut of_xml)).ok()
}
