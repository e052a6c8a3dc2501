//! Finds the running system that a tool is to look at.

use std::net::SocketAddr;

use anyhow::{Result, bail};

use crate::arguments::Running;
use armor_inspect::systems::{self, RunRecord};

/// Where the registry of the system that is meant listens: the one told, the one with that name, or
/// the only one.
///
/// # Errors
/// If there is none, or several.
pub fn registry(running: &Running) -> Result<SocketAddr> {
    if let Some(registry) = running.registry {
        return Ok(registry);
    }
    let records = systems::list_running(&systems::record_directory()?)?;
    choose(records, running.system.as_deref())
}

/// What is known of the system that is meant, if this user runs it on this host.
///
/// # Errors
/// If there is none, or several.
pub fn record(running: &Running) -> Result<RunRecord> {
    let mut records = systems::list_running(&systems::record_directory()?)?;
    if let Some(registry) = running.registry {
        records.retain(|record| record.registry == registry);
    }
    let registry = choose(records.clone(), running.system.as_deref())?;
    records.retain(|record| record.registry == registry);
    Ok(records.swap_remove(0))
}

fn choose(mut records: Vec<RunRecord>, name: Option<&str>) -> Result<SocketAddr> {
    let all: Vec<String> = records.iter().map(describe).collect();
    if let Some(name) = name {
        records.retain(|record| record.system == name);
    }
    match (&records[..], name) {
        ([only], _) => Ok(only.registry),
        ([], _) if all.is_empty() => {
            bail!("no system is running; start one with `armor run FILE`, or give --registry")
        }
        ([], name) => {
            bail!(
                "no system called {} is running; there are:\n{}",
                name.unwrap_or(""),
                all.join("\n")
            )
        }
        (several, Some(name)) => {
            let several: Vec<_> = several.iter().map(describe).collect();
            bail!(
                "several systems called {name} are running; give --registry of one:\n{}",
                several.join("\n")
            )
        }
        (_, None) => {
            bail!(
                "several systems are running; give --system or --registry of one:\n{}",
                all.join("\n")
            )
        }
    }
}

fn describe(record: &RunRecord) -> String {
    let RunRecord { system, registry, pid, file, .. } = record;
    format!("  --system {system}  --registry {registry}  (process {pid}, {})", file.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(system: &str, port: u16) -> RunRecord {
        RunRecord {
            system: system.into(),
            pid: 7,
            registry: ([127, 0, 0, 1], port).into(),
            started_s: 0.0,
            file: "rover.xml".into(),
            out: "out".into(),
        }
    }

    fn check(systems: &[(&str, u16)], name: Option<&str>, expected: Result<u16, &str>) {
        let records = systems.iter().map(|(system, port)| record(system, *port)).collect();
        match (choose(records, name), expected) {
            (Ok(address), Ok(port)) => assert_eq!(address.port(), port),
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{error}"),
            (got, expected) => panic!("{got:?} instead of {expected:?}"),
        }
    }

    #[test]
    fn the_only_one_or_the_named_one() {
        check(&[], None, Err("armor run"));
        check(&[("rover", 1)], None, Ok(1));
        check(&[("rover", 1)], Some("rover"), Ok(1));
        check(&[("rover", 1)], Some("arm"), Err("--system rover"));
        check(&[("rover", 1), ("arm", 2)], None, Err("--registry 127.0.0.1:2"));
        check(&[("rover", 1), ("arm", 2)], Some("arm"), Ok(2));
        check(&[("rover", 1), ("rover", 2)], Some("rover"), Err("several systems called rover"));
    }
}
