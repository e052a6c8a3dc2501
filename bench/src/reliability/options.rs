//! How faults are injected.

use std::path::PathBuf;
use std::time::Duration;

/// How, by the command line.
#[derive(Clone, Debug)]
pub struct ReliabilityOptions {
    /// The program `armor`; by default the one next to this program.
    pub program: Option<PathBuf>,
    pub hosts: usize,
    pub seed: u64,
    pub kills: usize,
    /// The worlds in which the mapper is killed; none: all.
    pub worlds: Vec<String>,
    pub count: usize,
    /// The longest cut or stop.
    pub longest: Duration,
    pub soak: Duration,
    /// From one fault of the soak to the next.
    pub interval: Duration,
}

impl Default for ReliabilityOptions {
    fn default() -> Self {
        Self {
            program: None,
            hosts: 2,
            seed: 1,
            kills: 300,
            worlds: Vec::new(),
            count: 100,
            longest: Duration::from_secs(60),
            soak: Duration::from_secs(30 * 60),
            interval: Duration::from_secs(10),
        }
    }
}
