//! The state machine in memory: readings instead of a disk, events instead of sockets.

use std::path::Path;
use std::time::Duration;

use armor_missions::{Feature, Manifests, Override, read};
use armor_net::CloseReason;
use armor_wire::config::{Assigned, InputSettings, Settings};
use armor_wire::keep::{Keep, Transport, Wake};

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

fn saved(text: &str) -> Event {
    Event::Read(Box::new(reading(text)))
}

fn versions_under(rules: Rules) -> Versions {
    let rules = Rules { root: "/robot".into(), ..rules };
    Versions::new(7, rules, reading(FILE), Vec::new())
        .unwrap_or_else(|findings| panic!("{findings:?}"))
        .0
}

fn versions() -> Versions {
    versions_under(Rules::default())
}

fn connect(
    versions: &mut Versions,
    peer: u64,
    from: &str,
    purpose: Purpose,
) -> armor_net::Action<Reply> {
    let (peer, address) = (PeerId(peer), ([127, 0, 0, 1], 4000).into());
    let hello = Hello::new(from, 1, purpose);
    let connected = armor_net::Event::Connected { peer, address, hello };
    match versions.handle(Event::Peer(connected)).pop() {
        Some(Action::Peer(action)) => action,
        other => panic!("{other:?}"),
    }
}

fn ask(versions: &mut Versions, peer: u64, message: Request) -> Reply {
    let (peer, arrived) = (PeerId(peer), Duration::ZERO);
    let asked = armor_net::Event::Message { peer, arrived, message };
    match versions.handle(Event::Peer(asked)).pop() {
        Some(Action::Peer(armor_net::Action::Send { peer: to, message })) => {
            assert_eq!(to, peer);
            message
        }
        other => panic!("{other:?}"),
    }
}

fn settings(versions: &mut Versions, from: &str) -> Settings {
    connect(versions, 1, from, Purpose::Config);
    match ask(versions, 1, Request::Settings { request: 3 }) {
        Reply::Settings { request: 3, settings } => settings,
        other => panic!("{other:?}"),
    }
}

