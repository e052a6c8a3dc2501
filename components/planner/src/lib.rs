//! Plans a path over the map to the goal that has priority. `planning` chooses the goal and what to
//! publish; `planned_path` is the search, `zone_costs` what zones close; `ports` alone handles
//! messages.

mod planned_path;
mod planning;
mod ports;
mod zone_costs;

pub use planning::{PlannerSettings, Planning, Rank};
pub use ports::Planner;
