//! Where robots go on the map when a step ends early.

use std::collections::HashMap;

use armor_geo::{MapPoint, ShortestPath};
use armor_robotfile::{DrivePurpose, Mission, list_drives};

use crate::item::Item;

/// The path from a step to the point where the robot goes when the step ends early.
pub struct SceneExit {
    /// The step.
    pub of: Item,
    /// From its worst point, that is farthest from the other one by path, to the rally point or the start
    /// of the route; around zones, if the path leads there.
    pub points: Vec<MapPoint>,
}

/// The points to which the exits of each step lead: its net has a place `route.step.to-POINT` for
/// each.
pub(super) struct ExitTargets<'a> {
    targets: HashMap<&'a str, Vec<&'a str>>,
    /// The longest path of each exit that leads around zones, by `ROUTE.STEP.POINT`.
    around: HashMap<String, ShortestPath>,
}

impl<'a> ExitTargets<'a> {
    /// The exits of a mission. `is_still`: its points are shown where they are drawn, and not being dragged;
    /// only then paths are led around zones.
    pub(super) fn of(mission: &'a Mission, is_still: bool) -> Self {
        let mut found: HashMap<&str, Vec<&str>> = HashMap::new();
        for place in &mission.places {
            let name = place.name.value.as_str();
            let mut dots = name.match_indices('.').map(|(at, _)| at);
            let (Some(_), Some(end)) = (dots.next(), dots.next()) else { continue };
            let last = name.rsplit('.').next().unwrap_or_default();
            let Some(target) = last.strip_prefix("to-") else { continue };
            let targets = found.entry(&name[..end]).or_default();
            if !targets.contains(&target) {
                targets.push(target);
            }
        }
        let around = if is_still { find_around(mission) } else { HashMap::new() };
        Self { targets: found, around }
    }

    pub(super) fn of_step(&self, route: &str, step: &str) -> &[&'a str] {
        self.targets.get(format!("{route}.{step}").as_str()).map_or(&[], Vec::as_slice)
    }

    /// The points of the longest path from a step to a point, if it leads around zones.
    pub(super) fn around(&self, route: &str, step: &str, point: &str) -> Option<&[MapPoint]> {
        let path = self.around.get(&format!("{route}.{step}.{point}"))?;
        Some(&path.points)
    }
}

fn find_around(mission: &Mission) -> HashMap<String, ShortestPath> {
    let mut found: HashMap<String, ShortestPath> = HashMap::new();
    for drive in list_drives(mission) {
        let DrivePurpose::Exit { point, around: Some(path), .. } = drive.purpose else { continue };
        let step = format!("{}.{}.{}", drive.route.name.value, drive.step.value, point.name.value);
        // A leg that a line divides has several.
        let is_longest = found.get(&step).is_none_or(|known| known.length_m < path.length_m);
        if is_longest {
            found.insert(step, path);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exit_around_a_zone_is_drawn_around_it() {
        let text = "<armor version='1'><system><component name='way' kind='patrol'/></system>\
            <mission goal='over' safe='hold'><map><point name='P0' at='0 0'/>\
            <point name='P1' at='4 0'/><rally name='R1' at='2 6'/>\
            <zone name='z' kind='no-go' shape='-2,2 6,2 6,3 -2,3'/></map>\
            <route name='red' mover='way.route' start='P0' out='over'><leg name='l1' to='P1'/>\
            <otherwise on='blocked' do='rally'/></route><place name='over'/><place name='hold'/>\
            </mission></armor>";
        let read = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(text.as_bytes().to_vec()));
        let mission = read.configuration.and_then(|it| it.mission).expect("a mission");
        let exits = ExitTargets::of(&mission, true);
        assert_eq!(exits.of_step("red", "l1"), ["R1"]);
        let points = exits.around("red", "l1", "R1").expect("it bends");
        // From the middle of the leg, past an end of the zone.
        assert!(points.len() == 4 && (points[0].x_m() - 2.0).abs() < 0.1, "{points:?}");
        assert!(points[1].y_m() < 2.0 && points[2].y_m() > 3.0, "{points:?}");
        assert_eq!(ExitTargets::of(&mission, false).around("red", "l1", "R1"), None);
    }
}
