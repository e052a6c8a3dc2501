//! The visits of an input's thread to the ring of a link with shared memory: it takes messages from
//! it, and waits for the next ones there and at the socket.

use std::io;

use armor_socket::Stream;
use armor_wire::frame::FrameReader;
use armor_wire::keep::Wake;

use super::{InputReader, ReadState};
use crate::link::memory_in::{MemoryReader, TakenMessage};
use crate::link::payload::Payload;

/// Polls between two looks of a spinning reader at whether the component is still active.
const SPINS_PER_LOOK: u32 = 1 << 12;
/// Polls of the ring of a link between two of its socket.
const SPINS_PER_RECEIVE: u32 = 64;
/// Messages that are taken from a ring before the reader reads the socket: a publisher that never
/// pauses must not keep the reader from noticing that it is ordered to end.
const RING_VISIT: usize = 64;

impl InputReader {
    /// Hands over the messages in the ring of the link, if it has shared memory.
    pub(super) fn process_ring(
        &self,
        stream: &Stream,
        reader: &mut FrameReader,
        state: &mut ReadState<'_>,
    ) -> Result<(), String> {
        let mut entered = None;
        for _ in 0..RING_VISIT {
            let Some(memory) = &mut state.memory else { return Ok(()) };
            match memory.take_message()? {
                TakenMessage::Nothing => return Ok(()),
                TakenMessage::Message(header, slot) => {
                    state.taken_from_ring += 1;
                    // The publisher is alive, although its beats may wait unread at the socket.
                    self.input.reads.increment();
                    let lost = self.input.follow_sequence(state.arrived, &header);
                    let Some(lost) = lost else { continue };
                    if entered.is_none() {
                        entered = self.runtime.try_enter();
                    }
                    self.hand_over(&mut entered, header, lost, Payload::Slot(&slot));
                }
                TakenMessage::OfferAwaited => {
                    // It was sent before the message was put into the ring.
                    match stream.try_receive_with_files(reader.space(), &mut state.files) {
                        Ok(0) => return Err("the publisher closed it".into()),
                        Ok(len) => reader.filled(len),
                        Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                        Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                            return Err("a message in memory that was not offered".into());
                        }
                        Err(error) => return Err(error.to_string()),
                    }
                    self.input.reads.increment();
                    entered = None;
                    self.process_frames(reader, state)?;
                }
            }
        }
        Ok(())
    }

    /// Waits for bytes or for messages in the ring: asleep in the kernel, or polling while the
    /// component is active. Where the ring is never empty, it reads the socket once for every
    /// [`RING_VISIT`] messages.
    pub(super) fn receive_bytes(
        &self,
        stream: &Stream,
        reader: &mut FrameReader,
        state: &mut ReadState<'_>,
    ) -> io::Result<usize> {
        let ReadState { files, memory, datagrams, taken_from_ring, .. } = state;
        if let Some(datagrams) = datagrams {
            return self.receive_next_to_datagrams(stream, reader, datagrams, files);
        }
        if *taken_from_ring >= RING_VISIT {
            *taken_from_ring = 0;
            return stream.try_receive_with_files(reader.space(), files);
        }
        let lifecycle = &self.participant().lifecycle;
        while self.settings.wake == Wake::Spin && lifecycle.is_active() {
            for spin in 0..SPINS_PER_LOOK {
                if memory.as_ref().is_some_and(MemoryReader::has_messages) {
                    return Err(io::ErrorKind::WouldBlock.into());
                }
                // A link with memory gets little else.
                if memory.is_some() && spin % SPINS_PER_RECEIVE != 0 {
                    std::hint::spin_loop();
                    continue;
                }
                match stream.try_receive_with_files(reader.space(), files) {
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                        std::hint::spin_loop();
                    }
                    received => return received,
                }
            }
        }
        if let Some(memory) = memory {
            // Of several subscribers on one core, each gives way to the others once: when they have had
            // their turn there is often another message, and the publisher need not wake this one for
            // it. Where the newest message matters and not their number, it would come later.
            if self.settings.keep.is_all() {
                std::thread::yield_now();
            }
            if memory.has_messages() || !memory.announce_sleep() {
                return Err(io::ErrorKind::WouldBlock.into());
            }
        }
        stream.receive_with_files(reader.space(), files)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::os::fd::AsFd;
    use std::os::unix::net::UnixStream;
    use std::sync::Arc;
    use std::sync::atomic::Ordering;

    use armor_memory::{LinkPage, PageLayout, RingEntry, RingWriter, SlotMemory};
    use armor_wire::frame::{self, DataHeader, FrameKind};
    use armor_wire::keep::Keep;
    use armor_wire::shared_memory::{MemoryOfferBody, SlotOfferBody, write_slot_header};

    use super::*;
    use crate::link::arrivals::ArrivedSequence;
    use crate::link::catch_up::CatchUp;
    use crate::link::input_reader::tests::reader;

    const SLOT: u32 = 1;

    /// The publisher's end of a link with memory.
    struct RingPublisher {
        stream: Stream,
        page: LinkPage,
        ring: RingWriter,
        slot: SlotMemory,
        sequence: u64,
    }

    impl RingPublisher {
        /// Offers a ring and one slot on `stream`.
        fn new(stream: Stream) -> Self {
            let layout = PageLayout { cells: 8, slots: 1 };
            let (page, page_file) = LinkPage::create(layout).expect("a page");
            let slot = SlotMemory::create(4096).expect("a slot");
            let offer = MemoryOfferBody { cells: layout.cells, slots: layout.slots, held: 1 };
            let bytes = frame::to_bytes(FrameKind::MemoryOffer, &offer).expect("a frame");
            stream.try_send_with_file(&bytes, page_file.as_fd()).expect("it is sent");
            let offer = SlotOfferBody { slot: SLOT, index: 0, len: 4096 };
            let bytes = frame::to_bytes(FrameKind::SlotOffer, &offer).expect("a frame");
            stream.try_send_with_file(&bytes, slot.file()).expect("it is sent");
            Self { stream, page, ring: RingWriter::default(), slot, sequence: 0 }
        }

        fn publish(&mut self) {
            let header =
                DataHeader { sequence: self.sequence, stamp_s: 0.0, instance: 1, fresh: false };
            self.sequence += 1;
            write_slot_header(self.slot.bytes_mut(), &header, 0);
            self.ring.push(self.page.words(), RingEntry { slot: SLOT, fresh: false });
        }
    }

    /// Lets `test` follow a reader whose link has a ring.
    fn follow_ring(
        wake: Wake,
        test: impl FnOnce(&InputReader, &mut FrameReader, &mut ReadState<'_>, RingPublisher),
    ) {
        let (near, far) = UnixStream::pair().expect("two sockets");
        let input_reader = reader(Keep::ALL, wake);
        let publisher = RingPublisher::new(Stream::Unix(far));
        let stream = Stream::Unix(near);
        let of_port = stream.try_clone().expect("a second handle");
        input_reader.input.begin_link(Arc::new(of_port), false, || true);
        let mut frames = FrameReader::new();
        let mut state = ReadState {
            arrived: &mut ArrivedSequence::default(),
            stream: &stream,
            instance: 1,
            catch_up: CatchUp::default(),
            files: VecDeque::new(),
            memory: None,
            taken_from_ring: 0,
            datagrams: None,
        };
        for _offer in 0..2 {
            let len = input_reader.receive_bytes(&stream, &mut frames, &mut state);
            frames.filled(len.expect("an offer"));
            input_reader.process_frames(&mut frames, &mut state).expect("valid offers");
        }
        assert!(state.memory.is_some());
        test(&input_reader, &mut frames, &mut state, publisher);
    }

    #[test]
    fn a_publisher_whose_messages_come_by_the_ring_alone_is_not_silent() {
        follow_ring(Wake::Sleep, |input_reader, frames, state, mut publisher| {
            let (input, stream) = (&input_reader.input, state.stream);
            for _look in 0..100 {
                publisher.publish();
                input_reader.process_ring(stream, frames, state).expect("valid messages");
                input.listening.store(true, Ordering::Relaxed);
                input.check_silence();
                assert!(input.status().connected, "taken for dead");
            }
            for _look in 0..100 {
                input.check_silence();
            }
            assert!(!input.status().connected, "nothing comes any more");
        });
    }

    #[test]
    fn a_socket_is_read_although_the_ring_is_never_empty() {
        for wake in [Wake::Sleep, Wake::Spin] {
            follow_ring(wake, |input_reader, frames, state, mut publisher| {
                let stream = state.stream;
                publisher.stream.try_send(&frame::signal(FrameKind::Beat)).expect("it is sent");
                publisher.publish();
                let rounds = (0..RING_VISIT).take_while(|_| {
                    input_reader.process_ring(stream, frames, state).expect("valid messages");
                    publisher.publish();
                    input_reader.receive_bytes(stream, frames, state).is_err()
                });
                assert_eq!(rounds.count(), RING_VISIT - 1, "{wake:?}");
            });
        }
    }
}