fn parameter(versions: &mut Versions, from: &str, name: &str) -> Option<Assigned> {
    connect(versions, 1, from, Purpose::Config);
    match ask(versions, 1, Request::Parameter { request: 4, name: name.into() }) {
        Reply::Parameter { request: 4, name: given, assigned } if given == name => assigned,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_component_learns_how_it_runs_and_is_connected() {
    let mut versions = versions();
    let input = |id: &str, data: &str, keep, wake| InputSettings {
        id: id.into(),
        data: data.into(),
        keep,
        wake,
        transport: if wake == Wake::Spin { Transport::Tcp } else { Transport::Auto },
    };
    let wanted = Settings {
        version: 1,
        rate_hz: Some(10.0),
        controlled: false,
        inputs: vec![
            input("scan", "player.scan", Keep::All, Wake::Sleep),
            input("odometry", "player.odometry", Keep::Last { count: 50 }, Wake::Spin),
        ],
        watchdog_s: None,
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
fn who_is_not_in_the_file_is_told_so_until_it_is() {
    let mut versions = versions();
    connect(&mut versions, 1, "plaier", Purpose::Config);
    match ask(&mut versions, 1, Request::Settings { request: 5 }) {
        Reply::Refused { request: 5, refusal } => {
            assert_eq!(
                refusal.text,
                "m/a.xml holds no component called `plaier`; it holds: player, mapper, view"
            );
        }
        other => panic!("{other:?}"),
    }
    versions.handle(saved(&FILE.replace("\"view\" ", "\"plaier\" ")));
    let answer = ask(&mut versions, 1, Request::Settings { request: 6 });
    assert!(matches!(answer, Reply::Settings { request: 6, .. }), "{answer:?}");
}

#[test]
fn who_comes_for_something_else_is_refused() {
    let action = connect(&mut versions(), 1, "tool", Purpose::Registry { entry: None });
    assert!(matches!(action, armor_net::Action::Refuse { .. }), "{action:?}");
}

#[test]
fn only_a_valid_version_is_taken() {
    let mut versions = versions();
    let mut read = |text: &str| match versions.handle(saved(text)).into_iter().next() {
        None => "nothing".to_owned(),
        Some(Action::Tell(Notice::Taken { version, .. })) => format!("taken {version}"),
        Some(Action::Tell(Notice::Restored { version })) => format!("restored {version}"),
        Some(Action::Tell(Notice::Refused { kept, findings })) => {
            let codes: Vec<_> = findings.iter().map(|finding| finding.code.as_str()).collect();
            format!("refused, kept {kept}: {}", codes.join(" "))
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
    let mut versions = versions_under(Rules { overrides: vec![over], ..Rules::default() });
    let wanted = Assigned { text: "b.log".into(), base: "/home".into(), origin: "--set".into() };
    assert_eq!(parameter(&mut versions, "player", "file").as_ref(), Some(&wanted));
    versions.handle(saved(&FILE.replace("a.log", "c.log")));
    assert_eq!(versions.number(), 2);
    assert_eq!(parameter(&mut versions, "player", "file"), Some(wanted));
    // A version without the component that is set is not taken.
    versions.handle(saved(&FILE.replace("player", "gamer")));
    assert_eq!(versions.number(), 2);
}

#[test]
fn what_is_not_played_is_not_taken() {
    let rules = Rules { played: Some(vec![Feature::Priority]), ..Rules::default() };
    let mut versions = versions_under(rules);
    versions.handle(saved(&FILE.replace("on=\"player.done\"", "priority=\"2\" timeout=\"1s\"")));
    assert_eq!(versions.number(), 2);
    versions.handle(saved(&FILE.replace("on=\"player.done\"", "when=\"x\"")));
    assert_eq!(versions.number(), 2);
}

fn live_manifests() -> Manifests {
    use armor_wire::manifest::{Manifest, ParameterManifest, ParameterType, PortManifest};
    let port = |id: &str| PortManifest {
        id: id.into(),
        type_name: "T".into(),
        schema: String::new(),
        schema_hash: 1,
        doc: String::new(),
        required: false,
        latched: false,
    };
    let parameter = |name: &str, live| ParameterManifest {
        name: name.into(),
        kind: ParameterType::Text,
        unit: String::new(),
        default: Some("1".into()),
        minimum: None,
        maximum: None,
        choices: Vec::new(),
        doc: String::new(),
        live,
    };
    let manifest = |kind: &str| Manifest {
        armor_manifest: 1,
        kind: kind.into(),
        summary: String::new(),
        inputs: vec![port("scan"), port("odometry")],
        outputs: vec![port("scan"), port("odometry")],
        parameters: vec![parameter("file", false), parameter("speed", true)],
    };
    ["player", "mapper", "view"].map(|kind| (kind.to_owned(), manifest(kind))).into()
}

#[test]
fn a_live_parameter_that_was_asked_for_is_sent_when_it_changes() {
    let rules = Rules { manifests: Some(live_manifests()), ..Rules::default() };
    let mut versions = versions_under(rules);
    for (peer, name) in [(1, "player"), (2, "player"), (3, "mapper")] {
        connect(&mut versions, peer, name, Purpose::Config);
    }
    for name in ["file", "speed"] {
        for peer in [1, 3] {
            ask(&mut versions, peer, Request::Parameter { request: 1, name: name.into() });
        }
    }
    let sent = |actions: Vec<Action>| -> Vec<_> {
        let messages = actions.into_iter().filter_map(|action| match action {
            Action::Peer(armor_net::Action::Send { peer, message }) => Some((peer.0, message)),
            _ => None,
        });
        messages.collect()
    };
    let changed = FILE.replace("value=\"2\"", "value=\"3\"").replace("a.log", "b.log");
    let messages = sent(versions.handle(saved(&changed)));
    match messages.as_slice() {
        [(1, Reply::Parameter { request: 0, name, assigned: Some(assigned) })] => {
            assert_eq!((name.as_str(), assigned.text.as_str()), ("speed", "3"));
        }
        other => panic!("{other:?}"),
    }
    versions.handle(Event::Peer(armor_net::Event::Closed {
        peer: PeerId(1),
        reason: CloseReason::Ended,
    }));
    assert!(sent(versions.handle(saved(FILE))).is_empty());
}

#[test]
fn an_invalid_first_version_is_refused_with_its_findings() {
    let refused = Versions::new(7, Rules::default(), reading("<armor"), Vec::new());
    assert!(refused.err().is_some_and(|findings| findings.has_errors()));
}

/// The state that was told last.
fn state(actions: &[Action]) -> ConfigurationState {
    let mut states = actions.iter().rev().filter_map(|action| match action {
        Action::Tell(Notice::State(state)) => Some((**state).clone()),
        _ => None,
    });
    states.next().unwrap_or_else(|| panic!("no state in {actions:?}"))
}

#[test]
fn how_things_stand_is_told_as_data() {
    let mut versions = versions();
    let refused = state(&versions.handle(saved(&FILE.replace("10Hz", "10"))));
    assert_eq!((refused.version, refused.refused), (1, true));
    assert_eq!(refused.files, ["/robot/m/a.xml"]);
    let [finding] = refused.findings.as_slice() else { panic!("{refused:?}") };
    assert_eq!((finding.code.as_str(), finding.severity.as_str()), ("E0019", "error"));
    assert_eq!((finding.file.as_str(), finding.line, finding.column), ("m/a.xml", 7, 50));
    assert_eq!((finding.end_line, finding.end_column, finding.text.as_str()), (7, 52, "10"));
    assert!(finding.source_line.contains("rate=\"10\""), "{finding:?}");

    let restored = state(&versions.handle(saved(FILE)));
    assert_eq!((restored.version, restored.refused, restored.findings.len()), (1, false, 0));
    let edited = FILE.replace("10Hz", "20Hz").replace("\"2\"", "\"3\"").replace("all", "latest");
    let taken = state(&versions.handle(saved(&edited)));
    assert_eq!((taken.version, taken.refused), (2, false));
    let said: Vec<_> =
        taken.changes.iter().map(|change| (change.text.as_str(), change.effect.as_str())).collect();
    let expected = [
        ("component mapper: rate 10Hz → 20Hz", "takes effect when mapper is started again"),
        ("parameter player.speed: 2 → 3", "takes effect when player is started again"),
        (
            "link player.scan -> mapper.scan: keep all → (none)",
            "takes effect when mapper is started again",
        ),
    ];
    assert_eq!(said, expected);
}

#[test]
fn a_change_says_when_it_takes_effect() {
    let over = Override::parse("player.file=b.log", Path::new("/home")).unwrap();
    let rules =
        Rules { manifests: Some(live_manifests()), overrides: vec![over], ..Rules::default() };
    let mut versions = versions_under(rules);
    let mut effect = |old: &str, new: &str| {
        versions.handle(saved(FILE));
        let taken = state(&versions.handle(saved(&FILE.replace(old, new))));
        taken.changes.into_iter().map(|change| change.effect).collect::<Vec<_>>().join("; ")
    };
    assert_eq!(effect("value=\"2\"", "value=\"3\""), "reaches player at once");
    assert_eq!(effect("a.log", "c.log"), "has no effect: --set gives player.file its value");
    let again = "takes effect when the system is run again";
    assert_eq!(effect("kind=\"view\"", "kind=\"mapper\""), again);
    assert_eq!(effect("name=\"over\"", "name=\"finished\""), format!("{again}; {again}"));
}

#[test]
fn what_changed_between_versions_can_be_asked() {
    let mut versions = versions();
    connect(&mut versions, 1, "param-7", Purpose::Config);
    let diff = |versions: &mut Versions, from, to| match ask(
        versions,
        1,
        Request::Diff { request: 5, from, to },
    ) {
        Reply::Differences { request: 5, from, to, changes, left_out: 0 } => {
            let texts: Vec<_> = changes.into_iter().map(|change| change.text).collect();
            format!("{from} to {to}: {}", texts.join("; "))
        }
        Reply::Refused { request: 5, refusal } => refusal.text,
        other => panic!("{other:?}"),
    };
    let only = "version 1 is the only one there is: nothing has changed yet";
    assert_eq!(diff(&mut versions, None, None), only);
    versions.handle(saved(&FILE.replace("10Hz", "20Hz")));
    versions.handle(saved(&FILE.replace("10Hz", "30Hz")));
    let rate = "component mapper: rate";
    assert_eq!(diff(&mut versions, None, None), format!("2 to 3: {rate} 20Hz → 30Hz"));
    assert_eq!(diff(&mut versions, Some(1), None), format!("1 to 3: {rate} 10Hz → 30Hz"));
    assert_eq!(diff(&mut versions, Some(3), Some(1)), format!("3 to 1: {rate} 30Hz → 10Hz"));
    assert_eq!(diff(&mut versions, Some(2), Some(2)), "2 to 2: ");
    let gone = "versions 1 and 9 are not both held; 1 to 3 are";
    assert_eq!(diff(&mut versions, Some(1), Some(9)), gone);
    for round in 0..40 {
        versions.handle(saved(&FILE.replace("10Hz", &format!("{}Hz", 40 + round))));
    }
    let held = "versions 1 and 43 are not both held; 12 to 43 are";
    assert_eq!(diff(&mut versions, Some(1), None), held);
}

#[test]
fn parameters_are_listed_with_values_and_origins() {
    let rules = Rules { manifests: Some(live_manifests()), ..Rules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "param-7", Purpose::Config);
    let list = |component: Option<&str>, from| Request::List {
        request: 5,
        component: component.map(Into::into),
        from,
    };
    let Reply::Listed { version: 1, refused: false, parameters, total: 6, .. } =
        ask(&mut versions, 1, list(None, 0))
    else {
        panic!("not listed");
    };
    let rows: Vec<_> = parameters
        .iter()
        .map(|one| {
            format!("{}.{} {} {} {}", one.component, one.name, one.value, one.origin, one.live)
        })
        .collect();
    assert_eq!(rows[0], "player.file logs/a.log m/a.xml:4:37 false");
    assert_eq!(rows[1], "player.speed 2 m/a.xml:5:38 true");
    assert_eq!(rows[2], "mapper.file 1 default false");
    match ask(&mut versions, 1, list(Some("mapper"), 1)) {
        Reply::Listed { parameters, total: 2, .. } => assert_eq!(parameters.len(), 1),
        other => panic!("{other:?}"),
    }
    let nobody = ask(&mut versions, 1, list(Some("nobody"), 0));
    assert!(matches!(nobody, Reply::Refused { request: 5, .. }), "{nobody:?}");
}

#[test]
fn an_unknown_parameter_is_refused_with_those_there_are() {
    let rules = Rules { manifests: Some(live_manifests()), ..Rules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "player", Purpose::Config);
    match ask(&mut versions, 1, Request::Parameter { request: 4, name: "sped".into() }) {
        Reply::Refused { request: 4, refusal } => assert_eq!(
            refusal.text,
            "`player` is a player, and that has no parameter called `sped`; it has: file, speed"
        ),
        other => panic!("{other:?}"),
    }
}

/// What a wish to set a value comes to at once.
fn set(versions: &mut Versions, request: u64, parameter: &str, value: Option<&str>) -> Vec<Action> {
    let (component, parameter) = parameter.split_once('.').unwrap();
    let message = Request::Set {
        request,
        component: component.into(),
        parameter: parameter.into(),
        value: value.map(Into::into),
    };
    let (peer, arrived) = (PeerId(1), Duration::ZERO);
    versions.handle(Event::Peer(armor_net::Event::Message { peer, arrived, message }))
}

fn replies(actions: &[Action]) -> Vec<&Reply> {
    let replies = actions.iter().filter_map(|action| match action {
        Action::Peer(armor_net::Action::Send { message, .. }) => Some(message),
        _ => None,
    });
    replies.collect()
}

fn tuned() -> Versions {
    let over = Override::parse("mapper.speed=7", Path::new("/home")).unwrap();
    let rules =
        Rules { manifests: Some(live_manifests()), overrides: vec![over], ..Rules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "param-7", Purpose::Config);
    versions
}

#[test]
fn a_value_is_in_force_once_it_is_on_the_disk() {
    let mut versions = tuned();
    let actions = set(&mut versions, 8, "player.speed", Some("5"));
    let [Action::Write(write)] = actions.as_slice() else { panic!("{actions:?}") };
    assert_eq!(write.file, Path::new("m/a.xml"));
    assert_eq!(write.expected, [("m/a.xml".into(), FILE.to_owned())]);
    assert_eq!(write.text, FILE.replace("\"2\"", "\"5\""));
    // A second one waits for the first, and is worked out on what that left.
    assert!(set(&mut versions, 9, "player.file", None).is_empty());
    assert_eq!(versions.number(), 1);
    let actions = versions.handle(Event::Written(Ok(())));
    assert_eq!(versions.number(), 2);
    match replies(&actions).as_slice() {
        [Reply::Set { request: 8, version: 2, changes }] => {
            assert_eq!(changes[0].text, "parameter player.speed: 2 → 5");
            assert_eq!(changes[0].effect, "reaches player at once");
        }
        other => panic!("{other:?}"),
    }
    let Some(Action::Write(second)) = actions.last() else { panic!("{actions:?}") };
    assert_eq!(second.expected[0].1, write.text);
    let gone = "      <parameter name=\"file\" value=\"logs/a.log\"/>\n";
    assert_eq!(second.text, write.text.replace(gone, ""));
    // Somebody else was faster: nothing is taken, and the watching tells what they did.
    let actions = versions.handle(Event::Written(Err("changed by somebody".into())));
    match replies(&actions).as_slice() {
        [Reply::Rejected { request: 9, text, .. }] => assert_eq!(text, "changed by somebody"),
        other => panic!("{other:?}"),
    }
    assert_eq!(versions.number(), 2);
    // The watching sees what was written: nothing new.
    assert!(versions.handle(saved(&write.text)).is_empty());
    let actions = set(&mut versions, 10, "player.speed", Some("5"));
    assert!(
        matches!(replies(&actions).as_slice(), [Reply::Set { version: 2, changes, .. }] if changes.is_empty()),
        "{actions:?}"
    );
}

#[test]
fn what_cannot_be_set_is_rejected_with_its_reason() {
    let mut versions = tuned();
    let rejected = |versions: &mut Versions, parameter: &str, value: &str| {
        let actions = set(versions, 8, parameter, Some(value));
        match replies(&actions).as_slice() {
            [Reply::Rejected { request: 8, text, findings, .. }] => {
                let codes: Vec<_> = findings.iter().map(|finding| finding.code.as_str()).collect();
                format!("{text} [{}]", codes.join(" "))
            }
            other => panic!("{other:?}"),
        }
    };
    let invalid = "nothing was written: the file would not be valid";
    assert_eq!(rejected(&mut versions, "player.sped", "1"), format!("{invalid} [E0110]"));
    let nobody = rejected(&mut versions, "nobody.speed", "1");
    assert!(nobody.contains("no component called `nobody`; it holds: player, mapper"), "{nobody}");
    let over = rejected(&mut versions, "mapper.speed", "1");
    assert!(over.starts_with("mapper.speed is given by --set"), "{over}");
    versions.handle(saved("<armor"));
    let broken = rejected(&mut versions, "player.speed", "1");
    assert!(
        broken.starts_with("the file on the disk is not valid") && broken.contains("E00"),
        "{broken}"
    );
}

#[test]
fn a_restart_goes_on_with_what_was_kept() {
    let kept = |number, text: &str| Kept { number, files: vec![("m/a.xml".into(), text.into())] };
    let start = |first: &str, kept: Vec<Kept>| {
        let rules = Rules { root: "/robot".into(), ..Rules::default() };
        Versions::new(9, rules, reading(first), kept)
    };
    let two = vec![kept(4, FILE), kept(5, &FILE.replace("10Hz", "20Hz"))];
    // The same file: the same version, and what led to it is still known.
    let (mut versions, actions) = start(&FILE.replace("10Hz", "20Hz"), two.clone()).unwrap();
    assert_eq!((versions.number(), state(&actions).refused), (5, false));
    connect(&mut versions, 1, "param-7", Purpose::Config);
    let diff = ask(&mut versions, 1, Request::Diff { request: 1, from: None, to: None });
    assert!(matches!(diff, Reply::Differences { from: 4, to: 5, .. }), "{diff:?}");
    // Another valid one: the next version.
    let (versions, actions) = start(&FILE.replace("10Hz", "30Hz"), two.clone()).unwrap();
    assert_eq!((versions.number(), state(&actions).changes.len()), (6, 1));
    assert!(matches!(actions.first(), Some(Action::Tell(Notice::Taken { version: 6, .. }))));
    // An invalid one: the last good one goes on.
    let (mut versions, actions) = start("<armor", two).unwrap();
    assert!(matches!(actions.first(), Some(Action::Tell(Notice::Refused { kept: 5, .. }))));
    assert!(state(&actions).refused && state(&actions).changes.len() == 1);
    assert_eq!(settings(&mut versions, "mapper").rate_hz, Some(20.0));
    // Kept bytes that nobody can read any more do not stand in for a valid file.
    assert_eq!(start(FILE, vec![kept(3, "<armor")]).unwrap().0.number(), 1);
    assert!(start("<armor", vec![kept(3, "<armor")]).is_err());
}
