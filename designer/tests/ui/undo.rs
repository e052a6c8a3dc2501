//! Undo as a property: any sequence of edits, all undone, gives the bytes of the start; made
//! again, those of the end.

use std::sync::Arc;

use armor_designer::canvas::{Alignment, align};
use armor_designer::project::{Project, Refused};
use armor_designer::system;
use armor_designer::{Item, View, layout};
use eframe::egui::{Pos2, Rect, Vec2};
use proptest::prelude::*;

use crate::ui::bench_kinds;

const START: &str = r#"<?xml version="1.0"?>
<armor version="1">
  <!-- comments   and odd   spaces stay -->
  <system name="bench">
    <component kind="eye"   name="eye" ><parameter name='device' value='a&amp;b'/></component>
    <component name="arm" kind="arm"/>

    <link from="eye.target" to="arm.target"/> <!-- the first -->
  </system>
  <mission goal="there" safe="there">
    <place name="there" initial="true" components="arm"/>
  </mission>
</armor>
"#;

/// An edit, with numbers that choose what it is about.
#[derive(Clone, Debug)]
enum Act {
    Add(usize, i16, i16),
    Remove(usize),
    Rename(usize, usize),
    Set(usize, String),
    Join(usize, usize),
    Cut(usize),
    Move(usize, i16, i16),
    Arrange,
    Align(usize),
    Copy(usize),
    Note(String),
    Undo,
    Redo,
}

fn acts() -> impl Strategy<Value = Vec<Act>> {
    let one = prop_oneof![
        (0..3_usize, any::<i16>(), any::<i16>()).prop_map(|(kind, x, y)| Act::Add(kind, x, y)),
        (0..9_usize).prop_map(Act::Remove),
        (0..9_usize, 0..9_usize).prop_map(|(n, name)| Act::Rename(n, name)),
        (0..9_usize, "[ -~äé<&\"]{0,12}").prop_map(|(n, text)| Act::Set(n, text)),
        (0..40_usize, 0..40_usize).prop_map(|(from, to)| Act::Join(from, to)),
        (0..9_usize).prop_map(Act::Cut),
        (0..9_usize, any::<i16>(), any::<i16>()).prop_map(|(n, x, y)| Act::Move(n, x, y)),
        Just(Act::Arrange),
        (0..6_usize).prop_map(Act::Align),
        (0..9_usize).prop_map(Act::Copy),
        "[ -~ä<&]{0,20}".prop_map(Act::Note),
        Just(Act::Undo),
        Just(Act::Redo),
    ];
    proptest::collection::vec(one, 1..24)
}

/// Acts on a project as the view does; a refused edit changes nothing.
fn act(project: &mut Project, act: &Act) -> Result<(), Refused> {
    let drawing = system::draw(project);
    let nodes = &drawing.diagram.nodes;
    let name = |n: &usize| nodes.get(n % nodes.len().max(1)).map(|node| node.title.clone());
    let component = |n: &usize| name(n).map(Item::component);
    let at = |x: &i16, y: &i16| Pos2::new(f32::from(*x), f32::from(*y));
    match act {
        Act::Add(kind, x, y) => {
            let kind = ["eye", "arm", "lamp"][kind % 3];
            project.edit("add", |d| system::add_component(d, kind, at(x, y)).map(|_| ()))
        }
        Act::Remove(n) => project.edit("remove", |d| system::remove(d, component(n).iter())),
        Act::Rename(n, new) => project.edit("rename", |d| {
            let old = name(n).unwrap_or_default();
            system::rename(d, &old, ["a", "b-2", "all", "9", "arm", "eye", "c", "d", "e"][*new])
        }),
        Act::Set(n, text) => project.edit("set", |d| {
            let owner = name(n).unwrap_or_default();
            Ok(d.system()?.set_parameter(&owner, "device", Some(text))?)
        }),
        Act::Join(from, to) => {
            let ports: Vec<_> = drawing.joints.ports.iter().flatten().map(|j| j.data()).collect();
            let port = |n: usize| ports.get(n % ports.len().max(1)).cloned().unwrap_or_default();
            project.edit("join", |d| system::join(d, &port(*from), &port(*to)))
        }
        Act::Cut(n) => {
            let wires = &drawing.diagram.wires;
            let wire = wires.get(n % wires.len().max(1)).map(|wire| wire.item);
            project.edit("cut", |d| system::remove(d, wire.iter()))
        }
        Act::Move(n, x, y) => project.edit("move", |d| {
            let places: Vec<_> = component(n).into_iter().map(|item| (item, at(x, y))).collect();
            system::place(d, &places)
        }),
        Act::Arrange => {
            let places = system::arrange_all(&drawing.diagram, &[], 1.6);
            project.edit("arrange", |d| system::place(d, &places))
        }
        Act::Align(how) => {
            use Alignment::{Across, Bottom, Down, Left, Right, Top};
            let areas: Vec<_> = nodes.iter().map(|node| (node.item, node.rect)).collect();
            let places = align(&areas, [Left, Right, Top, Bottom, Across, Down][*how]);
            project.edit("align", |d| system::place(d, &places))
        }
        Act::Copy(n) => {
            let Some(item) = component(n) else { return Ok(()) };
            let text = system::copied(project, &drawing, &[item].into()).unwrap_or_default();
            project.edit("paste", |d| {
                system::paste(d, &text, |whole| whole.min + Vec2::splat(30.0)).map(|_| ())
            })
        }
        Act::Note(text) => project.edit("note", |d| {
            let area = Rect::from_min_size(Pos2::new(5.0, 5.0), Vec2::new(100.0, 60.0));
            layout::add_decoration(d.system()?, View::System, true, area, text).map(|_| ())
        }),
        Act::Undo => {
            project.undo();
            Ok(())
        }
        Act::Redo => {
            project.redo();
            Ok(())
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn all_taken_back_is_the_start_and_made_again_the_end(acts in acts()) {
        let folder = std::env::temp_dir().join(format!("armor-undo-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("robot.xml");
        std::fs::write(&path, START).unwrap();
        let mut project = Project::open(&path, Arc::new(bench_kinds::kinds())).unwrap();
        let text = |project: &Project| Arc::clone(project.files()[0].text());
        for one in &acts {
            let before = text(&project);
            if act(&mut project, one).is_err() {
                prop_assert_eq!(&*before, &*text(&project), "a refused edit changed something");
            }
        }
        while project.redo().is_some() {}
        let end = text(&project);
        let mut steps = 0;
        while project.undo().is_some() {
            steps += 1;
        }
        prop_assert_eq!(&*text(&project), START);
        prop_assert!(!project.is_dirty());
        for _ in 0..steps {
            prop_assert!(project.redo().is_some());
        }
        prop_assert_eq!(text(&project), end);
    }
}
