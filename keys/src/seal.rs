//! How the datagrams of a connection between hosts are sealed: with keys from its TLS session, each
//! direction with its own, so that they prove the same holders of keys as the connection does
//! (docs/protocol.md, Gate).

use armor_wire::datagram::DATAGRAM_LEN;
use ring::aead::{Aad, CHACHA20_POLY1305, LessSafeKey, Nonce, UnboundKey};
use rustls::ConnectionCommon;

use crate::replay::ReplayWindow;

/// What the keys are for, to the TLS session.
const LABEL: &[u8] = b"EXPORTER-armor-datagrams";
/// Length of what precedes the sealed bytes: the number of the connection and that of the datagram.
const HEADER_LEN: usize = 16;
const TAG_LEN: usize = 16;
/// Longest sealed datagram in bytes.
pub(crate) const SEALED_LEN: usize = HEADER_LEN + DATAGRAM_LEN + TAG_LEN;

/// One end of the datagrams of one connection.
pub(crate) struct DatagramSeal {
    id: u64,
    sealing: LessSafeKey,
    opening: LessSafeKey,
    next: u64,
    seen: ReplayWindow,
}

/// Which end of the connection this is.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum SealEnd {
    Client,
    Gate,
}

impl DatagramSeal {
    /// That of a TLS session; `None` before its handshake is complete.
    pub fn of_session<D>(session: &ConnectionCommon<D>, end: SealEnd) -> Option<Self> {
        let exported = session.export_keying_material([0; 72], LABEL, None).ok()?;
        Self::from_keys(&exported, end)
    }

    fn from_keys(exported: &[u8; 72], end: SealEnd) -> Option<Self> {
        let (id, keys) = exported.split_first_chunk::<8>()?;
        let (of_client, of_gate) = keys.split_at(32);
        let key = |bytes| UnboundKey::new(&CHACHA20_POLY1305, bytes).ok().map(LessSafeKey::new);
        let (sealing, opening) = match end {
            SealEnd::Client => (of_client, of_gate),
            SealEnd::Gate => (of_gate, of_client),
        };
        Some(Self {
            id: u64::from_le_bytes(*id),
            sealing: key(sealing)?,
            opening: key(opening)?,
            next: 0,
            seen: ReplayWindow::default(),
        })
    }

    /// The number of the connection, with which its sealed datagrams begin.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Seals a datagram; `None` if it is too long to be one.
    pub fn seal(&mut self, datagram: &[u8]) -> Option<Vec<u8>> {
        if datagram.len() > DATAGRAM_LEN {
            return None;
        }
        let number = self.next;
        self.next = self.next.checked_add(1)?;
        let mut sealed = Vec::with_capacity(SEALED_LEN);
        sealed.extend_from_slice(&self.id.to_le_bytes());
        sealed.extend_from_slice(&number.to_le_bytes());
        let mut bytes = datagram.to_vec();
        let header = Aad::from(&sealed[..HEADER_LEN]);
        self.sealing.seal_in_place_append_tag(nonce(number), header, &mut bytes).ok()?;
        sealed.extend_from_slice(&bytes);
        Some(sealed)
    }

    /// Opens a sealed datagram; `None` if it is none of the other end's, or has been opened before.
    pub fn open(&mut self, sealed: &[u8]) -> Option<Vec<u8>> {
        let (header, rest) = sealed.split_at_checked(HEADER_LEN)?;
        if sealed.len() > SEALED_LEN || read_id(header) != Some(self.id) {
            return None;
        }
        let number =
            header.get(8..).and_then(<[u8]>::first_chunk).map(|it| u64::from_le_bytes(*it))?;
        let mut bytes = rest.to_vec();
        let opened = self.opening.open_in_place(nonce(number), Aad::from(header), &mut bytes);
        let len = opened.ok()?.len();
        bytes.truncate(len);
        self.seen.accept(number).then_some(bytes)
    }
}

/// The number of the connection to which a sealed datagram belongs.
pub(crate) fn read_id(sealed: &[u8]) -> Option<u64> {
    sealed.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
}

/// Each number is used once with a key.
fn nonce(number: u64) -> Nonce {
    let mut nonce = [0; 12];
    nonce[4..].copy_from_slice(&number.to_le_bytes());
    Nonce::assume_unique_for_key(nonce)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends() -> (DatagramSeal, DatagramSeal) {
        let exported = std::array::from_fn(|at| at as u8);
        let of = |end| DatagramSeal::from_keys(&exported, end).unwrap();
        (of(SealEnd::Client), of(SealEnd::Gate))
    }

    #[test]
    fn each_end_opens_once_what_the_other_has_sealed() {
        let (mut client, mut gate) = ends();
        for datagram in [&b""[..], b"a receipt", &[7; DATAGRAM_LEN]] {
            let sealed = client.seal(datagram).unwrap();
            assert!(sealed.len() <= SEALED_LEN && read_id(&sealed) == Some(gate.id()));
            assert_eq!(gate.open(&sealed).as_deref(), Some(datagram));
            assert_eq!(gate.open(&sealed), None, "it was sent again");
            let answer = gate.seal(datagram).unwrap();
            assert_eq!(gate.open(&answer), None, "it is its own");
            assert_eq!(client.open(&answer).as_deref(), Some(datagram));
        }
        assert_eq!(client.seal(&[7; DATAGRAM_LEN + 1]), None);
    }

    #[test]
    fn what_was_changed_is_refused_and_does_no_harm() {
        let (mut client, mut gate) = ends();
        let sealed = client.seal(b"drive").unwrap();
        for at in 0..sealed.len() {
            for bit in [0, 7] {
                let mut changed = sealed.clone();
                changed[at] ^= 1 << bit;
                assert_eq!(gate.open(&changed), None, "byte {at}");
            }
            assert_eq!(gate.open(&sealed[..at]), None);
        }
        assert_eq!(gate.open(&sealed).as_deref(), Some(&b"drive"[..]));
    }
}
