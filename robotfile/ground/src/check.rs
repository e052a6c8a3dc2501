//! Reads the grids that the maps of a file name, and examines the drives over them.

use armor_map_file::{MapFileError, read_map_cells};
use armor_robotfile::site_map::SiteMap;
use armor_robotfile::timing::{DriveLengths, StraightLengths};
use armor_robotfile::{Code, Configuration, Finding, Findings, Mission, Spanned};

use crate::examining::{examine_drives, with_path_lengths};
use crate::ground::SiteGround;

/// Returns what is wrong with the routes of a file over the grids that its maps name. It reads these
/// files, relative to the file that names them.
pub fn check_ground(configuration: &Configuration) -> Findings {
    let mut findings = Findings::default();
    for mission in configuration.missions() {
        let Some(map) = &mission.map else { continue };
        let Some(grid) = &map.grid else { continue };
        match read_ground(map, grid) {
            Ok(ground) => {
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

/// Calls `predict` with the lengths of a mission's drives: of the paths over the grid that its map names, or
/// straight ones without a grid that can be read.
pub fn with_drive_lengths<R>(mission: &Mission, predict: impl FnOnce(&dyn DriveLengths) -> R) -> R {
    let named = mission.map.as_ref().and_then(|map| Some((map, map.grid.as_ref()?)));
    match named.and_then(|(map, grid)| read_ground(map, grid).ok()) {
        Some(ground) => with_path_lengths(mission, &ground, predict),
        None => predict(&StraightLengths),
    }
}

fn read_ground(map: &SiteMap, grid: &Spanned<String>) -> Result<SiteGround, MapFileError> {
    let path = grid.at.source.folder().join(&grid.value);
    let (cells, map_from_cells) = read_map_cells(&path)?;
    Ok(SiteGround::new(cells, map_from_cells, &map.zones))
}
