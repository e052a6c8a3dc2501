//! The exit codes of each command, as its help and its manual page list them.

use clap::Command;
use clap::builder::StyledStr;

use crate::help_layout::{lay_out_examples, wrap_words};

/// The column of the meaning of a code.
const CODE_INDENT: usize = 6;
/// What 1 means for most commands that need a running system.
const NO_SYSTEM: &str = "no system is found, it does not answer, or has nothing of that name";
const MEASURED: &str = "the windows, or the result over the time, were printed";
const NO_DATA: &str = "no system is found, no component provides the data or it has ended for good, or \
                       nothing has arrived in the windows or the time asked for";
const REFUSED: &str = "the order was refused or not answered, or no mission runs";
const NOT_PLAYED: &str = "it is refused, no system is found, or no recording is played in it";
const SERVER: &str = "it could not start, or has failed";

/// The exit codes of one command: 0, 1, and those that few have. 2 is the same for all.
struct CommandCodes {
    /// The command with its group, such as `data list`.
    command: &'static str,
    fine: &'static str,
    failed: &'static str,
    others: &'static [(u8, &'static str)],
}

const fn codes(command: &'static str, fine: &'static str, failed: &'static str) -> CommandCodes {
    CommandCodes { command, fine, failed, others: &[] }
}

const INTERRUPTED: (u8, &str) = (130, "it was interrupted (Ctrl-C, SIGTERM)");

/// The commands with a meaning of their own; any other one fails with 1.
const COMMANDS: &[CommandCodes] = &[
    CommandCodes {
        command: "run",
        fine: "the mission has reached its goal, or a run without one was ended in order",
        failed: "the file has an error, the mission has ended in its safe place, or the start, the mission \
                 or an essential component failed",
        others: &[(3, "`armor stop --all` has ended it before its mission was over"), INTERRUPTED],
    },
    codes("check", "no file has an error", "a file has an error; with --strict also a warning"),
    codes("explain", "it is explained", "there is no finding with the code"),
    codes(
        "fmt",
        "all files are formatted",
        "a file cannot be formatted; with --check: one would change",
    ),
    codes("doctor", "nothing would stop a system", "something would stop a system"),
    codes("ps", "it is printed", NO_SYSTEM),
    CommandCodes {
        command: "top",
        fine: "it was printed, or ended by q",
        failed: "no system is found or its registry does not answer",
        others: &[INTERRUPTED],
    },
    codes("data list", "it is printed", NO_SYSTEM),
    codes("data info", "it is printed", "no system is found, or no component provides the data"),
    codes("data find", "ports are printed", "no system is found, or no port has the word"),
    codes(
        "data pub",
        "a process has received the data",
        "no process has received them, the name is taken, the fields do not fit the type, or no system \
         is found",
    ),
    codes("describe", "it is printed", "there is no such kind, or an executable is broken"),
    codes("message list", "it is printed", "a stock component is broken"),
    codes("message show", "it is printed", "there is no such message"),
    codes(
        "message export",
        "it is written",
        "there is no such message, several have the name, or the language cannot express it",
    ),
    codes("graph", "it is printed", NO_SYSTEM),
    codes(
        "echo",
        "data were printed until the number, or until stdout was closed",
        "no system is found, no component provides the data or it has ended for good, or a field does \
         not exist",
    ),
    CommandCodes {
        command: "play",
        fine: "the recording is over, or the mission has reached its goal",
        failed: "it cannot be played, or the mission, the player or an essential component failed",
        others: &[
            (3, "the recording was over before the mission, or `armor stop --all`"),
            INTERRUPTED,
        ],
    },
    codes("playback show", "it is printed", NOT_PLAYED),
    codes("playback pause", "time stands still", NOT_PLAYED),
    codes("playback resume", "time passes", NOT_PLAYED),
    codes("playback step", "the step has begun", NOT_PLAYED),
    codes("playback seek", "it is at that moment", NOT_PLAYED),
    codes("playback speed", "it has that speed", NOT_PLAYED),
    codes("playback loop", "it does so at the end", NOT_PLAYED),
    codes(
        "bag convert",
        "the copy is written",
        "the file cannot be read, or the copy not be written",
    ),
    codes("hz", MEASURED, NO_DATA),
    codes("bw", MEASURED, NO_DATA),
    codes("delay", MEASURED, NO_DATA),
    codes(
        "trace",
        "the time is over, the system has ended, or stdout was closed",
        "no system is found, no component publishes the data, or the collector takes nothing",
    ),
    codes(
        "watch",
        "stdout was closed",
        "no system is found, it has ended, or has no such component",
    ),
    codes(
        "restart",
        "the component runs",
        "it is refused, or the component has failed or does not run in time",
    ),
    codes("stop", "it is carried out", "it is refused, or the launcher does not answer"),
    codes("logs", "they are printed", "no run is found, or it has no such log"),
    codes("log", "it is carried out", "it is refused, or the component does not answer"),
    codes("mission show", "it is printed", "no system is found, or no mission runs"),
    codes("mission fire", "it is carried out", REFUSED),
    codes("mission pause", "it is carried out", REFUSED),
    codes("mission resume", "it is carried out", REFUSED),
    codes("mission safe", "it is carried out", REFUSED),
    codes("mission move", "it is carried out", REFUSED),
    codes("mission confirm", "it is carried out", REFUSED),
    codes("mission decline", "it is carried out", REFUSED),
    CommandCodes {
        command: "mission operate",
        fine: "stdin has ended, and all orders were carried out",
        failed: "an order was refused, or the command was lost",
        others: &[INTERRUPTED],
    },
    codes(
        "mission journal",
        "it is printed, or fits its mission",
        "it cannot be read, or does not fit its mission",
    ),
    codes("mission expand", "it is printed", "it cannot be read, or has an error"),
    codes(
        "mission times",
        "they are printed",
        "it cannot be read, has an error, or its limits cannot be kept",
    ),
    CommandCodes {
        command: "mission rehearse",
        fine: "it reached its goal, with everything within its bounds",
        failed: "it did not, or the file cannot be rehearsed",
        others: &[INTERRUPTED],
    },
    codes("mission replay", "it is printed", "it cannot be read, or does not fit the mission"),
    codes(
        "record",
        "it has ended as asked, or with the system",
        "no system is found, nothing can be recorded, or the disk is full",
    ),
    codes("net info", "the net is counted", "the file cannot be read, or a limit was reached"),
    codes("net check", "the net has no faults", "the net has a fault, or cannot be decided"),
    codes(
        "map convert",
        "the other file is written, with notes on what it has no place for",
        "a file cannot be read or written, or the other format has no place for the plan",
    ),
    codes(
        "map import",
        "the file with the plan is printed or written, and has no errors",
        "a file cannot be read or written, the plan cannot be drawn, or the file has errors with it",
    ),
    codes(
        "map export",
        "the plan is written, with notes on what has no counterpart",
        "the file has errors, no map with an origin, or no such route",
    ),
    codes("map symbol", "the code is readable", "the code is not one of the standard"),
    codes(
        "param set",
        "the value is in the file and in force",
        "it is refused, by the file or the component",
    ),
    CommandCodes {
        command: "connect",
        fine: "that of COMMAND",
        failed: "the gate cannot be reached or refuses the key",
        others: &[INTERRUPTED],
    },
    CommandCodes {
        command: "component",
        fine: "it was ended in order, by its system or by a signal",
        failed: "there is no such kind, no registry answers, or the component has failed",
        others: &[(101, "its code has panicked")],
    },
    CommandCodes { command: "registry", fine: "-", failed: SERVER, others: &[INTERRUPTED] },
    CommandCodes { command: "configd", fine: "-", failed: SERVER, others: &[INTERRUPTED] },
    CommandCodes {
        command: "executive",
        fine: "the mission has reached its goal",
        failed: "it could not start",
        others: &[
            (3, "the mission has ended in its safe place"),
            (4, "the mission has failed"),
            INTERRUPTED,
        ],
    },
    CommandCodes { command: "gate", fine: "-", failed: SERVER, others: &[INTERRUPTED] },
    CommandCodes { command: "host", fine: "-", failed: SERVER, others: &[INTERRUPTED] },
];

