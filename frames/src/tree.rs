//! The tree of frames: edges from parents to children, fixed or moving, and lookups between frames.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use crate::error::FrameError;
use crate::history::{OutsideHistory, TransformHistory};

/// Most edges of a tree: with full histories it takes 64 MiB.
pub const MAX_FRAMES: usize = 256;
/// Longest name of a frame, in bytes: a name of the file and an epoch.
pub const MAX_FRAME_NAME_LEN: usize = 128;

/// Frames, and where each is in its parent. Transforms read `target_from_source`: they bring the
/// coordinates of a point in `source` into `target`.
#[derive(Clone, Debug, Default)]
pub struct FrameTree {
    /// By child. The frames that are only parents are the roots.
    edges: BTreeMap<String, Edge>,
}

#[derive(Clone, Debug)]
struct Edge {
    parent: String,
    motion: Motion,
}

#[derive(Clone, Debug)]
enum Motion {
    Fixed(Isometry3<f64>),
    Moving(TransformHistory),
}

impl FrameTree {
    /// Sets where `child` always is in `parent`; a later call with the same parent replaces it.
    ///
    /// # Errors
    /// [`FrameError::SecondParent`], [`FrameError::Circle`], [`FrameError::OtherKind`] if it moves,
    /// or the limits and malformed arguments.
    pub fn set_fixed(
        &mut self,
        parent: &str,
        child: &str,
        parent_from_child: Isometry3<f64>,
    ) -> Result<(), FrameError> {
        check_finite(parent, child, 0.0, &parent_from_child)?;
        let motion = Motion::Fixed(parent_from_child);
        match self.find_edge(parent, child)? {
            Some(Edge { motion: Motion::Moving(_), .. }) => {
                return Err(other_kind(parent, child, false));
            }
            Some(edge) => edge.motion = motion,
            None => self.insert_edge(parent, child, motion)?,
        }
        Ok(())
    }

    /// Adds where `child` was in `parent` at a moment, in seconds. Stamps may run back within
    /// [`HISTORY_S`](crate::HISTORY_S); a second sample of one moment replaces the first.
    ///
    /// # Errors
    /// As [`Self::set_fixed`], and [`FrameError::Outdated`].
    pub fn add_sample(
        &mut self,
        parent: &str,
        child: &str,
        stamp_s: f64,
        parent_from_child: Isometry3<f64>,
    ) -> Result<(), FrameError> {
        check_finite(parent, child, stamp_s, &parent_from_child)?;
        match self.find_edge(parent, child)? {
            Some(Edge { motion: Motion::Fixed(_), .. }) => Err(other_kind(parent, child, true)),
            Some(Edge { motion: Motion::Moving(history), .. }) => {
                let newest_s = history.newest_s();
                if history.add(stamp_s, parent_from_child) {
                    return Ok(());
                }
                let (parent, child) = (parent.to_owned(), child.to_owned());
                Err(FrameError::Outdated { parent, child, stamp_s, newest_s })
            }
            None => {
                let history = TransformHistory::new(stamp_s, parent_from_child);
                self.insert_edge(parent, child, Motion::Moving(history))
            }
        }
    }

    /// Removes the edge above `child` with its history, as when its parent gets a new epoch;
    /// returns the parent that it had.
    pub fn remove(&mut self, child: &str) -> Option<String> {
        self.edges.remove(child).map(|edge| edge.parent)
    }

    /// Returns the parent of a frame; none of a root, or of a frame that is unknown.
    pub fn parent(&self, frame: &str) -> Option<&str> {
        self.edges.get(frame).map(|edge| edge.parent.as_str())
    }

    /// Returns `target_from_source` at a moment, in seconds: the edges between the two as they were
    /// then. Edges above their nearest common parent do not matter.
    ///
    /// # Errors
    /// [`FrameError::Unknown`], [`FrameError::NotConnected`], [`FrameError::TooOld`] or
    /// [`FrameError::TooNew`] with the edge that has no transform at that moment, or
    /// [`FrameError::NotFinite`] about the stamp.
    pub fn lookup(
        &self,
        target: &str,
        source: &str,
        stamp_s: f64,
    ) -> Result<Isometry3<f64>, FrameError> {
        if !stamp_s.is_finite() {
            return Err(not_finite(target, source));
        }
        let (target_chain, source_chain) = self.find_chains(target, source)?;
        let common_from_target = compose(&target_chain, stamp_s)?;
        let common_from_source = compose(&source_chain, stamp_s)?;
        if target_chain.is_empty() {
            return Ok(common_from_source);
        }
        Ok(common_from_target.inv_mul(&common_from_source))
    }

    /// Returns the newest moment, in seconds, at which no edge between the two frames is too new;
    /// none if all of them are fixed.
    ///
    /// # Errors
    /// [`FrameError::Unknown`] or [`FrameError::NotConnected`].
    pub fn newest_common_s(&self, target: &str, source: &str) -> Result<Option<f64>, FrameError> {
        let (target_chain, source_chain) = self.find_chains(target, source)?;
        let newest =
            target_chain.iter().chain(&source_chain).filter_map(|(_, edge)| match &edge.motion {
                Motion::Fixed(_) => None,
                Motion::Moving(history) => Some(history.newest_s()),
            });
        Ok(newest.reduce(f64::min))
    }

