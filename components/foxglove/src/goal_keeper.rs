//! The goal that a client has set: sent again until the robot is there, or another order ends it.
//! Pure.

/// A goal, and who has set it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KeptGoal<G> {
    pub(crate) goal: G,
    client: u64,
    x_m: f64,
    y_m: f64,
}

/// Keeps at most one goal.
#[derive(Debug)]
pub(crate) struct GoalKeeper<G> {
    kept: Option<KeptGoal<G>>,
    /// A robot at this distance from the goal has arrived.
    pub(crate) tolerance_m: f64,
}

impl<G> GoalKeeper<G> {
    /// Returns a keeper without a goal.
    pub(crate) fn new(tolerance_m: f64) -> Self {
        Self { kept: None, tolerance_m }
    }

    /// Keeps a goal of a client in place of the one before.
    pub(crate) fn set(&mut self, client: u64, goal: G, (x_m, y_m): (f64, f64)) {
        self.kept = Some(KeptGoal { goal, client, x_m, y_m });
    }

    /// Returns the goal to send.
    pub(crate) fn goal(&self) -> Option<&G> {
        self.kept.as_ref().map(|kept| &kept.goal)
    }

    /// Ends the goal, whichever client has set it.
    pub(crate) fn clear(&mut self) {
        self.kept = None;
    }

    /// A client has left: its goal ends.
    pub(crate) fn leave(&mut self, client: u64) {
        self.kept.take_if(|kept| kept.client == client);
    }

    /// The robot is at a place: returns whether it has arrived, which ends the goal.
    pub(crate) fn has_arrived(&mut self, (x_m, y_m): (f64, f64)) -> bool {
        let tolerance_m = self.tolerance_m;
        let is_there =
            |kept: &mut KeptGoal<G>| (kept.x_m - x_m).hypot(kept.y_m - y_m) <= tolerance_m;
        self.kept.take_if(is_there).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_ends_at_its_place_or_with_its_client() {
        let mut keeper = GoalKeeper::new(0.3);
        assert!(!keeper.has_arrived((0.0, 0.0)), "there is none");
        keeper.set(1, "a", (2.0, 0.0));
        assert!(!keeper.has_arrived((1.6, 0.0)));
        assert!(!keeper.has_arrived((f64::NAN, 0.0)));
        keeper.leave(2);
        assert_eq!(keeper.goal(), Some(&"a"));
        assert!(keeper.has_arrived((1.8, 0.1)) && keeper.goal().is_none());
        keeper.set(1, "b", (2.0, 0.0));
        keeper.leave(1);
        assert_eq!(keeper.goal(), None);
        keeper.set(1, "c", (2.0, 0.0));
        keeper.clear();
        assert_eq!(keeper.goal(), None);
    }
}
