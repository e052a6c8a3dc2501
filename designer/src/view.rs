//! The views that the window has.

use serde::{Deserialize, Serialize};

/// One of the views of a project.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub enum View {
    /// The components and their links.
    #[default]
    System,
    /// The net over them.
    Mission,
    /// What is drawn on the map, and the routes over it.
    Map,
    /// Both while the system runs.
    Live,
}