    /// Returns the existing edge from `parent` to `child`.
    fn find_edge(&mut self, parent: &str, child: &str) -> Result<Option<&mut Edge>, FrameError> {
        match self.edges.get_mut(child) {
            Some(edge) if edge.parent != parent => Err(FrameError::SecondParent {
                child: child.to_owned(),
                parent: edge.parent.clone(),
                other: parent.to_owned(),
            }),
            edge => Ok(edge),
        }
    }

    /// Inserts the first edge above `child`.
    fn insert_edge(&mut self, parent: &str, child: &str, motion: Motion) -> Result<(), FrameError> {
        for name in [parent, child] {
            if name.is_empty() || name.len() > MAX_FRAME_NAME_LEN {
                return Err(FrameError::BadName { len: name.len() });
            }
        }
        let mut above = Some(parent);
        while let Some(frame) = above {
            if frame == child {
                let (child, parent) = (child.to_owned(), parent.to_owned());
                return Err(FrameError::Circle { child, parent });
            }
            above = self.parent(frame);
        }
        if self.edges.len() >= MAX_FRAMES {
            return Err(FrameError::Full { child: child.to_owned() });
        }
        self.edges.insert(child.to_owned(), Edge { parent: parent.to_owned(), motion });
        Ok(())
    }

    /// Returns the edges from each of the two up to their nearest common parent, the lowest first.
    fn find_chains<'a>(
        &'a self,
        target: &'a str,
        source: &'a str,
    ) -> Result<(Chain<'a>, Chain<'a>), FrameError> {
        let (mut target_chain, target_root) = self.find_chain(target)?;
        let (mut source_chain, source_root) = self.find_chain(source)?;
        if target_root != source_root {
            return Err(FrameError::NotConnected {
                target: target.to_owned(),
                target_root: target_root.to_owned(),
                from: source.to_owned(),
                source_root: source_root.to_owned(),
            });
        }
        let is_shared = |(target, source): (Option<&Step<'_>>, Option<&Step<'_>>)| {
            target.zip(source).is_some_and(|((target, _), (source, _))| target == source)
        };
        while is_shared((target_chain.last(), source_chain.last())) {
            target_chain.pop();
            source_chain.pop();
        }
        Ok((target_chain, source_chain))
    }

    /// Returns the edges from a frame up to its root, and the root.
    fn find_chain<'a>(&'a self, frame: &'a str) -> Result<(Chain<'a>, &'a str), FrameError> {
        let (mut chain, mut root) = (Chain::new(), frame);
        while let Some((child, edge)) = self.edges.get_key_value(root) {
            chain.push((child, edge));
            root = &edge.parent;
        }
        let is_known = !chain.is_empty() || self.edges.values().any(|edge| edge.parent == frame);
        if is_known { Ok((chain, root)) } else { Err(FrameError::Unknown { frame: frame.into() }) }
    }
}

/// A child and the edge above it.
type Step<'a> = (&'a String, &'a Edge);
/// Edges upwards from a frame.
type Chain<'a> = Vec<Step<'a>>;

/// Composes the edges of a chain as they were at a moment.
fn compose(chain: &Chain<'_>, stamp_s: f64) -> Result<Isometry3<f64>, FrameError> {
    let mut above_from_frame: Option<Isometry3<f64>> = None;
    for (child, edge) in chain {
        let parent_from_child = match &edge.motion {
            Motion::Fixed(transform) => *transform,
            Motion::Moving(history) => {
                history.at(stamp_s).map_err(|why| outside(child, edge, history, stamp_s, why))?
            }
        };
        above_from_frame = Some(match above_from_frame {
            Some(below) => parent_from_child * below,
            None => parent_from_child,
        });
    }
    Ok(above_from_frame.unwrap_or_else(Isometry3::identity))
}

fn outside(
    child: &str,
    edge: &Edge,
    history: &TransformHistory,
    stamp_s: f64,
    why: OutsideHistory,
) -> FrameError {
    let (parent, child) = (edge.parent.clone(), child.to_owned());
    let (oldest_s, newest_s) = (history.oldest_s(), history.newest_s());
    match why {
        OutsideHistory::TooOld => FrameError::TooOld { parent, child, stamp_s, oldest_s, newest_s },
        OutsideHistory::TooNew => FrameError::TooNew { parent, child, stamp_s, oldest_s, newest_s },
    }
}

fn other_kind(parent: &str, child: &str, is_fixed: bool) -> FrameError {
    FrameError::OtherKind { parent: parent.to_owned(), child: child.to_owned(), is_fixed }
}

fn not_finite(parent: &str, child: &str) -> FrameError {
    FrameError::NotFinite { parent: parent.to_owned(), child: child.to_owned() }
}

fn check_finite(
    parent: &str,
    child: &str,
    stamp_s: f64,
    transform: &Isometry3<f64>,
) -> Result<(), FrameError> {
    let numbers = transform.translation.vector.iter().chain(transform.rotation.coords.iter());
    let is_finite = stamp_s.is_finite() && numbers.copied().all(f64::is_finite);
    if is_finite { Ok(()) } else { Err(not_finite(parent, child)) }
}

#[cfg(test)]
mod tests;
