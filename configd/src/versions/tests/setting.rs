//! Values set in the file.

use armor_wire::acting::{KeyRole, Preface};

use super::*;

/// Sends a request to set a value, and returns the immediate actions.
fn set(
    versions: &mut Versions,
    request: u64,
    parameter: &str,
    value: Option<&str>,
) -> Vec<ConfigdAction> {
    let (component, parameter) = parameter.split_once('.').unwrap();
    let message = ConfigRequest::Set {
        request,
        component: component.into(),
        parameter: parameter.into(),
        value: value.map(Into::into),
    };
    let (peer, arrived) = (PeerId(1), Duration::ZERO);
    versions.handle(ConfigdEvent::Peer(armor_wire::peer::PeerEvent::Message {
        peer,
        arrived,
        message,
    }))
}

fn replies(actions: &[ConfigdAction]) -> Vec<&ConfigReply> {
    let replies = actions.iter().filter_map(|action| match action {
        ConfigdAction::Peer(armor_wire::peer::PeerAction::Send { message, .. }) => Some(message),
        _ => None,
    });
    replies.collect()
}

fn tuned() -> Versions {
    let over = Override::parse("mapper.speed=7", Path::new("/home")).unwrap();
    let rules = VersionRules {
        manifests: Some(live_manifests()),
        overrides: vec![over],
        ..VersionRules::default()
    };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "param-7", Purpose::Config);
    versions
}

