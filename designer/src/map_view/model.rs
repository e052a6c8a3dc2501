//! What the open files have of the map.

use armor_geo::MapPlacement;
use armor_robotfile::Mission;
use armor_robotfile::site_map::SiteMap;

use crate::workspace::Workspace;

/// The mission, if there is one.
pub(super) fn mission_of(workspace: &Workspace) -> Option<&Mission> {
    workspace.project.configuration()?.mission.as_ref()
}

/// Where the map is in the world.
pub(super) fn placement_of(workspace: &Workspace) -> Option<MapPlacement> {
    mission_of(workspace)?.map.as_ref()?.placement
}

/// The map of the mission, if there is one.
pub(super) fn site_map_of(workspace: &Workspace) -> Option<&SiteMap> {
    mission_of(workspace)?.map.as_ref()
}
