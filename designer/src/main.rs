//! `armor-designer [FILE]`: opens the window, or does without one what the command line asks for.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;

use armor_designer::arguments::{Arguments, HELP, Task};
use armor_designer::check::check;
use armor_designer::disk::state_folder;
use armor_designer::{Designer, Settings, Start, take_picture};
use armor_robotfile::{Code, Colours, Findings, Severity};
use eframe::egui;
use tracing_subscriber::EnvFilter;

/// The command line makes no sense.
const USED_WRONGLY: u8 = 2;

fn main() -> ExitCode {
    // What winit states of displays is nothing that a user could do something about.
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn,winit=error".into());
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_env_filter(filter).init();
    let arguments = match Arguments::parse(std::env::args_os().skip(1)) {
        Ok(arguments) => arguments,
        Err(error) => {
            eprintln!("{error}\n`armor-designer --help` lists the options");
            return ExitCode::from(USED_WRONGLY);
        }
    };
    let is_done = match &arguments.task {
        Task::Help => print(HELP),
        Task::Version => print(concat!("armor-designer ", env!("CARGO_PKG_VERSION"))),
        Task::Check => {
            // A file with mistakes does not keep the following ones from being checked.
            let wrong = arguments.files.iter().filter(|file| !is_fine(file, &arguments)).count();
            wrong == 0
        }
        Task::Picture(_) => report_failure(take_picture(&arguments)),
        Task::Window => report_failure(open_window(arguments)),
    };
    if is_done { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn print(text: &str) -> bool {
    // A closed stdout is no failure: its reader wanted no more.
    let _ = writeln!(std::io::stdout(), "{text}");
    true
}

fn report_failure<E: std::fmt::Display>(outcome: Result<(), E>) -> bool {
    outcome.inspect_err(|error| eprintln!("{error}")).is_ok()
}

/// Prints what is wrong with a file, as `armor check` does.
fn is_fine(file: &Path, arguments: &Arguments) -> bool {
    let found = match check(file, &arguments.components) {
        Ok(found) => found,
        Err(error) => {
            eprintln!("{error}");
            return false;
        }
    };
    if !found.troubles.is_empty() {
        eprintln!("{}", found.troubles);
    }
    let colours = if std::io::stderr().is_terminal() { Colours::Yes } else { Colours::No };
    // How long the mission takes is a line of its own, as there.
    let mut shown = Findings::default();
    shown.extend(found.findings.iter().filter(|finding| finding.code != Code::Takes).cloned());
    eprint!("{}", shown.render(colours));
    if let Some(code) = shown.gravest() {
        eprintln!("see `armor explain {}`", code.as_str());
    }
    let problems = shown.count(Severity::Error) + shown.count(Severity::Warning);
    if problems == 0 {
        print(&format!("{} is fine", file.display()));
    }
    if let Some(takes) = found.findings.iter().find(|finding| finding.code == Code::Takes) {
        print(&format!("{}: {}", file.display(), takes.message));
    }
    shown.count(Severity::Error) == 0
}

#[derive(Debug, thiserror::Error)]
#[error(
    "the window cannot be opened: {why}\n\
     It needs a display (DISPLAY or WAYLAND_DISPLAY) and OpenGL: libGL and libEGL."
)]
struct WindowError {
    why: String,
}

impl From<eframe::Error> for WindowError {
    fn from(error: eframe::Error) -> Self {
        let why = match error {
            // Its words name a line of its source.
            eframe::Error::WinitEventLoop(_) => "no window system was found".to_owned(),
            error => error.to_string(),
        };
        Self { why }
    }
}

fn open_window(arguments: Arguments) -> Result<(), WindowError> {
    let viewport = egui::ViewportBuilder::default()
        .with_app_id("armor-designer")
        .with_inner_size([1360.0, 860.0])
        .with_min_inner_size([640.0, 420.0])
        .with_drag_and_drop(true);
    let options = eframe::NativeOptions { viewport, ..Default::default() };
    let create = |creation: &eframe::CreationContext<'_>| {
        let stored = creation.storage.and_then(|storage| eframe::get_value(storage, "settings"));
        let mut settings: Settings = stored.unwrap_or_default();
        if let Some(is_dark) = arguments.is_dark {
            settings.set_dark(is_dark);
        }
        let start = Start {
            first_page: arguments.files.is_empty() && arguments.attach.is_none(),
            attach: arguments.attach,
            file: arguments.files.into_iter().next(),
            components: arguments.components,
            view: arguments.view,
            kinds: None,
            own_folder: state_folder(),
        };
        let designer = Designer::new(&creation.egui_ctx, start, settings);
        Ok(Box::new(designer) as Box<dyn eframe::App>)
    };
    Ok(eframe::run_native("armor-designer", options, Box::new(create))?)
}
