//! Reads the grids that the maps of a file name, and examines the drives over them.

use armor_map_file::read_map_cells;
use armor_robotfile::{Code, Configuration, Finding, Findings};

use crate::examining::examine_drives;
use crate::ground::SiteGround;

/// Returns what is wrong with the routes of a file over the grids that its maps name. It reads these
/// files, relative to the file that names them.
pub fn check_ground(configuration: &Configuration) -> Findings {
    let mut findings = Findings::default();
    for mission in configuration.missions() {
        let Some(map) = &mission.map else { continue };
        let Some(grid) = &map.grid else { continue };
        let path = grid.at.source.folder().join(&grid.value);
        match read_map_cells(&path) {
            Ok((cells, map_from_cells)) => {
                let ground = SiteGround::new(cells, map_from_cells, &map.zones);
                findings.extend(examine_drives(mission, &configuration.system, &ground));
            }
            Err(error) => {
                let message = format!("the grid of the map: {error}");
                let finding = Finding::new(Code::GridUnreadable, &grid.at, message);
                findings.push(finding.remedy(
                    "name the YAML file of a map_server map, relative to this file; or leave grid out",
                ));
            }
        }
    }
    findings
}
