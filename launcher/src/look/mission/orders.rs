//! Orders to the executive: one at a time, or many while holding the command.

use std::io::{self, BufRead};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_sdk::control::{Order, TokenMove};
use armor_sdk::operator::{Operator, Verdict};
use serde_json::json;
use tokio::signal::unix::{SignalKind, signal};

use super::super::{Observed, printed, say};
use crate::arguments::{By, Format};
use crate::exit::Ending;

/// How often to look whether the executive is still there.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// How long the command is asked for at a time, while there is no executive.
const COME_BACK_WITHIN: Duration = Duration::from_secs(2);

/// What `operate` reads.
const WORDS: &str = "fire T, pause, resume, safe, move FROM TO [N], confirm T, decline T";

/// Gives one order; fails if it is refused.
///
/// # Errors
/// If there is no answer.
pub fn give(by: &By, order: &Order, format: Format) -> Result<Ending> {
    let mut operator = operator(by)?;
    let verdict = operator.order(by.take, order, by.within)?;
    report(&verdict, None, format)?;
    Ok(if verdict.accepted { Ending::Fine } else { Ending::Failed })
}

/// Holds the command until stdin ends or it is asked to end, and gives the orders that are read.
///
/// # Errors
/// If the command is not to be had, or somebody takes it over.
pub fn operate(by: &By, format: Format) -> Result<Ending> {
    let mut operator = operator(by)?;
    let taken = operator.order(by.take, &Order::Lease, by.within)?;
    if !taken.accepted {
        report(&taken, None, format)?;
        return Ok(Ending::Failed);
    }
    printed(report(&taken, None, format))?;
    let inputs = inputs()?;
    let mut ending = Ending::Fine;
    loop {
        match inputs.recv_timeout(LOOK_EVERY) {
            Ok(Input::Line(line)) if line.trim().is_empty() => {}
            Ok(Input::Line(line)) => match read(&line) {
                Some(order) => {
                    let verdict = operator.order(false, &order, by.within)?;
                    report(&verdict, Some(line.trim()), format)?;
                }
                None => eprintln!("`{}` is no order; there are: {WORDS}", line.trim()),
            },
            Ok(Input::Interrupted) => {
                ending = Ending::Interrupted;
                break;
            }
            Ok(Input::End) | Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if !operator.is_connected() {
            hold_again(&mut operator)?;
        }
    }
    let released = operator.order(false, &Order::Release, by.within)?;
    report(&released, None, format)?;
    Ok(ending)
}

/// The executive was restarted, or the link broke: the lease goes on if one is back in time.
fn hold_again(operator: &mut Operator) -> Result<()> {
    match operator.order(false, &Order::Lease, COME_BACK_WITHIN) {
        Ok(verdict) if !verdict.accepted => bail!("the command is lost: {}", verdict.text),
        Ok(_) => Ok(()),
        Err(error) => {
            eprintln!("no link to the executive: {error}");
            Ok(())
        }
    }
}

fn operator(by: &By) -> Result<Operator> {
    let observed = Observed::find(&by.running, "mission")?;
    let author = by.author.clone().unwrap_or_else(this_user);
    let from = format!("armor mission, process {}", std::process::id());
    Ok(Operator::new(observed.directory().clone(), &from, &author))
}

/// `user@host`, as far as it is known.
fn this_user() -> String {
    let user = ["USER", "LOGNAME"].iter().find_map(|name| std::env::var(name).ok());
    let user = user.filter(|user| !user.is_empty());
    let user = user.unwrap_or_else(|| format!("user {}", rustix::process::getuid().as_raw()));
    format!("{user}@{}", rustix::system::uname().nodename().to_string_lossy())
}

fn report(verdict: &Verdict, order: Option<&str>, format: Format) -> Result<()> {
    let Verdict { accepted, text } = verdict;
    match format {
        Format::Json => say(json!({ "order": order, "accepted": accepted, "text": text })),
        _ if *accepted => say(text),
        _ => {
            let how = if text.ends_with("take it over") { " with --take" } else { "" };
            eprintln!("refused: {text}{how}");
            Ok(())
        }
    }
}

enum Input {
    Line(String),
    End,
    Interrupted,
}

/// Lines of stdin and its end, SIGINT and SIGTERM. SIGHUP is not among them: a terminal that is cut
/// off is a lost link.
fn inputs() -> Result<Receiver<Input>> {
    let (sender, inputs) = mpsc::channel();
    let asked = sender.clone();
    let read = move || {
        for line in io::stdin().lock().lines() {
            let Ok(line) = line else { break };
            if sender.send(Input::Line(line)).is_err() {
                return;
            }
        }
        let _ = sender.send(Input::End);
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (mut interrupt, mut terminate) = {
        let _entered = runtime.enter();
        (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?)
    };
    let wait = move || {
        runtime.block_on(async {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
        });
        let _ = asked.send(Input::Interrupted);
    };
    thread::Builder::new().name("stdin".into()).spawn(read).context("no thread")?;
    thread::Builder::new().name("signals".into()).spawn(wait).context("no thread")?;
    Ok(inputs)
}

/// An order as people write it.
fn read(line: &str) -> Option<Order> {
    let words: Vec<_> = line.split_whitespace().collect();
    let name = |name: &str| name.to_owned();
    Some(match words[..] {
        ["fire", transition] => Order::Fire { transition: name(transition) },
        ["confirm", transition] => Order::Confirm { transition: name(transition) },
        ["decline", transition] => Order::Decline { transition: name(transition) },
        ["pause"] => Order::Pause,
        ["resume"] => Order::Resume,
        ["safe"] => Order::Safe,
        ["move", from, to] => moved(from, to, 1),
        ["move", from, to, tokens] => moved(from, to, tokens.parse().ok()?),
        _ => return None,
    })
}

fn moved(from: &str, to: &str, tokens: u32) -> Order {
    let (from, to) = (from.to_owned(), to.to_owned());
    Order::Move { moves: vec![TokenMove { from, to, tokens }] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_as_people_write_them() {
        assert_eq!(read(" fire  recall "), Some(Order::Fire { transition: "recall".into() }));
        assert_eq!(read("move a b"), Some(moved("a", "b", 1)));
        assert_eq!(read("move a b 3"), Some(moved("a", "b", 3)));
        for nothing in ["", "fire", "fire a b", "move a", "move a b many", "fly"] {
            assert_eq!(read(nothing), None, "{nothing:?}");
        }
    }
}
