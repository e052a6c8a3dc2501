//! What a format has place for is the same after writing and reading; the rest is named.

use armor_exchange::{
    AltitudeReference, Fence, FenceShape, MavlinkCommand, NamedPosition, PlanAltitude, PlanFormat,
    PlanItem, PlanPosition, PlanWriteError, PlannedRoute, RoutePlan, read_plan, write_plan,
};

fn at(latitude_deg: f64, longitude_deg: f64, m: f64, reference: AltitudeReference) -> PlanPosition {
    PlanPosition { latitude_deg, longitude_deg, altitude: Some(PlanAltitude { m, reference }) }
}

fn ground(latitude_deg: f64, longitude_deg: f64) -> PlanPosition {
    PlanPosition { latitude_deg, longitude_deg, altitude: None }
}

fn go(position: PlanPosition, stay_s: f64) -> PlanItem {
    PlanItem::Go { position, stay_s, name: None }
}

/// A route with every kind of item.
fn route() -> PlannedRoute {
    use AltitudeReference::{Home, Sea, Terrain};
    let items = vec![
        PlanItem::TakeOff {
            position: None,
            altitude: Some(PlanAltitude { m: 12.5, reference: Home }),
        },
        PlanItem::Speed(4.5),
        go(at(48.8583, 2.2945, 30.0, Home), 0.0),
        PlanItem::LookAt(at(48.85, 2.29, 0.0, Home)),
        PlanItem::TakePictures { interval_s: 2.0, count: 5 },
        go(at(-48.858312345, -2.294598765, 105.25, Sea), 7.5),
        PlanItem::StopPictures,
        PlanItem::LookAhead,
        PlanItem::Loiter {
            position: Some(at(48.86, 2.3, 15.0, Terrain)),
            time_s: 60.0,
            radius_m: -25.0,
        },
        PlanItem::Delay(3.0),
        PlanItem::Repeat { to: 2, times: Some(3) },
        PlanItem::Repeat { to: 1, times: None },
        PlanItem::Other(MavlinkCommand {
            command: 206,
            frame: 2,
            parameters: [Some(25.0), None, Some(1.0), Some(0.1), Some(0.0), Some(0.0), Some(0.0)],
        }),
        PlanItem::Land(Some(at(48.8584, 2.2946, 0.0, Home))),
        PlanItem::Return,
    ];
    PlannedRoute { name: None, items }
}

fn plan() -> RoutePlan {
    let corners = vec![ground(48.0, 2.0), ground(48.0, 2.1), ground(48.1, 2.1), ground(48.1, 2.0)];
    RoutePlan {
        home: Some(at(48.1, 2.05, 35.0, AltitudeReference::Sea)),
        routes: vec![route()],
        fences: vec![
            Fence { name: None, stay_in: true, shape: FenceShape::Polygon(corners) },
            Fence {
                name: None,
                stay_in: false,
                shape: FenceShape::Circle { centre: ground(48.05, 2.05), radius_m: 12.5 },
            },
        ],
        breach_return: Some(at(48.02, 2.02, 20.0, AltitudeReference::Home)),
        rally_points: vec![NamedPosition {
            name: None,
            position: at(48.03, 2.03, 10.0, AltitudeReference::Home),
        }],
        points: Vec::new(),
        notes: Vec::new(),
    }
}

#[test]
fn a_plan_of_ground_control_holds_everything_but_names() {
    let plan = plan();
    let (text, lost) = write_plan(&plan, PlanFormat::GroundControl).expect("it can be written");
    assert!(lost.is_empty(), "{lost:?}");
    let mut again = read_plan(&text, PlanFormat::GroundControl).expect("it can be read");
    let notes: Vec<String> = again.notes.drain(..).map(|note| note.to_string()).collect();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].starts_with("item 13: the MAVLink command 206"), "{notes:?}");
    assert_eq!(again, plan);
}

