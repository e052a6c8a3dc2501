//! File descriptors: how many a run needs, and the limit that all of its processes inherit.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use armor_robotfile::model::{Link, LinkMode, Transport};
use armor_robotfile::{Manifests, System, TypedManifests};
use armor_wire::schema::{self, Schema};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// What the launcher has open without any process: its record, sockets, signals, the log, the status
/// line, and room for tools and for what is open only for a moment while a process starts.
const OF_LAUNCHER: u64 = 40;
/// What the launcher has open for each process: two pipes, the process, its log file, and for a
/// component the control connection (two).
const PER_PROCESS: u64 = 6;
/// What a component has open without links.
const OF_COMPONENT: u64 = 24;
/// What a component has open for each of its links.
const PER_LINK: u64 = 2;
/// Most that is asked of the kernel where there is no hard limit.
const UNLIMITED: u64 = 1 << 20;

/// Returns the number of descriptors that the largest process of a run needs: `processes` of them
/// under the launcher, and the links of the file.
pub fn count_needed(system: &System, manifests: &Manifests, processes: usize) -> u64 {
    let launcher = OF_LAUNCHER + PER_PROCESS * processes as u64;
    let types = TypedManifests::of(system, manifests);
    let needs = system
        .components
        .iter()
        .map(|component| count_for_component(system, &types, &component.name.value));
    launcher.max(needs.max().unwrap_or(0))
}

fn count_for_component(system: &System, types: &TypedManifests<'_>, name: &str) -> u64 {
    let ends = system.links.iter().flat_map(|link| [&link.from, &link.to]);
    let links = ends.filter(|end| end.component.value == name).count() as u64;
    let others = count_datagram_sockets(system, name) + count_slots(system, types, name);
    OF_COMPONENT + PER_LINK * links + others
}

/// Datagrams take one more socket at each subscriber's link, and one for all that a process publishes.
fn count_datagram_sockets(system: &System, name: &str) -> u64 {
    let links = || system.links.iter().filter(|link| link.transport == Transport::Udp);
    let received = links().filter(|link| link.to.component.value == name).count() as u64;
    received + u64::from(links().any(|link| link.from.component.value == name))
}

/// The publisher keeps the file of each slot of shared memory open, for subscribers that it has not
/// offered the slot to yet. Subscribers close the files when they have mapped them.
fn count_slots(system: &System, types: &TypedManifests<'_>, name: &str) -> u64 {
    let mut outputs: BTreeMap<&str, Vec<_>> = BTreeMap::new();
    let published = system.links.iter().filter(|link| link.from.component.value == name);
    for link in published.filter(|link| may_share_memory(system, types, link)) {
        outputs.entry(&link.from.port.value).or_default().push((link.find_policy(), link.history));
    }
    outputs.into_values().map(|links| u64::from(armor_sdk::count_slots(links))).sum()
}

/// Whether a link is expected to use shared memory: because the file asks for it, or because its
/// messages contain arrays of any length. A text that is longer than 16 KiB is not expected.
fn may_share_memory(system: &System, types: &TypedManifests<'_>, link: &Link) -> bool {
    let hosts = [&link.from, &link.to].map(|end| {
        let component = system.component(&end.component.value);
        component.and_then(|component| component.host.as_ref()).map(|host| host.value.as_str())
    });
    hosts[0] == hosts[1]
        && match link.transport {
            Transport::Shm => true,
            Transport::Tcp | Transport::Udp => false,
            Transport::Auto if link.mode == LinkMode::Pull => true,
            Transport::Auto => {
                let kind = types.find(&link.from.component.value);
                let outputs = kind.into_iter().flat_map(|kind| &kind.outputs);
                let output = outputs.into_iter().find(|output| output.id == link.from.port.value);
                let schema = output.and_then(|output| schema::parse(&output.schema).ok());
                schema.is_some_and(|schema| has_list(&schema))
            }
        }
}

