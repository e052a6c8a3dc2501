//! How long a call of user code takes, and when that is worth a line in the log. Pure: the service
//! thread looks at every beat and hands in the time.

use std::time::Duration;

use crate::calls::CalledFunction;

/// A call that takes less than this is never reported.
const LEAST_PATIENCE: Duration = Duration::from_secs(2);
/// A call is reported after this many periods of its component, if that is longer.
const PATIENCE_PERIODS: u32 = 10;

/// A call of user code, as seen by the service thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ObservedCall {
    /// Its number.
    pub number: u64,
    pub function: CalledFunction,
    /// How long it has taken.
    pub taken: Duration,
}

/// What is to be logged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CallNotice {
    /// The call has not returned for too long. Reported once per call.
    Hangs { function: CalledFunction, taken: Duration },
    /// A call that was reported has returned.
    Returned { function: CalledFunction, taken: Duration },
}

#[derive(Clone, Copy, Debug)]
struct WatchedCall {
    call: ObservedCall,
    /// When it began.
    since: Duration,
    /// The function in which it was reported.
    reported: Option<CalledFunction>,
}

/// The call that ran at the last look.
#[derive(Debug, Default)]
pub(crate) struct CallWatch {
    watched: Option<WatchedCall>,
}

/// Returns the duration after which a call is reported, for a component with this period.
pub(crate) fn patience_for(period: Option<Duration>) -> Duration {
    let periods = period.unwrap_or_default().saturating_mul(PATIENCE_PERIODS);
    periods.max(LEAST_PATIENCE)
}

/// Returns what the watchdog of a component does about a call that hangs, or could do.
pub(crate) fn describe_watchdog(watchdog: Option<Duration>) -> String {
    match watchdog {
        Some(watchdog) => format!(
            "its watchdog has the process killed and started again if the call takes longer than \
             {} s",
            watchdog.as_secs_f64()
        ),
        None => "`watchdog` in the file has such a process killed and started again".into(),
    }
}

impl CallWatch {
    /// Takes the call that runs `now`; returns what is to be logged.
    pub fn look(
        &mut self,
        running: Option<ObservedCall>,
        now: Duration,
        patience: Duration,
    ) -> Option<CallNotice> {
        let is_same = |watched: &WatchedCall| {
            running.is_some_and(|running| running.number == watched.call.number)
        };
        let ended = self.watched.take_if(|watched| !is_same(watched));
        if let Some(call) = running {
            let since = now.saturating_sub(call.taken);
            let new = WatchedCall { call, since, reported: None };
            let watched = self.watched.get_or_insert(new);
            // One call may run `data_received` and then `exec`.
            watched.call = call;
            let taken = now.saturating_sub(watched.since);
            if taken >= patience && watched.reported.is_none() {
                watched.reported = Some(call.function);
                return Some(CallNotice::Hangs { function: call.function, taken });
            }
        }
        let ended = ended?;
        let taken = now.saturating_sub(ended.since);
        ended.reported.map(|function| CallNotice::Returned { function, taken })
    }

    /// Returns the function of the call that ran at the last look and still runs, and how long it
    /// has taken. `running` is the number of the call that runs `now`.
    pub fn current(
        &self,
        running: Option<u64>,
        now: Duration,
    ) -> Option<(CalledFunction, Duration)> {
        let watched = self.watched.as_ref().filter(|it| running == Some(it.call.number))?;
        Some((watched.call.function, now.saturating_sub(watched.since)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXEC: CalledFunction = CalledFunction::Exec;

    fn look(watch: &mut CallWatch, number: Option<u64>, now_ms: u64) -> Option<CallNotice> {
        let taken = Duration::ZERO;
        let running = number.map(|number| ObservedCall { number, function: EXEC, taken });
        watch.look(running, Duration::from_millis(now_ms), patience_for(None))
    }

    #[test]
    fn a_call_that_hangs_is_reported_once_and_again_when_it_has_returned() {
        let mut watch = CallWatch::default();
        assert_eq!(look(&mut watch, Some(7), 500), None);
        assert_eq!(look(&mut watch, Some(7), 2400), None);
        let taken = Duration::from_millis(2100);
        let hangs = CallNotice::Hangs { function: EXEC, taken };
        assert_eq!(look(&mut watch, Some(7), 2600), Some(hangs));
        assert_eq!(look(&mut watch, Some(7), 90_000), None);
        let now = Duration::from_secs(91);
        assert_eq!(watch.current(Some(7), now), Some((EXEC, Duration::from_millis(90_500))));
        assert_eq!(watch.current(Some(8), now), None, "it has returned since the last look");
        let taken = Duration::from_secs(100);
        let returned = CallNotice::Returned { function: EXEC, taken };
        assert_eq!(look(&mut watch, Some(8), 100_500), Some(returned));
        assert_eq!(look(&mut watch, None, 101_000), None, "the next call was short");
        assert_eq!(watch.current(None, now), None);
    }

    #[test]
    fn the_time_before_the_first_look_counts() {
        let mut watch = CallWatch::default();
        let (now, taken) = (Duration::from_secs(9), Duration::from_millis(400));
        let running = ObservedCall { number: 1, function: EXEC, taken };
        assert_eq!(watch.look(Some(running), now, patience_for(None)), None);
        let later = now + Duration::from_millis(100);
        assert_eq!(watch.current(Some(1), later), Some((EXEC, Duration::from_millis(500))));
    }

    #[test]
    fn many_short_calls_are_no_long_one() {
        let mut watch = CallWatch::default();
        assert!((0..100).all(|number| look(&mut watch, Some(number), 500 * number).is_none()));
    }

    #[test]
    fn a_watchdog_is_recommended_only_where_none_is_set() {
        let set = describe_watchdog(Some(Duration::from_millis(4500)));
        assert!(set.ends_with("if the call takes longer than 4.5 s"), "{set}");
        assert!(describe_watchdog(None).starts_with("`watchdog` in the file has"));
    }

    #[test]
    fn a_slow_component_has_ten_periods() {
        let patience = |period_ms| patience_for(Some(Duration::from_millis(period_ms)));
        assert_eq!(patience(20), LEAST_PATIENCE);
        assert_eq!(patience(5000), Duration::from_secs(50));
    }
}
