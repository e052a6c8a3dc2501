//! `armor connect`: tools on this computer reach the system of a robot through its gate.

use std::ffi::OsString;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_keys::connect::{GateClient, GateError, GateNotice, GateSession, ToolNotice};
use armor_keys::expiry::{describe_notice, find_notice};
use armor_socket::{FaultTable, listen};
use armor_wire::gate::GATE_PORT;
use clap::Args;
use serde_json::json;
use tokio::net::TcpListener;
use tokio::process::{Child, Command};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{print_line, print_notice};
use crate::run::glibc;
use crate::verb::Verb;

/// Period with which the end of the key is looked at.
const LOOK_AT_KEY: Duration = Duration::from_secs(60 * 60);
/// Changes of the connection that wait to be printed.
const MAX_NOTICES: usize = 16;

/// Reach the system of a robot through its gate, with a key.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor connect robot:7410 --key alice.key -- armor mission show
  armor connect robot:7410 --key alice.key -- armor-designer --attach
  armor connect robot --key alice.key          stays, and prints what to export in other terminals

The tools need nothing else: ARMOR_VIA is the proxy on this computer, which only this user can use,
and ARMOR_REGISTRY the registry on the robot's host.")]
pub struct ConnectArguments {
    /// Where the gate listens. Without a port: 7410.
    #[arg(value_name = "HOST:PORT")]
    pub gate: String,
    /// File of the key, as `armor keys add` has made it.
    #[arg(long, value_name = "FILE")]
    pub key: PathBuf,
    /// Where the proxy for the tools listens, on loopback. Default: a free port.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub listen: Option<SocketAddr>,
    /// What to run with the connection; its exit code is that of this command.
    #[arg(last = true, value_name = "COMMAND")]
    pub command: Vec<OsString>,
}

impl Verb for ConnectArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("the event loop cannot be started")?;
        let ending = runtime.block_on(connect(&self, format));
        // A lookup of a name that hangs is not waited for.
        runtime.shutdown_background();
        ending
    }
}

async fn connect(arguments: &ConnectArguments, format: OutputFormat) -> Result<ExitCode> {
    let mut signals = Signals::new()?;
    let client = Arc::new(GateClient::new(&with_port(&arguments.gate), &arguments.key)?);
    tokio::spawn(announce_end(Arc::clone(&client)));
    let listen_at = arguments.listen.unwrap_or_else(|| (Ipv4Addr::LOCALHOST, 0).into());
    let proxy = listen_for_tools(listen_at)?;
    let via = proxy.local_addr()?;
    let (sender, mut notices) = mpsc::channel(MAX_NOTICES);
    let watching = Arc::clone(&client);
    tokio::spawn(async move {
        watching.watch_gate(|notice| drop(sender.try_send(notice))).await;
    });
    let session = tokio::select! {
        notice = notices.recv() => match notice.context("the connection is not watched")? {
            GateNotice::Connected(session) => session,
            GateNotice::Lost(error) => bail!(error),
        },
        ending = signals.wait() => return Ok(ending.into()),
    };
    let faults = Arc::new(FaultTable::default());
    let report = move |notice: ToolNotice| match notice {
        ToolNotice::NotCarried(error @ GateError::Refused(_)) => {
            if faults.is_new(None, error.to_string()) {
                print_notice(error);
            }
        }
        // The loss of the gate is reported by the session.
        ToolNotice::NotCarried(_) => {}
        ToolNotice::NotAccepting(error) => {
            print_notice(format_args!("no connection of a tool can be accepted: {error}"));
        }
        ToolNotice::AcceptsAgain => print_notice("connections of tools are accepted again"),
    };
    tokio::spawn(client.serve_tools(proxy, report));
    let GateSession { host, name, role, registry } = &session;
    if arguments.command.is_empty() {
        print_notice(format_args!("connected to {host} as {name} ({role}); Ctrl-C ends it"));
        print_line(match format {
            OutputFormat::Json => json!({
                "via": via, "registry": registry, "host": host, "name": name,
                "role": role.name(),
            })
            .to_string(),
            _ => format!("export ARMOR_VIA={via} ARMOR_REGISTRY={registry}"),
        })?;
        let ending = tokio::select! {
            ending = signals.wait() => ending,
            () = report_changes(&mut notices, &session) => CommandEnding::Failed,
        };
        return Ok(ending.into());
    }
    let mut child = start_command(&arguments.command, via, *registry)?;
    let code = tokio::select! {
        code = wait_for_command(&mut child, &mut signals) => code?,
        () = report_changes(&mut notices, &session) => CommandEnding::Failed.code(),
    };
    Ok(code.into())
}

