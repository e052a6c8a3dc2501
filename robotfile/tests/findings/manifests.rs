//! Systems against the manifests of their kinds.

use armor_robotfile::{Colours, Manifests};
use armor_wire::manifest::Manifest;

use super::{one_with, reading, system};

fn manifests() -> Manifests {
    let port = |id: &str, name: &str, required: bool| {
        format!(
            r#"{{"id":"{id}","type":"{name}","schema":"{name}{{}}","schema_hash":"00000000000000{:02x}","required":{required}}}"#,
            name.len()
        )
    };
    let text = format!(
        r#"{{"armor_manifest":1,"kind":"k","summary":"","inputs":[{},{}],"outputs":[{},{},{},{}],"parameters":[
            {{"name":"speed","type":"number","unit":"m/s","default":"1","minimum":0.1,"maximum":2}},
            {{"name":"colour","type":"choice","choices":["red","blue"],"default":"red"}},
            {{"name":"count","type":"integer","default":"3"}},
            {{"name":"file","type":"path","doc":"the log"}}]}}"#,
        port("in", "Scan", true),
        port("extra", "Map", false),
        port("out", "Scan", false),
        port("map", "Map", false),
        port("old-clock", "Clock", false),
        port("clock", "Clock", false).replace("Clock{}", "Clock{clock:f64(s)}"),
    );
    let manifest: Manifest = serde_json::from_str(&text).unwrap();
    Manifests::from([("k".into(), manifest)])
}

#[test]
fn the_time_is_given_by_an_output_that_is_a_clock() {
    let file = system(
        r#"<clock source="a.clock"/><component name="a" kind="k"><parameter name="file" value="x"/></component><link from="a.out" to="a.in"/>"#,
    );
    let (fine, _) = reading(&file, Some(&manifests()));
    assert!(!fine.findings.has_errors(), "{}", fine.findings.render(Colours::No));
    let (reading, _) = reading(&file.replace("a.clock", "a.old-clock"), Some(&manifests()));
    let shown = reading.findings.render(Colours::No);
    assert!(shown.contains("a.old-clock cannot be the clock"), "{shown}");
    assert!(shown.contains("these publish a clock: a.clock"), "{shown}");
}

