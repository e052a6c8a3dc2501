//! Edits change their lines and no others, and what they write reads as it was meant.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use armor_missions::{Document, EditError, Item, NewElement};

/// A document of this text.
fn open(text: &str) -> Document {
    Document::open(Path::new("a.xml"), text.as_bytes()).unwrap()
}

fn text(document: &Document) -> &str {
    std::str::from_utf8(document.bytes()).unwrap()
}

/// `edit` makes `after` of `before`.
fn check(
    before: &str,
    edit: impl FnOnce(&mut Document) -> Result<(), EditError>,
    after: &str,
) -> Document {
    let mut document = open(before);
    edit(&mut document).unwrap();
    assert_eq!(text(&document), after);
    document
}

#[test]
fn a_parameter_is_set_added_and_removed_in_its_line() {
    let before = "<armor version='1'>\r\n\t<system>\r\n\t\t<!-- why -->\r\n\t\t<component name='a' kind='k'/> <!-- here -->\r\n\t</system>\r\n</armor>\r\n";
    let with = before.replace(
        "kind='k'/> <!--",
        "kind='k'>\r\n\t\t\t<parameter name=\"speed\" value=\"1m/s\"/>\r\n\t\t</component> <!--",
    );
    let mut document = check(before, |d| d.set_parameter("a", "speed", Some("1m/s")), &with);
    document.set_parameter("a", "speed", Some("1m/s")).unwrap();
    assert_eq!(text(&document), with);
    let other = with.replace("1m/s", "a&lt;b &amp; &quot;c&quot;&#10;'d'");
    document.set_parameter("a", "speed", Some("a<b & \"c\"\n'd'")).unwrap();
    assert_eq!(text(&document), other);
    document.set_parameter("a", "speed", None).unwrap();
    assert_eq!(text(&document), before);
}

#[test]
fn an_element_is_put_where_its_neighbours_are() {
    let new = || NewElement::new("x").attribute("n", "1");
    for (before, index, after) in [
        ("<a/>", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a />", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a></a>", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a>\n</a>", 0, "<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a>\n   <!-- c -->\n</a>", 0, "<a>\n   <!-- c -->\n   <x n=\"1\"/>\n</a>"),
        ("<a>\n <b/> <!-- c -->\n</a>", 1, "<a>\n <b/> <!-- c -->\n <x n=\"1\"/>\n</a>"),
        (
            "<a> <!-- of a -->\n <!-- of b -->\n <b/>\n</a>",
            0,
            "<a> <!-- of a -->\n <x n=\"1\"/>\n <!-- of b -->\n <b/>\n</a>",
        ),
        (
            "<a>\n <b/>\n\n <!-- of c -->\n <c/>\n</a>",
            1,
            "<a>\n <b/>\n <x n=\"1\"/>\n\n <!-- of c -->\n <c/>\n</a>",
        ),
        ("<a><b/><c/></a>", 1, "<a><b/><x n=\"1\"/><c/></a>"),
        ("<a> <b/> <c/> </a>", 2, "<a> <b/> <c/> <x n=\"1\"/> </a>"),
        ("<a> <b/> <c/> </a>", 0, "<a> <x n=\"1\"/> <b/> <c/> </a>"),
        ("\u{feff}<a/>", 0, "\u{feff}<a>\n  <x n=\"1\"/>\n</a>"),
        ("<a>text</a>", 0, "<a>text<x n=\"1\"/></a>"),
    ] {
        check(before, |d| d.insert_element(&[], index, &new()), after);
    }
}

#[test]
fn what_is_not_there_is_said() {
    let mut document = open("<armor version=\"1\"><system/></armor>");
    let error = document.set_parameter("laser", "x", Some("1")).unwrap_err();
    assert_eq!(error.to_string(), "there is no component laser in a.xml");
    assert!(document.find(Item::Mission).is_none());
}
