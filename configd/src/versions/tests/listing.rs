//! Answers to tools.

use super::*;

#[test]
fn the_state_is_published_as_data() {
    let mut versions = versions();
    let refused = state(&versions.handle(saved(&FILE.replace("10Hz", "10"))));
    assert_eq!((refused.version, refused.refused), (1, true));
    assert_eq!(refused.files, ["/robot/m/a.xml"]);
    let [finding] = refused.findings.as_slice() else { panic!("{refused:?}") };
    assert_eq!((finding.code.as_str(), finding.severity), ("E0019", FindingSeverity::Error));
    assert_eq!((finding.file.as_str(), finding.line, finding.column), ("m/a.xml", 7, 50));
    assert_eq!((finding.end_line, finding.end_column, finding.text.as_str()), (7, 52, "10"));
    assert!(finding.source_line.contains("rate=\"10\""), "{finding:?}");

    let restored = state(&versions.handle(saved(FILE)));
    assert_eq!((restored.version, restored.refused, restored.findings.len()), (1, false, 0));
    let edited = FILE.replace("10Hz", "20Hz").replace("\"2\"", "\"3\"").replace("all", "latest");
    let taken = state(&versions.handle(saved(&edited)));
    assert_eq!((taken.version, taken.refused), (2, false));
    let described: Vec<_> =
        taken.changes.iter().map(|change| (change.text.as_str(), change.effect.as_str())).collect();
    let expected = [
        ("component mapper: rate 10Hz → 20Hz", "takes effect when mapper is started again"),
        ("parameter player.speed: 2 → 3", "takes effect when player is started again"),
        (
            "link player.scan -> mapper.scan: keep all → (none)",
            "takes effect when mapper is started again",
        ),
    ];
    assert_eq!(described, expected);
}

#[test]
fn a_change_states_when_it_takes_effect() {
    let over = Override::parse("player.file=b.log", Path::new("/home")).unwrap();
    let rules = VersionRules {
        manifests: Some(live_manifests()),
        overrides: vec![over],
        ..VersionRules::default()
    };
    let mut versions = versions_under(rules);
    let mut effect = |old: &str, new: &str| {
        versions.handle(saved(FILE));
        let taken = state(&versions.handle(saved(&FILE.replace(old, new))));
        taken.changes.into_iter().map(|change| change.effect).collect::<Vec<_>>().join("; ")
    };
    assert_eq!(effect("value=\"2\"", "value=\"3\""), "reaches player immediately");
    assert_eq!(effect("a.log", "c.log"), "has no effect: --set gives player.file its value");
    let place = "components=\"player\"><parameter component=\"player\" name=\"speed\" value=\"9\"/></place>";
    let with_place = FILE.replace("components=\"player\"/>", place);
    versions.handle(saved(&with_place));
    let taken = state(&versions.handle(saved(&with_place.replace("value=\"2\"", "value=\"3\""))));
    let limited = "reaches player immediately, but not while one of these places is marked, which \
                   set it themselves: play";
    assert_eq!(taken.changes[0].effect, limited);
    let mut effect = |old: &str, new: &str| {
        versions.handle(saved(FILE));
        let taken = state(&versions.handle(saved(&FILE.replace(old, new))));
        taken.changes.into_iter().map(|change| change.effect).collect::<Vec<_>>().join("; ")
    };
    let again = "takes effect when the system is run again";
    assert_eq!(effect("kind=\"view\"", "kind=\"mapper\""), again);
    let judged = "takes effect once the executive finds it safe from where the mission stands";
    assert_eq!(effect("name=\"over\"", "name=\"finished\""), format!("{judged}; {judged}"));
}

#[test]
fn a_parameter_that_a_running_component_has_not_requested_is_named() {
    let rules = VersionRules { manifests: Some(live_manifests()), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "player", Purpose::Config);
    let edited = FILE.replace("value=\"2\"", "value=\"3\"").replace("a.log", "c.log");
    let taken = state(&versions.handle(saved(&edited)));
    let effects: Vec<_> = taken.changes.iter().map(|change| change.effect.as_str()).collect();
    let unrequested =
        "reaches player only when player requests speed, which it declares but has not requested";
    // Another start does not request one that is not live either.
    assert_eq!(effects, [&unrequested.replace("speed", "file"), unrequested], "{taken:?}");
    for (request, name) in [(1, "file"), (2, "speed")] {
        ask(&mut versions, 1, ConfigRequest::Parameter { request, name: name.into() });
    }
    let edited = edited.replace("value=\"3\"", "value=\"4\"").replace("c.log", "d.log");
    let taken = state(&versions.handle(saved(&edited)));
    let effects: Vec<_> = taken.changes.iter().map(|change| change.effect.as_str()).collect();
    let expected = ["takes effect when player is started again", "reaches player immediately"];
    assert_eq!(effects, expected, "{taken:?}");
}

#[test]
fn what_changed_between_versions_can_be_asked() {
    let mut versions = versions();
    connect(&mut versions, 1, "param-7", Purpose::Config);
    let diff = |versions: &mut Versions, from, to| match ask(
        versions,
        1,
        ConfigRequest::Diff { request: 5, from, to },
    ) {
        ConfigReply::Differences { request: 5, from, to, changes, left_out: 0 } => {
            let texts: Vec<_> = changes.into_iter().map(|change| change.text).collect();
            format!("{from} to {to}: {}", texts.join("; "))
        }
        ConfigReply::Refused { request: 5, refusal } => refusal.text,
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
    let gone = "versions 1 and 9 are not both kept; versions 1 to 3 are";
    assert_eq!(diff(&mut versions, Some(1), Some(9)), gone);
    for round in 0..40 {
        versions.handle(saved(&FILE.replace("10Hz", &format!("{}Hz", 40 + round))));
    }
    let held = "versions 1 and 43 are not both kept; versions 12 to 43 are";
    assert_eq!(diff(&mut versions, Some(1), None), held);
}

#[test]
fn parameters_are_listed_with_values_and_origins() {
    let rules = VersionRules { manifests: Some(live_manifests()), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "param-7", Purpose::Config);
    let list = |component: Option<&str>, from| ConfigRequest::List {
        request: 5,
        component: component.map(Into::into),
        from,
    };
    let ConfigReply::Listed { version: 1, refused: false, parameters, total: 6, .. } =
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
        ConfigReply::Listed { parameters, total: 2, .. } => assert_eq!(parameters.len(), 1),
        other => panic!("{other:?}"),
    }
    let unknown = ask(&mut versions, 1, list(Some("unknown"), 0));
    assert!(matches!(unknown, ConfigReply::Refused { request: 5, .. }), "{unknown:?}");
}

#[test]
fn an_unknown_parameter_is_refused_with_those_there_are() {
    let rules = VersionRules { manifests: Some(live_manifests()), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "player", Purpose::Config);
    match ask(&mut versions, 1, ConfigRequest::Parameter { request: 4, name: "sped".into() }) {
        ConfigReply::Refused { request: 4, refusal } => assert_eq!(
            refusal.text,
            "`player` is a player, and that has no parameter called `sped`; did you mean speed? It has: file, \
             speed"
        ),
        other => panic!("{other:?}"),
    }
}