/// Announces the end of the key, once for each of the times ahead.
async fn announce_end(client: Arc<GateClient>) {
    let mut announced = None;
    loop {
        let facts = client.facts();
        let now_s = armor_keys::expiry::now_s();
        let notice = find_notice(facts.not_after_s, now_s).map(|days| (facts.serial, days));
        if notice != announced
            && let Some(text) = describe_notice(&facts.holder.name, facts.not_after_s, now_s)
        {
            print_notice(format_args!("warning: {text}"));
        }
        announced = notice;
        tokio::time::sleep(LOOK_AT_KEY).await;
    }
}

/// Prints when the gate is lost and when it is back.
async fn report_changes(notices: &mut mpsc::Receiver<GateNotice>, first: &GateSession) {
    let mut known = first.clone();
    while let Some(notice) = notices.recv().await {
        match notice {
            GateNotice::Lost(error) => {
                print_notice(format_args!("{error}; trying again until it is back"));
            }
            GateNotice::Connected(session) => {
                print_notice(format_args!("connected to {} again", session.host));
                if session.registry != known.registry {
                    print_notice(format_args!(
                        "its system has another registry now: export ARMOR_REGISTRY={}",
                        session.registry
                    ));
                }
                known = session;
            }
        }
    }
}

fn with_port(gate: &str) -> String {
    let has_port = gate.rsplit_once(':').is_some_and(|(host, port)| {
        port.parse::<u16>().is_ok() && (!host.contains(':') || host.ends_with(']'))
    });
    if has_port {
        return gate.to_owned();
    }
    // An address of IPv6 alone has colons of its own.
    let is_bare = gate.contains(':') && !gate.starts_with('[');
    if is_bare { format!("[{gate}]:{GATE_PORT}") } else { format!("{gate}:{GATE_PORT}") }
}

fn listen_for_tools(address: SocketAddr) -> Result<TcpListener> {
    let armor_socket::Listener::Tcp(listener) = listen(address)? else {
        bail!("the proxy needs a TCP port");
    };
    Ok(TcpListener::from_std(listener)?)
}

fn start_command(command: &[OsString], via: SocketAddr, registry: SocketAddr) -> Result<Child> {
    let mut start = Command::new(&command[0]);
    start.args(&command[1..]).env("ARMOR_VIA", via.to_string());
    start.env("ARMOR_REGISTRY", registry.to_string());
    glibc::remove_settings(start.as_std_mut());
    let name = command[0].display();
    start.spawn().with_context(|| format!("{name} cannot be started"))
}

/// Waits for the end of the command; SIGTERM is passed on to it. Ctrl-C has reached it already.
async fn wait_for_command(child: &mut Child, signals: &mut Signals) -> Result<u8> {
    loop {
        tokio::select! {
            status = child.wait() => {
                // As shells do for a command that a signal has ended.
                let status = status.context("the command is lost")?;
                let signal = std::os::unix::process::ExitStatusExt::signal(&status);
                let code = status.code().unwrap_or_else(|| 128 + signal.unwrap_or_default());
                return Ok(u8::try_from(code).unwrap_or(u8::MAX));
            }
            ending = signals.wait() => {
                if ending == CommandEnding::Fine
                    && let Some(pid) = child.id().and_then(|pid| i32::try_from(pid).ok())
                    && let Some(pid) = rustix::process::Pid::from_raw(pid)
                {
                    let _ = rustix::process::kill_process(pid, rustix::process::Signal::TERM);
                }
            }
        }
    }
}

/// The signals that end this command.
struct Signals {
    interrupt: Signal,
    terminate: Signal,
}

impl Signals {
    fn new() -> Result<Self> {
        let interrupt = signal(SignalKind::interrupt())?;
        Ok(Self { interrupt, terminate: signal(SignalKind::terminate())? })
    }

    async fn wait(&mut self) -> CommandEnding {
        tokio::select! {
            _ = self.interrupt.recv() => CommandEnding::Interrupted,
            _ = self.terminate.recv() => CommandEnding::Fine,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_port_of_a_gate_may_be_left_out() {
        for (given, used) in [
            ("robot", "robot:7410"),
            ("robot:7500", "robot:7500"),
            ("10.0.0.2", "10.0.0.2:7410"),
            ("fd00::2", "[fd00::2]:7410"),
            ("[fd00::2]", "[fd00::2]:7410"),
            ("[fd00::2]:80", "[fd00::2]:80"),
        ] {
            assert_eq!(with_port(given), used);
        }
    }
}
