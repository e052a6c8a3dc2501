//! Frames and icons against the drawings of DISA: frames within 1.5 % of the octagon's height,
//! icons that overlap by 0.85 or more, texts that are equal. `ARMOR_BLESS=1` writes the figures
//! into `docs/symbols.md`.

mod drawings;

use std::fmt::Write;
use std::path::Path;

use armor_symbols::{Icon, OCTAGON, PaintRole, Symbol};

use drawings::{Picture, deviation, drawings, overlap, texts};

/// How far a frame may be from the drawing, in the units of both.
const FRAME_TOLERANCE: f32 = (0.015 * OCTAGON) as f32;
/// How much an icon must overlap.
const LEAST_OVERLAP: f32 = 0.85;

/// Frames whose drawings contradict each other: the suspect frame is that of hostile with another
/// line, but is drawn elsewhere.
const CONTRADICTORY: &[&str] = &["0_535_0"];

#[test]
fn frames_are_those_of_disa() {
    let Some(drawings) = drawings() else { return };
    let mut compared = 0;
    let mut wrong = Vec::new();
    for (path, svg) in &drawings {
        let Some(name) = path.strip_prefix("Frames/").and_then(|path| path.strip_suffix(".svg"))
        else {
            continue;
        };
        let digits = name.as_bytes();
        // `0_310_0`: context, identity, symbol set, status; those of civilians differ in colour.
        if digits.len() != 7 || CONTRADICTORY.contains(&name) {
            continue;
        }
        let code = format!("10{}{}{}0000000000000", &name[..1], &name[2..5], &name[6..7]);
        let Ok(symbol) = Symbol::parse(&code) else {
            assert_eq!(&name[3..5], "98", "{code}");
            continue;
        };
        compared += 1;
        let mut shapes = symbol.shapes();
        shapes.retain(|shape| shape.text.is_none());
        // Where a dash begins is not compared: of dashed frames only what is filled.
        let dashed = shapes.iter().any(|shape| shape.line.is_some_and(|line| line.dash.is_some()));
        let mut svg = svg.clone();
        if dashed {
            shapes.iter_mut().for_each(|shape| shape.line = None);
            svg = svg.replace("stroke=\"#000000\"", "");
        }
        let ours = Picture::of_shapes(&shapes, |role| symbol.color(role));
        let theirs = Picture::of_svg(&svg);
        let silhouette = deviation(&ours.opaque, &theirs.opaque);
        let lines = if dashed { 0.0 } else { deviation(&ours.dark, &theirs.dark) };
        if silhouette.max(lines) > FRAME_TOLERANCE {
            wrong.push(format!("{name}: outline {silhouette:.1}, lines {lines:.1}"));
        }
        let middle = [260, 400];
        if ours.color_at(middle) != theirs.color_at(middle) && &name[2..5] != "000" {
            wrong.push(format!(
                "{name}: colour {:?}, drawn {:?}",
                ours.color_at(middle),
                theirs.color_at(middle)
            ));
        }
    }
    assert!(compared > 80, "only {compared} frames");
    assert!(wrong.is_empty(), "of {compared} frames:\n{}", wrong.join("\n"));
}

/// One icon of the table against its drawings.
struct Score {
    icon: &'static Icon,
    /// The smallest overlap, over all frames that it is drawn for; nothing for a text.
    least: Option<f32>,
    texts: Vec<String>,
}

fn scores(drawings: &std::collections::BTreeMap<String, String>) -> Vec<Score> {
    let mut scores = Vec::new();
    for icon in Icon::all().iter().filter(|icon| icon.code != "00000000") {
        let mut least: Option<f32> = None;
        let mut their_texts = Vec::new();
        let mut found = 0;
        for (suffix, identity) in [("", 3), ("_0", 1), ("_1", 3), ("_2", 4), ("_3", 6)] {
            let name = format!("/{}{suffix}.svg", icon.code);
            let Some((_, svg)) = drawings.iter().find(|(path, _)| path.ends_with(&name)) else {
                continue;
            };
            found += 1;
            let (set, entity) = icon.code.split_at(2);
            let symbol = Symbol::parse(&format!("100{identity}{set}0000{entity}0000"))
                .expect("codes of the table are valid");
            assert_eq!(symbol.name(), icon.name);
            let shapes = symbol.icon_shapes();
            their_texts = texts(svg);
            if their_texts.is_empty() {
                let ours = Picture::of_shapes(&shapes, |role| symbol.color(role));
                let theirs = Picture::of_svg(svg);
                let overlap = overlap(&ours.dark, &theirs.dark);
                least = Some(least.map_or(overlap, |least| least.min(overlap)));
            } else {
                let mut ours: Vec<String> =
                    shapes.iter().filter_map(|shape| shape.text.clone()).collect();
                ours.sort();
                assert_eq!(ours, their_texts, "{} {}", icon.code, icon.name);
            }
        }
        assert!(found > 0, "DISA has no drawing of {} {}", icon.code, icon.name);
        scores.push(Score { icon, least, texts: their_texts });
    }
    scores
}

#[test]
fn icons_overlap_the_drawings_of_disa() {
    let Some(drawings) = drawings() else { return };
    let scores = scores(&drawings);
    let low: Vec<String> = scores
        .iter()
        .filter(|score| score.least.is_some_and(|least| least < LEAST_OVERLAP))
        .map(|score| {
            format!(
                "{} {}: {:.3}",
                score.icon.code,
                score.icon.name,
                score.least.unwrap_or_default()
            )
        })
        .collect();
    assert!(low.is_empty(), "below {LEAST_OVERLAP}:\n{}", low.join("\n"));
    let compared = scores.iter().filter(|score| score.least.is_some()).count();
    assert!(compared >= 70, "only {compared} icons are compared by shape");
    check_page(&scores);
}

/// Writes the table of the page, or checks that it names every icon.
fn check_page(scores: &[Score]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/symbols.md");
    let page = std::fs::read_to_string(&path).expect("the page exists");
    let (before, rest) = page.split_once("| code | icon |").expect("the page has the table");
    let after = rest.split_once("\n\n").map_or("", |(_, after)| after);
    if std::env::var_os("ARMOR_BLESS").is_some() {
        let mut table = "| code | icon | overlap |\n| --- | --- | --- |\n".to_owned();
        for Score { icon, least, texts } in scores {
            let figure = least.map_or_else(
                || format!("text `{}`", texts.join(" ")),
                |least| format!("{least:.2}"),
            );
            writeln!(table, "| {} | {} | {figure} |", icon.code, icon.name)
                .expect("a string grows");
        }
        std::fs::write(&path, format!("{before}{table}\n{after}")).expect("the page is written");
        return;
    }
    for Score { icon, .. } in scores {
        let row = format!("| {} | {} |", icon.code, icon.name);
        assert!(
            page.contains(&row),
            "docs/symbols.md has no row of {}; ARMOR_BLESS=1 writes it",
            icon.code
        );
    }
}

#[test]
fn colours_of_civilian_frames_are_those_of_disa() {
    let Some(drawings) = drawings() else { return };
    for (file, code) in [
        ("Frames/0_415_0c.svg", "10041500001601000000"),
        ("Frames/0_301_0c.svg", "10030100001203000000"),
        ("Frames/0_330_0c.svg", "10033000001407000000"),
        ("Frames/0_135_0c.svg", "10013500001202000000"),
    ] {
        let symbol = Symbol::parse(code).expect(code);
        let drawn = Picture::of_svg(&drawings[file]).color_at([306, 396]);
        assert_eq!(symbol.color(PaintRole::FrameFill), drawn, "{file}");
    }
}
