//! What the processes of other hosts may read.

use armor_wire::acting::{KeyRole, Rights};
use armor_wire::registry::DataReader;
use armor_wire::run_key::LinkKey;

use super::*;

/// The registry of a run, in which laser and camera publish, and gripper is placed on the host arm.
struct Site {
    bench: Bench,
    configd: PeerId,
    laser: PeerId,
}

fn reader(component: &str, data: &[&str], reads_all: bool) -> DataReader {
    let data = data.iter().map(ToString::to_string).collect();
    DataReader { component: component.into(), data, reads_all }
}

impl Site {
    fn new() -> Self {
        let mut bench = Bench::new();
        bench.directory = RegistryDirectory::new(99, 1000.0).with_secret(Some(*SECRET));
        let configd = bench.hello_proven("configd", None).0;
        let laser = bench.component("laser");
        let camera = bench.component("camera");
        for (peer, name) in
            [(laser, "laser.scan"), (laser, "laser.state"), (camera, "camera.image")]
        {
            bench.provide(peer, data(name));
        }
        Self { bench, configd, laser }
    }

    fn report(&mut self, readers: Vec<DataReader>) -> Actions {
        self.bench.send_request(self.configd, RegistryRequest::Readers { readers })
    }

    /// A process of another host, on which these components run.
    fn process_of(&mut self, host: &str, components: &[&str]) -> PeerId {
        let components = components.iter().map(ToString::to_string).collect();
        self.process_with(Preface { name: host.into(), rights: Rights::Host { components } })
    }

    fn process_with(&mut self, preface: Preface) -> PeerId {
        self.bench.peers += 1;
        let (peer, address) = (PeerId(self.bench.peers), ADDRESS.into());
        let hello = Hello::new("tool-7", 1, Purpose::Registry { entry: None });
        let preface = Some(preface);
        self.bench.handle(PeerEvent::Connected { peer, address, hello, preface });
        peer
    }
}

/// The key in the only answer, which is found.
fn key(actions: &[PeerAction<RegistryReply>]) -> Option<LinkKey> {
    match actions {
        [PeerAction::Send { message: RegistryReply::Found { key, .. }, .. }] => {
            key.map(LinkKey::new)
        }
        other => panic!("not found: {other:?}"),
    }
}

#[test]
fn a_host_reads_what_the_file_leads_to_its_components() {
    let mut site = Site::new();
    site.report(vec![reader("gripper", &["laser.scan"], false), reader("view", &[], true)]);
    let arm = site.process_of("arm", &["gripper"]);
    let expected = SECRET.key_of("laser").key_of_link("arm", "laser.scan", 7);
    assert_eq!(key(&site.bench.lookup(arm, 1, "laser.scan", true)), Some(expected));
    for wait in [false, true] {
        let actions = site.bench.lookup(arm, 2, "laser.state", wait);
        let refused = refusal(&actions);
        assert_eq!(refused.code, RefusalCode::Role);
        assert!(
            refused.text.starts_with("reading `laser.state` is not for the host arm: no link")
                && refused.text.contains("(gripper)")
                && refused.text.ends_with("such as to=\"gripper.INPUT\""),
            "{refused}"
        );
    }
    // Also what no process provides yet.
    assert_eq!(refusal(&site.bench.lookup(arm, 3, "new.data", true)).code, RefusalCode::Role);
    // Another host, on which the file places nothing that reads; one with a component that reads all.
    let base = site.process_of("base", &["base"]);
    assert_eq!(refusal(&site.bench.lookup(base, 1, "laser.scan", true)).code, RefusalCode::Role);
    let laptop = site.process_of("laptop", &["view"]);
    let expected = SECRET.key_of("camera").key_of_link("laptop", "camera.image", 7);
    assert_eq!(key(&site.bench.lookup(laptop, 1, "camera.image", false)), Some(expected));
    // A name that only looks like that of a component there is none.
    assert_eq!(refusal(&site.bench.lookup(arm, 4, "gripper2.x", true)).code, RefusalCode::Role);
    assert!(site.bench.lookup(arm, 5, "gripper.grip", true).is_empty(), "its own: it waits");
}

