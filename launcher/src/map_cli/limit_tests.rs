//! Plans with more than a file may have, and repetitions.

use armor_exchange::{PlanFormat, RoutePlan, read_plan};
use armor_robotfile::Item;

use super::drawing::{DrawingError, DrawingOptions, PositionForm};
use super::drawn_plan::draw_plan;
use super::exchange_tests::{base_path, check_import, draw, options, steps_of, system_text};

/// A list of waypoints, each a hundred-thousandth of a degree from the one before.
fn waypoints(count: usize, items: &str) -> RoutePlan {
    let mut text = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t48.1\t2.1\t35\t1\n".to_owned();
    for number in 1..=count {
        let latitude = 48.1 + number as f64 * 1e-5;
        text += &format!("{number}\t0\t3\t16\t0\t0\t0\t0\t{latitude}\t2.1\t0\t1\n");
    }
    read_plan(&(text + items), PlanFormat::WaypointList).expect("a list")
}

#[test]
fn limits_of_the_file_are_refused_with_what_to_do() {
    let refuse = |plan: &RoutePlan| {
        let error = draw(&system_text(), plan, &options(PositionForm::Metres));
        error.err().expect("it is refused").downcast::<DrawingError>().expect("its reason")
    };
    let error = refuse(&waypoints(65, ""));
    assert_eq!(error, DrawingError::TooManySteps { steps: 65, most: 64 });
    assert!(error.to_string().contains("divide it in the planner"), "{error}");

    let mut plan = waypoints(2, "");
    let position = plan.home.expect("home");
    let rally = armor_exchange::NamedPosition { name: Some("same".into()), position };
    plan.rally_points = vec![rally; 17];
    assert!(
        refuse(&plan).to_string().contains("17 rally points, the file 0, and a file at most 16")
    );
    plan.rally_points.truncate(16);
    let changed = draw(&system_text(), &plan, &options(PositionForm::Metres)).expect("it is drawn");
    assert!(changed.after.contains("<rally name=\"same-16\" at=\"0 0\"/>"), "{}", changed.after);

    let corner = |north: f64, east: f64| armor_exchange::PlanPosition {
        latitude_deg: 48.2 + north,
        longitude_deg: 2.2 + east,
        altitude: None,
    };
    let fence = |corners: Vec<_>| armor_exchange::Fence {
        name: None,
        stay_in: false,
        shape: armor_exchange::FenceShape::Polygon(corners),
    };
    let triangle = fence(vec![corner(0.0, 0.0), corner(0.0, 0.1), corner(0.1, 0.0)]);
    plan.fences = vec![triangle; 257];
    assert!(refuse(&plan).to_string().contains("257 fences"));
    let crossed = vec![corner(0.0, 0.0), corner(0.1, 0.1), corner(0.0, 0.1), corner(0.1, 0.0)];
    plan.fences = vec![fence(crossed)];
    assert!(matches!(refuse(&plan), DrawingError::Shape { .. }));
    let round = |count: usize| {
        let angle = move |n: usize| n as f64 / count as f64 * std::f64::consts::TAU;
        fence((0..count).map(|n| corner(angle(n).sin() * 0.01, angle(n).cos() * 0.01)).collect())
    };
    plan.fences = vec![round(257)];
    assert!(refuse(&plan).to_string().contains("257 corners, and at most 256"));
    plan.fences = vec![round(256); 9];
    assert!(refuse(&plan).to_string().contains("2304 corners of fences"));

    plan.fences.clear();
    plan.routes.push(plan.routes[0].clone());
    assert!(refuse(&plan).to_string().contains("2 routes (1, 2): choose one with --only"));
    plan.points = vec![plan.rally_points[0].clone(); 4_097];
    let only = DrawingOptions { only: Some("2".into()), ..options(PositionForm::Metres) };
    let error = draw(&system_text(), &plan, &only).err().expect("too many").to_string();
    assert!(error.contains("points"), "{error}");

    let mut base = draw(&system_text(), &waypoints(1, ""), &options(PositionForm::Metres));
    for _ in 0..7 {
        base = draw(&base.expect("eight").after, &waypoints(1, ""), &options(PositionForm::Metres));
    }
    let base = base.expect("eight routes").after;
    let error = draw(&base, &waypoints(1, ""), &options(PositionForm::Metres)).err();
    let error = error.expect("a ninth").to_string();
    assert!(error.contains("1 route, the file 8, and a file at most 8"), "{error}");

    let mut far = waypoints(1, "");
    far.home.as_mut().expect("home").latitude_deg = -48.0;
    let error = refuse(&far).to_string();
    assert!(error.starts_with("item 1:") && error.contains("1,000 km"), "{error}");
}

