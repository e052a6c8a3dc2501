//! The hosts of a running system: what runs on each, and whether it is connected to the launcher's.

use std::collections::BTreeMap;

use crate::observation::SystemPicture;
use crate::run_control::{HostLink, HostReport};
use crate::words::{format_duration, format_short_time};

/// A host of a running system.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservedHost<'a> {
    /// Its name.
    pub name: &'a str,
    /// What the launcher reports of it; none for the launcher's own host, and if the launcher cannot be
    /// asked.
    pub report: Option<&'a HostReport>,
    /// The processes that were seen there.
    pub processes: Vec<&'a str>,
}

impl SystemPicture {
    /// Returns its hosts by name; none if it has only one.
    pub fn list_hosts(&self) -> Vec<ObservedHost<'_>> {
        let mut hosts = BTreeMap::new();
        for report in &self.hosts {
            let host = ObservedHost { name: &report.host, report: Some(report), processes: vec![] };
            hosts.insert(report.host.as_str(), host);
        }
        for (name, process) in &self.processes {
            if self.is_second_name(name) {
                continue;
            }
            let host = process.entry.host.as_str();
            let new = ObservedHost { name: host, report: None, processes: Vec::new() };
            hosts.entry(host).or_insert(new).processes.push(name);
        }
        let is_one = self.hosts.is_empty() && hosts.len() < 2;
        if is_one { Vec::new() } else { hosts.into_values().collect() }
    }

    /// Returns the report of a host that is cut off.
    pub fn find_cut(&self, host: &str) -> Option<&HostReport> {
        if self.has_ended() {
            return None;
        }
        self.hosts.iter().find(|report| report.host == host && report.link == HostLink::CutOff)
    }
}

impl HostReport {
    /// Describes its connection, such as `cut off for 12.0 s (it has fallen silent)`.
    pub fn describe_link(&self) -> String {
        let word = self.link.word();
        let because =
            if self.reason.is_empty() { String::new() } else { format!(" ({})", self.reason) };
        match self.link {
            HostLink::CutOff => format!("{word} for {}{because}", format_duration(self.for_s)),
            HostLink::Connected | HostLink::Awaited => format!("{word}{because}"),
        }
    }

    /// Describes it in a line: its name, its connection, and its clock if that was measured.
    pub fn describe(&self) -> String {
        let clock = self.describe_clock().map(|clock| format!("; {clock}")).unwrap_or_default();
        format!("{}: {}{clock}", self.host, self.describe_link())
    }

    /// Describes why no process on it can be reached, if it is cut off.
    pub fn describe_cut(&self) -> Option<String> {
        let is_cut = self.link == HostLink::CutOff;
        is_cut.then(|| format!("{} is {}", self.host, self.describe_link()))
    }

    /// Describes its clock, if it was measured.
    pub fn describe_clock(&self) -> Option<String> {
        let (offset_s, error_s) = self.clock_offset_s.zip(self.clock_error_s)?;
        let side = if offset_s < 0.0 { "behind" } else { "ahead of" };
        let (offset, error) = (format_short_time(offset_s.abs()), format_short_time(error_s));
        Some(format!("its clock is {offset} {side} that of the launcher's host, ± {error}"))
    }
}

impl HostLink {
    /// Its word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Awaited => "not connected yet",
            Self::Connected => "connected",
            Self::CutOff => "cut off",
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_sdk::directory::DirectoryChange;
    use armor_wire::registry::ComponentEntry;

    use super::*;
    use crate::observation::SystemEvent;

    fn report(link: HostLink, reason: &str, clock: Option<(f64, f64)>) -> HostReport {
        HostReport {
            host: "arm".into(),
            link,
            reason: reason.into(),
            for_s: 75.0,
            clock_offset_s: clock.map(|clock| clock.0),
            clock_error_s: clock.map(|clock| clock.1),
        }
    }

    fn appear(picture: &mut SystemPicture, name: &str, host: &str) {
        let entry = ComponentEntry {
            name: name.into(),
            kind: "bench".into(),
            instance: 1,
            pid: 7,
            host: host.into(),
            endpoint: "127.0.0.1:1".into(),
        };
        let event = SystemEvent::Registry(DirectoryChange::Appeared(entry));
        picture.handle_event(event, Duration::ZERO);
    }

    #[test]
    fn a_host_is_described_with_its_connection_and_its_clock() {
        let connected = report(HostLink::Connected, "", Some((-0.25, 0.001)));
        assert_eq!(connected.describe_link(), "connected");
        let clock = connected.describe_clock().expect("it was measured");
        assert_eq!(clock, "its clock is 250.0 ms behind that of the launcher's host, ± 1.0 ms");
        let cut = report(HostLink::CutOff, "it has fallen silent", None);
        assert_eq!(cut.describe_link(), "cut off for 1 min 15 s (it has fallen silent)");
        assert_eq!(cut.describe_clock(), None);
        let why = cut.describe_cut();
        assert_eq!(why.as_deref(), Some("arm is cut off for 1 min 15 s (it has fallen silent)"));
        assert_eq!(connected.describe_cut(), None);
        let line = connected.describe();
        assert!(line.starts_with("arm: connected; its clock is 250.0 ms behind"), "{line}");
        let awaited = report(HostLink::Awaited, "no route", None);
        assert_eq!(awaited.describe_link(), "not connected yet (no route)");
    }

    #[test]
    fn hosts_are_those_of_processes_and_those_that_the_launcher_reports() {
        let mut picture = SystemPicture::default();
        appear(&mut picture, "near", "robot");
        assert!(picture.list_hosts().is_empty(), "one host is none worth a list");
        let cut = report(HostLink::CutOff, "", None);
        let (is_new, _) =
            picture.handle_event(SystemEvent::Hosts(vec![cut.clone()]), Duration::ZERO);
        assert!(is_new);
        let again = picture.handle_event(SystemEvent::Hosts(vec![cut.clone()]), Duration::ZERO);
        assert!(!again.0);
        appear(&mut picture, "far", "arm");
        let hosts = picture.list_hosts();
        let names: Vec<_> = hosts.iter().map(|host| (host.name, &host.processes[..])).collect();
        assert_eq!(names, [("arm", &["far"][..]), ("robot", &["near"])]);
        assert_eq!((hosts[0].report, hosts[1].report), (Some(&cut), None));
        assert_eq!(picture.find_cut("arm"), Some(&cut));
        assert_eq!(picture.find_cut("robot"), None);
    }
}
