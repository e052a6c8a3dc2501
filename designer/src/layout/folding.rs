//! Folding a group: its element in the file gets `folded="true"` and contains the blocks, groups and
//! notes that it hides, so that nothing else is hidden that is placed where they were.

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, ElementEdit, Item as Named};

use super::{decorations, gone, owner, path_of};
use crate::fragment::same_element;
use crate::project::Refused;
use crate::view::View;

/// Folds a group of the system with the blocks of these components, and these groups and notes.
/// Returns the number of the group from then on.
///
/// # Errors
/// If the group or a block does not exist.
pub fn fold(
    document: &mut Document,
    number: usize,
    components: &[String],
    inner: &[usize],
) -> Result<usize, Refused> {
    let view = View::System;
    let group = path_of(document, view, number).ok_or_else(gone)?;
    if document.tree().element(&group).is_none_or(|element| element.name != "group") {
        return Err(Refused::Rule("only a group can be folded".into()));
    }
    let blocks = components.iter().map(|name| block_path(document, name));
    let decorations = inner.iter().map(|number| path_of(document, view, *number));
    let paths = blocks.chain(decorations).map(|path| path.ok_or_else(gone));
    let mut paths = paths.collect::<Result<Vec<_>, _>>()?;
    paths.sort();
    // What is inside another moved element moves with it.
    let all = paths.clone();
    paths.retain(|path| !all.iter().any(|outer| path != outer && path.starts_with(outer)));
    let elements = paths.iter().filter_map(|path| document.tree().element(path));
    let moved: Vec<_> = elements.map(same_element).collect();
    let mut edits: Vec<_> = paths.iter().cloned().map(ElementEdit::Removal).collect();
    let folded = Some("true".to_owned());
    edits.push(ElementEdit::Attribute { path: group.clone(), name: "folded", value: folded });
    document.edit_elements(&edits)?;
    // Where the group is without what stood before it.
    let mut after = group.clone();
    for path in &paths {
        let depth = path.len() - 1;
        if group.len() > depth && path[..depth] == group[..depth] && path[depth] < group[depth] {
            after[depth] -= 1;
        }
    }
    let count = document.tree().element(&after).map_or(0, |group| group.elements().count());
    document.insert_elements(&after, count, &moved)?;
    number_at(document, &after).ok_or_else(gone)
}

/// Unfolds a group of the system: what it hides follows it in the file. Returns its number from then
/// on.
///
/// # Errors
/// If the group does not exist.
pub fn unfold(document: &mut Document, number: usize) -> Result<usize, Refused> {
    let group = path_of(document, View::System, number).ok_or_else(gone)?;
    let element = document.tree().element(&group).ok_or_else(gone)?;
    let moved: Vec<_> = element.elements().map(same_element).collect();
    let child = |n| ElementEdit::Removal([&group[..], &[n]].concat());
    let mut edits: Vec<_> = (0..moved.len()).map(child).collect();
    edits.push(ElementEdit::Attribute { path: group.clone(), name: "folded", value: None });
    document.edit_elements(&edits)?;
    let (last, parent) = group.split_last().ok_or_else(gone)?;
    document.insert_elements(parent, last + 1, &moved)?;
    number_at(document, &group).ok_or_else(gone)
}

/// The number of the group or note at a path.
fn number_at(document: &Document, path: &[usize]) -> Option<usize> {
    let owner = document.find(owner(View::System))?;
    let inside = path.strip_prefix(&owner[..])?;
    let all = decorations(document.tree().element(&owner)?);
    all.iter().position(|(path, _)| path == inside)
}

/// Where the block of a component is.
fn block_path(document: &Document, name: &str) -> Option<Vec<usize>> {
    let mut path = document.find(Named::System)?;
    let system = document.tree().element(&path)?;
    let layouts = system.elements().enumerate().filter(|(_, part)| part.name == "layout");
    let inside = layouts.into_iter().find_map(|(n, layout)| {
        let inside = find_block(layout, name)?;
        Some([&[n][..], &inside].concat())
    })?;
    path.extend(inside);
    Some(path)
}

