//! Components whose processes do not run, as the launcher knows them: whether data of one may still
//! come.

use std::cell::RefCell;

use armor_inspect::ProviderWatcher;
use armor_inspect::run_control::{self, AbsentComponent, AbsentState, HostReport, RunRequest};

use crate::arguments::RunningSystem;
use crate::print::print_notice;
use crate::system;

/// Returns the components whose processes do not run. Only the launcher knows them, so there are
/// none if it is of another user or on another host.
pub fn list_absent(running: &RunningSystem) -> Vec<AbsentComponent> {
    ask_launcher(running).0
}

/// As [`list_absent`], with the other hosts of the system.
pub fn ask_launcher(running: &RunningSystem) -> (Vec<AbsentComponent>, Vec<HostReport>) {
    let reply = system::find_record(running)
        .ok()
        .and_then(|record| run_control::request(&record, &RunRequest::List).ok());
    reply.map(|reply| (reply.absent, reply.hosts)).unwrap_or_default()
}

/// Reports on stderr why data has no provider, once per reason, as long as it may come.
pub struct AbsenceReporter {
    running: RunningSystem,
    data: String,
    reported: RefCell<String>,
}

impl AbsenceReporter {
    /// Nothing is reported yet.
    pub fn new(running: &RunningSystem, data: &str) -> Self {
        Self { running: running.clone(), data: data.into(), reported: RefCell::default() }
    }

    /// Returns whether the launcher knows that the provider does not run, and reports that it is
    /// waited for.
    ///
    /// # Errors
    /// In words, if it has ended for good.
    pub fn check_provider(&self) -> Result<bool, String> {
        let component = self.data.split('.').next().unwrap_or_default();
        let absent = list_absent(&self.running);
        let Some(absent) = absent.into_iter().find(|absent| absent.component == component) else {
            return Ok(false);
        };
        let reason = describe_wait(&absent).map_err(|why| format!("{}: {why}", self.data))?;
        if *self.reported.borrow() != reason {
            print_notice(format_args!("no {}: {reason}; waiting", self.data));
            self.reported.replace(reason);
        }
        Ok(true)
    }
}

impl ProviderWatcher for AbsenceReporter {
    fn report_end(&self, reason: &str) {
        let data = &self.data;
        print_notice(format_args!(
            "{data}: the link has ended: {reason}; waiting for the provider"
        ));
        self.reported.take();
    }

    fn check_return(&self) -> Result<(), String> {
        self.check_provider().map(drop)
    }
}

/// Returns why a component that does not run may come back; an error if it has ended for good.
fn describe_wait(absent: &AbsentComponent) -> Result<String, String> {
    let AbsentComponent { component, state, reason, .. } = absent;
    let because = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
    let for_good = |how: &str| {
        Err(format!("`{component}` {how}{because}; `armor restart {component}` starts it again"))
    };
    match state {
        AbsentState::Starting => Ok(format!("`{component}` is being started{because}")),
        AbsentState::Stopped => Ok(format!(
            "an operator has stopped `{component}`; `armor restart {component}` starts it again"
        )),
        AbsentState::Ended => for_good("has ended"),
        AbsentState::GivenUp => for_good("has been given up"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_ended_for_good_is_not_waited_for() {
        let describe = |state, reason: &str| {
            let (component, reason) = ("arm".to_owned(), reason.to_owned());
            let (host, ends) = (None, Vec::new());
            let absent = AbsentComponent { component, host, state, reason, starts: 5, ends };
            describe_wait(&absent)
        };
        let reason = "ended with code 7; it is given up after 5 starts in 1.6 s";
        let why = describe(AbsentState::GivenUp, reason).expect_err("for good");
        let expected = "`arm` has been given up (ended with code 7; it is given up after 5 starts in \
                        1.6 s); `armor restart arm` starts it again";
        assert_eq!(why, expected);
        let why = describe(AbsentState::Ended, "ended; it is not started again");
        assert!(why.is_err_and(|why| why.starts_with("`arm` has ended (ended; it is not")));
        let wait = describe(AbsentState::Starting, "");
        assert_eq!(wait.as_deref(), Ok("`arm` is being started"));
        let wait = describe(AbsentState::Stopped, "ended").expect("it may come back");
        assert!(wait.ends_with("`armor restart arm` starts it again"), "{wait}");
    }
}
