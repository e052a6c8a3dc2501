//! What does not exist is refused, and nothing panics, whatever the numbers are.

use armor_geo::{
    Clearance, EcefPosition, EnuFrame, EnuPosition, GeoError, GeoPosition, MapArea, MapCircle,
    MapPlacement, MapPoint, MapPolygon, MapPolyline, MapSegment, MercatorPosition, ScaleChoice,
    ShapeError, TileNumber, UtmZone, fit_map,
};

fn polygon(corners: &[(f64, f64)]) -> Result<MapPolygon, ShapeError> {
    let corners = corners.iter().map(|(x, y)| MapPoint::new(*x, *y)).collect::<Result<_, _>>()?;
    MapPolygon::new(corners)
}

#[test]
fn polygons_are_simple() {
    let crossing = |first, second| Err(ShapeError::CrossingEdges { first, second });
    type Case = (&'static [(f64, f64)], Result<(), ShapeError>);
    let cases: [Case; 9] = [
        (&[(0.0, 0.0), (4.0, 0.0), (0.0, 4.0)], Ok(())),
        (&[(0.0, 4.0), (4.0, 0.0), (0.0, 0.0)], Ok(())),
        // Not convex.
        (&[(0.0, 0.0), (4.0, 0.0), (1.0, 1.0), (0.0, 4.0)], Ok(())),
        // A bow tie.
        (&[(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)], crossing(1, 3)),
        // On one line, forth and back.
        (&[(0.0, 0.0), (4.0, 0.0), (2.0, 0.0)], crossing(1, 2)),
        // A spike.
        (&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (4.0, 2.0), (0.0, 2.0)], crossing(2, 3)),
        // A corner on another edge.
        (&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 0.0), (0.0, 4.0)], crossing(1, 3)),
        (&[(0.0, 0.0), (0.0, 0.0), (4.0, 4.0)], Err(ShapeError::RepeatedPoint { index: 1 })),
        (&[(0.0, 0.0), (4.0, 0.0)], Err(ShapeError::TooFewPoints { found: 2, needed: 3 })),
    ];
    for (corners, expected) in cases {
        assert_eq!(polygon(corners).map(|_| ()), expected, "{corners:?}");
    }
    let many = vec![(0.0, 0.0); 1_025];
    assert_eq!(polygon(&many), Err(ShapeError::TooManyPoints { found: 1_025, max: 1_024 }));
}

#[test]
fn errors_name_what_was_wrong() {
    assert_eq!(GeoPosition::new(91.0, 0.0, 0.0), Err(GeoError::Latitude { latitude_deg: 91.0 }));
    assert_eq!(
        GeoPosition::new(0.0, 361.0, 0.0).unwrap_err().to_string(),
        "longitude 361° is not between -360° and 360°"
    );
    let centre = EcefPosition { x_m: 0.0, y_m: 1.0, z_m: 0.0 };
    assert_eq!(GeoPosition::try_from(centre), Err(GeoError::TooDeep { distance_m: 1.0 }));
    assert_eq!(Clearance::new(-1.0), Err(ShapeError::Length { value: -1.0 }));
    let centre = MapPoint::new(0.0, 0.0).unwrap();
    assert_eq!(MapCircle::new(centre, Clearance::ZERO), Err(ShapeError::Radius));
    assert_eq!(UtmZone::new(61, true), Err(GeoError::UtmZoneNumber { number: 61 }));
}

/// Every constructor and conversion with the worst numbers that exist.
#[test]
fn no_number_causes_a_panic() {
    let worst = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.1,
        84.0,
        -80.0,
        90.0,
        -90.0,
        180.0,
        -180.0,
        360.0,
        1e8,
        -1e8,
        6.4e6,
        1e-15,
        1e-300,
        f64::MIN_POSITIVE,
        f64::EPSILON,
        1e300,
        f64::MAX,
        f64::MIN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    let origin = GeoPosition::new(48.0, 2.0, 0.0).unwrap();
    let frame = EnuFrame::new(origin);
    let zone = UtmZone::new(31, true).unwrap();
    let mut accepted = 0_usize;
    for a in worst {
        accepted += usize::from(Clearance::new(a).is_ok());
        accepted += usize::from(MapPlacement::new(origin, a, a).is_ok());
        for b in worst {
            let plane = MercatorPosition { x_m: a, y_m: b };
            accepted += usize::from(GeoPosition::try_from(plane).is_ok());
            for c in worst {
                let enu = EnuPosition { east_m: a, north_m: b, up_m: c };
                for position in [
                    GeoPosition::new(a, b, c),
                    GeoPosition::try_from(EcefPosition { x_m: a, y_m: b, z_m: c }),
                    frame.geo_from_enu(enu),
                    zone.geo_from_utm(a, b, c),
                ]
                .into_iter()
                .flatten()
                {
                    assert!(position.latitude_deg().abs() <= 90.0);
                    assert!((-180.0..180.0).contains(&position.longitude_deg()), "{position:?}");
                    accepted += usize::from(UtmZone::of(position).is_ok());
                    accepted += usize::from(zone.utm_from_geo(position).is_ok());
                    accepted += usize::from(TileNumber::containing(position, 30).is_ok());
                    accepted += usize::from(
                        MapPlacement::new(position, a, 1.0)
                            .and_then(|placed| placed.map_from_geo(origin))
                            .is_ok(),
                    );
                }
                accepted += usize::from(compare_shapes(a, b, c));
            }
        }
    }
    assert!(accepted > 10_000, "{accepted}");
}

/// Whether the three numbers make shapes, after all predicates were asked about them.
fn compare_shapes(a: f64, b: f64, c: f64) -> bool {
    let (Ok(p), Ok(q), Ok(r)) = (MapPoint::new(a, b), MapPoint::new(b, c), MapPoint::new(c, a))
    else {
        return false;
    };
    let clearance = Clearance::new(c).unwrap_or(Clearance::ZERO);
    let mut areas: Vec<MapArea> = Vec::new();
    areas.extend(MapPolygon::new(vec![p, q, r]).map(MapArea::from));
    areas.extend(MapCircle::new(p, clearance).map(MapArea::from));
    let leg = MapSegment::new(q, r);
    for area in &areas {
        let inside = leg.stays_within(area, clearance);
        assert!(!inside || leg.intrudes(area, Clearance::ZERO));
        area.locate(r);
    }
    if let Ok(line) = MapPolyline::new(vec![p, q, r]) {
        assert!(line.touches(leg));
    }
    let origin = GeoPosition::new(48.0, 2.0, 0.0).expect("valid");
    let other = GeoPosition::new(48.1, 2.0, 0.0).expect("valid");
    fit_map(&[(p, origin), (q, other)], ScaleChoice::Fitted).is_ok() || !areas.is_empty()
}
