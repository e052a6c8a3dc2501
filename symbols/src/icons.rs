//! The table of icons: a text file, one line for each, with code, name and drawing.

use std::sync::LazyLock;

use crate::code::SymbolSet;
use crate::drawing::{DrawingError, read_drawing};
use crate::frame::FrameGroup;
use crate::outline::SymbolShape;

/// One icon of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Icon {
    /// Symbol set and entity as eight digits.
    pub code: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Scheme, dimension and function of the older code, if it has one.
    letters: Option<[&'static str; 3]>,
    drawing: &'static str,
}

static ICONS: LazyLock<Vec<Icon>> = LazyLock::new(|| {
    let mut icons: Vec<Icon> = include_str!("icons.txt").lines().filter_map(read_line).collect();
    icons.sort_by_key(|icon| icon.code);
    icons
});

fn read_line(line: &'static str) -> Option<Icon> {
    if line.starts_with('#') {
        return None;
    }
    let mut fields = line.splitn(4, '|').map(str::trim);
    let (code, letters) = (fields.next()?, fields.next()?);
    let (name, drawing) = (fields.next()?, fields.next()?);
    let mut words = letters.split_ascii_whitespace();
    let letters = match (words.next(), words.next(), words.next()) {
        (Some(scheme), Some(dimension), Some(function)) => Some([scheme, dimension, function]),
        _ => None,
    };
    Some(Icon { code, name, letters, drawing })
}

impl Icon {
    /// All icons, in the order of their codes.
    pub fn all() -> &'static [Icon] {
        &ICONS
    }

    /// The icon of an entity in a symbol set.
    pub fn find(set: SymbolSet, entity: u32) -> Option<&'static Icon> {
        Self::of_code(&format!("{:02}{entity:06}", set.digits()))
    }

    fn of_code(code: &str) -> Option<&'static Icon> {
        ICONS.binary_search_by_key(&code, |icon| icon.code).ok().map(|index| &ICONS[index])
    }

    /// Its shapes, in a frame of this group.
    pub(crate) fn shapes(&self, group: FrameGroup) -> Result<Vec<SymbolShape>, DrawingError> {
        let Some(same) = self.drawing.strip_prefix('=') else {
            return read_drawing(self.drawing, group);
        };
        let (code, more) = same.split_once(';').unwrap_or((same, ""));
        // A drawing refers only to one that is written out.
        let base = Self::of_code(code.trim()).map_or("", |icon| icon.drawing);
        let mut shapes = read_drawing(base, group)?;
        shapes.extend(read_drawing(more, group)?);
        Ok(shapes)
    }
}

/// The set and entity of an older code's scheme, dimension and function.
pub(crate) fn entity_of_letters(
    scheme: char,
    dimension: char,
    function: &str,
) -> Option<(SymbolSet, u32)> {
    let icon = ICONS.iter().find(|icon| {
        icon.letters.is_some_and(|[of_scheme, of_dimension, of_function]| {
            of_function == function
                && of_scheme.starts_with(scheme)
                && (of_dimension == "-" || of_dimension.starts_with(dimension))
        })
    })?;
    let set = icon.code[..2].parse().ok()?;
    let set = *SymbolSet::ALL.iter().find(|known| known.digits() == set)?;
    Some((set, icon.code[2..].parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUPS: [FrameGroup; 4] =
        [FrameGroup::Unknown, FrameGroup::Friend, FrameGroup::Neutral, FrameGroup::Hostile];

    #[test]
    fn every_line_of_the_table_is_an_icon_that_can_be_drawn() {
        let lines = include_str!("icons.txt")
            .lines()
            .filter(|line| !line.starts_with('#') && !line.trim().is_empty());
        assert_eq!(lines.count(), Icon::all().len());
        for icon in Icon::all() {
            assert!(icon.code.len() == 8 && icon.code.parse::<u32>().is_ok(), "{}", icon.code);
            for group in GROUPS {
                let shapes = icon.shapes(group).expect(icon.code);
                assert!(!shapes.is_empty(), "{} {group:?}", icon.code);
            }
        }
    }

    #[test]
    fn codes_and_older_codes_are_unique() {
        for pair in Icon::all().windows(2) {
            assert!(pair[0].code < pair[1].code, "{}", pair[1].code);
        }
        let mut letters: Vec<_> = Icon::all().iter().filter_map(|icon| icon.letters).collect();
        let count = letters.len();
        letters.sort_unstable();
        letters.dedup();
        assert_eq!(letters.len(), count);
    }

    #[test]
    fn a_reference_names_a_drawing_that_is_written_out() {
        for icon in Icon::all() {
            if let Some(code) = icon.drawing.strip_prefix('=').and_then(|same| same.get(..8)) {
                let base = Icon::of_code(code).expect(code);
                assert!(!base.drawing.starts_with('='), "{}", icon.code);
            }
        }
    }

    #[test]
    fn the_table_covers_every_kind_of_robot() {
        for (set, entity) in [
            (SymbolSet::Air, 110_300),
            (SymbolSet::LandUnit, 121_900),
            (SymbolSet::SeaSurface, 120_700),
            (SymbolSet::SeaSubsurface, 110_400),
        ] {
            let name = Icon::find(set, entity).map(|icon| icon.name).unwrap_or_default();
            assert!(name.contains("Unmanned"), "{name}");
        }
        assert!(Icon::all().len() >= 70);
    }
}
