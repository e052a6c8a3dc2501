//! Paints all symbols and control measures on one sheet: `cargo run -p armor-symbols --example
//! sheet -- FILE.png`. Where it writes is its only argument.

use armor_symbols::{ControlMeasure, Icon, Symbol, svg_of};
use resvg::{tiny_skia, usvg};

/// The side of one symbol's field, and how many stand in a row.
const FIELD: usize = 76;
const ROW: usize = 16;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: sheet FILE.png")?;
    let codes = codes();
    let rows = codes.len().div_ceil(ROW);
    let (width, height) = ((ROW * FIELD) as u32, (rows * FIELD) as u32);
    let mut sheet = tiny_skia::Pixmap::new(width, height).ok_or("the sheet is empty")?;
    sheet.fill(tiny_skia::Color::WHITE);
    for (index, code) in codes.iter().enumerate() {
        let symbol = Symbol::parse(code)?;
        // One scale for all, so that sizes can be compared.
        let bounds = [[-250.0, -300.0], [250.0, 300.0]];
        let svg = svg_of(&symbol.shapes(), bounds, |role| symbol.color(role));
        let tree = usvg::Tree::from_str(&svg, &usvg::Options::default())?;
        let scale = FIELD as f32 / tree.size().height();
        let (column, row) = (index % ROW, index / ROW);
        let place = tiny_skia::Transform::from_scale(scale, scale)
            .post_translate((column * FIELD) as f32 + 3.0, (row * FIELD) as f32);
        resvg::render(&tree, place, &mut sheet.as_mut());
    }
    sheet.save_png(&path)?;
    println!("{} symbols in {path}", codes.len());
    Ok(())
}

/// Identities by dimension, amplifiers, every icon, every control measure.
fn codes() -> Vec<String> {
    let mut codes = Vec::new();
    for set in ["10", "15", "20", "40", "01", "05", "35"] {
        for identity in 0..7 {
            codes.push(format!("100{identity}{set}00000000000000"));
        }
        codes.push(format!("1003{set}10000000000000"));
    }
    for amplifier in
        [11, 13, 15, 17, 18, 22, 26, 31, 32, 33, 34, 35, 36, 37, 41, 42, 51, 52, 61, 62]
    {
        codes.push(format!("10031000{amplifier}1211000000"));
    }
    for (identity, digits) in
        [3, 4, 6, 1].iter().flat_map(|of| (0..8).map(move |digit| (of, digit)))
    {
        codes.push(format!("100{identity}100{digits}181211000000"));
    }
    for status in 1..6 {
        codes.push(format!("100315{status}0001401000009"));
    }
    for (index, icon) in Icon::all().iter().enumerate() {
        let identity = [3, 6, 4, 1][index % 4];
        let (set, entity) = icon.code.split_at(2);
        codes.push(format!("100{identity}{set}0000{entity}0000"));
    }
    codes.extend(
        ControlMeasure::all().iter().map(|measure| format!("1003250000{}0000", measure.entity)),
    );
    codes
}
