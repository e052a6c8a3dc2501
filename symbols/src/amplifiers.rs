//! What stands around a frame: echelon, mobility, headquarters, task force, dummy and condition.

use crate::OCTAGON;
use crate::code::{SymbolCode, SymbolContext, SymbolStatus};
use crate::frame::LINE;
use crate::outline::{
    PaintRole, PathStep, Position, ShapeLine, SymbolShape, arc, capsule, ellipse, polyline,
    rectangle,
};
use crate::stroke_text::centred_text;

/// The gap between a frame and the middle of the echelon above it.
const ECHELON_GAP: f64 = 38.0;
/// The distance from one mark of an echelon to the next.
const ECHELON_STEP: f64 = 44.0;
/// The radius of a wheel.
const WHEEL: f64 = 25.0;

/// All amplifiers of a code around a frame of this extent; a staff begins at `left_foot`.
pub(crate) fn amplifiers(
    code: &SymbolCode,
    extent: [Position; 2],
    left_foot: Position,
) -> Vec<SymbolShape> {
    let [[left, top], [right, bottom]] = extent;
    let mut shapes = match code.amplifier {
        11..=26 => echelon(code.amplifier, top - ECHELON_GAP),
        31..=62 => mobility(code.amplifier, right.min(174.0), bottom + 3.0),
        _ => Vec::new(),
    };
    if code.headquarters.is_headquarters() {
        // The staff ends an octagon below a frame of an octagon's height.
        shapes.push(line(&[left_foot, [left_foot[0], 1.5 * OCTAGON + 4.0]]));
    }
    if code.headquarters.is_task_force() {
        let (half, foot) = (0.25 * OCTAGON, top + 10.0);
        shapes.push(line(&[[-half, foot], [-half, top - 50.0], [half, top - 50.0], [half, foot]]));
    }
    if code.headquarters.is_dummy() {
        let apex = top - 0.42 * (right - left);
        let roof = line(&[[left, top], [0.0, apex], [right, top]]);
        shapes.push(roof.dashed([30.0, 26.0]));
    }
    shapes.extend(condition(code.status, extent));
    match code.context {
        SymbolContext::Reality => {}
        SymbolContext::Exercise => shapes.push(centred_text("X", [right + 32.0, top], 52.0)),
        SymbolContext::Simulation => shapes.push(centred_text("S", [right + 32.0, top], 52.0)),
    }
    shapes
}

fn line(positions: &[Position]) -> SymbolShape {
    SymbolShape::line(polyline(positions, false), LINE)
}

/// Dots, bars or crosses in a row above the frame.
fn echelon(amplifier: u8, middle: f64) -> Vec<SymbolShape> {
    let (count, draw): (usize, fn(Position) -> SymbolShape) = match amplifier {
        11 => return team(middle),
        12..=14 => (usize::from(amplifier - 11), dot),
        15..=17 => (usize::from(amplifier - 14), bar),
        18 => (1, cross),
        21..=25 => (usize::from(amplifier - 19), cross),
        _ => (2, plus),
    };
    // Rows of many crosses are set closer, to stay within the frame's width.
    let step = if count > 3 { 36.0 } else { ECHELON_STEP };
    let first = -(count as f64 - 1.0) / 2.0 * step;
    (0..count).map(|index| draw([first + index as f64 * step, middle])).collect()
}

fn team(middle: f64) -> Vec<SymbolShape> {
    vec![
        SymbolShape::line(ellipse([0.0, middle], [18.0, 18.0]), LINE),
        line(&[[-18.0, middle + 20.0], [18.0, middle - 20.0]]),
    ]
}

fn dot(centre: Position) -> SymbolShape {
    SymbolShape::filled(ellipse(centre, [18.0, 18.0]), PaintRole::Icon)
}

fn bar([x, y]: Position) -> SymbolShape {
    SymbolShape::line(polyline(&[[x, y - 24.5], [x, y + 24.5]], false), 10.0)
}

fn cross([x, y]: Position) -> SymbolShape {
    let mut steps = polyline(&[[x - 14.0, y - 17.0], [x + 14.0, y + 17.0]], false);
    steps.extend(polyline(&[[x - 14.0, y + 17.0], [x + 14.0, y - 17.0]], false));
    SymbolShape::line(steps, LINE)
}

fn plus([x, y]: Position) -> SymbolShape {
    let mut steps = polyline(&[[x - 18.0, y], [x + 18.0, y]], false);
    steps.extend(polyline(&[[x, y - 18.0], [x, y + 18.0]], false));
    SymbolShape::line(steps, 3.0)
}

