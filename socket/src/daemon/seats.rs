//! Counts connections, in total and per address. A seat is returned when it is dropped. While none is
//! free, a newcomer gets that of the connection that has waited longest for its own hello.

use std::collections::{HashMap, VecDeque};
use std::net::IpAddr;
use std::sync::{Arc, Weak};

use parking_lot::{Mutex, MutexGuard};
use tokio::sync::Notify;

/// The seats of a daemon.
#[derive(Clone)]
pub(crate) struct Seats {
    taken: Arc<Mutex<HashMap<IpAddr, usize>>>,
    most: usize,
    most_per_address: usize,
}

/// One connection's seat.
pub(crate) struct Seat {
    seats: Seats,
    address: IpAddr,
}

/// Why there is no seat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SeatShortage {
    /// The address has as many as it may.
    Address,
    /// All are taken.
    All,
}

impl Seats {
    pub(crate) fn new(most: usize, most_per_address: usize) -> Self {
        Self { taken: Arc::default(), most, most_per_address }
    }

    /// Returns a seat for a peer, if one is free.
    pub(crate) fn take_seat(&self, address: IpAddr) -> Result<Seat, SeatShortage> {
        let mut taken = self.lock();
        let here = taken.get(&address).copied().unwrap_or(0);
        if here >= self.most_per_address {
            return Err(SeatShortage::Address);
        }
        if taken.values().sum::<usize>() >= self.most {
            return Err(SeatShortage::All);
        }
        taken.insert(address, here + 1);
        Ok(Seat { seats: self.clone(), address })
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<IpAddr, usize>> {
        self.taken.lock()
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut taken = self.seats.lock();
        if let Some(here) = taken.get_mut(&self.address) {
            *here -= 1;
            if *here == 0 {
                taken.remove(&self.address);
            }
        }
    }
}

/// The seat of a connection that has not sent its hello yet: a newcomer may get it.
pub(crate) struct HandshakeSeat {
    seat: Mutex<Option<Seat>>,
    lost: Notify,
}

impl HandshakeSeat {
    /// The hello has come: the seat belongs to the connection from here on. `None` if a newcomer has
    /// got it.
    pub(crate) fn take(&self) -> Option<Seat> {
        self.seat.lock().take()
    }

    /// Returns when a newcomer has got the seat.
    pub(crate) async fn wait_for_loss(&self) {
        self.lost.notified().await;
    }

    /// Whether a newcomer can get it; one from `address`, if there is one.
    fn is_to_be_had(&self, address: Option<IpAddr>) -> bool {
        let seat = self.seat.lock();
        seat.as_ref().is_some_and(|seat| address.is_none_or(|address| seat.address == address))
    }
}

/// The connections that have not sent their hello yet, the longest wait first.
#[derive(Default)]
pub(crate) struct Handshakes {
    waiting: VecDeque<Weak<HandshakeSeat>>,
}

impl Handshakes {
    /// Returns a seat for a newcomer, if necessary that of the longest wait.
    pub(crate) fn take_seat(
        &mut self,
        seats: &Seats,
        address: IpAddr,
    ) -> Option<Arc<HandshakeSeat>> {
        let seat = match seats.take_seat(address) {
            Ok(seat) => seat,
            Err(shortage) => {
                self.free_seat((shortage == SeatShortage::Address).then_some(address));
                seats.take_seat(address).ok()?
            }
        };
        let held = Arc::new(HandshakeSeat { seat: Mutex::new(Some(seat)), lost: Notify::new() });
        let is_over =
            |it: &Weak<HandshakeSeat>| it.upgrade().is_none_or(|it| !it.is_to_be_had(None));
        while self.waiting.front().is_some_and(is_over) {
            self.waiting.pop_front();
        }
        self.waiting.push_back(Arc::downgrade(&held));
        Some(held)
    }

    /// Takes the seat of the longest wait, of one from `address` if there is one.
    fn free_seat(&mut self, address: Option<IpAddr>) {
        let mut waits = self.waiting.iter().enumerate();
        let longest = waits.find_map(|(at, it)| {
            let held = it.upgrade().filter(|held| held.is_to_be_had(address))?;
            Some((at, held))
        });
        if let Some((at, held)) = longest {
            self.waiting.remove(at);
            drop(held.take());
            held.lost.notify_one();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seats_are_limited_per_address_and_in_total_and_come_back() {
        let seats = Seats::new(3, 2);
        let (here, there) = ([127, 0, 0, 1].into(), [127, 0, 0, 2].into());
        let first = seats.take_seat(here).expect("the first seat");
        let _second = seats.take_seat(here).expect("the second seat");
        assert_eq!(seats.take_seat(here).err(), Some(SeatShortage::Address));
        let _third = seats.take_seat(there).expect("the third seat");
        assert_eq!(seats.take_seat(there).err(), Some(SeatShortage::All));
        drop(first);
        assert!(seats.take_seat(there).is_ok());
    }

    #[test]
    fn a_newcomer_gets_the_seat_of_the_longest_wait_but_none_of_a_peer_that_has_sent_its_hello() {
        let (seats, mut handshakes) = (Seats::new(3, 2), Handshakes::default());
        let (here, there) = ([127, 0, 0, 1].into(), [127, 0, 0, 2].into());
        let mut take = |address| handshakes.take_seat(&seats, address);
        let first = take(here).expect("the first seat");
        let second = take(there).expect("the second seat");
        let third = take(here).expect("the third seat");
        let greeted = third.take().expect("it has its seat");
        let fourth = take(here).expect("that of the first, since the address has two");
        assert!(first.take().is_none(), "it is lost");
        let fifth = take(there).expect("that of the second, since all are taken");
        assert!(second.take().is_none());
        let kept = (fourth.take().expect("its own"), fifth.take().expect("its own"));
        assert!(take(there).is_none(), "all have sent their hello");
        drop((greeted, kept));
        assert!(take(there).is_some());
    }
}
