//! The chart as a component: zones of a parameter and the grid of a file out.

use std::path::{Path as FilePath, PathBuf};

use armor_convert::{build_pose, build_zones, parse_zone_map};
use armor_grid::{Occupancy, Pose2};
use armor_map_file::read_map_cells;
use armor_sdk::prelude::*;
use armor_zones::ZoneMap;

/// A map that is turned by less than this is not turned, in radians.
const MAX_TURN_RAD: f64 = 1e-6;

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct ChartParameters {
    /// zones of the map, such as `school no-go margin=2m 3,4 9,4 9,8; hall speed=0.3m/s circle 4,4 2m`;
    /// if none are given, those of the mission's `<map>`
    #[parameter(default = "", format = "zones", parse = parse_zone_map, live)]
    zones: ZoneMap,
    /// map_server YAML file of the grid to publish; none if empty
    #[parameter(default = "", format = "file")]
    grid: Option<PathBuf>,
    /// frame of the zones and the grid: `map`, or `map#EPOCH`
    #[parameter(default = "map")]
    map_frame: String,
}

/// Publishes the zones of a map, and its grid.
pub struct Chart {
    armor: Armor,
    parameters: ChartParameters,
    is_started: bool,
}

impl Component for Chart {
    const KIND: &'static str = "chart";
    const SUMMARY: &'static str = "Publishes the zones of a map, and the grid of a file.";
    const REPORTS_DONE: bool = false;
    const PARAMETERS: &'static [Parameter] = ChartParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("zones", "the zones, at the start and when the parameter changes"),
        ("map", "the grid of the file, at the start; nothing without a file"),
    ];
    const EVENTS: &'static [DeclaredEvent] = &[];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Latched<Zones>>("zones")?;
        armor.provide::<Latched<OccupancyGrid>>("map")?;
        let parameters = ChartParameters::request(&armor)?;
        Ok(Self { armor, parameters, is_started: false })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        // Before the start, nothing can be published; the start publishes all.
        if self.is_started && name == "zones" { self.publish_zones() } else { Ok(()) }
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.is_started = true;
            self.publish_zones()?;
            if let Some(file) = &self.parameters.grid {
                let (stamp_s, frame) = (self.armor.timestamp(), &self.parameters.map_frame);
                self.armor.send_data("map", &read_grid(file, stamp_s, frame)?)?;
            }
        }
        Ok(Outcome::CarryOn)
    }
}

impl Chart {
    fn publish_zones(&self) -> Result<(), Fault> {
        let ChartParameters { zones, map_frame, .. } = &self.parameters;
        self.armor.send_data("zones", &build_zones(self.armor.timestamp(), map_frame, zones))?;
        Ok(())
    }
}

/// Reads the grid of a file as a message.
fn read_grid(file: &FilePath, stamp_s: f64, frame: &str) -> Result<OccupancyGrid, Fault> {
    let (cells, origin) = read_map_cells(file)?;
    if origin.yaw_rad.abs() > MAX_TURN_RAD {
        let name = file.display();
        let why = "its origin is turned, and planners take only grids that are parallel to the \
                   axes of their frame; set the third number of origin to 0.0 and turn the picture";
        return Err(format!("{name}: {why}").into());
    }
    let geometry = cells.geometry();
    let info = MapMetaData {
        map_load_time: stamp_s,
        resolution: geometry.resolution_m as f32,
        width: geometry.width as u32,
        height: geometry.height as u32,
        origin: build_pose(Pose2::new(origin.x_m, origin.y_m, 0.0)),
    };
    let percent = |occupancy: &Occupancy| match occupancy {
        Occupancy::Free => 0,
        Occupancy::Unknown => -1,
        Occupancy::Occupied => 100_i8,
    };
    let data: Vec<i8> = cells.values().iter().map(percent).collect();
    Ok(OccupancyGrid { stamp: stamp_s, frame: frame.into(), info, data: data.into() })
}

#[cfg(test)]
mod tests {
    use armor_convert::read_occupancy;
    use armor_grid::{Point2, Thresholds};
    use armor_sdk::testing::{TestError, TestedComponent};

    use super::*;

    const SCHOOL: &str = "school no-go margin=2m 3,4 9,4 9,8";

    #[test]
    fn zones_are_published_at_the_start_and_when_they_change() -> Result<(), TestError> {
        let mut chart = TestedComponent::build::<Chart>(&[("zones", SCHOOL)])?;
        chart.start()?;
        let zones = chart.last_output::<Zones>("zones")?;
        assert_eq!((zones.frame.as_str(), zones.zones.len()), ("map", 1));
        assert_eq!((zones.zones[0].name.as_str(), zones.zones[0].margin), ("school", 2.0));
        chart.set_parameter("zones", "pond observe circle 1,1 2m; a no-go circle 5,5 1m")?;
        assert_eq!(chart.last_output::<Zones>("zones")?.zones.len(), 2);
        chart.set_parameter("zones", "")?;
        assert_eq!(chart.last_output::<Zones>("zones")?.zones, []);
        assert!(chart.outputs::<OccupancyGrid>("map")?.is_empty(), "no file is given");
        Ok(())
    }

    #[test]
    fn zones_that_cannot_be_read_leave_the_last_ones() -> Result<(), TestError> {
        let mut chart = TestedComponent::build::<Chart>(&[("zones", SCHOOL)])?;
        chart.start()?;
        let error = chart.set_parameter("zones", "a no-go 1,1 2,2").expect_err("it is refused");
        let error = error.to_string();
        assert!(error.contains("at character 9") && error.contains("at least 3"), "{error}");
        assert_eq!(chart.last_output::<Zones>("zones")?.zones[0].name, "school");
        Ok(())
    }

    #[test]
    fn the_grid_of_a_file_is_published() -> Result<(), TestError> {
        let folder = std::env::temp_dir().join(format!("armor-chart-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join("map.pgm"), b"P5\n2 2\n255\n\xfe\xcd\x00\xfe").expect("a file");
        let yaml = |origin: &str| {
            format!(
                "image: map.pgm\nresolution: 0.5\norigin: {origin}\nnegate: 0\n\
                 occupied_thresh: 0.65\nfree_thresh: 0.196\n"
            )
        };
        let file = folder.join("map.yaml");
        std::fs::write(&file, yaml("[-1.0, 2.0, 0.0]")).expect("a file");
        let grid = file.to_str().expect("a path in UTF-8");
        let mut chart = TestedComponent::build::<Chart>(&[("grid", grid)])?;
        chart.start()?;
        let map = chart.last_output::<OccupancyGrid>("map")?;
        assert_eq!(map.frame, "map");
        let cells = read_occupancy(&map, Thresholds::default()).expect("a map");
        let at = |x_m, y_m| cells.at(Point2::new(x_m, y_m)).copied();
        assert_eq!(at(-0.9, 2.1), Some(Occupancy::Occupied));
        assert_eq!(at(-0.1, 2.1), Some(Occupancy::Free));
        assert_eq!(at(-0.1, 2.9), Some(Occupancy::Unknown));
        std::fs::write(&file, yaml("[-1.0, 2.0, 0.5]")).expect("a file");
        let mut turned = TestedComponent::build::<Chart>(&[("grid", grid)])?;
        let error = turned.start().expect_err("it is turned").to_string();
        assert!(error.contains("parallel to the axes"), "{error}");
        std::fs::remove_dir_all(&folder).expect("it is removed");
        Ok(())
    }
}
