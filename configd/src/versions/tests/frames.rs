//! The frames of the file as the parameters that they fill: answered, changed live, and kept.

use armor_wire::manifest::ParameterManifest;
use armor_wire::text_format::TextFormat;

use super::*;

/// The kinds of the tests; that of the mapper receives the frames of the file.
fn kinds_with_frames() -> Manifests {
    let mut kinds = live_manifests();
    let mapper = kinds.get_mut("mapper").expect("it is one of them");
    let speed = mapper.parameters.last().cloned().expect("it has some");
    let (name, format, default) = ("frames".into(), Some(TextFormat::Frames), Some(String::new()));
    mapper.parameters.push(ParameterManifest { name, format, default, ..speed });
    kinds
}

/// The file with a laser so far ahead.
fn placed(x: &str) -> String {
    let frame = format!("<system>\n    <frame name=\"laser\" in=\"base_link\" x=\"{x}\"/>");
    FILE.replace("<system>", &frame)
}

fn request_frames(versions: &mut Versions) -> Option<String> {
    connect(versions, 1, "mapper", Purpose::Config);
    let request = ConfigRequest::Parameter { request: 1, name: "frames".into() };
    match ask(versions, 1, request) {
        ConfigReply::Parameter { assigned, .. } => assigned.map(|assigned| assigned.text),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_frame_that_changes_reaches_the_components_that_have_it() {
    let rules = VersionRules { manifests: Some(kinds_with_frames()), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    assert_eq!(request_frames(&mut versions), None, "there are none");
    for (x, expected) in
        [("8cm", "laser,base_link,0.08,0,0,0,0,0"), ("1m", "laser,base_link,1,0,0,0,0,0")]
    {
        let actions = versions.handle(saved(&placed(x)));
        let sent = actions.iter().find_map(|action| match action {
            ConfigdAction::Peer(armor_wire::peer::PeerAction::Send {
                message: ConfigReply::Parameter { name, assigned: Some(assigned), .. },
                ..
            }) => Some((name.as_str(), assigned.text.as_str())),
            _ => None,
        });
        assert_eq!(sent, Some(("frames", expected)), "{actions:?}");
    }
    let changes =
        match ask(&mut versions, 1, ConfigRequest::Diff { request: 1, from: None, to: None }) {
            ConfigReply::Differences { changes, .. } => changes,
            other => panic!("{other:?}"),
        };
    let texts: Vec<_> = changes.iter().map(|it| (it.text.as_str(), it.effect.as_str())).collect();
    assert_eq!(texts[0].0, "frame laser: x 0.08m → 1m");
    assert!(texts[1].0.starts_with("parameter mapper.frames: "), "{texts:?}");
    assert_eq!(texts[1].1, "reaches mapper immediately");
}

#[test]
fn a_kept_version_that_new_kinds_refuse_still_answers_with_its_frames() {
    let mut kinds = kinds_with_frames();
    kinds.remove("view");
    let rules = VersionRules { manifests: Some(kinds), ..VersionRules::default() };
    let kept = KeptVersion { number: 3, files: vec![("m/a.xml".into(), placed("8cm"))] };
    let (mut versions, _) = Versions::new(9, rules, reading("<armor"), vec![kept]).unwrap();
    let frames = request_frames(&mut versions);
    assert_eq!(frames.as_deref(), Some("laser,base_link,0.08,0,0,0,0,0"));
}

#[test]
fn a_zone_that_is_drawn_reaches_the_components_that_obey_it() {
    let mut kinds = live_manifests();
    let mapper = kinds.get_mut("mapper").expect("it is one of them");
    let speed = mapper.parameters.last().cloned().expect("it has some");
    let (name, format, default) = ("zones".into(), Some(TextFormat::Zones), Some(String::new()));
    mapper.parameters.push(ParameterManifest { name, format, default, live: true, ..speed });
    let rules = VersionRules { manifests: Some(kinds), ..VersionRules::default() };
    let mut versions = versions_under(rules);
    connect(&mut versions, 1, "mapper", Purpose::Config);
    let request = ConfigRequest::Parameter { request: 1, name: "zones".into() };
    ask(&mut versions, 1, request);
    for (shape, expected) in
        [("circle 4,4 2m", "pit no-go circle 4,4 2m"), ("circle 4,5 2m", "pit no-go circle 4,5 2m")]
    {
        let map = format!("<map><zone name=\"pit\" kind=\"no-go\" shape=\"{shape}\"/></map>");
        let text = FILE.replace("safe=\"end\">", &format!("safe=\"end\">{map}"));
        let actions = versions.handle(saved(&text));
        let sent = actions.iter().find_map(|action| match action {
            ConfigdAction::Peer(armor_wire::peer::PeerAction::Send {
                message: ConfigReply::Parameter { name, assigned: Some(assigned), .. },
                ..
            }) => Some((name.as_str(), assigned.text.as_str())),
            _ => None,
        });
        assert_eq!(sent, Some(("zones", expected)), "{actions:?}");
    }
}
