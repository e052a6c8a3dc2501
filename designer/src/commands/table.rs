//! What menus and lists show of each command, in the order of the menus.

use eframe::egui::{Key, KeyboardShortcut, Modifiers};

use super::{About, Command, Menu};

const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const ALT: Modifiers = Modifiers::ALT;
const NONE: Modifiers = Modifiers::NONE;
const CTRL_ALT: Modifiers = Modifiers { alt: true, ..Modifiers::COMMAND };
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
        entry(C::New, File, "New", "Creates an empty robot.", Some((CTRL, Key::N))),
        entry(C::Open, File, "Open…", "Opens a robot or mission file.", Some((CTRL, Key::O))),
        entry(C::Save, File, "Save", "Saves the file if it has no errors.", Some((CTRL, Key::S))),
        entry(
            C::SaveAs,
            File,
            "Save as…",
            "Saves the file under another name.",
            Some((CTRL_SHIFT, Key::S)),
        ),
        entry(
            C::SaveDraft,
            File,
            "Save as draft",
            "Saves the file although it has errors, marked as a draft, which is not run.",
            Some((CTRL_ALT, Key::S)),
        ),
        entry(
            C::Export,
            File,
            "Export drawing…",
            "Saves the drawing as a picture, .svg or .png.",
            Some((CTRL, Key::E)),
        ),
        entry(
            C::Quit,
            File,
            "Quit",
            "Closes the window; asks first if there are unsaved changes.",
            Some((CTRL, Key::Q)),
        ),
        entry(C::Undo, Edit, "Undo", "Reverts the last change.", Some((CTRL, Key::Z))),
        entry(
            C::Redo,
            Edit,
            "Redo",
            "Applies the change again that was undone.",
            Some((CTRL_SHIFT, Key::Z)),
        ),
        entry(C::Cut, Edit, "Cut", "Moves the selection to the clipboard.", Some((CTRL, Key::X))),
        entry(
            C::Copy,
            Edit,
            "Copy",
            "Copies the selection to the clipboard, also for another file.",
            Some((CTRL, Key::C)),
        ),
        entry(C::Paste, Edit, "Paste", "Adds the contents of the clipboard.", Some((CTRL, Key::V))),
        entry(
            C::Duplicate,
            Edit,
            "Duplicate",
            "Adds a copy of the selection.",
            Some((CTRL, Key::D)),
        ),
        entry(
            C::Delete,
            Edit,
            "Delete",
            "Removes the selection, with its links.",
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
            "Clear selection",
            "Cancels the current drag, or else clears the selection.",
            Some((NONE, Key::Escape)),
        ),
        entry(
            C::Find,
            Edit,
            "Find…",
            "Finds a block, port, parameter or value by name.",
            Some((CTRL, Key::F)),
        ),
        entry(
            C::Rename,
            Edit,
            "Rename",
            "Renames the selected item everywhere.",
            Some((NONE, Key::F2)),
        ),
        entry(
            C::Properties,
            Edit,
            "Properties",
            "Edits the properties of the selected item.",
            Some((NONE, Key::Enter)),
        ),
        entry(C::Add, Draw, "Add…", "Adds an item: type a part of its name.", Some((NONE, Key::A))),
        entry(
            C::Link,
            Draw,
            "Link…",
            "Links the selected item with another one, by keyboard.",
            Some((NONE, Key::L)),
        ),
        entry(
            C::Group,
            Draw,
            "Group",
            "Draws a titled frame around the selection.",
            Some((CTRL, Key::G)),
        ),
        entry(C::Note, Draw, "Note", "Adds a note to the drawing.", Some((NONE, Key::N))),
        entry(
            C::Arrange,
            Draw,
            "Arrange",
            "Arranges everything, or the selection, from left to right.",
            Some((CTRL, Key::L)),
        ),
        entry(
            C::AlignLeft,
            Draw,
            "Align left",
            "Aligns the left edges of the selection.",
            Some((ALT, Key::ArrowLeft)),
        ),
        entry(
            C::AlignRight,
            Draw,
            "Align right",
            "Aligns the right edges of the selection.",
            Some((ALT, Key::ArrowRight)),
        ),
        entry(
            C::AlignTop,
            Draw,
            "Align top",
            "Aligns the top edges of the selection.",
            Some((ALT, Key::ArrowUp)),
        ),
        entry(
            C::AlignBottom,
            Draw,
            "Align bottom",
            "Aligns the bottom edges of the selection.",
            Some((ALT, Key::ArrowDown)),
        ),
        entry(C::SpaceAcross, Draw, "Space across", "Makes the horizontal gaps equal.", None),
        entry(C::SpaceDown, Draw, "Space down", "Makes the vertical gaps equal.", None),
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
        entry(
            C::ShowLive,
            View,
            "Live",
            "Shows both while the system runs.",
            Some((CTRL, Key::Num3)),
        ),
        entry(
            C::ZoomFit,
            View,
            "Fit",
            "Fits the whole drawing into the window.",
            Some((NONE, Key::F)),
        ),
        entry(
            C::ZoomSelected,
            View,
            "Show selected",
            "Fits the selection into the window.",
            Some((SHIFT, Key::F)),
        ),
        entry(
            C::ZoomActual,
            View,
            "Actual size",
            "Shows the drawing at actual size.",
            Some((CTRL, Key::Num0)),
        ),
        entry(C::ZoomIn, View, "Zoom in", "Shows the drawing larger.", Some((CTRL, Key::Plus))),
        entry(C::ZoomOut, View, "Zoom out", "Shows the drawing smaller.", Some((CTRL, Key::Minus))),
        entry(
            C::TogglePalette,
            View,
            "Palette",
            "Shows or hides the palette.",
            Some((NONE, Key::F6)),
        ),
        entry(
            C::ToggleProperties,
            View,
            "Properties panel",
            "Shows or hides the properties panel.",
            Some((NONE, Key::F7)),
        ),
        entry(
            C::ToggleProblems,
            View,
            "Problems",
            "Shows or hides the problems panel.",
            Some((NONE, Key::F8)),
        ),
        entry(
            C::NextProblem,
            View,
            "Next problem",
            "Goes to the next problem.",
            Some((NONE, Key::F4)),
        ),
        entry(
            C::ToggleMinimap,
            View,
            "Map of the drawing",
            "Shows or hides the map of the drawing.",
            None,
        ),
        entry(C::ToggleSnap, View, "Snap to grid", "Snaps moved items to the grid.", None),
        entry(
            C::ToggleTheme,
            View,
            "Light or dark",
            "Switches between the light and the dark theme.",
            None,
        ),
        entry(
            C::Run,
            Run,
            "Run",
            "Saves the file, runs it and watches the run.",
            Some((CTRL, Key::R)),
        ),
        entry(
            C::Stop,
            Run,
            "Stop",
            "Stops the run in order; pressed again, kills what has not stopped.",
            Some((CTRL_SHIFT, Key::R)),
        ),
        entry(
            C::Detach,
            Run,
            "Stop watching",
            "Stops watching the system, which continues to run.",
            None,
        ),
        entry(
            C::Pause,
            Run,
            "Pause the mission",
            "Stops the mission's clocks and components, except those of the safety class.",
            Some((CTRL, Key::F9)),
        ),
        entry(
            C::Resume,
            Run,
            "Resume the mission",
            "Continues where the mission was paused.",
            Some((CTRL_SHIFT, Key::F9)),
        ),
        entry(
            C::AllCommands,
            Help,
            "All commands…",
            "Runs a command, found by a part of its name.",
            Some((CTRL, Key::P)),
        ),
        entry(
            C::Shortcuts,
            Help,
            "Keys and mouse",
            "Shows all keys and mouse actions.",
            Some((NONE, Key::F1)),
        ),
        entry(
            C::FirstPage,
            Help,
            "Welcome page",
            "Shows the examples, the three steps and recent files.",
            None,
        ),
        entry(C::About, Help, "About", "Shows the version and the programs in use.", None),
        entry(
            C::Simulate,
            Simulation,
            "Simulate",
            "Starts or ends a simulation of the mission without a robot.",
            Some((NONE, Key::F5)),
        ),
        entry(
            C::SimulationRun,
            Simulation,
            "Play or pause",
            "Runs or pauses the simulation.",
            Some((NONE, Key::F9)),
        ),
        entry(
            C::SimulationStep,
            Simulation,
            "Step",
            "Runs one step of the simulation.",
            Some((NONE, Key::F10)),
        ),
        entry(
            C::SimulationBack,
            Simulation,
            "Step back",
            "Undoes the last step of the simulation.",
            Some((SHIFT, Key::F10)),
        ),
        entry(
            C::SimulationRestart,
            Simulation,
            "Restart",
            "Restarts the simulation.",
            Some((SHIFT, Key::F5)),
        ),
    ]
};
