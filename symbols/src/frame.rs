//! Frames: the shape shows identity and dimension. Sizes follow the octagon of the standard: the
//! rectangle is 1.5 octagons wide, the square 1.1, the diamond 1.44, the circle 1.2.

use crate::code::{StandardIdentity, SymbolCode, SymbolSet, SymbolStatus};
use crate::outline::{
    PaintRole, PathStep, Position, ShapeLine, SymbolShape, arc, ellipse, polyline, rectangle,
};

/// The width of a frame's line.
pub(crate) const LINE: f64 = 5.0;

/// The four shapes of frames; pending and unknown share one, and so on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrameGroup {
    Unknown,
    Friend,
    Neutral,
    Hostile,
}

impl FrameGroup {
    pub(crate) fn of(identity: StandardIdentity) -> Self {
        match identity {
            StandardIdentity::Pending | StandardIdentity::Unknown => Self::Unknown,
            StandardIdentity::AssumedFriend | StandardIdentity::Friend => Self::Friend,
            StandardIdentity::Neutral => Self::Neutral,
            StandardIdentity::Suspect | StandardIdentity::Hostile => Self::Hostile,
        }
    }

    /// The letter of the group in the table of icons.
    pub(crate) fn letter(self) -> char {
        match self {
            Self::Unknown => 'u',
            Self::Friend => 'f',
            Self::Neutral => 'n',
            Self::Hostile => 'h',
        }
    }
}

/// What the frame's shape shows of the dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FrameKind {
    Unit,
    /// Equipment and ships: as units, but a circle for friends.
    Equipment,
    Installation,
    Activity,
    Air,
    Space,
    Subsurface,
}

impl FrameKind {
    /// The kind of a symbol set; control measures and weather have no frame.
    fn of(set: SymbolSet) -> Option<Self> {
        Some(match set {
            SymbolSet::LandUnit
            | SymbolSet::LandCivilian
            | SymbolSet::DismountedIndividual
            | SymbolSet::SignalsLand
            | SymbolSet::Cyberspace => Self::Unit,
            SymbolSet::LandEquipment
            | SymbolSet::SeaSurface
            | SymbolSet::SignalsSurface
            | SymbolSet::Unknown => Self::Equipment,
            SymbolSet::LandInstallation => Self::Installation,
            SymbolSet::Activity => Self::Activity,
            SymbolSet::Air | SymbolSet::AirMissile | SymbolSet::SignalsAir => Self::Air,
            SymbolSet::Space | SymbolSet::SpaceMissile | SymbolSet::SignalsSpace => Self::Space,
            SymbolSet::SeaSubsurface | SymbolSet::MineWarfare | SymbolSet::SignalsSubsurface => {
                Self::Subsurface
            }
            SymbolSet::ControlMeasure
            | SymbolSet::Atmospheric
            | SymbolSet::Oceanographic
            | SymbolSet::MeteorologicalSpace => return None,
        })
    }
}

/// A frame: its outline, and the filled marks at it (bar, cap, corners).
pub(crate) struct Frame {
    outline: Vec<PathStep>,
    marks: Vec<Vec<PathStep>>,
}

impl Frame {
    /// The frame of a code, if its symbol set has one.
    pub(crate) fn of(code: &SymbolCode) -> Option<Self> {
        let kind = FrameKind::of(code.set)?;
        let group = FrameGroup::of(code.identity);
        let outline = outline(kind, group);
        let marks = match kind {
            FrameKind::Installation => vec![installation_bar(group)],
            FrameKind::Space => vec![space_cap(group)],
            FrameKind::Activity => activity_corners(group),
            _ => Vec::new(),
        };
        Some(Self { outline, marks })
    }

    /// The frame as shapes: the filled outline with its line, then the marks.
    pub(crate) fn shapes(&self, code: &SymbolCode) -> Vec<SymbolShape> {
        let uncertain = matches!(
            code.identity,
            StandardIdentity::Pending | StandardIdentity::AssumedFriend | StandardIdentity::Suspect
        );
        let dash = match (uncertain, code.status) {
            (true, _) => Some([5.0, 5.0]),
            (false, SymbolStatus::Planned) => Some([25.0, 15.0]),
            _ => None,
        };
        let mut shapes = vec![SymbolShape {
            steps: self.outline.clone(),
            fill: Some(PaintRole::FrameFill),
            line: Some(ShapeLine { role: PaintRole::FrameLine, width: LINE, dash }),
            text: None,
        }];
        shapes.extend(
            self.marks.iter().map(|mark| SymbolShape::filled(mark.clone(), PaintRole::FrameLine)),
        );
        shapes
    }

