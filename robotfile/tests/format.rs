//! Formatting changes white space that means nothing, and that once.

use std::fs;
use std::path::Path;

use armor_robotfile::tree::{Element, Node};
use armor_robotfile::{format, parse_tree};
use proptest::prelude::*;

const NAME: &str = "a.xml";

fn formatted(text: &str) -> String {
    String::from_utf8(format(Path::new(NAME), text.as_bytes()).unwrap()).unwrap()
}

/// The text is laid out like this, and then stays.
fn check(before: &str, after: &str) {
    assert_eq!(formatted(before), after);
    assert_eq!(formatted(after), after);
}

#[test]
fn one_element_per_line_and_one_blank_line_at_most() {
    check(
        "<?xml version='1.0'?><armor   version = '1' ><system\n name=\"a\" ><component name='b'\tkind='k' ></component >\n\n\n\n<link from='a.b'   to='c.d'/><link from='a.b' to='c.e'/>   \n\n</system></armor>",
        "<?xml version='1.0'?>\n<armor version='1'>\n  <system name=\"a\">\n    <component name='b' kind='k'/>\n\n    <link from='a.b' to='c.d'/>\n    <link from='a.b' to='c.e'/>\n  </system>\n</armor>\n",
    );
    check("\n\n <armor/> \n\n", "<armor/>\n");
    check(
        "\u{feff}<armor>\r\n\t<system>\n\n\n</system></armor>",
        "\u{feff}<armor>\r\n  <system/>\r\n</armor>\r\n",
    );
}

#[test]
fn a_comment_stays_where_it_belongs() {
    check(
        "<!-- head --> <!-- two -->\n\n<armor><!-- of armor -->\n<!-- of system\n      goes on   -->\n<system><component name='a'/>   <!-- of a --><component name='b'/>\n\n\n<!-- of c --><?of c?>\n<component name='c'/><!-- last -->\n\n<!-- end -->\n\n</system></armor> <!-- behind -->\n<!-- foot -->",
        "<!-- head --> <!-- two -->\n\n<armor> <!-- of armor -->\n  <!-- of system\n      goes on   -->\n  <system>\n    <component name='a'/> <!-- of a -->\n    <component name='b'/>\n\n    <!-- of c --> <?of c?>\n    <component name='c'/> <!-- last -->\n\n    <!-- end -->\n  </system>\n</armor> <!-- behind -->\n<!-- foot -->\n",
    );
}

#[test]
fn a_long_tag_has_its_attributes_below_one_another() {
    let long = "y".repeat(40);
    let wrapped = std::format!(
        "<armor>\n  <system>\n    <component name=\"{long}\"\n               kind='{long}'\n               rate=\"10Hz\"/>\n  </system>\n</armor>\n"
    );
    check(
        &std::format!(
            "<armor><system><component name=\"{long}\" kind='{long}' rate=\"10Hz\"/></system></armor>"
        ),
        &wrapped,
    );
    // One that fits again is joined.
    check(
        &wrapped.replace(&long, "y"),
        "<armor>\n  <system>\n    <component name=\"y\" kind='y' rate=\"10Hz\"/>\n  </system>\n</armor>\n",
    );
}

#[test]
fn texts_and_values_stay_as_they_are_written() {
    check(
        "<armor><mission name=' &#97;\n b '><check>  a &lt; <![CDATA[ b ]]>\n and c </check><layout><note> x <b/>  y</note><check> z </check><s xml:space='preserve'> </s></layout></mission></armor>",
        "<armor>\n  <mission name=' &#97;\n b '>\n    <check>a &lt; <![CDATA[ b ]]>\n and c</check>\n    <layout>\n      <note> x <b/>  y</note>\n      <check> z </check>\n      <s xml:space='preserve'> </s>\n    </layout>\n  </mission>\n</armor>\n",
    );
}

#[test]
fn other_xml_and_malformed_xml_are_refused_with_findings() {
    for (text, code) in [
        ("<armor><system></armor>", "E0012"),
        ("<armor a='1' a='2'/>", "E0011"),
        ("<svg/>", "E0020"),
        ("", "E0004"),
    ] {
        let findings = format(Path::new(NAME), text.as_bytes()).unwrap_err();
        assert_eq!(findings.iter().next().unwrap().code.as_str(), code, "{text}");
    }
    // Ill spelled, but XML.
    check("<armor><sistem/></armor>", "<armor>\n  <sistem/>\n</armor>\n");
    // Its line breaks would make it too long.
    let text = std::format!("<armor><system>{}</system></armor>", "<a/>".repeat(200_000));
    assert!(format(Path::new(NAME), text.as_bytes()).is_err());
}

