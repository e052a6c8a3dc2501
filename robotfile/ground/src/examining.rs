//! The drives of a mission compared with the ground.

use std::collections::{BTreeMap, BTreeSet};

use armor_geo::{Clearance, MapPoint};
use armor_grid::Grid;
use armor_robotfile::timing::{DriveLengths, StraightLengths};
use armor_robotfile::{
    Code, DrivePurpose, Finding, Findings, Mission, RouteDrive, System, check_times, list_drives,
};

use crate::ground::{Obstacle, ObstacleSort, OpenGround, SiteGround};

/// A rally point is nearer by path only if its path is shorter by this share: paths over a grid are up to
/// 8 % longer than those that a robot drives.
const NEARER: f64 = 0.9;
/// Most bytes of the lengths that are kept to choose between rally points.
const MAX_LENGTHS: usize = 256 << 20;

/// Returns what is wrong with the drives of a mission over this ground, and with its times if drives are
/// as long as the paths over it.
pub fn examine_drives(mission: &Mission, system: &System, ground: &SiteGround) -> Findings {
    let mut findings = Findings::default();
    let drives = list_drives(mission);
    let grounds = RouteGrounds::new(&drives, ground);
    let mut blocked: BTreeSet<&str> = BTreeSet::new();
    let mut reported: BTreeSet<(&str, &str)> = BTreeSet::new();
    for drive in &drives {
        let route = drive.route.name.value.as_str();
        let Some(open) = grounds.of(drive.radius()) else { continue };
        let Some(obstacle) = find_obstacle(open, drive) else { continue };
        // The robot never gets to what comes behind a leg that is blocked.
        if blocked.contains(route) || !reported.insert((route, drive.step.value.as_str())) {
            continue;
        }
        if matches!(drive.purpose, DrivePurpose::Leg { .. }) {
            blocked.insert(route);
        }
        findings.push(report_obstacle(drive, &obstacle));
    }
    if blocked.is_empty() {
        find_nearer_rallies(&drives, &grounds, &mut findings);
    }
    let times = check_times(mission, system, &grounds);
    findings.extend(times);
    findings
}

/// Calls `predict` with the lengths of the paths of a mission's drives over this ground.
pub fn with_path_lengths<R>(
    mission: &Mission,
    ground: &SiteGround,
    predict: impl FnOnce(&dyn DriveLengths) -> R,
) -> R {
    predict(&RouteGrounds::new(&list_drives(mission), ground))
}

fn find_obstacle(open: &OpenGround<'_>, drive: &RouteDrive<'_>) -> Option<Obstacle> {
    match drive.purpose {
        DrivePurpose::Leg { is_straight: true } => open.find_on_line(drive.from[0], drive.to),
        _ => drive.from.iter().find_map(|from| open.find_obstacle(*from, drive.to)),
    }
}

fn report_obstacle(drive: &RouteDrive<'_>, obstacle: &Obstacle) -> Finding {
    let at = format!("{:.1} {:.1}", obstacle.at.x_m, obstacle.at.y_m);
    let blocked = match &obstacle.sort {
        ObstacleSort::Wall => format!("a wall at {at}"),
        ObstacleSort::Unknown => format!("the grid does not know what is at {at}"),
        ObstacleSort::Zone(zone) => format!("zone {zone} at {at}"),
        ObstacleSort::Boundary(zone) => format!("the boundary of {zone} at {at}"),
        ObstacleSort::Narrow => {
            format!("there is too little room at {at} for {} m", drive.radius().metres())
        }
        ObstacleSort::Outside => format!("{at} is not on the grid"),
    };
    let step = &drive.step.value;
    match &drive.purpose {
        DrivePurpose::Leg { is_straight } => {
            let path = if *is_straight { "the straight line" } else { "no path" };
            let message = match is_straight {
                true => format!("{path} of {step} is not free: {blocked}"),
                false => format!("{path} over the grid leads along {step}: {blocked}"),
            };
            let remedy = match is_straight {
                true => "leave out way=\"straight\", or move the point",
                false => "move the point, or save a new grid if the site has changed",
            };
            Finding::new(Code::PathBlocked, &drive.step.at, message).remedy(remedy)
        }
        DrivePurpose::Exit { exit, point, .. } => {
            let name = &point.name.value;
            let message = format!("no path over the grid leads from {step} to {name}: {blocked}");
            Finding::new(Code::PathBlocked, &drive.step.at, message)
                .remedy("draw a rally point on this side of it; or write do=\"hold\"")
                .related(&exit.action.at, "this exit")
                .related(&point.name.at, "leads here")
        }
    }
}

