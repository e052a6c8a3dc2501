//! What is found in guards and variables, at which piece of the text.

use std::path::Path;

use armor_robotfile::{Colours, Manifests, check, read};
use armor_wire::manifest::{MANIFEST_VERSION, Manifest, PortManifest};

const STATE: &str = "State{stamp:f64(s),level:f32,charge:f32(Ah),tilt:f64(deg),fan:u8(steps),\
                     inner:Inner{volts:?f32(V)},mode:Mode<Off,On>,label:string,cells:[f32]}";

fn manifests() -> Manifests {
    let port = |id: &str, schema: &str| PortManifest {
        id: id.into(),
        type_name: schema.split('{').next().unwrap().into(),
        schema: schema.into(),
        schema_hash: 1,
        doc: String::new(),
        required: false,
        many: false,
        latched: false,
        stale_after: String::new(),
    };
    let manifest = Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind: "power".into(),
        summary: "for the test".into(),
        controllable: true,
        protocol: None,
        reports_done: true,
        ends_by_itself: false,
        needs_rate: false,
        reads_all: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
        inputs: vec![],
        outputs: vec![
            port("state", STATE),
            port("one", "One{stamp:f64(s),data:f64(m)}"),
            port("ok", "Ok{data:bool}"),
            port("hits", "Hits{data:u32}"),
        ],
        parameters: vec![],
        events: None,
    };
    [("power".to_owned(), manifest)].into()
}

fn file(inner: &str) -> String {
    format!(
        r#"<armor version="1"><system><component name="p" kind="power"/></system><mission safe="a"><place name="a" initial="true" components="p"/><place name="b"/>{inner}<transition name="back" from="b" to="a" timeout="1s"/></mission></armor>"#
    )
}

/// The file has exactly this finding, at the piece between `[[` and `]]`; with no code, none.
fn check_file(code: &str, inner: &str, manifests: Option<&Manifests>) {
    let text = file(inner);
    let plain = text.replace("[[", "").replace("]]", "");
    let reading = read(Path::new("a.xml"), &mut |_| Ok(plain.clone().into()));
    let reading = check(reading, &[], manifests);
    let shown = reading.findings.render(Colours::No);
    let found: Vec<_> = reading.findings.iter().filter(|f| f.code.as_str() != "N0123").collect();
    let codes: Vec<_> = found.iter().map(|finding| finding.code.as_str()).collect();
    let wanted: Vec<_> = Some(code).filter(|code| !code.is_empty()).into_iter().collect();
    assert_eq!(codes, wanted, "{inner}\n{shown}");
    if let Some(start) = text.find("[[") {
        let at = found[0].at.as_ref().unwrap();
        let piece = text[start + 2..].split("]]").next().unwrap();
        assert_eq!((at.span.start(), at.text()), (start, piece), "{shown}");
    }
}

fn when(guard: &str) -> String {
    format!(
        r#"<variable name="v" source="p.state.level" min="0" max="100"/><transition name="t" from="a" to="b" when="{guard}"/>"#
    )
}

fn guard(code: &str, guard: &str) {
    let keeps_used = format!("{guard} or v &lt; 5");
    check_file(code, &when(&keeps_used), Some(&manifests()));
}

#[test]
fn a_guard_in_order() {
    for text in [
        "v &gt; 30",
        "p.state.level &lt; 30%",
        "p.one &gt; 5m and p.one.data &lt; 2km",
        "p.one &gt; 5",
        "p.ok",
        "not p.ok == true",
        "p.state.charge &lt; 500mAh",
        "p.state.tilt * 2 &lt; 30deg or p.state.tilt &gt; 0",
        "p.state.fan &gt; 100",
        "p.state.inner &lt; 11V",
        "p.state.inner.volts / 12V &lt; 0.9",
        "p.state.mode == 'On' and p.state.label != ''",
        "known(p.state.label)",
        "p.one / 2s &lt; 1m/s",
        "v * 1% &lt; 0.5",
    ] {
        guard("", text);
    }
}

#[test]
fn names_that_are_not_there() {
    guard("E0231", "[[battery]] &lt; 3");
    guard("E0231", "[[v-1]] &lt; 3");
    guard("E0103", "[[q]].state.level &gt; 2");
    guard("E0106", "p.[[stat]].level &lt; 3");
    guard("E0106", "p.[[one-1]] &lt; 3");
    guard("E0232", "p.state.[[lvl]] &lt; 3");
    guard("E0232", "p.state.level.[[x]] &lt; 3");
    guard("E0232", "p.state.inner.[[volt]] &lt; 3V");
    guard("E0235", "[[p.state]] &lt; 3");
    guard("E0235", "[[p.state.cells]] &lt; 3");
}

