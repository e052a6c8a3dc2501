//! What is observed of the system, once in each frame: the version that is played, poses, paths, tracks, and
//! from these the progress.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use armor_inspect::SystemPicture;
use armor_marking::Marking;
use armor_robotfile::timing::{FollowedMission, MissionSighting, RobotSighting};
use armor_robotfile::{Configuration, Date};
use eframe::egui;

use crate::live::Watched;
use crate::map_view::live::robots::{ShownRobot, read_path};
use crate::map_view::live::{FollowedVersion, LiveMap};
use crate::project::Project;
use crate::workspace::Workspace;

/// Pause after which times and ages are drawn again though nothing arrives.
const AGES_EVERY: Duration = Duration::from_millis(200);
/// The newest firings that are compared with the routes.
const MAX_FIRINGS: usize = 2_000;
/// Pauses that are remembered.
const MAX_PAUSES: usize = 100;
/// The type of the messages with tracks, and with paths.
const TRACKS: &str = "Tracks";
const PATH: &str = "Path";

impl LiveMap {
    /// Takes what is observed now.
    pub fn follow(&mut self, ctx: &egui::Context, workspace: &Workspace) {
        if !self.is_open {
            return;
        }
        let now_s = ctx.input(|input| input.time);
        self.why_not = self.observe(workspace, now_s).err();
        if self.why_not.is_some() {
            self.progress.clear();
            self.robots.clear();
        } else {
            ctx.request_repaint_after(AGES_EVERY);
        }
    }

    fn observe(&mut self, workspace: &Workspace, now_s: f64) -> Result<(), String> {
        let watched = workspace.live.watched();
        let watched = watched.ok_or(
            "No system is watched: run this file, or attach to a system in the view Live.",
        )?;
        let look = watched.mission.look();
        let marking = look.marking.clone();
        let marking = marking.ok_or_else(|| match watched.watch.picture().found_count {
            0 => format!(
                "No registry has answered at {}: check the address, or run the system.",
                watched.registry
            ),
            _ => "The system that is watched has not published the state of a mission.".to_owned(),
        })?;
        check_file(workspace, watched, &marking)?;
        self.read_routes(workspace, watched, &marking);
        self.follow_robots(workspace, watched, now_s);
        self.follow_tracks(watched, now_s);
        let mission_s = watched.mission_s(&look);
        self.follow_pauses(&marking, mission_s);
        let Some((_, followed)) = &self.followed else { return Ok(()) };
        let skipped = look.history.fired.len().saturating_sub(MAX_FIRINGS);
        let fired = look.history.fired.iter().skip(skipped);
        let fired = fired.map(|fired| (fired.transition.as_str(), fired.fired_at_s)).collect();
        let marked = marking.places.iter().map(|place| place.place.as_str());
        let coming = marking.in_flight.iter().flat_map(|flight| &flight.to).map(String::as_str);
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).ok();
        let pauses = self.pauses.iter().copied();
        let paused = self.paused_s.map(|since_s| [since_s, mission_s]);
        let robots = self
            .robots
            .iter()
            .map(|robot| RobotSighting { at: robot.present(now_s), path: robot.path.clone() });
        self.progress = followed.progress(&MissionSighting {
            now_s: mission_s,
            utc: since_1970.map(Date::since_1970),
            places: marked.chain(coming).collect(),
            fired,
            pauses: pauses.chain(paused).collect(),
            robots: robots.collect(),
        });
        Ok(())
    }

    /// Reads the routes of the version that is played, or those of the open file if its text is not here.
    fn read_routes(&mut self, workspace: &Workspace, watched: &Watched, marking: &Marking) {
        let versions = watched.versions.as_ref().filter(|_| marking.version > 0);
        let kept = versions.and_then(|versions| versions.played(marking.version));
        let version = FollowedVersion {
            registry: watched.registry.clone(),
            played: kept.as_ref().map(|kept| kept.number),
            revision: kept.is_none().then(|| workspace.project.revision()),
        };
        let known = self.followed.as_ref().map(|(known, _)| known);
        if known == Some(&version) {
            return;
        }
        if known.is_none_or(|known| known.registry != version.registry) {
            *self = Self { is_open: true, ..Self::default() };
        }
        let routes_of = |configuration: Option<&Configuration>| {
            let configuration = configuration?;
            let mission = configuration.mission.as_ref()?;
            Some(FollowedMission::of_mission(mission, &configuration.system))
        };
        let followed = match kept {
            Some(kept) => {
                let kinds = Arc::clone(workspace.project.kinds());
                routes_of(Project::still(&kept.files, kinds).configuration())
            }
            None => routes_of(workspace.project.configuration()),
        };
        self.followed = followed.map(|followed| (version, followed));
    }

    fn follow_robots(&mut self, workspace: &Workspace, watched: &Watched, now_s: f64) {
        let Some((_, followed)) = &self.followed else { return };
        let picture = watched.watch.picture();
        let mut before = std::mem::take(&mut self.robots);
        for (route, radius_m, output) in followed.robots() {
            let is_it = |robot: &ShownRobot| robot.route == route && robot.output == output;
            let known = before.iter().position(is_it);
            let mut robot = known.map(|number| before.swap_remove(number)).unwrap_or_default();
            (robot.route, robot.radius_m) = (route.to_owned(), radius_m);
            match &output {
                Some(output) => robot.take(&watched.values.look(output), now_s),
                None => robot.why_not = Some("its route names no output with its pose".to_owned()),
            }
            robot.output = output;
            robot.path = match find_path_output(workspace, &picture, route) {
                Some(output) => read_path(&watched.values.look(&output)),
                None => Vec::new(),
            };
            self.robots.push(robot);
        }
    }

    fn follow_tracks(&mut self, watched: &Watched, now_s: f64) {
        let picture = watched.watch.picture();
        let statuses = picture.processes.values().filter_map(|process| process.status.as_ref());
        let outputs = statuses.flat_map(|status| &status.outputs);
        for output in outputs.filter(|output| output.type_name == TRACKS) {
            self.tracks.take(&output.data, &watched.values.look(&output.data), now_s);
        }
        self.tracks.forget_old(now_s);
    }

    fn follow_pauses(&mut self, marking: &Marking, mission_s: f64) {
        let since_s = marking.pause.as_ref().map(|pause| pause.since_at_s);
        if let (Some(begun_s), true) = (self.paused_s, since_s != self.paused_s) {
            self.pauses.push([begun_s, mission_s]);
            if self.pauses.len() > MAX_PAUSES {
                self.pauses.remove(0);
            }
        }
        self.paused_s = since_s;
    }
}

