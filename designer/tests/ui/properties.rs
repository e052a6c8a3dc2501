//! Parameters and other properties: each change of a field is one step.

use armor_designer::Kinds;
use eframe::egui::{Key, Modifiers};

use crate::ui::{Window, bench_kinds};

const EYE: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye"/>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="arm" x="300" y="0"/>
    </layout>
  </system>
</armor>
"#;

#[test]
fn a_double_click_opens_the_properties_and_the_number_on_the_block_counts_what_is_missing() {
    let mut window = Window::open(Some(EYE));
    let doc = |window: &Window| {
        use egui_kittest::kittest::{AccessKitNode, NodeT, Queryable};
        let node = window.harness.get_by_label("component eye");
        let node: AccessKitNode<'_> = node.accesskit_node();
        node.data().description().unwrap_or_default().to_owned()
    };
    assert!(doc(&window).contains("1 of its parameters need a value"), "{}", doc(&window));
    window.double_click("component eye");
    window.fill("parameter device", "usb0");
    assert!(window.text().contains(r#"<parameter name="device" value="usb0"/>"#));
    assert!(!doc(&window).contains("need a value"), "{}", doc(&window));
}

#[test]
fn saving_is_refused_while_a_parameter_lacks_a_value_and_leads_there() {
    let mut window = Window::open(Some(EYE));
    window.click("component arm");
    window.fill("Component name", "hand");
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.harness.run_steps(2);
    let refused = window.harness.state_mut().workspace().project.settle();
    // The window may have taken the answer itself by that time.
    if let Some(refused) = refused {
        assert!(refused.unwrap_err().to_string().contains("eye has no value for device"));
    } else {
        assert!(
            window.last_message().contains("eye has no value for device"),
            "{}",
            window.last_message()
        );
    }
    assert_eq!(crate::ui::read(&window.path("robot.xml")), EYE);
}

#[test]
fn what_would_not_be_saved_anywhere_is_not_asked_for_a_name() {
    let mut window = Window::open(None);
    let workspace = window.harness.state_mut().workspace();
    let at = eframe::egui::Pos2::ZERO;
    assert!(
        workspace.edit("add", |d| armor_designer::system::add_component(d, "eye", at).map(drop))
    );
    window.settle();
    window.keys(Modifiers::COMMAND, Key::S);
    assert!(
        window.last_message().contains("eye has no value for device"),
        "{}",
        window.last_message()
    );
    assert!(!window.has("File name"));
}

#[test]
fn a_value_that_does_not_fit_is_shown_as_a_problem() {
    let mut window = Window::open(Some(EYE));
    window.click("component eye");
    window.fill("parameter distance", "99m");
    let findings = &window.harness.state_mut().workspace().project.checked().findings.clone();
    let messages: Vec<_> = findings.iter().map(|finding| finding.message.as_str()).collect();
    assert!(messages.iter().any(|message| message.contains("out of range")), "{messages:?}");
    window.click("reset distance");
    assert_eq!(window.text(), EYE, "back at its default the file assigns nothing");
}

#[test]
fn a_component_is_renamed_everywhere() {
    let mut window = Window::open(Some(EYE));
    window.click("component eye");
    window.key(Key::F2);
    window.keys(Modifiers::COMMAND, Key::A);
    window.write("camera");
    window.key(Key::Enter);
    let text = window.text();
    assert!(text.contains(r#"from="camera.target""#) && text.contains(r#"of="camera""#), "{text}");
    assert!(window.has("component camera"));
    window.fill("Component name", "arm");
    assert!(window.last_message().contains("arm"), "{}", window.last_message());
    assert_eq!(window.text(), text);
}

#[test]
fn what_is_being_written_is_not_lost_when_something_else_is_clicked() {
    let mut window = Window::open(Some(EYE));
    window.click("component eye");
    window.click("parameter device");
    window.write("usb1");
    window.click("component arm");
    assert!(window.text().contains(r#"value="usb1""#), "{}", window.text());
}

#[test]
fn a_link_says_what_a_slow_consumer_gets() {
    let mut window = Window::open(Some(EYE));
    window.click("link eye.target to arm.target");
    window.click("link keep");
    window.click("everything; the sender waits");
    assert!(window.text().contains(r#"<link from="eye.target" to="arm.target" keep="all"/>"#));
    window.fill("link history", "5");
    assert!(window.text().contains(r#"keep="all" history="5""#), "{}", window.text());
    window.key(Key::Escape);
}

#[test]
fn the_frames_of_the_system_are_listed_added_measured_renamed_and_removed() {
    let mut window = Window::open(Some(EYE));
    window.click("Add a frame");
    let added = r#"    <frame name="laser" in="base_link" x="0m" z="0m"/>
    <component name="eye" kind="eye"/>"#;
    assert!(window.text().contains(added), "{}", window.text());
    window.fill("frame laser x", "8cm");
    window.fill("frame laser yaw", "180deg");
    let measured = r#"<frame name="laser" in="base_link" x="8cm" z="0m" yaw="180deg"/>"#;
    assert!(window.text().contains(measured), "{}", window.text());
    window.click("Add a frame");
    window.fill("frame camera in", "laser");
    assert!(window.text().contains(r#"<frame name="camera" in="laser""#), "{}", window.text());
    window.click("remove frame laser");
    let refused = window.last_message();
    assert!(refused.contains("laser"), "camera is in it: {refused}");
    window.fill("frame laser name", "front");
    let renamed = window.text();
    assert!(renamed.contains(r#"<frame name="front""#) && renamed.contains(r#"in="front""#));
    window.click("remove frame camera");
    window.click("remove frame front");
    assert_eq!(window.text(), EYE);
}

#[test]
fn a_flag_and_a_choice_have_editors_that_fit() {
    let mut window = Window::open(Some(EYE));
    window.click("component arm");
    window.click("parameter gentle");
    assert!(window.text().contains(r#"<parameter name="gentle" value="true"/>"#));
    window.click("parameter mode");
    window.click("fast");
    assert!(window.text().contains(r#"<parameter name="mode" value="fast"/>"#));
}

#[test]
fn what_a_component_may_use_of_the_host_is_edited() {
    let mut window = Window::open(Some(EYE));
    window.click("component arm");
    window.click("Execution");
    for (field, text, written) in [
        ("component nice", "5", r#"nice="5""#),
        ("component realtime", "10", r#"realtime="10""#),
        ("component cpus", "0 2-3", r#"cpus="0 2-3""#),
        ("component cpu", "150%", r#"cpu="150%""#),
        ("component memory", "512MiB", r#"memory="512MiB""#),
    ] {
        window.fill(field, text);
        assert!(window.text().contains(written), "{}", window.text());
    }
    window.fill("component memory", "512");
    let findings = &window.harness.state_mut().workspace().project.checked().findings.clone();
    let messages: Vec<_> = findings.iter().map(ToString::to_string).collect();
    let expected = "an amount such as 512MiB";
    assert!(messages.iter().any(|message| message.contains(expected)), "{messages:?}");
    for field in ["component memory", "component nice"] {
        window.click(field);
        window.keys(Modifiers::COMMAND, Key::A);
        window.key(Key::Delete);
        window.key(Key::Enter);
    }
    let text = window.text();
    assert!(!text.contains("nice=") && !text.contains("memory="), "{text}");
}

#[test]
fn parameters_are_filtered_by_words_and_by_whether_they_are_changed() {
    let text = EYE.replace(
        "</system>",
        r#"<component name="window" kind="view"><parameter name="gain" value="2"/></component></system>"#,
    );
    let mut window = Window::open(Some(&text));
    window.click("component window");
    let shown = |window: &Window| {
        let names = ["depth", "gain", "height", "margin", "width"];
        let names = names.into_iter().filter(|name| window.has(&format!("parameter {name}")));
        names.collect::<Vec<_>>()
    };
    assert_eq!(shown(&window).len(), 5);
    window.click("filter of parameters");
    window.write("i");
    assert_eq!(shown(&window), ["gain", "height", "margin", "width"]);
    window.click("changed only");
    assert_eq!(shown(&window), ["gain"]);
    assert!(window.has("4 parameters are hidden"));
    window.click("component eye");
    assert!(window.has("parameter device"), "few parameters are not filtered");
}

#[test]
fn many_parameters_are_grouped_by_the_first_word_of_their_names() {
    let text = EYE.replace(
        "</system>",
        r#"<component name="base" kind="station"><parameter name="gps_rate" value="5"/></component></system>"#,
    );
    let mut window = Window::open_as(Some(&text), |_, start| {
        let kinds = bench_kinds::manifests().into_iter().chain([bench_kinds::station()]);
        start.kinds = Some(Kinds::of(kinds, "stock"));
    });
    window.click("component base");
    assert!(window.has("laser (3)") && window.has("gps (3, 1 changed)"));
    assert!(window.has("parameter start_x"), "two of a word are no group");
    assert!(window.has("parameter gps_sigma"), "what is changed is open");
    assert!(!window.has("parameter laser_range"), "what has its defaults is folded");
    window.click("laser (3)");
    window.harness.run_steps(20);
    window.fill("parameter laser_range", "7");
    assert!(window.text().contains(r#"name="laser_range" value="7""#), "{}", window.text());
    window.click("changed only");
    assert!(window.has("laser (1, 1 changed)") && window.has("gps (1, 1 changed)"));
    assert!(window.has("10 parameters are hidden"));
    window.click("changed only");
    window.click("filter of parameters");
    window.write("sigma");
    assert!(window.has("parameter laser_sigma") && window.has("parameter gps_sigma"));
    assert!(!window.has("parameter seed") && !window.has("parameter laser_rate"));
}
