//! The visits of an input's thread to the datagrams of a link: it takes messages from them, reports what
//! has arrived, and waits for more there and at the stream.

use std::collections::VecDeque;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::atomic::Ordering;

use armor_socket::Stream;
use armor_wire::frame::{Frame, FrameReader};
use armor_wire::keep::Keep;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::{InputReader, ReadState};
use crate::link::catch_up::NewestFrame;
use crate::link::datagrams_in::DatagramReader;
use crate::link::payload::Payload;

/// Datagrams that are taken before the reader looks at the stream: a publisher that never pauses must
/// not keep it from noticing that it is ordered to end.
const DATAGRAM_VISIT: usize = 256;

impl InputReader {
    /// Opens the datagrams that the publisher offers, or follows where its data come.
    pub(super) fn follow_datagrams(
        &self,
        frame: &Frame<'_>,
        state: &mut ReadState<'_>,
    ) -> Result<(), String> {
        match &mut state.datagrams {
            Some(datagrams) => datagrams.follow_switch(frame),
            None => {
                let datagrams = DatagramReader::open(frame, state.stream, state.instance)?;
                state.datagrams = Some(datagrams);
                Ok(())
            }
        }
    }

    /// Hands over the messages that have come in datagrams, and reports which those are.
    pub(super) fn process_datagrams(&self, state: &mut ReadState<'_>) {
        let Some(datagrams) = &mut state.datagrams else { return };
        let mut arrived: Vec<NewestFrame> = Vec::new();
        for _ in 0..DATAGRAM_VISIT {
            while let Some((header, payload)) = datagrams.take_message() {
                let lost = self.input.follow_sequence(state.arrived, &header);
                let Some(lost) = lost else { continue };
                if self.settings.keep == Keep::Latest && arrived.pop().is_some() {
                    self.input.dropped.fetch_add(1, Ordering::Relaxed);
                }
                arrived.push(NewestFrame { header, lost, payload });
            }
            if !datagrams.receive() {
                break;
            }
            self.input.reads.increment();
        }
        // First, because the component's code may take a while.
        datagrams.send_receipt();
        let mut entered = None;
        for NewestFrame { header, lost, payload } in arrived {
            if entered.is_none() {
                entered = self.runtime.try_enter();
            }
            self.hand_over(&mut entered, header, lost, Payload::Buffer(&payload));
        }
    }

    /// Waits for bytes or datagrams, at most until a receipt is due.
    pub(super) fn receive_next_to_datagrams(
        &self,
        stream: &Stream,
        reader: &mut FrameReader,
        datagrams: &DatagramReader,
        files: &mut VecDeque<OwnedFd>,
    ) -> io::Result<usize> {
        let mut fds = [PollFd::new(stream, PollFlags::IN), PollFd::new(datagrams, PollFlags::IN)];
        let wait = datagrams.until_receipt();
        let wait = Timespec { tv_sec: 0, tv_nsec: i64::from(wait.subsec_nanos()) };
        poll(&mut fds, Some(&wait))?;
        if fds[0].revents().is_empty() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        stream.try_receive_with_files(reader.space(), files)
    }
}
