//! What of the format this version plays. The rest is refused by name, never passed over.

use armor_missions::Feature;

/// Everything that the links and the executive do beyond plain ArMoR.
pub const PLAYED: &[Feature] = &[];
