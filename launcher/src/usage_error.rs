//! Wrong usage: the parser's message at the width of the terminal, with the command that was
//! probably meant.

use armor_robotfile::suggest_similar;
use armor_wire::name::{is_name, split_data};
use clap::Command;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::print::{fits_stderr, print_notice};

/// Prints a message of the parser (an error, help or the version) and ends the process.
pub fn exit_with(mut error: clap::Error, command: &Command) -> ! {
    add_nested_command(&mut error, command);
    let arguments: Vec<_> =
        std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect();
    add_foreign_command(&mut error, &arguments);
    add_parameter_command(&mut error, &arguments);
    add_hidden_format(&mut error, &arguments);
    add_moved_places(&mut error, &arguments);
    let text = error.render().to_string();
    // Help is wrapped already.
    if error.use_stderr() && !fits_stderr(&text) {
        print_notice(text.trim_end());
        std::process::exit(error.exit_code());
    }
    error.exit()
}

/// Adds the whole command to the error about one that is given without its group, such as
/// `armor fire` instead of `armor mission fire`.
fn add_nested_command(error: &mut clap::Error, command: &Command) {
    if error.kind() != ErrorKind::InvalidSubcommand {
        return;
    }
    let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand) else {
        return;
    };
    let groups = command.get_subcommands().filter(|group| !group.is_hide_set());
    let nested: Vec<(&str, &str)> = groups
        .flat_map(|group| {
            group.get_subcommands().map(|nested| (group.get_name(), nested.get_name()))
        })
        .collect();
    let mut meant: Vec<_> = nested.iter().filter(|(_, nested)| nested == name).copied().collect();
    if meant.is_empty() && error.get(ContextKind::SuggestedSubcommand).is_none() {
        let advice = suggest_similar(name, nested.iter().map(|(_, nested)| *nested));
        let is_meant = |nested: &str| advice == Some(format!("did you mean {nested}?"));
        meant = nested.into_iter().filter(|(_, nested)| is_meant(nested)).collect();
    }
    let meant: Vec<_> =
        meant.iter().map(|(group, nested)| format!("`armor {group} {nested}`")).collect();
    if !meant.is_empty() {
        let tip = StyledStr::from(format!("did you mean {}?", meant.join(" or ")));
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
}

/// Verbs of other systems, with their second word where it matters, and what they are here.
const FOREIGN_VERBS: [(&str, &str, &str); 28] = [
    ("topic", "echo", "`armor echo COMPONENT.OUTPUT` prints data"),
    ("topic", "hz", "`armor hz COMPONENT.OUTPUT` measures a rate"),
    ("topic", "bw", "`armor bw COMPONENT.OUTPUT` measures bytes per second"),
    ("topic", "delay", "`armor delay COMPONENT.OUTPUT` measures how old data are on arrival"),
    ("topic", "list", "`armor data list` lists all outputs"),
    ("topic", "info", "`armor data info COMPONENT.OUTPUT` describes an output and its links"),
    ("topic", "find", "`armor data find TYPE` finds the outputs and inputs of a type"),
    ("topic", "pub", "`armor data pub COMPONENT.OUTPUT TYPE FIELD=VALUE` publishes by hand"),
    (
        "topic",
        "",
        "`armor data list` lists all outputs, `armor echo` prints one, `armor hz` measures its rate",
    ),
    ("monitor", "", "`armor top` shows processor, memory, rates and losses of all components"),
    ("node", "list", "`armor ps` lists the running components"),
    ("node", "info", "`armor describe KIND` and `armor graph` show ports and links"),
    ("node", "kill", "`armor stop COMPONENT` stops one"),
    ("node", "", "`armor ps` lists the running components, `armor watch` follows one"),
    ("launch", "", "`armor run FILE` starts a system"),
    ("start", "", "`armor run FILE` starts a system"),
    ("core", "", "`armor run FILE` starts the registry and all components"),
    ("msg", "", "`armor describe KIND` shows message types with their fields"),
    ("interface", "", "`armor describe KIND` shows message types with their fields"),
    (
        "show",
        "",
        "`armor describe KIND` shows a kind, `armor graph` the links, `armor mission show` the mission",
    ),
    (
        "service",
        "",
        "there are no services: a mission activates components and waits for their events; see `armor mission show`",
    ),
    (
        "action",
        "",
        "there are no actions: a mission activates components and waits for their events; see `armor mission show`",
    ),
    ("lifecycle", "", "the mission activates and freezes components; see `armor mission show`"),
    ("kill", "", "`armor stop COMPONENT` stops one, `armor stop --all` the system"),
    ("pkg", "", "`armor new NAME` begins a component, `armor describe` lists all kinds"),
    ("build", "", "`cargo build --release` in the project of a component builds it"),
    (
        "multiplot",
        "",
        "`armor plot DATA.FIELD` plots in the terminal, `armor-designer --attach` in a window",
    ),
    (
        "rviz",
        "",
        "the kind `operator-view` shows map, scan and trajectory; `armor-designer --attach` the system",
    ),
];

