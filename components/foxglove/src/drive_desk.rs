//! Who drives the robot by hand: one client at a time. Pure; the caller brings the time.
//!
//! The robot moves only while messages arrive: after [`DEAD_MAN`] without one, or when the client
//! leaves, zero is due. STOP may be ordered by any client, and released by the one that drives, or by
//! any if none does.

use std::time::{Duration, Instant};

use armor_inspect::{DEAD_MAN, DriveLimits};
use thiserror::Error;

/// Time without a message after which another client may drive.
const SILENCE: Duration = Duration::from_secs(5);

/// Why a client may not drive, or not release STOP.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub(crate) enum DriveRefusal {
    /// STOP is in force.
    #[error("STOP is in force: publish false on /stop first")]
    Stopped,
    /// Another client drives.
    #[error("another client drives: wait until it has sent nothing for 5 s, or has left")]
    Occupied,
    /// The velocity is not a number.
    #[error("a velocity must be finite numbers, in metres and radians per second")]
    NoNumber,
}

/// Keeps who drives.
#[derive(Debug)]
pub(crate) struct DriveDesk {
    pub(crate) limits: DriveLimits,
    holder: Option<DriveHolder>,
    /// When the robot must stop, if it moves.
    moves_until: Option<Instant>,
    is_stopped: bool,
}

#[derive(Clone, Copy, Debug)]
struct DriveHolder {
    client: u64,
    heard: Instant,
}

impl DriveDesk {
    /// Returns a desk at which no client is.
    pub(crate) fn new(limits: DriveLimits) -> Self {
        Self { limits, holder: None, moves_until: None, is_stopped: false }
    }

    /// Takes a velocity of a client: the one to publish, if any. `true`: it has begun to drive.
    pub(crate) fn take_velocity(
        &mut self,
        client: u64,
        (forward_mps, turn_radps): (f64, f64),
        now: Instant,
    ) -> Result<(Option<(f64, f64)>, bool), DriveRefusal> {
        let velocity = self.limits.clamp(forward_mps, turn_radps).ok_or(DriveRefusal::NoNumber)?;
        let is_holder = self.is_holder(client);
        if velocity == (0.0, 0.0) {
            if !is_holder {
                return Ok((None, false));
            }
            self.holder = Some(DriveHolder { client, heard: now });
            return Ok((self.take_halt(), false));
        }
        if self.is_stopped {
            return Err(DriveRefusal::Stopped);
        }
        if !is_holder && self.is_occupied(now) {
            return Err(DriveRefusal::Occupied);
        }
        self.holder = Some(DriveHolder { client, heard: now });
        let has_begun = self.moves_until.replace(now + DEAD_MAN).is_none();
        Ok((Some(velocity), has_begun))
    }

    /// Returns zero if the robot moves and no message has arrived in time.
    pub(crate) fn take_expired(&mut self, now: Instant) -> Option<(f64, f64)> {
        if self.moves_until.is_some_and(|until| until <= now) { self.take_halt() } else { None }
    }

    /// Returns when [`Self::take_expired`] is due, if the robot moves.
    pub(crate) fn moves_until(&self) -> Option<Instant> {
        self.moves_until
    }

    /// A client has left: zero, if it was driving.
    pub(crate) fn leave(&mut self, client: u64) -> Option<(f64, f64)> {
        if !self.is_holder(client) {
            return None;
        }
        self.holder = None;
        self.take_halt()
    }

    /// Returns whether a client is the one that drives; another one may, once it is silent.
    pub(crate) fn is_driver(&self, client: u64, now: Instant) -> bool {
        self.is_holder(client) && self.is_occupied(now)
    }

    /// Orders STOP: zero, if the robot moves.
    pub(crate) fn stop(&mut self) -> Option<(f64, f64)> {
        self.is_stopped = true;
        self.take_halt()
    }

