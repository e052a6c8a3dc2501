//! A marking that can come, with what shows it.

use armor_petri::TransitionId;
use armor_petri::analysis::runs::MarkingGraph;

/// A marking and firings that lead to it.
#[derive(Clone, Debug)]
pub(crate) struct Witness {
    pub(crate) path: Vec<TransitionId>,
    pub(crate) marking: Vec<u32>,
}

impl Witness {
    pub(crate) fn of(graph: &dyn MarkingGraph, node: u32) -> Self {
        Self { path: graph.path(node), marking: graph.tokens(node).into_owned() }
    }
}
