//! Limits for the number of elements, so that the work for any file is bounded.

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::source::Location;

/// The limit for the components, places, transitions and so on of a mission or system, for each
/// kind.
pub const MAX_ELEMENTS: usize = 4096;
/// Most links of a system.
pub const MAX_LINKS: usize = 16_384;
/// Most frames of a system: as many as a tree of transforms has.
pub const MAX_FRAMES: usize = 256;

/// Most zones, and most lines, of a map: every leg and every exit is compared with each.
pub const MAX_ZONES: usize = 256;
/// Most rally points of a map: the exits of each leg are compared with each.
pub const MAX_RALLIES: usize = 16;
/// Most points of one shape: the edges of a polygon are compared with each other.
pub const MAX_SHAPE_CORNERS: usize = 256;
/// Most points of all shapes of a map.
pub const MAX_MAP_CORNERS: usize = 2_048;
/// Most routes of a mission.
pub const MAX_ROUTES: usize = 8;
/// Most steps of a route.
pub const MAX_ROUTE_STEPS: usize = 64;
/// Most exits of a route: each step has each.
pub const MAX_ROUTE_EXITS: usize = 16;

/// Adds to a list up to a limit; false, once with a finding, beyond it.
pub(super) fn add_limited<T>(
    list: &mut Vec<T>,
    item: T,
    limit: usize,
    at: &Location,
    findings: &mut Findings,
) {
    if list.len() < limit {
        list.push(item);
        return;
    }
    // Reported once: the list does not grow beyond the limit, so only its first excess counts.
    let already = findings.iter().any(|finding| {
        finding.code == Code::TooMany
            && finding.at.as_ref().is_some_and(|other| other.text() == at.text())
    });
    if !already {
        let message = format!("there are more than {limit} <{}>", at.text());
        findings
            .push(Finding::new(Code::TooMany, at, message).remedy("this is the format's limit"));
    }
}
