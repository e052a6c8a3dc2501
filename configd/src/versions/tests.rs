//! The state machine in memory: readings instead of a disk, events instead of sockets.

mod frames;
mod listing;
mod readers;
mod requests;
mod setting;

use std::path::Path;
use std::time::Duration;

use armor_robotfile::{Code, Finding, Manifests, Override, read};
use armor_wire::config::{Assigned, ComponentSettings, FindingSeverity};
use armor_wire::hello::{Hello, Purpose};
use armor_wire::manifest::Manifest;

use super::*;

const FILE: &str = r#"<armor version="1">
  <system>
    <component name="player" kind="player">
      <parameter name="file" value="logs/a.log"/>
      <parameter name="speed" value="2"/>
    </component>
    <component name="mapper" kind="mapper" rate="10Hz"/>
    <component name="view" kind="view" controllable="false"/>
    <link from="player.scan" to="mapper.scan" keep="all"/>
    <link from="player.odometry" to="mapper.odometry" keep="50" wake="spin" transport="tcp"/>
  </system>
  <mission safe="end">
    <place name="play" initial="true" components="player"/>
    <place name="end"/>
    <transition name="over" from="play" to="end" on="player.done"/>
  </mission>
</armor>"#;

fn reading(text: &str) -> Reading {
    read(Path::new("m/a.xml"), &mut |_| Ok(text.into()))
}

fn saved(text: &str) -> ConfigdEvent {
    ConfigdEvent::Read(Box::new(reading(text)))
}

fn versions_under(rules: VersionRules) -> Versions {
    let rules = VersionRules { root: "/robot".into(), ..rules };
    Versions::new(7, rules, reading(FILE), Vec::new())
        .unwrap_or_else(|findings| panic!("{findings:?}"))
        .0
}

fn versions() -> Versions {
    versions_under(VersionRules::default())
}

fn connect(
    versions: &mut Versions,
    peer: u64,
    from: &str,
    purpose: Purpose,
) -> armor_wire::peer::PeerAction<ConfigReply> {
    send_hello(versions, peer, Hello::new(from, 1, purpose), None)
}

fn connect_through(versions: &mut Versions, peer: u64, from: &str, preface: Option<Preface>) {
    send_hello(versions, peer, Hello::new(from, 1, Purpose::Config), preface);
}

fn send_hello(
    versions: &mut Versions,
    peer: u64,
    hello: Hello,
    preface: Option<Preface>,
) -> armor_wire::peer::PeerAction<ConfigReply> {
    let (peer, address) = (PeerId(peer), ([127, 0, 0, 1], 4000).into());
    let connected = armor_wire::peer::PeerEvent::Connected { peer, address, hello, preface };
    match versions.handle(ConfigdEvent::Peer(connected)).pop() {
        Some(ConfigdAction::Peer(action)) => action,
        other => panic!("{other:?}"),
    }
}

fn ask(versions: &mut Versions, peer: u64, message: ConfigRequest) -> ConfigReply {
    let (peer, arrived) = (PeerId(peer), Duration::ZERO);
    let asked = armor_wire::peer::PeerEvent::Message { peer, arrived, message };
    match versions.handle(ConfigdEvent::Peer(asked)).pop() {
        Some(ConfigdAction::Peer(armor_wire::peer::PeerAction::Send { peer: to, message })) => {
            assert_eq!(to, peer);
            message
        }
        other => panic!("{other:?}"),
    }
}

fn settings(versions: &mut Versions, from: &str) -> ComponentSettings {
    connect(versions, 1, from, Purpose::Config);
    match ask(versions, 1, ConfigRequest::Settings { request: 3 }) {
        ConfigReply::Settings { request: 3, settings } => settings,
        other => panic!("{other:?}"),
    }
}

fn parameter(versions: &mut Versions, from: &str, name: &str) -> Option<Assigned> {
    connect(versions, 1, from, Purpose::Config);
    match ask(versions, 1, ConfigRequest::Parameter { request: 4, name: name.into() }) {
        ConfigReply::Parameter { request: 4, name: given, assigned } if given == name => assigned,
        other => panic!("{other:?}"),
    }
}

