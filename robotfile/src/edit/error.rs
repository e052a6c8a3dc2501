//! Why an edit was not made.

use crate::findings::Findings;
use crate::source::Location;

/// Why an edit was not made. The document is as it was.
#[derive(Clone, Debug, thiserror::Error)]
pub enum EditError {
    /// A path or a position leads to no element.
    #[error("there is no element at that place")]
    NoElement,
    /// The outermost element cannot be removed or moved.
    #[error("the outermost element cannot be removed or moved")]
    Outermost,
    /// The subject of the edit is not in the file.
    #[error("there is no {what} in {file}", file = file.display())]
    Absent {
        /// The missing item, such as "component laser".
        what: String,
        /// The file.
        file: std::path::PathBuf,
    },
    /// A place or transition that stands for a part of a route is not in the file.
    #[error("{what} is derived from {from}, {at}: edit that line, from which it is made")]
    Derived {
        /// The item, such as "place red.l1".
        what: String,
        /// What it is derived from, such as "leg l1 of route red".
        from: String,
        /// Where that is.
        at: Location,
    },
    /// The item to be added exists already.
    #[error("{what} exists already, at {at}")]
    Taken {
        /// The existing item, such as "component laser".
        what: String,
        /// Where.
        at: Location,
    },
    /// Not a name of the format.
    #[error(
        "{name:?} is not a name: a name starts with a letter, followed by letters, digits, _ and -; at most 64 characters"
    )]
    BadName {
        /// The argument.
        name: String,
    },
    /// A link, the system and the mission are not named by anything, so they cannot be renamed.
    #[error("{what} cannot be renamed; set its attributes")]
    Nameless {
        /// The item that cannot be renamed, such as "link from a.x to b.y".
        what: String,
    },
    /// Not `component.port`.
    #[error("{text:?} is not two names joined by a dot, such as laser.scan")]
    BadPort {
        /// The argument.
        text: String,
    },
    /// Not a name of an XML element or attribute.
    #[error("{name:?} cannot be the name of an element or attribute")]
    BadXmlName {
        /// The argument.
        name: String,
    },
    /// Not a finite number, or a very large one.
    #[error("a position is two numbers of at most a billion")]
    BadPosition,
    /// Only components, places and transitions have a block.
    #[error("{what} has no position")]
    NotShown {
        /// The item that has no position, such as "variable battery".
        what: String,
    },
    /// Something that would mean another thing without it still names it.
    #[error("{what} is still named {}", places(at))]
    StillNamed {
        /// The item to be removed, such as "place home".
        what: String,
        /// The locations that name it.
        at: Vec<Location>,
    },
    /// The result would not be XML, or would break a limit.
    #[error("the file could not be read after the edit: {}", first(.0))]
    Refused(Findings),
}

fn places(at: &[Location]) -> String {
    let shown = at.iter().take(3).map(|at| format!("at {at} ({})", at.text()));
    let mut text = shown.collect::<Vec<_>>().join(", ");
    if at.len() > 3 {
        text += &format!(" and in {} more places", at.len() - 3);
    }
    text
}

fn first(findings: &Findings) -> String {
    findings.iter().next().map(ToString::to_string).unwrap_or_default()
}
