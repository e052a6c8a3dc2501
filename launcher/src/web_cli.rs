//! `armor web`: a running system for browsers and programs.

use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::{Context, Result};
use armor_inspect::this_user;
use armor_web::{DEFAULT_LISTEN, WebOptions, WebServer};
use clap::Args;
use serde_json::json;
use tokio::signal::unix::{SignalKind, signal};

use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::print::{print_line, print_notice};
use crate::system;
use crate::verb::Verb;

/// Serve a running system as a page for browsers, as JSON over HTTP, and as metrics.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor web                                      the page is at http://127.0.0.1:8080
  armor web --listen 127.0.0.1:9000              at another port
  curl -s 127.0.0.1:8080/api/data/mapper.pose    a value as JSON; /api/openapi.json lists all routes
  armor connect robot --key alice.key -- armor web    a robot from another computer, with a key

It listens on loopback and serves only this user. To drive the robot from the page, give the system
a component of kind `web-view`, which serves the same page (docs/web.md).")]
pub struct WebArguments {
    /// Where it listens, on loopback.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = DEFAULT_LISTEN)]
    listen: SocketAddr,
    /// The author of orders that name none. Default: user@host.
    #[arg(long = "as", value_name = "NAME")]
    author: Option<String>,
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for WebArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let registry = system::find_registry(&self.running)?.to_string();
        let author = self.author.unwrap_or_else(this_user);
        let options = WebOptions { listen: self.listen, registry, author };
        let server = WebServer::start(&options, None)?;
        let address = server.address();
        if format == OutputFormat::Json {
            print_line(json!({"listen": address, "registry": options.registry}))?;
        } else {
            print_notice(format_args!(
                "the page of the system at {} is http://{address}; Ctrl-C ends it",
                options.registry
            ));
        }
        wait_for_end()?;
        drop(server);
        Ok(CommandEnding::Fine.into())
    }
}

/// Waits for Ctrl-C, SIGTERM or the end of the terminal.
fn wait_for_end() -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("the event loop cannot be started")?;
    runtime.block_on(async {
        let [mut interrupt, mut terminate, mut hang_up] = [
            signal(SignalKind::interrupt())?,
            signal(SignalKind::terminate())?,
            signal(SignalKind::hangup())?,
        ];
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            _ = hang_up.recv() => {}
        }
        Ok(())
    })
}
