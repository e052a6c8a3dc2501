//! Watches the system for the screen: its hosts, and both ends of the component's links.

use std::sync::Arc;

use armor_inspect::systems::{list_running, record_directory};
use armor_inspect::{SystemPicture, SystemWatch};

use super::panels::{HostsReading, LinksReading};

/// Watches the system that this process belongs to.
pub(super) struct SystemLookout {
    watch: SystemWatch,
    component: String,
    shown: Arc<SystemPicture>,
    hosts: HostsReading,
    links: LinksReading,
}

/// What has changed since the last look.
#[derive(Debug, Default)]
pub(super) struct SystemChange {
    pub(super) hosts: Option<HostsReading>,
    pub(super) links: Option<LinksReading>,
}

impl SystemLookout {
    /// Begins to watch the system whose registry is at `registry`, for `component`. Hosts are known
    /// only to the launcher: there are none in a system of one host, and none are shown on a host
    /// that is not the launcher's.
    pub(super) fn begin(registry: &str, component: String) -> Option<Self> {
        let watch = SystemWatch::begin(registry, "operator-view", Arc::new(|| {})).ok()?;
        let running = record_directory().and_then(|directory| list_running(&directory));
        let records = running.unwrap_or_default();
        if let Ok(address) = registry.parse()
            && let Some(record) = records.iter().find(|record| record.registry == address)
        {
            watch.follow_hosts(record).ok()?;
        }
        Some(Self {
            watch,
            component,
            shown: Arc::default(),
            hosts: HostsReading::default(),
            links: LinksReading::default(),
        })
    }

    /// Returns what has changed.
    pub(super) fn take_change(&mut self) -> SystemChange {
        let picture = self.watch.picture();
        if Arc::ptr_eq(&picture, &self.shown) {
            return SystemChange::default();
        }
        self.shown = picture;
        let hosts = HostsReading::of(&self.shown);
        let links = LinksReading::of(&self.shown, &self.component);
        SystemChange {
            hosts: replace_if_changed(&mut self.hosts, hosts),
            links: replace_if_changed(&mut self.links, links),
        }
    }
}

/// Returns the new value if it differs from the last one: a frame is painted for each change.
fn replace_if_changed<T: Clone + PartialEq>(last: &mut T, new: T) -> Option<T> {
    if *last == new {
        return None;
    }
    *last = new.clone();
    Some(new)
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use armor_registry::{BackgroundRegistry, RegistryOptions};
    use armor_sdk::prelude::*;

    use super::*;

    /// Only a hang takes this long.
    const DEADLINE: Duration = Duration::from_secs(60);

    struct Base(Armor);

    impl Component for Base {
        const KIND: &'static str = "base";
        const SUMMARY: &'static str = "Publishes a flag at each tick.";

        fn new(armor: Armor) -> Result<Self, Fault> {
            armor.provide::<Flag>("flag")?;
            Ok(Self(armor))
        }

        fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
            self.0.send_data("flag", &Flag::default())?;
            Ok(Outcome::CarryOn)
        }
    }

    struct View;

    impl Component for View {
        const KIND: &'static str = "view";
        const SUMMARY: &'static str = "Takes flags.";

        fn new(armor: Armor) -> Result<Self, Fault> {
            armor.subscribe::<Flag>("flag")?;
            Ok(Self)
        }

        fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
            Ok(Outcome::CarryOn)
        }
    }

    #[test]
    fn a_link_is_found_with_what_its_publisher_reports_of_it() {
        let listen = "127.0.0.1:0".parse().unwrap();
        let registry =
            BackgroundRegistry::start(RegistryOptions { listen, ..RegistryOptions::default() })
                .unwrap();
        let address = registry.address().to_string();
        let arguments = |name: &str, rest: &[&str]| {
            let common = ["--alone", "--registry", &address, "--name", name];
            common.iter().chain(rest).map(Into::into).collect::<Vec<_>>()
        };
        let base = arguments("base", &["--rate", "100Hz"]);
        let view = arguments("view", &["--rate", "10Hz", "--link=flag=base.flag,keep=pull"]);
        // They end with the test's process.
        std::thread::spawn(move || armor_sdk::run_with::<Base>(base));
        std::thread::spawn(move || armor_sdk::run_with::<View>(view));
        let mut lookout = SystemLookout::begin(&address, "view".into()).unwrap();
        let begin = Instant::now();
        let report = loop {
            let links = lookout.take_change().links;
            let report = links.and_then(|links| links.reports().first().cloned());
            // The two ends report separately, and the link begins with its socket.
            let report = report.filter(|report| report.skipped > 0);
            if let Some(report) = report.filter(|report| report.transport == "shm") {
                break report;
            }
            assert!(begin.elapsed() < DEADLINE, "never: a report of a link that pulls");
            std::thread::sleep(Duration::from_millis(10));
        };
        assert_eq!((report.input.as_str(), report.lost), ("flag", 0));
    }
}
