//! What the palette offers to drag into the drawing.

/// What is dragged from the palette.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum DraggedPart {
    /// An empty place.
    Place,
    /// A transition.
    Transition,
    /// A place that activates this component.
    Active(String),
}
