//! Maps in the world: both directions, and the fit by pairs of points.

use armor_geo::{FitError, GeoError, GeoPosition, MapPlacement, MapPoint, ScaleChoice, fit_map};

fn point(x: f64, y: f64) -> MapPoint {
    MapPoint::new(x, y).expect("valid")
}

fn tower() -> GeoPosition {
    GeoPosition::new(48.8583, 2.2945, 35.0).expect("valid")
}

#[test]
fn a_map_reaches_the_world_and_back_at_any_height() {
    let mut random = fastrand::Rng::with_seed(7);
    for _ in 0..1_000 {
        let origin = GeoPosition::new(
            170.0 * random.f64() - 85.0,
            360.0 * random.f64(),
            3_000.0 * random.f64(),
        )
        .unwrap();
        let heading_rad = 7.0 * random.f64();
        let scale = 0.5 + random.f64();
        let placement = MapPlacement::new(origin, heading_rad, scale).unwrap();
        let there = point(2e5 * (random.f64() - 0.5), 2e5 * (random.f64() - 0.5));
        let height_m = 1_000.0 * random.f64();
        let position = placement.geo_from_map_at(there, height_m).unwrap();
        assert!((position.height_m() - height_m).abs() < 1e-6);
        let back = placement.map_from_geo(position).unwrap();
        assert!(back.distance_m(there) < 1e-5, "{there:?} {back:?}");
    }
}

#[test]
fn y_points_to_the_heading_and_x_to_the_right_of_it() {
    let east = MapPlacement::new(tower(), 90_f64.to_radians(), 1.0).unwrap();
    let ahead = east.geo_from_map(point(0.0, 100.0)).unwrap();
    assert!(ahead.longitude_deg() > 2.2945 && (ahead.latitude_deg() - 48.8583).abs() < 1e-6);
    let right = east.geo_from_map(point(100.0, 0.0)).unwrap();
    assert!(right.latitude_deg() < 48.8583 && (right.longitude_deg() - 2.2945).abs() < 1e-6);
}

#[test]
fn pairs_fix_turn_position_and_scale_and_leave_residuals() {
    let truth = MapPlacement::new(tower(), 0.7, 1.25).unwrap();
    let corners = [point(0.0, 0.0), point(400.0, 10.0), point(380.0, 300.0), point(-20.0, 310.0)];
    let mut pairs: Vec<_> = corners.iter().map(|p| (*p, truth.geo_from_map(*p).unwrap())).collect();
    let fitted = fit_map(&pairs, ScaleChoice::Fitted).unwrap();
    assert!((fitted.placement.heading_rad() - 0.7).abs() < 1e-9);
    assert!((fitted.placement.scale() - 1.25).abs() < 1e-9);
    assert!(fitted.rms_m() < 1e-5, "{fitted:?}");

    // In metres the scale stays 1, and the residuals show that it does not fit.
    let rigid = fit_map(&pairs[..2], ScaleChoice::Metres).unwrap();
    assert!((rigid.placement.heading_rad() - 0.7).abs() < 1e-4);
    let length_m = corners[0].distance_m(corners[1]);
    for residual in &rigid.residuals_m {
        assert!((residual - 0.125 * length_m).abs() < 1e-3, "{rigid:?}");
    }

    // One pair that is 1 m wrong is where the largest residual is.
    pairs[2].0 = point(381.0, 300.0);
    let wrong = fit_map(&pairs, ScaleChoice::Fitted).unwrap();
    let largest = wrong.residuals_m.iter().copied().fold(0.0, f64::max);
    assert_eq!(wrong.residuals_m[2], largest, "{wrong:?}");
    assert!((0.1..1.25).contains(&largest));
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let here = (point(0.0, 0.0), tower());
    let there = (point(10.0, 0.0), GeoPosition::new(48.859, 2.2945, 35.0).unwrap());
    let fit = |pairs: &[_]| fit_map(pairs, ScaleChoice::Fitted).unwrap_err();
    assert_eq!(fit(&[here]), FitError::TooFewPairs { found: 1 });
    assert_eq!(fit(&[here, here]), FitError::NoSpread);
    assert_eq!(fit(&[here, (here.0, there.1)]), FitError::NoSpread);
    // The map turned by half a turn for one half of the pairs.
    let mirrored = [here, there, (here.0, there.1), (there.0, here.1)];
    assert_eq!(fit(&mirrored), FitError::NoDirection);
    let far = (point(10.0, 0.0), GeoPosition::new(-48.0, 2.0, 0.0).unwrap());
    assert!(matches!(fit(&[here, far]), FitError::Position(GeoError::Scale { .. })));
}