#[test]
fn values_that_do_not_fit() {
    guard("E0233", "[[v]]");
    guard("E0233", "not [[v]]");
    guard("E0233", "[[p.ok]] &lt; 3");
    guard("E0233", "[[p.ok == 3]]");
    guard("E0233", "p.state.mode == [['Onn']]");
    guard("E0233", "-[[p.state.label]] &lt; 3");
    guard("E0234", "p.state.charge &lt; [[3]]");
    guard("E0234", "p.state.tilt &lt; 30deg + [[1]]");
    guard("E0234", "p.one &lt; [[3s]]");
    guard("E0234", "p.state.level &lt; [[3s]]");
    guard("E0234", "p.state.fan &lt; [[3Hz]]");
    guard("E0234", "v &lt; [[30%]]");
    guard("E0234", "[[p.one]] + p.state.level &lt; 2m");
}

#[test]
fn constant_guards() {
    guard("W0236", "[[v &lt; 0]]");
    guard("W0236", "[[v + 1 &lt;= 101]]");
    guard("W0236", "[[0 - v &gt; 0]] or p.ok");
    guard("W0236", "[[1 &lt; 2]]");
    guard("W0236", "[[p.hits.data &gt;= 0]]");
    guard("W0236", "[[p.hits.data &lt; 0]]");
    guard("", "p.hits.data &gt;= 5 and p.hits.data != 7");
    check_file("W0236", r#"<transition name="t" from="a" to="b" when="[[true]]"/>"#, None);
}

#[test]
fn the_piece_is_found_behind_entities_and_line_breaks() {
    guard("E0230", "v &lt; 3 [[&amp;&#38;]] p.ok");
    guard("E0231", "v &#x3c; 3\r\n\tand 'ä' == 'ä' and [[x]] &gt; 1");
    guard("E0230", "v > 3 [[§]] 1");
}

#[test]
fn variables() {
    let with = |code: &str, variable: &str| {
        let text = format!(
            r#"<variable name="v" {variable}/><transition name="t" from="a" to="b" when="known(v)"/>"#
        );
        check_file(code, &text, Some(&manifests()));
    };
    with("", r#"source="p.state.level" min="0" max="100""#);
    with("", r#"source="p.one" min="0" max="1km""#);
    with("", r#"source="p.state.tilt" min="0" max="30deg""#);
    with("", r#"source="p.ok""#);
    with("W0027", r#"source="p.ok" [[initial]]="1""#);
    with("E0019", r#"source="[[p]]""#);
    with("E0019", r#"source="[[p.state.]]""#);
    with("E0103", r#"source="[[q]].state""#);
    with("E0232", r#"source="p.state.[[lvl]]""#);
    with("E0235", r#"source="[[p.state]]""#);
    with("E0233", r#"source="p.ok" min="[[0]]""#);
    with("E0234", r#"source="p.one" max="[[10s]]""#);
    with("E0234", r#"source="p.state.tilt" max="[[30]]""#);
    let unused = r#"<variable name="[[v]]" source="p.ok"/><transition name="t" from="a" to="b" timeout="2s"/>"#;
    check_file("W0237", unused, None);
}

#[test]
fn set_values_are_whole_numbers_in_the_domain() {
    let with = |code: &str, variable: &str, value: &str| {
        let text = format!(
            r#"<variable name="n" {variable}/><variable name="ok" source="p.one"/>
            <transition name="t" from="a" to="b" when="n &lt; 3 and known(ok)">
            <set variable="n" value="{value}"/></transition>"#
        );
        check_file(code, &text, Some(&manifests()));
    };
    let domain = r#"min="0" max="3""#;
    with("", domain, "n + 1");
    with("", domain, "3 - 2 * n");
    with("", r#"min="-5" max="5" initial="-2""#, "-n");
    with("E0238", domain, "[[n / 2]]");
    with("E0238", domain, "n + [[0.5]]");
    with("E0238", domain, "n + [[1s]]");
    with("E0238", domain, "[[p.one]] + 1");
    with("E0238", domain, "[[ok]] + 1");
    with("E0238", domain, "n [[&lt;]] 1");
    with("E0238", domain, "[[n + 4]]");
    with("E0231", domain, "n + [[m]]");
    with("E0019", r#"min="0.5" max="[[3m]]""#.replace("0.5", "0").as_str(), "n + 1");
    with("E0019", r#"min="0" max="3" initial="[[4]]""#, "n + 1");
    let check = |code: &str, text: &str| check_file(code, text, Some(&manifests()));
    let domain = r#"<variable name="n" min="0" max="3"/>"#;
    let guard = r#"<transition name="t" from="a" to="b" when="n &lt; 3">"#;
    let one = r#"<set variable="n" value="1"/>"#;
    check("", &format!("{domain}{guard}{one}</transition>"));
    let twice = r#"<set variable="[[n]]" value="2"/>"#;
    check("E0239", &format!("{domain}{guard}{one}{twice}</transition>"));
    let data = r#"<variable name="n" source="p.one"/>"#;
    let sets = r#"<set variable="[[n]]" value="2"/></transition>"#;
    check("E0239", &format!("{data}{guard}{sets}"));
    let unknown = r#"<set variable="[[m]]" value="2"/></transition>"#;
    check("E0231", &format!("{domain}{guard}{one}{unknown}"));
    let unset = r#"<variable name="[[n]]" min="0" max="3"/>"#;
    check("W0224", &format!("{unset}{guard}</transition>"));
    let none = r#"<variable name="[[n]]" min="0"/>"#;
    check("E0239", &format!("{none}{guard}{one}</transition>"));
    let alone = r#"<variable name="[[n]]" initial="1"/>"#;
    check("E0239", alone);
    let unread = r#"<variable name="[[n]]" min="0" max="3"/>
        <transition name="t" from="a" to="b" timeout="1s"><set variable="n" value="n + 1"/></transition>"#;
    check("W0237", unread);
    // A check may use it as a guard may.
    let claimed = unread.replace("[[n]]", "n") + "<check>always n &lt;= 3</check>";
    check("", &claimed);
    check("E0203", &(claimed + "<check>always [[m]] &lt;= 3</check>"));
}

#[test]
fn conditions_that_exclude_each_other() {
    let alone = |code: &str, guard: &str| {
        let text = format!(r#"<transition name="t" from="a" to="b" when="{guard}"/>"#);
        check_file(code, &text, Some(&manifests()));
    };
    for guard in [
        "[[p.one &gt; 300 and p.one &lt; 250]]",
        "[[p.one &lt; 300 or p.one &gt; 250]]",
        "[[p.one &gt; 3m and p.ok and 3m &gt;= p.one]]",
        "not [[(p.one &lt; 5 or p.one &gt; 3)]]",
        "[[p.state.mode == 'On' and p.state.mode == 'Off']]",
        "[[p.state.mode != 'On' or p.state.mode != 'Off']]",
        "[[p.ok and not p.ok]]",
        "p.ok or [[p.one &lt; 1 and p.one == 2]]",
    ] {
        alone("W0236", guard);
    }
    for guard in [
        "p.one &lt; 300 and p.one &gt; 250",
        "p.one &gt; 300 or p.one &lt; 250",
        "p.one &gt;= 3 and p.one &lt;= 3",
        "p.one &gt; 300 and p.state.level &lt; 250",
        "p.state.mode == 'On' or p.state.mode == 'Off'",
        "p.one != 3 and p.one != 4",
        "(p.ok and p.one &gt; 3) or (not p.ok and p.one &lt; 2)",
    ] {
        alone("", guard);
    }
}

#[test]
fn a_measured_value_is_not_exactly_a_fraction() {
    let alone = |code: &str, variable: &str, guard: &str| {
        let text = format!(r#"{variable}<transition name="t" from="a" to="b" when="{guard}"/>"#);
        check_file(code, &text, Some(&manifests()));
    };
    alone("W0268", "", "[[p.state.level == 30%]]");
    alone("W0268", "", "p.ok and not [[(p.one != 0.5)]]");
    let level = r#"<variable name="v" source="p.state.level" min="0" max="0.5"/>"#;
    alone("W0268", level, "[[v == 0.25]]");
    // Values outside of the domain are moved exactly to its ends.
    alone("", level, "v == 0.5");
    alone("", "", "p.one == 0 or p.one == 2m");
    alone("", "", "p.state.mode == 'On'");
}

#[test]
fn a_misspelt_word_is_found_where_it_is() {
    guard("E0230", "[[nto]] p.ok");
    guard("E0230", "p.ok [[adn]] p.ok");
    guard("E0230", "[[knwn]](v)");
    guard("E0230", "[[foo]](v)");
    let text =
        r#"<transition name="t" from="a" to="b" timeout="1s"/><check>[[nver]] a and b</check>"#;
    check_file("E0250", text, None);
    check_file("E0250", &text.replace("[[nver]] a and b", "never [[activ]](p)"), None);
}

#[test]
fn a_variable_that_nothing_reads_or_sets() {
    let text = r#"<variable name="[[n]]" min="0" max="3"/><transition name="t" from="a" to="b" timeout="1s"/>"#;
    check_file("W0237", text, None);
}
