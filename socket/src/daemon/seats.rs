//! Counts connections, in total and per address. A seat is returned when it is dropped.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};

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

impl Seats {
    pub(crate) fn new(most: usize, most_per_address: usize) -> Self {
        Self { taken: Arc::default(), most, most_per_address }
    }

    /// Returns a seat for a peer, if one is free.
    pub(crate) fn take_seat(&self, address: IpAddr) -> Option<Seat> {
        let mut taken = self.lock();
        let here = taken.get(&address).copied().unwrap_or(0);
        if here >= self.most_per_address || taken.values().sum::<usize>() >= self.most {
            return None;
        }
        taken.insert(address, here + 1);
        Some(Seat { seats: self.clone(), address })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seats_are_limited_per_address_and_in_total_and_come_back() {
        let seats = Seats::new(3, 2);
        let (here, there) = ([127, 0, 0, 1].into(), [127, 0, 0, 2].into());
        let first = seats.take_seat(here).expect("the first seat");
        let _second = seats.take_seat(here).expect("the second seat");
        assert!(seats.take_seat(here).is_none(), "two per address");
        let _third = seats.take_seat(there).expect("the third seat");
        assert!(seats.take_seat(there).is_none(), "three in total");
        drop(first);
        assert!(seats.take_seat(there).is_some());
    }
}
