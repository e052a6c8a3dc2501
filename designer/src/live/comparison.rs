//! The version that runs, compared with the text on the screen: the drawings of both, and a line
//! that states whether they differ.

use std::sync::Arc;

use armor_configd::KeptVersion;
use armor_inspect::systems::RunRecord;
use eframe::egui::{self, Panel, RichText};

use super::presence::{self, Presences};
use super::words::printable;
use crate::canvas::Diagram;
use crate::item::Item;
use crate::mission::net;
use crate::project::Project;
use crate::system::draw;
use crate::workspace::Workspace;
use armor_picture::theme::ThemeColours;

/// Differences that are listed in the tooltip.
const MAX_LISTED: usize = 12;

/// The versions that run.
pub struct RunningTexts {
    in_force: Arc<KeptVersion>,
    played: Option<Arc<KeptVersion>>,
    /// Whether the open file is the one that runs.
    is_open: bool,
}

impl RunningTexts {
    /// Those of the system that is watched, if they are known.
    pub fn of(workspace: &Workspace) -> Option<Self> {
        let watched = workspace.live.watched()?;
        let versions = watched.versions.as_ref()?;
        let in_force = versions.in_force()?;
        let played = watched.mission.look().marking.filter(|marking| marking.version > 0);
        let played = played.and_then(|marking| versions.played(marking.version));
        let is_open = watched.record.as_ref().is_some_and(|it| is_open(it, &workspace.project));
        Some(Self { in_force, played, is_open })
    }

    /// What distinguishes these texts from others of the same run.
    pub fn key(&self) -> (u64, Option<u64>, bool) {
        let played = self.played.as_ref().map(|version| version.number);
        (self.in_force.number, played, self.is_open)
    }
}

fn is_open(record: &RunRecord, project: &Project) -> bool {
    project.path().is_some_and(|open| record.runs(open) || open == record.file)
}

/// What runs, and what the text on the screen has.
#[derive(Debug, Default)]
pub struct Comparison {
    /// What only one of them has.
    pub presences: Presences,
    /// The versions that the components run and that the mission plays.
    versions: Option<(u64, u64)>,
    /// The differences, in words; none if the text is the one that runs.
    differences: Vec<String>,
    /// The open file is another one.
    is_another_file: bool,
}

/// The drawings of both, and the versions that run as files.
pub struct BothDrawings {
    pub system: Diagram<Item>,
    pub net: Diagram<Item>,
    pub comparison: Comparison,
    pub running: Option<Project>,
    pub played: Option<Project>,
}

/// Draws what runs, with what the text on the screen has in addition. Without a known version, the
/// open files are drawn.
pub fn draw_both(
    workspace: &Workspace,
    running: Option<&RunningTexts>,
    colours: &ThemeColours,
) -> BothDrawings {
    let text = &workspace.project;
    let Some(texts) = running else {
        if workspace.live.is_playing() {
            // The open file is another one.
            let comparison = Comparison::default();
            let (system, net) = (Diagram::default(), Diagram::default());
            return BothDrawings { system, net, comparison, running: None, played: None };
        }
        return BothDrawings {
            system: draw(text).diagram,
            net: net(text, colours),
            comparison: Comparison::default(),
            running: None,
            played: None,
        };
    };
    let read = |version: &KeptVersion| Project::still(&version.files, Arc::clone(text.kinds()));
    let running = read(&texts.in_force);
    let is_one = |played: &&Arc<KeptVersion>| played.number != texts.in_force.number;
    let played = texts.played.as_ref().filter(is_one).map(|version| read(version));
    let of_mission = played.as_ref().unwrap_or(&running);
    let (system, net_of_it) = (draw(&running).diagram, net(of_mission, colours));
    let number = texts.played.as_ref().map_or(texts.in_force.number, |played| played.number);
    let mut comparison = Comparison {
        versions: Some((texts.in_force.number, number)),
        is_another_file: !texts.is_open,
        ..Comparison::default()
    };
    if !texts.is_open {
        return BothDrawings { system, net: net_of_it, comparison, running: Some(running), played };
    }
    let (system, mut presences) = presence::merge(system, draw(text).diagram);
    let (net, of_net) = presence::merge(net_of_it, net(text, colours));
    presences.extend(of_net);
    let configurations =
        (running.configuration(), of_mission.configuration(), text.configuration());
    match configurations {
        (Some(running), Some(played), Some(text)) => {
            let found = presence::compare(running, played, text);
            presence::add_differences(&mut presences, &found);
            comparison.differences = found.iter().map(ToString::to_string).collect();
        }
        _ => comparison.differences.push("the text has no system that can be read".into()),
    }
    comparison.presences = presences;
    BothDrawings { system, net, comparison, running: Some(running), played }
}

