use std::path::Path;
use std::sync::Arc;

use armor_geo::MapPoint;

use super::*;
use crate::map_view::camera::map_point;
use crate::map_view::movers::RouteDrivers;
use crate::project::Project;

const DRAWN: &str = r#"<armor version="1">
  <system name="bench"><component name="way" kind="patrol"/></system>
  <mission goal="over" safe="hold">
    <map origin="48.8583 2.2945 35m"><!-- all of it -->
      <point name="P1" at=" 0   0 "/> <!-- the door -->
      <point name="P2" at="48.8584N 2.2946E"/>
      <zone kind='no-go' name='yard'   shape="2,2 8,2  8,6 2,6"/>
      <zone name="well" kind="observe" shape="circle 14,4 1m"/>
      <line name="green" kind="phase" shape="-2,-3 16,-3"/>
      <rally name="R1" at="-2 4"/>
      <symbol at="16 7" sidc="10031000131211000000"/>
    </map>
    <route name="red" mover="way.route" start="P1" out="over">
      <leg name="l1" to="P2"/>   <!-- out -->
      <stay name="s1" for="2s"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
    <check>never red.s1 and over</check>
  </mission>
</armor>
"#;

fn document(text: &str) -> Document {
    Document::open(Path::new("a.xml"), text.as_bytes()).expect("it is XML")
}

fn text(document: &Document) -> &str {
    std::str::from_utf8(document.bytes()).expect("it is text")
}

fn mission(text: &str) -> Mission {
    let read = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(text.as_bytes().to_vec()));
    read.configuration.and_then(|it| it.mission).expect("it has a mission")
}

fn placement() -> Option<MapPlacement> {
    mission(DRAWN).map.expect("a map").placement
}

fn at(x_m: f64, y_m: f64) -> MapPoint {
    map_point([x_m, y_m])
}

/// `edit` replaces `before` by `after`, and changes nothing else.
#[track_caller]
fn check(edit: impl FnOnce(&mut Document) -> Result<(), Refused>, before: &str, after: &str) {
    let mut document = document(DRAWN);
    edit(&mut document).expect("it is made");
    assert_eq!(text(&document), DRAWN.replacen(before, after, 1));
}

#[test]
fn a_position_is_written_as_it_was() {
    let place = |item, number, to| {
        move |document: &mut Document| {
            let placed = [(Corner { item, number }, to)];
            place_corners(document, placement().as_ref(), &placed)
        }
    };
    check(place(Item::map_point("P1"), 0, at(1.5, -2.0)), "\" 0   0 \"", "\"1.5 -2\"");
    check(place(Item::zone("yard"), 2, at(9.0, 7.0)), "8,6", "9,7");
    check(place(Item::zone("well"), 1, at(14.0, 6.5)), "4 1m", "4 2.5m");
    check(place(Item::zone("well"), 0, at(1.0, 1.0)), "circle 14,4", "circle 1,1");
    check(place(Item::Symbol(0), 0, at(3.0, 3.0)), "16 7", "3 3");
    let north = place(Item::map_point("P2"), 0, at(0.0, 0.0));
    check(north, "48.8584N 2.2946E", "48.8583000N 2.2945000E");
}

#[test]
fn what_is_not_there_is_refused_and_changes_nothing() {
    let mut document = document(DRAWN);
    let placed = |item, number| [(Corner { item, number }, at(1.0, 1.0))];
    for placed in [
        placed(Item::map_point("P9"), 0),
        placed(Item::zone("yard"), 7),
        placed(Item::Symbol(3), 0),
    ] {
        assert!(place_corners(&mut document, None, &placed).is_err(), "{placed:?}");
    }
    let flat = [(Corner { item: Item::zone("well"), number: 1 }, at(14.0, 4.0))];
    let refused = place_corners(&mut document, None, &flat).expect_err("it has no radius");
    assert!(refused.to_string().contains("radius"), "{refused}");
    let corner = |number| Corner { item: Item::map_line("green"), number };
    let refused = remove_corner(&mut document, corner(0)).expect_err("two are left");
    assert_eq!(refused.to_string(), "line green needs 2 corners");
    let gone = [Item::step("red", "s1")];
    let refused = remove(&mut document, &mission(DRAWN), &gone).expect_err("a check names it");
    assert!(refused.to_string().contains("still named"), "{refused}");
    assert_eq!(text(&document), DRAWN);
}

