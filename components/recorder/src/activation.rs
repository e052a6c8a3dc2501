//! The recording of one activation, on a thread of its own: a disk that is slow delays no call.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;

use armor_inspect::ObservedSystem;
use armor_inspect::systems::{self, RunRecord};
use armor_recording::capture::{
    Recorder, RecorderError, RecorderOptions, RecordingEnd, RecordingReport,
};
use parking_lot::Mutex;

/// The name of the recorder as an observer of the system.
const OBSERVER: &str = "recorder";

/// A recording that runs, until it is finished or dropped.
pub(crate) struct ActivationRecording {
    shared: Arc<SharedRecording>,
    thread: Option<JoinHandle<()>>,
}

struct SharedRecording {
    is_over: AtomicBool,
    least_free: AtomicU64,
    lost: AtomicU64,
    result: Mutex<Option<Result<RecordingEnd, String>>>,
}

impl ActivationRecording {
    /// Begins to record the system of the registry.
    ///
    /// # Errors
    /// If there is no thread.
    pub(crate) fn begin(registry: &str, options: RecorderOptions) -> std::io::Result<Self> {
        let shared = Arc::new(SharedRecording {
            is_over: AtomicBool::new(false),
            least_free: AtomicU64::new(options.least_free),
            lost: AtomicU64::new(0),
            result: Mutex::new(None),
        });
        let (registry, of_thread) = (registry.to_owned(), Arc::clone(&shared));
        let run = move || {
            let result = of_thread.record(&registry, options);
            *of_thread.result.lock() = Some(result.map_err(|error| error.to_string()));
        };
        let thread = std::thread::Builder::new().name("recording".into()).spawn(run)?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Sets how many bytes must be left on the disk.
    pub(crate) fn set_least_free(&self, bytes: u64) {
        self.shared.least_free.store(bytes, Ordering::Relaxed);
    }

    /// Messages that were lost so far.
    pub(crate) fn count_lost(&self) -> u64 {
        self.shared.lost.load(Ordering::Relaxed)
    }

    /// Takes the result, if the recording has ended.
    pub(crate) fn take_result(&self) -> Option<Result<RecordingEnd, String>> {
        self.shared.result.lock().take()
    }

    /// Completes the file, and waits for it.
    pub(crate) fn finish(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of it is reported by the SDK.
            let _ = thread.join();
        }
    }
}

impl Drop for ActivationRecording {
    fn drop(&mut self) {
        self.finish();
    }
}

impl SharedRecording {
    fn record(
        &self,
        registry: &str,
        options: RecorderOptions,
    ) -> Result<RecordingEnd, RecorderError> {
        let observed = ObservedSystem::at(registry, OBSERVER);
        let mut recorder = Recorder::begin(&observed, find_record(registry), options)?;
        tracing::info!("recording into {}", recorder.path().display());
        let end = recorder.record_until(|lost, least_free| {
            self.lost.store(lost, Ordering::Relaxed);
            *least_free = self.least_free.load(Ordering::Relaxed);
            !self.is_over.load(Ordering::Relaxed)
        })?;
        let RecordingReport { files, messages, lost, .. } = recorder.finish()?;
        self.lost.store(lost, Ordering::Relaxed);
        let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
        tracing::info!("{}: {messages} messages, {lost} lost", names.join(", "));
        Ok(end)
    }
}

/// The record of the run on this host, if it is on this host.
fn find_record(registry: &str) -> Option<RunRecord> {
    let records = systems::list_running(&systems::record_directory().ok()?).ok()?;
    records.into_iter().find(|record| record.registry.to_string() == registry)
}