/// Adds its exit codes to the help of each command.
pub fn add_exit_codes(command: Command) -> Command {
    command.mut_subcommands(|command| add_below(command, ""))
}

fn add_below(command: Command, group: &str) -> Command {
    let path = match group {
        "" => command.get_name().to_owned(),
        group => format!("{group} {}", command.get_name()),
    };
    let command = command.mut_subcommands(|nested| add_below(nested, &path));
    let before = command.get_after_help().map(StyledStr::to_string);
    if command.is_subcommand_required_set() {
        return match before {
            Some(before) => command.after_help(lay_out_examples(&before)),
            None => command,
        };
    }
    let text = describe_codes(&path);
    match before {
        Some(before) => command.after_help(format!("{}\n\n{text}", lay_out_examples(&before))),
        None => command.after_help(text),
    }
}

/// Returns the part of the help of a command with its exit codes.
pub fn describe_codes(path: &str) -> String {
    let known = COMMANDS.iter().find(|codes| codes.command == path);
    let usual = codes("", "it has succeeded", "it has failed; the reason is on stderr");
    let CommandCodes { fine, failed, others, .. } = known.unwrap_or(&usual);
    let mut lines = vec![(0, *fine), (1, *failed), (2, "wrong usage")];
    lines.extend_from_slice(others);
    let lines = lines.into_iter().filter(|(_, text)| *text != "-");
    let lines = lines.map(|(code, text)| {
        format!("\n  {code:<3} {}", wrap_words(text, CODE_INDENT).trim_start())
    });
    format!("Exit codes:{}", lines.collect::<String>())
}

#[cfg(test)]
mod tests {
    use crate::command_line::build_command;

    use super::*;

    /// Calls `check` with every command that can be run, and its name.
    fn for_each_command(
        command: &mut Command,
        path: &str,
        check: &mut impl FnMut(&str, &mut Command),
    ) {
        for nested in command.get_subcommands_mut().filter(|it| !it.is_hide_set()) {
            let path = format!("{path} {}", nested.get_name());
            for_each_command(nested, &path, check);
            if !nested.is_subcommand_required_set() {
                check(path.trim(), nested);
            }
        }
    }

    #[test]
    fn the_help_of_every_command_names_its_exit_codes() {
        let mut names = Vec::new();
        for_each_command(&mut build_command(), "", &mut |name, command| {
            for help in [command.render_help().to_string(), command.render_long_help().to_string()]
            {
                for part in ["Exit codes:\n", "\n  1   ", "\n  2   wrong usage"] {
                    assert!(help.contains(part), "armor {name}: {part}\n{help}");
                }
                assert_eq!(help.matches("Exit codes:").count(), 1, "armor {name}");
            }
            names.push(name.to_owned());
        });
        let unknown = COMMANDS.iter().find(|codes| !names.iter().any(|name| name == codes.command));
        assert!(unknown.is_none(), "no command is called {}", unknown.map_or("", |it| it.command));
    }

    #[test]
    fn examples_stay_above_the_exit_codes() {
        let text = describe_codes("run");
        assert!(text.contains("\n  3   `armor stop --all`") && text.contains("\n  130 "), "{text}");
        assert!(!describe_codes("registry").contains("\n  0 "));
        assert!(describe_codes("sdk").contains("\n  0   it has succeeded"));
    }
}
