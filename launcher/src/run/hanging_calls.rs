//! The calls of components' code that hang, as their beats report them: for the status of the run.

use std::collections::BTreeMap;
use std::sync::Arc;

use armor_inspect::HANGING_CALL_S;
use armor_inspect::words::describe_call;
use armor_wire::control::CurrentCall;
use parking_lot::Mutex;

/// The calls that hang, by component. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct HangingCalls {
    calls: Arc<Mutex<BTreeMap<String, CurrentCall>>>,
}

impl HangingCalls {
    /// Takes the call that a beat of the component reports, if one runs.
    pub fn record_beat(&self, component: &str, call: Option<&CurrentCall>) {
        let mut calls = self.calls.lock();
        match call.filter(|call| call.call_s >= HANGING_CALL_S) {
            Some(call) => {
                calls.insert(component.into(), call.clone());
            }
            None => {
                calls.remove(component);
            }
        }
    }

    /// Forgets a component whose process has ended.
    pub fn forget_component(&self, component: &str) {
        self.calls.lock().remove(component);
    }

    /// Returns the calls in words, such as `tank in exec for 12.0 s`.
    pub fn describe_calls(&self) -> Vec<String> {
        let calls = self.calls.lock();
        calls.iter().map(|(name, call)| format!("{name} {}", describe_call(call))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_is_listed_until_it_returns_or_its_process_ends() {
        let calls = HangingCalls::default();
        let call = |call_s| CurrentCall { function: "exec".into(), call_s };
        calls.record_beat("tank", Some(&call(0.1)));
        assert_eq!(calls.describe_calls(), Vec::<String>::new(), "a short call is no finding");
        calls.record_beat("tank", Some(&call(12.0)));
        calls.record_beat("arm", Some(&call(61.0)));
        assert_eq!(
            calls.describe_calls(),
            ["arm in exec for 1 min 01 s", "tank in exec for 12.0 s"]
        );
        calls.record_beat("tank", None);
        calls.forget_component("arm");
        assert_eq!(calls.describe_calls(), Vec::<String>::new());
    }
}
