//! Driving among zones in closed loop; the robot's true place is checked, not the one it believes.

use armor_geo::{Clearance, MapArea, MapCircle, MapPoint, MapPolygon};
use armor_zones::{MapZone, ZoneDuty};

use super::*;

fn rectangle(min: (f64, f64), max: (f64, f64)) -> MapArea {
    let corners = [min, (max.0, min.1), max, (min.0, max.1)];
    let corners = corners.map(|(x, y)| MapPoint::new(x, y).expect("a point"));
    MapPolygon::new(corners.into()).expect("a polygon").into()
}

fn circle(x_m: f64, y_m: f64, radius_m: f64) -> MapArea {
    let radius = Clearance::new(radius_m).expect("a radius");
    MapCircle::new(MapPoint::new(x_m, y_m).expect("a point"), radius).expect("a circle").into()
}

fn zones(zones: &[(ZoneDuty, f64, MapArea)]) -> ZoneMap {
    let zone = |(number, (duty, margin_m, area)): (usize, &(ZoneDuty, f64, MapArea))| MapZone {
        name: format!("zone-{number}"),
        duty: *duty,
        margin: Clearance::new(*margin_m).expect("a margin"),
        area: area.clone(),
    };
    ZoneMap::new(zones.iter().enumerate().map(zone).collect()).expect("zones")
}

impl Trial {
    fn room_m(&self, zones: &ZoneMap) -> f64 {
        zones.room_m(self.world.robot.point())
    }
}

/// A path straight through a zone, as of a planner that does not know it.
#[test]
fn it_stops_before_a_no_go_zone_that_its_path_leads_into() {
    let zones = zones(&[(ZoneDuty::NoGo, 0.1, rectangle((2.5, 0.2), (3.2, 1.7)))]);
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    trial.driving.zones_seen(zones.clone());
    let path: Vec<Pose2> =
        (0..60).map(|step| Pose2::new(1.0 + 0.05 * f64::from(step), 1.0, 0.0)).collect();
    for _ in 0..400 {
        trial.sense();
        trial.driving.path_seen(trial.now_s, path.clone());
        trial.move_on();
        assert!(trial.room_m(&zones) > 0.18, "{:?}", trial.world.robot);
    }
    assert_eq!(trial.driving.phase(), DrivingPhase::AtZone);
    assert_eq!(trial.driving.zone_ahead(), Some("zone-0"));
    assert_eq!(trial.driving.command, Velocity::ZERO);
    assert!(trial.room_m(&zones) < 0.35, "as near as it may: {:?}", trial.world.robot);
}

#[test]
fn a_manual_velocity_does_not_lead_into_a_no_go_zone() {
    let zones = zones(&[(ZoneDuty::NoGo, 0.0, circle(3.0, 1.0, 0.6))]);
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    trial.driving.zones_seen(zones.clone());
    for _ in 0..400 {
        trial.tick_manually(Velocity { speed_mps: 0.6, turn_radps: 0.0 });
        assert!(trial.room_m(&zones) > 0.18, "{:?}", trial.world.robot);
    }
    assert!(trial.room_m(&zones) < 0.4, "{:?}", trial.world.robot);
}

#[test]
fn it_is_slow_in_a_speed_zone_and_fast_before_and_after() {
    let (limit_mps, area) = (0.2, rectangle((2.2, 0.0), (3.0, 5.0)));
    let zones = zones(&[(ZoneDuty::Speed { limit_mps }, 0.0, area)]);
    let mut walls = BoxWalls(Vec::new());
    walls.line(&[(0.0, 0.0), (8.0, 0.0), (8.0, 5.0), (0.0, 5.0), (0.0, 0.0)]);
    let mut trial = Trial::new(walls, TAU, EXACT);
    trial.driving.zones_seen(zones.clone());
    let goal = Pose2::new(6.0, 1.0, 0.0);
    let (mut before_mps, mut after_mps, mut ticks_inside) = (0.0_f64, 0.0_f64, 0);
    while trial.away_m(goal) > 0.2 {
        let from = trial.world.robot.point();
        trial.tick(Some(goal));
        let here = trial.world.robot.point();
        let speed_mps = from.distance_m(here) / TICK_S;
        let outline_m = zones.speed_limits(here).next().expect("a zone").1 - 0.18;
        if outline_m < 0.0 {
            assert!(speed_mps < limit_mps + 0.01, "{speed_mps} m/s at {here:?}");
            ticks_inside += 1;
        } else if here.x_m < 2.2 {
            before_mps = before_mps.max(speed_mps);
        } else {
            after_mps = after_mps.max(speed_mps);
        }
        assert!(trial.now_s < 160.0, "{here:?}");
    }
    assert!(ticks_inside > 50 && before_mps > 0.5 && after_mps > 0.5, "{before_mps} {after_mps}");
}

#[test]
fn out_of_a_zone_that_has_appeared_it_drives_by_itself_and_never_deeper() {
    let zones = zones(&[(ZoneDuty::NoGo, 0.1, rectangle((0.4, 0.4), (2.6, 1.6)))]);
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    for _ in 0..5 {
        trial.tick(None);
    }
    trial.planning.zones_seen(zones.clone());
    trial.driving.zones_seen(zones.clone());
    let goal = Pose2::new(0.7, 4.2, 0.0);
    let mut most_m = trial.room_m(&zones);
    assert!(most_m < -0.6, "{most_m} m");
    while trial.away_m(goal) > 0.2 {
        trial.tick(Some(goal));
        let room_m = trial.room_m(&zones);
        assert!(room_m > most_m.min(0.2) - 0.03, "{room_m} m after {most_m} m");
        most_m = most_m.max(room_m);
        assert!(trial.now_s < 160.0, "{:?}", trial.world.robot);
    }
}

#[test]
fn with_noise_the_true_robot_is_never_in_a_no_go_zone() {
    let mut nearest_m = f64::INFINITY;
    for seed in 0..8 {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut drawn = vec![(ZoneDuty::NoGo, 0.15, rectangle((1.7, 1.8), (2.5, 2.6)))];
        // In the right room, off the door and the places of the tour.
        let (x_m, y_m) = (6.2 + 0.4 * random.f64(), 1.4 + 0.6 * random.f64());
        drawn.push((ZoneDuty::NoGo, 0.15, circle(x_m, y_m, 0.2 + 0.2 * random.f64())));
        let zones = zones(&drawn);
        let noise = Noise { range_m: 0.015, pose_m: 0.02, odometry: 0.05, seed };
        let mut trial = Trial::new(two_rooms(1.0), TAU, noise);
        trial.planning.zones_seen(zones.clone());
        trial.driving.zones_seen(zones.clone());
        for goal in TOUR {
            let until_s = trial.now_s + 90.0;
            while trial.away_m(goal) > 0.25 {
                trial.tick(Some(goal));
                let outline_m = trial.room_m(&zones) - 0.18;
                nearest_m = nearest_m.min(outline_m);
                assert!(outline_m > -0.15, "{seed}: in a zone at {:?}", trial.world.robot);
                assert!(trial.now_s < until_s, "{seed}: {goal:?} from {:?}", trial.world.robot);
            }
        }
    }
    println!("the outline came as near as {nearest_m:.3} m to the margin");
}
