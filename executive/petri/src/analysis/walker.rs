//! A small net for the tests of this folder.

use super::budget::AnalysisBudget;
use super::explore_states;
use super::invariants::PlaceBounds;
use super::space::Space;
use crate::net::Net;

/// Returns the space of one token that moves along these edges.
pub(super) fn space_of_walker(places: usize, edges: &[(usize, usize)]) -> Space {
    let mut net = Net::builder();
    let places: Vec<_> =
        (0..places).map(|p| net.place(format!("p{p}"), u32::from(p == 0))).collect();
    for (index, &(from, to)) in edges.iter().enumerate() {
        net.transition(format!("t{index}")).input(places[from], 1).output(places[to], 1);
    }
    let net = net.build().unwrap();
    explore_states(&net, &PlaceBounds::of_net(&net, &|| false), true, &AnalysisBudget::UNLIMITED)
        .space
}
