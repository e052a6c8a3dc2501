//! The subscriber's end of a link in datagrams: its socket, and the receipts.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

use armor_socket::{DatagramSocket, Stream};
use armor_wire::codec;
use armor_wire::datagram::{
    DATAGRAM_LEN, DatagramOfferBody, DatagramReceiver, DatagramSwitchBody, ReceivedMessage,
};
use armor_wire::frame::{DataHeader, Frame, FrameKind};

/// The longest time between two receipts.
const RECEIPT_PERIOD: Duration = Duration::from_millis(400);

/// See the module.
pub(super) struct DatagramReader {
    receiver: DatagramReceiver,
    socket: DatagramSocket,
    last_receipt: Option<Instant>,
    /// The publisher waits for a receipt.
    owes_receipt: bool,
    instance: u64,
}

impl DatagramReader {
    /// Opens the socket for what the publisher, the process start `instance`, has offered.
    pub fn open(frame: &Frame<'_>, stream: &Stream, instance: u64) -> Result<Self, String> {
        let offer: DatagramOfferBody =
            codec::decode_control(frame.body).map_err(|error| error.to_string())?;
        let socket = DatagramSocket::of_stream(stream)
            .map_err(|error| format!("no socket for datagrams: {error}"))?;
        let receiver = DatagramReceiver::new(offer.token, offer.resent);
        Ok(Self { receiver, socket, last_receipt: None, owes_receipt: false, instance })
    }

    /// Follows a change of what carries the data.
    pub fn follow_switch(&mut self, frame: &Frame<'_>) -> Result<(), String> {
        let switch: DatagramSwitchBody =
            codec::decode_control(frame.body).map_err(|error| error.to_string())?;
        self.receiver.switch(switch);
        Ok(())
    }

    /// Whether data come in datagrams now.
    pub fn is_in_datagrams(&self) -> bool {
        self.receiver.is_in_datagrams()
    }

    /// Whether data of the stream are put in order with those of the datagrams.
    pub fn is_ordered(&self) -> bool {
        self.receiver.is_ordered()
    }

    /// Takes data that have come by the stream.
    pub fn receive_by_stream(&mut self, header: &DataHeader, payload: &[u8]) {
        let DataHeader { sequence, stamp_s, fresh, .. } = *header;
        let payload = payload.to_vec();
        self.receiver.receive_by_stream(ReceivedMessage { sequence, stamp_s, fresh, payload });
    }

    /// Receives a datagram. Returns whether there was one.
    pub fn receive(&mut self) -> bool {
        // One byte more than a datagram of this protocol has.
        let mut buffer = [0; DATAGRAM_LEN + 1];
        match self.socket.try_receive(&mut buffer) {
            Ok((len, _)) => {
                self.owes_receipt |= self.receiver.receive(&buffer[..len]);
                true
            }
            // No process at the other end, or not yet: the receipts continue.
            Err(error) => error.kind() == io::ErrorKind::Interrupted,
        }
    }

    /// The next message.
    pub fn take_message(&mut self) -> Option<(DataHeader, Vec<u8>)> {
        let ReceivedMessage { sequence, stamp_s, fresh, payload } = self.receiver.take_message()?;
        let instance = self.instance;
        Some((DataHeader { sequence, stamp_s, instance, fresh }, payload))
    }

    /// Reports what has arrived, if that is due.
    pub fn send_receipt(&mut self) {
        if self.owes_receipt || self.until_receipt().is_zero() {
            let _ = self.socket.try_send(&self.receiver.write_receipt());
            self.last_receipt = Some(Instant::now());
            self.owes_receipt = false;
        }
    }

    /// The time until a receipt is due although nothing has come.
    pub fn until_receipt(&self) -> Duration {
        self.last_receipt
            .map_or(Duration::ZERO, |last| RECEIPT_PERIOD.saturating_sub(last.elapsed()))
    }
}

impl AsFd for DatagramReader {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// Whether a frame is about datagrams.
pub(super) fn is_about_datagrams(kind: FrameKind) -> bool {
    matches!(kind, FrameKind::DatagramOffer | FrameKind::DatagramSwitch)
}
