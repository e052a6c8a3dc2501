//! A command to one process that is answered with whether it is carried out, and the answer in print.

use std::sync::mpsc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_sdk::control::{Answer, Command, ControlConnection, ControlEvent, Role};
use armor_wire::registry::ComponentEntry;
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line, print_notice};

/// A process answers within this time.
pub const ANSWER_WITHIN: Duration = Duration::from_secs(3);
/// Names the only command of a connection.
pub const REQUEST: u64 = 1;

/// Whether a command is carried out, and what follows from it, or why it is refused.
pub struct CommandAnswer {
    accepted: bool,
    text: String,
}

/// Sends a command with the number [`REQUEST`] and waits for its answer. `from` is the program.
///
/// # Errors
/// If the process cannot be reached, or does not answer.
pub fn send_command(
    entry: &ComponentEntry,
    from: &str,
    command: &Command,
) -> Result<CommandAnswer> {
    let name = &entry.name;
    let (sender, answers) = mpsc::channel();
    let sink = move |event| {
        let answer = match event {
            ControlEvent::Answer(Answer::Ordered { request: REQUEST, accepted, text }) => {
                Ok(CommandAnswer { accepted, text })
            }
            ControlEvent::Closed(reason) => Err(reason),
            ControlEvent::Answer(_) => return,
        };
        // The first answer is the one that is read.
        let _ = sender.send(answer);
    };
    let connection = ControlConnection::connect(entry, Role::Operator, from, sink)
        .with_context(|| format!("{name} cannot be reached"))?;
    connection.send(command)?;
    match answers.recv_timeout(ANSWER_WITHIN) {
        Ok(Ok(answer)) => Ok(answer),
        Ok(Err(reason)) => bail!(
            "{name} has closed the connection ({reason}); it may have been built with an older SDK, \
             which does not know this command"
        ),
        Err(_) => bail!("{name} has not answered within {} s", ANSWER_WITHIN.as_secs()),
    }
}

impl CommandAnswer {
    /// Prints it, after `subject` if it is carried out; fails if it is refused.
    ///
    /// # Errors
    /// If it cannot be printed.
    pub fn print(&self, subject: &str, format: OutputFormat) -> Result<CommandEnding> {
        let Self { accepted, text } = self;
        match format {
            OutputFormat::Json => {
                end_printing(print_line(json!({ "accepted": accepted, "text": text })))?;
            }
            _ if *accepted => {
                end_printing(print_line(format_args!("{subject}{text}")))?;
            }
            _ => print_notice(format_args!("refused: {text}")),
        }
        Ok(if *accepted { CommandEnding::Fine } else { CommandEnding::Failed })
    }
}
