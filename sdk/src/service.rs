//! The thread for everything that is not on a message's path: new connections, control, beats, and
//! links with a slow subscriber.

mod control;
mod datagrams;
mod handshake;
mod keep_rights;

use std::io;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{ComponentListeners, Stream};
use armor_wire::frame::{self, FrameKind};
use armor_wire::liveness::{BEAT, LOOK};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use crate::background_thread::spawn_background;
use crate::participant::Participant;
use control::ControlServer;
use datagrams::DatagramService;
use handshake::Handshakes;

/// While user code gathers frames in one long call, they are flushed this often.
const GATHER_PERIOD: Duration = Duration::from_millis(1);

/// After accepting has failed, as without free file descriptors, it is not tried for this long.
const ACCEPT_PAUSE: Duration = Duration::from_secs(1);

/// While connections cannot be waited for, they are served this often. An order may be late by as
/// much; without a pause the thread would take a whole core.
const POLL_PAUSE: Duration = Duration::from_millis(10);

/// Starts the thread.
pub(crate) fn start_thread(
    participant: &Arc<Participant>,
    listeners: ComponentListeners,
) -> io::Result<()> {
    let participant = Arc::clone(participant);
    let service = ServiceThread {
        handshakes: Handshakes::new(Arc::clone(&participant)),
        control: ControlServer::new(Arc::clone(&participant)),
        datagrams: DatagramService::new(Arc::clone(&participant), listeners.port()),
        datagrams_due: None,
        listeners,
        participant,
        last_beat: Instant::now(),
        last_look: Instant::now(),
        accept_after: None,
        is_poll_failing: false,
    };
    spawn_background("service", move || service.serve_until_left())
}

struct ServiceThread {
    participant: Arc<Participant>,
    listeners: ComponentListeners,
    handshakes: Handshakes,
    control: ControlServer,
    datagrams: DatagramService,
    /// When datagrams are due that must be sent again.
    datagrams_due: Option<Instant>,
    last_beat: Instant,
    last_look: Instant,
    /// Set after accepting has failed, as it does without free file descriptors, until a connection is
    /// accepted.
    accept_after: Option<Instant>,
    /// Whether the last poll(2) failed, as it does if the limit of file descriptors was lowered below
    /// the number of connections.
    is_poll_failing: bool,
}

impl ServiceThread {
    fn serve_until_left(mut self) {
        while !self.participant.lifecycle.has_left() {
            let links = self.wait_for_work();
            self.participant.wakers.clear_service();
            self.accept_connections();
            for admitted in self.handshakes.serve_pending(&mut self.datagrams) {
                // Commands of an earlier executive count before a new one takes over.
                self.control.serve_peers();
                self.control.add_peer(admitted);
            }
            self.datagrams_due = self.datagrams.serve().map(|wait| Instant::now() + wait);
            if links || self.is_look_due() || self.participant.ports.is_gathering() {
                self.serve_links();
            }
            self.control.serve_peers();
        }
    }

    fn is_look_due(&self) -> bool {
        self.last_look.elapsed() >= LOOK || self.last_beat.elapsed() >= BEAT
    }

    /// Waits until there is something to do. Returns whether it may concern an output's link.
    fn wait_for_work(&mut self) -> bool {
        let mut links = Vec::new();
        for output in self.participant.ports.served_outputs() {
            output.list_streams(&mut links);
        }
        let mut fds: Vec<PollFd<'_>> = links.iter().map(|(s, waits)| watched(s, *waits)).collect();
        let count = fds.len();
        fds.push(PollFd::from_borrowed_fd(
            self.participant.wakers.service_fd().as_fd(),
            PollFlags::IN,
        ));
        let is_accepting = self.accept_after.is_none_or(|after| Instant::now() >= after);
        if is_accepting {
            fds.extend(self.listeners.sockets().map(|socket| PollFd::new(socket, PollFlags::IN)));
        }
        fds.extend(self.datagrams.poll_fd());
        self.handshakes.add_poll_fds(&mut fds);
        self.control.add_poll_fds(&mut fds);
        let beat = BEAT.saturating_sub(self.last_beat.elapsed());
        let mut timeout = LOOK.saturating_sub(self.last_look.elapsed()).min(beat);
        if self.participant.ports.is_gathering() {
            timeout = timeout.min(GATHER_PERIOD);
        }
        if let Some(due) = self.datagrams_due {
            timeout = timeout.min(due.saturating_duration_since(Instant::now()));
        }
        let limit = Timespec {
            tv_sec: timeout.as_secs() as i64,
            tv_nsec: i64::from(timeout.subsec_nanos().max(1)),
        };
        let polled = poll(&mut fds, Some(&limit));
        let is_link = fds[..count].iter().any(|fd| !fd.revents().is_empty());
        let descriptors = fds.len();
        drop(fds);
        match polled {
            Ok(_) | Err(Errno::INTR) => {
                // Without the listeners, fewer descriptors may be just within the limit.
                if is_accepting && std::mem::take(&mut self.is_poll_failing) {
                    tracing::info!("connections are waited for again");
                }
                is_link
            }
            Err(error) => {
                self.note_poll_failure(error, descriptors);
                std::thread::sleep(timeout.min(POLL_PAUSE));
                true
            }
        }
    }

    fn note_poll_failure(&mut self, error: Errno, descriptors: usize) {
        if !std::mem::replace(&mut self.is_poll_failing, true) {
            tracing::error!(
                "cannot wait for {descriptors} file descriptors: {error}; until that works, \
                 connections are served every {} ms. If the limit of this process is lower, raise \
                 it: prlimit --nofile",
                POLL_PAUSE.as_millis()
            );
        }
    }

    fn accept_connections(&mut self) {
        // Other connections also wake this thread.
        if self.accept_after.is_some_and(|after| Instant::now() < after) {
            return;
        }
        loop {
            match self.listeners.accept() {
                Ok(Some(stream)) => {
                    if self.accept_after.take().is_some() {
                        tracing::info!("connections are accepted again");
                    }
                    self.handshakes.add_connection(stream);
                }
                Ok(None) => return,
                Err(error) => {
                    // No descriptors left: existing connections continue; try again later.
                    if self.accept_after.replace(Instant::now() + ACCEPT_PAUSE).is_none() {
                        tracing::error!("cannot accept a connection: {error}");
                    }
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
        for output in self.participant.ports.served_outputs() {
            output.serve_links(now, &beat);
        }
        if self.last_look.elapsed() >= LOOK {
            self.last_look = Instant::now();
            for output in self.participant.ports.served_outputs() {
                output.release_idle_memory();
            }
            self.participant.ports.report_calls(self.participant.clock.timestamp());
            for input in self.participant.ports.inputs() {
                input.check_silence();
            }
        }
        if self.last_beat.elapsed() >= BEAT {
            self.last_beat = Instant::now();
            for input in self.participant.ports.inputs() {
                input.send_beat();
            }
        }
    }
}

/// What to poll for on a stream with or without unsent bytes.
fn watched(stream: &Stream, waits: bool) -> PollFd<'_> {
    let flags = if waits { PollFlags::IN | PollFlags::OUT } else { PollFlags::IN };
    PollFd::from_borrowed_fd(stream.as_fd(), flags)
}
