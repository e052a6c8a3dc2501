//! `armor eval` from outside: its reports on valid files and on invalid ones.

use crate::fixture::{Folder, run_to_end};

const TITLES: &str = "scan,timestamp_s,x_m,y_m,theta_rad\n";

/// A quarter of a circle of 5 m, every 0.1 s, moved to the side.
fn way(aside_m: f64, begin_s: f64) -> String {
    let line = |i: u32| {
        let (part, stamp_s) = (f64::from(i) * 0.05, begin_s + f64::from(i) * 0.1);
        let (x_m, y_m) = (5.0 * part.cos() + aside_m, 5.0 * part.sin());
        format!("{i},{stamp_s:.3},{x_m:.6},{y_m:.6},{part:.6}\n")
    };
    TITLES.to_owned() + &(0..40).map(line).collect::<String>()
}

/// One relation that agrees with the trajectory, and one that is off by half a metre.
const RELATIONS: &str = "i,j,kind,dx_m,dy_m,dtheta_rad\n\
    0,1,next,0.006248,0.249896,0.05\n0,2,revisit,0.024979,0.999167,0.1\n";

fn eval(folder: &Folder, arguments: &[&str]) -> (i32, String, String) {
    run_to_end(&mut folder.armor(&[&["eval"], arguments].concat()))
}

/// The report on a good run.
fn good(folder: &Folder) {
    folder.write("found.csv", &way(0.0, 100.0));
    folder.write("moved.csv", &way(3.0, 100.0));
    folder.write("known.csv", RELATIONS);
}

#[test]
fn a_good_run_is_measured_in_words_and_numbers() {
    let folder = Folder::new("eval");
    good(&folder);
    let files = ["found.csv", "--relations", "known.csv", "--reference", "moved.csv"];
    let (code, out, err) = eval(&folder, &files);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(out.contains("next") && out.contains("rms 0.0000 m"), "{out}");
    let (code, out, _) = eval(&folder, &[&files[..], &["--format", "json"]].concat());
    assert_eq!(code, 0);
    let report: serde_json::Value = serde_json::from_str(&out).expect("one line of JSON");
    let mean = |kind: &str| report["relations"][kind]["metres"]["mean"].as_f64().expect("a number");
    assert!(mean("next") < 0.13 && (mean("revisit") - 0.5).abs() < 0.01, "{report}");
    assert!(report["absolute"]["rms_m"].as_f64().is_some_and(|rms_m| rms_m < 1e-5), "{report}");
    assert_eq!(report["worst"][0]["j"], 2, "{report}");
}

