//! Missions: places and transitions, alone and together, their dates and their reports.

use super::{found_in, mission, none, one};

#[test]
fn missions() {
    one("E0201", &mission(r#"<place name="[[a]]"/>"#));
    one("E0202", &mission(r#"<transition name="t" from="a"/><transition name="[[t]]" from="a"/>"#));
    one("E0203", &mission(r#"<transition name="t" from="a" to="[[b]]"/>"#));
    one(
        "E0203",
        &mission(r#"<transition name="t" from="a"><inhibitor place="[[b]]"/></transition>"#),
    );
    one("E0203", &mission(r#"<transition name="t" from="a" overrun="[[b]]"/>"#));
    one("E0103", &mission(r#"<transition name="t" from="a" on="[[robot]].done"/>"#));
    one(
        "E0103",
        &mission(
            r#"<exclusive components="go [[robot]]"/><place name="b" initial="true" components="go"/><place name="c" initial="true"/>"#,
        ),
    );
    one("E0205", &mission(r#"<transition name="[[t]]"/>"#));
    one("E0205", &mission(r#"<transition name="t" from="a"><[[arc]]/></transition>"#));
    one(
        "E0206",
        &mission(
            r#"<exclusive components="go [[free]]"/><place name="b" initial="true" components="go"/><place name="c" initial="true"/>"#,
        ),
    );
    one(
        "E0208",
        &mission(
            r#"<exclusive components="go stop [[go]]"/><place name="b" initial="true" components="go"/><place name="c" components="stop"/><transition name="x" from="b" to="c"/>"#,
        ),
    );
    one(
        "E0207",
        &mission(
            r#"<exclusive components="go stop"/><place name="b" components="go [[stop]]"/><transition name="t" from="a" to="b"/>"#,
        ),
    );
    one(
        "E0207",
        &mission(
            r#"<exclusive components="go stop"/><place name="b" initial="true" components="go"/><place name="c" initial="true" components="[[stop]]"/>"#,
        ),
    );
    one(
        "E0209",
        &mission(
            r#"<place name="b" initial="true" components="go"><parameter component="[[stop]]" name="p" value="1"/></place>"#,
        ),
    );
    one(
        "E0210",
        &mission(r#"<variable name="v" min="0" max="1"/><variable name="[[v]]" min="0" max="1"/>"#),
    );
    one("E0211", &mission(r#"<transition name="t" from="a"><arc from="[[a]]"/></transition>"#));
    one("W0212", &mission(r#"<place name="[[b]]"/>"#));
    one(
        "W0214",
        &mission(
            r#"<place name="b" components="go"/><transition name="s" from="a" to="b" timeout="1s"/><transition name="t" from="a" on="[[go]].done"/>"#,
        ),
    );
    one("W0215", &mission(r#"<[[exclusive]] components="go"/>"#));
    one(
        "E0204",
        "<armor version=\"1\"><system/><[[mission]] safe=\"a\"><place name=\"a\"/></mission></armor>",
    );
    one(
        "W0213",
        "<armor version=\"1\"><system><component name=\"c\" kind=\"k\"/></system><[[mission]]><place name=\"a\" initial=\"true\"/></mission></armor>",
    );
    one(
        "E0203",
        "<armor version=\"1\"><system/><mission safe=\"a\" goal=\"[[b]]\"><place name=\"a\" initial=\"true\"/></mission></armor>",
    );
}

#[test]
fn transitions_that_hinder_themselves_or_each_other() {
    let b = r#"<place name="b" components="go"/><transition name="in" from="a" to="b"/>"#;
    let with = |code: &str, inner: &str| one(code, &mission(&format!("{b}{inner}")));
    let fine = |inner: &str| none(&mission(&format!("{b}{inner}")));
    with(
        "W0217",
        r#"<transition name="t" from="b" to="hold"><inhibitor place="[[b]]"/></transition>"#,
    );
    with("W0217", r#"<transition name="t"><arc from="[[b]]" weight="2"/></transition>"#);
    fine(
        r#"<transition name="t" from="b" to="hold"><inhibitor place="a" weight="2"/></transition>"#,
    );
    with(
        "E0216",
        r#"<place name="c" initial="true"/><transition name="t" from="c"><arc to="[[b]]" weight="2"/></transition>"#,
    );
    with("E0216", r#"<place name="[[c]]" initial="2" components="stop"/>"#);
    fine(r#"<place name="c" initial="2"/>"#);
    // Immediate before late, early before late; but not if something else must be there too.
    with("W0217", r#"<transition name="[[t]]" from="a" to="hold" timeout="5s"/>"#);
    with(
        "W0217",
        r#"<transition name="s" from="b" to="hold" timeout="2s"/><transition name="[[t]]" from="b" to="hold" on="go.done" after="3s"/>"#,
    );
    fine(
        r#"<place name="c" initial="true"/><transition name="s" from="b c" to="hold" timeout="2s"/><transition name="t" from="b" to="hold" timeout="3s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" to="hold" timeout="2s"/><transition name="t" from="b" to="hold" timeout="3s" class="safety"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" to="hold" on="go.done"/><transition name="t" from="b" to="hold" timeout="3s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" to="hold" after="2s" operator="true"/><transition name="t" from="b" to="hold" timeout="3s"/>"#,
    );
    with(
        "W0217",
        r#"<transition name="[[s]]" from="b" to="hold" on="go.done"/><transition name="t" from="b" to="hold" on="go.done" priority="1"/>"#,
    );
    with(
        "W0218",
        r#"<transition name="s" from="b" to="hold" on="go.done"/><transition name="[[t]]" from="b" to="hold" on="go.done"/>"#,
    );
    with(
        "W0218",
        r#"<place name="c" initial="true"/><transition name="s" from="b c" to="hold" timeout="2s"/><transition name="[[t]]" from="b" to="hold" timeout="2s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" to="hold" on="go.done"/><transition name="t" from="b" to="hold" on="go.failed"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" to="hold" when="go.o.x &lt; 1"/><transition name="t" from="b" to="hold" when="go.o.x &gt; 1"/>"#,
    );
}

#[test]
fn dates_periods_and_attributes_without_effect() {
    let with = |code: &str, inner: &str| {
        one(
            code,
            &mission(&format!(
                "<place name=\"b\"/>{}",
                inner.replace("T>", "name=\"t\" from=\"a\" to=\"b\"")
            )),
        );
    };
    with(
        "E0219",
        r#"<transition T> not-before="2026-11-21T15:00Z" not-after="[[2026-11-21T14:59:59.9Z]]"/>"#,
    );
    with("E0019", r#"<transition T> not-after="[[2026-02-30T00:00Z]]"/>"#);
    with("W0027", r#"<transition T> [[missed]]="skip"/>"#);
    with("W0027", r#"<transition T> [[lost-link]]="fire"/>"#);
    with("W0027", r#"<transition T> operator="true" [[answer-within]]="5s"/>"#);
    with("W0027", r#"<transition T> autonomy="confirm" [[unanswered]]="fire"/>"#);
    with("W0027", r#"<transition T> after="5s" [[overrun]]="a"/>"#);
    with(
        "W0027",
        r#"<transition T>/><place name="c" on-failure="[[a]]"/><transition name="u" from="b" to="c" timeout="1s"/><transition name="v" from="c" to="hold" timeout="1s"/>"#,
    );
    with("E0103", r#"<transition T>/><variable name="v" source="[[robot]].battery"/>"#);
    let late = |period: &str, time: &str| {
        format!(
            r#"<armor version="1"><system><component name="c" kind="k"/></system><mission safe="a" period="{period}"><place name="a" initial="true"/><transition name="t" from="a" {time}/></mission></armor>"#
        )
    };
    one("W0220", &late("1s", "timeout=\"[[0.5s]]\""));
    none(&late("1s", "timeout=\"1s\""));
    none(&late("1s", "after=\"0.5s\""));
    one("E0019", &late("[[0s]]", ""));
}

#[test]
fn a_report_that_is_almost_done_is_a_warning() {
    for report in ["dnoe", "Done", "don", "faild"] {
        one("W0221", &mission(&format!(r#"<transition name="t" from="a" on="go.[[{report}]]"/>"#)));
    }
    for report in ["done", "failed", "seen", "docked"] {
        none(&mission(&format!(r#"<transition name="t" from="a" on="go.{report}"/>"#)));
    }
}

#[test]
fn a_circle_that_takes_no_time_is_a_warning() {
    let circle = |first: &str, more: &str| {
        mission(&format!(
            r#"<place name="b"/><place name="c"/><transition name="t" from="a" to="b"/><transition name="[[u]]" from="b" to="c"/><transition name="v" from="c" to="b"{first}/>{more}"#
        ))
    };
    one("W0222", &circle("", ""));
    one("W0222", &mission(r#"<transition name="[[t]]" from="a" to="a"/>"#));
    for rest in [r#" after="1s""#, r#" timeout="1s""#, r#" on="free.done""#, r#" operator="true""#]
    {
        none(&circle(rest, "").replace("[[u]]", "u"));
    }
    // Another one goes first, and leads out of it.
    let out = r#"<place name="d"/><transition name="w" from="b" to="d" priority="1"/>"#;
    let (codes, shown) = found_in(&circle("", out).replace("[[u]]", "u"));
    assert!(!codes.contains(&"W0222"), "{shown}");
}

#[test]
fn the_expected_number_is_described() {
    let shown = |inner: &str| found_in(&mission(inner)).1;
    let count = shown(r#"<transition name="t" from="a" priority="99999999999999"/>"#);
    assert!(count.contains("a whole number from -999999999 to 999999999"), "{count}");
    let large = shown(r#"<variable name="v" min="1e999m/s"/>"#);
    assert!(large.contains("below 1e308"), "{large}");
    let empty = shown(r#"<transition name="t" from="a" priority=""/>"#);
    assert!(empty.contains("priority is empty"), "{empty}");
}

#[test]
fn a_mission_that_stops_somewhere_has_a_goal() {
    let with = |attributes: &str, inner: &str| {
        format!(
            r#"<armor version="1"><system><component name="go" kind="k"/></system><[[mission]] {attributes}><place name="a" initial="true" components="go"/><place name="b" components="go"/><place name="hold"/><transition name="t" from="a" to="b" on="go.done"/>{inner}</mission></armor>"#
        )
    };
    let unmarked = |file: String| file.replace("[[", "").replace("]]", "");
    one("W0260", &with(r#"safe="hold""#, ""));
    none(&unmarked(with(r#"safe="hold" goal="b""#, "")));
    // A mission that repeats its places, and one that always ends in its safe place, need none.
    let back = r#"<transition name="u" from="b" to="a" on="go.done"/>"#;
    none(&unmarked(with(r#"safe="hold""#, back)));
    none(&unmarked(with(
        r#"safe="hold""#,
        r#"<transition name="u" from="b" to="hold" timeout="5s"/>"#,
    )));
    // A place that counts something is not where it stops.
    let counted = r#"<place name="n"/><transition name="u" from="b" to="a n" on="go.done"/>"#;
    none(&unmarked(with(r#"safe="hold""#, counted)));
}

#[test]
fn a_transition_without_from_is_an_emergency_or_a_mistake() {
    one("W0261", &mission(r#"<transition name="[[t]]" to="hold" timeout="10min"/>"#));
    one("W0261", &mission(r#"<transition name="[[t]]" to="hold" on="go.failed"/>"#));
    one("W0261", &mission(r#"<transition name="[[t]]" to="a" class="safety" operator="true"/>"#));
    none(&mission(r#"<transition name="t" to="hold" class="safety" operator="true"/>"#));
    none(&mission(r#"<transition name="t" to="over" class="safety" on="go.done"/>"#));
    for condition in ["<read place=\"a\"/>", "<inhibitor place=\"b\"/>", "<reset place=\"b\"/>"] {
        none(&mission(&format!(
            r#"<place name="b"/><transition name="t" to="b" timeout="5s">{condition}</transition>"#
        )));
    }
}

#[test]
fn failures_times_and_sets_that_change_nothing() {
    let place = |target: &str| {
        mission(&format!(
            r#"<place name="b" initial="true" components="go" on-failure="{target}"/>"#
        ))
    };
    one("W0263", &place("[[b]]"));
    none(&place("a"));
    for time in [r#"timeout="[[0s]]""#, r#"timeout="[[1ms]]""#] {
        one("W0264", &mission(&format!(r#"<transition name="t" from="a" to="hold" {time}/>"#)));
    }
    let (codes, shown) =
        found_in(&mission(r#"<transition name="t" from="a" interval="[0s,9ms]"/>"#));
    assert_eq!(codes, ["W0264"], "{shown}");
    for time in [r#"timeout="10ms""#, r#"after="0s""#, r#"interval="[0s,5s]""#] {
        none(&mission(&format!(r#"<transition name="t" from="a" to="hold" {time}/>"#)));
    }
    let sets = |second: &str| {
        mission(&format!(
            r#"<place name="b" initial="true" components="go"/><place name="c" components="stop"/><place name="d" components="third"/><transition name="x" from="b" to="c"/><transition name="y" from="c" to="d"/><exclusive components="go stop"/>{second}"#
        ))
        .replace("<component name=\"go\"", "<component name=\"third\" kind=\"k\"/><component name=\"go\"")
    };
    one("W0265", &sets(r#"<[[exclusive]] components="stop go"/>"#));
    none(&sets(r#"<exclusive components="go stop third"/>"#));
}

#[test]
fn a_guard_over_frozen_data_is_a_warning_where_it_waits() {
    let with = |places: &str, guard: &str| {
        mission(&format!(
            r#"<place name="b" components="go"/>{places}<transition name="in" from="a" to="b" timeout="1s"/><transition name="t" from="b" to="over" when="{guard}"/>"#
        ))
    };
    let measured = r#"<place name="m" components="stop"/><transition name="m" from="a" to="m"><inhibitor place="hold"/></transition><transition name="n" from="m" to="a" timeout="1s"/>"#;
    one("W0267", &with(measured, "[[stop.o.x]] &lt; 1"));
    let variable = format!(r#"{measured}<variable name="v" source="stop.o.x"/>"#);
    one("W0267", &with(&variable, "1 &gt; [[v]]"));
    none(&with(measured, "go.o.x &lt; 1"));
    // A component in no place is always active.
    none(&with(measured, "free.o.x &lt; 1"));
    // Active in a place that is marked together with it.
    let parallel = r#"<place name="m" initial="true" components="stop"/>"#;
    none(&with(parallel, "stop.o.x &lt; 1"));
    // Where no component works, the guard decides by the last value.
    none(
        &with(measured, "stop.o.x &lt; 1")
            .replace(r#"<place name="b" components="go"/>"#, r#"<place name="b"/>"#),
    );
    // If it is active only after the guard let the transition fire, there is no last value.
    let before = |guard: &str| {
        mission(&format!(
            r#"<place name="m" components="stop"/><transition name="t" from="a" to="m" when="{guard}"/><transition name="n" from="m" to="hold" timeout="1s"/>"#
        ))
    };
    one("W0267", &before("[[stop.o.x]] &lt; 1"));
    none(&before("free.o.x &lt; 1"));
}

#[test]
fn a_block_of_the_layout_shows_something() {
    let with = |block: &str| mission(&format!("<layout>{block}</layout>"));
    one("N0134", &with(r#"<block of="[[b]]" x="1" y="2"/>"#));
    one("N0134", &with(r#"<group><block transition="[[a]]" x="1" y="2"/></group>"#));
    one("N0134", &with(r#"<block of="a" x="[[abc]]" y="2"/>"#));
    none(&with(r#"<block of="a" x="1" y="-2.5"/><block transition="end" x="1e3" y="0"/>"#));
    none(&with(r#"<block x="a"/><other of="b" x="c"/>"#));
}

#[test]
fn one_fault_of_a_transition_is_one_finding() {
    for inner in [
        r#"<place name="b" components="go"/><transition name="in" from="a" to="b"/><transition name="t" [[frm]]="b" to="over" on="go.done"/>"#,
        r#"<place name="b" components="go"/><transition name="in" from="a" to="b"/><transition name="t" [[form]]="b" to="over" on="go.done"/>"#,
    ] {
        one("E0016", &mission(inner));
    }
    // `go` could report in `b`: that the transition does not start there is the finding.
    one(
        "W0261",
        &mission(
            r#"<place name="b" components="go"/><transition name="in" from="a" to="b"/><transition name="[[t]]" to="over" on="go.done"/>"#,
        ),
    );
}
