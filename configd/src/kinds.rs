//! The kinds of components as they are now: executables come, go and are rebuilt while configd
//! runs.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use armor_robotfile::Manifests;

/// Looks for kinds in the folders of the given files, and elsewhere.
type LookForKinds = dyn Fn(&[PathBuf]) -> Option<Manifests> + Send + Sync;

/// Provides the kinds of components. It is called on a thread of its own, so it may be slow.
#[derive(Clone)]
pub struct KindSource(Arc<LookForKinds>);

impl KindSource {
    /// Uses `look`, which gets the files that configd knows and returns all kinds; `None` if they
    /// have not changed since its last call.
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
