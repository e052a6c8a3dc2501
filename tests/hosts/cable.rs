//! A network between two hosts that can be cut: a TCP forwarder that keeps its connections while it
//! carries nothing, as a cable that is pulled.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

/// Period with which a cable that is cut looks whether it is whole again.
const LOOK: Duration = Duration::from_millis(20);

/// The cable. It leads to one port of this host.
pub struct Cable {
    pub port: u16,
    state: Arc<CableState>,
}

#[derive(Default)]
struct CableState {
    is_cut: AtomicBool,
    is_gone: AtomicBool,
}

impl Cable {
    /// A whole one.
    pub fn to(target: u16) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        let port = listener.local_addr().expect("it is bound").port();
        let state = Arc::<CableState>::default();
        let own = Arc::clone(&state);
        thread::spawn(move || {
            for near in listener.incoming().map_while(Result::ok) {
                if own.is_gone.load(Ordering::SeqCst) {
                    return;
                }
                let own = Arc::clone(&own);
                thread::spawn(move || {
                    if own.wait()
                        && let Ok(far) = TcpStream::connect((Ipv4Addr::LOCALHOST, target))
                    {
                        let backward =
                            (far.try_clone().expect("a socket"), near.try_clone().expect("one"));
                        let state = Arc::clone(&own);
                        thread::spawn(move || own.carry(near, far));
                        state.carry(backward.0, backward.1);
                    }
                });
            }
        });
        Self { port, state }
    }

    pub fn cut(&self) {
        self.state.is_cut.store(true, Ordering::SeqCst);
    }

    pub fn heal(&self) {
        self.state.is_cut.store(false, Ordering::SeqCst);
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        self.state.is_gone.store(true, Ordering::SeqCst);
        self.heal();
        // Wakes the listener.
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port));
    }
}

impl CableState {
    /// Waits until it is whole; returns false if it is gone.
    fn wait(&self) -> bool {
        while self.is_cut.load(Ordering::SeqCst) {
            thread::sleep(LOOK);
        }
        !self.is_gone.load(Ordering::SeqCst)
    }

    fn carry(&self, mut from: TcpStream, mut to: TcpStream) {
        let mut bytes = vec![0; 16 << 10];
        while let Ok(len @ 1..) = from.read(&mut bytes) {
            if !self.wait() || to.write_all(&bytes[..len]).is_err() {
                break;
            }
        }
        // The end of a connection does not travel on a cable that is cut, either.
        self.wait();
        let _ = to.shutdown(Shutdown::Write);
        let _ = from.shutdown(Shutdown::Read);
    }
}