#[test]
fn a_file_without_a_map_gets_one() {
    let empty = "<armor>\n  <mission>\n    <place name=\"a\"/>\n  </mission>\n</armor>\n";
    let mut document = document(empty);
    assert_eq!(add_point(&mut document, false, "1 2").expect("added"), "P1");
    assert_eq!(add_area(&mut document, true, "speed", "0,0 1,0 1,1").expect("added"), "zone1");
    assert_eq!(add_symbol(&mut document, "3 4").expect("added"), 0);
    let expected = "<map>\n      <point name=\"P1\" at=\"1 2\"/>\n      <zone name=\"zone1\" \
                    kind=\"speed\" shape=\"0,0 1,0 1,1\" speed=\"0.5m/s\"/>\n      <symbol at=\"3 4\" \
                    sidc=\"10031000001211000000\"/>\n    </map>\n    <place name=\"a\"/>";
    assert_eq!(text(&document), empty.replace("<place name=\"a\"/>", expected));
}

/// Which lines an edit may change.
#[derive(Clone, Copy, Debug)]
enum Touched {
    /// That of one item.
    One,
    /// It adds one.
    Added,
    /// It gives those that name an item its new name, `other`.
    Renamed,
    /// It removes those that name the item.
    Removed(Item),
}

/// The lines that only the first text has, and those that only the second one has.
fn different<'a>(before: &'a str, after: &'a str) -> (Vec<&'a str>, Vec<&'a str>) {
    let mut only_after: Vec<_> = after.lines().collect();
    let only_before = before.lines().filter(|line| {
        let found = only_after.iter().position(|other| other == line);
        found.map(|at| only_after.remove(at)).is_none()
    });
    (only_before.collect(), only_after)
}

#[track_caller]
fn check_lines(before: &str, after: &str, touched: Touched, context: &str) {
    let (gone, new) = different(before, after);
    let context = || format!("{context}: {touched:?} changed {gone:?} to {new:?}");
    // A comment behind what was removed stays.
    let is_rest = |line: &&str| gone.iter().any(|before| before.ends_with(line.trim_start()));
    let only_rest = new.iter().all(is_rest);
    match touched {
        Touched::One => assert!(gone.len() == 1 && new.len() == 1, "{}", context()),
        Touched::Added => assert!(gone.is_empty() && new.len() == 1, "{}", context()),
        Touched::Renamed => {
            let is_renamed = gone.len() == new.len() && new.iter().all(|it| it.contains("other"));
            assert!(is_renamed, "{}", context());
        }
        Touched::Removed(Item::Symbol(_)) => {
            assert!(gone.len() == 1 && only_rest, "{}", context());
        }
        Touched::Removed(Item::Route(_)) => assert!(only_rest, "{}", context()),
        Touched::Removed(item) => {
            let label = item.to_string();
            let label = label.split(" of ").next().unwrap_or_default();
            let name = label.rsplit(' ').next().unwrap_or_default();
            let names = |line: &&str| {
                ["\"", "'"].iter().any(|quote| line.contains(&format!("{quote}{name}{quote}")))
            };
            assert!(only_rest && gone.iter().all(names), "{}", context());
        }
    }
}

/// One random edit of the map; what it refuses changes nothing. Returns which lines it may change.
fn act(document: &mut Document, random: &mut fastrand::Rng) -> Result<Touched, Refused> {
    let to = at(f64::from(random.i16(..)) / 100.0, f64::from(random.i16(..)) / 100.0);
    let items = [
        Item::map_point("P1"),
        Item::map_point("P2"),
        Item::map_point("P3"),
        Item::zone("yard"),
        Item::zone("zone1"),
        Item::zone("well"),
        Item::map_line("green"),
        Item::rally("R1"),
        Item::Symbol(0),
        Item::step("red", "l1"),
        Item::step("red", "l2"),
        Item::route("red"),
    ];
    let item = items[random.usize(..items.len())];
    let corner = Corner { item, number: random.usize(..5) };
    let placement = placement();
    match random.u8(..10) {
        0..3 => place_corners(document, placement.as_ref(), &[(corner, to)])?,
        3 => insert_corner(document, placement.as_ref(), corner, to)?,
        4 => remove_corner(document, corner)?,
        5 => return add_point(document, random.bool(), "1 2").map(|_| Touched::Added),
        6 => {
            let added = add_area(document, true, "no-go", "0,0 1,0 1,1");
            return added.map(|_| Touched::Added);
        }
        7 => {
            let before = random.bool().then_some("s1");
            return add_leg(document, "red", before, "P1").map(|_| Touched::Added);
        }
        8 => {
            let mission = mission(text(document));
            return remove(document, &mission, &[item]).map(|()| Touched::Removed(item));
        }
        _ => {
            let named = item.named().unwrap_or(Named::Map);
            document.set_attribute(named, "name", Some("other"))?;
            return Ok(Touched::Renamed);
        }
    }
    Ok(Touched::One)
}