/// What is drawn of a recording, in a line.
fn describe_recorded(workspace: &Workspace) -> String {
    let Some(playback) = workspace.live.playback() else {
        return "what was recorded".into();
    };
    let found = playback.found();
    match found.files.first() {
        Some((file, _)) => format!("{}, as {} has it", file.display(), playback.name()),
        None if found.is_complete => {
            format!("{} has no system file: its components are listed at the left", playback.name())
        }
        None => format!("{} is being opened", playback.name()),
    }
}

impl Comparison {
    /// What runs, or ran until the end, in a line; and whether it differs from what is on the screen.
    fn line(&self, has_ended: bool) -> Option<(String, bool)> {
        let (components, mission) = self.versions?;
        let runs = match (components == mission, has_ended) {
            (true, false) => format!("version {components} runs"),
            (true, true) => format!("version {components} ran"),
            (false, false) => format!(
                "the components run version {components}, the mission plays version {mission}"
            ),
            (false, true) => format!(
                "the components ran version {components}, the mission played version {mission}"
            ),
        };
        Some(match (self.is_another_file, self.differences.is_empty()) {
            (true, _) => (format!("{runs}; the open file is another one"), true),
            (false, true) => (runs, false),
            (false, false) => (format!("{runs}; the text on the screen differs"), true),
        })
    }

    /// Shows the line above the drawing.
    pub fn show(&self, ui: &mut egui::Ui, workspace: &Workspace) {
        let Some(watched) = workspace.live.watched() else { return };
        let colours = ThemeColours::of(ui.visuals());
        let (line, differs) = self.line(workspace.live.ended().is_some()).unwrap_or_else(|| {
            ("the version that runs is not known here; drawn is the open file".into(), false)
        });
        Panel::top("live version").show(ui, |ui| {
            if watched.is_recorded() || workspace.live.is_playing() {
                ui.weak(RichText::new(describe_recorded(workspace)).strong());
                return;
            }
            ui.horizontal_wrapped(|ui| {
                let colour = if differs { colours.warning } else { colours.weak };
                let label = ui.colored_label(colour, RichText::new(&line).strong());
                if !self.differences.is_empty() {
                    let mut listed: Vec<_> =
                        self.differences.iter().take(MAX_LISTED).cloned().collect();
                    if self.differences.len() > MAX_LISTED {
                        listed.push(format!("and {} more", self.differences.len() - MAX_LISTED));
                    }
                    label.on_hover_text(printable(ui, &listed.join("\n")));
                    ui.weak(self.reason(workspace));
                }
                let change = watched.mission.look().marking.and_then(|it| it.change.clone());
                if let Some(change) = change {
                    let text =
                        format!("version {}: {} {}", change.version, change.state, change.why);
                    ui.weak(printable(ui, text.trim_end()));
                }
            });
        });
    }

    fn reason(&self, workspace: &Workspace) -> String {
        let count = match self.differences.len() {
            1 => "1 difference".to_owned(),
            count => format!("{count} differences"),
        };
        let saved = if workspace.project.is_dirty() { "not saved" } else { "saved, not running" };
        format!("{count}, {saved}")
    }
}