#[test]
fn systems_against_manifests() {
    let manifests = manifests();
    let with = |code: &str, parameters: &str, links: &str| {
        let file = format!(
            r#"<component name="a" kind="k"><parameter name="file" value="x"/>{parameters}</component>{links}"#
        );
        one_with(code, &system(&file), Some(&manifests));
    };
    let fed = r#"<link from="a.out" to="a.in"/>"#;
    with("E0106", "", &format!(r#"{fed}<link from="a.[[oot]]" to="a.extra"/>"#));
    with("E0107", "", &format!(r#"{fed}<link from="[[a.in]]" to="a.extra"/>"#));
    with("E0108", "", &format!(r#"{fed}<link from="a.out" to="[[a.extra]]"/>"#));
    with("E0108", "", &format!(r#"{fed}<clock source="[[a.out]]"/>"#));
    with("E0108", "", &format!(r#"{fed}<clock source="[[a.old-clock]]"/>"#));
    with("E0106", "", &format!(r#"{fed}<clock source="a.[[clok]]"/>"#));
    with("E0110", r#"<parameter name="[[sped]]" value="1"/>"#, fed);
    with("E0112", r#"<parameter name="speed" value="[[fast]]"/>"#, fed);
    with("E0112", r#"<parameter name="speed" value="[[1m]]"/>"#, fed);
    with("E0112", r#"<parameter name="count" value="[[1.5]]"/>"#, fed);
    with("E0113", r#"<parameter name="speed" value="[[3m/s]]"/>"#, fed);
    with("E0113", r#"<parameter name="colour" value="[[green]]"/>"#, fed);
    let exchanged = r#"<component name="b" kind="k"><parameter name="file" value="x"/></component><link from="[[b.in]]" to="a.out"/>"#;
    with("E0107", "", &format!("{fed}{exchanged}"));
    one_with(
        "E0018",
        &system(
            r#"<component name="[[a b]]" kind="k"><parameter name="file" value="x"/></component><link from="ab.out" to="ab.in"/>"#,
        ),
        Some(&manifests),
    );
    // A slip in a name, and not also that what it meant is missing.
    with("E0106", "", r#"<link from="a.out" to="a.[[inn]]"/>"#);
    with("E0103", "", r#"<link from="a.out" to="[[aa]].in"/>"#);
    with("E0019", "", r#"<link from="[[a]]" to="a.in"/>"#);
    with("E0019", "", r#"<link from="a.out" to="[[a]]"/>"#);
    with("E0017", "", r#"<[[link]] from="a.out"/>"#);
    with("E0015", "", r#"<[[lnik]] from="a.out" to="a.in"/>"#);
    with("E0101", "", &format!(r#"{fed}<component name="[[a]]" kind="other"/>"#));
    for kind in ["[[]]", "[[k ]]"] {
        let malformed = format!(r#"<component name="a" kind="{kind}"/>{fed}"#);
        one_with("E0018", &system(&malformed), Some(&manifests));
    }
    one_with(
        "E0110",
        &system(&format!(
            r#"<component name="a" kind="k"><parameter name="[[fille]]" value="x"/></component>{fed}"#
        )),
        Some(&manifests),
    );
    one_with("E0105", &system(r#"<component name="a" kind="[[kk]]"/>"#), Some(&manifests));
    let no_input =
        r#"<component name="[[a]]" kind="k"><parameter name="file" value="x"/></component>"#;
    one_with("E0109", &system(no_input), Some(&manifests));
    let no_file = format!(r#"<component name="[[a]]" kind="k"/>{fed}"#);
    one_with("E0111", &system(&no_file), Some(&manifests));
    let right = r#"<component name="a" kind="k" rate="5Hz"><parameter name="file" value="x"/><parameter name="speed" value="5km/h"/></component>"#;
    let other = right.replace("\"a\"", "\"b\"");
    let all = format!(
        r#"{right}{other}<link from="a.out" to="b.in"/><link from="b.out" to="a.in"/><link from="a.map" to="b.extra"/><link from="b.map" to="a.extra"/>"#
    );
    let (reading, _) = reading(&system(&all), Some(&manifests));
    assert!(reading.findings.is_empty(), "{}", reading.findings.render(Colours::No));
}

#[test]
fn two_versions_of_a_message_are_distinguished_by_their_fields() {
    let port = |schema: &str, hash: u32| {
        format!(
            r#"{{"id":"p","type":"Scan","schema":"{schema}","schema_hash":"{hash:016x}","required":true}}"#
        )
    };
    let kind = |kind: &str, inputs: &str, outputs: &str| -> Manifest {
        let text = format!(
            r#"{{"armor_manifest":1,"kind":"{kind}","summary":"","inputs":[{inputs}],"outputs":[{outputs}],"parameters":[]}}"#
        );
        serde_json::from_str(&text).unwrap()
    };
    let old = kind("old", "", &port("Scan{ranges:[f32]}", 1));
    let new = kind("new", &port("Scan{ranges:[f64],stamp:f64}", 2), "");
    let manifests = Manifests::from([("old".into(), old), ("new".into(), new)]);
    let file = r#"<component name="a" kind="old"/><component name="b" kind="new"/><link from="a.p" to="b.p"/>"#;
    let (reading, _) = reading(&system(file), Some(&manifests));
    let shown = reading.findings.render(Colours::No);
    assert!(shown.contains("E0108") && shown.contains("both use the name Scan"), "{shown}");
    assert!(shown.contains("ranges[]: a.p has f32, b.p has f64"), "{shown}");
    assert!(shown.contains("stamp"), "{shown}");
}

#[test]
fn a_link_that_never_delivers_a_message() {
    let kind = |latched: bool| -> Manifest {
        let port = |id: &str| {
            format!(
                r#"{{"id":"{id}","type":"S","schema":"S{{}}","schema_hash":"0000000000000001","latched":{latched}}}"#
            )
        };
        let text = format!(
            r#"{{"armor_manifest":1,"kind":"k","summary":"","inputs":[{}],"outputs":[{}],"parameters":[]}}"#,
            port("in"),
            port("out")
        );
        serde_json::from_str(&text).unwrap()
    };
    let file = |first: &str, second: &str, more: &str| {
        format!(
            r#"<armor version="1"><system><component name="one" kind="k" rate="10Hz"/><component name="two" kind="k" rate="10Hz"/><link from="[[one.out]]" to="two.in"/><link from="two.out" to="one.in" mode="pull"/></system>
            <mission goal="over" safe="hold"><place name="a" initial="true" components="{first}"/><place name="b" components="{second}"/><place name="over"/><place name="hold"/>{more}
            <transition name="t" from="a" to="b" timeout="1s"/><transition name="u" from="b" to="over" timeout="1s"/></mission></armor>"#
        )
    };
    let manifests = |latched| Manifests::from([("k".into(), kind(latched))]);
    one_with("W0266", &file("one", "two", ""), Some(&manifests(false)));
    let together = r#"<place name="c" initial="true" components="two"/>"#;
    for (fine, manifests) in [
        (file("one", "one two", ""), Some(manifests(false))),
        (file("one", "two", together), Some(manifests(false))),
        // One that is in no place is always active.
        (file("one", "one", ""), Some(manifests(false))),
        (file("one", "two", ""), Some(manifests(true))),
        // Without manifests it is not known whether the output is latched.
        (file("one", "two", ""), None),
    ] {
        let (reading, _) = reading(&fine, manifests.as_ref());
        assert!(reading.findings.is_empty(), "{fine}\n{}", reading.findings.render(Colours::No));
    }
}

#[test]
fn the_reports_a_mission_waits_for_are_those_that_its_components_declare() {
    let kind = |kind: &str, events: &str| -> Manifest {
        let text = format!(
            r#"{{"armor_manifest":1,"kind":"{kind}","summary":"","inputs":[],"outputs":[],
                "parameters":[{{"name":"buttons","type":"text","default":"start"}}]{events}}}"#
        );
        serde_json::from_str(&text).unwrap()
    };
    let patrol = kind("patrol", r#","events":[{"name":"lap"},{"name":"dome"}]"#);
    let view = kind("view", r#","events":[{"name":"button","named_by":"buttons"}]"#);
    let manifests = Manifests::from([
        ("patrol".into(), patrol),
        ("view".into(), view),
        ("quiet".into(), kind("quiet", r#","events":[]"#)),
        ("unlisted".into(), kind("unlisted", "")),
    ]);
    let found = |on: &str, parameter: &str, in_place: &str| {
        let file = format!(
            r#"<armor version="1"><system>
            <component name="a" kind="patrol"/><component name="b" kind="view">{parameter}</component>
            <component name="c" kind="quiet"/><component name="d" kind="unlisted"/></system>
            <mission goal="home" safe="hold"><place name="go" initial="true" components="a b c d">{in_place}</place>
            <place name="home"/><place name="hold"/>
            <transition name="t" from="go" to="home" on="{on}"/>
            <transition name="u" from="go" to="hold" timeout="10min"/></mission></armor>"#
        );
        let (reading, _) = reading(&file, Some(&manifests));
        let of =
            |f: &&armor_robotfile::Finding| ["E0225", "N0226", "W0221"].contains(&f.code.as_str());
        let found = reading.findings.iter().filter(of);
        found
            .map(|f| format!("{} {} ({})", f.code.as_str(), f.message, f.remedy))
            .collect::<Vec<_>>()
    };
    let home = r#"<parameter name="buttons" value="home  explore"/>"#;
    let given = r#"<parameter component="b" name="buttons" value="stop"/>"#;
    let none: [&str; 0] = [];
    for (on, parameter, in_place) in [
        ("a.done", "", ""),
        ("a.failed", "", ""),
        ("a.lap", "", ""),
        ("a.dome", "", ""), // like `done`, but declared
        ("b.start", "", ""),
        ("b.explore", home, ""),
        ("b.stop", home, given),
    ] {
        assert_eq!(found(on, parameter, in_place), none, "{on}");
    }
    assert_eq!(
        found("a.lapp", "", ""),
        ["E0225 a reports no event called lapp (did you mean lap?)"]
    );
    assert_eq!(
        found("a.dnoe", "", ""),
        ["E0225 a reports no event called dnoe (did you mean done?)"],
        "not W0221 as well"
    );
    assert_eq!(
        found("b.start", home, ""),
        [
            "E0225 b reports no event called start (it reports: explore, home, done, failed; otherwise add start to buttons of b)"
        ]
    );
    assert_eq!(
        found("c.finshed", "", ""),
        ["E0225 c reports no event called finshed (it reports: done, failed)"]
    );
    assert_eq!(
        found("c.dnoe", "", ""),
        ["E0225 c reports no event called dnoe (did you mean done?)"]
    );
    let misspelt = found("d.dnoe", "", "");
    assert!(misspelt.len() == 1 && misspelt[0].starts_with("W0221"), "{misspelt:?}");
    let unlisted = found("d.seen", "", "");
    assert!(
        unlisted.len() == 1 && unlisted[0].starts_with("N0226 the manifest of the kind unlisted"),
        "{unlisted:?}"
    );
}

#[test]
fn no_mission_controls_a_kind_that_forbids_it() {
    let kind = |kind: &str, controllable: bool| -> (String, Manifest) {
        let text = format!(
            r#"{{"armor_manifest":1,"kind":"{kind}","summary":"","inputs":[],"outputs":[],
                "parameters":[{{"name":"speed","type":"number","default":"1"}}],
                "controllable":{controllable}}}"#
        );
        (kind.into(), serde_json::from_str(&text).unwrap())
    };
    let manifests = Manifests::from([kind("free", false), kind("k", true)]);
    let file = |place: &str, inner: &str, more: &str| {
        format!(
            r#"<armor version="1"><system><component name="one" kind="k"/><component name="two" kind="k"/><component name="view" kind="free"/></system>
            <mission goal="over" safe="hold"><place name="a" initial="true" components="{place}">{inner}</place><place name="b" components="two"/><place name="over"/><place name="hold"/>{more}
            <transition name="t" from="a" to="b" timeout="1s"/><transition name="u" from="b" to="over" timeout="1s"/></mission></armor>"#
        )
    };
    let exclusive = |mark: &str| format!("<exclusive components=\"one {mark}\"/>");
    let given = r#"<parameter component="[[view]]" name="speed" value="2"/>"#;
    for file in [
        file("one [[view]]", "", ""),
        file("one", "", &exclusive("[[view]]")),
        file("one", given, ""),
    ] {
        one_with("E0206", &file, Some(&manifests));
    }
    let (reading, _) = reading(&file("one view", "", ""), None);
    assert!(reading.is_valid(), "without manifests nothing is known of the kind");
}

#[test]
fn a_text_has_the_form_that_its_component_declares() {
    let kinds = super::follow_ups::kinds();
    let found = |name: &str, value: &str| -> Vec<String> {
        let file = system(&format!(
            r#"<component name="a" kind="patrol"><parameter name="{name}" value="{value}"/></component>"#
        ));
        let findings = reading(&file, Some(&kinds)).0.findings;
        let shown = findings.iter().filter(|found| found.code.as_str() != "N0117");
        shown.map(|it| format!("{} {}; {}", it.code.as_str(), it.message, it.remedy)).collect()
    };
    let none: Vec<String> = Vec::new();
    for (name, value) in [("route", "3.6,1.5 0,0"), ("route", ""), ("buttons", "explore home")] {
        assert_eq!(found(name, value), none, "{value}");
    }
    assert_eq!(
        found("route", "3.6;1.5"),
        ["E0112 route: point 1, `3.6;1.5`, is not x,y in metres; write points x,y in metres \
             with spaces between them, such as `4,1 9.5,-3`; waypoints; a list of points is expected"]
    );
    assert_eq!(
        found("buttons", "go lap"),
        ["E0112 buttons: lap is the name of another event; choose another name; these are \
             taken: lap, waypoint, skipped, done, failed"]
    );
    assert!(found("buttons", "go,home")[0].starts_with("E0112 buttons: name 1, `go,home`"));
}

/// Returns the warnings about a system of the kinds of the documentation's examples.
fn warnings_of(file: &str) -> Vec<String> {
    let manifests: Vec<Manifest> =
        serde_json::from_str(include_str!("../example_kinds.json")).unwrap();
    let manifests = manifests.into_iter().map(|it| (it.kind.clone(), it)).collect();
    let (reading, _) = reading(file, Some(&manifests));
    let faults = reading.findings.iter().filter(|it| it.code.as_str().starts_with(['W', 'E']));
    faults.map(|it| format!("{} {} ({})", it.code.as_str(), it.message, it.remedy)).collect()
}

#[test]
fn an_input_that_takes_another_output_than_that_of_its_name() {
    let with = |components: &str, pose: &str, truth: &str| {
        let components = components.split(' ');
        let components = components.map(|it| format!(r#"<component name="{it}" kind="{it}"/>"#));
        warnings_of(&system(&format!(
            r#"{}<link from="pilot.velocity" to="world.velocity"/><link from="{pose}" to="pilot.pose"/><link from="{truth}" to="judge.truth"/>{}"#,
            components.collect::<String>(),
            r#"<link from="tracker.pose" to="judge.pose"/>"#
        )))
    };
    let all = "world tracker pilot judge";
    let found = with(all, "world.truth", "world.truth");
    assert_eq!(found.len(), 1, "{found:?}");
    let message = "W0140 pilot.pose takes world.truth, although tracker.pose has its name";
    assert!(found[0].starts_with(message), "{found:?}");
    let found = with(all, "tracker.pose", "tracker.pose");
    assert!(found.len() == 1 && found[0].contains("world.truth has its name"), "{found:?}");
    assert_eq!(with(all, "tracker.pose", "world.truth"), Vec::<String>::new());
    // Without a component that publishes the name, the other one is all there is.
    let found = with("world pilot judge", "world.truth", "world.truth");
    assert!(!found.iter().any(|it| it.starts_with("W0140")), "{found:?}");
}

#[test]
fn time_that_only_one_component_follows() {
    let with = |clock: &str, speed: &str| {
        warnings_of(&system(&format!(
            r#"{clock}<component name="world" kind="world"><parameter name="speed" value="{speed}"/></component>"#
        )))
    };
    let found = with("", "8");
    assert!(
        found.len() == 1 && found[0].starts_with("W0141 the time of world runs 8"),
        "{found:?}"
    );
    assert!(found[0].contains(r#"<clock source="world.clock"/>"#), "{found:?}");
    assert_eq!(with("", "1"), Vec::<String>::new());
    assert_eq!(with(r#"<clock source="world.clock"/>"#, "8"), Vec::<String>::new());
}

#[test]
fn data_that_come_less_often_than_they_must() {
    let with = |rate: &str| {
        warnings_of(&system(&format!(
            r#"<component name="world" kind="world"/><component name="tracker" kind="tracker"/><component name="pilot" kind="pilot"{rate}/><link from="tracker.pose" to="pilot.pose"/><link from="pilot.velocity" to="world.velocity"/>"#
        )))
    };
    let found = with(r#" rate="1Hz""#);
    assert_eq!(
        found,
        [
            "W0142 pilot is called every 1 s, but world takes pilot.velocity for missing after 0.5 s \
          (give pilot a higher rate)"
        ]
    );
    assert_eq!(with(r#" rate="2Hz""#).len(), 1, "0.5 s is not younger than 0.5 s");
    assert_eq!(with(r#" rate="2.5Hz""#), Vec::<String>::new());
    // Called by data, it is as fast as these.
    assert_eq!(with(""), Vec::<String>::new());
}

#[test]
fn a_component_that_works_at_its_rate_has_one() {
    let mut manifests: Manifests = manifests();
    manifests.get_mut("k").expect("the kind").needs_rate = true;
    let file = |rate: &str, link: &str| {
        system(&format!(
            r#"<component name="[[a]]" kind="k" {rate}><parameter name="file" value="x"/></component>{link}"#
        ))
    };
    let with = |rate: &str| file(rate, r#"<link from="a.out" to="a.in"/>"#);
    let codes = |file: &str| {
        let (reading, _) = reading(file, Some(&manifests));
        reading.findings.iter().map(|it| it.code.as_str()).collect::<Vec<_>>()
    };
    assert!(codes(&with("")).contains(&"W0120"));
    assert!(!codes(&with(r#"rate="5Hz""#)).contains(&"W0120"));
    assert!(!codes(&file("", "")).contains(&"W0120"), "without an input it is called at 10 Hz");
}

#[test]
fn a_component_that_needs_one_of_several_sources() {
    let mut manifests = manifests();
    let group = ["extra", "file"].map(str::to_owned);
    manifests.get_mut("k").expect("the kind").needs_one_of = vec![group.to_vec()];
    let with = |inner: &str, link: &str| {
        let file = system(&format!(
            r#"<component name="a" kind="k">{inner}</component><link from="a.out" to="a.in"/>{link}"#
        ));
        let (reading, _) = reading(&file, Some(&manifests));
        let unfed = reading.findings.iter().filter(|it| it.code.as_str() == "E0109");
        unfed.map(|it| it.remedy.clone()).collect::<Vec<_>>()
    };
    let none = r#"<parameter name="file" value=""/>"#;
    assert_eq!(with(none, ""), ["add a link to a.extra, or the parameter file"]);
    assert_eq!(with(r#"<parameter name="file" value="x"/>"#, ""), Vec::<String>::new());
    assert_eq!(with(none, r#"<link from="a.map" to="a.extra"/>"#), Vec::<String>::new());
}

#[test]
fn parameters_of_another_kind_are_one_finding() {
    let mut manifests = manifests();
    let mut other = manifests["k"].clone();
    other.kind = "other".into();
    other.parameters.truncate(1);
    other.parameters[0].name = "size".into();
    (other.inputs, other.outputs) = (Vec::new(), Vec::new());
    manifests.insert("other".into(), other);
    let file = system(
        r#"<component name="a" kind="[[other]]"><parameter name="speed" value="1m/s"/><parameter name="count" value="2"/></component>"#,
    );
    one_with("E0110", &file, Some(&manifests));
    let (reading, _) = reading(&file, Some(&manifests));
    let shown = reading.findings.render(Colours::No);
    assert!(shown.contains("did you mean kind=\"k\"?"), "{shown}");
}

#[test]
fn an_input_that_is_fed_twice_names_one_that_was_meant() {
    let with = |links: &str| {
        let file = system(&format!(
            r#"<component name="world" kind="world"/><component name="tracker" kind="tracker"/><component name="pilot" kind="pilot"/><component name="judge" kind="judge"/><link from="pilot.velocity" to="world.velocity"/>{links}"#
        ));
        let found = warnings_of(&file).into_iter().filter(|it| it.starts_with("E0104"));
        found.collect::<Vec<_>>()
    };
    let pilot = r#"<link from="tracker.pose" to="pilot.pose"/>"#;
    let judge = r#"<link from="tracker.pose" to="judge.pose"/>"#;
    let truth = with(&format!(r#"{pilot}{judge}<link from="world.truth" to="judge.pose"/>"#));
    assert!(truth.len() == 1 && truth[0].contains("judge.truth, which nothing feeds"), "{truth:?}");
    let twice = with(&format!("{pilot}{pilot}"));
    assert!(twice.len() == 1 && twice[0].contains("judge.pose, which nothing feeds"), "{twice:?}");
}

#[test]
fn an_input_that_takes_many_has_any_number_of_links_and_at_least_one() {
    let with = |links: &[&str]| {
        let links = links.iter().map(|link| format!(r#"<link {link}/>"#)).collect::<String>();
        let components = r#"<component name="front" kind="laser"/><component name="rear" kind="laser"/><component name="maps" kind="scan-mapper"/><component name="draws" kind="cartographer"/>"#;
        let found = warnings_of(&system(&format!("{components}{links}")));
        found.into_iter().filter(|it| it.starts_with('E')).collect::<Vec<_>>()
    };
    let (front, rear) =
        (r#"from="front.scan" to="maps.scans""#, r#"from="rear.scan" to="maps.scans""#);
    let (draws, map) =
        (r#"from="front.scan" to="draws.scan""#, r#"from="draws.map" to="maps.scans""#);
    assert_eq!(with(&[front, rear, draws]), [] as [String; 0]);
    let unfed = with(&[draws]);
    assert!(unfed.len() == 1 && unfed[0].contains("nothing feeds maps.scans"), "{unfed:?}");
    let twice = with(&[front, rear, front, draws]);
    assert!(twice.len() == 1, "{twice:?}");
    assert!(
        twice[0].starts_with("E0104 the input maps.scans is fed twice by front.scan"),
        "{twice:?}"
    );
    let other = with(&[front, map, draws]);
    assert!(other.len() == 1 && other[0].starts_with("E0108 draws.map cannot feed"), "{other:?}");
}

#[test]
fn a_component_that_is_never_done() {
    let with = |event: &str| {
        warnings_of(&format!(
            r#"<armor version="1"><system><component name="world" kind="world"/></system><mission goal="over" safe="hold"><place name="a" initial="true" components="world"/><place name="over"/><place name="hold"/><transition name="t" from="a" to="over" on="world.{event}"/><transition name="late" from="a" to="hold" timeout="9s"/></mission></armor>"#
        ))
    };
    let found = with("done");
    assert!(
        found
            .iter()
            .any(|it| it == "E0225 world never reports that it is done (it reports: failed)"),
        "{found:?}"
    );
    assert!(!with("failed").iter().any(|it| it.starts_with("E0225")));
}

#[test]
fn outputs_of_two_links_that_are_exchanged_are_one_finding() {
    let file = |pose: &str, truth: &str| {
        let components = ["world", "tracker", "pilot", "judge"]
            .map(|it| format!(r#"<component name="{it}" kind="{it}"/>"#));
        warnings_of(&system(&format!(
            r#"{}<link from="pilot.velocity" to="world.velocity"/><link from="tracker.pose" to="pilot.pose"/><link from="{pose}" to="judge.pose"/><link from="{truth}" to="judge.truth"/>"#,
            components.concat()
        )))
    };
    assert_eq!(file("tracker.pose", "world.truth"), Vec::<String>::new());
    let found = file("world.truth", "tracker.pose");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].contains(r#"exchange the outputs of the two links: from="tracker.pose" here"#),
        "{found:?}"
    );
}

#[test]
fn a_component_whose_uses_are_those_of_another_kind() {
    let file = system(
        r#"<component name="world" kind="world"/><component name="judge" kind="tracker"/><link from="pilot.velocity" to="world.velocity"/><component name="tracker" kind="tracker"/><component name="pilot" kind="pilot"/><link from="tracker.pose" to="pilot.pose"/><link from="tracker.pose" to="judge.pose"/><link from="world.truth" to="judge.truth"/>"#,
    );
    let found = warnings_of(&file);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].starts_with("E0106 a tracker has no ports called pose, truth; a judge has all"),
        "{found:?}"
    );
    assert!(found[0].contains(r#"did you mean kind="judge"?"#), "{found:?}");
}
