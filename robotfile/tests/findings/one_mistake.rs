//! One mistake is one finding: it brings no follow-ups, and hides no other mistake.

use super::follow_ups::{END, LATE, kinds, only, robot};
use super::{all_of, found_in, mission, one, reading, system};

#[test]
fn tags_that_do_not_match_hide_nothing_else() {
    let file = |first: &str, second: &str| {
        system(&format!(
            r#"{first}<component name="b" kind="k" rate="x"/><link from="a.x" to="c.y"/>{second}"#
        ))
    };
    let a = r#"<component name="a" kind="k">"#;
    // Without the mistake: a bad rate and an unknown component.
    assert_eq!(all_of(&file(&format!("{a}</component>"), "")), ["E0019", "E0103"]);
    assert_eq!(all_of(&file(a, "")), ["E0012", "E0019", "E0103"]);
    assert_eq!(all_of(&file(&format!("{a}</component>"), "</clock>")), ["E0019", "E0103", "E0012"]);
    let mission = r#"<mission safe="h"><place name="h" initial="true"><transition name="t" from="h" to="g"/></mission>"#;
    let both = format!("<armor version=\"1\"><system>{a}</component>{mission}</armor>");
    assert_eq!(all_of(&both), ["E0012", "E0012", "E0203"]);
}

#[test]
fn a_misspelt_end_tag_is_one_mistake() {
    let file =
        r#"<armor version="1"><system><component name="a" kind="k"></componet></system></armor>"#;
    assert_eq!(all_of(file), ["E0012"]);
    let misspelt = r#"<armor version="1"><system><component name="a" kind="k"/></systm></armor>"#;
    assert_eq!(all_of(misspelt), ["E0012"]);
}

#[test]
fn a_malformed_tag_brings_no_follow_up() {
    // The component is not understood, so whether links lead to it is not known.
    let file = r#"<component name="a" kind=k/><component name="b" kind="k" rate="x"/><link from="a.x" to="b.y"/><link from="a.x" to="b.y"/>"#;
    assert_eq!(all_of(&system(file)), ["E0004", "E0019", "E0104"]);
    let cut = r#"<armor version="1"><system><component name="b" kind="k" rate="x"/><link from="a.x" to="b"#;
    assert_eq!(all_of(cut), ["E0019", "E0004"]);
}

