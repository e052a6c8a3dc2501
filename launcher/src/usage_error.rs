//! Wrong usage: the parser's message at the width of the terminal, with the command that was
//! probably meant.

use armor_robotfile::suggest_similar;
use clap::Command;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::print::{fits_stderr, print_notice};

/// Prints a message of the parser (an error, help or the version) and ends the process.
pub fn exit_with(mut error: clap::Error, command: &Command) -> ! {
    add_nested_command(&mut error, command);
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

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::command_line::CommandLine;

    fn render(arguments: &[&str]) -> String {
        let command = CommandLine::command();
        let mut error = command.clone().try_get_matches_from(arguments).expect_err("wrong usage");
        add_nested_command(&mut error, &command);
        error.render().to_string()
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
            "tip: did you mean `armor data list` or `armor param list` or `armor keys list`?",
        );
        check("chek", "'check'");
        assert!(!render(&["armor", "xyzzy"]).contains("did you mean"));
        assert!(render(&["armor", "mission", "fier", "t"]).contains("'fire'"));
    }
}
