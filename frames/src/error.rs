//! Why a transform is refused.

use thiserror::Error;

use crate::history::HISTORY_S;
use crate::tree::{MAX_FRAME_NAME_LEN, MAX_FRAMES};

/// Why the tree does not take a transform, or has no answer.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FrameError {
    /// No edge names the frame.
    #[error("the frame `{frame}` is unknown: no transform names it")]
    Unknown {
        /// The frame.
        frame: String,
    },
    /// The two frames are in different trees.
    #[error(
        "`{target}` and `{from}` are not connected: the one is in the tree of `{target_root}`, the \
         other in that of `{source_root}`"
    )]
    NotConnected {
        /// The frame whose coordinates are wanted.
        target: String,
        /// Its outermost parent.
        target_root: String,
        /// The frame whose coordinates are known.
        from: String,
        /// Its outermost parent.
        source_root: String,
    },
    /// The moment is before the oldest sample of an edge.
    #[error(
        "{parent} -> {child} at {stamp_s} s is too old: the edge has {oldest_s} s to {newest_s} s"
    )]
    TooOld {
        /// The edge's parent.
        parent: String,
        /// The edge's child.
        child: String,
        /// The moment, in seconds.
        stamp_s: f64,
        /// Stamp of its oldest sample, in seconds.
        oldest_s: f64,
        /// Stamp of its newest sample, in seconds.
        newest_s: f64,
    },
    /// The moment is after the newest sample of an edge.
    #[error(
        "{parent} -> {child} at {stamp_s} s is too new: the edge has {oldest_s} s to {newest_s} s"
    )]
    TooNew {
        /// The edge's parent.
        parent: String,
        /// The edge's child.
        child: String,
        /// The moment, in seconds.
        stamp_s: f64,
        /// Stamp of its oldest sample, in seconds.
        oldest_s: f64,
        /// Stamp of its newest sample, in seconds.
        newest_s: f64,
    },
    /// A sample is older than what its edge keeps.
    #[error(
        "a sample of {parent} -> {child} at {stamp_s} s is more than {HISTORY_S} s older than the \
         newest, {newest_s} s; if time began again, remove the edge first"
    )]
    Outdated {
        /// The edge's parent.
        parent: String,
        /// The edge's child.
        child: String,
        /// Stamp of the sample, in seconds.
        stamp_s: f64,
        /// Stamp of its newest sample, in seconds.
        newest_s: f64,
    },
    /// The child has another parent already.
    #[error("`{child}` is in `{parent}` already: it cannot be in `{other}`, too")]
    SecondParent {
        /// The child.
        child: String,
        /// The parent that it has.
        parent: String,
        /// The one that it does not get.
        other: String,
    },
    /// The parent is the child, or is in it.
    #[error("`{child}` cannot be in `{parent}`, which is in `{child}` itself")]
    Circle {
        /// The child.
        child: String,
        /// The parent.
        parent: String,
    },
    /// A fixed edge gets a sample, or a moving one a fixed transform.
    #[error("{parent} -> {child} is {}", if *.is_fixed { "fixed: it takes no samples" } else { "moving: it cannot become fixed" })]
    OtherKind {
        /// The edge's parent.
        parent: String,
        /// The edge's child.
        child: String,
        /// Whether the edge in the tree is the fixed one.
        is_fixed: bool,
    },
    /// A name is empty or too long.
    #[error("a frame's name has 1 to {MAX_FRAME_NAME_LEN} bytes, and this one has {len}")]
    BadName {
        /// Its length in bytes.
        len: usize,
    },
    /// A number is infinite or none, or the rotation has no direction.
    #[error("{parent} -> {child}: a number of the transform or its stamp is not finite")]
    NotFinite {
        /// The edge's parent, or the frame whose coordinates are wanted.
        parent: String,
        /// The edge's child, or the frame whose coordinates are known.
        child: String,
    },
    /// The tree is full.
    #[error("the tree has {MAX_FRAMES} edges already, so `{child}` is not added")]
    Full {
        /// The child of the edge that is not added.
        child: String,
    },
}