#[test]
fn a_repetition_that_is_too_long_is_left_out_with_a_note() {
    let plan = waypoints(10, "11\t0\t2\t177\t1\t6\t0\t0\t0\t0\t0\t1\n");
    let changed = draw(&system_text(), &plan, &options(PositionForm::Metres)).expect("drawn");
    assert_eq!(steps_of(&changed.after).len(), 10);
    let text = "the repetition of items 1 to 10, 6 times, is left out: written out, the route has \
                70 legs and stays, and at most 64 are drawn; plan fewer passes, or divide the route in \
                the planner";
    let is_it = |note: &&armor_exchange::PlanNote| note.text == text && note.place == "item 11";
    assert_eq!(
        changed.drawing.notes.iter().filter(is_it).count(),
        1,
        "{:?}",
        changed.drawing.notes
    );
    let plan = waypoints(10, "11\t0\t2\t177\t1\t5\t0\t0\t0\t0\t0\t1\n");
    let changed = draw(&system_text(), &plan, &options(PositionForm::Metres)).expect("drawn");
    assert_eq!(steps_of(&changed.after).len(), 60);
    let plan = waypoints(2, "3\t0\t2\t177\t1\t-1\t0\t0\t0\t0\t0\t1\n");
    let changed = draw(&system_text(), &plan, &options(PositionForm::Metres)).expect("drawn");
    assert_eq!(steps_of(&changed.after).len(), 2);
    assert!(changed.after.contains("without end has no counterpart"), "{}", changed.after);
}

#[test]
fn a_repetition_is_driven_pass_by_pass_and_exported_so() {
    // The first two waypoints three times, then the third.
    let repeat = "3\t0\t2\t177\t1\t2\t0\t0\t0\t0\t0\t1\n";
    let last = "4\t0\t3\t16\t0\t0\t0\t0\t48.10003\t2.1\t0\t1\n";
    let plan = waypoints(2, &format!("{repeat}{last}"));
    // It is exported and imported again, too: the same route.
    let changed = check_import("passes", &plan, PositionForm::Metres);
    let steps = steps_of(&changed.after);
    assert_eq!(steps.len(), 7, "{steps:?}");
    assert!(steps[2..4] == steps[..2] && steps[4..6] == steps[..2] && steps[6] != steps[0]);
    let note = "the repetition of items 1 to 2, 2 times, is written out";
    assert!(changed.drawing.notes.iter().any(|it| it.text == note), "{:?}", changed.drawing.notes);
    // So many that they are not even counted.
    let plan = waypoints(2, &repeat.replace("1\t2\t0", "1\t1000000\t0"));
    let changed = draw(&system_text(), &plan, &options(PositionForm::Metres)).expect("drawn");
    assert_eq!(steps_of(&changed.after).len(), 2);
    let part =
        "the route has more than 4096 items, and at most 64 legs and stays are drawn; plan fewer";
    assert!(changed.after.contains(part), "{}", changed.after);
}

#[test]
fn a_new_mission_has_its_map_route_and_ends() {
    let drawing = draw_plan(
        &waypoints(2, ""),
        &options(PositionForm::Metres),
        &super::drawing::ExistingDrawing::default(),
    )
    .expect("it is drawn");
    let mut document = super::insertion::make_file(&base_path()).expect("a file");
    super::insertion::insert_drawing(&mut document, &drawing, Some("a&b.xml")).expect("it fits");
    let text = String::from_utf8_lossy(document.bytes()).into_owned();
    assert!(
        text.contains("<mission system=\"a&amp;b.xml\" goal=\"over\" safe=\"hold\">"),
        "{text}"
    );
    assert!(document.find(Item::MapPoint("P2")).is_some() && document.find(Item::Map).is_some());
}
