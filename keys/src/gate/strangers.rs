//! Places for connections, as for those whose other end has not proven a key yet. A newcomer always
//! gets one: the oldest of its own address, or of the address that has most, loses its own. In place
//! of an address something else may tell who a connection belongs to, such as a session.

use std::net::IpAddr;
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::oneshot;

use super::limits::GateLimits;

/// The places.
#[derive(Clone)]
pub struct Strangers<K = IpAddr> {
    waiting: Arc<Mutex<Waiting<K>>>,
    most: usize,
    most_per_address: usize,
}

struct Waiting<K> {
    last: u64,
    /// The oldest first.
    places: Vec<WaitingPlace<K>>,
}

struct WaitingPlace<K> {
    id: u64,
    address: K,
    /// Ends the connection.
    end: oneshot::Sender<()>,
}

/// One connection's place, which is returned when this is dropped.
pub struct StrangerPlace<K: Clone + PartialEq = IpAddr> {
    strangers: Strangers<K>,
    id: u64,
    ended: Option<oneshot::Receiver<()>>,
}

impl Strangers {
    pub(crate) fn new(limits: &GateLimits) -> Self {
        Self::with_places(limits.strangers, limits.strangers_per_address)
    }
}

impl<K: Clone + PartialEq> Strangers<K> {
    /// `most` places in total, and `most_per_address` for one address.
    pub fn with_places(most: usize, most_per_address: usize) -> Self {
        let waiting = Waiting { last: 0, places: Vec::new() };
        Self { waiting: Arc::new(Mutex::new(waiting)), most, most_per_address }
    }

    /// Gives a newcomer a place, and ends another connection if all are taken.
    pub fn enter(&self, address: K) -> StrangerPlace<K> {
        let mut waiting = self.waiting.lock();
        let of = |places: &[WaitingPlace<K>], address: &K| {
            places.iter().filter(|place| place.address == *address).count()
        };
        let crowded = if of(&waiting.places, &address) >= self.most_per_address {
            Some(address.clone())
        } else if waiting.places.len() >= self.most {
            let all = waiting.places.iter().map(|place| &place.address);
            all.max_by_key(|one| of(&waiting.places, one)).cloned()
        } else {
            None
        };
        if let Some(crowded) = crowded
            && let Some(oldest) = waiting.places.iter().position(|place| place.address == crowded)
        {
            let _ = waiting.places.remove(oldest).end.send(());
        }
        waiting.last += 1;
        let id = waiting.last;
        let (end, ended) = oneshot::channel();
        waiting.places.push(WaitingPlace { id, address, end });
        drop(waiting);
        StrangerPlace { strangers: self.clone(), id, ended: Some(ended) }
    }
}

impl<K: Clone + PartialEq> StrangerPlace<K> {
    /// Waits until another connection has taken the place. Never, after [`Self::take_end`].
    pub async fn ended(&mut self) {
        let Some(ended) = &mut self.ended else { return std::future::pending().await };
        if ended.await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// Returns what ends with the place, with whether another connection has taken it: for a
    /// connection that proves later that it needs none.
    pub fn take_end(&mut self) -> impl Future<Output = bool> + Send + use<K> {
        let ended = self.ended.take();
        async move {
            match ended {
                Some(ended) => ended.await.is_ok(),
                None => false,
            }
        }
    }
}

impl<K: Clone + PartialEq> Drop for StrangerPlace<K> {
    fn drop(&mut self) {
        self.strangers.waiting.lock().places.retain(|place| place.id != self.id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_ended(place: &mut StrangerPlace) -> bool {
        place.ended.as_mut().is_some_and(|ended| ended.try_recv().is_ok())
    }

    #[test]
    fn a_newcomer_ends_the_oldest_of_its_address_or_of_the_largest_crowd() {
        let limits = GateLimits { strangers: 4, strangers_per_address: 3, ..GateLimits::default() };
        let strangers = Strangers::new(&limits);
        let (crowd, other, third) =
            ([10, 0, 0, 1].into(), [10, 0, 0, 2].into(), [10, 0, 0, 3].into());
        let mut first = strangers.enter(crowd);
        let mut second = strangers.enter(crowd);
        let mut alone = strangers.enter(other);
        let mut last = strangers.enter(crowd);
        assert!(!is_ended(&mut first));
        let mut newest = strangers.enter(crowd);
        assert!(is_ended(&mut first) && !is_ended(&mut second), "three of one address");
        let _newcomer = strangers.enter(third);
        assert!(is_ended(&mut second), "four in total: the crowd loses one");
        for place in [&mut alone, &mut last, &mut newest] {
            assert!(!is_ended(place));
        }
        drop((alone, last));
        let _places = [strangers.enter(other), strangers.enter(other)];
        assert!(!is_ended(&mut newest), "places come back");
    }
}
