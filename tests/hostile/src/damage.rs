//! Damages well-formed inputs: bytes, pieces and numbers, by a seed.

use fastrand::Rng;

/// Pieces that decoders of text compare with, or that are at the edge of what they take.
const PIECES: [&str; 24] = [
    "<",
    ">",
    "/>",
    "\"",
    "&#x0;",
    "<![CDATA[",
    "]]>",
    "{",
    "}",
    "[",
    ",w[",
    "->",
    "-1",
    "1e309",
    "NaN",
    "99999999999999999999",
    "0x",
    "\u{0}",
    "\u{feff}",
    "ä\u{2028}",
    "\n",
    "\r\n",
    "(((",
    "not not ",
];
/// Longest input, in bytes.
const MAX_LEN: usize = 64 << 10;

/// One of the seeds with one to eight damages; now and then only noise.
pub fn damage_one(seeds: &[Vec<u8>], rng: &mut Rng) -> Vec<u8> {
    if rng.u8(..) < 8 {
        return (0..rng.usize(..200)).map(|_| rng.u8(..)).collect();
    }
    let mut bytes = seeds[rng.usize(..seeds.len())].clone();
    for _ in 0..rng.usize(1..=8) {
        let other = &seeds[rng.usize(..seeds.len())];
        damage_once(&mut bytes, other, rng);
        bytes.truncate(MAX_LEN);
    }
    bytes
}

fn damage_once(bytes: &mut Vec<u8>, other: &[u8], rng: &mut Rng) {
    let at = rng.usize(..=bytes.len());
    let end = (at + rng.usize(..=40)).min(bytes.len());
    match rng.u8(..8) {
        0 if at < bytes.len() => bytes[at] ^= 1 << rng.u8(..8),
        1 => drop(bytes.drain(at..end)),
        2 => {
            let piece = bytes[at..end].to_vec();
            let to = rng.usize(..=bytes.len());
            drop(bytes.splice(to..to, piece));
        }
        3 => bytes.truncate(at),
        4 => {
            let from = rng.usize(..=other.len());
            let to = (from + rng.usize(..=60)).min(other.len());
            drop(bytes.splice(at..end, other[from..to].iter().copied()));
        }
        5 => {
            // Deep nesting, and long lists.
            let piece = bytes[at..end].repeat(rng.usize(2..=200));
            drop(bytes.splice(at..end, piece));
        }
        6 => change_number(bytes, at, rng),
        _ => {
            let piece = PIECES[rng.usize(..PIECES.len())];
            drop(bytes.splice(at..at, piece.bytes()));
        }
    }
}

/// Replaces the first number from `at` on.
fn change_number(bytes: &mut Vec<u8>, at: usize, rng: &mut Rng) {
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|it| at + it) else {
        return;
    };
    let len = bytes[start..].iter().position(|byte| !byte.is_ascii_digit());
    let end = len.map_or(bytes.len(), |len| start + len);
    let number = match rng.u8(..4) {
        0 => rng.u64(..).to_string(),
        1 => format!("-{}", rng.u16(..)),
        2 => format!("{}e{}", rng.u8(..), rng.u16(..400)),
        _ => rng.u8(..).to_string(),
    };
    drop(bytes.splice(start..end, number.into_bytes()));
}
