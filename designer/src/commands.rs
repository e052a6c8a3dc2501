//! Everything the user can do by name: menus, shortcuts, the list of commands and the page of
//! shortcuts are made from [`COMMANDS`].

use eframe::egui::{Key, KeyboardShortcut, Modifiers};

/// Something the user can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "COMMANDS says what each does")]
pub enum Command {
    New,
    Open,
    Save,
    SaveAs,
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
    Note,
    ZoomIn,
    ZoomOut,
    ZoomActual,
    ZoomFit,
    ZoomSelected,
    ShowSystem,
    ShowMission,
    ShowLive,
    TogglePalette,
    ToggleProperties,
    ToggleProblems,
    ToggleMinimap,
    ToggleSnap,
    ToggleTheme,
    NextProblem,
    Run,
    Stop,
    Detach,
    Pause,
    Resume,
    AllCommands,
    Shortcuts,
    FirstPage,
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

/// What there is to say about a command.
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

/// What there is to say about a command.
pub fn about(command: Command) -> &'static About {
    let found = COMMANDS.iter().find(|about| about.command == command);
    // A test shows that every command is in the table.
    found.unwrap_or(&COMMANDS[0])
}

const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const ALT: Modifiers = Modifiers::ALT;
const NONE: Modifiers = Modifiers::NONE;
const CTRL_SHIFT: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

const fn entry(
    command: Command,
    menu: Menu,
    name: &'static str,
    doc: &'static str,
    keys: Option<(Modifiers, Key)>,
) -> About {
    let keys = match keys {
        Some((modifiers, key)) => Some(KeyboardShortcut::new(modifiers, key)),
        None => None,
    };
    About { command, name, doc, menu, keys }
}