#[test]
fn a_value_is_in_force_once_it_is_on_the_disk() {
    let mut versions = tuned();
    let actions = set(&mut versions, 8, "player.speed", Some("5"));
    let [ConfigdAction::Write(write)] = actions.as_slice() else { panic!("{actions:?}") };
    assert_eq!(write.file, Path::new("m/a.xml"));
    assert_eq!(write.expected, [("m/a.xml".into(), FILE.to_owned())]);
    assert_eq!(write.text, FILE.replace("\"2\"", "\"5\""));
    // A second request waits for the first, and is applied to the text that the first wrote.
    assert!(set(&mut versions, 9, "player.file", None).is_empty());
    assert_eq!(versions.number(), 1);
    let actions = versions.handle(ConfigdEvent::Written(Ok(Findings::default())));
    assert_eq!(versions.number(), 2);
    match replies(&actions).as_slice() {
        [ConfigReply::Set { request: 8, version: 2, changes, findings }] => {
            assert!(findings.is_empty());
            assert_eq!(changes[0].text, "parameter player.speed: 2 → 5");
            assert_eq!(changes[0].effect, "reaches player immediately");
        }
        other => panic!("{other:?}"),
    }
    let Some(ConfigdAction::Write(second)) = actions.last() else { panic!("{actions:?}") };
    assert_eq!(second.expected[0].1, write.text);
    let gone = "      <parameter name=\"file\" value=\"logs/a.log\"/>\n";
    assert_eq!(second.text, write.text.replace(gone, ""));
    // Another program has changed the file first: no version is taken. The file watcher will
    // report that change.
    let actions = versions.handle(ConfigdEvent::Written(Err("changed by another program".into())));
    match replies(&actions).as_slice() {
        [ConfigReply::Rejected { request: 9, text, .. }] => {
            assert_eq!(text, "changed by another program");
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(versions.number(), 2);
    // The file watcher reports the text that was written: no new version.
    assert!(versions.handle(saved(&write.text)).is_empty());
    let actions = set(&mut versions, 10, "player.speed", Some("5"));
    assert!(
        matches!(replies(&actions).as_slice(), [ConfigReply::Set { version: 2, changes, .. }] if changes.is_empty()),
        "{actions:?}"
    );
}

#[test]
fn a_path_that_is_set_is_looked_for_when_it_is_written() {
    let mut manifests = live_manifests();
    let player = manifests.get_mut("player").expect("it is there");
    player.parameters[0].kind = armor_wire::manifest::ParameterType::Path;
    let rules = VersionRules { manifests: Some(manifests), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "param-7", Purpose::Config);
    let actions = set(&mut versions, 8, "player.file", Some("logs/b.log"));
    let [ConfigdAction::Write(write)] = actions.as_slice() else { panic!("{actions:?}") };
    let paths: Vec<_> = write.needs.iter().map(|needed| needed.path.as_path()).collect();
    assert_eq!(paths, [Path::new("/robot/m/logs/b.log")]);
    let mut missing = Findings::default();
    missing.extend(write.needs.iter().filter_map(|needed| needed.find_fault()));
    let actions = versions.handle(ConfigdEvent::Written(Ok(missing)));
    match replies(&actions).as_slice() {
        [ConfigReply::Set { version: 2, findings, .. }] => {
            assert_eq!((findings[0].code.as_str(), findings.len()), ("W0118", 1));
            assert!(findings[0].message.contains("player.file names logs/b.log"), "{findings:?}");
        }
        other => panic!("{other:?}"),
    }
    // Any other parameter names no file.
    let actions = set(&mut versions, 9, "player.speed", Some("5"));
    let [ConfigdAction::Write(write)] = actions.as_slice() else { panic!("{actions:?}") };
    assert!(write.needs.is_empty());
}

#[test]
fn what_cannot_be_set_is_rejected_with_its_reason() {
    let mut versions = tuned();
    let rejected = |versions: &mut Versions, parameter: &str, value: &str| {
        let actions = set(versions, 8, parameter, Some(value));
        match replies(&actions).as_slice() {
            [ConfigReply::Rejected { request: 8, text, findings, .. }] => {
                let codes: Vec<_> = findings.iter().map(|finding| finding.code.as_str()).collect();
                format!("{text} [{}]", codes.join(" "))
            }
            other => panic!("{other:?}"),
        }
    };
    let invalid = "nothing was written: the file would not be valid";
    assert_eq!(rejected(&mut versions, "player.sped", "1"), format!("{invalid} [E0110]"));
    let unknown = rejected(&mut versions, "unknown.speed", "1");
    assert!(unknown.contains("no component called `unknown`; it has: player, mapper"), "{unknown}");
    let over = rejected(&mut versions, "mapper.speed", "1");
    assert!(over.starts_with("mapper.speed is given by --set"), "{over}");
    let control = rejected(&mut versions, "player.file", "a\u{1}b");
    assert_eq!(control, "the value contains U+0001, a character that XML does not allow []");
    let unknown = set(&mut versions, 8, "player.nosuch", None);
    match replies(&unknown).as_slice() {
        [ConfigReply::Rejected { findings, .. }] => {
            assert_eq!((findings[0].code.as_str(), findings[0].line), ("E0110", 3));
        }
        other => panic!("{other:?}"),
    }
    let is_so = set(&mut versions, 8, "mapper.file", None);
    assert!(matches!(replies(&is_so).as_slice(), [ConfigReply::Set { .. }]), "{is_so:?}");
    versions.handle(saved("<armor"));
    let broken = rejected(&mut versions, "player.speed", "1");
    assert!(
        broken.starts_with("the file on the disk is not valid (m/a.xml:1:")
            && broken.contains("E0004"),
        "{broken}"
    );
}

#[test]
fn no_request_leads_what_a_component_writes_out_of_the_run_folder() {
    let mut manifests = live_manifests();
    for parameter in &mut manifests.get_mut("player").unwrap().parameters {
        parameter.written = parameter.name == "file";
    }
    let rules = VersionRules { manifests: Some(manifests), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "param-7", Purpose::Config);
    for outside in ["/root/.bashrc", "../b.log", "logs/../../b.log"] {
        let actions = set(&mut versions, 8, "player.file", Some(outside));
        match replies(&actions).as_slice() {
            [ConfigReply::Rejected { request: 8, text, .. }] => {
                assert!(text.contains("within the run's folder"), "{text}");
                assert!(text.contains("m/a.xml:"), "{text}");
            }
            other => panic!("{outside}: {other:?}"),
        }
    }
    let actions = set(&mut versions, 9, "player.file", Some("./logs/b.log"));
    assert!(matches!(actions.as_slice(), [ConfigdAction::Write(_)]), "{actions:?}");
}

#[test]
fn a_value_is_set_through_a_gate_by_an_engineer_and_by_no_lower_role() {
    for role in KeyRole::ALL {
        let mut versions = tuned();
        let preface = Some(Preface::of_person("alice", role));
        connect_through(&mut versions, 1, "tool-7", preface);
        let actions = set(&mut versions, 8, "player.speed", Some("5"));
        if role == KeyRole::Engineer {
            assert!(matches!(actions[..], [ConfigdAction::Write(_)]), "{actions:?}");
            continue;
        }
        let [ConfigReply::Rejected { request: 8, text, .. }] = replies(&actions)[..] else {
            panic!("{actions:?}")
        };
        assert_eq!(
            *text,
            format!(
                "setting player.speed needs the role engineer, and the key of alice has the role \
                 {role}"
            )
        );
        let listed =
            ask(&mut versions, 1, ConfigRequest::List { request: 9, component: None, from: 0 });
        assert!(matches!(listed, ConfigReply::Listed { .. }), "{listed:?}");
    }
}
