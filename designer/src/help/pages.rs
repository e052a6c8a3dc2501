//! The pages of the documentation, and which of them is about an item.

use armor_robotfile::Code;

use crate::item::Item;

/// What the window shows as a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HelpPage {
    /// What a finding means, with an example and the remedy.
    Finding(Code),
    /// A section of a document.
    Document {
        /// Its number in [`DOCUMENTS`].
        document: usize,
        /// The number of the section.
        section: usize,
    },
    /// The manifest of a kind of component, or one of its parameters.
    Kind {
        /// The kind.
        kind: String,
        /// The parameter; none shows all.
        parameter: Option<String>,
    },
}

/// A document of `docs/`.
#[derive(Debug)]
pub struct HelpDocument {
    /// Its path below `docs/`.
    pub path: &'static str,
    text: &'static str,
}

macro_rules! documents {
    ($($path:literal)*) => {
        &[$(HelpDocument { path: $path, text: include_str!(concat!("../../../docs/", $path)) },)*]
    };
}

/// The documents in the order of the menu.
pub const DOCUMENTS: &[HelpDocument] = documents! {
    "designer.md" "tutorial/1-run.md" "tutorial/2-component.md" "tutorial/3-inputs.md"
    "tutorial/4-system.md" "tutorial/5-mission.md" "tutorial/6-when-it-stands-still.md"
    "tutorial/7-replay.md" "robot.md" "component.md" "mission.md" "watch.md" "missions.md"
    "file-format.md" "semantics.md" "units.md" "links.md" "frames.md" "blackboard.md" "manifest.md"
    "command-line.md" "operator.md" "screen.md" "web.md" "hosts.md" "keys.md" "security.md"
    "journal.md" "recordings.md" "map.md"
};

/// A part of a document, from one heading to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HelpSection<'a> {
    /// The heading.
    pub title: &'a str,
    /// 1 is the document's own heading.
    pub level: usize,
    /// The text below it.
    pub text: &'a str,
}

impl HelpDocument {
    /// The heading of the document.
    pub fn title(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
    }

    /// Its sections. A `#` within an example begins none.
    pub fn sections(&self) -> Vec<HelpSection<'static>> {
        let mut starts = Vec::new();
        let (mut at, mut is_example) = (0, false);
        for line in self.text.split_inclusive('\n') {
            if line.starts_with("```") {
                is_example = !is_example;
            } else if line.starts_with('#') && !is_example {
                starts.push((at, at + line.len()));
            }
            at += line.len();
        }
        let ends = starts.iter().skip(1).map(|(start, _)| *start).chain([self.text.len()]);
        let ends: Vec<_> = ends.collect();
        let sections = starts.into_iter().zip(ends).map(|((start, text), end)| {
            let heading = self.text[start..text].trim();
            let title = heading.trim_start_matches('#');
            let level = heading.len() - title.len();
            HelpSection { title: title.trim(), level, text: &self.text[text..end] }
        });
        sections.collect()
    }
}

impl HelpPage {
    /// The section of a document whose heading contains these words.
    pub fn find(path: &str, words: &str) -> Option<Self> {
        let document = DOCUMENTS.iter().position(|document| document.path == path)?;
        let sections = DOCUMENTS[document].sections();
        let section = sections.iter().position(|section| section.title.contains(words))?;
        Some(Self::Document { document, section })
    }

    /// The page about an item. That of a component's kind is known to its view.
    pub fn of_item(item: Item) -> Option<Self> {
        let format = |words| Self::find("file-format.md", words);
        match item {
            Item::Component(_) => format("<component>"),
            Item::Link { .. } => format("<link>"),
            Item::Place(_) => format("<place>"),
            Item::Transition(_) | Item::Arc { .. } => format("<transition>"),
            Item::Variable(_) => format("<variable>"),
            Item::Submission(_) => format("<submission>"),
            Item::Exclusive(_) => format("<exclusive>"),
            Item::Check(_) => format("<check>"),
            Item::Decoration { .. } => format("<layout>"),
            Item::MapPoint(_)
            | Item::Rally(_)
            | Item::Zone(_)
            | Item::MapLine(_)
            | Item::Symbol(_) => format("<map>"),
            Item::Route(_) | Item::Step { .. } => format("<route>"),
            Item::System => format("<system>"),
            Item::Mission => format("<mission>"),
        }
    }

