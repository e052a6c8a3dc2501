//! What identifies a process start: its random number and its host.

use crate::hosts::own_place;

/// Returns a random number other than 0, which means "any" wherever instances are compared.
///
/// # Panics
/// If the kernel has no random numbers. Linux has some from its start on.
pub fn random_id() -> u64 {
    getrandom::u64().expect("the kernel provides random numbers").max(1)
}

/// Returns the name of this host, as the registry lists it: that in the file, if the system has
/// several hosts, or the kernel's.
pub fn host_name() -> String {
    if let Some(place) = own_place() {
        return place.host;
    }
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}