/// All commands in the order of the menus.
pub const COMMANDS: &[About] = {
    use Command as C;
    use Menu::{Draw, Edit, File, Help, Run, Simulation, View};
    &[
        entry(C::New, File, "New", "Starts a robot from nothing.", Some((CTRL, Key::N))),
        entry(C::Open, File, "Open..", "Opens a robot or mission file.", Some((CTRL, Key::O))),
        entry(
            C::Save,
            File,
            "Save",
            "Saves the file, if nothing is wrong with it.",
            Some((CTRL, Key::S)),
        ),
        entry(
            C::SaveAs,
            File,
            "Save as..",
            "Saves the file under another name.",
            Some((CTRL_SHIFT, Key::S)),
        ),
        entry(
            C::Export,
            File,
            "Export drawing..",
            "Saves the drawing as a picture, .svg or .png.",
            Some((CTRL, Key::E)),
        ),
        entry(
            C::Quit,
            File,
            "Quit",
            "Closes the window; asks if something is not saved.",
            Some((CTRL, Key::Q)),
        ),
        entry(C::Undo, Edit, "Undo", "Takes the last change back.", Some((CTRL, Key::Z))),
        entry(
            C::Redo,
            Edit,
            "Redo",
            "Makes the change again that was taken back.",
            Some((CTRL_SHIFT, Key::Z)),
        ),
        entry(
            C::Cut,
            Edit,
            "Cut",
            "Takes what is selected to the clipboard.",
            Some((CTRL, Key::X)),
        ),
        entry(
            C::Copy,
            Edit,
            "Copy",
            "Copies what is selected, also for another file.",
            Some((CTRL, Key::C)),
        ),
        entry(C::Paste, Edit, "Paste", "Adds what is in the clipboard.", Some((CTRL, Key::V))),
        entry(
            C::Duplicate,
            Edit,
            "Duplicate",
            "Adds what is selected once more.",
            Some((CTRL, Key::D)),
        ),
        entry(
            C::Delete,
            Edit,
            "Delete",
            "Removes what is selected, with its links.",
            Some((NONE, Key::Delete)),
        ),
        entry(
            C::SelectAll,
            Edit,
            "Select all",
            "Selects everything in the drawing.",
            Some((CTRL, Key::A)),
        ),
        entry(
            C::SelectNone,
            Edit,
            "Select nothing",
            "Ends what is going on, then selects nothing.",
            Some((NONE, Key::Escape)),
        ),
        entry(
            C::Find,
            Edit,
            "Find..",
            "Finds a block, port, parameter or value by its words.",
            Some((CTRL, Key::F)),
        ),
        entry(
            C::Rename,
            Edit,
            "Rename",
            "Gives what is selected another name, everywhere.",
            Some((NONE, Key::F2)),
        ),
        entry(
            C::Properties,
            Edit,
            "Properties",
            "Edits the properties of what is selected.",
            Some((NONE, Key::Enter)),
        ),
        entry(
            C::Add,
            Draw,
            "Add..",
            "Adds something: type a part of its name.",
            Some((NONE, Key::A)),
        ),
        entry(
            C::Link,
            Draw,
            "Link..",
            "Links what is selected with something else, by keyboard.",
            Some((NONE, Key::L)),
        ),
        entry(
            C::Group,
            Draw,
            "Group",
            "Draws a titled frame around what is selected.",
            Some((CTRL, Key::G)),
        ),
        entry(C::Note, Draw, "Note", "Adds a note to the drawing.", Some((NONE, Key::N))),
        entry(
            C::Arrange,
            Draw,
            "Arrange",
            "Places everything, or what is selected, so that it reads from left to right.",
            Some((CTRL, Key::L)),
        ),
        entry(
            C::AlignLeft,
            Draw,
            "Align left",
            "Brings the left edges of what is selected into line.",
            Some((ALT, Key::ArrowLeft)),
        ),
        entry(
            C::AlignRight,
            Draw,
            "Align right",
            "Brings the right edges of what is selected into line.",
            Some((ALT, Key::ArrowRight)),
        ),
        entry(
            C::AlignTop,
            Draw,
            "Align top",
            "Brings the top edges of what is selected into line.",
            Some((ALT, Key::ArrowUp)),
        ),
        entry(
            C::AlignBottom,
            Draw,
            "Align bottom",
            "Brings the bottom edges of what is selected into line.",
            Some((ALT, Key::ArrowDown)),
        ),
        entry(
            C::SpaceAcross,
            Draw,
            "Space across",
            "Makes the gaps from left to right alike.",
            None,
        ),
        entry(C::SpaceDown, Draw, "Space down", "Makes the gaps from top to bottom alike.", None),
        entry(
            C::ShowSystem,
            View,
            "System",
            "Shows the components and their links.",
            Some((CTRL, Key::Num1)),
        ),
        entry(
            C::ShowMission,
            View,
            "Mission",
            "Shows the net over the components.",
            Some((CTRL, Key::Num2)),
        ),
        entry(C::ShowLive, View, "Live", "Shows both while they run.", Some((CTRL, Key::Num3))),
        entry(
            C::ZoomFit,
            View,
            "Show everything",
            "Fits the whole drawing into the window.",
            Some((NONE, Key::F)),
        ),
        entry(
            C::ZoomSelected,
            View,
            "Show selected",
            "Fits what is selected into the window.",
            Some((SHIFT, Key::F)),
        ),
        entry(
            C::ZoomActual,
            View,
            "Actual size",
            "Shows the drawing at its own size.",
            Some((CTRL, Key::Num0)),
        ),
        entry(C::ZoomIn, View, "Zoom in", "Shows the drawing larger.", Some((CTRL, Key::Plus))),
        entry(C::ZoomOut, View, "Zoom out", "Shows the drawing smaller.", Some((CTRL, Key::Minus))),
        entry(
            C::TogglePalette,
            View,
            "Palette",
            "Shows or hides what can be added.",
            Some((NONE, Key::F6)),
        ),
        entry(
            C::ToggleProperties,
            View,
            "Properties panel",
            "Shows or hides what is selected.",
            Some((NONE, Key::F7)),
        ),
        entry(
            C::ToggleProblems,
            View,
            "Problems",
            "Shows or hides what is wrong.",
            Some((NONE, Key::F8)),
        ),
        entry(
            C::NextProblem,
            View,
            "Next problem",
            "Goes to the next thing that is wrong.",
            Some((NONE, Key::F4)),
        ),
        entry(C::ToggleMinimap, View, "Map of the drawing", "Shows or hides the small map.", None),
        entry(
            C::ToggleSnap,
            View,
            "Keep to the grid",
            "Whether what is moved keeps to the grid.",
            None,
        ),
        entry(
            C::ToggleTheme,
            View,
            "Light or dark",
            "Changes between a light and a dark window.",
            None,
        ),
        entry(
            C::Run,
            Run,
            "Run",
            "Saves the file and runs it; the window watches.",
            Some((CTRL, Key::R)),
        ),
        entry(
            C::Stop,
            Run,
            "Stop",
            "Stops the run in order; once more kills what has not stopped.",
            Some((CTRL_SHIFT, Key::R)),
        ),
        entry(
            C::Detach,
            Run,
            "Stop watching",
            "Lets go of the system that is watched; it goes on.",
            None,
        ),
        entry(
            C::Pause,
            Run,
            "Pause the mission",
            "Stops its clocks and components, but for those of safety.",
            Some((CTRL, Key::F9)),
        ),
        entry(
            C::Resume,
            Run,
            "Resume the mission",
            "Goes on where everything stood.",
            Some((CTRL_SHIFT, Key::F9)),
        ),
        entry(
            C::AllCommands,
            Help,
            "All commands..",
            "Runs a command by a part of its name.",
            Some((CTRL, Key::P)),
        ),
        entry(
            C::Shortcuts,
            Help,
            "Keys and mouse",
            "Shows every key, and what the mouse does.",
            Some((NONE, Key::F1)),
        ),
        entry(
            C::FirstPage,
            Help,
            "First page",
            "Shows the examples, the three steps, and what was open before.",
            None,
        ),
        entry(
            C::Simulate,
            Simulation,
            "Simulate",
            "Plays the mission without a robot; again, ends it.",
            Some((NONE, Key::F5)),
        ),
        entry(
            C::SimulationRun,
            Simulation,
            "Play or pause",
            "Lets the simulation go on by itself, or stops it.",
            Some((NONE, Key::F9)),
        ),
        entry(
            C::SimulationStep,
            Simulation,
            "Step",
            "Makes one step of the simulation.",
            Some((NONE, Key::F10)),
        ),
        entry(
            C::SimulationBack,
            Simulation,
            "Step back",
            "Takes the last step of the simulation back.",
            Some((SHIFT, Key::F10)),
        ),
        entry(
            C::SimulationRestart,
            Simulation,
            "Begin again",
            "Takes the simulation back to its beginning.",
            Some((SHIFT, Key::F5)),
        ),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;

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
