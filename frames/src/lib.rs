//! A tree of transforms between frames, over time (T. Foote, *tf: The Transform Library*, TePRA
//! 2013). Pure: no IO, no clock, no messages.
//!
//! ```
//! use armor_frames::{FrameError, FrameTree, Isometry3};
//! let mut tree = FrameTree::default();
//! tree.set_fixed("base_link", "laser", Isometry3::translation(0.08, 0.0, 0.3))?;
//! tree.add_sample("odom", "base_link", 1.0, Isometry3::translation(2.0, 0.0, 0.0))?;
//! tree.add_sample("odom", "base_link", 2.0, Isometry3::translation(3.0, 0.0, 0.0))?;
//! let odom_from_laser = tree.lookup("odom", "laser", 1.5)?;
//! assert!((odom_from_laser.translation.x - 2.58).abs() < 1e-12);
//! assert!(matches!(tree.lookup("odom", "laser", 2.5), Err(FrameError::TooNew { .. })));
//! # Ok::<(), FrameError>(())
//! ```

mod error;
mod history;
mod tree;

pub use error::FrameError;
pub use history::{HISTORY_S, MAX_SAMPLES};
pub use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
pub use tree::{FrameTree, MAX_FRAME_NAME_LEN, MAX_FRAMES};