fn has_list(schema: &Schema) -> bool {
    match schema {
        Schema::List(_) => true,
        Schema::Option(item) | Schema::Fixed(item, _) => has_list(item),
        Schema::Struct { fields, .. } => fields.iter().any(|field| has_list(&field.schema)),
        Schema::Enum { variants, .. } => {
            variants.iter().flat_map(|it| &it.fields).any(|field| has_list(&field.schema))
        }
        _ => false,
    }
}

/// Raises the limit to the most that is allowed.
///
/// # Errors
/// If that is less than `needed`.
pub fn raise_limit(needed: u64) -> Result<()> {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let most = maximum.unwrap_or(UNLIMITED);
    let raised = current.is_some_and(|current| current < most)
        && setrlimit(Resource::Nofile, Rlimit { current: Some(most), maximum }).is_ok();
    let limit = if raised { most } else { current.unwrap_or(UNLIMITED) };
    if limit < needed {
        bail!(
            "this system needs {needed} file descriptors, and the limit is {limit}: run \
             `ulimit -n {needed}` first; where that is refused, raise the hard limit (`nofile` in \
             /etc/security/limits.conf, or `LimitNOFILE={needed}` in the service of systemd)"
        );
    }
    Ok(())
}

/// Returns whether this process can open another file.
pub fn has_free_descriptor() -> bool {
    std::fs::File::open("/dev/null").is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds::stock::STOCK;

    /// Checks what the simulator and the mapper `slam` need more than without links.
    #[track_caller]
    fn check(links: &str, simulator: u64, mapper: u64) {
        let text = format!(
            r#"<armor version="1"><system><host name="base" address="10.0.0.2"/>
            <component name="sim" kind="simulator"/><component name="slam" kind="grid-slam"/>
            <component name="second" kind="grid-slam"/>
            <component name="far" kind="grid-slam" host="base"/>{links}</system></armor>"#
        );
        let reading =
            armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(text.clone().into_bytes()));
        let system = reading.configuration.expect("it is read").system;
        assert_eq!(system.links.len(), links.matches("<link").count(), "{links}");
        let manifests: Manifests = STOCK
            .iter()
            .map(|stock| (stock.kind.into(), (stock.manifest)().expect("a manifest")))
            .collect();
        let types = TypedManifests::of(&system, &manifests);
        let needs = |name| count_for_component(&system, &types, name) - OF_COMPONENT;
        assert_eq!((needs("sim"), needs("slam")), (simulator, mapper), "{links}");
    }

    #[test]
    fn each_link_needs_its_sockets_and_datagrams_one_more_at_the_subscriber_and_one_per_publisher()
    {
        check("", 0, 0);
        check(r#"<link from="sim.scan" to="slam.scan" transport="tcp"/>"#, 2, 2);
        check(r#"<link from="sim.scan" to="slam.scan" transport="udp"/>"#, 3, 3);
        let both = r#"<link from="sim.scan" to="slam.scan" transport="udp"/>
                      <link from="sim.odometry" to="slam.odometry" transport="udp"/>"#;
        check(both, 5, 6);
    }

    #[test]
    fn the_publisher_keeps_the_file_of_each_slot_that_an_output_may_have() {
        // Latest: one in the ring, three held, one that is copied, and two of the publisher.
        let link = r#"<link from="sim.scan" to="slam.scan" keep="latest"/>"#;
        check(link, 2 + 7, 2);
        check(&link.replace("latest", "all"), 2 + 21, 2);
        // With a history `latest` keeps as many: four in the ring, four that wait, and the history.
        check(&link.replace("<link", r#"<link history="4""#), 2 + 17, 2);
        let second = link.replace("slam.", "second.");
        check(&format!("{link}{second}"), 4 + 12, 2);
        let pull = link.replace("keep=\"latest\"", "mode=\"pull\"");
        check(&pull, 2 + 7, 2);
        check(&pull.replace("scan", "odometry"), 2 + 7, 2);
        // No memory: it has no array, or no common host.
        check(&link.replace("scan", "odometry"), 2, 2);
        check(&link.replace("slam.", "far."), 2, 0);
        let asked = link.replace("scan", "odometry").replace("/>", " transport=\"shm\"/>");
        check(&asked, 2 + 7, 2);
    }
}
