//! Orders to the executive: one at a time, or many while holding the command.

use std::io::{self, BufRead};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use armor_inspect::systems::{self, RunRecord};
use armor_inspect::{ObservedSystem, this_user};
use armor_robotfile::advise_similar;
use armor_sdk::control::{Order, TokenMove};
use armor_sdk::operator::{Operator, OrderError, OrderVerdict};
use serde_json::json;
use tokio::signal::unix::{SignalKind, signal};

use super::super::{describe_restarting, select_system};
use super::EXECUTIVE;
use super::arguments::OrderArguments;
use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line, print_notice};
use crate::system;

/// Period of the check that the executive is still connected.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Longest time of one attempt to reconnect while there is no executive.
const COME_BACK_WITHIN: Duration = Duration::from_secs(2);
/// A system on another host counts as ended after its executive and its registry have not answered
/// for this long.
const GONE_AFTER: Duration = Duration::from_secs(10);

/// What `operate` reads.
const WORDS: &str = "fire T, pause, resume, safe, move FROM TO [N], confirm T, decline T";

/// Gives one order; fails if it is refused.
///
/// # Errors
/// If there is no answer.
pub fn give(by: &OrderArguments, order: &Order, format: OutputFormat) -> Result<CommandEnding> {
    let mut operator = operator(by)?;
    let verdict = send_order(&mut operator, by.take, order, by)?;
    report(&verdict, None, format)?;
    Ok(if verdict.accepted { CommandEnding::Fine } else { CommandEnding::Failed })
}

