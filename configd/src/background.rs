//! configd on a thread of its own, for programs and tests that have no tokio runtime.

use std::net::SocketAddr;
use std::sync::mpsc::{self, Receiver};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use tokio::sync::oneshot;

use crate::serve::{ConfigdOptions, ConfigdStartError, serve};
use crate::versions::Notice;

/// How long stopping waits for a disk that does not answer.
const DISK_PATIENCE: Duration = Duration::from_secs(1);

/// A running configd. Dropping it stops it and closes all its connections.
pub struct BackgroundConfigd {
    address: SocketAddr,
    notices: Receiver<Notice>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl BackgroundConfigd {
    /// Starts configd and waits until components can connect to it.
    ///
    /// # Errors
    /// [`ConfigdStartError`] if it cannot start; the file's findings among it.
    pub fn start(options: ConfigdOptions) -> Result<Self, ConfigdStartError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (stop, stopped) = oneshot::channel();
        let (starting, started) = mpsc::channel();
        let (noticing, notices) = mpsc::channel();
        let thread = thread::Builder::new().name("configd".into()).spawn(move || {
            let ready = starting.clone();
            // A receiver that has been dropped needs no notices.
            let serving = serve(options, move |notice| match notice {
                Notice::Ready { address } => drop(ready.send(Ok(address))),
                other => drop(noticing.send(other)),
            });
            runtime.block_on(async {
                tokio::select! {
                    Err(error) = serving => drop(starting.send(Err(error))),
                    _ = stopped => {}
                }
            });
            runtime.shutdown_timeout(DISK_PATIENCE);
        })?;
        let address =
            started.recv().map_err(|_| std::io::Error::other("its thread has ended"))??;
        Ok(Self { address, notices, stop: Some(stop), thread: Some(thread) })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// What becomes of the file, in order.
    pub fn notices(&self) -> &Receiver<Notice> {
        &self.notices
    }
}

impl Drop for BackgroundConfigd {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // The thread does not panic; if it did, its error could not be reported here.
            let _ = thread.join();
        }
    }
}
