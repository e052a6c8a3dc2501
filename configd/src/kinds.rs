//! The kinds of components as they are now: executables come, go and are rebuilt while configd runs.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use armor_robotfile::Manifests;

/// Looks for kinds beside the files given, and elsewhere.
type LookForKinds = dyn Fn(&[PathBuf]) -> Option<Manifests> + Send + Sync;

/// Says which kinds there are. It is asked beside the loop, so it may take its time.
#[derive(Clone)]
pub struct KindSource(Arc<LookForKinds>);

impl KindSource {
    /// Asks `look`, with the files that configd knows, for all kinds there are; it says nothing if
    /// they are what they were when it was asked last.
    pub fn new(look: impl Fn(&[PathBuf]) -> Option<Manifests> + Send + Sync + 'static) -> Self {
        Self(Arc::new(look))
    }

    pub(crate) fn look_again(&self, files: &[PathBuf]) -> Option<Manifests> {
        (self.0)(files)
    }
}

impl fmt::Debug for KindSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("KindSource")
    }
}
