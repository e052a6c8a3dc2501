//! The remedy for errors that occur while a daemon of a running system is being started again, or
//! after the system has ended.

use std::net::SocketAddr;

use anyhow::Error;
use armor_inspect::run_control::RunControlError;
use armor_inspect::{FollowError, systems};
use armor_sdk::configuration::ConfigdError;
use armor_sdk::directory::DirectoryError;
use armor_sdk::operator::OrderError;
use armor_sdk::tap::TapError;

const REGISTRY: &str = "a registry that has ended is started again: try again in a moment, and \
                        `armor run` prints why, if it stays away";
const ENDED: &str = "no run of this user on this host has this registry: the system has ended, \
                     unless another user started it; `armor run FILE` starts one";
const CONFIGD: &str = "a configd that has ended is started again: try again in a moment";
const EXECUTIVE: &str = "an executive that has ended or hangs is started again: look at `armor \
                         mission show` in a moment, since the order may have been carried out";
const PROVIDER: &str = "a process that has ended or hangs is started again: try again in a moment";
const LAUNCHER: &str = "it is busy, or a signal has stopped it (`kill -CONT` continues it): try \
                        again in a moment";

/// Returns what to do about an error that may pass by itself, or that the end of the system
/// explains.
pub fn advise_retry(error: &Error) -> Option<&'static str> {
    advise(error, &has_ended)
}

/// Returns whether the registry is one of this host, and no run of this user has it. A launcher
/// that starts a registry again keeps its record meanwhile.
fn has_ended(registry: &str) -> bool {
    let Ok(address) = registry.parse::<SocketAddr>() else { return false };
    if !address.ip().is_loopback() || armor_socket::has_proxy() {
        return false;
    }
    let records = systems::record_directory().and_then(|folder| systems::list_running(&folder));
    records.is_ok_and(|records| records.iter().all(|record| record.registry != address))
}

fn advise(error: &Error, has_ended: &dyn Fn(&str) -> bool) -> Option<&'static str> {
    let advise_registry = |error: &DirectoryError| match error {
        DirectoryError::Timeout { address, .. } if has_ended(address) => Some(ENDED),
        DirectoryError::Timeout { .. } => Some(REGISTRY),
        _ => None,
    };
    let advise_provider = |error: &TapError| match error {
        TapError::Directory(error) => advise_registry(error),
        TapError::Connect(_) | TapError::Ended(_) => Some(PROVIDER),
        _ => None,
    };
    error.chain().find_map(|cause| {
        if let Some(error) = cause.downcast_ref::<DirectoryError>() {
            return advise_registry(error);
        }
        if let Some(error) = cause.downcast_ref::<TapError>() {
            return advise_provider(error);
        }
        if let Some(FollowError::Tap(error)) = cause.downcast_ref::<FollowError>() {
            return advise_provider(error);
        }
        if let Some(RunControlError::Unreachable { .. }) = cause.downcast_ref::<RunControlError>() {
            return Some(LAUNCHER);
        }
        if let Some(error) = cause.downcast_ref::<OrderError>() {
            return match error {
                OrderError::NoRegistry(error) => advise_registry(error),
                OrderError::NoAnswer { .. } => Some(EXECUTIVE),
                OrderError::NoExecutive(_) | OrderError::Lost(_) => None,
            };
        }
        match cause.downcast_ref::<ConfigdError>()? {
            // The name is right, so it is missing at the registry.
            ConfigdError::Directory(DirectoryError::Refused(_)) => Some(CONFIGD),
            ConfigdError::Directory(error) => advise_registry(error),
            ConfigdError::Connect(_) | ConfigdError::Ended(_) => Some(CONFIGD),
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_wire::hello::{Refusal, RefusalCode};

    use super::*;

    #[test]
    fn what_passes_by_itself_is_to_be_tried_again() {
        let timeout = || DirectoryError::Timeout {
            address: "127.0.0.1:7411".into(),
            waited: Duration::from_secs(3),
            problem: "refused".into(),
        };
        let missing = || {
            DirectoryError::from(Refusal::new(RefusalCode::UnknownData, "no process is called so"))
        };
        let no_answer =
            OrderError::NoAnswer { limit: Duration::from_secs(5), why: "closed".into() };
        let check = |error: Error, expected| {
            let ended = if expected == Some(REGISTRY) { Some(ENDED) } else { expected };
            assert_eq!(advise(&error, &|at| at != "127.0.0.1:7411"), expected, "{error:#}");
            assert_eq!(advise(&error, &|at| at == "127.0.0.1:7411"), ended, "{error:#}");
            assert_eq!(advise(&error.context("more"), &|_| false), expected);
        };
        check(timeout().into(), Some(REGISTRY));
        check(TapError::from(timeout()).into(), Some(REGISTRY));
        check(ConfigdError::from(timeout()).into(), Some(REGISTRY));
        check(OrderError::NoRegistry(timeout()).into(), Some(REGISTRY));
        check(ConfigdError::from(missing()).into(), Some(CONFIGD));
        check(ConfigdError::Ended("it closed the connection".into()).into(), Some(CONFIGD));
        check(no_answer.into(), Some(EXECUTIVE));
        check(TapError::Ended("closed".into()).into(), Some(PROVIDER));
        check(missing().into(), None);
        check(TapError::from(missing()).into(), None);
        check(anyhow::anyhow!("another cause"), None);
    }

    #[test]
    fn only_a_registry_of_this_host_is_known_to_have_ended() {
        // No run has port 0.
        assert!(has_ended("127.0.0.1:0"));
        assert!(!has_ended("192.0.2.7:7411") && !has_ended("robot"));
    }
}
