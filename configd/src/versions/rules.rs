//! The rules by which a version of the file is checked.

use std::path::PathBuf;

use armor_robotfile::{
    Configuration, Findings, Manifests, Override, Reading, check, fill_parameters,
};
use armor_wire::manifest::ParameterManifest;
use tracing::warn;

use crate::history::KeptVersion;

/// The rules by which a version of the file is checked. Only the kinds can change while configd
/// runs.
#[derive(Clone, Debug, Default)]
pub struct VersionRules {
    /// Values with priority over those of every version.
    pub overrides: Vec<Override>,
    /// The data that time follows, whatever the file specifies.
    pub clock: Option<String>,
    /// The kinds of components there are; without them only the file itself is checked.
    pub manifests: Option<Manifests>,
    /// What else may be wrong with one that is valid otherwise.
    pub further: Option<fn(&Configuration) -> Findings>,
    /// The absolute folder that relative paths of files start from.
    pub root: PathBuf,
}

impl VersionRules {
    /// The configuration with its warnings if all of it is valid, else what is wrong.
    pub(super) fn judge_reading(
        &self,
        reading: Reading,
    ) -> Result<(Configuration, Findings), Findings> {
        let mut reading = check(reading, &self.overrides, self.manifests.as_ref());
        if let (Some(further), Some(configuration), true) =
            (self.further, &reading.configuration, reading.is_valid())
        {
            reading.findings.extend(further(configuration));
        }
        match reading.configuration {
            Some(configuration) if !reading.findings.has_errors() => {
                Ok((configuration, reading.findings))
            }
            _ => Err(reading.findings),
        }
    }

    /// Returns the newest of the kept versions (oldest first) that is intact: a disk may have
    /// damaged the last ones.
    pub(super) fn newest_good(
        &self,
        kept: &[KeptVersion],
    ) -> Option<(u64, (Configuration, Findings))> {
        for version in kept.iter().rev() {
            match self.judge_again(version) {
                Ok(good) => return Some((version.number, good)),
                Err(findings) => {
                    let why = findings.iter().next().map(ToString::to_string).unwrap_or_default();
                    let number = version.number;
                    warn!("version {number}, as it was kept, is damaged and passed over: {why}");
                }
            }
        }
        None
    }

    /// Checks a version that an earlier process start accepted. If its kinds have changed since, it
    /// is still taken, so that the running components get answers.
    fn judge_again(&self, kept: &KeptVersion) -> Result<(Configuration, Findings), Findings> {
        let judged = self.judge_reading(kept.read_files());
        let lenient = Self { overrides: self.overrides.clone(), ..Self::default() };
        judged.or_else(|_| {
            let (mut configuration, findings) = lenient.judge_reading(kept.read_files())?;
            self.fill_parameters(&mut configuration);
            Ok((configuration, findings))
        })
    }

    /// Gives the file's frames and zones to the components that have parameters for them.
    pub(super) fn fill_parameters(&self, configuration: &mut Configuration) {
        if let Some(manifests) = &self.manifests {
            fill_parameters(configuration, manifests);
        }
    }

    /// Whether a kind writes to the path that a parameter names.
    pub(crate) fn is_written(&self, kind: &str, parameter: &str) -> bool {
        self.parameter(kind, parameter).is_some_and(|known| known.written)
    }

    /// Whether changes of a parameter reach the running components of a kind.
    pub(crate) fn is_live(&self, kind: &str, parameter: &str) -> bool {
        self.parameter(kind, parameter).is_some_and(|known| known.live)
    }

    fn parameter(&self, kind: &str, name: &str) -> Option<&ParameterManifest> {
        let manifest = self.manifests.as_ref().and_then(|manifests| manifests.get(kind))?;
        manifest.parameters.iter().find(|known| known.name == name)
    }

    /// Whether an override has priority over the file's value.
    pub(crate) fn is_overridden(&self, component: &str, parameter: &str) -> bool {
        let mut overrides = self.overrides.iter();
        overrides.any(|over| over.component.value == component && over.name.value == parameter)
    }
}

/// Whether two versions were read from the same bytes.
pub(super) fn is_same(a: &Configuration, b: &Configuration) -> bool {
    let same = |(a, b): (&std::sync::Arc<armor_robotfile::Source>, &std::sync::Arc<_>)| {
        let b: &armor_robotfile::Source = b;
        a.path() == b.path() && a.text() == b.text()
    };
    a.sources.len() == b.sources.len() && a.sources.iter().zip(&b.sources).all(same)
}
