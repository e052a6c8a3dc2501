//! Edits change their lines and no others, and what they write reads as it was meant.

use std::path::Path;

use armor_robotfile::{Document, EditError, Item, NewElement, Position};

/// A document of this text.
fn open(text: &str) -> Document {
    Document::open(Path::new("a.xml"), text.as_bytes()).unwrap()
}

fn text(document: &Document) -> &str {
    std::str::from_utf8(document.bytes()).unwrap()
}

/// `edit` makes `after` of `before`.
fn check(
    before: &str,
    edit: impl FnOnce(&mut Document) -> Result<(), EditError>,
    after: &str,
) -> Document {
    let mut document = open(before);
    edit(&mut document).unwrap();
    assert_eq!(text(&document), after);
    document
}

#[test]
fn a_parameter_is_set_added_and_removed_in_its_line() {
    let before = "<armor version='1'>\r\n\t<system>\r\n\t\t<!-- why -->\r\n\t\t<component name='a' kind='k'/> <!-- here -->\r\n\t</system>\r\n</armor>\r\n";
    let with = before.replace(
        "kind='k'/> <!--",
        "kind='k'>\r\n\t\t\t<parameter name=\"speed\" value=\"1m/s\"/>\r\n\t\t</component> <!--",
    );
    let mut document = check(before, |d| d.set_parameter("a", "speed", Some("1m/s")), &with);
    document.set_parameter("a", "speed", Some("1m/s")).unwrap();
    assert_eq!(text(&document), with);
    let other = with.replace("1m/s", "a&lt;b &amp; &quot;c&quot;&#10;'d'");
    document.set_parameter("a", "speed", Some("a<b & \"c\"\n'd'")).unwrap();
    assert_eq!(text(&document), other);
    document.set_parameter("a", "speed", None).unwrap();
    assert_eq!(text(&document), before);
}

#[test]
fn a_comment_stands_above_its_new_element() {
    let new = NewElement::new("x").comment("why -- <a> --->").comment("line\nbreak");
    let child = NewElement::new("y").child(NewElement::new("z").comment("inner"));
    check(
        "<a>\n  <b/>\n</a>",
        |d| d.insert_elements(&[], 1, &[new, child]),
        "<a>\n  <b/>\n  <!-- why - - <a> - - -> -->\n  <!-- line break -->\n  <x/>\n  <y>\n    \
         <!-- inner -->\n    <z/>\n  </y>\n</a>",
    );
    // On one line there is no place for a line of its own.
    let mut document = open("<a><b/></a>");
    document.insert_element(&[], 1, &NewElement::new("x").comment("-")).unwrap();
    assert_eq!(text(&document), "<a><b/><!-- - --><x/></a>");
}

#[test]
fn an_element_is_put_where_its_neighbours_are() {
    let new = || NewElement::new("x").attribute("n", "1");
    for (before, index, after) in [
        ("<a/>", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a />", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a></a>", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a>\n</a>", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a>\n   <!-- c -->\n</a>", 0, "<a>\n   <!-- c -->\n   <x n=\"1\"/>\n</a>"),
        ("<a>\n <b/> <!-- c -->\n</a>", 1, "<a>\n <b/> <!-- c -->\n <x n=\"1\"/>\n</a>"),
        (
            "<a> <!-- of a -->\n <!-- of b -->\n <b/>\n</a>",
            0,
            "<a> <!-- of a -->\n <x n=\"1\"/>\n <!-- of b -->\n <b/>\n</a>",
        ),
        (
            "<a>\n <b/>\n\n <!-- of c -->\n <c/>\n</a>",
            1,
            "<a>\n <b/>\n <x n=\"1\"/>\n\n <!-- of c -->\n <c/>\n</a>",
        ),
        ("<a><b/><c/></a>", 1, "<a><b/><x n=\"1\"/><c/></a>"),
        ("<a> <b/> <c/> </a>", 2, "<a> <b/> <c/> <x n=\"1\"/> </a>"),
        ("<a> <b/> <c/> </a>", 0, "<a> <x n=\"1\"/> <b/> <c/> </a>"),
        ("\u{feff}<a/>", 0, "\u{feff}<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a>text</a>", 0, "<a>text<x n=\"1\"/></a>"),
    ] {
        check(before, |d| d.insert_element(&[], index, &new()), after);
    }
}

