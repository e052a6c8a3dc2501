//! "Did you mean …?"

use crate::limits::MAX_SIMILAR;

/// Returns the names nearest to `wanted`, nearest first: those with at most a third of their
/// letters different, or with the same output or the same component.
pub(crate) fn find_similar<'a>(wanted: &str, names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let parts = |name: &str| name.split_once('.').map(|(a, b)| (a.to_owned(), b.to_owned()));
    let wanted_parts = parts(wanted);
    let mut near: Vec<(usize, &str)> = names
        .filter_map(|name| {
            let distance = strsim::levenshtein(wanted, name);
            let shares = match (&wanted_parts, parts(name)) {
                (Some((a, b)), Some((c, d))) => *a == c || *b == d,
                _ => false,
            };
            (shares || distance * 3 <= wanted.len()).then_some((distance, name))
        })
        .collect();
    near.sort_unstable();
    near.into_iter().map(|(_, name)| name).take(MAX_SIMILAR).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_names_come_first_and_strangers_not_at_all() {
        let names = ["lidar.scan", "lidar.scans", "base.odometry", "camera.image", "rear.scan"];
        let near = |wanted| find_similar(wanted, names.into_iter());
        assert_eq!(near("lidra.scan"), ["lidar.scan", "lidar.scans", "rear.scan"]);
        assert_eq!(near("base.odom"), ["base.odometry"]);
        assert!(near("arm.joints").is_empty());
    }
}