/// Returns what a command of another system is here: `topic echo`, or `rostopic echo` with the
/// prefix that some have.
fn translate_verb(verb: &str, next: &str) -> Option<&'static str> {
    let bare = verb.strip_prefix("ros2").or_else(|| verb.strip_prefix("ros")).unwrap_or(verb);
    // `ros2 topic echo`: the prefix is a word of its own.
    let (bare, next) = if bare.is_empty() { (next, "") } else { (bare, next) };
    let singular = bare.strip_suffix('s').unwrap_or(bare);
    let is_it = |it: &&(&str, &str, &str)| {
        (it.0 == bare || it.0 == singular) && (it.1.is_empty() || it.1 == next)
    };
    FOREIGN_VERBS.iter().find(is_it).map(|(.., here)| *here)
}

/// Adds what a command of another robotics system is here.
fn add_foreign_command(error: &mut clap::Error, arguments: &[String]) {
    if error.kind() != ErrorKind::InvalidSubcommand {
        return;
    }
    let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand) else {
        return;
    };
    let at = arguments.iter().position(|argument| argument == name);
    let next = at.and_then(|at| arguments.get(at + 1)).map_or("", String::as_str);
    if let Some(here) = translate_verb(name, next) {
        // What is merely spelt alike would only mislead.
        error.remove(ContextKind::SuggestedSubcommand);
        let tip = StyledStr::from(here);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
}

/// Adds the command about the component or parameter that follows `armor param` in place of one.
fn add_parameter_command(error: &mut clap::Error, arguments: &[String]) {
    let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand) else {
        return;
    };
    let follows_param = arguments.windows(2).any(|pair| pair[0] == "param" && pair[1] == *name);
    if !follows_param || error.get(ContextKind::SuggestedSubcommand).is_some() {
        return;
    }
    let tip = match split_data(name) {
        Some(_) => format!("`armor param get {name}` prints the value of a parameter"),
        None if is_name(name) => format!("`armor param list {name}` lists those of a component"),
        None => return,
    };
    error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![StyledStr::from(tip)]));
}

/// `dot` is a format of `armor graph` alone, so that the list of formats shows it only there.
fn add_hidden_format(error: &mut clap::Error, arguments: &[String]) {
    let is_format = matches!(
        error.get(ContextKind::InvalidArg),
        Some(ContextValue::String(name)) if name.starts_with("--format")
    );
    if !is_format || !arguments.iter().any(|argument| argument == "graph") {
        return;
    }
    if let Some(ContextValue::Strings(values)) = error.get(ContextKind::ValidValue) {
        let values = values.iter().cloned().chain(["dot".to_owned()]).collect();
        error.insert(ContextKind::ValidValue, ContextValue::Strings(values));
    }
}