#[test]
fn a_reference_of_another_clock_is_compared_by_time() {
    let folder = Folder::new("eval-time");
    good(&folder);
    // The same trajectory, but its first pose is the twentieth of the other file.
    let late: String = way(3.0, 100.0).lines().skip(21).map(|line| format!("{line}\n")).collect();
    let renumbered = late
        .lines()
        .enumerate()
        .map(|(i, line)| format!("{i},{}\n", line.split_once(',').expect("columns").1));
    folder.write("truth.csv", &(TITLES.to_owned() + &renumbered.collect::<String>()));
    let (code, out, err) = eval(&folder, &["found.csv", "--reference", "truth.csv"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("rms 0.0000 m"), "{out}");
}

#[test]
fn pictures_are_drawn_in_both_forms() {
    let folder = Folder::new("eval-plot");
    good(&folder);
    for (name, begins) in [("errors.svg", b"<svg".as_slice()), ("errors.png", b"\x89PNG")] {
        let arguments = ["found.csv", "--relations", "known.csv", "--plot", name];
        let (code, _, err) = eval(&folder, &arguments);
        assert_eq!(code, 0, "{err}");
        let bytes = std::fs::read(folder.path().join(name)).expect("the picture");
        assert!(bytes.starts_with(begins) && bytes.len() > 2_000, "{name}: {}", bytes.len());
    }
    folder.write("curve.csv", "scan,seconds\n0,0.1\n1,0.3\n2,0.2\n");
    let (code, _, err) = eval(&folder, &["--curve", "curve.csv", "--plot", "curve.svg"]);
    assert_eq!(code, 0, "{err}");
    let svg = std::fs::read_to_string(folder.path().join("curve.svg")).expect("the curve");
    assert!(svg.contains("seconds over scan") && svg.contains("0.300"), "{svg}");
}

/// A map of 30 x 20 cells of 10 cm: a room with a wall across, from its corner.
fn map(folder: &Folder, name: &str, corner_m: f64, wall_column: usize) {
    let cell = |i: usize| {
        let (x, y) = (i % 30, i / 30);
        let is_wall = x == 0 || y == 0 || x == 29 || y == 19 || (x == wall_column && y > 5);
        if is_wall { 0 } else { 254 }
    };
    let pixels: Vec<u8> = (0..600).map(cell).collect();
    let pgm = [b"P5\n30 20\n255\n".as_slice(), &pixels].concat();
    std::fs::write(folder.path().join(format!("{name}.pgm")), pgm).expect("writable");
    folder.write(
        &format!("{name}.yaml"),
        &format!(
            "image: {name}.pgm\nresolution: 0.1\norigin: [{corner_m}, 0.0, 0.0]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        ),
    );
}

#[test]
fn maps_are_compared_in_place_or_aligned() {
    let folder = Folder::new("eval-map");
    map(&folder, "one", 0.0, 12);
    map(&folder, "shifted", 0.5, 12);
    map(&folder, "other", 0.0, 20);
    let found = |arguments: &[&str]| -> [f64; 2] {
        let arguments = [&["--map", "one.yaml", "--format", "json"], arguments].concat();
        let (code, out, err) = eval(&folder, &arguments);
        assert_eq!(code, 0, "{err}");
        let report: serde_json::Value = serde_json::from_str(&out).expect("one line of JSON");
        ["found", "right"].map(|what| report["map"]["walls"][what].as_f64().expect("a share"))
    };
    assert_eq!(found(&["--reference-map", "one.yaml"]), [1.0, 1.0]);
    let other = found(&["--reference-map", "other.yaml"]);
    assert!(other.iter().all(|&share| (0.8..0.95).contains(&share)), "one wall is off: {other:?}");
    let shifted = found(&["--reference-map", "shifted.yaml"]);
    assert!(shifted[0] < 0.7, "{shifted:?}");
    let laid = found(&["--reference-map", "shifted.yaml", "--align"]);
    assert!(laid.iter().all(|&share| share > 0.98), "{laid:?}");
}

#[test]
fn faults_are_named_with_their_position() {
    let folder = Folder::new("eval-wrong");
    good(&folder);
    folder.write("broken.csv", &format!("{TITLES}0,1.0,2.0,3.0,0.1\n1,1.1,two,3.0,0.1\n"));
    folder.write("alone.csv", &way(0.0, 9_000.0).replace("\n0,", "\n900,"));
    let late = way(0.0, 9e3).replace('\n', "\n5");
    folder.write("late.csv", late.trim_end_matches('5'));
    let check = |arguments: &[&str], code: i32, words: &[&str]| {
        let (ended, out, err) = eval(&folder, arguments);
        assert_eq!((ended, out.as_str()), (code, ""), "{arguments:?}: {err}");
        for word in words {
            assert!(err.contains(word), "{arguments:?}: {word} in {err}");
        }
    };
    check(&["no.csv", "--relations", "known.csv"], 1, &["no.csv", "No such file"]);
    check(&["broken.csv", "--reference", "found.csv"], 1, &["broken.csv", "line 3", "1,1.1,two"]);
    check(&["found.csv", "--relations", "moved.csv"], 1, &["moved.csv", "i,j,kind,dx_m"]);
    check(
        &["found.csv", "--reference", "late.csv"],
        1,
        &["late.csv", "are they from the same run"],
    );
    check(&["found.csv"], 1, &["--relations"]);
    check(&["found.csv", "--reference", "moved.csv", "--plot", "a.gif"], 1, &["a.gif", ".png"]);
    check(&["--map", "no.yaml", "--reference-map", "no.yaml"], 1, &["no.yaml"]);
    check(&["--map", "one.yaml"], 2, &["--reference-map"]);
    check(&[], 2, &["TRAJECTORY"]);
}
