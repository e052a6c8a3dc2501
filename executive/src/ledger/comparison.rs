//! For tests: whether two ledgers are the same.

use super::Ledger;

/// Checks that nothing distinguishes two ledgers.
pub(crate) fn check_same(live: &Ledger, again: &Ledger) {
    assert_eq!(live.plan().fingerprint(), again.plan().fingerprint());
    assert_eq!(live.plan().version(), again.plan().version());
    assert_eq!(live.version_since, again.version_since);
    assert_eq!(live.firings, again.firings);
    assert_eq!(live.activations, again.activations);
    assert_eq!((&live.standing, &live.gates), (&again.standing, &again.gates));
    assert_eq!(live.counters, again.counters);
    assert_eq!(live.authority, again.authority);
    assert_eq!(live.stage, again.stage);
    assert_eq!((live.marking(), &live.why), (again.marking(), &again.why));
    for id in live.plan.net().transition_ids() {
        assert_eq!(live.state.gate(id), again.state.gate(id));
        assert_eq!(live.state.enabled_since(id), again.state.enabled_since(id));
        assert_eq!(live.state.is_held(id), again.state.is_held(id));
    }
    let mut later = again.state.clone();
    later.advance(live.state.now());
    assert!(live.state.enabled().eq(later.enabled()), "they fire in another order");
    assert_eq!(live.state.held_since(), again.state.held_since());
    let numbers = |it: &Ledger| [it.last_firing, it.last_activation, it.fired, it.records];
    assert_eq!((numbers(live), &live.history), (numbers(again), &again.history));
    assert_eq!(live.at, again.at);
}
