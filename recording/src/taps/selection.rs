//! Which outputs are read, by their names.

use armor_wire::name::is_name;

/// Which outputs are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OutputSelection {
    /// These, and with `component.*` all of a component; all outputs if there are none.
    pub include: Vec<String>,
    /// All but these, written the same way.
    pub exclude: Vec<String>,
}

impl OutputSelection {
    /// Whether an output is read.
    pub fn holds(&self, data: &str) -> bool {
        let is_included = self.include.iter().any(|name| matches_name(name, data));
        (self.include.is_empty() || is_included) && !self.excludes(data)
    }

    /// Checks a name of a selection: `component.output`, or `component.*` for all of a component.
    ///
    /// # Errors
    /// How it is written.
    pub fn check_name(name: &str) -> Result<(), String> {
        let is_one = name.split_once('.').is_some_and(|(component, output)| {
            is_name(component) && (output == "*" || is_name(output))
        });
        is_one
            .then_some(())
            .ok_or_else(|| "write COMPONENT.OUTPUT, or COMPONENT.* for all of a component".into())
    }

    /// Whether an output is left out by its name.
    pub fn excludes(&self, data: &str) -> bool {
        self.exclude.iter().any(|name| matches_name(name, data))
    }

    /// The names in it, included or excluded, that none of these outputs has.
    pub fn find_missing<'a>(
        names: &'a [String],
        outputs: impl Iterator<Item = &'a str> + Clone,
    ) -> Vec<&'a str> {
        let is_missing = |name: &&String| !outputs.clone().any(|output| matches_name(name, output));
        names.iter().filter(is_missing).map(String::as_str).collect()
    }
}

/// Whether a name, which may end with `*`, is that of the data.
fn matches_name(name: &str, data: &str) -> bool {
    name.strip_suffix('*').map_or(name == data, |beginning| data.starts_with(beginning))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_selected_by_name_and_by_component() {
        let all = OutputSelection::default();
        assert!(all.holds("a.x"));
        let some = OutputSelection {
            include: vec!["a.*".into(), "b.y".into()],
            exclude: vec!["a.map".into()],
        };
        let held = ["a.x", "b.y", "a.map", "b.x", "ab.x"].map(|data| some.holds(data));
        assert_eq!(held, [true, true, false, false, false]);
        let there = ["a.x", "b.x"];
        assert_eq!(OutputSelection::find_missing(&some.include, there.into_iter()), ["b.y"]);
        assert_eq!(OutputSelection::find_missing(&some.exclude, there.into_iter()), ["a.map"]);
    }
}
