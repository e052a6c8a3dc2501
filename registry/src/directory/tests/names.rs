//! Names that belong to the processes which the launcher of the run starts.

use super::*;

/// A registry of a run, whose launcher has reserved these names.
fn bench(reserved: &[&str]) -> (Bench, PeerId) {
    let mut bench = Bench::new();
    bench.directory = RegistryDirectory::new(99, 1000.0).with_secret(Some(*SECRET));
    let (launcher, actions) = bench.hello_proven("launcher-7", None);
    assert!(matches!(actions[..], [PeerAction::Welcome { .. }]), "{actions:?}");
    reserve(&mut bench, launcher, reserved);
    (bench, launcher)
}

fn reserve(bench: &mut Bench, launcher: PeerId, names: &[&str]) {
    let names = names.iter().map(ToString::to_string).collect();
    let actions = bench.send_request(launcher, RegistryRequest::Reserve { names });
    assert!(actions.is_empty(), "{actions:?}");
}

fn is_welcome(actions: &Actions) -> bool {
    actions.iter().any(|action| matches!(action, PeerAction::Welcome { .. }))
}

#[test]
fn the_name_of_a_dead_component_stays_with_the_launcher_until_it_gives_it_free() {
    let (mut bench, launcher) = bench(&["laser"]);
    let (laser, actions) = bench.hello_proven("laser", Some(entry("laser")));
    assert!(is_welcome(&actions), "{actions:?}");
    bench.close(laser);
    let refusal = bench.refused(&entry("laser"));
    assert_eq!(refusal.code, RefusalCode::DuplicateName);
    assert!(refusal.text.contains("`armor stop laser`"), "{refusal}");
    bench.component("another");
    reserve(&mut bench, launcher, &[]);
    bench.component("laser");
}

#[test]
fn a_process_of_the_launcher_replaces_one_that_was_earlier_under_its_name() {
    let (mut bench, _) = bench(&[]);
    let by_hand = bench.component("laser");
    let started = ComponentEntry { instance: 8, ..entry("laser") };
    let (laser, actions) = bench.hello_proven("laser", Some(started.clone()));
    let is_closed = |action: &PeerAction<_>| matches!(action, PeerAction::Close { peer, .. } if *peer == by_hand);
    assert!(is_welcome(&actions) && actions.iter().any(is_closed), "{actions:?}");
    // A second one is a duplicate, as ever.
    let second = ComponentEntry { instance: 9, ..started };
    let (_, actions) = bench.hello_proven("laser", Some(second));
    assert!(matches!(actions[..], [PeerAction::Refuse { .. }]), "{actions:?}");
    bench.close(laser);
}

#[test]
fn a_key_is_good_for_its_own_name_and_the_roles_of_the_system_need_one() {
    let (mut bench, _) = bench(&["laser", "driver"]);
    // The key of driver, with the name of laser in the entry.
    let (_, actions) = bench.hello_proven("driver", Some(entry("laser")));
    assert!(matches!(actions[..], [PeerAction::Refuse { .. }]), "{actions:?}");
    for name in ["executive", "configd", "configuration"] {
        let own = ComponentEntry { kind: name.into(), ..entry(name) };
        assert_eq!(bench.refused(&own).code, RefusalCode::DuplicateName, "{name}");
        let (_, actions) = bench.hello_proven(name, Some(own));
        assert!(is_welcome(&actions), "{actions:?}");
    }
}

#[test]
fn only_the_launcher_reserves_names() {
    let (mut bench, _) = bench(&[]);
    let names = vec!["laser".to_owned()];
    let observer = bench.observer();
    let component = bench.hello_proven("launcher-x", Some(entry("launcher-x"))).0;
    for peer in [observer, component] {
        let actions = bench.send_request(peer, RegistryRequest::Reserve { names: names.clone() });
        let is_closed = |action: &PeerAction<_>| matches!(action, PeerAction::Close { .. });
        assert!(actions.iter().any(is_closed), "{actions:?}");
    }
    bench.component("laser");
}

#[test]
fn a_registry_that_was_started_by_hand_takes_every_name() {
    let mut bench = Bench::new();
    bench.component("laser");
    let own = ComponentEntry { kind: "executive".into(), ..entry("executive") };
    assert!(is_welcome(&bench.register(&own).1));
}