/// Holds the command until stdin ends, the system does, or it is asked to end, and gives the orders
/// that are read. Fails if one of them was refused.
///
/// # Errors
/// If the command cannot be taken, or another operator takes it over.
pub fn operate(by: &OrderArguments, format: OutputFormat) -> Result<CommandEnding> {
    let mut commanded = Commanded::find(&by.running)?;
    let mut operator = operator(by)?;
    let taken = send_order(&mut operator, by.take, &Order::Lease, by)?;
    if !taken.accepted {
        report(&taken, None, format)?;
        return Ok(CommandEnding::Failed);
    }
    end_printing(report(&taken, None, format))?;
    let inputs = inputs()?;
    let mut ending = CommandEnding::Fine;
    loop {
        match inputs.recv_timeout(LOOK_EVERY) {
            Ok(OperatorLine::Line(line)) if line.trim().is_empty() => {}
            Ok(OperatorLine::Line(line)) => {
                if !carry_out(&mut operator, line.trim(), by, format)? {
                    ending = CommandEnding::Failed;
                }
            }
            Ok(OperatorLine::Interrupted) => {
                ending = CommandEnding::Interrupted;
                break;
            }
            Ok(OperatorLine::End) | Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if operator.is_connected() {
            commanded.away_since = None;
        } else if !commanded.come_back(&mut operator)? {
            print_notice("the system that was commanded has ended");
            return Ok(ending);
        }
        if let Some(why) = operator.lost() {
            bail!("the command is lost: {why}");
        }
    }
    let released = operator.order(false, &Order::Release, by.within)?;
    report(&released, None, format)?;
    Ok(ending)
}

/// Gives the order that stands in a line. Answers whether it is accepted.
fn carry_out(
    operator: &mut Operator,
    line: &str,
    by: &OrderArguments,
    format: OutputFormat,
) -> Result<bool> {
    let Some(order) = read(line) else {
        print_notice(describe_unreadable(line));
        return Ok(false);
    };
    let verdict = send_order(operator, false, &order, by)?;
    report(&verdict, Some(line), format)?;
    Ok(verdict.accepted)
}

/// The system whose mission is commanded, and no other that comes after it in its place.
struct Commanded {
    observed: ObservedSystem,
    /// As the launcher has written it down, if this user runs it on this host.
    record: Option<RunRecord>,
    /// Since when its executive cannot be reached.
    away_since: Option<Instant>,
}

impl Commanded {
    fn find(running: &RunningSystem) -> Result<Self> {
        let observed = select_system(running, "mission")?;
        Ok(Self { observed, record: system::find_record(running).ok(), away_since: None })
    }

    /// The executive was restarted, or the link broke: the command is kept if the connection is
    /// made again in time. Answers whether the system is still there.
    fn come_back(&mut self, operator: &mut Operator) -> Result<bool> {
        if self.has_ended()? {
            return Ok(false);
        }
        match operator.order(false, &Order::Rejoin, COME_BACK_WITHIN) {
            // `lost` records whether it is lost.
            Ok(_) | Err(OrderError::Lost(_)) => self.away_since = None,
            Err(error) => {
                if self.away_since.is_none() {
                    self.away_since = Some(Instant::now());
                    print_notice(format_args!("no link to the executive: {error}; trying on"));
                }
            }
        }
        Ok(true)
    }

    fn has_ended(&self) -> Result<bool> {
        match &self.record {
            Some(RunRecord { pid, registry, .. }) => {
                let mut running = systems::list_running(&systems::record_directory()?)?.into_iter();
                Ok(!running.any(|it| it.pid == *pid && it.registry == *registry))
            }
            // Of another host only this is known.
            None => {
                let away = self.away_since.map(|since| since.elapsed());
                Ok(away.is_some_and(|away| away > GONE_AFTER) && self.observed.list().is_err())
            }
        }
    }
}

/// Sends an order; an error distinguishes a system without a mission from an executive that is being
/// started again.
fn send_order(
    operator: &mut Operator,
    take: bool,
    order: &Order,
    by: &OrderArguments,
) -> Result<OrderVerdict> {
    operator.order(take, order, by.within).map_err(|error| {
        let is_missing = matches!(error, OrderError::NoExecutive(_));
        let restarting = is_missing.then(|| describe_restarting(&by.running, EXECUTIVE)).flatten();
        match restarting {
            Some(restarting) => anyhow!("the order was not sent: {restarting}"),
            None => error.into(),
        }
    })
}

fn operator(by: &OrderArguments) -> Result<Operator> {
    let observed = select_system(&by.running, "mission")?;
    let author = by.author.clone().unwrap_or_else(this_user);
    let from = format!("armor mission, process {}", std::process::id());
    Ok(Operator::new(observed.directory().clone(), &from, &author))
}

fn report(verdict: &OrderVerdict, order: Option<&str>, format: OutputFormat) -> Result<()> {
    let OrderVerdict { accepted, text } = verdict;
    match format {
        OutputFormat::Json => {
            print_line(json!({ "order": order, "accepted": accepted, "text": text }))
        }
        _ if *accepted => print_line(text),
        _ => {
            let how = if text.ends_with("take it over") { " with --take" } else { "" };
            print_notice(format_args!("refused: {text}{how}"));
            Ok(())
        }
    }
}

enum OperatorLine {
    Line(String),
    End,
    Interrupted,
}

/// Lines of stdin and its end, SIGINT and SIGTERM. SIGHUP is not among them: a terminal that is cut
/// off is a lost link.
fn inputs() -> Result<Receiver<OperatorLine>> {
    let (sender, inputs) = mpsc::channel();
    let asked = sender.clone();
    let read = move || {
        for line in io::stdin().lock().lines() {
            let Ok(line) = line else { break };
            if sender.send(OperatorLine::Line(line)).is_err() {
                return;
            }
        }
        let _ = sender.send(OperatorLine::End);
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
        let _ = asked.send(OperatorLine::Interrupted);
    };
    thread::Builder::new().name("stdin".into()).spawn(read).context("no thread")?;
    thread::Builder::new().name("signals".into()).spawn(wait).context("no thread")?;
    Ok(inputs)
}

/// Returns why a line is no order, and what was probably meant.
fn describe_unreadable(line: &str) -> String {
    let names = || WORDS.split(", ").filter_map(|order| order.split(' ').next());
    let name = line.split_whitespace().next().unwrap_or_default();
    let advice = advise_similar(name, names().filter(|known| *known != name));
    format!("`{line}` is no order{advice} (there are: {WORDS})")
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
        let advice = describe_unreadable("fier recall");
        assert!(advice.starts_with("`fier recall` is no order; did you mean fire? (there are: "));
        assert!(describe_unreadable("fire a b").starts_with("`fire a b` is no order (there are: "));
        for nothing in ["", "fire", "fire a b", "move a", "move a b many", "fly"] {
            assert_eq!(read(nothing), None, "{nothing:?}");
        }
    }
}
