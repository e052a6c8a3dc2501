//! The thread that serves everything that is not on the way of a message: new connections, control,
//! beats, and links whose subscriber is slow.

mod control;
mod handshake;

use std::io;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{ComponentListeners, Stream};
use armor_wire::frame::{self, FrameKind};
use armor_wire::liveness::BEAT;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::participant::Participant;
use control::ControlServer;
use handshake::Handshakes;

/// While user code gathers frames in one long call, they are flushed this often.
const GATHER_PERIOD: Duration = Duration::from_millis(1);

/// Starts the thread.
pub(crate) fn start(
    participant: &Arc<Participant>,
    listeners: ComponentListeners,
) -> io::Result<()> {
    let participant = Arc::clone(participant);
    let service = Service {
        handshakes: Handshakes::new(Arc::clone(&participant)),
        control: ControlServer::new(Arc::clone(&participant)),
        listeners,
        participant,
        last_beat: Instant::now(),
        accept_after: None,
    };
    std::thread::Builder::new()
        .name("service".into())
        .stack_size(256 << 10)
        .spawn(move || service.run())?;
    Ok(())
}

struct Service {
    participant: Arc<Participant>,
    listeners: ComponentListeners,
    handshakes: Handshakes,
    control: ControlServer,
    last_beat: Instant,
    /// Set after accepting has failed, as it does without free file descriptors.
    accept_after: Option<Instant>,
}

impl Service {
    fn run(mut self) {
        while !self.participant.lifecycle.has_left() {
            let links = self.wait();
            self.participant.wakers.clear_service();
            self.accept();
            for admitted in self.handshakes.serve() {
                // What an earlier executive has still said counts before a new one takes over.
                self.control.serve();
                self.control.add(admitted);
            }
            if links || self.last_beat.elapsed() >= BEAT || self.participant.ports.is_gathering() {
                self.serve_links();
            }
            self.control.serve();
        }
    }

    /// Waits until there is something to do; whether it concerns an output's link.
    fn wait(&self) -> bool {
        let mut links = Vec::new();
        for output in self.participant.ports.outputs() {
            output.streams(&mut links);
        }
        let mut fds: Vec<PollFd<'_>> = links.iter().map(|(s, waits)| watched(s, *waits)).collect();
        let count = fds.len();
        fds.push(PollFd::from_borrowed_fd(
            self.participant.wakers.service_fd().as_fd(),
            PollFlags::IN,
        ));
        if self.accept_after.is_none_or(|after| Instant::now() >= after) {
            fds.extend(self.listeners.sockets().map(|socket| PollFd::new(socket, PollFlags::IN)));
        }
        self.handshakes.watch(&mut fds);
        self.control.watch(&mut fds);
        let mut timeout = BEAT.saturating_sub(self.last_beat.elapsed());
        if self.participant.ports.is_gathering() {
            timeout = timeout.min(GATHER_PERIOD);
        }
        let timeout = Timespec {
            tv_sec: timeout.as_secs() as i64,
            tv_nsec: i64::from(timeout.subsec_nanos().max(1)),
        };
        let _ = poll(&mut fds, Some(&timeout));
        fds[..count].iter().any(|fd| !fd.revents().is_empty())
    }

    fn accept(&mut self) {
        self.accept_after = None;
        loop {
            match self.listeners.accept() {
                Ok(Some(stream)) => self.handshakes.add(stream),
                Ok(None) => return,
                Err(error) => {
                    // No descriptors left: existing connections go on; try again in a while.
                    tracing::error!("cannot accept a connection: {error}");
                    self.accept_after = Some(Instant::now() + Duration::from_secs(1));
                    return;
                }
            }
        }
    }

    fn serve_links(&mut self) {
        if self.participant.calls.running_call().is_none() {
            // A thread of the user's own may have added to what a call gathered, after its flush.
            self.participant.ports.flush_gathered();
        }
        let now = self.participant.clock.monotonic();
        let beat = frame::signal(FrameKind::Beat);
        for output in self.participant.ports.outputs() {
            output.serve(now, &beat);
        }
        if self.last_beat.elapsed() >= BEAT {
            self.last_beat = Instant::now();
            for input in self.participant.ports.inputs() {
                input.beat();
            }
        }
    }
}

/// How a stream with or without waiting bytes is watched.
fn watched(stream: &Stream, waits: bool) -> PollFd<'_> {
    let flags = if waits { PollFlags::IN | PollFlags::OUT } else { PollFlags::IN };
    PollFd::from_borrowed_fd(stream.as_fd(), flags)
}