/// `armor mission move` takes its two places without options, which `--from` and `--to` resemble.
fn add_moved_places(error: &mut clap::Error, arguments: &[String]) {
    let is_place = matches!(
        error.get(ContextKind::InvalidArg),
        Some(ContextValue::String(name)) if ["--from", "--to"].contains(&name.as_str())
    );
    if error.kind() == ErrorKind::UnknownArgument
        && is_place
        && arguments.iter().any(|argument| argument == "move")
    {
        error.remove(ContextKind::SuggestedArg);
        let tip = StyledStr::from("write `armor mission move FROM TO`, without --from and --to");
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::command_line::CommandLine;

    fn render(arguments: &[&str]) -> String {
        let command = CommandLine::command();
        let mut error = command.clone().try_get_matches_from(arguments).expect_err("wrong usage");
        add_nested_command(&mut error, &command);
        let arguments: Vec<_> = arguments.iter().map(|argument| (*argument).to_owned()).collect();
        add_foreign_command(&mut error, &arguments);
        add_parameter_command(&mut error, &arguments);
        add_hidden_format(&mut error, &arguments);
        add_moved_places(&mut error, &arguments);
        error.render().to_string()
    }

    #[test]
    fn a_command_of_another_system_is_answered_with_the_one_here() {
        for (line, expected) in [
            ("armor topic echo /scan", "tip: `armor echo COMPONENT.OUTPUT` prints data"),
            ("armor rostopic hz /scan", "tip: `armor hz COMPONENT.OUTPUT`"),
            ("armor topics", "tip: `armor data list` lists"),
            ("armor ros2 node list", "tip: `armor ps` lists"),
            ("armor rosnode list", "tip: `armor ps` lists"),
            ("armor nodes", "tip: `armor ps` lists"),
            ("armor roslaunch a.xml", "tip: `armor run FILE`"),
            ("armor launch a.xml", "tip: `armor run FILE`"),
            ("armor roscore", "tip: `armor run FILE`"),
        ] {
            let arguments: Vec<_> = line.split(' ').collect();
            let text = render(&arguments);
            assert!(text.contains(expected), "{line}: {text}");
        }
        assert!(!render(&["armor", "rosy"]).contains("tip: `armor"));
    }

    #[test]
    fn the_places_of_a_move_are_written_without_options() {
        let text = render(&["armor", "mission", "move", "--from", "a", "--to", "b"]);
        assert!(text.contains("write `armor mission move FROM TO`"), "{text}");
        assert!(!text.contains("a similar argument"), "{text}");
    }

    /// A tip names only commands that exist.
    #[test]
    fn the_commands_of_the_tips_exist() {
        let command = CommandLine::command();
        let known: Vec<_> = command.get_subcommands().map(Command::get_name).collect();
        for (verb, _, here) in FOREIGN_VERBS {
            assert!(!known.contains(&verb), "{verb} is a command here");
            for tip in here.split('`').skip(1).step_by(2).filter(|tip| tip.starts_with("armor ")) {
                let name = tip.split(' ').nth(1).unwrap();
                assert!(known.contains(&name), "{tip}");
            }
        }
    }

    #[test]
    fn only_graph_offers_the_format_of_drawings() {
        let text = render(&["armor", "graph", "--format", "png"]);
        assert!(text.contains("[possible values: text, json, dot]"), "{text}");
        let text = render(&["armor", "ps", "--format", "png"]);
        assert!(text.contains("[possible values: text, json]"), "{text}");
    }

    #[test]
    fn a_command_without_its_group_is_answered_with_the_whole_command() {
        let check = |name, expected: &str| {
            let text = render(&["armor", name, "recall"]);
            assert!(text.contains(expected), "{text}");
        };
        check("fire", "tip: did you mean `armor mission fire`?");
        check("fier", "tip: did you mean `armor mission fire`?");
        check(
            "list",
            "tip: did you mean `armor data list` or `armor message list` or `armor param list` or \
             `armor keys list`?",
        );
        let text = render(&["armor", "param", "driver"]);
        assert!(text.contains("tip: `armor param list driver` lists"), "{text}");
        let text = render(&["armor", "param", "driver.speed"]);
        assert!(text.contains("tip: `armor param get driver.speed` prints"), "{text}");
        assert!(render(&["armor", "param", "lst"]).contains("'list'"));
        check("chek", "'check'");
        assert!(!render(&["armor", "xyzzy"]).contains("did you mean"));
        assert!(render(&["armor", "mission", "fier", "t"]).contains("'fire'"));
    }
}
