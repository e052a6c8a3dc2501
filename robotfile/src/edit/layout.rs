//! Where the designer shows things: one `<block>` for each, in the `<layout>` of the system or the
//! mission that it belongs to.

use crate::edit::attribute;
use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::Item;
use crate::edit::new_element::NewElement;
use crate::edit::patch::Patches;
use crate::edit::removing::RemovedElements;
use crate::tree::Element;

/// Farthest from the origin; digits beyond would be noise.
const MAX_COORDINATE: f64 = 1e9;

/// A point of a drawing, in the designer's units: `x` to the right, `y` down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// To the right.
    pub x: f64,
    /// Down.
    pub y: f64,
}

impl Document {
    /// Returns the position of an item in the designer, if the file has one.
    pub fn position(&self, item: Item<'_>) -> Option<Position> {
        let (_, block) = self.block(item)?;
        let number = |name| block.attribute(name)?.value.trim().parse().ok();
        let position = Position { x: number("x")?, y: number("y")? };
        (position.x.is_finite() && position.y.is_finite()).then_some(position)
    }

    /// Shows components, places and transitions at these positions, also those that are derived from
    /// a route, as one edit; `None` forgets where. Positions are kept to a hundredth. Each moved block is one line of the file.
    ///
    /// # Errors
    /// If an item is missing or of a kind that is not shown, or a position is not finite or farther
    /// than 10⁹ away.
    pub fn set_positions(
        &mut self,
        positions: &[(Item<'_>, Option<Position>)],
    ) -> Result<(), EditError> {
        let mut draft = self.clone();
        let mut patches = Patches::default();
        let mut gone = RemovedElements::default();
        let (mut in_system, mut in_mission) = (Vec::new(), Vec::new());
        for (n, (item, position)) in positions.iter().enumerate() {
            // What is derived from a route has no element, but a place in the drawing.
            if self.derivation(*item).is_none() {
                self.path_of(*item)?;
            }
            let key = block_key(*item)?;
            let written = position.map(format_position).transpose()?;
            if positions[n + 1..].iter().any(|(later, _)| later == item) {
                continue;
            }
            match (self.block(*item), written) {
                (Some((_, block)), Some(written)) => {
                    for (name, value) in written {
                        attribute::set(self.source(), block, name, Some(&value), &mut patches)?;
                    }
                }
                (None, Some([x, y])) => {
                    let new = NewElement::new("block").attribute(key, item.name().unwrap_or(""));
                    let new = new.attribute(x.0, x.1).attribute(y.0, y.1);
                    let is_component = matches!(item, Item::Component(_));
                    if is_component { &mut in_system } else { &mut in_mission }.push(new);
                }
                (Some((parent, block)), None) => {
                    let index = parent.elements().position(|e| e.span == block.span);
                    gone.add(parent, index.unwrap_or_default());
                }
                (None, None) => {}
            }
        }
        gone.remove(self.source(), &mut patches);
        draft.apply(patches)?;
        // A layout that lost its last block is an empty element by now.
        let mut patches = Patches::default();
        draft.add_blocks(Item::System, in_system, &mut patches)?;
        draft.add_blocks(Item::Mission, in_mission, &mut patches)?;
        draft.apply(patches)?;
        *self = draft;
        Ok(())
    }

    /// Puts new blocks into the layout of the system or the mission, with a layout if there is none.
    fn add_blocks(
        &self,
        owner: Item<'_>,
        blocks: Vec<NewElement>,
        patches: &mut Patches,
    ) -> Result<(), EditError> {
        if blocks.is_empty() {
            return Ok(());
        }
        let mut path = self.path_of(owner)?;
        let parent = self.element(&path)?;
        match parent.elements().position(|element| element.name == "layout") {
            Some(layout) => {
                path.push(layout);
                let count = self.element(&path)?.elements().count();
                self.insert(&path, count, &blocks, patches)
            }
            None => {
                let layout = blocks.into_iter().fold(NewElement::new("layout"), NewElement::child);
                self.insert_sorted(&path, &layout, patches)
            }
        }
    }

    /// The first block of an item, and the element around it.
    fn block(&self, item: Item<'_>) -> Option<(&Element, &Element)> {
        let owner = if matches!(item, Item::Component(_)) { Item::System } else { Item::Mission };
        let owner = self.tree().element(&self.find(owner)?)?;
        let (key, name) = (block_key(item).ok()?, item.name()?);
        let is_it = |block: &Element| {
            block.name == "block" && block.attribute(key).is_some_and(|given| given.value == name)
        };
        owner
            .elements()
            .filter(|e| e.name == "layout")
            .find_map(|layout| find_block(layout, &is_it))
    }
}

/// Recursion is bounded by the tree's depth.
fn find_block<'a>(
    parent: &'a Element,
    is_it: &impl Fn(&Element) -> bool,
) -> Option<(&'a Element, &'a Element)> {
    parent.elements().find_map(|element| {
        if is_it(element) { Some((parent, element)) } else { find_block(element, is_it) }
    })
}

/// Returns the attribute of a block that names its item. Places and transitions may share a name.
fn block_key(item: Item<'_>) -> Result<&'static str, EditError> {
    match item {
        Item::Component(_) | Item::Place(_) => Ok("of"),
        Item::Transition(_) => Ok("transition"),
        _ => Err(EditError::NotShown { what: item.to_string() }),
    }
}

fn format_position(position: Position) -> Result<[(&'static str, String); 2], EditError> {
    let number = |value: f64| {
        let near = value.abs() <= MAX_COORDINATE;
        // Adding zero makes -0 a 0.
        near.then(|| ((value * 100.0).round() / 100.0 + 0.0).to_string())
    };
    match (number(position.x), number(position.y)) {
        (Some(x), Some(y)) => Ok([("x", x), ("y", y)]),
        _ => Err(EditError::BadPosition),
    }
}
