//! Which odometry each scan of the public logs gets, whichever of the two streams is ahead; and that
//! the SDK's history, which finds by the newest stamps, would give some scans another one.

use crate::recorded::{Recorded, recorded};
use armor_grid_slam::pairing::Pairing;
use armor_grid_slam::pose::Pose;

/// How many readings a search in a history looks back.
const HISTORY: usize = 100;

/// The odometry that the scans get if they come `lag` readings after their own, or before it.
fn pair_all(scans: &[Recorded], lag: isize) -> Vec<Pose> {
    let (mut pairing, mut found) = (Pairing::default(), Vec::new());
    let count = scans.len() as isize;
    let in_log = |at: isize| usize::try_from(at).ok().and_then(|at| scans.get(at));
    for step in -lag.abs()..count + lag.abs() {
        if let Some(reading) = in_log(step + lag.max(0)) {
            pairing.odometry_seen(reading.scan.stamp_s, reading.odometry);
        }
        if let Some(scan) = in_log(step - lag.min(0)) {
            pairing.scan_seen(scan.scan.clone());
        }
        found.extend(std::iter::from_fn(|| pairing.next_pair()).map(|(pose, _)| pose));
    }
    assert_eq!(pairing.dropped(), 0);
    found
}

/// As `History::around`, and interpolated: the newest neighbours of the last readings between whose
/// stamps the scan's lies.
fn search_history(scans: &[Recorded], newest: usize, stamp_s: f64) -> Option<Pose> {
    let first = (newest + 1).saturating_sub(HISTORY);
    for at in (first..=newest).rev() {
        let (later_s, later) = (scans[at].scan.stamp_s, scans[at].odometry);
        if later_s == stamp_s {
            return Some(later);
        }
        let earlier = at.checked_sub(1).filter(|at| *at >= first).map(|at| &scans[at]);
        if let Some(Recorded { odometry, scan, .. }) = earlier
            && (scan.stamp_s..later_s).contains(&stamp_s)
        {
            let part = (stamp_s - scan.stamp_s) / (later_s - scan.stamp_s);
            return Some(odometry.towards(&later, part));
        }
    }
    None
}

/// Returns how many scans a history would give another odometry, if the scans lag by so much.
fn check(name: &str) -> usize {
    let Some((scans, _)) = recorded(name) else { return 1 };
    let own: Vec<_> = scans.iter().map(|scan| scan.odometry).collect();
    for lag in [0, 1, 20, -1, -20] {
        let found = pair_all(&scans, lag);
        assert_eq!(found.len(), own.len(), "{name}: {lag} readings ahead");
        let other = found.iter().zip(&own).filter(|(found, own)| found != own).count();
        assert_eq!(other, 0, "{name}: {lag} readings ahead, each scan gets its own odometry");
    }
    let others = [0, 1, 20].map(|lag| {
        let is_other = |at: &usize| {
            let newest = (at + lag).min(scans.len() - 1);
            search_history(&scans, newest, scans[*at].scan.stamp_s) != Some(own[*at])
        };
        (0..scans.len()).filter(is_other).count()
    });
    println!(
        "{name:>13}: {} scans; with a history, {} get another odometry, {} if they come a reading \
         later, {} if 20",
        scans.len(),
        others[0],
        others[1],
        others[2]
    );
    others[2]
}

#[test]
fn every_scan_gets_its_own_odometry_which_a_history_would_not_give() {
    let logs = ["intel", "aces", "freiburg-079", "edmonton", "acapulco"];
    let others: usize = logs.into_iter().map(check).sum();
    assert!(others > 0, "the logs do not need their own pairing: use `data.history`");
}
