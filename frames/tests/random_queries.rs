//! Random queries of random trees against a composition by hand: 4×4 matrices, a linear search for
//! the samples, and slerp by its formula. 20,000 queries, with `ARMOR_FULL` a million;
//! `ARMOR_SEED` selects others. `--nocapture` shows the figures.

use armor_frames::{
    FrameError, FrameTree, HISTORY_S, Isometry3, Quaternion, Translation3, UnitQuaternion,
};
use fastrand::Rng;

/// Queries of one tree.
const QUERIES: usize = 100;
/// Largest difference of a number of the matrix, in metres or without unit.
const TOLERANCE: f64 = 1e-9;

type Matrix = [[f64; 4]; 4];

/// A transform as numbers: x, y, z, and the quaternion's w, x, y, z.
#[derive(Clone, Copy)]
struct Numbers([f64; 3], [f64; 4]);

/// An edge as it was built: by hand, so a plain list.
struct KnownEdge {
    parent: usize,
    /// None of a fixed one.
    samples: Option<Vec<(f64, Numbers)>>,
    fixed: Numbers,
}

/// Frames by index; roots have no edge.
struct KnownTree {
    edges: Vec<Option<KnownEdge>>,
}

fn name(frame: usize) -> String {
    format!("frame{frame}")
}

fn draw_numbers(rng: &mut Rng) -> Numbers {
    let mut draw = || rng.f64() * 2.0 - 1.0;
    let place = [draw() * 5.0, draw() * 5.0, draw() * 5.0];
    let turn = [draw(), draw(), draw(), draw()];
    let norm = turn.iter().map(|part| part * part).sum::<f64>().sqrt().max(1e-3);
    Numbers(place, turn.map(|part| part / norm))
}

fn isometry(Numbers([x, y, z], [w, i, j, k]): Numbers) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::new(x, y, z), rotation)
}

fn matrix(Numbers([x, y, z], [w, i, j, k]): Numbers) -> Matrix {
    [
        [1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j - w * k), 2.0 * (i * k + w * j), x],
        [2.0 * (i * j + w * k), 1.0 - 2.0 * (i * i + k * k), 2.0 * (j * k - w * i), y],
        [2.0 * (i * k - w * j), 2.0 * (j * k + w * i), 1.0 - 2.0 * (i * i + j * j), z],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| (0..4).map(|k| a[row][k] * b[k][column]).sum())
    })
}

/// Transposes the rotation and turns the translation back.
fn invert(a: &Matrix) -> Matrix {
    let mut inverse: Matrix =
        std::array::from_fn(|row| std::array::from_fn(|column| a[column][row]));
    for row in 0..3 {
        inverse[row][3] = -(0..3).map(|k| a[k][row] * a[k][3]).sum::<f64>();
    }
    inverse[3] = [0.0, 0.0, 0.0, 1.0];
    inverse
}

fn interpolate(from: Numbers, to: Numbers, share: f64) -> Numbers {
    let place = std::array::from_fn(|axis| from.0[axis] * (1.0 - share) + to.0[axis] * share);
    let dot: f64 = (0..4).map(|part| from.1[part] * to.1[part]).sum();
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    let angle = dot.abs().min(1.0).acos();
    let weights = if angle < 1e-12 {
        [1.0 - share, share]
    } else {
        [((1.0 - share) * angle).sin() / angle.sin(), (share * angle).sin() / angle.sin()]
    };
    let turn =
        std::array::from_fn(|part| weights[0] * from.1[part] + sign * weights[1] * to.1[part]);
    Numbers(place, turn)
}

