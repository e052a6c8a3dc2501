//! What components get when they ask, and which changes they are sent.

use armor_wire::config::InputSettings;
use armor_wire::keep::{Keep, Wake};
use armor_wire::peer::CloseReason;
use armor_wire::transport::Transport;

use super::*;

#[test]
fn a_component_learns_how_it_runs_and_is_connected() {
    let mut versions = versions();
    let input = |id: &str, data: &str, keep, wake| InputSettings {
        id: id.into(),
        data: data.into(),
        keep,
        wake,
        transport: if wake == Wake::Spin { Transport::Tcp } else { Transport::Auto },
        history: 1,
    };
    let wanted = ComponentSettings {
        version: 1,
        rate_hz: Some(10.0),
        controlled: false,
        inputs: vec![
            input("scan", "player.scan", Keep::ALL, Wake::Sleep),
            input("odometry", "player.odometry", Keep::Last { count: 50 }, Wake::Spin),
        ],
        watchdog_s: None,
        clock: None,
    };
    assert_eq!(settings(&mut versions, "mapper"), wanted);
    assert!(settings(&mut versions, "player").controlled);
    assert!(!settings(&mut versions, "view").controlled);
}

#[test]
fn a_parameter_comes_with_its_folder_and_place_or_is_not_assigned() {
    let mut versions = versions();
    let wanted = Assigned {
        text: "logs/a.log".into(),
        base: "/robot/m".into(),
        origin: "m/a.xml:4:37".into(),
    };
    assert_eq!(parameter(&mut versions, "player", "file"), Some(wanted));
    assert_eq!(parameter(&mut versions, "player", "loop"), None);
}

#[test]
fn a_component_is_refused_until_it_is_in_the_file() {
    let mut versions = versions();
    connect(&mut versions, 1, "plaier", Purpose::Config);
    match ask(&mut versions, 1, ConfigRequest::Settings { request: 5 }) {
        ConfigReply::Refused { request: 5, refusal } => {
            assert_eq!(
                refusal.text,
                "m/a.xml has no component called `plaier`; did you mean player? It has: player, \
                 mapper, view"
            );
        }
        other => panic!("{other:?}"),
    }
    versions.handle(saved(&FILE.replace("\"view\" ", "\"plaier\" ")));
    let answer = ask(&mut versions, 1, ConfigRequest::Settings { request: 6 });
    assert!(matches!(answer, ConfigReply::Settings { request: 6, .. }), "{answer:?}");
}

#[test]
fn a_client_with_another_purpose_is_refused() {
    let action = connect(&mut versions(), 1, "tool", Purpose::Registry { entry: None });
    assert!(matches!(action, armor_wire::peer::PeerAction::Refuse { .. }), "{action:?}");
}

#[test]
fn a_live_parameter_that_was_asked_for_is_sent_when_it_changes() {
    let rules = VersionRules { manifests: Some(live_manifests()), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    for (peer, name) in [(1, "player"), (2, "player"), (3, "mapper")] {
        connect(&mut versions, peer, name, Purpose::Config);
    }
    for name in ["file", "speed"] {
        for peer in [1, 3] {
            ask(&mut versions, peer, ConfigRequest::Parameter { request: 1, name: name.into() });
        }
    }
    let sent = |actions: Vec<ConfigdAction>| -> Vec<_> {
        let messages = actions.into_iter().filter_map(|action| match action {
            ConfigdAction::Peer(armor_wire::peer::PeerAction::Send { peer, message }) => {
                Some((peer.0, message))
            }
            _ => None,
        });
        messages.collect()
    };
    let changed = FILE.replace("value=\"2\"", "value=\"3\"").replace("a.log", "b.log");
    let messages = sent(versions.handle(saved(&changed)));
    match messages.as_slice() {
        [(1, ConfigReply::Parameter { request: 0, name, assigned: Some(assigned) })] => {
            assert_eq!((name.as_str(), assigned.text.as_str()), ("speed", "3"));
        }
        other => panic!("{other:?}"),
    }
    versions.handle(ConfigdEvent::Peer(armor_wire::peer::PeerEvent::Closed {
        peer: PeerId(1),
        reason: CloseReason::Ended,
    }));
    assert!(sent(versions.handle(saved(FILE))).is_empty());
}
