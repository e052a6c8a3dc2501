//! The data that the time of a system follows, as its links show: the provider has a link to each
//! process that brings nothing but the time.

use armor_sdk::time_link;
use armor_wire::control::Status;

/// Returns the data that the time of `component` follows; none if that is the registry's clock.
pub fn find_source_of(statuses: &[Status], component: &str) -> Option<String> {
    let link = time_link(component);
    find_output(statuses, |to| to == link)
}

/// Returns the data that the time of any component follows.
pub fn find_time_source(statuses: &[Status]) -> Option<String> {
    let is_time_link =
        |to: &str| to.split_once(':').is_some_and(|(component, _)| to == time_link(component));
    find_output(statuses, is_time_link)
}

fn find_output(statuses: &[Status], has_link: impl Fn(&str) -> bool) -> Option<String> {
    let mut outputs = statuses.iter().flat_map(|status| &status.outputs);
    let source = outputs.find(|output| output.links.iter().any(|link| has_link(&link.to)));
    source.map(|output| output.data.clone())
}
