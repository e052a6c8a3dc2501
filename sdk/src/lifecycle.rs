//! Whether the component is active, what the executive orders next, and whether the process ends.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use armor_wire::control::{GivenParameter, RunState};
use parking_lot::{Mutex, RwLock, RwLockReadGuard};

use crate::call::Outcome;
use crate::wake::Wakers;

/// What the executive orders.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LifecycleOrder {
    Activate(ActivationOrder),
    /// The activation that ends.
    Freeze(u64),
    /// What a component reports that has no code, because it is played from a recording.
    Report(Outcome),
}

/// An activation that is to begin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ActivationOrder {
    pub activation: u64,
    /// The values that the mission gives to parameters for the duration of the activation.
    pub parameters: Vec<GivenParameter>,
}

/// A state and the activation in which it was entered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EnteredState {
    pub state: RunState,
    pub activation: u64,
}

/// The component's state and the orders that change it. The main loop changes the state; other
/// threads give orders and read.
pub(crate) struct Lifecycle {
    controllable: AtomicBool,
    /// The system has an executive, so the component waits for its order to become active.
    controlled: AtomicBool,
    state: Mutex<EnteredState>,
    /// States that the control connections have not been sent yet, in order.
    unsent: Mutex<Vec<EnteredState>>,
    /// Whether `state` is active, for readers that must not take its lock.
    active: AtomicBool,
    /// Shared by threads outside the calls of user code while they publish; the component is not
    /// frozen as long as one does.
    publishing: RwLock<()>,
    /// Such a thread was refused before.
    has_refused: AtomicBool,
    orders: Mutex<VecDeque<LifecycleOrder>>,
    /// Whether `orders` has any, for the main loop between two messages.
    ordered: AtomicBool,
    ending: AtomicBool,
    left: AtomicBool,
    crashed: AtomicBool,
    wakers: Arc<Wakers>,
}

impl Lifecycle {
    pub fn new(wakers: Arc<Wakers>) -> Self {
        Self {
            controllable: AtomicBool::new(true),
            controlled: AtomicBool::new(false),
            state: Mutex::new(EnteredState { state: RunState::Starting, activation: 0 }),
            unsent: Mutex::default(),
            active: AtomicBool::new(false),
            publishing: RwLock::default(),
            has_refused: AtomicBool::new(false),
            orders: Mutex::default(),
            ordered: AtomicBool::new(false),
            ending: AtomicBool::new(false),
            left: AtomicBool::new(false),
            crashed: AtomicBool::new(false),
            wakers,
        }
    }

    pub fn set_non_controllable(&self) {
        self.controllable.store(false, Ordering::Relaxed);
    }

    /// Whether the executive may freeze the component.
    pub fn is_controllable(&self) -> bool {
        self.controllable.load(Ordering::Relaxed)
    }

    pub fn set_controlled(&self, controlled: bool) {
        self.controlled.store(controlled, Ordering::Relaxed);
    }

    /// Whether the component becomes active without an order. One that the mission commands does
    /// not, even if its code forbids that: it could be active together with one that excludes it.
    pub fn starts_active(&self) -> bool {
        !self.controlled.load(Ordering::Relaxed)
    }

    /// Whether the mission commands the component, which its code forbids.
    pub fn is_contradictory(&self) -> bool {
        self.controlled.load(Ordering::Relaxed) && !self.is_controllable()
    }

    /// Records a new state and wakes the service thread to send it.
    pub fn enter_state(&self, state: RunState, activation: u64) {
        let entered = EnteredState { state, activation };
        let _none_publishes = (state == RunState::Frozen).then(|| self.publishing.write());
        *self.state.lock() = entered;
        self.unsent.lock().push(entered);
        self.active.store(state == RunState::Active, Ordering::SeqCst);
        self.wakers.wake_service();
    }