/// Reports exits to the rally point that is nearest on the drawing, where another one is nearer over the
/// grid.
fn find_nearer_rallies(
    drives: &[RouteDrive<'_>],
    grounds: &RouteGrounds<'_>,
    findings: &mut Findings,
) {
    let mut measured = MeasuredPaths { kept: BTreeMap::new(), bytes: 0 };
    for drive in drives {
        let DrivePurpose::Exit { exit, point, others, .. } = &drive.purpose else { continue };
        let Some(open) = grounds.of(drive.radius()).filter(|_| !others.is_empty()) else {
            continue;
        };
        let Some(own_m) = measured.worst_m(open, drive, drive.to) else { continue };
        let length = |to: MapPoint, measured: &mut MeasuredPaths| measured.worst_m(open, drive, to);
        let nearer = others.iter().filter_map(|other| {
            let length_m = length(other.position.value.point, &mut measured)?;
            (length_m < own_m * NEARER).then_some((other, length_m))
        });
        let Some((nearest, length_m)) = nearer.min_by(|one, two| one.1.total_cmp(&two.1)) else {
            continue;
        };
        let (step, own, other) = (&drive.step.value, &point.name.value, &nearest.name.value);
        let message = format!(
            "from {step} the path over the grid to {other} is {length_m:.1} m long, and that to {own}, \
             which is nearer on the drawing and is taken, {own_m:.1} m"
        );
        let finding = Finding::new(Code::RallyFarther, &drive.step.at, message);
        findings.push(
            finding
                .remedy(format!("write to=\"{other}\" at the exit, or move {own}"))
                .related(&exit.action.at, "this exit"),
        );
    }
}

/// The lengths of the paths to points, each measured once.
struct MeasuredPaths {
    kept: BTreeMap<[u64; 3], Grid<u32>>,
    bytes: usize,
}

impl MeasuredPaths {
    /// The length of the path to a point from the farther end of a drive's begin.
    fn worst_m(
        &mut self,
        open: &OpenGround<'_>,
        drive: &RouteDrive<'_>,
        to: MapPoint,
    ) -> Option<f64> {
        let key = [to.x_m(), to.y_m(), drive.radius().metres()].map(f64::to_bits);
        if !self.kept.contains_key(&key) {
            let lengths = open.measure_to(to);
            let bytes = lengths.geometry().len() * size_of::<u32>();
            if self.bytes + bytes > MAX_LENGTHS {
                self.kept.clear();
                self.bytes = 0;
            }
            self.bytes += bytes;
            self.kept.insert(key, lengths);
        }
        let lengths = self.kept.get(&key)?;
        let [one, other] = drive.from.map(|from| open.measured_m(lengths, from));
        Some(one?.max(other?))
    }
}

/// The ground for the robots of each route.
struct RouteGrounds<'a> {
    of_radius: Vec<(Clearance, OpenGround<'a>)>,
}

impl<'a> RouteGrounds<'a> {
    fn new(drives: &[RouteDrive<'_>], ground: &'a SiteGround) -> Self {
        let mut of_radius: Vec<(Clearance, OpenGround<'a>)> = Vec::new();
        for drive in drives {
            let radius = drive.radius();
            if !of_radius.iter().any(|(known, _)| known.metres() == radius.metres()) {
                of_radius.push((radius, ground.open_for(radius)));
            }
        }
        Self { of_radius }
    }

    fn of(&self, radius: Clearance) -> Option<&OpenGround<'a>> {
        let found = self.of_radius.iter().find(|(known, _)| known.metres() == radius.metres());
        found.map(|(_, open)| open)
    }
}

impl DriveLengths for RouteGrounds<'_> {
    fn length_m(&self, from: MapPoint, to: MapPoint, radius: Clearance) -> f64 {
        let length_m = self.of(radius).and_then(|open| open.length_m(from, to));
        length_m.unwrap_or_else(|| from.distance_m(to))
    }

    fn directions_rad(&self, from: MapPoint, to: MapPoint, radius: Clearance) -> Option<[f64; 2]> {
        let of_path = self.of(radius).and_then(|open| open.directions_rad(from, to));
        of_path.or_else(|| StraightLengths.directions_rad(from, to, radius))
    }
}