/// Checks that the mission that is watched is that of the open file.
fn check_file(workspace: &Workspace, watched: &Watched, marking: &Marking) -> Result<(), String> {
    let project = &workspace.project;
    if let Some(record) = &watched.record {
        let is_open = |open: &Path| record.runs(open) || open == record.file;
        if !project.path().is_some_and(is_open) {
            let file = crate::text::path(&record.resolve(&record.file));
            return Err(format!(
                "The system that is watched runs {file}, which is not the open file."
            ));
        }
        return Ok(());
    }
    let mission = project.configuration().and_then(|configuration| configuration.mission.as_ref());
    let name = mission.and_then(|mission| mission.name.as_ref());
    if name.is_some_and(|name| name.value != marking.mission) {
        let played = &marking.mission;
        return Err(format!(
            "The system that is watched plays the mission {played}, not this one."
        ));
    }
    Ok(())
}

/// The output with the path that leads to the goals of a route's mover: of a component that it is linked to.
fn find_path_output(workspace: &Workspace, picture: &SystemPicture, route: &str) -> Option<String> {
    let configuration = workspace.project.configuration()?;
    let routes = &configuration.mission.as_ref()?.routes;
    let mover = &routes.iter().find(|it| it.name.value == route)?.mover.component.value;
    let links =
        configuration.system.links.iter().filter(|link| link.from.component.value == *mover);
    links.into_iter().find_map(|link| {
        let process = picture.processes.get(&link.to.component.value)?;
        let outputs = &process.status.as_ref()?.outputs;
        let path = outputs.iter().find(|output| output.type_name == PATH)?;
        Some(path.data.clone())
    })
}