#[test]
fn any_edits_all_undone_give_the_same_bytes_and_each_changes_only_its_lines() {
    let wanted =
        |name: &str, or| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(or);
    let (sequences, seed) = (wanted("ARMOR_SEQUENCES", 40), wanted("ARMOR_SEED", 1));
    for sequence in seed..seed + sequences {
        let mut random = fastrand::Rng::with_seed(sequence);
        let files = [(Path::new("a.xml").to_owned(), DRAWN.to_owned())];
        let mut project = Project::still(&files, Arc::default());
        let mut texts = vec![project.files()[0].text().to_string()];
        for _ in 0..20 {
            let mut touched = None;
            let made = project.edit("act", |documents| {
                touched = Some(act(documents.mission()?, &mut random)?);
                Ok(())
            });
            let now = project.files()[0].text().to_string();
            let last = texts.last().expect("one");
            assert!(made.is_ok() || now == *last, "seed {sequence}: a refused edit changed {now}");
            if now != *last {
                let touched = touched.expect("it was made");
                check_lines(last, &now, touched, &format!("seed {sequence}"));
                texts.push(now);
            }
        }
        for expected in texts.iter().rev().skip(1) {
            assert!(project.undo().is_some(), "seed {sequence}");
            assert_eq!(&**project.files()[0].text(), expected, "seed {sequence}");
        }
        assert!(project.undo().is_none(), "seed {sequence}");
    }
}

#[test]
fn a_first_route_gives_the_mission_its_ends_and_a_stay_is_behind_its_step() {
    let empty = "<armor version=\"1\">\n  <system/>\n  <mission/>\n</armor>\n";
    let mut document = document(empty);
    let start = add_point(&mut document, false, "0 0").expect("a point");
    let out = ensure_ends(&mut document).expect("ends");
    let drivers = RouteDrivers {
        mover: "way.route".into(),
        pace: Some("driver.speed".into()),
        pose: Some("mapper.pose".into()),
        fence: Some("guard".into()),
    };
    let new = NewRoute { drivers: &drivers, start: &start, out: &out };
    let route = add_route(&mut document, &new).expect("a route");
    let to = add_point(&mut document, false, "4 0").expect("a point");
    let leg = add_leg(&mut document, &route, None, &to).expect("a leg");
    assert_eq!(add_stay(&mut document, &route, &leg).expect("a stay"), "s1");
    let mission = mission(text(&document));
    assert_eq!(mission.goal.as_ref().map(|it| it.value.as_str()), Some("over"));
    assert_eq!(mission.safe.as_ref().map(|it| it.value.as_str()), Some("hold"));
    let drawn = &mission.routes[0];
    assert_eq!(drawn.pace.as_ref().map(|it| it.component.value.as_str()), Some("driver"));
    assert_eq!(drawn.pose.as_ref().map(|it| it.component.value.as_str()), Some("mapper"));
    assert_eq!(drawn.fence.as_ref().map(|it| it.value.as_str()), Some("guard"));
    let steps: Vec<_> = drawn.steps.iter().map(|step| step.name().value.as_str()).collect();
    assert_eq!(steps, ["l1", "s1"]);
    // Its exits lead to the safe place; those of a route that is drawn with a rally point, there.
    add_exits(&mut document, &route).expect("exits");
    add_point(&mut document, true, "1 1").expect("a rally point");
    let path = |at: &str| vec![at.to_owned(), "2 2".to_owned()];
    let (second, _) =
        add_path(&mut document, PathEnd::New(&drivers), &path("0 1")).expect("a second route");
    let (again, _) = add_path(&mut document, PathEnd::Of(&second), &path("3 3")).expect("legs");
    assert_eq!(again, second);
    let exits = |to: &str| format!("<otherwise on=\"lost-link blocked late\" do=\"{to}\"/>");
    let counts = ["hold", "rally"].map(|to| text(&document).matches(&exits(to)).count());
    assert_eq!(counts, [1, 1], "{}", text(&document));
    // Each is changed in its line.
    let before = text(&document).to_owned();
    set_exit(&mut document, &route, 0, "do", Some("rally")).expect("an action");
    set_exit(&mut document, &second, 0, "on", Some("late recall breach")).expect("causes");
    let changed = before.replacen(&exits("hold"), &exits("rally"), 1);
    let (head, tail) = changed.rsplit_once("lost-link blocked late").expect("the second one");
    assert_eq!(text(&document), format!("{head}late recall breach{tail}"));
    let refused = set_exit(&mut document, &route, 3, "do", Some("hold")).expect_err("there is one");
    assert_eq!(refused.to_string(), format!("route {route} has no exit 4"));
    let read = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(text(&document).into()));
    assert!(!read.findings.has_errors(), "{}", text(&document));
    let before = text(&document).to_owned();
    assert_eq!(ensure_ends(&mut document).expect("they are there"), "over");
    assert_eq!(text(&document), before);
}