    /// Releases STOP for a client.
    pub(crate) fn release(&mut self, client: u64, now: Instant) -> Result<(), DriveRefusal> {
        if self.is_occupied(now) && !self.is_holder(client) {
            return Err(DriveRefusal::Occupied);
        }
        self.is_stopped = false;
        Ok(())
    }

    /// Returns whether STOP is in force, as far as this process has ordered it.
    pub(crate) fn is_stopped(&self) -> bool {
        self.is_stopped
    }

    fn is_holder(&self, client: u64) -> bool {
        self.holder.is_some_and(|holder| holder.client == client)
    }

    fn is_occupied(&self, now: Instant) -> bool {
        self.holder.is_some_and(|it| now.saturating_duration_since(it.heard) < SILENCE)
    }

    /// Zero once, and then nothing, so that the path of a mission is followed again.
    fn take_halt(&mut self) -> Option<(f64, f64)> {
        self.moves_until.take().map(|_| (0.0, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALT: Option<(f64, f64)> = Some((0.0, 0.0));

    fn desk() -> (DriveDesk, Instant) {
        (DriveDesk::new(DriveLimits { speed_mps: 0.5, turn_radps: 1.0 }), Instant::now())
    }

    #[test]
    fn the_robot_moves_while_messages_arrive_and_then_gets_zero_once() {
        let (mut desk, now) = desk();
        let first = desk.take_velocity(1, (2.0, 0.25), now);
        assert_eq!(first, Ok((Some((0.5, 0.25)), true)), "limited, and it has begun");
        let later = now + DEAD_MAN / 2;
        assert_eq!(desk.take_velocity(1, (0.1, 0.0), later), Ok((Some((0.1, 0.0)), false)));
        assert_eq!(desk.take_expired(now + DEAD_MAN), None, "the second one counts");
        assert_eq!(desk.take_expired(later + DEAD_MAN), HALT);
        assert_eq!(desk.take_expired(later + 2 * DEAD_MAN), None);
        assert_eq!(desk.take_velocity(1, (0.0, 0.0), later), Ok((None, false)), "it stands");
    }

    #[test]
    fn one_client_drives_until_it_is_silent_or_has_left() {
        let (mut desk, now) = desk();
        desk.take_velocity(1, (0.1, 0.0), now).expect("free");
        assert_eq!(desk.take_velocity(2, (0.1, 0.0), now), Err(DriveRefusal::Occupied));
        assert_eq!(desk.take_velocity(2, (0.0, 0.0), now), Ok((None, false)), "no halt for 1");
        assert_eq!(desk.leave(2), None, "another one has left");
        assert_eq!(desk.leave(1), HALT);
        desk.take_velocity(2, (0.1, 0.0), now).expect("free again");
        assert!(desk.is_driver(2, now) && !desk.is_driver(2, now + SILENCE));
        desk.take_velocity(1, (0.1, 0.0), now + SILENCE).expect("the other one is silent");
    }

    #[test]
    fn stop_halts_and_is_released_by_the_driver_or_if_none_drives() {
        let (mut desk, now) = desk();
        desk.take_velocity(1, (0.1, 0.0), now).expect("free");
        assert_eq!(desk.stop(), HALT);
        assert_eq!(desk.take_velocity(1, (0.1, 0.0), now), Err(DriveRefusal::Stopped));
        assert_eq!(desk.release(2, now), Err(DriveRefusal::Occupied));
        assert_eq!(desk.release(1, now), Ok(()));
        desk.take_velocity(1, (0.1, 0.0), now).expect("released");
        desk.stop();
        desk.leave(1);
        assert_eq!(desk.release(2, now), Ok(()), "none drives");
        assert!(!desk.is_stopped());
    }

    #[test]
    fn what_is_no_number_is_refused_and_moves_nothing() {
        let (mut desk, now) = desk();
        for wrong in [(f64::NAN, 0.0), (0.0, f64::INFINITY)] {
            assert_eq!(desk.take_velocity(1, wrong, now), Err(DriveRefusal::NoNumber));
        }
        assert_eq!(desk.moves_until(), None);
    }
}
