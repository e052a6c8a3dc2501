//! A symbol: its code, what it means, and its shapes from frame to amplifiers.

use std::fmt;

use crate::amplifiers::amplifiers;
use crate::code::{CodeError, StandardIdentity, SymbolCode, SymbolSet, SymbolStatus};
use crate::control::ControlMeasure;
use crate::frame::{Frame, FrameGroup};
use crate::icons::Icon;
use crate::letters::read_letters;
use crate::outline::{PaintRole, Position, SymbolShape, polyline};
use crate::svg::svg_of;

/// A symbol that was read from its code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    /// What the code specifies.
    pub code: SymbolCode,
}

/// A part of a code that is valid but has no drawing here; the rest of the symbol is drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SymbolFinding {
    /// The table of icons has no such entity.
    UnknownIcon {
        /// Symbol set and entity, as eight digits.
        code: String,
    },
    /// The function of an older code corresponds to no entity of the table.
    UnknownFunction {
        /// Its six letters.
        function: String,
    },
    /// A modifier that is not drawn.
    UnknownModifier {
        /// Where its digits begin.
        position: usize,
        /// Its digits.
        modifier: u8,
    },
}

impl fmt::Display for SymbolFinding {
    fn fmt(&self, text: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownIcon { code } => write!(
                text,
                "no icon for {code} (symbol set and entity, positions 5, 6 and 11 to 16): only the frame is drawn; symbols/README.md lists the icons"
            ),
            Self::UnknownFunction { function } => write!(
                text,
                "no icon for the function {function} (positions 5 to 10): only the frame is drawn; use a code of 20 digits, or a function of symbols/src/icons.txt"
            ),
            Self::UnknownModifier { position, modifier } => write!(
                text,
                "modifier {modifier:02} at position {position} is not drawn; 00 leaves it out"
            ),
        }
    }
}

/// The modifier of equipment that drives without a crew (digits 19 and 20).
const ROBOTIC: u8 = 9;

impl SymbolCode {
    /// Reads a code of 20 digits or 15 letters.
    ///
    /// # Errors
    /// If it has another length, a character that cannot stand at its position, or a value that
    /// the standard does not define. An entity or modifier that is not known is no error.
    pub fn parse(code: &str) -> Result<Self, CodeError> {
        match code.chars().count() {
            20 => Self::of_digits(code),
            15 => read_letters(code),
            found => Err(CodeError::Length { found }),
        }
    }
}

impl Symbol {
    /// Reads a code of 20 digits or 15 letters.
    ///
    /// # Errors
    /// As [`SymbolCode::parse`]: an entity that is not known is a finding, not an error.
    pub fn parse(code: &str) -> Result<Self, CodeError> {
        SymbolCode::parse(code).map(|code| Self { code })
    }

