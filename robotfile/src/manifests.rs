//! The manifests that a check is given.

use std::collections::BTreeMap;

use armor_wire::manifest::Manifest;

/// The manifests of all available kinds, by kind.
pub type Manifests = BTreeMap<String, Manifest>;
