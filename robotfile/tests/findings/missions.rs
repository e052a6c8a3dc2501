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
            r#"<place name="b" components="go"/><transition name="s" from="a" to="b"/><transition name="t" from="a" on="[[go]].done"/>"#,
        ),
    );
    one("W0215", &mission(r#"<[[exclusive]] components="go"/>"#));
    one(
        "E0204",
        "<armor version=\"1\"><system/><[[mission]] safe=\"a\"><place name=\"a\"/></mission></armor>",
    );
    one(
        "W0213",
        "<armor version=\"1\"><system/><[[mission]]><place name=\"a\" initial=\"true\"/></mission></armor>",
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
    with("W0217", r#"<transition name="t" from="b"><inhibitor place="[[b]]"/></transition>"#);
    with("W0217", r#"<transition name="t"><arc from="[[b]]" weight="2"/></transition>"#);
    fine(r#"<transition name="t" from="b"><inhibitor place="a" weight="2"/></transition>"#);
    with(
        "E0216",
        r#"<place name="c" initial="true"/><transition name="t" from="c"><arc to="[[b]]" weight="2"/></transition>"#,
    );
    with("E0216", r#"<place name="[[c]]" initial="2" components="stop"/>"#);
    fine(r#"<place name="c" initial="2"/>"#);
    // Immediate before late, early before late; but not if something else must be there too.
    with("W0217", r#"<transition name="[[t]]" from="a" timeout="5s"/>"#);
    with(
        "W0217",
        r#"<transition name="s" from="b" timeout="2s"/><transition name="[[t]]" from="b" on="go.done" after="3s"/>"#,
    );
    fine(
        r#"<place name="c" initial="true"/><transition name="s" from="b c" timeout="2s"/><transition name="t" from="b" timeout="3s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" timeout="2s"/><transition name="t" from="b" timeout="3s" class="safety"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" on="go.done"/><transition name="t" from="b" timeout="3s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" timeout="2s" operator="true"/><transition name="t" from="b" timeout="3s"/>"#,
    );
    with(
        "W0217",
        r#"<transition name="[[s]]" from="b" on="go.done"/><transition name="t" from="b" on="go.done" priority="1"/>"#,
    );
    with(
        "W0218",
        r#"<transition name="s" from="b" on="go.done"/><transition name="[[t]]" from="b" on="go.done"/>"#,
    );
    with(
        "W0218",
        r#"<place name="c" initial="true"/><transition name="s" from="b c" timeout="2s"/><transition name="[[t]]" from="b" timeout="2s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" on="go.done"/><transition name="t" from="b" on="go.failed"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" when="go.o.x &lt; 1"/><transition name="t" from="b" when="go.o.x &gt; 1"/>"#,
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
    with("W0027", r#"<transition T>/><place name="c" initial="true" on-failure="[[a]]"/>"#);
    with("E0103", r#"<transition T>/><variable name="v" source="[[robot]].battery"/>"#);
    let late = |period: &str, time: &str| {
        format!(
            r#"<armor version="1"><system/><mission safe="a" period="{period}"><place name="a" initial="true"/><transition name="t" from="a" {time}/></mission></armor>"#
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
    for rest in [r#" after="1s""#, r#" timeout="1s""#, r#" on="go.done""#, r#" operator="true""#] {
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
