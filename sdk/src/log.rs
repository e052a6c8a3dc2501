//! The log of a component's process: plain lines on stderr. The launcher adds time and name to those of
//! its processes; a process that was started by hand adds the date itself.
//! A component logs with the macros of `tracing`; what is written is filtered by level and module, and
//! the filter can be changed while the process runs.

use std::io::IsTerminal;
use std::sync::OnceLock;

use tracing_subscriber::Registry;
use tracing_subscriber::filter::{LevelFilter, ParseError, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::reload::{self, Handle};
use tracing_subscriber::util::SubscriberInitExt;

/// Longest filter that is accepted, in bytes.
const MAX_FILTER_LEN: usize = 1 << 10;

/// Set in the environment of every process whose lines a launcher reads.
const LAUNCHED_VARIABLE: &str = "ARMOR_PROCESS";

/// Libraries that log as INFO what is of use only to them, and the level from which on they are logged.
/// `notify` does so whenever a file that is watched is replaced.
const QUIET: [(&str, LevelFilter); 1] = [("notify", LevelFilter::WARN)];

static FILTER: OnceLock<Handle<Targets, Registry>> = OnceLock::new();

/// Logs to stderr; `ARMOR_LOG` filters, such as `debug` or `armor_sdk=trace,info`.
///
/// Does nothing if the process has a log already.
pub fn init() {
    let filter = std::env::var("ARMOR_LOG").unwrap_or_else(|_| "info".into());
    let targets = parse_targets(&filter)
        .unwrap_or_else(|_| Targets::new().with_default(tracing::Level::INFO));
    let (targets, handle) = reload::Layer::new(targets);
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false);
    let registry = tracing_subscriber::registry().with(targets);
    let begun = if std::env::var_os(LAUNCHED_VARIABLE).is_some() {
        registry.with(lines.without_time()).try_init()
    } else {
        registry.with(lines).try_init()
    };
    if begun.is_ok() {
        let _ = FILTER.set(handle);
    }
}

/// Replaces the filter of [`init`].
///
/// # Errors
/// In words, if it is no filter, or the log of this process is not that of [`init`].
pub(crate) fn set_filter(filter: &str) -> Result<(), String> {
    let handle = FILTER.get().ok_or("the log of this process is not the SDK's")?;
    handle.reload(parse_filter(filter)?).map_err(|error| error.to_string())
}

/// Reads a filter; the modules of [`QUIET`] have their level if it does not name them.
fn parse_targets(filter: &str) -> Result<Targets, ParseError> {
    let targets: Targets = filter.parse()?;
    let quiet = QUIET.iter().filter(|(module, _)| !filter.contains(module));
    // A filter that is stricter stays as it is.
    let quiet = quiet.filter(|(_, level)| targets.default_level().is_none_or(|it| it > *level));
    let quiet: Vec<_> = quiet.collect();
    Ok(quiet
        .into_iter()
        .fold(targets, |targets, (module, level)| targets.with_target(*module, *level)))
}

fn parse_filter(filter: &str) -> Result<Targets, String> {
    let known = "write error, warn, info, debug, trace or off, or modules with their levels, such as \
                 my_crate=debug,info";
    if filter.trim().is_empty() || filter.len() > MAX_FILTER_LEN {
        return Err(format!("this is no filter: {known}"));
    }
    let targets = parse_targets(filter).map_err(|error| format!("{error}; {known}"))?;
    // A word that is no level is read as a module of which everything is logged: a typing mistake.
    let is_word = !filter.contains(['=', ',', ':']);
    if is_word && targets.default_level().is_none() {
        return Err(format!("`{filter}` is no level; {known}"));
    }
    Ok(targets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_are_quiet_unless_the_filter_names_them() {
        let logs = |filter: &str, level| {
            parse_filter(filter).is_ok_and(|it| it.would_enable("notify::inotify", &level))
        };
        assert!(!logs("info", tracing::Level::INFO) && logs("info", tracing::Level::WARN));
        assert!(!logs("armor_configd=debug,info", tracing::Level::INFO));
        assert!(logs("notify=info,info", tracing::Level::INFO));
        assert!(!logs("error", tracing::Level::WARN), "it makes nothing louder");
    }

    #[test]
    fn a_filter_is_a_level_or_levels_of_modules() {
        let level = |text: &str| parse_filter(text).map(|targets| targets.default_level());
        assert_eq!(level("debug"), Ok(Some(LevelFilter::DEBUG)));
        assert_eq!(level("off"), Ok(Some(LevelFilter::OFF)));
        assert_eq!(level("my_crate=debug,warn"), Ok(Some(LevelFilter::WARN)));
        for wrong in ["", "debgu", "my_crate=loud", &"a".repeat(2000)] {
            assert!(parse_filter(wrong).is_err(), "{wrong}");
        }
    }
}
