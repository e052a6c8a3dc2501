//! Remedies of findings in the words of the window.
//!
//! A finding states its remedy as it is written in the file, such as `write from="…"`. In the window
//! nothing is written: a field is filled in, an arc is drawn, a link is added.

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
pub(crate) fn attribute(text: &str) -> Option<(&str, &str, &str)> {
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
