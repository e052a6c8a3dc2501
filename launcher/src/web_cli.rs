//! `armor web`: a running system for browsers and programs.

use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::{Context, Result};
use armor_inspect::this_user;
use armor_web::{DEFAULT_LISTEN, RemoteFacts, WebOptions, WebServer};
use clap::Args;
use serde_json::json;
use tokio::signal::unix::{SignalKind, signal};

use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::keys_cli::{KeysDirectory, PAGE_PORT};
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
  armor web --listen 0.0.0.0:8443                for phones: HTTPS with the key of this host

On loopback it serves only this user. Beyond, it needs the key of this host (`armor keys add robot
--role host --at robot.local`), and people log in with a link (`armor keys invite`). To drive the robot from the page, give the system
a component of kind `web-view`, which serves the same page (docs/web.md).")]
pub struct WebArguments {
    /// Where it listens; beyond loopback with HTTPS, for people with an invitation.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = DEFAULT_LISTEN)]
    listen: SocketAddr,
    /// The author of orders that name none. Default: user@host.
    #[arg(long = "as", value_name = "NAME")]
    author: Option<String>,
    #[command(flatten)]
    directory: KeysDirectory,
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for WebArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        armor_sdk::log::init();
        let registry = system::find_registry(&self.running)?.to_string();
        let author = self.author.clone().unwrap_or_else(this_user);
        let keys = self.directory.path().ok();
        let options = WebOptions { listen: self.listen, keys, registry, author };
        let server = WebServer::start(&options, None)?;
        let address = server.address();
        let registry = &options.registry;
        if format == OutputFormat::Json {
            let mut record = json!({"listen": address, "registry": registry});
            if let Some(facts) = server.remote() {
                record["urls"] = json!(facts.urls);
                record["fingerprint"] = json!(facts.fingerprint);
                record["authority_fingerprint"] = json!(facts.authority_fingerprint);
            }
            print_line(record)?;
        } else if let Some(facts) = server.remote() {
            print_notice(format_args!(
                "the page of the system at {registry} is {}; Ctrl-C ends it\n\
                 its certificate: SHA-256 {}\n\
                 its authority:   SHA-256 {}\n\
                 people log in with the link of an invitation: armor keys invite NAME --role ROLE{}",
                facts.urls.join(" and "),
                facts.fingerprint,
                facts.authority_fingerprint,
                self.describe_invitation(&facts)
            ));
        } else {
            print_notice(format_args!(
                "the page of the system at {registry} is http://{address}; Ctrl-C ends it"
            ));
        }
        wait_for_end()?;
        drop(server);
        Ok(CommandEnding::Fine.into())
    }
}

impl WebArguments {
    /// Returns the further arguments with which a link leads to this page.
    fn describe_invitation(&self, facts: &RemoteFacts) -> String {
        let mut text = String::new();
        let first = facts.urls.first().and_then(|url| url.strip_prefix("https://"));
        if let Some(at) = first.map(|at| at.trim_end_matches('/'))
            && !at.ends_with(&format!(":{PAGE_PORT}"))
        {
            text += &format!(" --at {at}");
        }
        if let Some(keys) = &self.directory.keys {
            text += &format!(" --keys {}", keys.display());
        }
        text
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
