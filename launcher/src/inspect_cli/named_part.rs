//! The part of a system that `armor ps`, `armor graph` and `armor data list` show: all of it, or
//! what belongs to the component or port that is named.

use std::collections::BTreeSet;

use anyhow::{Result, bail};
use armor_robotfile::advise_similar;

/// A component or a port, as a user names it; none stands for the whole system.
#[derive(Clone, Copy)]
pub struct NamedPart<'a>(pub Option<&'a str>);

impl NamedPart<'_> {
    /// Returns whether a component, an output or an input belongs to it.
    pub fn contains(&self, name: &str) -> bool {
        self.0.is_none_or(|own| own == name || own == component_of(name))
    }

    /// Refuses a name that nothing in the system has.
    ///
    /// # Errors
    /// With the name that was probably meant, and those of all components.
    pub fn expect_among<'k>(&self, known: impl Iterator<Item = &'k str>) -> Result<()> {
        let Some(name) = self.0 else { return Ok(()) };
        let known: BTreeSet<&str> = known.flat_map(|it| [component_of(it), it]).collect();
        if known.contains(name) {
            return Ok(());
        }
        let advice = advise_similar(name, known.iter().copied());
        let components: Vec<_> = known.into_iter().filter(|it| !it.contains('.')).collect();
        let what = if name.contains('.') { "output or input" } else { "component" };
        bail!("no {what} is called {name}{advice} (components: {})", components.join(", "))
    }
}

fn component_of(name: &str) -> &str {
    name.split('.').next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_has_its_ports_and_a_port_only_itself() {
        let contained = |own| {
            let part = NamedPart(own);
            ["wheels", "wheels.path", "wheels.scan", "mapper.map"].map(|it| part.contains(it))
        };
        assert_eq!(contained(None), [true; 4]);
        assert_eq!(contained(Some("wheels")), [true, true, true, false]);
        assert_eq!(contained(Some("wheels.path")), [false, true, false, false]);
        // The beginning of a name is another name.
        assert_eq!(contained(Some("wheel")), [false; 4]);
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_one_that_is_meant() {
        let known = || ["wheels.path", "mapper.map", "configd"].into_iter();
        let refused = |name| NamedPart(Some(name)).expect_among(known()).unwrap_err().to_string();
        assert_eq!(
            refused("whels"),
            "no component is called whels; did you mean wheels? (components: configd, mapper, wheels)"
        );
        assert!(
            refused("mapper.mpa")
                .contains("no output or input is called mapper.mpa; did you mean mapper.map?")
        );
        for name in [None, Some("wheels"), Some("wheels.path"), Some("configd")] {
            assert!(NamedPart(name).expect_among(known()).is_ok(), "{name:?}");
        }
    }
}