impl KnownTree {
    /// Draws a forest and builds the tree that is tested: samples in any order, some of them twice,
    /// a tenth of the edges removed and built again.
    fn draw(rng: &mut Rng) -> (Self, FrameTree) {
        let mut tree = FrameTree::default();
        let mut edges = Vec::new();
        for frame in 0..rng.usize(2..24) {
            let is_root = frame == 0 || rng.u8(..) < 20;
            edges.push((!is_root).then(|| {
                let parent = rng.usize(0..frame);
                if rng.u8(..) < 25 {
                    KnownEdge::draw(rng, parent).build(frame, rng, &mut tree);
                    tree.remove(&name(frame)).expect("it was built");
                }
                let edge = KnownEdge::draw(rng, parent);
                edge.build(frame, rng, &mut tree);
                edge
            }));
        }
        (Self { edges }, tree)
    }

    /// The frames from this one up to its root.
    fn line(&self, frame: usize) -> Vec<usize> {
        let mut line = vec![frame];
        let mut frame = frame;
        while let Some(edge) = &self.edges[frame] {
            frame = edge.parent;
            line.push(frame);
        }
        line
    }

    /// Whether any transform names it.
    fn is_known(&self, frame: usize) -> bool {
        let is_parent = || self.edges.iter().flatten().any(|edge| edge.parent == frame);
        self.edges.get(frame).is_some_and(|edge| edge.is_some() || is_parent())
    }

    /// `ancestor_from_frame` by hand; the frame whose edge has nothing at that moment otherwise.
    fn compose(&self, line: &[usize], ancestor: usize, stamp_s: f64) -> Result<Matrix, usize> {
        let mut product = matrix(Numbers([0.0; 3], [1.0, 0.0, 0.0, 0.0]));
        for frame in line.iter().take_while(|frame| **frame != ancestor) {
            let edge = self.edges[*frame].as_ref().expect("it is below the ancestor");
            let numbers = edge.at(stamp_s).ok_or(*frame)?;
            product = multiply(&matrix(numbers), &product);
        }
        Ok(product)
    }
}

impl KnownEdge {
    fn draw(rng: &mut Rng, parent: usize) -> Self {
        let fixed = draw_numbers(rng);
        if rng.bool() {
            return Self { parent, samples: None, fixed };
        }
        let mut stamps: Vec<_> = (0..rng.usize(1..40)).map(|_| rng.f64() * 20.0).collect();
        stamps.sort_by(f64::total_cmp);
        stamps.dedup();
        let newest_s = stamps.last().copied().unwrap_or_default();
        stamps.retain(|stamp_s| *stamp_s >= newest_s - HISTORY_S);
        let samples = stamps.into_iter().map(|stamp_s| (stamp_s, draw_numbers(rng))).collect();
        Self { parent, samples: Some(samples), fixed }
    }

    fn build(&self, frame: usize, rng: &mut Rng, tree: &mut FrameTree) {
        let (parent, child) = (name(self.parent), name(frame));
        let Some(samples) = &self.samples else {
            return tree.set_fixed(&parent, &child, isometry(self.fixed)).expect("a new edge");
        };
        let mut order: Vec<_> = (0..samples.len()).collect();
        rng.shuffle(&mut order);
        for index in order {
            let (stamp_s, numbers) = samples[index];
            if rng.u8(..) < 25 {
                let other = isometry(draw_numbers(rng));
                tree.add_sample(&parent, &child, stamp_s, other).expect("it is replaced");
            }
            tree.add_sample(&parent, &child, stamp_s, isometry(numbers)).expect("it is kept");
        }
    }

    fn at(&self, stamp_s: f64) -> Option<Numbers> {
        let Some(samples) = &self.samples else { return Some(self.fixed) };
        if let Some((_, same)) = samples.iter().find(|(stamp, _)| *stamp == stamp_s) {
            return Some(*same);
        }
        let after = samples.iter().position(|(stamp, _)| *stamp > stamp_s)?;
        let ((from_s, from), (to_s, to)) = (samples[after.checked_sub(1)?], samples[after]);
        Some(interpolate(from, to, (stamp_s - from_s) / (to_s - from_s)))
    }