#[test]
fn missing_items_are_reported() {
    let mut document = open("<armor version=\"1\"><system/></armor>");
    let error = document.set_parameter("laser", "x", Some("1")).unwrap_err();
    assert_eq!(error.to_string(), "there is no component laser in a.xml");
    assert!(document.find(Item::Mission).is_none());
}

/// A robot and its mission, in an odd form.
const ROVER: &str = r#"<?xml version='1.0'?>
<!-- of a person -->
<armor version="1" xmlns:my="urn:my">

	<system name='rover'>
		<clock source="sim.time"/>
		<component name="sim" kind='simulator' my:colour="red"/><!-- the world -->
		<component   name="slam"
		             kind="mapper"/>

		<link from="sim.scan" to="slam.scan"/>
		<!-- slow -->
		<link from="slam.map" to="sim.map" keep="all"/>
	</system>
	<mission goal="home" safe="home">
		<variable name="sim" source="slam.quality"/>
		<place name="explore" initial="true" components="sim  slam">
			<parameter component="slam" name="area" value="north"/>
		</place>
		<place name="home" on-failure="home"/>
		<exclusive components="slam sim"/>
		<transition name="t" from="explore" to="home" on="slam.done" when="sim &lt; 3 and sim.x&gt;slam.y"/>
		<transition name="home" from="home"><arc to="explore" weight="2"/></transition>
		<check>always reachable(home) &amp;&amp; not home.x</check>
	</mission>
</armor>
"#;

fn rover(
    edit: impl FnOnce(&mut Document) -> Result<(), EditError>,
    changes: &[(&str, &str)],
) -> Document {
    let mut after = ROVER.to_owned();
    for (old, new) in changes {
        assert_eq!(after.matches(old).count(), 1, "{old}");
        after = after.replace(old, new);
    }
    check(ROVER, edit, &after)
}

