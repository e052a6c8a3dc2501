//! The nine plans of `ARMOR_DATA`: three are read, six refused with their reason.

use std::path::PathBuf;

use armor_exchange::{PlanFormat, PlanItem, RoutePlan, read_plan, write_plan};

fn folder() -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("ARMOR_DATA") else {
        assert!(
            std::env::var_os("CI").is_none(),
            "ARMOR_DATA is not set: it names the data folder"
        );
        eprintln!("skipped: ARMOR_DATA is not set");
        return None;
    };
    Some(PathBuf::from(folder).join("plans"))
}

fn text_of(folder: &std::path::Path, name: &str) -> String {
    let path = folder.join(format!("qgroundcontrol_sample{name}.plan"));
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn six_plans_are_refused_with_their_reason() {
    let Some(folder) = folder() else { return };
    for (name, reason) in [
        ("_wrong_overall_version", "the plan has version 42, and version 1 is read"),
        ("_wrong_mission_version", "the mission has version 7, and version 2 is read"),
        ("_without_mission", "the plan has no mission"),
        ("_with_survey_wrong_version", "item 2 (survey) has version 9"),
        ("_with_survey_missing_items", "item 2 (survey) has no Items"),
        ("_with_structured_scan", "item 2 is a StructureScan"),
    ] {
        let text = text_of(&folder, name);
        let error = read_plan(&text, PlanFormat::GroundControl).expect_err(name).to_string();
        assert!(error.contains(reason), "{name}: {error}");
    }
}

fn read(folder: &std::path::Path, name: &str) -> RoutePlan {
    read_plan(&text_of(folder, name), PlanFormat::GroundControl).expect(name)
}

#[test]
fn three_plans_are_read_and_written_with_the_same_route() {
    let Some(folder) = folder() else { return };
    for (name, items, positions, notes) in [
        // Of the take-off, the pitch is not carried.
        ("", 6, 4, 1),
        ("_with_digicam_control", 1, 0, 1),
        ("_with_survey", 13, 8, 5),
    ] {
        let plan = read(&folder, name);
        let route = &plan.routes[0];
        let count = route.items.iter().filter(|item| item.position().is_some()).count();
        assert_eq!(
            (route.items.len(), count, plan.notes.len()),
            (items, positions, notes),
            "{name}"
        );
        for format in [PlanFormat::GroundControl, PlanFormat::WaypointList] {
            let (text, lost) = write_plan(&plan, format).expect(name);
            assert!(lost.is_empty(), "{name}: {lost:?}");
            let again = read_plan(&text, format).expect(name);
            assert_eq!(again.routes, plan.routes, "{name} as {}", format.name());
            assert_eq!(again.home, plan.home, "{name} as {}", format.name());
        }
        for format in [PlanFormat::Gpx, PlanFormat::GeoJson, PlanFormat::Kml] {
            let (text, _) = write_plan(&plan, format).expect(name);
            let again = read_plan(&text, format).expect(name);
            let places = |plan: &RoutePlan| -> Vec<[f64; 2]> {
                let items = plan.routes.iter().flat_map(|route| &route.items);
                let positions = items.filter_map(PlanItem::position);
                positions.map(|position| [position.latitude_deg, position.longitude_deg]).collect()
            };
            // An empty line has no coordinates to read.
            if positions > 0 {
                assert_eq!(places(&again), places(&plan), "{name} as {}", format.name());
            }
        }
    }
}

#[test]
fn the_sample_takes_off_takes_a_picture_and_returns() {
    let Some(folder) = folder() else { return };
    let plan = read(&folder, "");
    let items = &plan.routes[0].items;
    assert!(matches!(items[0], PlanItem::TakeOff { position: Some(_), .. }));
    assert_eq!(items[2], PlanItem::TakePictures { interval_s: 0.0, count: 1 });
    assert_eq!(items[5], PlanItem::Return);
    assert_eq!(plan.home.map(|home| home.latitude_deg), Some(47.3977507));
}