#[test]
fn who_runs_and_what_the_mission_does_is_open_to_every_host() {
    let mut site = Site::new();
    let executive = ComponentEntry { kind: "executive".into(), ..entry("executive") };
    let (executive, _) = site.bench.hello_proven("executive", Some(executive));
    site.bench.provide(executive, data("executive.marking"));
    let arm = site.process_of("arm", &["gripper"]);
    // Even before configd has reported anything.
    assert!(key(&site.bench.lookup(arm, 1, "executive.marking", true)).is_some());
    assert_eq!(key(&site.bench.lookup(arm, 2, "laser", true)), None, "a process, not data");
}

#[test]
fn people_and_processes_of_this_host_need_no_link() {
    let mut site = Site::new();
    site.report(Vec::new());
    let own = site.bench.observer();
    let alice = site.process_with(Preface::of_person("alice", KeyRole::Observer));
    for peer in [own, alice] {
        assert_eq!(key(&site.bench.lookup(peer, 1, "laser.scan", true)), None);
    }
}

#[test]
fn a_lookup_waits_until_the_links_are_known() {
    let mut site = Site::new();
    let arm = site.process_of("arm", &["gripper"]);
    assert!(site.bench.lookup(arm, 1, "laser.scan", true).is_empty());
    assert!(site.bench.lookup(arm, 2, "camera.image", true).is_empty());
    assert!(site.bench.lookup(arm, 3, "late.data", true).is_empty());
    assert_eq!(refusal(&site.bench.lookup(arm, 4, "laser.scan", false)).code, RefusalCode::Limit);
    let actions = site.report(vec![reader("gripper", &["laser.scan", "late.data"], false)]);
    let (refused, found): (Vec<_>, Vec<_>) = actions.into_iter().partition(|action| {
        matches!(action, PeerAction::Send { message: RegistryReply::Refused { .. }, .. })
    });
    assert!(key(&found).is_some());
    assert!(refusal(&refused).text.contains("reading `camera.image`"), "{refused:?}");
    let late = site.bench.component("late");
    let actions = site.bench.provide(late, data("late.data"));
    assert!(key(&actions[1..]).is_some(), "{actions:?}");
}

#[test]
fn links_follow_the_file_and_what_was_granted_stays() {
    let mut site = Site::new();
    site.report(vec![reader("gripper", &["laser.scan"], false)]);
    let arm = site.process_of("arm", &["gripper"]);
    assert!(key(&site.bench.lookup(arm, 1, "laser.scan", true)).is_some());
    site.report(vec![reader("gripper", &["camera.image"], false)]);
    assert!(key(&site.bench.lookup(arm, 2, "camera.image", true)).is_some());
    // A running component keeps the links that it was started with, until it is started again.
    assert!(key(&site.bench.lookup(arm, 3, "laser.scan", true)).is_some());
    let again = site.process_of("arm", &["gripper"]);
    assert_eq!(refusal(&site.bench.lookup(again, 1, "laser.scan", true)).code, RefusalCode::Role);
}

#[test]
fn only_configd_reports_the_links() {
    let mut site = Site::new();
    let readers = || vec![reader("gripper", &["laser.scan"], false)];
    let observer = site.bench.observer();
    let launcher = site.bench.hello_proven("launcher-7", None).0;
    for peer in [observer, launcher, site.laser] {
        let readers = readers();
        let actions = site.bench.send_request(peer, RegistryRequest::Readers { readers });
        let is_closed = |action: &PeerAction<_>| matches!(action, PeerAction::Close { .. });
        assert!(actions.iter().any(is_closed), "{actions:?}");
    }
    let arm = site.process_of("arm", &["gripper"]);
    assert!(site.bench.lookup(arm, 1, "laser.scan", true).is_empty(), "no links are known");
}
