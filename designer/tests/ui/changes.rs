//! Undo of the mission as a property: any sequence of changes, all undone, gives the bytes of
//! the start; made again, those of the end. What is refused has changed nothing.

use std::sync::Arc;

use armor_designer::Item;
use armor_designer::mission::{Change, Decides, Timing};
use armor_designer::project::Project;
use armor_robotfile::mission::ArcKind;
use proptest::prelude::*;

use crate::ui::bench_kinds;

const START: &str = r#"<?xml version="1.0"?>
<armor version="1">
  <!-- comments   and odd   spaces stay -->
  <system name="bench">
    <component kind="eye"   name="eye" ><parameter name='device' value='a&amp;b'/></component>
    <component name="arm" kind="arm"/>
  </system>
  <mission goal="home"   safe="hold">
    <place  name='explore' initial="true" components="arm"><!-- the first --></place>
    <place name="home"/> <place name="hold"/>
    <variable name="near" source="eye.target.x"/>
    <transition name="seen" from="explore" to="home" on="arm.done" when='near &lt; 2'/>
    <transition name="late" from="explore" timeout="90s">
      <arc to="hold" weight="2"/>
    </transition>
    <exclusive components="arm eye"/>
    <check>never home and hold</check>
  </mission>
</armor>
"#;

fn name() -> impl Strategy<Value = String> {
    const KNOWN: &[&str] = &["explore", "home", "hold", "seen", "late", "near", "new", "9", "a b"];
    proptest::sample::select(KNOWN).prop_map(str::to_owned)
}

fn component() -> impl Strategy<Value = String> {
    const KNOWN: &[&str] = &["arm", "eye", "gone"];
    proptest::sample::select(KNOWN).prop_map(str::to_owned)
}

fn kind() -> impl Strategy<Value = ArcKind> {
    use ArcKind::{Inhibitor, Put, Read, Reset, Take};
    const ALL: &[ArcKind] = &[Take, Put, Read, Inhibitor, Reset];
    proptest::sample::select(ALL)
}

fn arc() -> impl Strategy<Value = Item> {
    (name(), name(), kind())
        .prop_map(|(transition, place, kind)| Item::arc(transition, place, kind))
}

fn item() -> impl Strategy<Value = Item> {
    prop_oneof![
        name().prop_map(Item::place),
        name().prop_map(Item::transition),
        name().prop_map(Item::variable),
        arc(),
        (0..2_usize).prop_map(Item::Check),
        (0..2_usize).prop_map(Item::Exclusive),
        Just(Item::Mission),
    ]
}

fn text() -> impl Strategy<Value = String> {
    "[ -~äé<&\"']{0,16}"
}

fn change() -> impl Strategy<Value = Change> {
    const KEYS: &[&str] = &["when", "components", "goal", "priority", "on", "initial", "from"];
    let key = proptest::sample::select(KEYS);
    prop_oneof![
        (item(), name()).prop_map(|(item, name)| Change::Rename(item, name)),
        (item(), key, proptest::option::of(text()))
            .prop_map(|(item, key, value)| Change::Attribute(item, key, value)),
        (name(), component(), any::<bool>()).prop_map(|(place, component, is_active)| {
            Change::Component { place, component, is_active }
        }),
        (name(), component(), proptest::option::of(text())).prop_map(
            |(place, component, value)| {
                let parameter = "mode".to_owned();
                Change::PlaceParameter { place, component, parameter, value }
            }
        ),
        (name(), 0..4_usize).prop_map(|(name, which)| {
            let timing = match which {
                0 => Timing::Immediate,
                1 => Timing::Timeout("1s".into()),
                2 => Timing::After("2s".into()),
                _ => Timing::Interval("1s".into(), "5s".into()),
            };
            Change::Timing(name, timing)
        }),
        (name(), 0..3_usize).prop_map(|(name, which)| {
            let all = [Decides::Auto, Decides::Confirm, Decides::Operator];
            Change::Decides(name, all[which])
        }),
        (arc(), kind()).prop_map(|(arc, kind)| Change::ArcKind(arc, kind)),
        (arc(), 1..5_u32).prop_map(|(arc, weight)| Change::Weight(arc, weight)),
        arc().prop_map(Change::AddArc),
        (0..2_usize, component(), any::<bool>())
            .prop_map(|(number, component, is_in)| Change::Exclusive(number, component, is_in)),
        text().prop_map(Change::AddCheck),
        (0..2_usize, text()).prop_map(|(number, text)| Change::Check(number, text)),
        text().prop_map(Change::AddSubmission),
        proptest::collection::vec(item(), 1..4).prop_map(Change::Remove),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn all_taken_back_is_the_start_and_made_again_the_end(
        changes in proptest::collection::vec(change(), 1..20)
    ) {
        let folder = std::env::temp_dir().join(format!("armor-changes-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("robot.xml");
        std::fs::write(&path, START).unwrap();
        let mut project = Project::open(&path, Arc::new(bench_kinds::kinds())).unwrap();
        for change in &changes {
            let before = project.files()[0].text().clone();
            if project.edit(change.what(), |documents| change.apply(documents)).is_err() {
                prop_assert_eq!(&before, project.files()[0].text());
            }
        }
        let end = project.files()[0].text().clone();
        while project.undo().is_some() {}
        prop_assert_eq!(&**project.files()[0].text(), START);
        while project.redo().is_some() {}
        prop_assert_eq!(project.files()[0].text(), &end);
        let _ = std::fs::remove_dir_all(&folder);
    }
}