/// The recursion is bounded by the depth of the tree.
fn find_block(parent: &Element, name: &str) -> Option<Vec<usize>> {
    parent.elements().enumerate().find_map(|(n, element)| {
        let of = element.attribute("of").filter(|_| element.name == "block");
        if of.is_some_and(|of| of.value == name) {
            return Some(vec![n]);
        }
        Some([&[n][..], &find_block(element, name)?].concat())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::read;

    const FILE: &str = r#"<armor version="1">
  <system>
    <component name="eye" kind="k"/>
    <component name="arm" kind="k"/>
    <component name="leg" kind="k"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <note x="5" y="5" width="50" height="20">Wash &lt;it&gt;.</note>
      <group title="Inner" x="4" y="4" width="60" height="30"/>
      <group title="Senses" x="-10" y="-10" width="300" height="200"/>
      <block of="arm" x="100" y="0"/>
      <block of="leg" x="900" y="0"/>
    </layout>
  </system>
</armor>
"#;

    fn document() -> Document {
        Document::open("a.xml".as_ref(), FILE.as_bytes()).unwrap()
    }

    #[test]
    fn a_folded_group_contains_what_it_hides() {
        let mut document = document();
        let members = ["eye".to_owned(), "arm".to_owned()];
        assert_eq!(fold(&mut document, 2, &members, &[0, 1]).unwrap(), 0);
        let text = std::str::from_utf8(document.bytes()).unwrap();
        let expected = r#"    <layout>
      <group title="Senses" x="-10" y="-10" width="300" height="200" folded="true">
        <block of="eye" x="0" y="0"/>
        <note x="5" y="5" width="50" height="20">Wash &lt;it>.</note>
        <group title="Inner" x="4" y="4" width="60" height="30"/>
        <block of="arm" x="100" y="0"/>
      </group>
      <block of="leg" x="900" y="0"/>
    </layout>
"#;
        assert!(text.contains(expected), "{text}");
        let layout = read(&document, View::System);
        let [group] = &layout.folded[..] else { panic!("{:?}", layout.folded) };
        assert_eq!((group.number, &group.inner[..]), (0, &[1, 2][..]));
        assert_eq!(group.members, ["eye", "arm"]);
        assert_eq!(layout.blocks.len(), 3);
    }

    #[test]
    fn unfolding_puts_all_back_into_the_layout() {
        let mut document = document();
        let before = read(&document, View::System);
        let number = fold(&mut document, 2, &["arm".to_owned()], &[1]).unwrap();
        let note = fold(&mut document, 0, &[], &[number]);
        assert_eq!(note.unwrap_err().to_string(), "only a group can be folded");
        let number = unfold(&mut document, number).unwrap();
        let after = read(&document, View::System);
        assert_eq!(after.decorations[number].text, "Senses");
        assert_eq!(after.blocks, before.blocks);
        assert!(after.folded.is_empty());
        let texts = |layout: &crate::layout::Layout| {
            let mut texts: Vec<_> =
                layout.decorations.iter().map(|it| (it.text.clone(), it.is_note)).collect();
            texts.sort();
            texts
        };
        assert_eq!(texts(&after), texts(&before));
    }

    #[test]
    fn what_a_folded_group_hides_moves_with_it() {
        let mut document = document();
        let members = ["eye".to_owned(), "arm".to_owned()];
        let number = fold(&mut document, 2, &members, &[0]).unwrap();
        let item = crate::item::Item::Decoration { view: View::System, number };
        let to = eframe::egui::Pos2::new(90.0, 190.0);
        crate::layout::place(&mut document, View::System, &[(item, to)]).unwrap();
        let layout = read(&document, View::System);
        assert_eq!(layout.blocks["eye"], eframe::egui::Pos2::new(100.0, 200.0));
        assert_eq!(layout.blocks["arm"], eframe::egui::Pos2::new(200.0, 200.0));
        assert_eq!(layout.blocks["leg"], eframe::egui::Pos2::new(900.0, 0.0));
        let note = layout.decorations.iter().find(|it| it.is_note).unwrap();
        assert_eq!(note.rect.min, eframe::egui::Pos2::new(105.0, 205.0));
    }
}
