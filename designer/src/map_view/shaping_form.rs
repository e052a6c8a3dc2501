//! The numbers for what is done with the selection, as they are typed.

/// The numbers that are typed.
#[derive(Clone, Debug)]
pub struct ShapingForm {
    pub(super) move_by: String,
    pub(super) rotate_by: String,
    pub(super) mirror_across: String,
    pub(super) offset_by: String,
    pub(super) spacing: String,
    pub(super) direction: String,
    pub(super) inset: String,
    pub(super) width: String,
}

impl Default for ShapingForm {
    fn default() -> Self {
        let text = str::to_owned;
        Self {
            move_by: String::new(),
            rotate_by: text("90deg"),
            mirror_across: text("x"),
            offset_by: text("0.5m"),
            spacing: text("1m"),
            direction: text("0deg"),
            inset: text("0.5m"),
            width: text("3m"),
        }
    }
}
