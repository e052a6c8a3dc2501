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
/// Messages that are taken from a ring before the reader looks at the socket: a publisher that never
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
    /// component is active.
    pub(super) fn receive_bytes(
        &self,
        stream: &Stream,
        reader: &mut FrameReader,
        state: &mut ReadState<'_>,
    ) -> io::Result<usize> {
        let ReadState { files, memory, datagrams, .. } = state;
        if let Some(datagrams) = datagrams {
            return self.receive_next_to_datagrams(stream, reader, datagrams, files);
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
