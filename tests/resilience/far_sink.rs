//! A sink behind a bad network.

use std::fs::File;
use std::process::{Child, Command, Stdio};

use super::system::{Draft, System, probe};
use super::trace::Got;
use crate::fixture::fault_proxy::FaultProxy;
use crate::fixture::{Folder, wait_for};

/// A source, and a sink that reaches everything through a proxy.
pub struct FarSink {
    pub proxy: FaultProxy,
    sink: Child,
    pub system: System,
}

impl Drop for FarSink {
    fn drop(&mut self) {
        let _ = self.sink.kill();
        let _ = self.sink.wait();
    }
}

impl FarSink {
    /// Starts both, with these links from `source.numbers` to inputs of the sink, of which `a` gets data.
    pub fn start(name: &str, links: &str, seed: u64) -> Self {
        Self::start_at("100Hz", name, links, seed)
    }

    /// The same with another rate of the source.
    pub fn start_at(rate: &str, name: &str, links: &str, seed: u64) -> Self {
        let source = format!("rate='{rate}'");
        let draft = Draft::default().probe("source", &source, "").probe("sink", "", "");
        let system = draft.component(links).run_with(Folder::new(name), &["--without", "sink"]);
        let proxy = FaultProxy::start(seed);
        let sink = start_sink(&system, &proxy);
        let far = Self { proxy, sink, system };
        far.wait_for_data();
        far
    }

    /// Replaces the process of the sink.
    pub fn replace_sink(&mut self) {
        let _ = (self.sink.kill(), self.sink.wait());
        self.sink = start_sink(&self.system, &self.proxy);
    }

    pub fn log(&self) -> String {
        std::fs::read_to_string(self.system.folder.path().join("sink.log")).unwrap_or_default()
    }

    /// What the sink has received at an input.
    pub fn got(&self, input: &str) -> Vec<Got> {
        self.system.trace("sink").got(input)
    }

    /// Waits for data that are newer than those now.
    pub fn wait_for_data(&self) {
        let before = self.got("a").len();
        wait_for(&format!("more data\n{}\n{}", self.log(), self.system.run.log()), || {
            (self.got("a").len() > before).then_some(())
        });
    }

    /// Whether the source and the registry still count on the sink.
    pub fn is_known(&self) -> bool {
        let source = self.system.status("source");
        source.outputs.iter().any(|output| !output.links.is_empty())
            || self.system.entries().iter().any(|entry| entry.name == "sink")
    }

    pub fn count_closed_links(&self) -> usize {
        self.log().matches("link from source.numbers closed").count()
    }

    /// Checks that the sink has missed only what was counted, in the right order.
    pub fn check_losses_counted(&self) {
        check_losses_counted(&self.got("a"));
    }
}

/// Checks the messages of one input in the same way.
pub fn check_losses_counted(got: &[Got]) {
    for pair in got.windows(2) {
        let [before, after] = pair else { continue };
        assert_eq!(before.from, after.from, "the source never ended");
        assert_eq!(before.count + 1 + after.lost, after.count, "{before:?} {after:?}");
    }
}

fn start_sink(system: &System, proxy: &FaultProxy) -> Child {
    let log = File::create(system.folder.path().join("sink.log")).expect("writable");
    let mut sink = Command::new(probe());
    sink.args(["--name", "sink", "--registry", &system.registry.to_string()]);
    sink.env("ARMOR_VIA", proxy.address.to_string()).current_dir(system.folder.path());
    sink.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log).spawn().expect("the probe starts")
}
