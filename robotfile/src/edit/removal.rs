//! The bytes that are removed with an element.

use std::ops::Range;

use crate::edit::patch::Patches;
use crate::edit::placement::{indentation, line_end, line_start, trailing_blanks};
use crate::source::Source;
use crate::tree::{Element, Node};

/// Removes elements of a parent, given by their numbers.
pub(crate) fn remove(source: &Source, parent: &Element, indices: &[usize], patches: &mut Patches) {
    let text = source.text();
    let goes = |n: usize| indices.contains(&n);
    let leaves_nothing = parent.children.iter().all(|node| match node {
        Node::Element(_) => true,
        Node::Text(..) => text[node.span().start()..node.span().end()].trim().is_empty(),
        _ => false,
    });
    if leaves_nothing && parent.elements().enumerate().all(|(n, _)| goes(n)) {
        patches.replace(parent.tag_span.end() - 1..parent.span.end(), "/>");
        return;
    }
    for (_, element) in parent.elements().enumerate().filter(|(n, _)| goes(*n)) {
        patches.replace(full_extent(text, element.span.start()..element.span.end()), "");
    }
}

/// Takes one element out, to put it elsewhere: the comments directly above it and behind it on its
/// line are removed with it. Returns the removed text, without the indentation of its first line.
pub(crate) fn take(
    source: &Source,
    parent: &Element,
    element: &Element,
    patches: &mut Patches,
) -> String {
    let text = source.text();
    let mut range = element.span.start()..element.span.end();
    let end = line_end(text, parent, range.end);
    if let (Some(_), Some(end)) = (indentation(text, range.start), end) {
        range = first_comment(text, parent, element)..end;
    }
    patches.replace(full_extent(text, range.clone()), "");
    text[range].to_owned()
}

/// Returns where the comments directly above an element begin, each on lines of its own; the
/// element's own start if there are none.
fn first_comment(text: &str, parent: &Element, element: &Element) -> usize {
    let mut first = element.span.start();
    let above = parent.children.iter().rev().skip_while(|node| node.span() != element.span).skip(1);
    for node in above {
        let span = node.span();
        let piece = &text[span.start()..span.end()];
        match node {
            Node::Comment(_) if indentation(text, span.start()).is_some() => first = span.start(),
            Node::Text(..) if piece.trim().is_empty() && piece.matches('\n').count() == 1 => {}
            _ => break,
        }
    }
    first
}

/// Returns the bytes that are removed with a piece: its lines if nothing else is on them, else the
/// space that kept it from its neighbour.
fn full_extent(text: &str, piece: Range<usize>) -> Range<usize> {
    let behind = &text[piece.end..];
    let rest = behind.trim_start_matches([' ', '\t', '\r']);
    match indentation(text, piece.start) {
        Some(_) if rest.starts_with('\n') => {
            line_start(text, piece.start)..text.len() - rest.len() + 1
        }
        Some(_) => piece.start..text.len() - behind.trim_start_matches([' ', '\t']).len(),
        None if behind.starts_with(['<', ' ', '\t', '\r', '\n']) => {
            piece.start - trailing_blanks(&text[..piece.start])..piece.end
        }
        None => piece,
    }
}
