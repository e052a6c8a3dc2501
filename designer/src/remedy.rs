//! Remedies of findings in the words of the window, and those that a click can apply.
//!
//! A finding states its remedy as it is written in the file, such as `write from="…"`. In the window
//! nothing is written: a field is filled in, an arc is drawn, a link is added.

use std::sync::Arc;

use armor_robotfile::tree::Element;
use armor_robotfile::{Finding, OfferedEdit};

use crate::project::Project;
use crate::workspace::Workspace;

/// The tooltip of a button that applies a remedy.
pub const APPLIES: &str = "Makes this change. Undo reverts it.";

/// What an attribute of the file is called in the window.
fn field_name(attribute: &str) -> &str {
    match attribute {
        "initial" => "the initial tokens",
        "from" => "its source",
        "to" => "its target",
        "in" => "where it enters",
        "out" => "where it leaves",
        "on" => "the report it waits for",
        "when" => "its guard",
        "after" | "timeout" => "its time",
        "operator" => "that the operator fires it",
        "answer-within" => "the time to answer",
        "keep" => "what the link keeps",
        "safe" => "the safe place",
        "ref" => "the file of the sub-mission",
        "min" => "the least value",
        "max" => "the greatest value",
        "components" => "its components",
        "controllable" => "that the mission can freeze it",
        other => other,
    }
}

/// What an element of the file is called in the window.
fn thing_name(element: &str) -> String {
    match element {
        "read" => "an arc that reads".into(),
        "inhibitor" => "an inhibitor arc".into(),
        "reset" => "an arc that empties".into(),
        "submission" => "a sub-mission".into(),
        "exclusive" => "an exclusive set".into(),
        "parameter" => "the parameter".into(),
        "armor" => "the file's outermost element".into(),
        "system" => "the system".into(),
        "mission" => "the mission".into(),
        "set" => "a value that it sets".into(),
        "activity" => "an activity".into(),
        other => format!("a {other}"),
    }
}

/// Returns a text about the file in the words of the window: without names in quotation marks and
/// without angle brackets.
pub fn in_window_words(text: &str) -> String {
    let mut out = String::new();
    // What is wrong with the file as a text is corrected in a text editor.
    let mut rest = if text.contains("<armor") || text.contains("<?xml") { "" } else { text };
    if rest.is_empty() {
        return text.to_owned();
    }
    while !rest.is_empty() {
        if let Some((words, after)) = element(rest) {
            let has_article = ["a", "an", "the", "second", "one", "another"];
            let bare = out.split_whitespace().last().is_some_and(|it| has_article.contains(&it));
            let articles = ["a ", "an ", "the "];
            let short = articles.iter().find_map(|article| words.strip_prefix(article));
            out += short.filter(|_| bare).unwrap_or(&words);
            rest = after;
        } else if let Some((name, value, after)) =
            at_word_start(&out).then(|| attribute(rest)).flatten()
        {
            // `write from="…"`: the verb depends on whether the value is known.
            let verb = ["write ", "Write "].into_iter().find(|verb| out.ends_with(verb));
            if let Some(verb) = verb {
                out.truncate(out.len() - verb.len());
                out += match (value, verb.starts_with('W')) {
                    ("…", true) => "Fill in ",
                    ("…", false) => "fill in ",
                    (_, true) => "Set ",
                    (_, false) => "set ",
                };
            }
            out += &match (value, verb) {
                ("…" | "true", _) => field_name(name).to_owned(),
                ("false", _) => format!("{} to no", field_name(name)),
                (value, Some(_)) => format!("{} to {value}", field_name(name)),
                (value, None) => format!("{}: {value}", field_name(name)),
            };
            rest = after;
        } else {
            let next = rest.chars().next().unwrap_or(' ');
            out.push(next);
            rest = &rest[next.len_utf8()..];
        }
    }
    out
}

fn at_word_start(out: &str) -> bool {
    !out.chars().next_back().is_some_and(|c| c.is_alphanumeric() || c == '-' || c == '_')
}

/// `name="value"` at the beginning of a text: the name, the value, and what follows.
fn attribute(text: &str) -> Option<(&str, &str, &str)> {
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || "-_:".contains(c)))?;
    let value = text[end..].strip_prefix("=\"")?;
    let close = value.find('"')?;
    (end > 0).then(|| (&text[..end], &value[..close], &value[close + 1..]))
}

/// `<name attribute="…"/>`, `<name>` or `</name>` at the beginning of a text, in words, and what
/// follows.
fn element(text: &str) -> Option<(String, &str)> {
    let inner = text.strip_prefix('<')?;
    let is_end = inner.starts_with('/');
    let inner = inner.trim_start_matches(['/', '?']);
    let end =
        inner.find(|c: char| !(c.is_ascii_alphanumeric() || c == '-' || c == '_' || c == '…'))?;
    let (name, mut rest) = inner.split_at(end);
    if name.is_empty() {
        return None;
    }
    let mut words =
        if is_end { format!("the end of {}", thing_name(name)) } else { thing_name(name) };
    loop {
        rest = rest.trim_start_matches([' ', '\n']);
        if let Some((name, value, after)) = attribute(rest) {
            rest = after;
            match (name, value) {
                (_, "…") => {}
                ("name" | "ref" | "kind" | "place", value) => words += &format!(" {value}"),
                ("from" | "to" | "in" | "out" | "on", value) => {
                    words += &format!(" {name} {value}");
                }
                (name, value) => words += &format!(", {name} {value}"),
            }
        } else if let Some(after) = ["/>", "?>", ">"].iter().find_map(|end| rest.strip_prefix(end))
        {
            // What is between the tags is part of it.
            let close = format!("</{name}>");
            return Some(match after.split_once(close.as_str()) {
                Some((content, after)) if !content.contains('<') && !content.is_empty() => {
                    (format!("{words}: {content}"), after)
                }
                _ => (words, after),
            });
        } else {
            return None;
        }
    }
}

