//! The log of a component's process: plain lines on stderr, to which the launcher adds time and
//! name.

use std::io::IsTerminal;

use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Logs to stderr; `ARMOR_LOG` filters, such as `debug` or `armor_sdk=trace,info`.
///
/// Does nothing if the process has a log already.
pub fn init() {
    let filter = std::env::var("ARMOR_LOG").unwrap_or_else(|_| "info".into());
    let targets: Targets =
        filter.parse().unwrap_or_else(|_| Targets::new().with_default(tracing::Level::INFO));
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time();
    let _ = tracing_subscriber::registry().with(targets).with(lines).try_init();
}