#[test]
fn a_component_is_renamed_wherever_it_is_meant() {
    let back = |mut document: Document, renamed, old| {
        document.rename(renamed, old).unwrap();
        assert_eq!(text(&document), ROVER);
    };
    let changes = [
        (r#"source="sim.time""#, r#"source="world.time""#),
        (r#"component name="sim""#, r#"component name="world""#),
        (r#"from="sim.scan""#, r#"from="world.scan""#),
        (r#"to="sim.map""#, r#"to="world.map""#),
        ("sim  slam", "world  slam"),
        ("slam sim", "slam world"),
        // The variable of the same name is not the component.
        ("and sim.x", "and world.x"),
    ];
    let document = rover(|d| d.rename(Item::Component("sim"), "world"), &changes);
    back(document, Item::Component("world"), "sim");

    let changes = [
        (r#"goal="home""#, r#"goal="base""#),
        (r#"safe="home""#, r#"safe="base""#),
        (r#"place name="home" on-failure="home""#, r#"place name="base" on-failure="base""#),
        (r#"to="home""#, r#"to="base""#),
        (r#""home"><arc"#, r#""base"><arc"#),
        ("reachable(home)", "reachable(base)"),
    ];
    let document = rover(|d| d.rename(Item::Place("home"), "base"), &changes);
    back(document, Item::Place("base"), "home");

    let changes = [(r#"variable name="sim""#, r#"variable name="x""#), ("\"sim &lt;", "\"x &lt;")];
    let document = rover(|d| d.rename(Item::Variable("sim"), "x"), &changes);
    back(document, Item::Variable("x"), "sim");

    let changes = [(r#"transition name="home""#, r#"transition name="x""#)];
    let document =
        rover(|d| d.set_attribute(Item::Transition("home"), "name", Some("x")), &changes);
    back(document, Item::Transition("x"), "home");
}

#[test]
fn a_component_is_removed_with_everything_that_needs_it() {
    let mut document = open(ROVER);
    let error = document.remove(Item::Component("slam")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "component slam is still named at a.xml:16:32 (slam.quality), at a.xml:22:53 (slam.done), \
         at a.xml:22:70 (sim &lt; 3 and sim.x&gt;slam.y)"
    );
    assert_eq!(text(&document), ROVER);
    document.set_attribute(Item::Variable("sim"), "source", None).unwrap();
    document.remove(Item::Transition("t")).unwrap();
    document.remove(Item::Component("slam")).unwrap();
    let after = text(&document);
    assert!(!after.contains("slam") && !after.contains("exclusive"), "{after}");
    assert!(
        after.contains("<place name=\"explore\" initial=\"true\" components=\"sim\"/>\n"),
        "{after}"
    );
    assert!(after.contains("<!-- slow -->") && after.contains("<!-- the world -->"));
    let message = document.remove(Item::Place("home")).unwrap_err().to_string();
    assert!(message.contains("still named at a.xml:11:17 (home)"), "{message}");
}

#[test]
fn new_elements_follow_the_last_of_their_kind() {
    rover(
        |d| d.add(Item::Component("arm"), &[("kind", "arm"), ("rate", "5Hz")]),
        &[(
            "kind=\"mapper\"/>\n",
            "kind=\"mapper\"/>\n\t\t<component name=\"arm\" kind=\"arm\" rate=\"5Hz\"/>\n",
        )],
    );
    rover(
        |d| d.add(Item::Link { from: "sim.odometry", to: "slam.odometry" }, &[("keep", "50")]),
        &[(
            "keep=\"all\"/>\n",
            "keep=\"all\"/>\n\t\t<link from=\"sim.odometry\" to=\"slam.odometry\" keep=\"50\"/>\n",
        )],
    );
    rover(
        |d| d.add(Item::Place("dock"), &[("components", "sim")]),
        &[(
            "on-failure=\"home\"/>\n",
            "on-failure=\"home\"/>\n\t\t<place name=\"dock\" components=\"sim\"/>\n",
        )],
    );
    let mut whole = open("<armor version=\"1\"/>\n");
    whole.add(Item::Mission, &[("safe", "a")]).unwrap();
    whole.add(Item::Transition("t"), &[("from", "a")]).unwrap();
    whole.add(Item::Place("a"), &[]).unwrap();
    whole.add(Item::System, &[]).unwrap();
    whole.add(Item::Component("c"), &[("kind", "k")]).unwrap();
    whole.set_place_parameter("a", "c", "p", Some("1")).unwrap();
    assert_eq!(
        text(&whole),
        r#"<armor version="1">
  <system>
    <component name="c" kind="k"/>
  </system>
  <mission safe="a">
    <place name="a">
      <parameter component="c" name="p" value="1"/>
    </place>
    <transition name="t" from="a"/>
  </mission>
</armor>
"#
    );
}

#[test]
fn an_input_takes_a_link_from_each_output_once() {
    let mut document = open(ROVER);
    let (one, other) = ("sim.scan", "slam.map");
    let link = |from, to| Item::Link { from, to };
    let mut set = |from, name, value| {
        let changed = document.set_attribute(link(from, "sim.map"), name, Some(value));
        changed.map_err(|error| error.to_string())
    };
    let known = |error: Result<(), String>| error.is_err_and(|it| it.contains("exists already"));
    assert!(set(one, "keep", "2").is_err(), "there is no such link yet");
    set(other, "to", "sim.map").expect("nothing changes");
    document.add(link(one, "sim.map"), &[]).expect("the input may take several");
    let mut set = |from, name, value| {
        let changed = document.set_attribute(link(from, "sim.map"), name, Some(value));
        changed.map_err(|error| error.to_string())
    };
    assert!(known(set(one, "to", "slam.scan")));
    assert!(known(set(other, "from", one)));
    set(one, "keep", "2").expect("the second of the two");
    let expected = "<link from=\"sim.scan\" to=\"sim.map\" keep=\"2\"/>";
    assert!(text(&document).contains(expected), "{}", text(&document));
}

#[test]
fn edits_that_break_the_format_are_refused() {
    let mut document = open(ROVER);
    let link = |from, to| Item::Link { from, to };
    let refused = |result: Result<(), EditError>, part: &str| {
        let message = result.unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    refused(
        document.add(Item::Component("slam"), &[]),
        "component slam exists already, at a.xml:8:",
    );
    refused(document.add(Item::Component("a b"), &[]), "\"a b\" is not a name");
    refused(document.add(Item::Component("x"), &[("name", "y")]), "error[E0011]");
    refused(document.add(Item::Component("x"), &[("a b", "y")]), "cannot be the name");
    refused(document.add(link("sim.scan", "slam"), &[]), "two names joined by a dot");
    let twice = "link from sim.scan to slam.scan exists already";
    refused(document.add(link("sim.scan", "slam.scan"), &[]), twice);
    refused(document.add(link("laser.x", "slam.y"), &[]), "no component laser");
    refused(document.set_attribute(link("sim.scan", "slam.scan"), "to", None), "two names");
    refused(document.set_attribute(Item::Place("home"), "name", None), "is not a name");
    refused(document.rename(Item::Place("home"), "explore"), "place explore exists already");
    refused(document.rename(link("sim.scan", "slam.scan"), "x"), "cannot be renamed");
    refused(document.rename(Item::Place("nowhere"), "x"), "no place nowhere");
    refused(document.set_parameter("slam", "a b", Some("1")), "is not a name");
    refused(document.set_parameter("slam", "a", Some("\u{1}")), "U+0001");
    refused(document.set_parameter("slam", "a", Some(&"x".repeat(1 << 20))), "at most 1 MiB");
    refused(document.remove_element(&[]), "outermost");
    refused(document.remove_element(&[7]), "no element");
    refused(document.insert_element(&[0], 99, &NewElement::new("x")), "no element");
    refused(document.move_element(&[0], 2), "no element");
    refused(document.set_text_at(&[0, 0, 0], "x"), "no element");
    assert_eq!(text(&document), ROVER);
    // What was refused once may be done when nothing is in the way.
    document.set_attribute(link("sim.scan", "slam.scan"), "to", Some("slam.range")).unwrap();
}

#[test]
fn a_moved_block_is_one_line() {
    let at = |x, y| Some(Position { x, y });
    let (sim, home) = (Item::Component("sim"), Item::Place("home"));
    let mut document = open(ROVER);
    let all =
        [(sim, at(10.0, -20.5)), (home, at(1.0, 2.0)), (Item::Transition("home"), at(0.0, 0.004))];
    document.set_positions(&all).unwrap();
    let first = text(&document).to_owned();
    let blocks: Vec<_> = first.lines().filter(|line| line.contains("<block")).collect();
    assert_eq!(
        blocks,
        [
            "\t\t\t<block of=\"sim\" x=\"10\" y=\"-20.5\"/>",
            "\t\t\t<block of=\"home\" x=\"1\" y=\"2\"/>",
            "\t\t\t<block transition=\"home\" x=\"0\" y=\"0\"/>",
        ]
    );
    document.set_positions(&[(home, at(3.0, 2.0))]).unwrap();
    assert_eq!(text(&document), first.replace("x=\"1\" y=\"2\"", "x=\"3\" y=\"2\""));
    assert_eq!(document.position(home), at(3.0, 2.0));
    document.set_positions(&[(sim, None), (Item::Component("slam"), at(5.0, 5.0))]).unwrap();
    assert_eq!(document.position(sim), None);
    assert_eq!(document.position(Item::Component("slam")), at(5.0, 5.0));
    document.rename(Item::Component("slam"), "mapper").unwrap();
    assert_eq!(document.position(Item::Component("mapper")), at(5.0, 5.0));
    for bad in [f64::NAN, f64::INFINITY, 1e10] {
        assert!(document.set_positions(&[(home, at(bad, 0.0))]).is_err());
    }
    assert!(document.set_positions(&[(Item::Variable("sim"), at(0.0, 0.0))]).is_err());
}

#[test]
fn an_element_moves_with_its_comments() {
    rover(
        |d| d.move_element(&[0, 4], 3),
        &[
            ("\t\t<!-- slow -->\n\t\t<link from=\"slam.map\" to=\"sim.map\" keep=\"all\"/>\n", ""),
            (
                "kind=\"mapper\"/>\n",
                "kind=\"mapper\"/>\n\t\t<!-- slow -->\n\t\t<link from=\"slam.map\" to=\"sim.map\" keep=\"all\"/>\n",
            ),
        ],
    );
    check("<a> <b/> <c/> </a>", |d| d.move_element(&[0], 1), "<a> <c/> <b/> </a>");
    check(
        "<a>\n<b/><!-- b -->\n<c>\n</c>\n</a>",
        |d| d.move_element(&[1], 0),
        "<a>\n<c>\n</c>\n<b/><!-- b -->\n</a>",
    );
}

#[test]
fn a_component_of_another_file_is_renamed_where_it_is_named() {
    let before = r#"<armor version="1"><mission system="rover.xml"><place name="a" components="x y"/><check>active(x) and a</check></mission></armor>"#;
    let mut document = check(
        before,
        |d| d.rename(Item::Component("x"), "z"),
        &before.replace("x y", "z y").replace("(x)", "(z)"),
    );
    assert!(document.rename(Item::Component("z"), "y").is_err());
    check(before, |d| d.remove(Item::Component("y")), &before.replace("x y", "x"));
}

#[test]
fn references_cdata_and_instructions_stay_as_they_are_written() {
    let before = "<armor version=\"1\"><?keep  this?><mission><place name='h&#111;me'/><transition name='t' from=' home ' when='a &#60;b and&#x20;home.x'/><check><!-- c -->reachable(<![CDATA[home]]>)</check><check> home &lt; 1<?p?></check></mission></armor>";
    check(
        before,
        |d| d.rename(Item::Place("home"), "x"),
        &before
            .replace("'h&#111;me'", "'x'")
            .replace("' home '", "' x '")
            .replace("reachable(<![CDATA[home]]>)", "reachable(x)")
            .replace(" home &lt;", " x &lt;"),
    );
    check(
        before,
        |d| d.set_text_at(&[0, 2], "a < \"b\" ]]> c\nd"),
        &before.replace("reachable(<![CDATA[home]]>)", "a &lt; \"b\" ]]&gt; c&#10;d"),
    );
}

#[test]
fn a_new_attribute_is_written_as_the_last_one_is() {
    let set =
        |name: &'static str, value| move |d: &mut Document| d.set_attribute_at(&[], name, value);
    for (before, name, value, after) in [
        ("<a/>", "x", Some("1"), "<a x=\"1\"/>"),
        ("<a b='1' />", "x", Some("it's"), "<a b='1' x='it&apos;s' />"),
        (
            "<a b='1'\n   c = \"2\"></a>",
            "x",
            Some("\"'"),
            "<a b='1'\n   c = \"2\"\n   x=\"&quot;'\"></a>",
        ),
        ("<a b='1'\n   c = \"2\"></a>", "c", Some("3"), "<a b='1'\n   c = \"3\"></a>"),
        ("<a b='1'\n   c = \"2\"></a>", "b", None, "<a\n   c = \"2\"></a>"),
        ("<a b='1'\n   c = \"2\"></a>", "c", None, "<a b='1'></a>"),
        ("<a b='&#65;'/>", "b", Some("A"), "<a b='&#65;'/>"),
    ] {
        check(before, set(name, value), after);
    }
}

#[test]
fn several_items_are_removed_with_their_mentions() {
    let before = r#"<armor version="1">
  <system>
    <component name="a" kind="k"/>
    <component name="b" kind="k"/>
    <component name="c" kind="k"/>
    <link from="a.x" to="b.x"/>
    <link from="b.y" to="c.y"/>
    <layout>
      <block of="a" x="0" y="0"/>
      <block of="b" x="9" y="0"/>
    </layout>
  </system>
  <mission goal="p">
    <place name="p" components="a b c"/>
    <place name="q" components="a"><parameter component="a" name="n" value="1"/></place>
    <exclusive components="a b c"/>
    <transition name="t" from="p" to="q" on="a.done"/>
  </mission>
</armor>
"#;
    let mut document = open(before);
    let refused = document.remove_all(&[Item::Component("a"), Item::Component("b")]);
    assert!(refused.unwrap_err().to_string().starts_with("component a is still named at"));
    assert_eq!(document.bytes(), before.as_bytes());
    let all = [
        Item::Component("a"),
        Item::Transition("t"),
        Item::Component("b"),
        Item::Place("q"),
        Item::Link { from: "b.y", to: "c.y" },
    ];
    document.remove_all(&all).unwrap();
    let after = r#"<armor version="1">
  <system>
    <component name="c" kind="k"/>
    <layout/>
  </system>
  <mission goal="p">
    <place name="p" components="c"/>
  </mission>
</armor>
"#;
    assert_eq!(std::str::from_utf8(document.bytes()).unwrap(), after);
}

#[test]
fn a_frame_is_added_measured_renamed_and_removed() {
    let before =
        "<armor version='1'>\n <system>\n  <component name='a' kind='k'/>\n </system>\n</armor>";
    let mut document = open(before);
    document.add(Item::Frame("mast"), &[("in", "base_link"), ("z", "0.5m")]).unwrap();
    document.add(Item::Frame("laser"), &[("in", "mast")]).unwrap();
    document.set_attribute(Item::Frame("laser"), "yaw", Some("90deg")).unwrap();
    let frames = "  <frame name=\"mast\" in=\"base_link\" z=\"0.5m\"/>\n  <frame name=\"laser\" in=\"mast\" yaw=\"90deg\"/>\n";
    let with = before.replace("  <component", &format!("{frames}  <component"));
    assert_eq!(text(&document), with, "before the components");
    let taken = document.add(Item::Frame("laser"), &[("in", "base_link")]).unwrap_err();
    assert!(taken.to_string().contains("frame laser"), "{taken}");
    let needed = document.remove(Item::Frame("mast")).unwrap_err();
    assert!(needed.to_string().starts_with("frame mast is still named at a.xml:4:27"), "{needed}");
    document.rename(Item::Frame("mast"), "tower").unwrap();
    assert_eq!(text(&document), with.replace("mast", "tower"), "also where it is a parent");
    document.remove_all(&[Item::Frame("laser"), Item::Frame("tower")]).unwrap();
    assert_eq!(text(&document), before);
}

const ROUTED: &str = r#"<armor version="1">
  <mission>
    <map>
      <point name="P1" at="1 2"/>
    </map>
    <route name="red" mover="way.route">
      <leg name="l1" to="P1"/>
      <stay name="s1" for="2s"/> <!-- look around -->
      <otherwise on="late" do="hold"/>
    </route>
    <route name="blue" mover="way.route">
      <leg name="l1" to="P1"/>
    </route>
    <check>never red.l1 and blue.l1</check>
    <check>fires(red.l1.late)</check>
    <layout>
      <block of="red.l1" x="1" y="2"/>
      <block transition="red.l1.late" x="1" y="2"/>
    </layout>
  </mission>
</armor>
"#;

#[test]
fn a_leg_is_put_behind_the_last_step_or_before_another() {
    let behind = "look around -->\n      <leg name=\"l2\" to=\"P1\"/>";
    let after = ROUTED.replace("look around -->", behind);
    check(ROUTED, |d| d.add(Item::Step { route: "red", step: "l2" }, &[("to", "P1")]), &after);
    let before = "<leg name=\"l2\" to=\"P1\"/>\n      <stay";
    let after = ROUTED.replace("<stay", before);
    check(ROUTED, |d| d.add_leg("red", "l2", Some("s1"), &[("to", "P1")]), &after);
    let mut document = open(ROUTED);
    let taken = document.add_leg("red", "s1", None, &[]).unwrap_err();
    assert!(taken.to_string().starts_with("step s1 of route red exists already"), "{taken}");
    assert!(document.add_leg("green", "l2", None, &[]).is_err());
    assert!(document.add_leg("red", "l2", Some("l9"), &[]).is_err());
    assert!(document.add_leg("red", "l 2", None, &[]).is_err());
    assert_eq!(text(&document), ROUTED);
}

#[test]
fn a_step_is_renamed_with_what_is_derived_from_it_and_a_step_of_another_route_is_not() {
    let after = ROUTED.replace(
        "<leg name=\"l1\" to=\"P1\"/>\n      <stay",
        "<leg name=\"first\" to=\"P1\"/>\n      <stay",
    );
    let after = after.replace("red.l1", "red.first");
    check(ROUTED, |d| d.rename(Item::Step { route: "red", step: "l1" }, "first"), &after);
    let after = ROUTED.replace("name=\"red\"", "name=\"green\"").replace("red.l1", "green.l1");
    check(ROUTED, |d| d.rename(Item::Route("red"), "green"), &after);
    let after = ROUTED.replace("\"P1\"", "\"door\"");
    check(ROUTED, |d| d.rename(Item::MapPoint("P1"), "door"), &after);
}

#[test]
fn a_step_that_a_check_names_stays_and_another_one_goes_with_its_line() {
    let mut document = open(ROUTED);
    let error = document.remove(Item::Step { route: "red", step: "l1" }).unwrap_err();
    let EditError::StillNamed { at, .. } = &error else { panic!("{error}") };
    assert_eq!(at.len(), 2, "{error}");
    document.remove(Item::Step { route: "red", step: "s1" }).unwrap();
    assert!(!text(&document).contains("<stay"));
    let by = document.set_attribute(Item::Step { route: "blue", step: "l1" }, "by", Some("1min"));
    by.unwrap();
    assert!(text(&document).contains("<leg name=\"l1\" to=\"P1\" by=\"1min\"/>\n    </route>"));
}
