//! What the arguments of several commands have in common.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use armor_wire::name::{is_name, split_data};
use armor_wire::quantity;
use clap::{Args, ValueEnum};

/// What is printed on stdout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum OutputFormat {
    /// For people.
    #[default]
    Text,
    /// One JSON object per line.
    Json,
    /// Graphviz, for `armor graph` alone, so that no other command offers it.
    #[value(hide = true)]
    Dot,
}

/// Where kinds of components are found besides the stock.
#[derive(Args, Clone, Debug, Default)]
pub struct KindFolders {
    /// Folder of component executables; may be given several times.
    #[arg(long = "components", value_name = "DIR")]
    pub directories: Vec<PathBuf>,
}

/// Selects a running system.
#[derive(Args, Clone, Debug, Default)]
pub struct RunningSystem {
    /// The system with this name; needed if several run.
    #[arg(long, value_name = "NAME")]
    pub system: Option<String>,
    /// The system whose registry listens here.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY")]
    pub registry: Option<SocketAddr>,
}

/// Returns the address at which a registry listens by default.
pub fn default_registry() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], armor_wire::registry::DEFAULT_PORT))
}

/// Reads a time with its unit, such as `30s`.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let seconds = quantity::seconds(text).map_err(|error| match text.trim().parse::<f64>() {
        Ok(number) => format!("a unit is missing: write {number}s, or {number}min"),
        Err(_) => error.to_string(),
    })?;
    Duration::try_from_secs_f64(seconds).map_err(|e| e.to_string())
}

/// Reads the time for which access is given: as [`parse_duration`], and in days, such as `90d`.
pub fn parse_access_time(text: &str) -> Result<Duration, String> {
    let days = text.trim().strip_suffix('d').map(str::trim_end);
    if let Some(days) = days.and_then(|days| days.parse::<f64>().ok()) {
        let time = Duration::try_from_secs_f64(days * 24.0 * 3600.0);
        return time.map_err(|_| format!("{text} is no time: write 12h or 3d"));
    }
    let accepted = "write a number with s, min, h or d, such as 12h or 3d";
    match (parse_duration(text), text.trim().parse::<f64>()) {
        (Ok(time), _) => Ok(time),
        (Err(_), Ok(number)) => Err(format!("a unit is missing: write {number}h or {number}d")),
        (Err(_), Err(_)) => Err(format!("{text:?} is no time: {accepted}")),
    }
}

/// Reads the name of data, `COMPONENT.OUTPUT`.
pub fn parse_data_name(text: &str) -> Result<String, String> {
    match split_data(text) {
        Some(_) => Ok(text.into()),
        None if is_name(text) => Err(format!(
            "write COMPONENT.OUTPUT: {text} is only one of the two; `armor data list` shows all outputs"
        )),
        None => {
            Err("write COMPONENT.OUTPUT; `armor graph` and `armor describe` show outputs".into())
        }
    }
}

/// Reads `NAME=VALUE`.
pub fn parse_pair(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("NAME=VALUE is expected")?;
    Ok((name.to_owned(), value.to_owned()))
}

/// Reads the name of a component or system.
pub fn parse_name(text: &str) -> Result<String, String> {
    if is_name(text) {
        Ok(text.into())
    } else {
        Err("a name starts with a letter, followed by letters, digits, _ and -; at most 64 characters".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn access_is_given_for_days_too_and_a_refusal_names_what_is_accepted() {
        for (text, hours) in [("90d", 2160.0), ("1.5 d", 36.0), ("12h", 12.0), ("30min", 0.5)] {
            let time = parse_access_time(text).expect(text);
            assert_eq!(time, Duration::from_secs_f64(hours * 3600.0), "{text}");
        }
        for (text, words) in [
            ("90", "90h or 90d"),
            ("d", "s, min, h or d"),
            ("3 weeks", "s, min, h or d"),
            ("-1d", "12h or 3d"),
            ("infd", "12h or 3d"),
            ("-1h", "s, min, h or d"),
        ] {
            let error = parse_access_time(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