    /// The page about a field of the mission, by the field's name; none if it is that of the item.
    pub fn of_mission_field(name: &str) -> Option<Self> {
        let format = |words| Self::find("file-format.md", words);
        match name {
            "guard" => format("Guards"),
            "not before this date" | "not after this date" => format("Dates"),
            name if name.starts_with("check ") => format("<check>"),
            name if name.starts_with("sets ") => format("<set>"),
            name if name.contains("sub-mission") => format("<submission>"),
            "name of the mission" | "period" => format("<mission>"),
            _ => None,
        }
    }

    /// What a link in the text of a document leads to, if it is a page of the window.
    pub fn of_link(target: &str, from: &str) -> Option<Self> {
        let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
        let file = file.trim_start_matches("./");
        if let Some(code) = file.rsplit('/').next().and_then(|name| name.strip_suffix(".md"))
            && let Some(code) = Code::ALL.iter().find(|known| known.as_str() == code)
        {
            return Some(Self::Finding(*code));
        }
        let (folder, _) = from.rsplit_once('/').unwrap_or(("", from));
        let path = match file {
            "" => from.to_owned(),
            file if file.starts_with("../") => file.trim_start_matches("../").to_owned(),
            file if folder.is_empty() => file.to_owned(),
            file => format!("{folder}/{file}"),
        };
        let path = path.trim_start_matches("docs/");
        let document = DOCUMENTS.iter().position(|document| document.path == path)?;
        let sections = DOCUMENTS[document].sections();
        let section = sections.iter().position(|section| anchor_of(section.title) == anchor);
        Some(Self::Document { document, section: section.unwrap_or_default() })
    }
}

/// The anchor of a heading, as web pages of Markdown have it.
fn anchor_of(title: &str) -> String {
    let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::View;

    #[test]
    fn every_item_and_field_has_a_page_with_a_text() {
        let items = [
            Item::component("a"),
            Item::link("a.x", "b.y"),
            Item::place("p"),
            Item::transition("t"),
            Item::arc("t", "p", armor_robotfile::mission::ArcKind::Take),
            Item::variable("v"),
            Item::Submission(0),
            Item::Exclusive(0),
            Item::Check(0),
            Item::Decoration { view: View::System, number: 0 },
            Item::map_point("P1"),
            Item::zone("z"),
            Item::Symbol(0),
            Item::route("red"),
            Item::step("red", "l1"),
            Item::System,
            Item::Mission,
        ];
        let fields = ["guard", "not after this date", "check 1", "sets x to", "period"];
        let of_items = items.into_iter().map(|item| (format!("{item}"), HelpPage::of_item(item)));
        let of_fields = fields.map(|name| (name.to_owned(), HelpPage::of_mission_field(name)));
        for (what, page) in of_items.chain(of_fields) {
            let Some(HelpPage::Document { document, section }) = page else {
                panic!("{what} has no page")
            };
            assert!(!DOCUMENTS[document].sections()[section].text.trim().is_empty(), "{what}");
        }
        assert_eq!(HelpPage::of_mission_field("priority"), None);
    }

    #[test]
    fn links_between_documents_lead_to_their_sections() {
        let check = |target: &str, from: &str, expected: &str| {
            let shown = HelpPage::of_link(target, from).map(|page| match page {
                HelpPage::Document { document, section } => {
                    let document = &DOCUMENTS[document];
                    format!("{}: {}", document.path, document.sections()[section].title)
                }
                HelpPage::Finding(code) => code.as_str().to_owned(),
                HelpPage::Kind { kind, .. } => kind,
            });
            assert_eq!(shown.as_deref().unwrap_or("none"), expected, "{target}");
        };
        check("links.md#shared-memory", "file-format.md", "links.md: Shared memory");
        check("#guards", "file-format.md", "file-format.md: Guards");
        check("errors/E0145.md", "file-format.md", "E0145");
        check("../file-format.md", "tutorial/4-system.md", "file-format.md: The file format");
        check("5-mission.md", "tutorial/4-system.md", "tutorial/5-mission.md: 5. A mission");
        check("https://example.com", "links.md", "none");
        check("../components/README.md", "links.md", "none");
    }
}
