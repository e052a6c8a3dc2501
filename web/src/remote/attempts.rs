//! Wrong secrets, by address: each address has a few attempts, then it waits longer and longer. Pure:
//! the time is an argument.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::time::Duration;

/// Wrong secrets of one address before it must wait.
const FREE: u32 = 5;
/// The first wait; it doubles with each further wrong secret.
const FIRST_WAIT: Duration = Duration::from_secs(1);
/// The longest wait. A person behind the same address as an attacker waits for as long.
const LONGEST_WAIT: Duration = Duration::from_secs(30);
/// An address without a wrong secret for this long is forgotten.
const FORGOTTEN_AFTER: Duration = Duration::from_secs(3600);
/// Most addresses that are remembered; the one that was quiet for longest is forgotten first.
const MAX_ADDRESSES: usize = 1024;

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Attempts(HashMap<IpAddr, WrongSecrets>);

#[derive(Clone, Copy, Debug)]
struct WrongSecrets {
    count: u32,
    last: Duration,
}

impl WrongSecrets {
    /// The time at which the next attempt is looked at.
    fn next_at(self) -> Duration {
        let Some(excess) = self.count.checked_sub(FREE) else { return Duration::ZERO };
        let wait = FIRST_WAIT.saturating_mul(1 << excess.min(16));
        self.last + wait.min(LONGEST_WAIT)
    }
}

impl Attempts {
    /// Checks whether an attempt of this address is looked at.
    ///
    /// # Errors
    /// The time that it must wait.
    pub(super) fn check(&self, address: IpAddr, now: Duration) -> Result<(), Duration> {
        let Some(wrong) = self.0.get(&group_of(address)) else { return Ok(()) };
        match wrong.next_at().saturating_sub(now) {
            Duration::ZERO => Ok(()),
            left => Err(left),
        }
    }

    /// Notes a wrong secret; returns how many came from this address.
    pub(super) fn note_wrong(&mut self, address: IpAddr, now: Duration) -> u32 {
        let group = group_of(address);
        if !self.0.contains_key(&group) && self.0.len() >= MAX_ADDRESSES {
            self.0.retain(|_, wrong| now.saturating_sub(wrong.last) < FORGOTTEN_AFTER);
            let quiet = self.0.iter().min_by_key(|(_, wrong)| wrong.last).map(|(it, _)| *it);
            if let Some(quiet) = quiet
                && self.0.len() >= MAX_ADDRESSES
            {
                self.0.remove(&quiet);
            }
        }
        let wrong = self.0.entry(group).or_insert(WrongSecrets { count: 0, last: now });
        if now.saturating_sub(wrong.last) >= FORGOTTEN_AFTER {
            wrong.count = 0;
        }
        *wrong = WrongSecrets { count: wrong.count.saturating_add(1), last: now };
        wrong.count
    }

    /// Forgets the wrong secrets of an address that has sent a right one.
    pub(super) fn forget(&mut self, address: IpAddr) {
        self.0.remove(&group_of(address));
    }
}

/// The address by which attempts are counted: a host has 2⁶⁴ addresses of IPv6 at least.
fn group_of(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => {
            let [a, b, c, d, ..] = address.segments();
            Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).into()
        }
        address => address,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 1));

    fn s(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    #[test]
    fn wrong_secrets_are_looked_at_ever_more_slowly() {
        let mut attempts = Attempts::default();
        let mut now = s(1000.0);
        let mut waits = Vec::new();
        for _ in 0..14 {
            if let Err(wait) = attempts.check(ONE, now) {
                waits.push(wait.as_secs());
                assert_eq!(attempts.check(ONE, now + wait - s(0.1)), Err(s(0.1)));
                now += wait;
            }
            assert_eq!(attempts.check(ONE, now), Ok(()));
            attempts.note_wrong(ONE, now);
        }
        assert_eq!(waits, [1, 2, 4, 8, 16, 30, 30, 30, 30]);
        let other = IpAddr::from([10, 0, 0, 2]);
        assert_eq!(attempts.check(other, now), Ok(()), "another address need not wait");
        attempts.forget(ONE);
        assert_eq!(attempts.check(ONE, now), Ok(()));
    }

    #[test]
    fn an_address_is_forgotten_after_an_hour_and_the_memory_is_bounded() {
        let mut attempts = Attempts::default();
        for _ in 0..9 {
            attempts.note_wrong(ONE, s(0.0));
        }
        assert_eq!(attempts.note_wrong(ONE, s(3600.0)), 1);
        for number in 0..5_000_u32 {
            attempts.note_wrong(IpAddr::from(number.to_be_bytes()), s(3600.0 + f64::from(number)));
            assert!(attempts.0.len() <= MAX_ADDRESSES);
        }
        assert_eq!(attempts.0.len(), MAX_ADDRESSES);
    }

    #[test]
    fn all_addresses_of_a_host_of_ipv6_are_one() {
        let mut attempts = Attempts::default();
        for last in 1..=6_u16 {
            let address = Ipv6Addr::new(0xfd00, 1, 2, 3, 4, 5, 6, last);
            attempts.note_wrong(address.into(), s(1.0));
        }
        let another = |fourth| IpAddr::from(Ipv6Addr::new(0xfd00, 1, 2, fourth, 9, 9, 9, 9));
        assert!(attempts.check(another(3), s(1.0)).is_err());
        assert!(attempts.check(another(4), s(1.0)).is_ok());
        let mapped = IpAddr::from(std::net::Ipv4Addr::new(10, 0, 0, 1).to_ipv6_mapped());
        for _ in 0..=FREE {
            attempts.note_wrong(mapped, s(1.0));
        }
        assert!(attempts.check(ONE, s(1.0)).is_err());
    }
}