#[test]
fn one_mistake_about_a_component_is_one_finding() {
    let with = |component: &str| {
        format!(
            "<armor version=\"1\"><system>{component}<component name=\"b\" kind=\"k\"/>\
             <link from=\"arm.x\" to=\"b.in\"/><link from=\"b.y\" to=\"arm.z\"/></system>\
             <mission safe=\"p\"><place name=\"p\" initial=\"true\" components=\"arm\">\
             <parameter component=\"arm\" name=\"n\" value=\"1\"/></place></mission></armor>"
        )
    };
    for (code, component) in [
        ("E0015", r#"<componnet name="arm" kind="k"/>"#),
        ("E0015", r#"<Component name="arm" kind="k"/>"#),
        ("E0016", r#"<component nmae="arm" kind="k"/>"#),
        ("E0017", r#"<component kind="k"/>"#),
        ("E0017", r#"<component name="arm"/>"#),
        ("E0018", r#"<component name="arm " kind="k"/>"#),
        ("E0018", r#"<component name="arm" kind="k "/>"#),
        ("E0101", r#"<component name="arm" kind="k"/><component name="arm" kind="j"/>"#),
        ("E0103", ""),
    ] {
        let (codes, shown) = found_in(&with(component));
        assert_eq!(codes, [code], "{component}\n{shown}");
        assert_eq!(code == "E0103", shown.contains("it is also named in 3 more places"), "{shown}");
    }
    let reserved = with(r#"<component name="executive" kind="k"/>"#)
        .replace("arm.", "executive.")
        .replace("\"arm\"", "\"executive\"");
    assert_eq!(found_in(&reserved).0, ["E0115"]);
    // A use of the name that was meant, and a use of the malformed one, are the same mistake.
    let malformed = r#"<component name="2arm" kind="k"/>"#;
    let (codes, shown) = found_in(&with(malformed).replace("arm.", "2arm."));
    assert_eq!(codes, ["E0018"], "{shown}");
}

#[test]
fn a_malformed_name_is_one_finding() {
    one(
        "E0018",
        &system(
            r#"<component name="[[dri ver]]" kind="k"/><component name="b" kind="k"/><link from="b.x" to="driver.y"/>"#,
        ),
    );
    one(
        "E0018",
        &mission(
            r#"<place name="[[rou nds]]"/><transition name="in" from="a" to="rounds"/><transition name="out" from="rounds" to="over" on="go.done"/><place name="c" components="go"/><transition name="d" from="rounds" to="c" timeout="5s"/>"#,
        ),
    );
}

#[test]
fn one_mistake_in_a_mission_is_one_finding() {
    let mission = |inner: &str| {
        format!(
            "<armor version=\"1\"><system><component name=\"go\" kind=\"k\"/>\
             <component name=\"stop\" kind=\"k\"/></system><mission goal=\"over\" safe=\"hold\">{inner}<place name=\"over\"/>\
             <place name=\"hold\"/></mission></armor>"
        )
    };
    let place = r#"<place name="a" initial="true" components="go"/><place name="b"/>"#;
    let ab = r#"<transition name="t" from="a" to="b" timeout="5s"/>"#;
    for (code, inner) in [
        ("E0019", r#"<place name="a" initial="yes"/>"#.to_owned()),
        ("E0019", r#"<place name="a" initial="true" components="go,stop"/>"#.to_owned()),
        ("E0019", format!("{place}{ab}<transition name=\"u\" from=\"a\" to=\"hold\" on=\"go\"/>")),
        (
            "E0230",
            format!("{place}{ab}<transition name=\"u\" from=\"a\" to=\"hold\" when=\"1 1\"/>"),
        ),
        (
            "E0230",
            format!("{place}<transition name=\"u\" from=\"a\" to=\"hold\" when=\"1 1\"/>{ab}"),
        ),
        (
            "E0009",
            format!("{place}{ab}<transition name=\"u\" from=\"a\" to=\"hold\" when=\"1 & 1\"/>"),
        ),
        ("E0015", format!("{place}{}", ab.replace("transition", "transtion"))),
        ("E0203", format!("{place}{}", ab.replace("\"b\"", "\"bb\""))),
        ("W0212", place.to_owned()),
    ] {
        let (codes, shown) = found_in(&mission(&inner));
        assert_eq!(codes, [code], "{inner}\n{shown}");
    }
    // That the goal can never be reached is a finding of the proof.
    let goal =
        mission(place).replace("goal=\"over\"", "goal=\"b\"").replace("<place name=\"over\"/>", "");
    assert_eq!(found_in(&goal).0, [""; 0]);
}

#[test]
fn one_mistake_in_the_file_is_one_finding() {
    let (codes, shown) = found_in("<armor version=\"1\"><System/></armor>");
    assert_eq!(codes, ["E0015"], "{shown}");
    assert!(shown.contains("did you mean system?"), "{shown}");
    one(
        "E0010",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="[[&#0;]]"/></component>"#,
        ),
    );
    let conflict = "<armor version=\"1\">\n<system>\n[[<<<<<<<]] HEAD\n<component name=\"a\" kind=\"k\"/>\n\
                    =======\n<component name=\"a\" kind=\"j\"/>\n>>>>>>> other\n</system></armor>";
    one("E0004", conflict);
}

#[test]
fn both_ends_of_a_link_without_ports_are_one_finding() {
    let components = r#"<component name="a" kind="k"/><component name="b" kind="k"/>"#;
    assert_eq!(all_of(&system(&format!(r#"{components}<link from="a" to="b"/>"#))), ["E0019"]);
    let two = format!(r#"{components}<link from="a" to="b.x"/>{}<link from="b.y" to="a"/>"#, "\n");
    assert_eq!(all_of(&system(&two)), ["E0019", "E0019"]);
}

#[test]
fn a_period_that_is_too_long_is_one_finding() {
    let file = mission(
        r#"<place name="b"/><transition name="t" from="a" to="b" timeout="2s"/><transition name="u" from="b" to="hold" timeout="3s"/>"#,
    );
    let file = file.replace(r#"safe="hold""#, r#"safe="hold" period="10s""#);
    let (codes, shown) = found_in(&file);
    assert_eq!(codes, ["W0220"], "{shown}");
    assert!(shown.contains("3s is shorter than"), "{shown}");
}

#[test]
fn a_value_that_fits_no_use_is_one_finding() {
    let file = mission(
        r#"<variable name="v" min="0" max="100"/><transition name="t" from="a" to="hold" on="go.failed" when="v &lt; 30%"><set variable="v" value="1"/></transition><transition name="u" from="a" to="over" on="go.done" when="v &lt; 30%"/>"#,
    );
    let (codes, shown) = found_in(&file);
    assert_eq!(codes, ["E0234"], "{shown}");
}

#[test]
fn a_component_that_is_active_in_one_place_only_is_one_finding() {
    let with = |place: &str| {
        mission(&format!(
            r#"<place name="b" components="go"/><place name="c" components="go"/><place name="m" {place}/><transition name="m" from="a" to="m" timeout="2s"/><transition name="in" from="m" to="b" timeout="1s"/><transition name="t" from="b" to="c" when="stop.o.x &lt; 1"/><transition name="u" from="c" to="over" when="stop.o.x &gt; 1"/>"#
        ))
    };
    let (codes, shown) = found_in(&with(r#"components="stop""#));
    assert_eq!(codes, ["W0267"], "{shown}");
    assert_eq!(shown.matches("but stop is frozen while").count(), 2, "{shown}");
}

#[test]
fn a_name_of_another_thing_is_recognized() {
    let text = |file: &str| found_in(file).1;
    let two = r#"<component name="a" kind="laser"/><component name="b" kind="k"/>"#;
    let of_kind = text(&system(&format!(r#"{two}<link from="laser.x" to="b.y"/>"#)));
    assert!(of_kind.contains("laser is the kind of a: did you mean a?"), "{of_kind}");
    let two = r#"<component name="a" kind="k"/><component name="b" kind="k"/>"#;
    let of_two = text(&system(&format!(r#"{two}<link from="k.x" to="b.y"/>"#)));
    assert!(of_two.contains("add it, or name one of"), "{of_two}");
    let place = text(&mission("<check>never active(hold)</check>"));
    assert!(place.contains("hold is a place: write hold, without active"), "{place}");
}

#[test]
fn what_a_misspelt_element_declares_is_not_missing() {
    let declared = r#"<variable name="n" min="0" max="2"/><transition name="t" from="a" to="hold" on="go.done" when="n &lt; 2"><set variable="n" value="n + 1"/></transition>"#;
    for (right, wrong) in
        [("<variable ", "<var "), ("<variable ", "<varaible "), ("<set ", "<assign ")]
    {
        let (codes, shown) = found_in(&mission(&declared.replace(right, wrong)));
        assert_eq!(codes, ["E0015"], "{shown}");
        let meant = right.trim_matches(['<', ' ']);
        assert!(shown.contains(&format!("did you mean {meant}?")), "{shown}");
    }
    for wrong in ["<cheque>never over and hold</check>", "<chek>never over and hold</chek>"] {
        let (codes, shown) = found_in(&mission(wrong));
        assert_eq!(codes, ["E0015"], "{shown}");
        assert!(shown.contains("did you mean check?"), "{shown}");
    }
    let place = r#"<state name="b" components="stop"/><transition name="t" from="a" to="b" timeout="5s"/><transition name="u" from="b" to="hold" on="stop.done"/>"#;
    assert_eq!(found_in(&mission(place)).0, ["E0015"]);
}

#[test]
fn a_link_or_a_component_under_another_name_is_one_finding() {
    let file = |component: &str, link: &str| {
        system(&format!(
            r#"<component name="a" kind="k"/><{component} name="b" kind="k"/><{link} from="a.x" to="b.y"/>"#
        ))
    };
    assert_eq!(found_in(&file("component", "link")).0, [""; 0]);
    for link in ["connect", "conect", "connection", "Link"] {
        let (codes, shown) = found_in(&file("component", link));
        assert_eq!(codes, ["E0015"], "{shown}");
        assert!(shown.contains("did you mean link?"), "{shown}");
    }
    let (codes, shown) = found_in(&file("node", "link"));
    assert_eq!(codes, ["E0015"], "{shown}");
    assert!(shown.contains("did you mean component?"), "{shown}");
    // The mistakes of other elements are reported still.
    assert_eq!(found_in(&file("component", "connect").replace("b.y", "c.y")).0, ["E0015", "E0103"]);
    assert_eq!(found_in(&system(r#"<connect out="a.x" in="b.y"/>"#)).0, ["E0015"]);
}

#[test]
fn an_attribute_under_another_name_is_one_finding() {
    let text = |file: &str| {
        let (codes, shown) = found_in(file);
        assert_eq!(codes, ["E0016"], "{shown}");
        shown
    };
    let rate = text(&system(r#"<component name="a" kind="k" frequency="5Hz"/>"#));
    assert!(rate.contains("did you mean rate?"), "{rate}");
    let kind = text(&system(r#"<component name="a" type="k"/>"#));
    assert!(kind.contains("did you mean kind?"), "{kind}");
    let speed =
        text(&system(r#"<component name="a" kind="k"><parameter speed="0.5m/s"/></component>"#));
    assert!(speed.contains(r#"did you mean name="speed" value="0.5m/s"?"#), "{speed}");
    let place = text(&mission(
        r#"<place name="b" components="go"><parameter component="go" speed="1m/s"/></place><transition name="t" from="a" to="b" timeout="5s"/><transition name="u" from="b" to="hold" on="go.done"/>"#,
    ));
    assert!(place.contains(r#"did you mean name="speed" value="1m/s"?"#), "{place}");
}

/// A mission in which `go` works, then `stop`; `{}` are its places and elements.
fn two_steps(of_b: &str, content: &str) -> String {
    mission(&format!(
        r#"<place name="b" {of_b}</place><place name="c" components="stop"/><transition name="in" from="a" to="b" timeout="5s"/><transition name="next" from="b" to="c" on="go.done"/><transition name="late" from="b" to="hold" timeout="9s"/><transition name="out" from="c" to="over" on="stop.done"/><transition name="stuck" from="c" to="hold" timeout="9s"/>{content}"#
    ))
}

/// The file has only this finding, which shows the text.
fn only_shown(code: &str, text: &str, file: &str) {
    let (codes, shown) = found_in(file);
    assert_eq!(codes, [code], "{file}\n{shown}");
    assert!(shown.contains(text), "{text}\n{shown}");
}

#[test]
fn the_components_that_a_place_lost_are_one_finding() {
    let given = r#"><parameter component="go" name="p" value="1"/>"#;
    assert_eq!(found_in(&two_steps(&format!(r#"components="go"{given}"#), "")).0, [""; 0]);
    let add = "add go to the components of b";
    only_shown("E0209", add, &two_steps(given, ""));
    // It is the only place of the other component, too.
    let both = format!(r#"{given}<parameter component="stop" name="p" value="1"/>"#);
    only_shown("E0209", "add go and stop to the components of b", &two_steps(&both, ""));
    let other = two_steps(r#"><parameter component="stop" name="p" value="1"/>"#, "");
    let elsewhere = r#"<place name="d" components="go"/><transition name="t" from="a" to="d" operator="true"/><transition name="u" from="d" to="over" on="go.done"/></mission>"#;
    let other = other.replace("</mission>", elsewhere);
    only_shown("E0209", "add stop and go to the components of b", &other);
    let exclusive = r#"<exclusive components="go stop"/>"#;
    let right = two_steps(r#"components="go" on-failure="c">"#, exclusive);
    assert_eq!(found_in(&right).0, [""; 0]);
    let lost = right.replace(r#"components="go" on-failure="c""#, r#"on-failure="c""#);
    let lost = lost.replace(r#"on="go.done""#, r#"operator="true""#);
    only_shown("E0207", "did you mean components=\"go\" in b?", &lost);
}

#[test]
fn a_place_that_a_list_has_twice_is_one_finding() {
    one(
        "E0208",
        &mission(
            r#"<place name="b"/><transition name="in" from="a" to="b" timeout="5s"/><transition name="t" from="b [[b]]" to="over" timeout="5s"/>"#,
        ),
    );
}

#[test]
fn a_misspelt_safe_place_is_one_finding() {
    let exits = r#"<transition name="crash" to="hold" when="free.state.broken" class="safety"/><transition name="panic" to="hold" operator="true" class="safety"/>"#;
    assert_eq!(found_in(&mission(exits)).0, [""; 0]);
    one("E0203", &mission(exits).replace("safe=\"hold\"", "safe=\"[[holt]]\""));
}

#[test]
fn a_domain_that_is_too_small_is_one_finding() {
    let file = |maximum: &str| {
        two_steps(
            r#"components="go">"#,
            &format!(
                r#"<variable name="n" min="0" max="{maximum}"/><transition name="again" from="b" to="b" on="go.failed" when="n &lt; 2"><set variable="n" value="3"/></transition><check>always n &lt;= 3</check>"#
            ),
        )
    };
    assert_eq!(found_in(&file("3")).0, [""; 0]);
    only_shown("E0238", "this comparison with 3 is always true", &file("2"));
    // A comparison that is never true is another mistake, unless it is with the same value.
    let never = |value: &str| file("2").replace("n &lt;= 3", &format!("n == {value}"));
    assert_eq!(found_in(&never("5")).0, ["E0238", "W0236"]);
    only_shown("E0238", "widen the domain of n", &never("3"));
}

#[test]
fn a_variable_that_begins_outside_of_its_domain_is_one_finding() {
    let file = |least: &str| {
        two_steps(
            r#"components="go">"#,
            &format!(
                r#"<variable name="n" min="{least}" max="2" initial="0"/><transition name="again" from="b" to="b" on="go.failed" when="n &lt; 1"><set variable="n" value="n + 1"/></transition>"#
            ),
        )
    };
    assert_eq!(found_in(&file("0")).0, [""; 0]);
    only_shown("E0019", "write a value from 1 to 2, or widen", &file("1"));
}

#[test]
fn two_variables_of_one_name_are_one_finding() {
    let file = |name: &str| {
        two_steps(
            r#"components="go">"#,
            &format!(
                r#"<variable name="n" min="0" max="2"/><variable name="{name}" min="0" max="1"/><transition name="again" from="b" to="b" on="go.failed" when="n &lt; 1 or m &lt; 1"><set variable="n" value="2"/><set variable="m" value="1"/></transition>"#
            ),
        )
    };
    assert_eq!(found_in(&file("m")).0, [""; 0]);
    let twice =
        file("n").replace(" or m &lt; 1", "").replace(r#"<set variable="m" value="1"/>"#, "");
    only_shown("E0210", "a second variable called n", &twice);
}

#[test]
fn an_emergency_to_a_misspelt_place_is_one_finding() {
    let panic = r#"<transition name="panic" to="[[holt]]" operator="true" class="safety"/>"#;
    one("E0203", &mission(panic));
}

#[test]
fn a_variable_in_the_system_is_one_finding() {
    let guarded = r#"<transition name="weak" from="a" to="hold" when="level &lt; 2"/>"#;
    let variable = r#"<variable name="level" source="free.state.level"/>"#;
    assert_eq!(found_in(&mission(&format!("{variable}{guarded}"))).0, [""; 0]);
    let moved = mission(guarded).replace("</system>", &format!("{variable}</system>"));
    only_shown("E0015", "write it directly in <mission>", &moved);
    let other = moved.replace("when=\"level", "when=\"lever");
    assert_eq!(found_in(&other).0, ["E0015", "E0231"]);
}

#[test]
fn a_report_in_place_of_a_guard_is_one_finding() {
    let file = |condition: &str| {
        robot(
            r#"safe="hold""#,
            &format!(
                r#"<variable name="level" source="power.state.level"/>{END}{LATE}<transition name="weak" from="a" to="hold" {condition}/>"#
            ),
        )
    };
    only("E0225", "did you mean empty?", &file(r#"on="go.empyt""#));
    only("W0237", "no guard uses level", &file(r#"on="go.failed""#));
}

#[test]
fn a_component_that_gets_the_name_of_another_is_one_finding() {
    let file = |name: &str| {
        system(&format!(
            r#"<component name="laser" kind="laser"/><component name="{name}" kind="arm"/><component name="mapper" kind="mapper"/><link from="laser.scan" to="mapper.scan"/>"#
        ))
    };
    let (reading, _) = reading(&file("mapper"), Some(&kinds()));
    let found = reading.findings.without_notes();
    let codes: Vec<_> = found.iter().map(|it| it.code.as_str()).collect();
    assert_eq!(codes, ["E0101"], "{}", found.render(armor_robotfile::Colours::No));
}