/// Wheels, tracks and the like below the frame, between `-half` and `half`, from `top` down.
fn mobility(amplifier: u8, half: f64, top: f64) -> Vec<SymbolShape> {
    let axle = line(&[[-half, top], [half, top]]);
    let wheel = |x: f64| SymbolShape::line(ellipse([x, top + WHEEL], [WHEEL, WHEEL]), LINE);
    let track = |from: f64, to: f64| {
        let middle = [(from + to) / 2.0, top + WHEEL];
        let straight = (to - from) / 2.0 - WHEEL;
        SymbolShape::line(capsule(middle, straight, [WHEEL, WHEEL]), LINE)
    };
    let edge = half - WHEEL;
    match amplifier {
        31 => vec![axle, wheel(-edge), wheel(edge)],
        32 => vec![axle, wheel(-edge), wheel(0.0), wheel(edge)],
        33 => vec![track(-half, half)],
        34 => vec![wheel(-edge), track(-edge + WHEEL + 8.0, half)],
        35 => {
            let ring = |x: f64| SymbolShape::line(ellipse([x, top], [WHEEL, WHEEL]), LINE);
            let rod = line(&[[-edge + WHEEL, top], [edge - WHEEL, top]]);
            vec![rod, ring(-edge), ring(edge)]
        }
        36 => {
            let pair = 2.0 * WHEEL + 3.0;
            vec![axle, wheel(-edge), wheel(pair - edge), wheel(edge - pair), wheel(edge)]
        }
        37 => {
            let zigzag = [[-50.0, 50.0], [-25.0, 0.0], [0.0, 50.0], [25.0, 0.0], [50.0, 50.0]];
            vec![line(&zigzag.map(|[x, y]| [x, top + y]))]
        }
        41 => vec![line(&[
            [-half, top - 25.0 + WHEEL],
            [-half + 38.0, top + 50.0],
            [half, top + 50.0],
        ])],
        42 => vec![sled(half, top)],
        51 => {
            let mut hull = arc([0.0, top], [half, 36.0], 0.0, 180.0);
            hull.push(PathStep::Close);
            vec![SymbolShape::line(hull, LINE)]
        }
        52 => vec![waves(half, top)],
        61 => towed_array(half, top, &[-1.0, 0.0, 1.0], &[0.0]),
        _ => towed_array(half, top, &[-1.0, -0.5, 0.0, 0.5, 1.0], &[-0.5, 0.5]),
    }
}

/// A runner whose ends turn up.
fn sled(half: f64, top: f64) -> SymbolShape {
    let (middle, edge) = (top + 20.0, half - 20.0);
    let mut steps = arc([-edge, middle], [20.0, 20.0], 270.0, 90.0);
    steps.push(PathStep::Line([edge, middle + 20.0]));
    steps.extend(arc([edge, middle], [20.0, 20.0], 90.0, -90.0).into_iter().skip(1));
    SymbolShape::line(steps, LINE)
}

/// Half circles, up and down in turn.
fn waves(half: f64, top: f64) -> SymbolShape {
    let radius = half / 5.0;
    let mut steps = Vec::new();
    for index in 0..5 {
        let centre = [-half + radius * (2.0 * f64::from(index) + 1.0), top + radius];
        let to = if index % 2 == 0 { 360.0 } else { 0.0 };
        steps.extend(arc(centre, [radius, radius], 180.0, to).into_iter().skip(steps.len().min(1)));
    }
    SymbolShape::line(steps, LINE)
}

fn towed_array(half: f64, top: f64, weights: &[f64], rods: &[f64]) -> Vec<SymbolShape> {
    let middle = top + 28.0;
    let mut shapes = vec![line(&[[-half, middle], [half, middle]])];
    for at in weights {
        let x = at * half;
        let weight = rectangle([x - 12.5, middle - 12.5], [x + 12.5, middle + 12.5]);
        shapes.push(SymbolShape::filled(weight, PaintRole::Icon));
    }
    for at in rods {
        shapes.push(line(&[[at * half, middle - 20.0], [at * half, middle + 20.0]]));
    }
    shapes
}

/// The operational condition: a stroke or cross over what is damaged or destroyed, else a bar.
fn condition(
    status: SymbolStatus,
    [[left, _], [right, bottom]]: [Position; 2],
) -> Vec<SymbolShape> {
    let stroke =
        |from: Position, to: Position| SymbolShape::line(polyline(&[from, to], false), 20.0);
    let (low, high) = ([-101.75, 176.25], [101.75, -176.25]);
    match status {
        SymbolStatus::Present | SymbolStatus::Planned => Vec::new(),
        SymbolStatus::Damaged => vec![stroke(low, high)],
        SymbolStatus::Destroyed => {
            vec![stroke(low, high), stroke([low[0], high[1]], [high[0], low[1]])]
        }
        SymbolStatus::FullyCapable | SymbolStatus::FullToCapacity => {
            let steps = rectangle([left, bottom + 10.5], [right, bottom + 63.5]);
            let line = ShapeLine { role: PaintRole::FrameLine, width: LINE, dash: None };
            let (fill, line) = (Some(PaintRole::Condition), Some(line));
            vec![SymbolShape { steps, fill, line, text: None }]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(digits: &str) -> Vec<SymbolShape> {
        let code = SymbolCode::parse(digits).expect("it is valid");
        amplifiers(&code, [[-180.0, -120.0], [180.0, 120.0]], [-180.0, 120.0])
    }

    #[test]
    fn every_amplifier_of_the_standard_is_drawn() {
        for amplifier in [
            11, 12, 13, 14, 15, 16, 17, 18, 21, 22, 23, 24, 25, 26, 31, 32, 33, 34, 35, 36, 37, 41,
            42, 51, 52, 61, 62,
        ] {
            let shapes = around(&format!("10031000{amplifier}0000000000"));
            assert!(!shapes.is_empty(), "{amplifier}");
            for [low, high] in shapes.iter().filter_map(SymbolShape::bounds) {
                let above = high[1] <= -120.0;
                let below = low[1] >= 90.0;
                assert!(
                    if amplifier < 30 { above } else { below },
                    "{amplifier}: {low:?} {high:?}"
                );
            }
        }
    }

    #[test]
    fn a_brigade_has_one_cross_and_a_corps_three() {
        assert_eq!(around("10031000180000000000").len(), 1);
        assert_eq!(around("10031000220000000000").len(), 3);
    }

    #[test]
    fn marks_of_headquarters_task_force_and_dummy_add_up() {
        let count = |digit: u8| around(&format!("1003100{digit}000000000000")).len();
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(count), [0, 1, 1, 2, 1, 2, 2, 3]);
    }
}