    /// The smallest and largest coordinates of the outline, without its line.
    pub(crate) fn extent(&self) -> [Position; 2] {
        let mut extent = [[f64::MAX; 2], [f64::MIN; 2]];
        for [x, y] in self.positions() {
            extent[0] = [extent[0][0].min(x), extent[0][1].min(y)];
            extent[1] = [extent[1][0].max(x), extent[1][1].max(y)];
        }
        extent
    }

    /// The lowest position at the left edge of the outline, where the staff of a headquarters
    /// begins.
    pub(crate) fn left_foot(&self) -> Position {
        let left = self.extent()[0][0];
        let lowest = |low: Position, at: Position| if at[1] > low[1] { at } else { low };
        let at_edge = self.positions().into_iter().filter(|[x, _]| *x < left + 0.5);
        at_edge.fold([left, f64::MIN], lowest)
    }

    /// The corners of the outline, and sixteen positions on each curve.
    fn positions(&self) -> Vec<Position> {
        let mut positions = Vec::new();
        let mut from = [0.0, 0.0];
        for step in &self.outline {
            match *step {
                PathStep::Move(to) | PathStep::Line(to) => {
                    positions.push(to);
                    from = to;
                }
                PathStep::Curve(first, second, to) => {
                    positions.extend(
                        (1..=16).map(|part| {
                            on_curve([from, first, second, to], f64::from(part) / 16.0)
                        }),
                    );
                    from = to;
                }
                PathStep::Close => {}
            }
        }
        positions
    }
}

fn on_curve(of: [Position; 4], part: f64) -> Position {
    let rest = 1.0 - part;
    let weights = [
        rest * rest * rest,
        3.0 * rest * rest * part,
        3.0 * rest * part * part,
        part * part * part,
    ];
    let sum = |axis: usize| weights.iter().zip(&of).map(|(weight, at)| weight * at[axis]).sum();
    [sum(0), sum(1)]
}

/// A lobe from the last position to another one: a cubic curve whose control points lie `depth`
/// away, so that it is three quarters of that deep.
fn lobe(from: Position, to: Position, depth: Position) -> PathStep {
    PathStep::Curve(
        [from[0] + depth[0], from[1] + depth[1]],
        [to[0] + depth[0], to[1] + depth[1]],
        to,
    )
}

/// Lobes around a line of positions, each with its depth.
fn lobes(from: Position, sides: &[(Position, Position)]) -> Vec<PathStep> {
    let mut steps = vec![PathStep::Move(from)];
    let mut last = from;
    for (to, depth) in sides {
        steps.push(lobe(last, *to, *depth));
        last = *to;
    }
    steps
}

fn outline(kind: FrameKind, group: FrameGroup) -> Vec<PathStep> {
    match kind {
        FrameKind::Air => open_outline(group),
        FrameKind::Space => match group {
            // The standard's square for space stands higher than that for air.
            FrameGroup::Neutral => polyline(
                &[[-132.0, 119.0], [-132.0, -169.0], [132.0, -169.0], [132.0, 119.0]],
                false,
            ),
            _ => open_outline(group),
        },
        FrameKind::Subsurface => open_outline(group).iter().map(upside_down).collect(),
        FrameKind::Equipment if group == FrameGroup::Friend => ellipse([0.0, 0.0], [144.0, 144.0]),
        _ => closed_outline(group),
    }
}

/// The frames on the ground.
fn closed_outline(group: FrameGroup) -> Vec<PathStep> {
    match group {
        FrameGroup::Friend => rectangle([-180.0, -120.0], [180.0, 120.0]),
        FrameGroup::Neutral => rectangle([-132.0, -133.0], [132.0, 131.0]),
        FrameGroup::Hostile => {
            polyline(&[[0.0, 172.0], [173.0, -1.0], [0.0, -174.0], [-173.0, -1.0]], true)
        }
        FrameGroup::Unknown => {
            let (low, high) = ([-85.0, 84.0], [85.0, -86.0]);
            let mut steps = lobes(
                low,
                &[
                    ([high[0], low[1]], [0.0, 115.0]),
                    (high, [115.0, 0.0]),
                    ([low[0], high[1]], [0.0, -115.0]),
                    (low, [-115.0, 0.0]),
                ],
            );
            steps.push(PathStep::Close);
            steps
        }
    }
}

/// The frames in the air: open at the bottom.
fn open_outline(group: FrameGroup) -> Vec<PathStep> {
    match group {
        FrameGroup::Friend => arc([0.0, 121.0], [130.5, 316.0], 180.0, 360.0),
        FrameGroup::Neutral => {
            polyline(&[[-132.0, 144.0], [-132.0, -144.0], [132.0, -144.0], [132.0, 144.0]], false)
        }
        FrameGroup::Hostile => polyline(
            &[[-132.0, 121.0], [-132.0, -69.0], [0.0, -191.0], [132.0, -69.0], [132.0, 121.0]],
            false,
        ),
        FrameGroup::Unknown => lobes(
            [85.0, 118.0],
            &[
                ([85.0, -87.0], [125.0, 0.0]),
                ([-85.0, -87.0], [0.0, -139.0]),
                ([-85.0, 118.0], [-125.0, 0.0]),
            ],
        ),
    }
}

