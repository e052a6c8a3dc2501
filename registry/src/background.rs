//! A registry on a thread of its own, for programs and tests that have no tokio runtime.

use std::net::SocketAddr;
use std::sync::mpsc;
use std::thread::{self, JoinHandle};

use tokio::sync::oneshot;

use crate::serve::{RegistryOptions, RegistryStartError, serve};

/// A running registry. Dropping it stops it and closes all its connections.
pub struct BackgroundRegistry {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl BackgroundRegistry {
    /// Starts a registry and waits until peers can connect to it.
    ///
    /// # Errors
    /// [`RegistryStartError`] if it cannot start.
    pub fn start(options: RegistryOptions) -> Result<Self, RegistryStartError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (stop, stopped) = oneshot::channel();
        let (sender, receiver) = mpsc::channel();
        let thread = thread::Builder::new().name("registry".into()).spawn(move || {
            let ready = sender.clone();
            let serving = serve(options, move |address| {
                // The other end waits for exactly one message.
                let _ = ready.send(Ok(address));
            });
            runtime.block_on(async {
                tokio::select! {
                    Err(error) = serving => {
                        let _ = sender.send(Err(error));
                    }
                    _ = stopped => {}
                }
            });
        })?;
        let address =
            receiver.recv().map_err(|_| std::io::Error::other("its thread has ended"))??;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Returns the address on which it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for BackgroundRegistry {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // The thread does not panic; if it did, its error could not be reported here.
            let _ = thread.join();
        }
    }
}
