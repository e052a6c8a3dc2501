//! The newest reading of each type that a panel keeps.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::Arc;

/// At or below this share of its charge a battery is low.
const LOW_CHARGE: f64 = 0.2;

/// The newest state of the battery; `None` is not measured.
#[derive(Clone, Debug)]
pub struct BatteryReading {
    /// 0 … 1.
    pub charge: Option<f64>,
    /// Its voltage.
    pub volts: Option<f64>,
    /// Whether it is being charged.
    pub is_charging: bool,
}

impl BatteryReading {
    /// Returns whether the operator must do something about it.
    pub fn is_low(&self) -> bool {
        !self.is_charging && self.charge.is_some_and(|charge| charge <= LOW_CHARGE)
    }
}

/// What the active component is doing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskReading {
    /// In a word or two.
    pub task: String,
}

impl TaskReading {
    /// Returns whether it is the report of a driver that has received STOP.
    pub fn is_stopped(&self) -> bool {
        self.task == "stopped"
    }
}

/// Values by their type; a clone shares them.
#[derive(Clone, Default)]
pub struct Readings {
    by_type: HashMap<TypeId, Arc<dyn Any + Send + Sync>>,
}

impl Readings {
    /// Keeps a reading in place of the last one of its type.
    pub fn store<T: Any + Send + Sync>(&mut self, reading: T) {
        self.by_type.insert(TypeId::of::<T>(), Arc::new(reading));
    }

    /// Returns the newest reading of a type.
    pub fn newest<T: Any>(&self) -> Option<&T> {
        self.by_type.get(&TypeId::of::<T>())?.downcast_ref()
    }
}

impl std::fmt::Debug for Readings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Readings").field("types", &self.by_type.len()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_of_each_type_is_kept() {
        let mut readings = Readings::default();
        assert_eq!(readings.newest::<u8>(), None);
        readings.store(1_u8);
        readings.store("text");
        readings.store(2_u8);
        assert_eq!(readings.newest(), Some(&2_u8));
        assert_eq!(readings.newest(), Some(&"text"));
    }
}
