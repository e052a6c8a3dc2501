//! Edits of odd files, with odd names and values: each is made as it was meant or refused, and a
//! refused one has changed nothing.

use std::path::Path;

use armor_robotfile::tree::{Element, Node};
use armor_robotfile::{Document, EditError, Item, NewElement, Position, parse_tree};
use proptest::prelude::*;

/// An element without its form. White space in texts is left out, for there may be more or less of
/// it around an element that is added or removed.
#[derive(Clone, Debug, PartialEq)]
struct Plain {
    name: String,
    attributes: Vec<(String, String)>,
    children: Vec<Plain>,
    text: String,
    others: usize,
}

fn plain(element: &Element) -> Plain {
    let other = |node: &&Node| matches!(node, Node::Comment(_) | Node::Instruction(_));
    Plain {
        name: element.name.clone(),
        attributes: element.attributes.iter().map(|a| (a.name.clone(), a.value.clone())).collect(),
        children: element.elements().map(plain).collect(),
        text: element.text().0.split_whitespace().collect(),
        others: element.children.iter().filter(other).count(),
    }
}

fn at<'a>(root: &'a mut Plain, path: &[usize]) -> Option<&'a mut Plain> {
    path.iter().try_fold(root, |element, n| element.children.get_mut(*n))
}

#[derive(Clone, Debug)]
enum Edit {
    Attribute(String, Option<String>),
    Text(String),
    Insert(usize, NewElement, Plain),
    Remove,
    Move(usize),
}

/// The edit in the document, by path.
fn edit(document: &mut Document, path: &[usize], edit: &Edit) -> Result<(), EditError> {
    match edit {
        Edit::Attribute(name, value) => document.set_attribute_at(path, name, value.as_deref()),
        Edit::Text(text) => document.set_text_at(path, text),
        Edit::Insert(index, new, _) => document.insert_element(path, *index, new),
        Edit::Remove => document.remove_element(path),
        Edit::Move(index) => document.move_element(path, *index),
    }
}

/// The same edit of the plain tree; none if there is no such place in it.
fn edit_plain(root: &mut Plain, path: &[usize], edit: &Edit) -> Option<()> {
    let element = at(root, path)?;
    match edit {
        Edit::Attribute(name, None) => element.attributes.retain(|(known, _)| known != name),
        Edit::Attribute(name, Some(value)) => {
            match element.attributes.iter_mut().find(|(known, _)| known == name) {
                Some((_, old)) => old.clone_from(value),
                None => element.attributes.push((name.clone(), value.clone())),
            }
        }
        Edit::Text(text) => element.text = text.split_whitespace().collect(),
        Edit::Insert(index, _, new) => {
            (*index <= element.children.len()).then_some(())?;
            element.children.insert(*index, new.clone());
        }
        Edit::Remove | Edit::Move(_) => {
            let (from, parent) = path.split_last()?;
            let siblings = &mut at(root, parent)?.children;
            if let Edit::Move(to) = edit
                && *to >= siblings.len()
            {
                return None;
            }
            let taken = siblings.remove(*from);
            if let Edit::Move(to) = edit {
                siblings.insert(*to, taken);
            }
        }
    }
    Some(())
}

const PIECES: &[&str] = &[
    " ",
    "\n",
    "\n\n",
    "\t",
    "\r\n",
    "\r",
    "<!-- c -->",
    "<!--a\n b-->",
    "<?p i?>",
    "<x/>",
    "<x y='1'  z = \"2\" ></x >",
    "<x> </x>",
    "<x>\n\t<y/></x>",
    "<x>t<y/> u</x>",
    "word",
    "&lt;&#65;",
    "<![CDATA[ ]]>",
    "<![CDATA[<x>]]>",
    "\u{a0}",
    "<ns:x ns:y='&quot;'\n  z=''/>",
];
const NAMES: &[&str] =
    &["name", "y", "z", "my:colour", "ä", "a b", "", "1", "a=\"b\" c", "x/", "x>", "-"];

fn value() -> impl Strategy<Value = String> {
    let pieces = &[
        "a", " ", "<", ">", "&", "\"", "'", "]]>", "&lt;", "\n", "\r", "\t", "\u{1}", "\u{fffe}",
        "𝄞", "--", "/>",
    ];
    proptest::collection::vec(proptest::sample::select(&pieces[..]), 0..5)
        .prop_map(|all| all.concat())
}

fn any_edit() -> impl Strategy<Value = Edit> {
    let name = || proptest::sample::select(NAMES).prop_map(String::from);
    let insert =
        (0usize..6, name(), name(), value(), value()).prop_map(|(index, tag, key, value, text)| {
            let child = NewElement::new("child").attribute("n", &*value);
            let new = NewElement::new(&*tag).attribute(&*key, &*value).child(child).text(&*text);
            let child = Plain {
                name: "child".into(),
                attributes: vec![("n".into(), value.clone())],
                children: Vec::new(),
                text: String::new(),
                others: 0,
            };
            let text = text.split_whitespace().collect();
            let plain = Plain {
                name: tag,
                attributes: vec![(key, value)],
                children: vec![child],
                text,
                others: 0,
            };
            Edit::Insert(index, new, plain)
        });
    prop_oneof![
        (name(), proptest::option::of(value()))
            .prop_map(|(name, value)| Edit::Attribute(name, value)),
        value().prop_map(Edit::Text),
        insert,
        Just(Edit::Remove),
        (0usize..6).prop_map(Edit::Move),
    ]
}

