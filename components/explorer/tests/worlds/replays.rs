//! How far poses are from the truth in missions that were recorded once, mapped with several seeds:
//! a single run is left to chance as soon as the pose drifts in a corridor.

use crate::kills::{config, error_m, greatest};
use crate::trial::{MappedScan, Trial};
use crate::{conditions, is_full};
use armor_grid_slam::config::Config;
use armor_grid_slam::slam::Slam;

const MISSIONS: u64 = 4;
const MAPPER_SEEDS: u64 = 4;
const OFF_M: f64 = 0.1;

fn map_mission(scans: &[MappedScan], seed: u64) -> Vec<f64> {
    let mut slam = Slam::new(Config { seed, ..config() });
    let place = |MappedScan { odometry, scan, truth }: &MappedScan| {
        error_m(&slam.add(*odometry, scan).pose, truth)
    };
    scans.iter().map(place).collect()
}

/// The share of the poses of all missions in a world that are too far from the truth.
fn share_off(world: &str) -> f64 {
    let mut errors_m = Vec::new();
    for mission in 1..=MISSIONS {
        let scans = Trial::new(&format!("{world}.svg"), conditions(mission)).record();
        errors_m.extend((1..=MAPPER_SEEDS).flat_map(|seed| map_mission(&scans, seed)));
    }
    let off = errors_m.iter().filter(|error_m| **error_m > OFF_M).count();
    let share = off as f64 / errors_m.len() as f64;
    println!(
        "{world}: {:.2} % of {} poses over 0.1 m, at most {:.3} m",
        100.0 * share,
        errors_m.len(),
        greatest(&errors_m)
    );
    share
}

#[test]
fn poses_of_recorded_missions_are_near_the_truth_with_any_seed() {
    if !is_full() {
        println!("missions are replayed with ARMOR_FULL=1 only");
        return;
    }
    // In the ring 11 % were off while parallel walls did not measure the heading. In the warehouse one of
    // the four missions decides: nothing measures the way along its aisles of 9 m, the odometry is off by
    // 1 % of it, and the map beyond an aisle is displaced by that as a whole.
    let limits = [("warehouse", 0.3), ("ring", 0.03), ("hall", 0.01)];
    let shares = limits.map(|(world, limit)| (world, share_off(world), limit));
    assert!(shares.iter().all(|(_, share, limit)| share <= limit), "{shares:?}");
}