    /// For a thread outside the calls of user code: the right to publish, which keeps the component
    /// from being frozen until it is dropped. `None` if the component is starting, or frozen.
    pub fn try_publish_quietly(&self) -> Option<RwLockReadGuard<'_, ()>> {
        let right = self.publishing.read();
        (!matches!(self.state().state, RunState::Starting | RunState::Frozen)).then_some(right)
    }

    /// As [`Self::try_publish_quietly`]; a refusal for being frozen is logged the first time.
    pub fn try_publish_outside_calls(&self) -> Option<RwLockReadGuard<'_, ()>> {
        let right = self.try_publish_quietly();
        if right.is_some() {
            return right;
        }
        let state = self.state().state;
        // A thread that the constructor has started is early, not wrong.
        if state == RunState::Frozen && !self.has_refused.swap(true, Ordering::Relaxed) {
            let thread = std::thread::current();
            tracing::warn!(
                "`send_data` on the thread `{}` was refused: the component is frozen; further \
                 ones are not logged",
                thread.name().unwrap_or("(without a name)")
            );
        }
        None
    }

    pub fn state(&self) -> EnteredState {
        *self.state.lock()
    }

    pub fn is_starting(&self) -> bool {
        self.state().state == RunState::Starting
    }

    pub fn is_active(&self) -> bool {
        self.active.load(Ordering::SeqCst)
    }

    /// Every state entered since the last call, also those that have been left again.
    pub fn take_unsent(&self) -> Vec<EnteredState> {
        std::mem::take(&mut *self.unsent.lock())
    }

    /// Queues an order and wakes the main loop.
    pub fn push_order(&self, order: LifecycleOrder) {
        self.orders.lock().push_back(order);
        self.ordered.store(true, Ordering::SeqCst);
        self.wakers.wake_main();
    }

    pub fn take_order(&self) -> Option<LifecycleOrder> {
        let mut orders = self.orders.lock();
        let order = orders.pop_front();
        self.ordered.store(!orders.is_empty(), Ordering::SeqCst);
        order
    }

    /// Whether the main loop has something to do that goes before data: an order, or the end.
    pub fn has_orders(&self) -> bool {
        self.ordered.load(Ordering::SeqCst) || self.is_ending()
    }

    /// Asks the main loop to stop the component and to end the process.
    pub fn request_end(&self) {
        self.ending.store(true, Ordering::SeqCst);
        self.wakers.wake_main();
    }

    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::SeqCst)
    }

    /// The process has left the system; every background thread ends.
    pub fn set_left(&self) {
        self.ending.store(true, Ordering::SeqCst);
        self.left.store(true, Ordering::SeqCst);
    }

    pub fn has_left(&self) -> bool {
        self.left.load(Ordering::SeqCst)
    }

    /// The component's code has panicked; the main loop ends the process.
    pub fn set_crashed(&self) {
        self.crashed.store(true, Ordering::SeqCst);
        self.wakers.wake_main();
    }

    pub fn has_crashed(&self) -> bool {
        self.crashed.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_component_is_frozen_after_a_thread_of_its_own_has_published() {
        let lifecycle = Lifecycle::new(Arc::new(Wakers::new().unwrap()));
        assert!(lifecycle.try_publish_outside_calls().is_none(), "it is starting");
        lifecycle.enter_state(RunState::Active, 1);
        std::thread::scope(|scope| {
            let right = lifecycle.try_publish_outside_calls().expect("it is active");
            let freezing = scope.spawn(|| lifecycle.enter_state(RunState::Frozen, 1));
            while lifecycle.publishing.try_read().is_some() {
                assert!(!freezing.is_finished(), "it does not wait");
                std::thread::yield_now();
            }
            assert_eq!(lifecycle.state().state, RunState::Active);
            drop(right);
        });
        assert_eq!(lifecycle.state().state, RunState::Frozen);
        assert!(lifecycle.try_publish_outside_calls().is_none());
        lifecycle.enter_state(RunState::Done, 2);
        assert!(lifecycle.try_publish_outside_calls().is_some(), "its activation has not ended");
    }

    #[test]
    fn orders_come_in_their_order_and_every_state_is_sent_once() {
        let lifecycle = Lifecycle::new(Arc::new(Wakers::new().unwrap()));
        assert!(lifecycle.is_starting() && lifecycle.starts_active());
        lifecycle.set_controlled(true);
        assert!(!lifecycle.starts_active() && !lifecycle.is_contradictory());
        lifecycle.set_non_controllable();
        assert!(!lifecycle.starts_active(), "it might be excluded now");
        assert!(lifecycle.is_contradictory());
        let activate = ActivationOrder { activation: 3, parameters: Vec::new() };
        let orders = [LifecycleOrder::Activate(activate), LifecycleOrder::Freeze(3)];
        orders.iter().for_each(|order| lifecycle.push_order(order.clone()));
        let taken: Vec<_> = std::iter::from_fn(|| lifecycle.take_order()).collect();
        assert_eq!(taken, orders);
        assert!(!lifecycle.has_orders());
        lifecycle.enter_state(RunState::Active, 3);
        lifecycle.enter_state(RunState::Frozen, 3);
        assert!(!lifecycle.is_active());
        let states: Vec<_> = lifecycle.take_unsent().iter().map(|entered| entered.state).collect();
        assert_eq!(states, [RunState::Active, RunState::Frozen]);
        assert!(lifecycle.take_unsent().is_empty());
        lifecycle.request_end();
        assert!(lifecycle.has_orders(), "the end goes before data too");
    }
}
