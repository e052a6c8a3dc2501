//! The remedy for errors that occur while a daemon of a running system is being started again.

use anyhow::Error;
use armor_inspect::FollowError;
use armor_inspect::run_control::RunControlError;
use armor_sdk::configuration::ConfigdError;
use armor_sdk::directory::DirectoryError;
use armor_sdk::operator::OrderError;
use armor_sdk::tap::TapError;

const REGISTRY: &str = "a registry that has ended is started again: try again in a moment, and \
                        `armor run` prints why, if it stays away";
const CONFIGD: &str = "a configd that has ended is started again: try again in a moment";
const EXECUTIVE: &str = "an executive that has ended or hangs is started again: look at `armor \
                         mission show` in a moment, since the order may have been carried out";
const PROVIDER: &str = "a process that has ended or hangs is started again: try again in a moment";
const LAUNCHER: &str = "it is busy, or a signal has stopped it (`kill -CONT` continues it): try \
                        again in a moment";

/// Returns what to do about an error that may pass by itself.
pub fn advise_retry(error: &Error) -> Option<&'static str> {
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

fn advise_registry(error: &DirectoryError) -> Option<&'static str> {
    matches!(error, DirectoryError::Timeout { .. }).then_some(REGISTRY)
}

fn advise_provider(error: &TapError) -> Option<&'static str> {
    match error {
        TapError::Directory(error) => advise_registry(error),
        TapError::Connect(_) | TapError::Ended(_) => Some(PROVIDER),
        _ => None,
    }
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
            assert_eq!(advise_retry(&error), expected, "{error:#}");
            assert_eq!(advise_retry(&error.context("more")), expected);
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
}
