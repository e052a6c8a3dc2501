//! The undo history: the whole texts before and after each step. Files that a step did not change
//! are shared, so a step costs only what it changed. The total is bounded.

use std::collections::VecDeque;
use std::sync::Arc;

/// Bytes of texts that are kept. A file has at most one MiB.
const MAX_BYTES: usize = 256 << 20;
/// Steps that are kept at least, however large they are.
const MIN_STEPS: usize = 20;

/// One step.
#[derive(Clone, Debug)]
pub(super) struct Step {
    /// What it did, as a menu shows it.
    pub(super) what: String,
    /// The texts of all files before it.
    pub(super) before: Vec<Arc<str>>,
    /// The same after it.
    pub(super) after: Vec<Arc<str>>,
}

impl Step {
    /// Bytes that only this step holds: the texts after it. Those before it belong to the previous
    /// step.
    fn cost(&self) -> usize {
        let pairs = self.before.iter().zip(&self.after);
        pairs.filter(|(a, b)| !Arc::ptr_eq(a, b)).map(|(_, after)| after.len()).sum()
    }
}

/// The steps, the oldest first.
#[derive(Default)]
pub(super) struct History {
    steps: VecDeque<Step>,
    /// The number of steps that are done; the steps after them were undone.
    done: usize,
    bytes: usize,
}

impl History {
    pub(super) fn push(&mut self, step: Step) {
        // A new step after an undo makes the undone steps unreachable.
        for undone in self.steps.drain(self.done..) {
            self.bytes -= undone.cost();
        }
        self.bytes += step.cost();
        self.steps.push_back(step);
        while self.bytes > MAX_BYTES && self.steps.len() > MIN_STEPS {
            self.bytes -= self.steps.pop_front().map_or(0, |step| step.cost());
        }
        self.done = self.steps.len();
    }

    /// Adds a file to the last step: its text before and after it.
    pub(super) fn extend_last(&mut self, before: &str, after: &Arc<str>) {
        let Some(step) = self.done.checked_sub(1).and_then(|last| self.steps.get_mut(last)) else {
            return;
        };
        step.before.push(before.into());
        step.after.push(Arc::clone(after));
        self.bytes += after.len();
    }

    /// Replaces the text of a file after the last step.
    pub(super) fn amend_last(&mut self, file: usize, after: &Arc<str>) {
        let Some(step) = self.done.checked_sub(1).and_then(|last| self.steps.get_mut(last)) else {
            return;
        };
        self.bytes -= step.cost();
        if let Some(text) = step.after.get_mut(file) {
            *text = Arc::clone(after);
        }
        self.bytes += step.cost();
    }

    pub(super) fn undo(&mut self) -> Option<&Step> {
        self.done = self.done.checked_sub(1)?;
        self.steps.get(self.done)
    }

    pub(super) fn redo(&mut self) -> Option<&Step> {
        let step = self.steps.get(self.done)?;
        self.done += 1;
        Some(step)
    }

    pub(super) fn undoable(&self) -> Option<&Step> {
        self.steps.get(self.done.checked_sub(1)?)
    }

    pub(super) fn redoable(&self) -> Option<&Step> {
        self.steps.get(self.done)
    }
}
