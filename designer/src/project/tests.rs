use super::*;
use armor_robotfile::Item as Named;

const FILE: &str = "<armor version=\"1\">\n  <!-- mine -->\n  <system>\n    \
    <component name=\"a\"  kind=\"k\"/>\n  </system>\n</armor>\n";

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("armor-designer-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn add(project: &mut Project, name: &str) -> Result<(), Refused> {
    project.edit(format!("add {name}"), |documents| {
        Ok(documents.system()?.add(Named::Component(name), &[("kind", "k")])?)
    })
}

#[test]
fn an_edit_is_one_step_that_can_be_taken_back_to_the_byte() {
    let folder = folder("edit");
    let path = folder.join("robot.xml");
    std::fs::write(&path, FILE).unwrap();
    let mut project = Project::open(&path, Arc::default()).unwrap();
    project
        .edit("two together", |documents| {
            documents.system()?.add(Named::Component("b"), &[("kind", "k")])?;
            Ok(documents.system()?.add(Named::Component("c"), &[("kind", "k")])?)
        })
        .unwrap();
    let after = Arc::clone(project.files()[0].text());
    assert_eq!(project.configuration().unwrap().system.components.len(), 3);
    assert!(project.is_dirty());
    assert_eq!(project.undo().as_deref(), Some("two together"));
    assert_eq!(&**project.files()[0].text(), FILE);
    assert!(!project.is_dirty() && project.undo().is_none());
    assert_eq!(project.redo().as_deref(), Some("two together"));
    assert_eq!(*project.files()[0].text(), after);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn an_edit_that_is_refused_half_way_changes_nothing() {
    let mut project = Project::new(Arc::default());
    add(&mut project, "a").unwrap();
    let before = Arc::clone(project.files()[0].text());
    let refused = project.edit("bad", |documents| {
        documents.system()?.add(Named::Component("b"), &[("kind", "k")])?;
        Ok(documents.system()?.add(Named::Component("a"), &[("kind", "k")])?)
    });
    assert!(refused.is_err());
    assert_eq!(*project.files()[0].text(), before);
    assert_eq!(project.undoable(), Some("add a"));
}

#[test]
fn a_mission_and_the_system_that_it_names_are_edited_together() {
    let folder = folder("two");
    std::fs::write(folder.join("robot.xml"), FILE).unwrap();
    let mission = "<armor version=\"1\">\n  <mission system=\"robot.xml\" goal=\"p\" safe=\"p\">\n    \
        <place name=\"p\" initial=\"true\" components=\"a\"/>\n  </mission>\n</armor>\n";
    std::fs::write(folder.join("mission.xml"), mission).unwrap();
    let mut project = Project::open(&folder.join("mission.xml"), Arc::default()).unwrap();
    assert_eq!(project.files().len(), 2);
    project
        .edit("rename", |documents| {
            for document in documents.all() {
                document.rename(Named::Component("a"), "arm")?;
            }
            Ok(())
        })
        .unwrap();
    assert!(project.files().iter().all(|file| file.text().contains("arm")));
    project.save().unwrap();
    let saved = project.settle().unwrap().unwrap();
    assert_eq!(saved.files.len(), 2);
    let written = std::fs::read_to_string(folder.join("robot.xml")).unwrap();
    assert_eq!(written, FILE.replace("name=\"a\"", "name=\"arm\""));
    project.undo();
    assert!(project.is_dirty());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_wrong_is_not_saved_and_the_reasons_are_reported() {
    let folder = folder("wrong");
    let path = folder.join("robot.xml");
    std::fs::write(&path, FILE).unwrap();
    let mut project = Project::open(&path, Arc::default()).unwrap();
    // No component of this name exists.
    project
        .edit("link", |documents| {
            let document = documents.system()?;
            let path = document.find(Named::System).unwrap();
            let link = armor_robotfile::NewElement::new("link")
                .attribute("from", "a.x")
                .attribute("to", "ghost.y");
            Ok(document.insert_element(&path, 1, &link)?)
        })
        .unwrap();
    project.save().unwrap();
    let refused = project.settle().unwrap().unwrap_err();
    assert!(matches!(&refused, SaveRefused::Wrong(errors) if !errors.is_empty()), "{refused}");
    assert!(refused.to_string().contains("ghost"), "{refused}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), FILE);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_no_xml_is_opened_and_cannot_be_edited() {
    let folder = folder("broken");
    let path = folder.join("robot.xml");
    std::fs::write(&path, "<armor><system>").unwrap();
    let mut project = Project::open(&path, Arc::default()).unwrap();
    project.settle();
    assert!(project.checked().findings.has_errors());
    assert!(matches!(add(&mut project, "a"), Err(Refused::Broken { .. })));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_new_robot_is_saved_once_it_has_a_name() {
    let folder = folder("new");
    let mut project = Project::new(Arc::default());
    add(&mut project, "a").unwrap();
    assert!(matches!(project.save(), Err(SaveRefused::Nowhere)));
    let path = folder.join("robot.xml");
    project.save_as(path.clone());
    project.settle().unwrap().unwrap();
    assert_eq!(project.path(), Some(path.as_path()));
    assert!(!project.is_dirty());
    assert_eq!(std::fs::read_to_string(&path).unwrap(), &**project.files()[0].text());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_another_program_has_just_written_is_not_overwritten() {
    let folder = folder("raced");
    let path = folder.join("robot.xml");
    std::fs::write(&path, FILE).unwrap();
    let mut project = Project::open(&path, Arc::default()).unwrap();
    add(&mut project, "b").unwrap();
    let theirs = FILE.replace("mine", "theirs");
    std::fs::write(&path, &theirs).unwrap();
    project.save().unwrap();
    let refused = project.settle().expect("it was asked for").unwrap_err();
    assert!(matches!(&refused, SaveRefused::Changed(at) if *at == path), "{refused}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), theirs);
    // Once it is known, it is the user's decision.
    project.set_saved(0, theirs.into());
    project.save().unwrap();
    project.settle().expect("it was asked for").unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), **project.files()[0].text());
    std::fs::remove_dir_all(folder).unwrap();
}