#[test]
fn a_waypoint_list_holds_home_and_route() {
    let plan = plan();
    let (text, lost) = write_plan(&plan, PlanFormat::WaypointList).expect("it can be written");
    let lost: Vec<String> = lost.iter().map(ToString::to_string).collect();
    assert_eq!(
        lost,
        [
            "QGC WPL 110: has no place for: fence (2)",
            "QGC WPL 110: has no place for: breach return (1)",
            "QGC WPL 110: has no place for: rally point (1)",
        ]
    );
    let again = read_plan(&text, PlanFormat::WaypointList).expect("it can be read");
    assert_eq!((again.home, again.routes), (plan.home, plan.routes));
}

/// A plan of positions with names, as GPX, GeoJSON and KML have.
fn positions(with_names: bool) -> RoutePlan {
    let name = |name: &str| with_names.then(|| name.to_owned());
    let named = |text: &str, position| PlanItem::Go { position, stay_s: 0.0, name: name(text) };
    let sea = AltitudeReference::Sea;
    let first =
        vec![named("A & <B>", at(48.1, 2.1, 30.0, sea)), named("C", at(48.2, -2.2, 31.5, sea))];
    let second = vec![named("D", ground(-33.9, 151.2)), named("E", ground(-33.8, 151.3))];
    RoutePlan {
        routes: vec![
            PlannedRoute { name: Some("red \"1\"".into()), items: first },
            PlannedRoute { name: None, items: second },
        ],
        rally_points: vec![NamedPosition { name: Some("R1".into()), position: ground(48.3, 2.3) }],
        points: vec![NamedPosition { name: None, position: at(48.4, 2.4, 7.0, sea) }],
        ..RoutePlan::default()
    }
}

#[test]
fn gpx_geojson_and_kml_hold_positions_and_names() {
    for (format, with_names) in
        [(PlanFormat::Gpx, true), (PlanFormat::GeoJson, true), (PlanFormat::Kml, false)]
    {
        let plan = positions(with_names);
        let (text, lost) =
            write_plan(&plan, format).unwrap_or_else(|error| panic!("{}: {error}", format.name()));
        assert!(lost.is_empty(), "{}: {lost:?}", format.name());
        assert_eq!(read_plan(&text, format).expect(&text), plan, "{}", format.name());
    }
}

#[test]
fn geojson_holds_fences_and_home_and_kml_polygons() {
    let mut plan = RoutePlan { routes: Vec::new(), ..plan() };
    plan.breach_return = Some(ground(48.02, 2.02));
    plan.rally_points.clear();
    plan.fences[0].name = Some("school".into());
    let (text, lost) = write_plan(&plan, PlanFormat::GeoJson).expect("it can be written");
    assert!(lost.is_empty(), "{lost:?}");
    assert_eq!(read_plan(&text, PlanFormat::GeoJson).expect(&text), plan);

    plan.fences.pop();
    let (text, lost) = write_plan(&plan, PlanFormat::Kml).expect("it can be written");
    assert!(lost.is_empty(), "{lost:?}");
    assert_eq!(read_plan(&text, PlanFormat::Kml).expect(&text), plan);
}

#[test]
fn what_a_format_has_no_place_for_is_named_with_its_number() {
    for format in [PlanFormat::Gpx, PlanFormat::GeoJson, PlanFormat::Kml] {
        let (_, lost) = write_plan(&plan(), format)
            .unwrap_or_else(|error| panic!("{}: {error}", format.name()));
        let lost: Vec<String> = lost.iter().map(ToString::to_string).collect();
        for kind in [
            "take-off (1)",
            "speed (1)",
            "stay at a position (1)",
            "circling (1)",
            "repetition (2)",
            "MAVLink command (1)",
        ] {
            assert!(
                lost.iter().any(|note| note.ends_with(kind)),
                "{}: {kind}: {lost:?}",
                format.name()
            );
        }
    }
}