/// Puts pieces somewhere between the tags of an example.
fn odd_file(places: &[(f64, &str)]) -> String {
    let mut text =
        include_str!("everything.xml").replace("my:author", "xmlns:ns='urn:ns' my:author");
    for (at, piece) in places {
        let body = text.find("<mission").unwrap();
        let tags: Vec<_> = text[body..].match_indices('<').map(|(at, _)| body + at).collect();
        let tag = tags[(at * tags.len() as f64) as usize];
        text.insert_str(tag, piece);
    }
    text
}

/// An edit to be tried.
type Try<'a> = &'a dyn Fn(&mut Document) -> Result<(), EditError>;

/// Every edit is made as in the plain tree, or changes nothing.
fn check(document: &mut Document, path: &[usize], change: &Edit) {
    let before = document.bytes().to_vec();
    let mut wanted = plain(document.tree().root());
    let expected = edit_plain(&mut wanted, path, change);
    match edit(document, path, change) {
        Ok(()) => {
            assert!(expected.is_some(), "{path:?} {change:?}");
            let mut found = plain(document.tree().root());
            if matches!(change, Edit::Move(_)) {
                // The comments of an element may be in its parent, and move in it.
                (found.others, wanted.others) = (0, 0);
            }
            assert_eq!(found, wanted, "{path:?} {change:?}\n{}", document.tree().source().text());
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            assert_eq!(document.bytes(), before, "{path:?} {change:?}: {error}");
            let odd = |text: &str| text.contains(['\u{1}', '\u{fffe}']);
            let is_odd = match change {
                Edit::Attribute(name, value) => {
                    !["name", "y", "z", "my:colour", "ä"].contains(&name.as_str())
                        || value.as_deref().is_some_and(odd)
                }
                Edit::Text(text) => odd(text),
                Edit::Insert(_, _, new) => {
                    odd(&new.text)
                        || new.attributes.iter().any(|(_, value)| odd(value))
                        || [&new.name, &new.attributes[0].0].iter().any(|name| {
                            !["name", "y", "z", "my:colour", "ä"].contains(&name.as_str())
                        })
                }
                Edit::Remove | Edit::Move(_) => false,
            };
            assert!(expected.is_none() || is_odd, "{path:?} {change:?}: {error}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_edits_of_an_odd_file(
        places in proptest::collection::vec((0.0f64..1.0, proptest::sample::select(PIECES)), 0..10),
        edits in proptest::collection::vec((proptest::collection::vec(0usize..5, 0..4), any_edit()), 1..8),
    ) {
        let text = odd_file(&places);
        let opened = Document::open(Path::new("a.xml"), text.as_bytes());
        prop_assert_eq!(opened.is_ok(), parse_tree(Path::new("a.xml"), text.as_bytes()).is_ok());
        if let Ok(mut document) = opened {
            for (path, change) in &edits {
                check(&mut document, path, change);
            }
        }
    }

    #[test]
    fn any_words_for_any_item(
        places in proptest::collection::vec((0.0f64..1.0, proptest::sample::select(PIECES)), 0..10),
        name in proptest::sample::select(&["laser", "slam", "home", "explore", "weak", "battery", "x", "", "a b", "<"][..]),
        new in proptest::sample::select(&["laser", "home", "new", "", "a.b", "&lt;", "\u{1}"][..]),
        x in any::<f64>(),
    ) {
        let text = odd_file(&places);
        if let Ok(document) = Document::open(Path::new("a.xml"), text.as_bytes()) {
            let link = Item::Link { from: name, to: new };
            for item in [Item::System, Item::Mission, Item::Component(name), link, Item::Place(name), Item::Transition(name), Item::Variable(name)] {
                let tries: [Try<'_>; 7] = [
                    &|d| d.add(item, &[("kind", new)]),
                    &|d| d.rename(item, new),
                    &|d| d.remove(item),
                    &|d| d.set_attribute(item, "name", Some(new)),
                    &|d| d.set_attribute(item, new, Some(name)),
                    &|d| d.set_positions(&[(item, Some(Position { x, y: 0.0 })), (item, None)]),
                    &|d| d.set_parameter(name, new, Some(new)),
                ];
                for change in tries {
                    let mut edited = document.clone();
                    if let Err(error) = change(&mut edited) {
                        prop_assert!(!error.to_string().is_empty());
                        prop_assert_eq!(edited.bytes(), document.bytes());
                    }
                    // What it holds is what reading its bytes gives.
                    prop_assert!(Document::open(Path::new("a.xml"), edited.bytes()).is_ok());
                    let _ = edited.position(item);
                }
            }
        }
    }
}

#[test]
fn a_file_that_is_not_xml_is_not_opened() {
    for text in [
        "",
        "<a",
        "<a></b>",
        "<a b='1' b='2'/>",
        "<a>&x;</a>",
        "<!DOCTYPE a><a/>",
        "\u{feff}\u{feff}<a/>",
    ] {
        assert!(Document::open(Path::new("a.xml"), text.as_bytes()).is_err(), "{text}");
    }
    assert!(Document::open(Path::new("a.xml"), b"<a>\xff</a>").is_err());
}

#[test]
fn limits_apply_to_edits() {
    let deep = "<a>".repeat(32) + &"</a>".repeat(32);
    let mut document = Document::open(Path::new("a.xml"), deep.as_bytes()).unwrap();
    let error = document.insert_element(&[0; 31], 0, &NewElement::new("x")).unwrap_err();
    assert!(error.to_string().contains("E0006"), "{error}");
    let attributes: String = (0..64).map(|n| format!(" a{n}=''")).collect();
    let mut document =
        Document::open(Path::new("a.xml"), format!("<a{attributes}/>").as_bytes()).unwrap();
    let error = document.set_attribute_at(&[], "b", Some("")).unwrap_err();
    assert!(error.to_string().contains("E0007"), "{error}");
}