    /// The name of the icon or control measure; "Unknown" if there is none.
    pub fn name(&self) -> &'static str {
        match (self.icon(), self.measure(), self.code.entity) {
            (Some(icon), _, _) => icon.name,
            (_, Some(measure), _) => measure.name,
            (_, _, 0) => "Unspecified",
            _ => "Unknown",
        }
    }

    fn icon(&self) -> Option<&'static Icon> {
        Icon::find(self.code.set, self.code.entity)
    }

    /// The control measure of the code, if it is one that is known.
    pub fn measure(&self) -> Option<&'static ControlMeasure> {
        (self.code.set == SymbolSet::ControlMeasure)
            .then(|| ControlMeasure::of_entity(self.code.entity))
            .flatten()
    }

    /// What is not drawn, and why.
    pub fn findings(&self) -> Vec<SymbolFinding> {
        let code = &self.code;
        let mut findings = Vec::new();
        if let Some(function) = &code.unknown_function {
            findings.push(SymbolFinding::UnknownFunction { function: function.clone() });
        } else if code.entity != 0 && self.icon().is_none() && self.measure().is_none() {
            let code = format!("{:02}{:06}", code.set.digits(), code.entity);
            findings.push(SymbolFinding::UnknownIcon { code });
        }
        if code.upper_modifier != 0 {
            let modifier = code.upper_modifier;
            findings.push(SymbolFinding::UnknownModifier { position: 17, modifier });
        }
        if code.lower_modifier != 0 && !self.is_robotic() {
            let modifier = code.lower_modifier;
            findings.push(SymbolFinding::UnknownModifier { position: 19, modifier });
        }
        findings
    }

    fn is_robotic(&self) -> bool {
        self.code.set == SymbolSet::LandEquipment && self.code.lower_modifier == ROBOTIC
    }

    /// Its shapes in units of the octagon ([`crate::OCTAGON`]), from back to front. A control
    /// measure is drawn over an example of its positions.
    pub fn shapes(&self) -> Vec<SymbolShape> {
        if let Some(measure) = self.measure() {
            return measure.example(self.code.status == SymbolStatus::Planned);
        }
        let mut shapes = Vec::new();
        let frame = Frame::of(&self.code);
        if let Some(frame) = &frame {
            shapes.extend(frame.shapes(&self.code));
        }
        shapes.extend(self.icon_shapes());
        if self.is_robotic() {
            shapes.push(robotic_mark());
        }
        let octagon = ([[-120.0, -120.0], [120.0, 120.0]], [-120.0, 0.0]);
        let (extent, left_foot) =
            frame.map_or(octagon, |frame| (frame.extent(), frame.left_foot()));
        shapes.extend(amplifiers(&self.code, extent, left_foot));
        shapes
    }

    /// The shapes of the icon alone, without frame and amplifiers.
    pub fn icon_shapes(&self) -> Vec<SymbolShape> {
        let group = FrameGroup::of(self.code.identity);
        // The tests of the table draw every icon in every frame, so none is left out here.
        self.icon().and_then(|icon| icon.shapes(group).ok()).unwrap_or_default()
    }

    /// The smallest and largest coordinates of all shapes.
    pub fn bounds(&self) -> [Position; 2] {
        let mut bounds = [[-120.0, -120.0], [120.0, 120.0]];
        for [low, high] in self.shapes().iter().filter_map(SymbolShape::bounds) {
            for axis in 0..2 {
                bounds[0][axis] = f64::min(bounds[0][axis], low[axis]);
                bounds[1][axis] = f64::max(bounds[1][axis], high[axis]);
            }
        }
        bounds
    }

    /// The standard's colour of a role, as red, green and blue.
    pub fn color(&self, role: PaintRole) -> [u8; 3] {
        match role {
            PaintRole::FrameFill => self.frame_color(),
            PaintRole::FrameLine | PaintRole::Icon => [0, 0, 0],
            PaintRole::IconFill => [255, 255, 255],
            PaintRole::Condition => match self.code.status {
                SymbolStatus::FullToCapacity => [0, 0, 255],
                SymbolStatus::Damaged => [255, 255, 0],
                SymbolStatus::Destroyed => [255, 0, 0],
                _ => [0, 255, 0],
            },
        }
    }

    fn frame_color(&self) -> [u8; 3] {
        let hostile =
            matches!(self.code.identity, StandardIdentity::Hostile | StandardIdentity::Suspect);
        if self.code.is_civilian() && !hostile {
            return [255, 161, 255];
        }
        match FrameGroup::of(self.code.identity) {
            FrameGroup::Unknown => [255, 255, 128],
            FrameGroup::Friend => [128, 224, 255],
            FrameGroup::Neutral => [170, 255, 170],
            FrameGroup::Hostile => [255, 128, 128],
        }
    }

    /// The symbol as an SVG image that fits it.
    pub fn to_svg(&self) -> String {
        svg_of(&self.shapes(), self.bounds(), |role| self.color(role))
    }
}

/// A shallow chevron in the lower part of the octagon, as the icons of unmanned vehicles have.
fn robotic_mark() -> SymbolShape {
    let positions =
        [[-50.0, 64.0], [0.0, 84.0], [50.0, 64.0], [50.0, 76.0], [0.0, 100.0], [-50.0, 76.0]];
    SymbolShape::filled(polyline(&positions, true), PaintRole::Icon)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_icon_is_a_frame_with_a_finding() {
        let symbol = Symbol::parse("10031000009999990000").expect("its shape is valid");
        assert_eq!(symbol.shapes().len(), 1);
        let findings = symbol.findings();
        assert_eq!(findings, [SymbolFinding::UnknownIcon { code: "10999999".into() }]);
        assert!(findings[0].to_string().contains("only the frame"));
    }

    #[test]
    fn a_robot_on_the_ground_is_a_vehicle_with_its_mark() {
        let crewed = Symbol::parse("10031500001401000000").expect("it is valid");
        let robot = Symbol::parse("10031500001401000009").expect("it is valid");
        assert_eq!(robot.shapes().len(), crewed.shapes().len() + 1);
        assert!(robot.findings().is_empty());
        let other = Symbol::parse("10031500001401000302").expect("its shape is valid");
        assert_eq!(other.findings().len(), 2);
    }

    #[test]
    fn civilians_have_their_own_colour_unless_they_are_hostile() {
        let fill = |code: &str| Symbol::parse(code).expect(code).color(PaintRole::FrameFill);
        assert_eq!(fill("10041500001601000000"), [255, 161, 255]);
        assert_eq!(fill("10061500001601000000"), [255, 128, 128]);
        assert_eq!(fill("10031500001401000000"), [128, 224, 255]);
    }
}