#[test]
fn only_a_valid_version_is_taken() {
    let mut versions = versions();
    let mut read = |text: &str| match versions.handle(saved(text)).into_iter().next() {
        None => "nothing".to_owned(),
        Some(ConfigdAction::Tell(Notice::Taken { version, .. })) => format!("taken {version}"),
        Some(ConfigdAction::Tell(Notice::Restored { version })) => format!("restored {version}"),
        Some(ConfigdAction::Tell(Notice::Refused { kept, findings })) => {
            let codes: Vec<_> = findings.iter().map(|finding| finding.code.as_str()).collect();
            format!("refused, kept {}: {}", kept.unwrap(), codes.join(" "))
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(read(&FILE[..200]), "refused, kept 1: E0004");
    assert_eq!(read(""), "refused, kept 1: E0004");
    assert_eq!(read(FILE), "restored 1");
    assert_eq!(read(FILE), "nothing");
    assert_eq!(read(&FILE.replace("10Hz", "20Hz")), "taken 2");
    let two_faults = FILE.replace("10Hz", "10").replace("end\">", "fin\">");
    assert_eq!(read(&two_faults), "refused, kept 2: E0019 E0203");
    assert_eq!(read(FILE), "taken 3");
    assert_eq!(versions.number(), 3);
    assert_eq!(settings(&mut versions, "mapper").version, 3);
}

#[test]
fn overrides_go_over_every_version() {
    let over = Override::parse("player.file=b.log", Path::new("/home")).unwrap();
    let mut versions =
        versions_under(VersionRules { overrides: vec![over], ..VersionRules::default() });
    let wanted = Assigned { text: "b.log".into(), base: "/home".into(), origin: "--set".into() };
    assert_eq!(parameter(&mut versions, "player", "file").as_ref(), Some(&wanted));
    versions.handle(saved(&FILE.replace("a.log", "c.log")));
    assert_eq!(versions.number(), 2);
    assert_eq!(parameter(&mut versions, "player", "file"), Some(wanted));
    // A version without the component that is set is not taken.
    versions.handle(saved(&FILE.replace("player", "gamer")));
    assert_eq!(versions.number(), 2);
}

fn live_manifests() -> Manifests {
    use armor_wire::manifest::{ParameterManifest, ParameterType, PortManifest};
    let port = |id: &str| PortManifest {
        id: id.into(),
        type_name: "T".into(),
        schema: String::new(),
        schema_hash: 1,
        doc: String::new(),
        required: false,
        many: false,
        latched: false,
        stale_after: String::new(),
    };
    let parameter = |name: &str, live| ParameterManifest {
        name: name.into(),
        kind: ParameterType::Text,
        unit: String::new(),
        default: Some("1".into()),
        minimum: None,
        maximum: None,
        choices: Vec::new(),
        format: None,
        doc: String::new(),
        live,
        written: false,
    };
    let manifest = |kind: &str| Manifest {
        armor_manifest: 1,
        kind: kind.into(),
        summary: String::new(),
        controllable: true,
        reads_all: false,
        protocol: None,
        reports_done: true,
        ends_by_itself: false,
        needs_rate: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
        inputs: vec![port("scan"), port("odometry")],
        outputs: vec![port("scan"), port("odometry")],
        parameters: vec![parameter("file", false), parameter("speed", true)],
        events: None,
    };
    ["player", "mapper", "view"].map(|kind| (kind.to_owned(), manifest(kind))).into()
}

#[test]
fn an_invalid_first_version_is_refused_with_its_findings() {
    let refused = Versions::new(7, VersionRules::default(), reading("<armor"), Vec::new());
    assert!(refused.err().is_some_and(|findings| findings.has_errors()));
}

/// The last state notice.
fn state(actions: &[ConfigdAction]) -> ConfigurationState {
    let mut states = actions.iter().rev().filter_map(|action| match action {
        ConfigdAction::Tell(Notice::State(state)) => Some((**state).clone()),
        _ => None,
    });
    states.next().unwrap_or_else(|| panic!("no state in {actions:?}"))
}

#[test]
fn a_component_commanded_by_the_mission_stays_so_while_the_system_runs() {
    // A mission that no longer commands a component is not taken while the component runs: with
    // another answer at its next start, the component would be active together with those that
    // exclude it.
    let free = FILE.replace(r#" components="player""#, "");
    let mut versions = versions();
    versions.handle(saved(&free));
    assert_eq!(versions.number(), 2);
    assert!(settings(&mut versions, "player").controlled, "as when it was started first");
    let kept =
        |number, text: &str| KeptVersion { number, files: vec![("m/a.xml".into(), text.into())] };
    let rules = VersionRules { root: "/robot".into(), ..VersionRules::default() };
    let two = vec![kept(1, FILE), kept(2, &free)];
    let (mut again, _) = Versions::new(9, rules, reading(&free), two).unwrap();
    assert!(settings(&mut again, "player").controlled, "also by a configd that was killed");
    assert!(!settings(&mut again, "mapper").controlled);
}

#[test]
fn a_restart_continues_with_the_kept_versions() {
    let kept =
        |number, text: &str| KeptVersion { number, files: vec![("m/a.xml".into(), text.into())] };
    let start = |first: &str, kept: Vec<KeptVersion>| {
        let rules = VersionRules { root: "/robot".into(), ..VersionRules::default() };
        Versions::new(9, rules, reading(first), kept)
    };
    let two = vec![kept(4, FILE), kept(5, &FILE.replace("10Hz", "20Hz"))];
    // The same file: the same version, and what led to it is still known.
    let (mut versions, actions) = start(&FILE.replace("10Hz", "20Hz"), two.clone()).unwrap();
    assert_eq!((versions.number(), state(&actions).refused), (5, false));
    connect(&mut versions, 1, "param-7", Purpose::Config);
    let diff = ask(&mut versions, 1, ConfigRequest::Diff { request: 1, from: None, to: None });
    assert!(matches!(diff, ConfigReply::Differences { from: 4, to: 5, .. }), "{diff:?}");
    // Another valid one: the next version.
    let (versions, actions) = start(&FILE.replace("10Hz", "30Hz"), two.clone()).unwrap();
    assert_eq!((versions.number(), state(&actions).changes.len()), (6, 1));
    assert!(matches!(actions.first(), Some(ConfigdAction::Tell(Notice::Taken { version: 6, .. }))));
    // An invalid file: the last valid version stays active.
    let (mut versions, actions) = start("<armor", two).unwrap();
    assert!(matches!(
        actions.first(),
        Some(ConfigdAction::Tell(Notice::Refused { kept: Some(5), .. }))
    ));
    assert!(state(&actions).refused && state(&actions).changes.len() == 1);
    assert_eq!(settings(&mut versions, "mapper").rate_hz, Some(20.0));
    // The newest kept versions are damaged: the newest intact one stays active, and the next
    // version gets the number after it.
    let damaged = || {
        let five = FILE.replace("10Hz", "20Hz");
        vec![kept(4, FILE), kept(5, &five), kept(6, &FILE[..200]), kept(7, "")]
    };
    let (mut versions, actions) = start("<armor", damaged()).unwrap();
    assert!(matches!(
        actions.first(),
        Some(ConfigdAction::Tell(Notice::Refused { kept: Some(5), .. }))
    ));
    assert_eq!(settings(&mut versions, "mapper").rate_hz, Some(20.0));
    assert_eq!(start(FILE, damaged()).unwrap().0.number(), 6);
    // A kept version that cannot be read any more does not replace a valid file.
    assert_eq!(start(FILE, vec![kept(3, "<armor")]).unwrap().0.number(), 1);
    assert!(start("<armor", vec![kept(3, "<armor")]).is_err());
}

#[test]
fn without_any_version_everybody_is_refused_until_the_file_is_valid() {
    let findings =
        Versions::new(7, VersionRules::default(), reading("<armor"), Vec::new()).err().unwrap();
    let rules = VersionRules { manifests: Some(live_manifests()), ..VersionRules::default() };
    let (mut versions, actions) = Versions::waiting(7, rules, 3, findings);
    assert!(matches!(
        actions.first(),
        Some(ConfigdAction::Tell(Notice::Refused { kept: None, .. }))
    ));
    assert!(state(&actions).refused && versions.newest_kept().is_none());
    connect(&mut versions, 1, "mapper", Purpose::Config);
    let asked = [
        ConfigRequest::Settings { request: 1 },
        ConfigRequest::Parameter { request: 1, name: "speed".into() },
        ConfigRequest::List { request: 1, component: None, from: 0 },
        ConfigRequest::Diff { request: 1, from: None, to: None },
    ];
    for request in asked {
        match ask(&mut versions, 1, request) {
            ConfigReply::Refused { request: 1, refusal } => {
                assert!(refusal.text.contains("no valid version"), "{}", refusal.text);
                assert!(refusal.text.contains("E0004"), "{}", refusal.text);
            }
            other => panic!("{other:?}"),
        }
    }
    let (component, parameter) = ("mapper".into(), "speed".into());
    let set = ConfigRequest::Set { request: 1, component, parameter, value: None };
    let set = ask(&mut versions, 1, set);
    assert!(
        matches!(&set, ConfigReply::Rejected { findings, .. } if !findings.is_empty()),
        "{set:?}"
    );
    let actions = versions.handle(saved("<armor version"));
    assert!(matches!(
        actions.first(),
        Some(ConfigdAction::Tell(Notice::Refused { kept: None, .. }))
    ));
    let actions = versions.handle(saved(FILE));
    assert!(matches!(actions.first(), Some(ConfigdAction::Tell(Notice::Taken { version: 4, .. }))));
    // Who had asked for a live one, and runs with its last value, hears of it.
    let is_answer = |action: &ConfigdAction| {
        let ConfigdAction::Peer(armor_wire::peer::PeerAction::Send { message, .. }) = action else {
            return false;
        };
        matches!(message, ConfigReply::Parameter { request: 0, name, .. } if name == "speed")
    };
    assert!(actions.iter().any(is_answer), "{actions:?}");
    assert_eq!(settings(&mut versions, "mapper").version, 4);
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let missing = read(Path::new("m/a.xml"), &mut |_| Err(std::io::ErrorKind::NotFound.into()));
    let state = state(&versions().handle(ConfigdEvent::Read(Box::new(missing))));
    assert_eq!(
        (state.findings[0].code.as_str(), state.findings[0].file.as_str()),
        ("E0003", "m/a.xml")
    );
    assert_eq!(state.findings[0].line, 0);
}

#[test]
fn a_file_is_judged_by_the_kinds_there_are_when_it_is_saved_or_later() {
    let rules = VersionRules { manifests: Some(live_manifests()), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    let with_arm = FILE.replace("kind=\"view\"", "kind=\"arm\"");
    assert!(state(&versions.handle(saved(&with_arm))).refused);
    let mut manifests = live_manifests();
    manifests.insert("arm".into(), Manifest { kind: "arm".into(), ..manifests["view"].clone() });
    let actions = versions.handle(ConfigdEvent::Kinds(manifests.clone()));
    assert!(matches!(actions.first(), Some(ConfigdAction::Tell(Notice::Taken { version: 2, .. }))));
    // Kinds that fit are no news; the next version is judged by them.
    assert!(versions.handle(ConfigdEvent::Kinds(manifests.clone())).is_empty());
    manifests.remove("arm");
    versions.handle(ConfigdEvent::Kinds(manifests));
    assert_eq!(versions.number(), 2);
    assert!(state(&versions.handle(saved(&with_arm.replace("10Hz", "20Hz")))).refused);
}

#[test]
fn other_ports_of_a_running_kind_are_reported_without_a_new_version() {
    let rules = VersionRules { manifests: Some(live_manifests()), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    let mut other = live_manifests();
    let outputs = &mut other.get_mut("player").expect("it is there").outputs;
    outputs.retain(|output| output.id != "scan");
    let actions = versions.handle(ConfigdEvent::Kinds(other.clone()));
    match actions.first() {
        Some(ConfigdAction::Tell(Notice::Outdated { version: 1, findings })) => {
            let codes: Vec<_> = findings.iter().map(|finding| finding.code).collect();
            assert_eq!(codes, [Code::WrongDirection], "{}", findings.iter().next().expect("one"));
        }
        other => panic!("{other:?}"),
    }
    assert!(state(&actions).refused && state(&actions).findings[0].line == 9);
    // The components that run still get their answers.
    assert!(parameter(&mut versions, "player", "speed").is_some());
    // Another build of the kind fits again; or the file is changed so that it fits.
    let actions = versions.handle(ConfigdEvent::Kinds(live_manifests()));
    assert!(matches!(actions.first(), Some(ConfigdAction::Tell(Notice::Restored { version: 1 }))));
    versions.handle(ConfigdEvent::Kinds(other));
    let link = "    <link from=\"player.scan\" to=\"mapper.scan\" keep=\"all\"/>\n";
    let actions = versions.handle(saved(&FILE.replace(link, "")));
    assert!(matches!(actions.first(), Some(ConfigdAction::Tell(Notice::Taken { version: 2, .. }))));
}

#[test]
fn a_warning_is_reported_with_the_version_that_brings_it_and_not_again() {
    let further = |configuration: &Configuration| {
        let mut findings = Findings::default();
        let fast = configuration.sources.iter().any(|source| source.text().contains("20Hz"));
        let messages = ["always", "fast"].into_iter().take(if fast { 2 } else { 1 });
        findings.extend(messages.map(|message| Finding::nowhere(Code::NeverFires, message)));
        findings
    };
    let rules = VersionRules { further: Some(further), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    let mut warnings_of = |text: &str| match versions.handle(saved(text)).into_iter().next() {
        Some(ConfigdAction::Tell(Notice::Taken { findings, .. })) => {
            findings.iter().map(|finding| finding.message.clone()).collect::<Vec<_>>()
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(warnings_of(&format!("{FILE}\n")), [] as [&str; 0], "the first version had it");
    assert_eq!(warnings_of(&FILE.replace("10Hz", "20Hz")), ["fast"]);
    assert_eq!(warnings_of(&FILE.replace("10Hz", "20Hz").replace("/>", " />")), [] as [&str; 0]);
    assert_eq!(warnings_of(FILE), [] as [&str; 0], "one is gone");
    assert_eq!(warnings_of(&FILE.replace("10Hz", "20Hz")), ["fast"], "and is new again");
}
