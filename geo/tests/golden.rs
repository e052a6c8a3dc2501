//! The conversions against the values of GeographicLib in golden.csv, which golden.sh writes.

use armor_geo::{EcefPosition, EnuFrame, EnuPosition, GeoPosition, UtmZone};

const TOLERANCE_M: f64 = 1e-5;

fn assert_near(what: &str, line: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{what}: {found}, not {expected}: {line}");
    }
}

/// Positions apart in metres, also at the poles.
fn distance_m(a: GeoPosition, b: GeoPosition) -> f64 {
    let (a, b) = (EcefPosition::from(a), EcefPosition::from(b));
    (a.x_m - b.x_m).hypot(a.y_m - b.y_m).hypot(a.z_m - b.z_m)
}

#[test]
fn golden_positions_are_converted_as_by_geographiclib_and_back() {
    let text = include_str!("golden.csv");
    let lines: Vec<_> = text.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(lines.len(), 36);
    let mut in_grid = 0;
    for line in lines {
        let fields: Vec<_> = line.split(',').collect();
        let number = |index: usize| fields[index].parse::<f64>().unwrap();
        let numbers = |range: std::ops::Range<usize>| range.map(number).collect::<Vec<_>>();
        let position = GeoPosition::new(number(0), number(1), number(2)).unwrap();

        let ecef = EcefPosition::from(position);
        let expected = numbers(3..6);
        assert_near("ECEF", line, &[ecef.x_m, ecef.y_m, ecef.z_m], &expected, TOLERANCE_M);
        let golden = EcefPosition { x_m: expected[0], y_m: expected[1], z_m: expected[2] };
        let back = GeoPosition::try_from(golden).unwrap();
        assert!(distance_m(back, position) < TOLERANCE_M, "from ECEF: {back:?}: {line}");

        let origin = GeoPosition::new(number(6), number(7), number(8)).unwrap();
        let frame = EnuFrame::new(origin);
        let enu = frame.enu_from_geo(position);
        let expected = numbers(9..12);
        assert_near("ENU", line, &[enu.east_m, enu.north_m, enu.up_m], &expected, TOLERANCE_M);
        let golden = EnuPosition { east_m: expected[0], north_m: expected[1], up_m: expected[2] };
        let back = frame.geo_from_enu(golden).unwrap();
        assert!(distance_m(back, position) < TOLERANCE_M, "from ENU: {back:?}: {line}");

        if fields[12] == "-" {
            assert!(UtmZone::of(position).is_err(), "{line}");
            continue;
        }
        in_grid += 1;
        let zone = UtmZone::of(position).unwrap();
        assert_eq!(format!("{:0>3}", zone.to_string()), fields[12], "{line}");
        let grid = zone.utm_from_geo(position).unwrap();
        let expected = numbers(13..17);
        assert_near("UTM", line, &[grid.easting_m, grid.northing_m], &expected[..2], TOLERANCE_M);
        let bend = [grid.convergence_rad.to_degrees(), grid.scale];
        assert_near("convergence and scale", line, &bend, &expected[2..], 1e-11);
        let back = zone.geo_from_utm(expected[0], expected[1], position.height_m()).unwrap();
        assert!(distance_m(back, position) < TOLERANCE_M, "from UTM: {back:?}: {line}");
    }
    assert_eq!(in_grid, 28);
}

/// The exceptions among the zones, EPSG 3857 by its textbook formula ln(tan(45° + φ/2)), tiles.
#[test]
fn zones_and_tiles_are_those_of_their_definitions() {
    use armor_geo::{GeoError, MercatorPosition, TileNumber};
    let zone = |latitude, longitude| {
        UtmZone::of(GeoPosition::new(latitude, longitude, 0.0).unwrap()).map(UtmZone::number)
    };
    assert_eq!(zone(55.9999, 3.5), Ok(31));
    assert_eq!(zone(56.0, 3.5), Ok(32));
    assert_eq!(zone(64.0, 3.5), Ok(31));
    assert_eq!(zone(72.0, 33.0), Ok(37));
    assert_eq!(zone(71.9, 33.0), Ok(36));
    assert_eq!(zone(0.0, 180.0), Ok(1));
    assert_eq!(zone(0.0, 179.999_999_999_999_97), Ok(60));
    assert_eq!(zone(84.1, 0.0), Err(GeoError::OutsideUtm { latitude_deg: 84.1 }));

    // The Eiffel tower at zoom 15, as OpenStreetMap numbers it.
    let tower = GeoPosition::new(48.8583, 2.2945, 0.0).unwrap();
    let (tile, right, down) = TileNumber::containing(tower, 15).unwrap();
    assert_eq!((tile.x(), tile.y()), (16_592, 11_272));
    let there = GeoPosition::try_from(tile.mercator_at(right, down)).unwrap();
    assert!(distance_m(there, tower) < 1e-6, "{there:?}");
    let plane = MercatorPosition::try_from(tower).unwrap();
    let expected = [255_422.571_625_2, 6_250_851.981_640_3];
    assert_near("EPSG 3857", "tower", &[plane.x_m, plane.y_m], &expected, 1e-6);
    let corner = TileNumber::new(0, 0, 0).unwrap().mercator_at(0.0, 0.0);
    assert!((corner.x_m + 20_037_508.342_789_244).abs() < 1e-6);
    let corner = GeoPosition::try_from(corner).unwrap();
    assert!((corner.latitude_deg() - armor_geo::MAX_MERCATOR_LATITUDE_DEG).abs() < 1e-12);
    assert!(TileNumber::new(3, 8, 0).is_err() && TileNumber::new(31, 0, 0).is_err());
}
