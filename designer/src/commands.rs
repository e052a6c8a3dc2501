//! Everything the user can do by name: menus, shortcuts, the list of commands and the page of
//! shortcuts are made from [`COMMANDS`].

mod table;

use eframe::egui::KeyboardShortcut;

pub use table::COMMANDS;

/// Something the user can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "COMMANDS documents each")]
pub enum Command {
    New,
    Open,
    OpenRecording,
    Save,
    SaveAs,
    SaveDraft,
    Export,
    Quit,
    Undo,
    Redo,
    Cut,
    Copy,
    Paste,
    Duplicate,
    Delete,
    SelectAll,
    SelectNone,
    Find,
    Rename,
    Properties,
    Add,
    Link,
    Arrange,
    AlignLeft,
    AlignRight,
    AlignTop,
    AlignBottom,
    SpaceAcross,
    SpaceDown,
    Group,
    Fold,
    Note,
    ZoomIn,
    ZoomOut,
    ZoomActual,
    ZoomFit,
    ZoomSelected,
    ShowSystem,
    ShowMission,
    ShowMap,
    ShowLive,
    TogglePalette,
    ToggleProperties,
    ToggleProblems,
    ToggleMinimap,
    ToggleTimes,
    ToggleProgress,
    ToggleSnap,
    ToggleTheme,
    NextProblem,
    Run,
    Rehearse,
    Stop,
    Detach,
    Pause,
    Resume,
    AllCommands,
    Help,
    Shortcuts,
    FirstPage,
    About,
    Simulate,
    SimulationRun,
    SimulationStep,
    SimulationBack,
    SimulationRestart,
}

/// The menus, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    /// Files.
    File,
    /// Changes of what is selected.
    Edit,
    /// New things, and where things are.
    Draw,
    /// What is shown.
    View,
    /// What runs.
    Run,
    /// What helps to find one's way.
    Help,
    /// The mission played without a robot.
    Simulation,
}

impl Menu {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::File, Self::Edit, Self::Draw, Self::View, Self::Simulation, Self::Run, Self::Help];

    /// What the menu bar calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::Draw => "Draw",
            Self::View => "View",
            Self::Run => "Run",
            Self::Help => "Help",
            Self::Simulation => "Simulation",
        }
    }
}

/// What menus and lists show of a command.
#[derive(Debug)]
pub struct About {
    /// The command.
    pub command: Command,
    /// What menus call it.
    pub name: &'static str,
    /// What it does, in one sentence.
    pub doc: &'static str,
    /// The menu that it is in.
    pub menu: Menu,
    /// The keys for it.
    pub keys: Option<KeyboardShortcut>,
}

/// What menus and lists show of a command.
pub fn about(command: Command) -> &'static About {
    let found = COMMANDS.iter().find(|about| about.command == command);
    // A test shows that every command is in the table.
    found.unwrap_or(&COMMANDS[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_of_the_views_are_in_the_order_of_their_tabs() {
        use eframe::egui::Key;
        let views =
            [Command::ShowSystem, Command::ShowMission, Command::ShowMap, Command::ShowLive];
        let keys = views.map(|view| about(view).keys.map(|keys| keys.logical_key));
        assert_eq!(keys, [Key::Num1, Key::Num2, Key::Num3, Key::Num4].map(Some));
    }

    #[test]
    fn no_two_commands_share_keys_or_a_name() {
        for (n, one) in COMMANDS.iter().enumerate() {
            for other in &COMMANDS[n + 1..] {
                assert!(one.keys.is_none() || one.keys != other.keys, "{one:?} {other:?}");
                assert_ne!(one.name, other.name);
                assert_ne!(one.command, other.command);
            }
            assert_eq!(about(one.command).name, one.name);
        }
    }
}
