//! Mission file → plan: what the executive plays, checks and proves.
//!
//! [`Plan`] is a net with what its places activate and its transitions wait for, all names
//! resolved. [`Plan::of`] compiles one from a configuration, [`Plan::over`] one that follows a
//! running mission.

mod builder;
mod canonical;
mod compile;
mod counters;
mod dates;
mod giving;
mod guards;
mod limits;
mod plan;
mod planned;
mod setting;
mod succession;
mod values;
mod version;

pub use builder::PlanBuilder;
pub use counters::{PlannedCounter, PlannedSet, Stand};
pub use dates::{DatePhase, PlannedDates};
pub use giving::Contradiction;
pub use guards::{Operand, PlannedGuard, PlannedVariable, Watch, WatchId};
pub use limits::{OnResume, PlanLimits};
pub use plan::{Plan, PlanReader};
pub use planned::{ComponentId, PlannedComponent, PlannedPlace, PlannedTransition};
pub use succession::{fits, read};
pub use values::GivenValue;
pub use version::{FileText, Version, in_words};
