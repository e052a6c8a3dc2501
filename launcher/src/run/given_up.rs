//! What the launcher reports to the executive: the components that it has given up. One JSON object
//! per line on the executive's stdin; a restarted executive receives the whole list again.

use std::collections::BTreeMap;
use std::io::{BufRead, PipeWriter, Write};

use armor_executive::GivenUpComponents;
use serde::{Deserialize, Serialize};

/// One line.
#[derive(Debug, Serialize, Deserialize)]
struct GivenUpLine {
    component: String,
    /// Why; without it, the component is started again.
    #[serde(default)]
    why: Option<String>,
}

/// The list, and the pipe to the executive that runs.
#[derive(Debug, Default)]
pub struct GivenUpReports {
    list: BTreeMap<String, String>,
    pipe: Option<PipeWriter>,
}

impl GivenUpReports {
    /// Reports to an executive that has just started.
    pub fn connect_executive(&mut self, pipe: PipeWriter) {
        self.pipe = Some(pipe);
        for (component, why) in self.list.clone() {
            self.write_line(component, Some(why));
        }
    }

    /// Reports that a component is given up.
    pub fn add_component(&mut self, component: &str, why: String) {
        self.list.insert(component.to_owned(), why.clone());
        self.write_line(component.to_owned(), Some(why));
    }

    /// Reports that a component is started, if it was given up before.
    pub fn remove_component(&mut self, component: &str) {
        if self.list.remove(component).is_some() {
            self.write_line(component.to_owned(), None);
        }
    }

    fn write_line(&mut self, component: String, why: Option<String>) {
        let Ok(text) = serde_json::to_string(&GivenUpLine { component, why }) else { return };
        if let Some(pipe) = &mut self.pipe {
            // It fails if the executive has ended, or if it is stopped and the pipe is full; its
            // successor receives the whole list.
            let _ = pipe.write_all(format!("{text}\n").as_bytes());
        }
    }
}

/// Takes in the lines of the launcher until they end.
pub fn take_reports(lines: impl BufRead, components: &GivenUpComponents) {
    for line in lines.lines().map_while(Result::ok) {
        match serde_json::from_str(&line) {
            Ok(GivenUpLine { component, why }) => components.note_component(&component, why),
            Err(error) => tracing::warn!("the launcher's report cannot be read: {error}: {line}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, pipe};

    use super::*;

    #[test]
    fn a_restarted_executive_receives_what_is_still_true() {
        let mut reports = GivenUpReports::default();
        reports.add_component("laser", "laser was given up".into());
        reports.add_component("slam", "slam was given up: \"quoted\"\nin two lines".into());
        reports.remove_component("laser");
        let (reader, writer) = pipe().expect("a pipe");
        reports.connect_executive(writer);
        reports.remove_component("camera");
        reports.add_component("laser", "again".into());
        reports.remove_component("laser");
        drop(reports);
        let lines: Vec<_> = BufReader::new(reader).lines().map_while(Result::ok).collect();
        assert_eq!(lines.len(), 3, "{lines:?}");
        let components = GivenUpComponents::default();
        take_reports(lines.join("\n").as_bytes(), &components);
        take_reports("no JSON\n{\"component\":1}\n".as_bytes(), &components);
        assert!(lines[0].contains("slam") && lines[2].contains("null"), "{lines:?}");
    }
}