    /// A moment: mostly within the samples, sometimes exactly one of them, sometimes outside.
    fn draw_stamp(&self, rng: &mut Rng) -> f64 {
        match &self.samples {
            Some(samples) if rng.u8(..) < 64 => samples[rng.usize(..samples.len())].0,
            _ => rng.f64() * 24.0 - 2.0,
        }
    }
}

/// Compares one answer with that by hand; returns whether it was a transform.
fn check(known: &KnownTree, tree: &FrameTree, target: usize, source: usize, stamp_s: f64) -> bool {
    let answer = tree.lookup(&name(target), &name(source), stamp_s);
    if let Some(unknown) = [target, source].into_iter().find(|frame| !known.is_known(*frame)) {
        assert_eq!(answer, Err(FrameError::Unknown { frame: name(unknown) }));
        return false;
    }
    let (to_target, to_source) = (known.line(target), known.line(source));
    let Some(common) = to_target.iter().copied().find(|frame| to_source.contains(frame)) else {
        let root = |line: &[usize]| line.last().map(|root| name(*root)).expect("it has itself");
        let (target, from) = (name(target), name(source));
        let (target_root, source_root) = (root(&to_target), root(&to_source));
        let expected = FrameError::NotConnected { target, target_root, from, source_root };
        assert_eq!(answer, Err(expected));
        return false;
    };
    let target_side = known.compose(&to_target, common, stamp_s);
    let source_side = known.compose(&to_source, common, stamp_s);
    let (common_from_target, common_from_source) = match (target_side, source_side) {
        (Ok(target_side), Ok(source_side)) => (target_side, source_side),
        (Err(frame), _) | (_, Err(frame)) => {
            let edge = known.edges[frame].as_ref().expect("it has an edge");
            let samples = edge.samples.as_ref().expect("a fixed edge has every moment");
            let (oldest_s, newest_s) = (samples[0].0, samples[samples.len() - 1].0);
            let (parent, child) = (name(edge.parent), name(frame));
            let expected = if stamp_s < oldest_s {
                FrameError::TooOld { parent, child, stamp_s, oldest_s, newest_s }
            } else {
                FrameError::TooNew { parent, child, stamp_s, oldest_s, newest_s }
            };
            assert_eq!(answer, Err(expected));
            return false;
        }
    };
    let expected = multiply(&invert(&common_from_target), &common_from_source);
    let found = answer.expect("it is known by hand").to_homogeneous();
    for row in 0..4 {
        for column in 0..4 {
            let difference = (found[(row, column)] - expected[row][column]).abs();
            assert!(difference < TOLERANCE, "{difference} at {row},{column}");
        }
    }
    true
}

#[test]
fn answers_equal_a_composition_by_hand_and_impossible_ones_are_refused() {
    let seed = std::env::var("ARMOR_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let wanted = if std::env::var_os("ARMOR_FULL").is_some() { 1_000_000 } else { 20_000 };
    println!("ARMOR_SEED={seed}");
    let mut rng = Rng::with_seed(seed);
    let (mut answered, mut refused, mut trees) = (0, 0, 0);
    while answered + refused < wanted {
        let (known, tree) = KnownTree::draw(&mut rng);
        trees += 1;
        for _ in 0..QUERIES.min(wanted - answered - refused) {
            // One more than there are: a frame that no transform names.
            let frames = known.edges.len() + usize::from(rng.u8(..) < 25);
            let (target, source) = (rng.usize(..frames), rng.usize(..frames));
            let edge = known.edges.get(source).and_then(Option::as_ref);
            let stamp_s = edge.map_or(5.0, |edge| edge.draw_stamp(&mut rng));
            if check(&known, &tree, target, source, stamp_s) { answered += 1 } else { refused += 1 }
        }
    }
    println!("{wanted} queries of {trees} trees: {answered} answered, {refused} refused");
    assert!(answered > wanted / 5 && refused > wanted / 5, "both are tested");
}