/// A remedy that a click applies.
#[derive(Clone, Debug)]
pub struct Offer {
    /// The text of the button.
    pub label: String,
    /// What it does.
    pub edit: OfferedEdit,
}

/// Returns the remedies of a finding that a click can apply: those that were proven to help, or the
/// name that was probably meant.
pub fn offers(finding: &Finding, project: &Project) -> Vec<Offer> {
    if !finding.edits.is_empty() {
        let label = |edit: &OfferedEdit| {
            let words = match edit.result.as_str() {
                result if result.starts_with('<') => format!("Change it to {result}"),
                result if result.starts_with("no ") => format!("Have {result}"),
                result => format!("Write {result}"),
            };
            match edit.element.as_str() {
                "" => in_window_words(&words),
                element => in_window_words(&format!("{words} ({element})")),
            }
        };
        let offer = |edit: &OfferedEdit| Offer { label: label(edit), edit: edit.clone() };
        return finding.edits.iter().map(offer).collect();
    }
    meant_name(finding).or_else(|| meant_attributes(finding, project)).into_iter().collect()
}

/// What the remedy proposes for attributes of the element that the finding is about.
fn meant_attributes(finding: &Finding, project: &Project) -> Option<Offer> {
    let (_, mut rest) = finding.remedy.split_once("did you mean ")?;
    let at = finding.at.as_ref()?;
    let files = project.files().iter();
    let file = files.into_iter().find(|file| file.shown_path() == at.source.path())?;
    let element = element_at(file.document()?.tree().root(), at.span.start())?;
    let (mut replaced, mut words) = (Vec::new(), Vec::new());
    while let Some((name, value, after)) = attribute(rest) {
        let is_whole = !value.contains(['…', '&', '<', '"']);
        let known = element.attribute(name).filter(|_| is_whole)?;
        replaced.push((known.value_span, value.to_owned()));
        words.push(in_window_words(&format!("write {name}=\"{value}\"")));
        rest = after.trim_start();
    }
    (rest.starts_with('?') && !replaced.is_empty()).then(|| Offer {
        label: capitalized(&words.join(", ")),
        edit: OfferedEdit {
            source: Arc::clone(&at.source),
            replaced,
            result: String::new(),
            element: String::new(),
        },
    })
}

/// The innermost element at a byte.
fn element_at(element: &Element, at: usize) -> Option<&Element> {
    let is_in = element.span.start() <= at && at < element.span.end();
    is_in.then(|| element.elements().find_map(|inner| element_at(inner, at)).unwrap_or(element))
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The name that the remedy proposes for the one that the finding is about.
fn meant_name(finding: &Finding) -> Option<Offer> {
    let is_name = |text: &str| {
        !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || "-_.".contains(c))
    };
    let (_, meant) = finding.remedy.split_once("did you mean ")?;
    let (meant, _) = meant.split_once('?')?;
    let at = finding.at.as_ref()?;
    let written = at.text();
    let dots = |text: &str| text.matches('.').count();
    let is_alike = is_name(meant) && is_name(written) && dots(meant) == dots(written);
    (is_alike && meant != written).then(|| Offer {
        label: format!("Change {written} to {meant}"),
        edit: OfferedEdit {
            source: Arc::clone(&at.source),
            replaced: vec![(at.span, meant.to_owned())],
            result: meant.to_owned(),
            element: String::new(),
        },
    })
}

impl Workspace {
    /// Whether an offered edit can be made: its file is open and has the text that it was made for.
    pub fn can_apply(&self, edit: &OfferedEdit) -> bool {
        self.file_of(edit).is_some()
    }

    /// Makes an offered edit, as one step of the history.
    pub fn apply_offer(&mut self, offer: &Offer) {
        let Some(file) = self.file_of(&offer.edit) else {
            self.messages.warn("The file has changed: wait until it is checked again.");
            return;
        };
        self.project.replace_text(file, offer.label.clone(), offer.edit.text().into());
    }

    fn file_of(&self, edit: &OfferedEdit) -> Option<usize> {
        let source = &edit.source;
        self.project
            .files()
            .iter()
            .position(|file| file.shown_path() == source.path() && **file.text() == *source.text())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remedy_is_in_the_words_of_the_window() {
        for (written, shown) in [
            ("write from=\"…\" or to=\"…\"", "fill in its source or its target"),
            ("write initial=\"true\" on hall", "set the initial tokens on hall"),
            ("did you mean safe=\"hold\"?", "did you mean the safe place: hold?"),
            ("did you mean <read place=\"a\"/>?", "did you mean an arc that reads a?"),
            (
                "add <transition from=\"a\" to=\"…\" on=\"b.done\"/>",
                "add a transition from a on b.done",
            ),
            ("write a second <check>", "write a second check"),
            (
                "an Armor file starts with <armor version=\"1\">",
                "an Armor file starts with <armor version=\"1\">",
            ),
            ("did you mean explorer?", "did you mean explorer?"),
        ] {
            assert_eq!(in_window_words(written), shown);
        }
    }
}
