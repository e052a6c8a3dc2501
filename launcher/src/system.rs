//! Finds the running system that a command inspects.

use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use anyhow::{Result, bail};

use crate::arguments::{RunningSystem, default_registry};
use armor_inspect::systems::{self, RunRecord};
use armor_robotfile::advise_similar;

/// Longest wait for a listener on this host.
const REGISTRY_WITHIN: Duration = Duration::from_millis(200);

/// Returns the address of the selected system's registry: the given one, that of the system with
/// the given name, or that of the only one.
///
/// # Errors
/// If there is none, or several.
pub fn find_registry(running: &RunningSystem) -> Result<SocketAddr> {
    let registry = select_registry(running)?;
    systems::adopt_place(registry);
    Ok(registry)
}

fn select_registry(running: &RunningSystem) -> Result<SocketAddr> {
    if let Some(registry) = running.registry {
        return Ok(registry);
    }
    if armor_socket::has_proxy() {
        bail!(
            "ARMOR_VIA is set, for a system on another host: give the --registry of that system, or \
             set ARMOR_REGISTRY; `armor connect` sets both"
        );
    }
    let records = systems::list_running(&systems::record_directory()?)?;
    choose_system(records, running.system.as_deref(), hint_at_registry)
}

/// Returns the record of the selected system, if this user runs it on this host.
///
/// # Errors
/// If there is none, or several.
pub fn find_record(running: &RunningSystem) -> Result<RunRecord> {
    if armor_socket::has_proxy() {
        bail!(
            "ARMOR_VIA is set, for a system on another host; its launcher can only be reached on \
             that host"
        );
    }
    let mut records = systems::list_running(&systems::record_directory()?)?;
    if let Some(registry) = running.registry {
        records.retain(|record| record.registry == registry);
    }
    let registry = choose_system(records.clone(), running.system.as_deref(), hint_at_registry)?;
    records.retain(|record| record.registry == registry);
    Ok(records.swap_remove(0))
}

fn choose_system(
    mut records: Vec<RunRecord>,
    name: Option<&str>,
    hint: impl Fn() -> String,
) -> Result<SocketAddr> {
    let all = list_systems(&records);
    let advice = name.map(|name| advise_system(name, &records)).unwrap_or_default();
    if let Some(name) = name {
        records.retain(|record| record.system == name);
    }
    match (&records[..], name) {
        ([only], _) => Ok(only.registry),
        ([], _) if all.is_empty() => {
            bail!(
                "no system is running; start one with `armor run FILE`, or give --registry{}",
                hint()
            )
        }
        ([], name) => {
            bail!("no system called {} is running{advice}; there are:\n{}", name.unwrap_or(""), all)
        }
        (several, name) => {
            let called = name.map(|name| format!(" called {name}")).unwrap_or_default();
            let several = list_systems(several);
            bail!("several systems{called} are running; give one of these:\n{several}")
        }
    }
}

/// Lists the systems, one per line, each with what selects it alone: its name, or its registry if
/// another one has the same name.
fn list_systems(records: &[RunRecord]) -> String {
    let lines = records.iter().map(|record| {
        let RunRecord { system, registry, pid, file, .. } = record;
        let namesakes = records.iter().filter(|other| other.system == *system).count();
        let option = match namesakes {
            1 => format!("--system {system}  (registry {registry}"),
            _ => format!("--registry {registry}  (system {system}"),
        };
        format!("  {option}, process {pid}, {})", file.display())
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns which running system was probably meant: one that runs the file or mission of that name,
/// or one with a similar name.
fn advise_system(name: &str, records: &[RunRecord]) -> String {
    let mut also_called = records.iter().filter(|record| record.is_also_called(name));
    match also_called.next() {
        Some(RunRecord { system, file, .. }) => {
            let file = file.display();
            format!("; {file} runs as the system {system}: give --system {system}")
        }
        None => advise_similar(name, records.iter().map(|record| record.system.as_str())),
    }
}

/// Names the registry at the default address, if one answers there that no `armor run` of this user
/// has started: components may have been started by hand.
fn hint_at_registry() -> String {
    let default = default_registry();
    let answers = TcpStream::connect_timeout(&default, REGISTRY_WITHIN).is_ok();
    if answers { format!(", such as {default}, where something listens") } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find_record(system: &str, port: u16) -> RunRecord {
        RunRecord {
            system: system.into(),
            pid: 7,
            registry: ([127, 0, 0, 1], port).into(),
            started_s: 0.0,
            file: "robots/explorer.xml".into(),
            file_names: vec!["patrol".into()],
            out: "out".into(),
            place: None,
        }
    }

    fn check(systems: &[(&str, u16)], name: Option<&str>, expected: Result<u16, &str>) {
        let records = systems.iter().map(|(system, port)| find_record(system, *port)).collect();
        match (choose_system(records, name, || ", such as 7".into()), expected) {
            (Ok(address), Ok(port)) => assert_eq!(address.port(), port),
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{error}"),
            (got, expected) => panic!("{got:?} instead of {expected:?}"),
        }
    }

    #[test]
    fn the_only_one_or_the_named_one() {
        check(&[], None, Err("give --registry, such as 7"));
        check(&[("rover", 1)], None, Ok(1));
        check(&[("rover", 1)], Some("rover"), Ok(1));
        check(&[("rover", 1)], Some("arm"), Err("--system rover"));
        let both = "several systems are running; give one of these:\n  --system rover  (registry \
                    127.0.0.1:1, process 7, robots/explorer.xml)\n  --system arm  (";
        check(&[("rover", 1), ("arm", 2)], None, Err(both));
        check(&[("rover", 1), ("arm", 2)], Some("arm"), Ok(2));
        for other in ["explorer", "explorer.xml", "robots/explorer.xml", "patrol"] {
            let meant = "explorer.xml runs as the system rover: give --system rover; there are:\n";
            check(&[("rover", 1)], Some(other), Err(meant));
        }
        check(&[("rover", 1)], Some("rovr"), Err("did you mean rover?"));
        // A name that two have selects none of them.
        let same = "give one of these:\n  --registry 127.0.0.1:1  (system rover, process 7, \
                    robots/explorer.xml)\n  --registry 127.0.0.1:2  (";
        check(&[("rover", 1), ("rover", 2)], Some("rover"), Err(same));
        check(&[("rover", 1), ("rover", 2), ("arm", 3)], None, Err(same));
        check(&[("rover", 1), ("rover", 2), ("arm", 3)], None, Err("\n  --system arm  ("));
        check(&[("rover", 1), ("rover", 2), ("arm", 3)], Some("arm"), Ok(3));
    }
}
