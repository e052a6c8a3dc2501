//! The relay as a process of the network under test: its orders and its answers.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use anyhow::{Context, Result, bail};

use super::network::TestNetwork;
use super::relay::{NetworkQuality, RELAY};

/// How long it may take to carry out an order: data pass all the time.
const ANSWERS_WITHIN: Duration = Duration::from_secs(10);

/// It ends when this is dropped.
pub struct RelayProcess {
    child: Child,
    orders: ChildStdin,
    answers: Receiver<String>,
}

impl RelayProcess {
    /// Starts it in the namespace of the router, between the ports of two hosts.
    ///
    /// # Errors
    /// If it does not listen.
    pub fn start(network: &TestNetwork, seed: u64, routes: &[String]) -> Result<Self> {
        let mut command = network.command_on_router(&std::env::current_exe()?);
        command.arg(RELAY).arg(seed.to_string()).args(routes);
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().context("the relay does not start")?;
        let orders = child.stdin.take().context("no pipe")?;
        let stdout = child.stdout.take().context("no pipe")?;
        let (sender, answers) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        let relay = Self { child, orders, answers };
        relay.wait_for("ready")?;
        Ok(relay)
    }

    /// Changes the network.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn set_quality(&mut self, quality: NetworkQuality) -> Result<()> {
        self.order(&quality.to_order())?;
        self.wait_for("quality").map(drop)
    }

    /// Resets all connections; returns how many there were.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn reset_all(&mut self) -> Result<u64> {
        self.order("reset")?;
        Ok(self.wait_for("reset")?.parse()?)
    }

    /// Changes a bit of the next piece, or passes only its first half; returns when it has.
    ///
    /// # Errors
    /// If nothing passes.
    pub fn spoil_next(&mut self, truncates: bool) -> Result<()> {
        let (order, answer) =
            if truncates { ("truncate", "truncated") } else { ("corrupt", "corrupted") };
        self.order(order)?;
        self.wait_for(answer).map(drop)
    }

    fn order(&mut self, order: &str) -> Result<()> {
        writeln!(self.orders, "{order}").context("the relay has ended")
    }

    fn wait_for(&self, wanted: &str) -> Result<String> {
        let answer = self.answers.recv_timeout(ANSWERS_WITHIN);
        let answer = answer.with_context(|| format!("the relay does not answer `{wanted}`"))?;
        match answer.split_once(' ').unwrap_or((&answer, "")) {
            (first, rest) if first == wanted => Ok(rest.to_owned()),
            _ => bail!("the relay answers `{answer}`, not `{wanted}`"),
        }
    }
}

impl Drop for RelayProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