#[test]
fn the_shipped_files_are_formatted() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "xml") {
            let bytes = fs::read(&path).unwrap();
            assert!(format(&path, &bytes).unwrap() == bytes, "armor fmt {}", path.display());
        }
    }
}

/// The contents of a file: names, values, texts and comments in their order, without blank text
/// between elements.
fn meaning(text: &str) -> Vec<String> {
    let tree = parse_tree(Path::new(NAME), text.as_bytes()).unwrap();
    let mut out = Vec::new();
    nodes(tree.before(), text, false, &mut out);
    element(tree.root(), text, &mut out);
    nodes(tree.after(), text, false, &mut out);
    out
}

fn element(element: &Element, text: &str, out: &mut Vec<String>) {
    out.push(std::format!("<{}", element.name));
    out.extend(element.attributes.iter().map(|a| std::format!("{}={}", a.name, a.value)));
    let has_words = element
        .children
        .iter()
        .any(|node| matches!(node, Node::Text(..)) && !written(node, text).trim_ascii().is_empty());
    nodes(&element.children, text, has_words, out);
    out.push(">".into());
}

fn nodes(nodes: &[Node], text: &str, has_words: bool, out: &mut Vec<String>) {
    let first_text = out.len();
    for node in nodes {
        match node {
            Node::Element(inner) => element(inner, text, out),
            Node::Text(..) if !has_words => {}
            // The reader trims the text of a `<check>`, so its outer spaces do not count.
            Node::Text(words, _) => match out.get_mut(first_text..).and_then(|o| o.last_mut()) {
                Some(last) if last.starts_with('\'') => {
                    *last += &lines(words);
                }
                _ => out.push(std::format!("'{}", lines(words).trim_start())),
            },
            node => out.push(lines(written(node, text))),
        }
    }
    if let Some(last) = out.get_mut(first_text..).and_then(|out| out.last_mut())
        && last.starts_with('\'')
    {
        *last = last.trim_end().to_owned();
    }
}

/// Line breaks as XML has them, however they are written.
fn lines(text: &str) -> String {
    text.replace("\r\n", "\n").replace('\r', "\n")
}

fn written<'a>(node: &Node, text: &'a str) -> &'a str {
    &text[node.span().start()..node.span().end()]
}

/// Pieces that any sequence of is put between an example's own.
const PIECES: &[&str] = &[
    " ",
    "\n",
    "\n\n\n",
    "\t",
    "\r\n",
    "\r",
    "<!-- c -->",
    "<!-- a\n  b  -->",
    "<!---->",
    "<?p i?>",
    "<x/>",
    "<x y='1'  z = \"2\" ></x >",
    "<x> </x>",
    "<x>\n<y/></x>",
    "<x>t<y/> </x>",
    "<check> a </check>",
];
/// Pieces that add text to the element that contains them.
const WORDS: &[&str] = &["word", "&lt;", "&#32;", "<![CDATA[ ]]>", "<![CDATA[\r\nx]]>", "\u{a0}"];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    /// Formatting keeps any text between the tags of an example, and a second time changes nothing.
    #[test]
    fn meaning_and_comments_are_kept_and_twice_is_once(
        breaks in any::<bool>(),
        mark in any::<bool>(),
        places in proptest::collection::vec(
            (0.0f64..1.0, proptest::sample::select(PIECES), proptest::sample::select(WORDS), 0u8..8), 0..12),
    ) {
        let mut text = include_str!("everything.xml").to_owned();
        for (at, piece, word, chance) in places {
            let tags: Vec<_> = text.match_indices('<').map(|(at, _)| at).collect();
            let tag = tags[(at * tags.len() as f64) as usize];
            // Neither before the declaration nor into a comment or CDATA.
            let outside = |open: &str, close: &str| {
                text[..tag].rfind(open).is_none_or(|open| text[open..tag].contains(close))
            };
            let inside = text[..tag].contains("<armor") && !text[tag..].starts_with("</armor");
            if tag == 0 || !outside("<!--", "-->") || !outside("<![CDATA[", "]]>") {
                continue;
            }
            let in_root = text[..tag].contains("<armor") && text[tag..].contains("</armor>");
            if inside && in_root && chance == 0 {
                text.insert_str(tag, word);
            } else if in_root || !piece.contains("<x") && !piece.contains("<check") {
                text.insert_str(tag, piece);
            }
        }
        if breaks {
            text = text.replace("\r\n", "\n").replace('\n', "\r\n");
        }
        if mark {
            text.insert(0, '\u{feff}');
        }
        prop_assume!(parse_tree(Path::new(NAME), text.as_bytes()).is_ok());
        let once = formatted(&text);
        prop_assert_eq!(meaning(&text), meaning(&once));
        prop_assert_eq!(formatted(&once), once);
    }
}
