//! One fault, one finding: what only follows from it is left out, and its remedy is shown.

use std::path::Path;

use armor_robotfile::{Colours, Manifests, check, needed_paths, read};
use armor_wire::manifest::Manifest;

use super::{one, system};

pub(super) fn kinds() -> Manifests {
    let text = include_str!("../example_kinds.json");
    let kinds: Vec<Manifest> = serde_json::from_str(text).expect("manifests");
    kinds.into_iter().map(|manifest| (manifest.kind.clone(), manifest)).collect()
}

/// The file has one finding, of this code, whose text contains `shown`.
pub(super) fn only(code: &str, shown: &str, file: &str) {
    let reading = read(Path::new("a.xml"), &mut |path| match path.to_str() {
        Some("a.xml") => Ok(file.into()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    });
    let reading = check(reading, &[], Some(&kinds()));
    let text = reading.findings.render(Colours::No);
    let without_notes = reading.findings.without_notes();
    let codes: Vec<_> = without_notes.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(codes, [code], "{file}\n{text}");
    assert!(text.contains(shown), "{shown}\n{text}");
}

/// A mission of an explorer, an arm and a battery, with these attributes of the mission and content.
pub(super) fn robot(of_mission: &str, content: &str) -> String {
    let power = r#"<component name="power" kind="battery"/>"#;
    let power = if content.contains("power.") { power } else { "" };
    format!(
        r#"<armor version="1"><system><component name="go" kind="explorer"/><component name="arm" kind="arm"/>{power}</system><mission goal="over" {of_mission}><place name="a" initial="true" components="go"/><place name="over"/><place name="hold"/>{content}</mission></armor>"#
    )
}

pub(super) const END: &str = r#"<transition name="end" from="a" to="over" on="go.done"/>"#;
pub(super) const LATE: &str = r#"<transition name="late" from="a" to="hold" timeout="60s"/>"#;

#[test]
fn the_reports_of_an_unknown_kind_are_not_known() {
    let file = robot(r#"safe="hold""#, &format!("{}{LATE}", END.replace("done", "dnoe")));
    only("E0105", "did you mean explorer?", &file.replace("\"explorer\"", "\"explorr\""));
}

#[test]
fn a_domain_that_is_empty_decides_no_guard() {
    let guards = r#"<transition name="t" from="a" to="hold" when="n &lt; 2"><set variable="n" value="n + 1"/></transition><transition name="u" from="a" to="over" when="n == 2"/>"#;
    let variable = r#"<variable name="n" min="3" max="0"/>"#;
    only(
        "E0019",
        "max must not be below min",
        &robot(r#"safe="hold""#, &format!("{variable}{guards}")),
    );
    let power = r#"<variable name="n" source="power.state.level" min="1" max="0"/><transition name="t" from="a" to="hold" when="n &lt; 0.5"/>"#;
    only("E0019", "max must not be below min", &robot(r#"safe="hold""#, &format!("{power}{END}")));
}

#[test]
fn components_may_be_in_a_place_that_is_missing() {
    let exclusive = r#"<exclusive components="go arm"/>"#;
    let file = |content: &str| robot(r#"safe="hold""#, &format!("{END}{LATE}{exclusive}{content}"));
    only("E0207", "arm is in no place", &file(""));
    only(
        "E0023",
        "dock.xml cannot be read",
        &file(r#"<submission ref="dock.xml" in="hold" out="over"/>"#),
    );
    only("E0103", "did you mean arm?", &file(r#"<place name="b" components="amr"/>"#));
    only("E0016", "did you mean components?", &file(r#"<place name="b" component="arm"/>"#));
    only(
        "E0203",
        "no place called b",
        &file(r#"<transition name="t" from="a" to="b" on="go.failed"/>"#),
    );
    let without_start = robot(r#"safe="hold""#, &format!("{END}{LATE}"));
    let a = r#"<place name="a" initial="true" components="go"/>"#;
    only("E0203", "no place called a", &without_start.replace(a, ""));
}

#[test]
fn a_link_of_another_type_forms_no_circle() {
    let file = system(
        r#"<component name="left" kind="relay"/><component name="right" kind="base"/><component name="maps" kind="cartographer"/><link from="left.out" to="right.way" keep="all"/><link from="right.scan" to="maps.scan" keep="all"/><link from="maps.map" to="left.in" keep="all"/>"#,
    );
    only("E0108", "maps.map cannot feed left.in", &file);
}

#[test]
fn a_link_to_the_wrong_input_is_one_finding() {
    let file = |second: &str| {
        let components = r#"<component name="laser" kind="laser"/><component name="one" kind="relay"/><component name="two" kind="relay"/>"#;
        system(&format!(
            r#"{components}<link from="laser.scan" to="one.in"/><link from="laser.scan" to="{second}.in"/>"#
        ))
    };
    only("E0104", "was one meant for two.in, which nothing feeds?", &file("one"));
    let maps = r#"<component name="laser" kind="laser"/><component name="maps" kind="cartographer"/><component name="viewer" kind="viewer"/><link from="laser.scan" to="maps.scan"/><link from="laser.scan" to="viewer.map"/><link from="maps.map" to="viewer.map"/>"#;
    only("E0108", "laser.scan cannot feed viewer.map", &system(maps));
}

#[test]
fn two_values_for_one_parameter_are_one_finding() {
    let file = r#"<component name="l" kind="laser"><parameter name="range" value="fast"/><parameter name="range" value="5m"/></component>"#;
    only("E0102", "a second value for range", &system(file));
}

#[test]
fn a_component_that_no_mission_controls_is_named_once() {
    let file = robot(
        r#"safe="hold""#,
        &format!(
            "{END}{LATE}<exclusive components=\"go arm\"/><place name=\"b\" components=\"go arm\"/>"
        ),
    );
    let file = file.replace("kind=\"explorer\"", "kind=\"explorer\" controllable=\"false\"");
    let file = file.replace("<exclusive components=\"go arm\"/>", "");
    only("E0206", "it is also named in 1 more place", &file);
}

#[test]
fn a_guard_that_is_always_false_says_what_to_do() {
    let file = |guard: &str| {
        let transition = format!(r#"<transition name="t" from="a" to="hold" when="{guard}"/>"#);
        robot(r#"safe="hold""#, &format!("{END}{transition}"))
    };
    only("W0236", "this guard is always false", &file("false"));
    only("W0236", "the transition never fires: write a condition", &file("false"));
    only("W0236", "`2 > 3` is always false: it contains no value that changes", &file("2 > 3"));
    only("W0236", "remove it, or name data", &file("true"));
}

#[test]
fn a_weight_at_a_place_with_components_is_to_be_removed() {
    let file = |arcs: &str| robot(r#"safe="hold""#, &format!("{END}{arcs}"));
    let taken =
        r#"<transition name="t" to="hold" timeout="9s"><arc from="a" weight="2"/></transition>"#;
    only("W0217", "remove the weight; to count tokens", &file(taken));
    let put = r#"<place name="b" components="arm"/><transition name="t" from="a" timeout="9s"><arc to="b" weight="2"/></transition><transition name="u" from="b" to="hold" on="arm.done"/>"#;
    only("E0216", "remove the weight; to count tokens", &file(put));
}

#[test]
fn places_of_a_submission_are_of_the_mission_that_includes_it() {
    let robot = robot(r#"safe="hold""#, r#"<submission ref="dock.xml" in="a" out="docked"/>"#);
    let dock = r#"<armor version="1"><mission goal="docked" safe="missed"><place name="creep" initial="true" components="arm"/><place name="docked"/><place name="missed"/><transition name="t" from="creep" to="docked" on="arm.done"/></mission></armor>"#;
    for (out, shown) in [
        ("docked", "docked is a place of dock.xml, not of this mission"),
        ("docked", "before and after the sub-mission: a, hold, over"),
        ("ovr", "did you mean over?"),
        ("nowhere", "name one of: a, hold, over"),
    ] {
        let robot = robot.replace("out=\"docked\"", &format!("out=\"{out}\""));
        let reading = read(Path::new("a.xml"), &mut |path| match path.to_str() {
            Some("a.xml") => Ok(robot.clone().into()),
            _ => Ok(dock.into()),
        });
        let reading = check(reading, &[], Some(&kinds()));
        let text = reading.findings.render(Colours::No);
        let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
        assert_eq!(codes, ["E0203"], "{text}");
        assert!(text.contains(shown), "{shown}\n{text}");
    }
}

#[test]
fn the_safe_place_that_was_probably_meant_is_named() {
    only(
        "W0213",
        "write safe=\"hold\" if the robot is safe in hold",
        &robot("", &format!("{END}{LATE}")),
    );
}

#[test]
fn a_value_of_a_closed_list_is_shown_as_it_is_with_what_is_allowed() {
    let file = |attribute: &str| {
        robot(
            r#"safe="hold""#,
            &format!("{END}{}", LATE.replace("timeout", &format!("{attribute} timeout"))),
        )
    };
    only("E0019", "autonomy: `operater` is not valid", &file(r#"autonomy="operater""#));
    for value in ["operater", "OPERATOR", "‹operator›", "“operator”", " operator"] {
        let shown = "did you mean operator? write one of auto, confirm, operator";
        only("E0019", shown, &file(&format!("autonomy=\"{value}\"")));
    }
    only("E0019", "write one of auto, confirm, operator", &file(r#"autonomy="manual""#));
    only("E0019", "did you mean true?", &file(r#"operator="Yes""#));
    let guard = |value: &str| {
        let when = format!(
            r#"<transition name="t" from="a" to="hold" when="power.state.status == {value}"/>"#
        );
        robot(r#"safe="hold""#, &format!("{END}{when}"))
    };
    only("E0233", "it is never '‹full›'", &guard("'‹full›'"));
    only("E0233", "did you mean Full? write one of Idle, Full", &guard("'‹full›'"));
    only("E0230", "put a text between single quotes", &guard("“Full”"));
}

#[test]
fn a_transition_without_to_is_one_finding() {
    let file = robot(r#"safe="hold""#, &format!("{END}{}", LATE.replace(" to=\"hold\"", "")));
    only("W0271", "late takes the token from a and puts it into no place", &file);
    // A place without components may be a stock, from which tokens are taken.
    let stock =
        r#"<place name="stock" initial="3"/><transition name="drop" from="stock" timeout="9s"/>"#;
    let text = robot(r#"safe="hold""#, &format!("{END}{LATE}{stock}"));
    super::none(&text);
}

#[test]
fn the_units_of_the_expected_quantity_are_suggested() {
    let timeout =
        |value: &str| robot(r#"safe="hold""#, &format!("{END}{}", LATE.replace("60s", value)));
    only("E0019", "`S` in `60S` is not a unit; did you mean 60s?", &timeout("60S"));
    only("E0019", "did you mean 5min?", &timeout("5 minutes"));
    only("E0019", "did you mean 1.5min?", &timeout("1,5min"));
    only("E0019", "is not a unit; write s, ms, us, ns, min or h", &timeout("5 parsec"));
    let rate =
        |value: &str| system(&format!(r#"<component name="l" kind="laser" rate="{value}"/>"#));
    only("E0019", "did you mean 20Hz?", &rate("20hz"));
    let range = |value: &str| {
        system(&format!(
            r#"<component name="l" kind="laser"><parameter name="range" value="{value}"/></component>"#
        ))
    };
    only("E0112", "did you mean 5m?", &range("5M"));
    only("E0112", "write m, mm, cm or km", &range("5 parsec"));
    let guard = |value: &str| {
        let when = format!(
            r#"<transition name="t" from="a" to="hold" when="power.state.voltage &lt; {value}"/>"#
        );
        robot(r#"safe="hold""#, &format!("{END}{when}"))
    };
    only("E0230", "did you mean V?", &guard("11v"));
    super::none(&robot(
        r#"safe="hold""#,
        &format!(
            r#"{END}{}<check>duration(over or hold) &lt;= 18 min</check>"#,
            LATE.replace("timeout=\"60s\"", "when=\"power.state.voltage &lt; 11 V\"")
        ),
    ));
    only("E0230", "did you mean %?", &guard("30 percent"));
    only("E0230", "did you mean V?", &guard("11volts"));
    let check = robot(
        r#"safe="hold""#,
        &format!("{END}{LATE}<check>duration(over or hold) &lt;= 18m</check>"),
    );
    only("E0250", "did you mean 18min?", &check);
}

#[test]
fn a_field_in_percent_is_compared_with_percent() {
    let manifest = r#"{"armor_manifest":1,"kind":"radio","summary":"","inputs":[],"outputs":[{"id":"state","type":"Radio","schema":"Radio{quality:f32(%),share:f32}","schema_hash":"0000000000000001"}],"parameters":[{"name":"least","type":"number","unit":"%","default":"20%","minimum":0,"maximum":100}]}"#;
    let manifest: Manifest = serde_json::from_str(manifest).expect("a manifest");
    let kinds = Manifests::from([("radio".to_owned(), manifest)]);
    let check = |least: &str, guard: &str| {
        let file = format!(
            r#"<armor version="1"><system><component name="link" kind="radio"><parameter name="least" value="{least}"/></component></system><mission goal="b" safe="c"><place name="a" initial="true"/><place name="b"/><place name="c"/><transition name="t" from="a" to="b" when="{guard}"/></mission></armor>"#
        );
        let reading = read(Path::new("a.xml"), &mut |_| Ok(file.clone().into()));
        check(reading, &[], Some(&kinds)).findings.render(Colours::No)
    };
    for (least, guard) in [
        ("30%", "link.state.quality &lt; 30%"),
        ("30", "link.state.share &lt; 30%"),
        ("5000ppm", "link.state.share &lt; 0.3"),
    ] {
        assert_eq!(check(least, guard), "", "{least} {guard}");
    }
    let never = check("30%", "link.state.quality > 120%");
    assert!(never.contains("W0236") && never.contains("quality is 0 to 100 %"), "{never}");
    assert_eq!(check("30%", "link.state.share > 1.2"), "");
    let bare = check("30%", "link.state.quality &lt; 30");
    assert!(bare.contains("is in %") && bare.contains("write 30%"), "{bare}");
    let outside = check("130%", "link.state.quality &lt; 30%");
    assert!(
        outside.contains("error[E0113]: least: `130%` is out of range, 0 to 100 %"),
        "{outside}"
    );
}

#[test]
fn an_unknown_attribute_may_be_the_one_that_is_missing() {
    one("E0016", &system(r#"<component [[label]]="a" kind="k"/>"#));
    one("E0017", &system(r#"<[[component]] kind="k" xmlns:x="urn:x" x:label="a"/>"#));
}

#[test]
fn what_repeats_a_malformed_or_misspelt_word_is_left_out() {
    one("E0018", &super::mission("").replace("safe=\"hold\"", "safe=\"[[hold over]]\""));
    let file = "<armor version=\"1\"><system/><[[misson]] safe=\"a\"><place name=\"a\" initial=\"true\"/></mission></armor>";
    one("E0015", file);
    let file =
        r#"<component name="a" kind="k"><parameter name="laps">[[2]]</parameter></component>"#;
    one("E0014", &system(file));
}

#[test]
fn a_variable_that_is_missing_is_named_once() {
    let content = r#"<transition name="t" from="a" to="hold" on="go.empty" when="n &lt; 2"><set variable="n" value="n + 1"/></transition><check>never n &gt; 3</check>"#;
    only(
        "E0231",
        "there is no variable called n; it is also named in 2 more places",
        &robot(r#"safe="hold""#, &format!("{END}{content}")),
    );
}

#[test]
fn of_a_branch_that_is_never_reached_its_first_place_is_named() {
    let branch = r#"<place name="b" components="arm"/><place name="c"/><transition name="t" from="b" to="c" on="arm.done"/><transition name="u" from="c" to="over" timeout="9s"/>"#;
    only(
        "W0212",
        "no transition leads to b, so arm is never active",
        &robot(r#"safe="hold""#, &format!("{END}{LATE}{branch}")),
    );
}

#[test]
fn a_name_that_is_taken_is_one_finding() {
    let file = system(
        r#"<component name="eye" kind="laser"/><component name="map" kind="mapper"/><link from="eye.scan" to="map.scan"/>"#,
    );
    // It takes the name of another, so its own name is missing, and its port seems to be.
    let renamed =
        |from: &str, to: &str| file.replace(&format!("name=\"{from}\""), &format!("name=\"{to}\""));
    only("E0101", "a second component called eye", &renamed("map", "eye"));
    only("E0101", "a second component called map", &renamed("eye", "map"));
    only("E0115", "registry is a reserved name", &renamed("map", "registry"));
    let file = robot(r#"safe="hold""#, &format!("{END}{LATE}"));
    only("E0201", "a second place called a", &file.replace(r#"name="hold""#, r#"name="a""#));
}

#[test]
fn what_cannot_be_read_of_a_transition_has_no_follow_ups() {
    let asked = r#"<transition name="asked" from="a" to="hold" autonomy="confirm" answer-within="30s" unanswered="fire" lost-link="fire"/>"#;
    let file = |from: &str, to: &str| {
        robot(r#"safe="hold""#, &format!("{END}{}", asked.replace(from, to)))
    };
    only("E0019", "did you mean confirm?", &file("\"confirm\"", "\"confrim\""));
    only("E0019", "did you mean true?", &file("autonomy=\"confirm\"", "operator=\"TRUE\""));
    // Without it, the three attributes that need it are one mistake.
    only("W0027", "write operator=", &file("autonomy=\"confirm\"", "timeout=\"9s\""));
    // One that is misspelt is there, and so are the safe place and the goal.
    let asked_for = asked.replace(r#"autonomy="confirm""#, r#"operater="true""#);
    only("E0016", "operator", &robot(r#"safe="hold""#, &format!("{END}{asked_for}")));
    only("E0016", "safe", &robot(r#"save="hold""#, &format!("{END}{asked}")));
    let arc = r#"<transition name="t" timeout="3s"><arc from="a"/><arc plac="hold"/></transition>"#;
    only("E0016", "<arc> has no attribute plac", &robot(r#"safe="hold""#, &format!("{END}{arc}")));
    // An attribute of another namespace is no misspelt one.
    let foreign = arc.replace("plac=", "xmlns:x=\"urn:x\" x:place=");
    only("E0205", "this arc joins no place", &robot(r#"safe="hold""#, &format!("{END}{foreign}")));
    let sets = r#"<variable name="n" source="power.state.level" min="0" max="1"/><transition name="t" from="a" to="hold" when="n &lt; 0.5"><set variable="n" value="n + 1"/></transition>"#;
    only("E0239", "no transition may set it", &robot(r#"safe="hold""#, &format!("{sets}{END}")));
}

#[test]
fn what_is_not_closed_leaves_no_names_on_its_line() {
    let late = "\n<transition name=\"late\" from=\"a\" to=\"hold timeout=\"60s\"/>\n";
    only("E0004", "not closed", &robot(r#"safe="hold""#, &format!("{END}{late}")));
}

#[test]
fn dates_in_the_wrong_order_have_not_passed_too() {
    let dates = r#"not-before="2024-06-01T12:00:00Z" not-after="2023-06-01T12:00:00Z""#;
    let file = robot(r#"safe="hold""#, &format!("{END}{}", LATE.replace("timeout=\"60s\"", dates)));
    let reading = read(Path::new("a.xml"), &mut |_| Ok(file.clone().into()));
    let configuration = reading.configuration.expect("it is readable");
    let now = "2030-01-01T00:00:00Z".parse().expect("a date");
    assert!(armor_robotfile::passed_dates(&configuration, now).is_empty());
}

#[test]
fn a_comparison_with_itself_and_a_division_by_nothing_are_found() {
    let file = |guard: &str| {
        let variable = r#"<variable name="n" source="power.state.level" min="0" max="1"/>"#;
        let go = format!(r#"<transition name="t" from="a" to="hold" when="{guard}"/>"#);
        robot(r#"safe="hold""#, &format!("{variable}{go}{END}"))
    };
    only("W0236", "`n < n` is always false: both sides are the same", &file("n &lt; n"));
    only("W0236", "is always true: both sides are the same", &file("n - 0.1 &gt;= (n - 0.1)"));
    only("W0236", "`n/0` has no value: it is divided by 0", &file("n/0 &lt; 0.5"));
}

#[test]
fn no_number_is_taken_for_a_truth_or_a_count_for_percent() {
    let file = robot(r#"safe="hold""#, &format!("{END}{LATE}"));
    let negative = file.replace(r#"initial="true""#, r#"initial="-1""#);
    let reading = read(Path::new("a.xml"), &mut |_| Ok(negative.clone().into()));
    let text = check(reading, &[], None).findings.render(Colours::No);
    assert!(!text.contains("did you mean true"), "{text}");
    let counts = r#"<variable name="n" min="0" max="1"/><transition name="t" from="a" to="hold" when="n &lt; 2"><set variable="n" value="1"/></transition>"#;
    let counts = robot(r#"safe="hold""#, &format!("{counts}{END}"));
    let reading = read(Path::new("a.xml"), &mut |_| Ok(counts.clone().into()));
    let text = check(reading, &[], None).findings.render(Colours::No);
    assert!(text.contains("W0236") && !text.contains('%'), "{text}");
}

#[test]
fn a_variable_with_a_taken_name_is_one_finding() {
    let power = r#"<variable name="n" source="power.state.level" min="0" max="1"/>"#;
    let guards = r#"<transition name="t" from="a" to="hold" when="n &lt; 30% and m == 0"><set variable="m" value="m + 1"/></transition>"#;
    let content = format!(r#"{power}<variable name="n" min="0" max="2"/>{END}{guards}"#);
    only("E0210", "a second variable called n", &robot(r#"safe="hold""#, &content));
}

#[test]
fn a_mistake_that_a_guard_repeats_is_one_finding() {
    let guard = |text: &str| {
        let when = format!(r#"<transition name="t" from="a" to="hold" when="{text}"/>"#);
        robot(r#"safe="hold""#, &format!("{END}{when}"))
    };
    let level = "power.state.level";
    only("E0233", "each side of and", &guard(&format!("{level} and {level}")));
    only("W0236", "is always 0: both sides", &guard(&format!("{level} - {level} &lt; 1")));
    only("W0236", "is always 1: both sides", &guard(&format!("{level} / {level} &lt; 1")));
    super::none(&guard(&format!("{level} - 0.1 &lt; {level} * 2")));
}

#[test]
fn a_file_that_cannot_be_opened_is_named_with_the_reason() {
    let player = |file: &str| {
        system(&format!(
            r#"<component name="p" kind="player"><parameter name="file" value="{file}"/></component>"#
        ))
    };
    let fault = |path: &Path| {
        let text = player(&path.display().to_string());
        let reading = read(Path::new("a.xml"), &mut |_| Ok(text.clone().into()));
        let needed = needed_paths(&reading.configuration.expect("it is read"), &kinds());
        let [only] = &needed[..] else { panic!("{}", needed.len()) };
        let denied = only.refuse(&std::io::ErrorKind::PermissionDenied.into()).message;
        assert!(denied.contains("which cannot be read: permission denied"), "{denied}");
        only.find_fault().map(|finding| finding.message)
    };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    assert_eq!(fault(&here.join("Cargo.toml")), None);
    assert_eq!(fault(here), None, "a folder may be meant");
    let missing = fault(&here.join("gone.log")).expect("a finding");
    assert!(missing.contains("which does not exist"), "{missing}");
}
