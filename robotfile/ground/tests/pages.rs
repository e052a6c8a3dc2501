//! The pages of the findings over the grid: the example in each gives its finding, prints what the page
//! shows, and has no finding in its fixed form. `ARMOR_BLESS=1` writes what is printed.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::fs;

use armor_robotfile::{Code, Colours, FindingOrigin, Findings, PageExample, check, read};

/// Cells of half a metre.
const RESOLUTION_M: f64 = 0.5;
/// The lower left corner.
const ORIGIN: [f64; 2] = [-3.0, -5.0];

/// The grid of the examples, `site.yaml`: 18 m × 16 m, with a wall at x = 6 from the bottom up to y = 5.
fn write_site() {
    let (width, height) = (36, 32);
    let mut pixels = Vec::new();
    for row in (0..height).rev() {
        for column in 0..width {
            let centre =
                |number: i32, origin: f64| origin + (f64::from(number) + 0.5) * RESOLUTION_M;
            let (x_m, y_m) = (centre(column, ORIGIN[0]), centre(row, ORIGIN[1]));
            let is_wall = (5.75..6.25).contains(&x_m) && y_m < 5.0;
            pixels.push(if is_wall { 0_u8 } else { 254 });
        }
    }
    let mut picture = format!("P5\n{width} {height}\n255\n").into_bytes();
    picture.extend(pixels);
    fs::write("site.pgm", picture).unwrap();
    let mut yaml = String::from("image: site.pgm\n");
    writeln!(yaml, "resolution: {RESOLUTION_M}").unwrap();
    writeln!(yaml, "origin: [{}, {}, 0.0]", ORIGIN[0], ORIGIN[1]).unwrap();
    yaml += "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    fs::write("site.yaml", yaml).unwrap();
}

fn check_example(example: &PageExample) -> Findings {
    let bytes = example.file("robot.xml").unwrap().to_vec();
    let reading = read("robot.xml".as_ref(), &mut |_| Ok(bytes.clone()));
    let reading = check(reading, &[], None);
    let mut findings = reading.findings.clone();
    findings.extend_new(armor_ground::check_ground(reading.configuration.as_ref().unwrap()));
    findings
}

#[test]
fn every_page_shows_what_is_found_and_its_fixed_example_has_nothing() {
    let pages = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/errors");
    let folder = tempfile::tempdir().unwrap();
    // The grid is named relative to the file. This program has one test.
    std::env::set_current_dir(folder.path()).unwrap();
    write_site();
    for code in Code::ALL.iter().copied().filter(|code| code.origin() == FindingOrigin::Ground) {
        let findings = check_example(&code.faulty_example().unwrap());
        let rendered = findings.render(Colours::No);
        assert!(findings.iter().all(|it| it.code == code) && !findings.is_empty(), "{rendered}");
        let rendered = rendered.rsplit_once("\n\n").map_or(rendered.as_str(), |found| found.0);
        let page = code.page();
        let printed = page.split("```text\n").nth(1).unwrap().split("```").next().unwrap();
        if std::env::var_os("ARMOR_BLESS").is_some() {
            let old = format!("```text\n{printed}```");
            let page = page.replacen(&old, &format!("```text\n{rendered}\n```"), 1);
            fs::write(format!("{pages}/{}.md", code.as_str()), page).unwrap();
        } else {
            assert_eq!(rendered.trim_end(), printed.trim_end(), "{code:?}");
        }
        let fixed = check_example(&code.fixed_example().unwrap());
        assert!(fixed.is_empty(), "{code:?}, fixed:\n{}", fixed.render(Colours::No));
    }
}
