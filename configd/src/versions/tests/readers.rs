//! What each component reads, as the registry is informed of it.

use super::*;

fn readers(actions: &[ConfigdAction]) -> Vec<(String, Vec<String>, bool)> {
    let mut found = actions.iter().rev().filter_map(|action| match action {
        ConfigdAction::Tell(Notice::Readers(readers)) => Some(readers.clone()),
        _ => None,
    });
    let readers = found.next().unwrap_or_else(|| panic!("no readers in {actions:?}"));
    readers.into_iter().map(|one| (one.component, one.data, one.reads_all)).collect()
}

fn row(component: &str, data: &[&str], reads_all: bool) -> (String, Vec<String>, bool) {
    (component.into(), data.iter().map(ToString::to_string).collect(), reads_all)
}

#[test]
fn the_data_of_links_and_of_the_clock_are_reported_with_each_version() {
    let mut manifests = live_manifests();
    manifests.get_mut("view").expect("it is there").reads_all = true;
    let rules = VersionRules {
        root: "/robot".into(),
        manifests: Some(manifests.clone()),
        ..VersionRules::default()
    };
    let (mut versions, actions) =
        Versions::new(7, rules.clone(), reading(FILE), Vec::new()).expect("it is valid");
    let links = row("mapper", &["player.odometry", "player.scan"], false);
    let first = [row("player", &[], false), links, row("view", &[], true)];
    assert_eq!(readers(&actions), first);
    // A link that is removed; a kind that no longer reads everything.
    let link = "    <link from=\"player.scan\" to=\"mapper.scan\" keep=\"all\"/>\n";
    let fewer = FILE.replace(link, "");
    let actions = versions.handle(saved(&fewer));
    assert_eq!(readers(&actions)[1], row("mapper", &["player.odometry"], false));
    manifests.get_mut("view").expect("it is there").reads_all = false;
    let actions = versions.handle(ConfigdEvent::Kinds(manifests));
    assert_eq!(readers(&actions)[2], row("view", &[], false));
    // A configd that was killed reports them again, with the clock that its options name.
    let kept = KeptVersion { number: 2, files: vec![("m/a.xml".into(), fewer.clone())] };
    let rules = VersionRules { clock: Some("playback.clock".into()), ..rules };
    let (_, actions) = Versions::new(9, rules, reading(&fewer), vec![kept]).expect("it is valid");
    let expected = row("mapper", &["playback.clock", "player.odometry"], false);
    assert_eq!(readers(&actions)[1], expected);
}