fn upside_down(step: &PathStep) -> PathStep {
    let turn = |[x, y]: Position| [x, -y];
    match *step {
        PathStep::Move(to) => PathStep::Move(turn(to)),
        PathStep::Line(to) => PathStep::Line(turn(to)),
        PathStep::Curve(first, second, to) => PathStep::Curve(turn(first), turn(second), turn(to)),
        PathStep::Close => PathStep::Close,
    }
}

/// The bar on top of an installation's frame.
fn installation_bar(group: FrameGroup) -> Vec<PathStep> {
    match group {
        FrameGroup::Friend => rectangle([-38.5, -143.5], [38.5, -120.0]),
        FrameGroup::Neutral => rectangle([-38.5, -157.0], [38.5, -133.0]),
        FrameGroup::Unknown => rectangle([-35.5, -192.0], [35.0, -168.0]),
        // Its lower edge follows the diamond.
        FrameGroup::Hostile => polyline(
            &[
                [-29.0, -178.5],
                [29.0, -178.5],
                [29.0, -152.5],
                [21.0, -152.5],
                [0.0, -173.5],
                [-21.0, -152.5],
                [-29.0, -152.5],
            ],
            true,
        ),
    }
}

/// The dark cap at the top of a frame in space.
fn space_cap(group: FrameGroup) -> Vec<PathStep> {
    match group {
        FrameGroup::Friend => cap([-68.5, -144.5], [32.0, -65.0]),
        FrameGroup::Unknown => cap([-80.5, -122.0], [30.0, -95.0]),
        FrameGroup::Neutral => rectangle([-132.0, -169.0], [132.0, -121.0]),
        FrameGroup::Hostile => polyline(&[[-77.0, -120.0], [0.0, -190.0], [77.0, -120.0]], true),
    }
}

/// A symmetric cap over a level chord that begins at `from`; `handle` leads to its first control
/// point.
fn cap(from: Position, handle: Position) -> Vec<PathStep> {
    let first = [from[0] + handle[0], from[1] + handle[1]];
    let mirror = |[x, y]: Position| [-x, y];
    vec![PathStep::Move(from), PathStep::Curve(first, mirror(first), mirror(from)), PathStep::Close]
}

/// The four marks inside the corners of an activity's frame.
fn activity_corners(group: FrameGroup) -> Vec<Vec<PathStep>> {
    let square = |[x, y]: Position| rectangle([x - 10.5, y - 10.5], [x + 10.5, y + 10.5]);
    let centres: [Position; 4] = match group {
        FrameGroup::Friend => [[-170.5, -110.0], [170.5, -110.0], [170.5, 110.0], [-170.5, 110.0]],
        FrameGroup::Neutral => [[-122.5, -123.0], [122.5, -123.0], [122.5, 121.5], [-122.5, 121.5]],
        FrameGroup::Unknown => [[0.0, -160.0], [159.5, -1.0], [0.0, 158.5], [-159.5, -1.0]],
        FrameGroup::Hostile => {
            let diamond = |[x, y]: Position| {
                polyline(&[[x, y - 14.0], [x + 14.0, y], [x, y + 14.0], [x - 14.0, y]], true)
            };
            return [[0.0, -160.5], [159.5, -1.0], [0.0, 158.5], [-160.0, -1.0]]
                .map(diamond)
                .to_vec();
        }
    };
    centres.map(square).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_the_sizes_of_the_octagon() {
        let size = |digits: &str| {
            let code = SymbolCode::parse(digits).expect("it is valid");
            let [low, high] = Frame::of(&code).expect("it has a frame").extent();
            [high[0] - low[0], high[1] - low[1]].map(|side| (side / 24.0).round() / 10.0)
        };
        assert_eq!(size("10031000000000000000"), [1.5, 1.0]);
        assert_eq!(size("10041000000000000000"), [1.1, 1.1]);
        assert_eq!(size("10061000000000000000"), [1.4, 1.4]);
        assert_eq!(size("10011000000000000000"), [1.4, 1.4]);
        assert_eq!(size("10031500000000000000"), [1.2, 1.2]);
    }

    #[test]
    fn weather_and_control_measures_have_no_frame() {
        for set in ["25", "45", "46", "47"] {
            let code = SymbolCode::parse(&format!("1003{set}00000000000000")).expect("valid");
            assert!(Frame::of(&code).is_none(), "{set}");
        }
    }
}
