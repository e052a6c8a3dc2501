//! Changes that reach files which are not open.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use super::NameChange;
use crate::item::Item;
use crate::mission::Change;
use crate::project::Project;

const SYSTEM: &str = "<armor version=\"1\"><system name=\"s\">\
    <component name=\"arm\" kind=\"k\"/><component name=\"eye\" kind=\"k\"/></system></armor>";

fn mission(system: &str, inner: &str) -> String {
    format!(
        "<armor version=\"1\"><mission {system} goal=\"p\">{inner}\
         <place name=\"p\" components=\"arm eye\"/></mission></armor>"
    )
}

/// A system with two missions over it, one with a sub-mission below, and one of another system.
fn folder(name: &str) -> PathBuf {
    let folder =
        std::env::temp_dir().join(format!("armor-elsewhere-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("parts")).unwrap();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    write("robot.xml", SYSTEM);
    write("other.xml", SYSTEM);
    write("one.xml", &mission("system=\"robot.xml\"", ""));
    write(
        "two.xml",
        &mission("system=\"robot.xml\"", "<submission ref=\"parts/inner.xml\" in=\"p\"/>"),
    );
    write("parts/inner.xml", &mission("", ""));
    write("parts/unused.xml", &mission("", ""));
    write("foreign.xml", &mission("system=\"other.xml\"", ""));
    folder.canonicalize().unwrap()
}

fn rename(project: &mut Project) -> NameChange {
    project.edit("rename", |documents| crate::system::rename(documents, "arm", "hand")).unwrap();
    NameChange::Rename { item: Item::component("arm"), new: "hand".into() }
}

fn texts(project: &Project) -> Vec<String> {
    project.files().iter().map(|file| file.text().to_string()).collect()
}

#[test]
fn files_over_the_same_system_are_changed_in_one_step() {
    let folder = folder("step");
    let mut project = Project::open(&folder.join("robot.xml"), Arc::default()).unwrap();
    let change = rename(&mut project);
    let elsewhere = project.find_elsewhere(change).expect("three files name it");
    let names: Vec<_> = elsewhere
        .files
        .iter()
        .map(|file| file.path.strip_prefix(&folder).unwrap().display().to_string())
        .collect();
    assert_eq!(names, ["one.xml", "parts/inner.xml", "two.xml"]);
    assert_eq!(project.change_elsewhere(&elsewhere).changed.len(), 3);
    assert!(texts(&project).iter().all(|text| text.contains("hand") && !text.contains("arm eye")));
    assert_eq!(project.undo().as_deref(), Some("rename"));
    assert!(project.undo().is_none() && !project.is_dirty(), "it is one step");
    assert!(texts(&project).iter().all(|text| !text.contains("hand")));
    project.redo();
    project.save().unwrap();
    assert!(project.settle().is_some_and(|saved| saved.is_ok_and(|it| it.files.len() == 4)));
    let saved = fs::read_to_string(folder.join("parts/inner.xml")).unwrap();
    assert!(saved.contains("hand eye"));
    // The next change reaches them without a question.
    project.edit("again", |it| crate::system::rename(it, "hand", "fist")).unwrap();
    assert!(texts(&project).iter().all(|text| text.contains("fist")));
    // What is drawn and edited is still the file that was opened.
    assert!(project.document_with(armor_robotfile::Item::Mission).is_none());
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_file_that_is_read_only_or_has_changed_is_left_with_the_reason() {
    let folder = folder("left");
    let mut project = Project::open(&folder.join("robot.xml"), Arc::default()).unwrap();
    let mut mode = fs::metadata(folder.join("one.xml")).unwrap().permissions();
    mode.set_readonly(true);
    fs::set_permissions(folder.join("one.xml"), mode).unwrap();
    let change = rename(&mut project);
    let elsewhere = project.find_elsewhere(change).unwrap();
    assert_eq!(elsewhere.files[0].obstacle.as_deref(), Some("it is read-only"));
    // Meanwhile another program changes one and removes another.
    let newer = mission("system=\"robot.xml\"", "").replace("<place", "<!-- new --><place");
    fs::write(folder.join("two.xml"), newer).unwrap();
    fs::remove_file(folder.join("parts/inner.xml")).unwrap();
    let result = project.change_elsewhere(&elsewhere);
    assert_eq!(result.changed, [folder.join("two.xml")]);
    let left: Vec<_> = result.left.iter().map(|(path, _)| path.clone()).collect();
    assert_eq!(left, [folder.join("parts/inner.xml"), folder.join("one.xml")]);
    let text = project.files().last().unwrap().text();
    assert!(text.contains("<!-- new -->") && text.contains("hand"));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_a_mission_cannot_do_without_is_not_removed_there() {
    let folder = folder("remove");
    let needs = mission("system=\"robot.xml\"", "")
        .replace("<place", "<transition name=\"t\" from=\"p\" to=\"p\" on=\"arm.done\"/><place");
    fs::write(folder.join("one.xml"), needs).unwrap();
    let mut project = Project::open(&folder.join("robot.xml"), Arc::default()).unwrap();
    let arm = Item::component("arm");
    project.edit("remove", |documents| crate::system::remove(documents, [&arm])).unwrap();
    let elsewhere = project.find_elsewhere(NameChange::Remove(vec![arm])).unwrap();
    let obstacles: Vec<_> = elsewhere.files.iter().map(|file| file.obstacle.is_some()).collect();
    assert_eq!(obstacles, [true, false, false]);
    let result = project.change_elsewhere(&elsewhere);
    assert_eq!((result.changed.len(), result.left.len()), (2, 1));
    assert!(texts(&project).iter().all(|text| !text.contains("arm eye")));
    fs::remove_dir_all(folder).unwrap();
}

const DOCK: &str = "<armor version=\"1\"><mission goal=\"done\"><place name=\"creep\" initial=\"true\"/>\
    <place name=\"done\"/><transition name=\"contact\" from=\"creep\" to=\"done\" timeout=\"1s\"/>\
    </mission></armor>";

/// A mission that includes files, with one check.
fn including(files: &[&str], check: &str) -> String {
    let inner = files.iter().map(|file| format!("<submission ref=\"{file}\"/>"));
    let inner: String = inner.collect();
    format!(
        "<armor version=\"1\"><system/><mission>{inner}<place name=\"creep\" initial=\"true\"/>\
         <check>{check}</check></mission></armor>"
    )
}

/// A sub-mission below, twice in one mission, through another one in a second, and in a third that
/// has no check of it.
fn submission_folder(name: &str) -> PathBuf {
    let folder =
        std::env::temp_dir().join(format!("armor-elsewhere-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("parts")).unwrap();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    write("parts/dock.xml", DOCK);
    let both = "never dock.creep and dock-2.creep and creep and dock.creeps";
    write("twice.xml", &including(&["parts/dock.xml", "parts/dock.xml"], both));
    write("parts/park.xml", &including(&["dock.xml"], "fires(dock.contact)"));
    write("deep.xml", &including(&["parts/park.xml"], "always not park.dock.creep"));
    write("plain.xml", &including(&["parts/dock.xml"], "never creep"));
    write("other.xml", &including(&["parts/park.xml"], "never dock.creep"));
    folder.canonicalize().unwrap()
}

#[test]
fn the_checks_that_name_a_place_of_a_submission_follow_its_name() {
    let folder = submission_folder("place");
    let mut project = Project::open(&folder.join("parts/dock.xml"), Arc::default()).unwrap();
    let item = Item::place("creep");
    let rename = |new: &str| Change::Rename(item, new.to_owned());
    project.edit("rename", |documents| rename("crawl").apply(documents)).unwrap();
    let change = NameChange::Rename { item, new: "crawl".into() };
    let elsewhere = project.find_elsewhere(change).expect("two files name it");
    let names: Vec<_> =
        elsewhere.files.iter().map(|file| (file.path.clone(), file.mentions)).collect();
    assert_eq!(names, [(folder.join("deep.xml"), 1), (folder.join("twice.xml"), 2)]);
    assert_eq!(project.change_elsewhere(&elsewhere).changed.len(), 2);
    let text = texts(&project).join("\n");
    assert!(text.contains("always not park.dock.crawl"), "{text}");
    assert!(text.contains("never dock.crawl and dock-2.crawl and creep and dock.creeps"), "{text}");
    // They are open now, and follow the next name too, as a part of its step.
    let item = Item::place("crawl");
    let again = Change::Rename(item, "slow".into());
    project.edit("again", |documents| again.apply(documents)).unwrap();
    let change = NameChange::Rename { item, new: "slow".into() };
    let elsewhere = project.find_elsewhere(change).unwrap();
    assert_eq!(project.change_elsewhere(&elsewhere).changed.len(), 2);
    assert!(texts(&project).iter().all(|text| !text.contains("crawl")));
    assert_eq!(project.files().len(), 3, "none is open twice");
    assert_eq!(project.undo().as_deref(), Some("again"));
    assert!(texts(&project).iter().all(|text| text.contains("crawl")));
    assert_eq!(project.undo().as_deref(), Some("rename"));
    assert!(!project.is_dirty());
    assert_eq!(project.redo().as_deref(), Some("rename"));
    assert!(texts(&project).iter().all(|text| text.contains("crawl")));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_checks_follow_the_name_of_a_submission_and_of_its_siblings() {
    let folder = submission_folder("mission");
    // The other mission is the second of that name once the first one has it, too.
    fs::write(folder.join("parts/quay.xml"), DOCK).unwrap();
    let check = "never dock.creep and quay.creep and fires(dock.contact)";
    let both = including(&["parts/dock.xml", "parts/quay.xml"], check);
    fs::write(folder.join("both.xml"), both).unwrap();
    let mut project = Project::open(&folder.join("parts/dock.xml"), Arc::default()).unwrap();
    let rename =
        |new: Option<&str>| Change::Attribute(Item::Mission, "name", new.map(str::to_owned));
    let change = rename(Some("quay")).name_change(None).expect("others may name it");
    project.edit("rename", |documents| rename(Some("quay")).apply(documents)).unwrap();
    let elsewhere = project.find_elsewhere(change).expect("four files name it");
    let names: Vec<_> = elsewhere
        .files
        .iter()
        .map(|file| (file.path.file_name().unwrap().to_str().unwrap(), file.obstacle.clone()))
        .collect();
    let expected = ["both.xml", "deep.xml", "park.xml", "twice.xml"];
    assert_eq!(names, expected.map(|name| (name, None)));
    assert_eq!(project.change_elsewhere(&elsewhere).changed.len(), 4);
    let text = texts(&project).join("\n");
    for expected in [
        "never quay.creep and quay-2.creep and fires(quay.contact)",
        "always not park.quay.creep",
        "fires(quay.contact)",
        "never quay.creep and quay-2.creep and creep and dock.creeps",
    ] {
        assert!(text.contains(expected), "{expected} is not in {text}");
    }
    // Without a name, it has that of its file.
    let change = rename(None).name_change(Some("quay")).unwrap();
    project.edit("unname", |documents| rename(None).apply(documents)).unwrap();
    let elsewhere = project.find_elsewhere(change).unwrap();
    assert_eq!(project.change_elsewhere(&elsewhere).changed.len(), 4);
    let text = texts(&project).join("\n");
    assert!(text.contains("never dock.creep and quay.creep and fires(dock.contact)"), "{text}");
    assert_eq!(rename(Some("dock")).name_change(Some("dock")), None);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_check_that_names_a_removed_transition_of_a_submission_is_reported() {
    let folder = submission_folder("transition");
    let mut project = Project::open(&folder.join("parts/dock.xml"), Arc::default()).unwrap();
    let items = vec![Item::transition("contact")];
    let remove = Change::Remove(items.clone());
    project.edit("remove", |documents| remove.apply(documents)).unwrap();
    let elsewhere = project.find_elsewhere(NameChange::removal(&items).unwrap()).unwrap();
    let [file] = &elsewhere.files[..] else { panic!("{elsewhere:?}") };
    assert_eq!(file.path, folder.join("parts/park.xml"));
    let obstacle = file.obstacle.as_deref().expect("its meaning would change");
    assert!(obstacle.contains("dock.contact"), "{obstacle}");
    fs::remove_dir_all(folder).unwrap();
}
