//! Circles: modules that import each other in a loop.

use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;

use petgraph::algo::tarjan_scc;
use petgraph::graph::DiGraph;

use crate::modules::CrateModules;

/// Modules each of which reaches every other one by imports.
#[derive(Clone, Debug)]
pub struct Circle {
    /// The files of the modules, ordered.
    pub files: Vec<PathBuf>,
    /// Who takes which names from whom.
    pub imports: Vec<(PathBuf, PathBuf, BTreeSet<String>)>,
}

/// Finds the circles among the modules of one library or program, the largest first.
pub fn circles_of(modules: &CrateModules) -> Vec<Circle> {
    let mut graph = DiGraph::<(), ()>::new();
    let nodes: Vec<_> = modules.files.iter().map(|_| graph.add_node(())).collect();
    for (from, to) in modules.imports.keys() {
        graph.add_edge(nodes[*from], nodes[*to], ());
    }
    let mut circles: Vec<Circle> = tarjan_scc(&graph)
        .into_iter()
        .map(|members| members.into_iter().map(|node| node.index()).collect::<Vec<_>>())
        .filter(|members| members.len() > 1)
        .map(|members| {
            let mut files: Vec<_> =
                members.iter().map(|file| modules.files[*file].clone()).collect();
            files.sort();
            let inside =
                |(from, to): &(usize, usize)| members.contains(from) && members.contains(to);
            let imports = modules.imports.iter().filter(|(pair, _)| inside(pair));
            let imports = imports.map(|((from, to), names)| {
                (modules.files[*from].clone(), modules.files[*to].clone(), names.clone())
            });
            Circle { files, imports: imports.collect() }
        })
        .collect();
    circles.sort_by_key(|circle| std::cmp::Reverse(circle.files.len()));
    circles
}

impl fmt::Display for Circle {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{} modules import each other:", self.files.len())?;
        for (from, to, names) in &self.imports {
            let names: Vec<_> = names.iter().map(String::as_str).collect();
            writeln!(out, "  {} -> {}: {}", from.display(), to.display(), names.join(", "))?;
        }
        Ok(())
    }
}