#[test]
fn what_cannot_be_written_is_refused() {
    let mut plan = positions(false);
    for format in [PlanFormat::GroundControl, PlanFormat::WaypointList] {
        let error = write_plan(&plan, format).expect_err("two routes");
        assert_eq!(error, PlanWriteError::SeveralRoutes { format: format.name(), found: 2 });
    }
    plan.routes[0].items.push(PlanItem::Repeat { to: 9, times: None });
    let error = write_plan(&plan, PlanFormat::Gpx).expect_err("it leads nowhere");
    assert_eq!(error, PlanWriteError::Repetition { item: 3, to: 10 });
}

#[test]
fn files_that_are_wrong_are_refused_with_their_place() {
    use PlanFormat::{GeoJson, Gpx, GroundControl, Kml, WaypointList};
    let point = r#"{"type":"Point","coordinates":[2.0,91.0]}"#;
    for (format, text, part) in [
        (GroundControl, "<gpx/>", "this is no plan of QGroundControl"),
        (GroundControl, "[]", "does not begin with `{`"),
        (GroundControl, r#"{"fileType":"Parameters","version":1}"#, "fileType is Parameters"),
        (WaypointList, "QGC WPL 120\n", "version 120"),
        (WaypointList, "hello", "`QGC WPL 110`"),
        (WaypointList, "QGC WPL 110\n1\t0\t3\t16\n", "line 2: it has 4 fields"),
        (WaypointList, "QGC WPL 110\n1 0 3 16 0 0 0 0 95 2 3 1\n", "line 2: latitude 95"),
        (WaypointList, "QGC WPL 110\n1 0 2 177 7 2 0 0 0 0 0 1\n", "a jump to item 7"),
        (WaypointList, "QGC WPL 110\n1 0 1 16 0 0 0 0 5 2 3 1\n", "MAVLink frame 1"),
        (Gpx, "<gpx version=\"1.1\"><rte><rtept lat=\"1\"/></rte></gpx>", "has no lon"),
        (Gpx, "<gpx version=\"2.0\"/>", "version 2.0"),
        (Gpx, "<gpx version=\"1.1\"><rte>", "<rte> does not end"),
        (Gpx, "<kml/>", "its root is <kml>"),
        (Gpx, "<gpx version=\"1.1\"><wpt lat=\"x\" lon=\"2\"/></gpx>", "`x` is no number"),
        (GeoJson, point, "latitude 91"),
        (GeoJson, r#"{"type":"Topology"}"#, "Topology is not defined"),
        (GeoJson, r#"{"type":"Polygon","coordinates":[[[0,0],[1,1],[0,0]]]}"#, "2 corners"),
        (
            Kml,
            "<kml><Placemark><Point><coordinates>1;2</coordinates></Point></Placemark></kml>",
            "`1;2` is no position",
        ),
        (Kml, "<kml><Placemark><Polygon/></Placemark></kml>", "no outer boundary"),
    ] {
        let error = read_plan(text, format).expect_err(text).to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}

#[test]
fn commands_that_have_no_counterpart_are_kept_and_named() {
    let list = "QGC WPL 110\n\
        1 0 3 82 0 0 0 0 48.1 2.1 30 1\n\
        2 0 3 16 0 5 3 90 48.2 2.2 30 1\n\
        3 0 3 16 0 0 0 0 0 0 30 1\n";
    let plan = read_plan(list, PlanFormat::WaypointList).expect("it can be read");
    let notes: Vec<String> = plan.notes.iter().map(ToString::to_string).collect();
    assert_eq!(notes.len(), 3, "{notes:?}");
    assert!(notes[0].contains("82 has no counterpart"), "{notes:?}");
    assert!(notes[1].contains("2 = 5, 3 = 3, 4 = 90"), "{notes:?}");
    // A waypoint at zero means "here", which no position expresses.
    assert!(matches!(plan.routes[0].items[2], PlanItem::Other(_)));
}

#[test]
fn a_file_is_known_by_the_end_of_its_name() {
    assert_eq!(PlanFormat::of_file_name("a/b.PLAN"), Some(PlanFormat::GroundControl));
    assert_eq!(PlanFormat::of_file_name("field.waypoints"), Some(PlanFormat::WaypointList));
    assert_eq!(PlanFormat::of_file_name("field.xml"), None);
}
