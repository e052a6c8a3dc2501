//! The command line of the window.

use std::path::{Path, PathBuf};

pub(super) const USAGE: &str = "\
usage: armor-operator-view --watch FILE|HOST:PORT [--picture PNG] [--light]
  --watch FILE        show every run of this file, and stay open when it has ended
  --watch HOST:PORT   the same for the system whose registry has this address
  --picture PNG       no window: paint the screen as this file, twice per second
  --light             begin with the light theme, for sunlight";

/// What the command line asks for.
#[derive(Debug, Default, PartialEq)]
pub(super) struct StationOptions {
    pub(super) watched: String,
    pub(super) picture: Option<PathBuf>,
    pub(super) is_light: bool,
}

pub(super) fn parse_options(arguments: &[String]) -> Result<StationOptions, String> {
    let mut options = StationOptions::default();
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        let mut value = || {
            let value = arguments.next().filter(|value| !value.starts_with("--"));
            value.cloned().ok_or_else(|| format!("{argument} needs a value"))
        };
        match argument.as_str() {
            "--watch" => options.watched = value()?,
            "--picture" => options.picture = Some(value()?.into()),
            "--light" => options.is_light = true,
            other => return Err(format!("unknown argument `{other}`")),
        }
    }
    let is_address = options.watched.parse::<std::net::SocketAddr>().is_ok();
    if !is_address && !Path::new(&options.watched).is_file() {
        return Err(format!("{} is no file, and no HOST:PORT", options.watched));
    }
    Ok(options)
}
