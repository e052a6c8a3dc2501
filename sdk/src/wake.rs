//! Wakes the two threads of a process that sleep until there is work: the main loop and the service
//! thread.

use std::io;
use std::os::fd::OwnedFd;
use std::thread::Thread;

use parking_lot::Mutex;
use rustix::event::{EventfdFlags, eventfd};

/// The means to wake both threads.
pub(crate) struct Wakers {
    /// The thread of the main loop, once it runs.
    main: Mutex<Option<Thread>>,
    /// Readable when the service thread has something to do.
    service: OwnedFd,
}

impl Wakers {
    pub fn new() -> io::Result<Self> {
        let service = eventfd(0, EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC)?;
        Ok(Self { main: Mutex::default(), service })
    }

    /// The calling thread runs the main loop.
    pub fn set_main(&self, thread: Thread) {
        *self.main.lock() = Some(thread);
    }

    pub fn wake_main(&self) {
        if let Some(main) = &*self.main.lock() {
            main.unpark();
        }
    }

    pub fn wake_service(&self) {
        let _ = rustix::io::write(&self.service, &1u64.to_ne_bytes());
    }

    /// What the service thread polls.
    pub fn service_fd(&self) -> &OwnedFd {
        &self.service
    }

    /// Called by the service thread after it has woken, before it looks for work: a wake that comes
    /// later makes the descriptor readable again.
    pub fn clear_service(&self) {
        let _ = rustix::io::read(&self.service, &mut [0u8; 8]);
    }
}
