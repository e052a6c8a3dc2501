//! Frames: how they are written, where they are, and which components need them.

use std::path::Path;

use armor_robotfile::{Colours, Manifests, Override, check, differences, read};
use armor_wire::manifest::Manifest;

use super::{found_in, none, one, one_with, system};

fn example_kinds() -> Manifests {
    let kinds: Vec<Manifest> = serde_json::from_str(include_str!("../example_kinds.json")).unwrap();
    kinds.into_iter().map(|kind| (kind.kind.clone(), kind)).collect()
}

/// A laser and a mapper that needs the frame `laser`, with `frames` before them.
fn mapped(frames: &str, parameters: &str) -> String {
    system(&format!(
        r#"{frames}<component name="l" kind="laser"/><component name="m" kind="mounted-mapper">{parameters}</component><link from="l.scan" to="m.scan"/>"#
    ))
}

#[test]
fn a_frame_is_a_name_a_parent_lengths_and_angles() {
    let with = |frame: &str| system(&format!(r#"{frame}<component name="a" kind="k"/>"#));
    none(&with(r#"<frame name="f" in="base_link" x="80mm" y="-1cm" z=".3m" roll="180deg"/>"#));
    none(&with(r#"<frame name="f" in="odom" pitch="0.1rad" yaw="-90deg"/>"#));
    one("E0017", &with(r#"<[[frame]] name="f" x="1m"/>"#));
    one("E0017", &with(r#"<[[frame]] in="f" x="1m"/>"#));
    one("E0018", &with(r#"<frame name="[[f#2]]" in="map" x="1m"/>"#));
    one("E0016", &with(r#"<frame name="f" in="map" [[theta]]="1rad"/>"#));
    for (attribute, help) in [
        (r#"x="[[0.08]]""#, "it has no unit: write 0.08m"),
        (r#"x="[[8deg]]""#, "it is an angle; a length such as 0.3m is expected"),
        (r#"yaw="[[90]]""#, "it has no unit: write 90deg"),
        (r#"yaw="[[90rad]]""#, "it is 14.3 full turns: write one at most, such as 90deg"),
        (r#"yaw="[[1m]]""#, "it is a length; an angle such as 90deg is expected"),
        (r#"z="[[high]]""#, "a length such as 0.3m is expected"),
        (r#"z="[[infm]]""#, "a length such as 0.3m is expected"),
    ] {
        let file = with(&format!(r#"<frame name="f" in="map" {attribute}/>"#));
        one("E0019", &file);
        let (_, shown) = found_in(&file.replace("[[", "").replace("]]", ""));
        assert!(shown.contains(help), "{shown} instead of {help}");
    }
}

#[test]
fn frames_form_a_tree_of_what_does_not_move() {
    let with = |code: &str, frames: &str| {
        one(code, &system(&format!(r#"{frames}<component name="a" kind="k"/>"#)));
    };
    with("E0144", r#"<frame name="f" in="map"/><frame name="[[f]]" in="odom"/>"#);
    with("E0145", r#"<frame name="f" in="[[f]]"/>"#);
    with(
        "E0145",
        r#"<frame name="f" in="[[g]]"/><frame name="h" in="f"/><frame name="g" in="f"/>"#,
    );
    with("E0148", r#"<frame name="[[odom]]" in="map"/>"#);
}

#[test]
fn a_frame_that_a_component_needs_is_placed_on_the_robot() {
    let kinds = example_kinds();
    let with = |code: &str, frames: &str, parameters: &str| {
        one_with(code, &mapped(frames, parameters), Some(&kinds));
    };
    let fine = |frames: &str, parameters: &str| {
        let reading = read(Path::new("a.xml"), &mut |_| Ok(mapped(frames, parameters).into()));
        let reading = check(reading, &[], Some(&kinds));
        assert!(reading.findings.is_empty(), "{}", reading.findings.render(Colours::No));
    };
    let named = r#"<parameter name="laser_frame" value="front"/>"#;
    fine(r#"<frame name="laser" in="base_link" x="1m"/>"#, "");
    fine(r#"<frame name="front" in="mast"/><frame name="mast" in="base_link"/>"#, named);
    with("E0146", r#"<frame name="laser" in="map"/>"#, "");
    with("E0146", r#"<frame name="laser" in="base_link"/>"#, &named.replace("front", "[[front]]"));
    with(
        "E0112",
        r#"<frame name="laser" in="base_link"/>"#,
        r#"<parameter name="laser_frame" value="[[the laser]]"/>"#,
    );
    with(
        "W0147",
        r#"<frame name="laser" in="base_link"/><frame name="camera" in="[[gripper]]"/>"#,
        "",
    );
    with(
        "E0112",
        r#"<frame name="laser" in="base_link"/>"#,
        r#"<parameter name="frames" value="[[laser,base_link,0,0,0,0,0,0]]"/>"#,
    );
    let unlinked = r#"<component name="m" kind="mounted-mapper"/>"#;
    let reading = read(Path::new("a.xml"), &mut |_| Ok(system(unlinked).into()));
    let reading = check(reading, &[], Some(&kinds));
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert!(!codes.contains(&"E0146"), "only a port that is linked needs its frame: {codes:?}");
}

#[test]
fn the_frames_fill_the_parameters_that_are_for_them() {
    let kinds = example_kinds();
    let load = |x: &str| {
        let frames = format!(
            r#"<frame name="laser" in="mast" x="{x}" yaw="180deg"/><frame name="mast" in="base_link" z="0.5m"/>"#
        );
        let reading = read(Path::new("a.xml"), &mut |_| Ok(mapped(&frames, "").into()));
        let reading = check(reading, &[], Some(&kinds));
        assert!(reading.is_valid(), "{}", reading.findings.render(Colours::No));
        reading.configuration.expect("it is valid")
    };
    let configuration = load("8cm");
    let mapper = configuration.system.component("m").expect("it is there");
    let frames = mapper.parameter("frames").expect("it is filled");
    assert_eq!(
        frames.value.value,
        "laser,mast,0.08,0,0,0,0,3.141592653589793 mast,base_link,0,0,0.5,0,0,0"
    );
    assert_eq!(frames.origin(), "a.xml:1:41", "where the first one is");
    assert!(configuration.system.component("l").is_some_and(|laser| laser.parameters.is_empty()));
    let changes = differences(&configuration, &load("9cm"));
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    assert_eq!(changes[0], "frame laser: x 0.08m → 0.09m");
    assert!(changes[1].starts_with("parameter m.frames: "), "{changes:?}");
    assert_eq!(changes.len(), 2, "{changes:?}");
}

#[test]
fn frames_are_given_by_no_command_line() {
    let over = Override::parse("m.frames=laser,base_link,0,0,0,0,0,0", Path::new(".")).unwrap();
    let file = mapped(r#"<frame name="laser" in="base_link"/>"#, "");
    let reading = read(Path::new("a.xml"), &mut |_| Ok(file.clone().into()));
    let reading = check(reading, &[over], Some(&example_kinds()));
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(codes, ["E0112"]);
}

#[test]
fn one_frame_that_several_components_need_is_one_finding() {
    let kinds = example_kinds();
    let with = |code: &str, frames: &str, remedy: &str| {
        let file = mapped(frames, r#"</component><component name="n" kind="mounted-mapper">"#)
            .replace("</system>", r#"<link from="l.scan" to="n.scan"/></system>"#);
        one_with(code, &file, Some(&kinds));
        let plain = file.replace("[[", "").replace("]]", "");
        let reading = read(Path::new("a.xml"), &mut |_| Ok(plain.clone().into()));
        let shown = check(reading, &[], Some(&kinds)).findings.render(Colours::No);
        let names_both = code != "E0146" || shown.contains("m and n need the frame laser");
        assert!(shown.contains(remedy) && names_both, "{remedy}\n{shown}");
    };
    let mast = r#"<frame name="mast" in="base_link"/>"#;
    with("E0146", "", "add <frame name=\"laser\"");
    with("E0146", r#"<frame name="[[lazer]]" in="base_link"/>"#, "did you mean laser?");
    with("E0146", &format!(r#"{mast}<frame name="laser" in="[[mats]]"/>"#), "did you mean mast?");
    let base = mast.replace("base_link", "[[base]]");
    let base = format!(r#"{base}<frame name="laser" in="mast"/>"#);
    with("E0146", &base, "did you mean base_link?");
    let lost = r#"<frame name="laser" in="[[mast]]"/>"#;
    with("E0146", lost, "or place laser in base_link");
    with("E0146", &lost.replace("mast", "map"), "write in=\"base_link\"");
    // What is wrong with the frame itself explains that it is missing.
    let inner = r#"<frame name="laser" in="mast"/>"#;
    with("E0016", &format!(r#"<frame name="mast" [[parent]]="base_link"/>{inner}"#), "mean in?");
    with("E0144", &format!(r#"{mast}<frame name="[[mast]]" in="mast"/>"#), "another name");
    with("E0145", &format!(r#"<frame name="mast" in="[[laser]]"/>{inner}"#), "base_link");
    with("E0148", &format!(r#"{mast}<frame name="[[odom]]" in="mast"/>"#), "remove it");
}

#[test]
fn a_frame_under_the_name_of_another_one_is_the_one_that_is_missing() {
    let laser = r#"<frame name="laser" in="mast" z="0.1m"/>"#;
    let file = |name: &str| {
        mapped(&format!(r#"<frame name="{name}" in="base_link" z="0.3m"/>{laser}"#), "")
    };
    let kinds = example_kinds();
    let found = |name: &str| {
        let file = file(name);
        let reading = read(Path::new("a.xml"), &mut |_| Ok(file.clone().into()));
        check(reading, &[], Some(&kinds)).findings
    };
    assert!(found("mast").is_empty(), "{}", found("mast").render(Colours::No));
    for (name, code, remedy) in [
        ("laser", "E0144", "did you mean mast for one of them?"),
        ("base_link", "E0148", "did you mean mast? Otherwise remove it"),
    ] {
        let findings = found(name);
        let codes: Vec<_> = findings.iter().map(|it| it.code.as_str()).collect();
        let text = findings.render(Colours::No);
        assert_eq!(codes, [code], "{text}");
        assert!(text.contains(remedy), "{text}");
    }
}

#[test]
fn a_misspelt_parameter_that_names_a_frame_is_one_finding() {
    let frame = r#"<frame name="lidar" in="base_link" z="0.3m"/>"#;
    let parameter = |name: &str| format!(r#"<parameter name="{name}" value="lidar"/>"#);
    let file = mapped(frame, &parameter("[[laser-frame]]"));
    one_with("E0110", &file, Some(&example_kinds()));
}
