use proptest::prelude::*;

use super::*;

const START: &str = r#"<circle id="start" cx="1" cy="2" r="0.2"/>"#;

/// Reads shapes on lines of their own, from line 2 on, after a start on line 1.
fn read(shapes: &str) -> Result<WorldDrawing, DrawingError> {
    WorldDrawing::parse(
        "world.svg",
        format!("<svg>{START}\n{shapes}\n</svg>").as_bytes(),
        &WorldStart::default(),
    )
}

/// The corners that a shape is drawn with: each segment's first end, and the last one's second.
#[track_caller]
fn check(shape: &str, corners: &[(f64, f64)]) {
    let drawing = read(shape).expect("a readable shape");
    let mut drawn: Vec<_> = drawing.segments.iter().map(|s| s.from_m).collect();
    drawn.push(drawing.segments[drawing.segments.len() - 1].to_m);
    assert_eq!(drawn, corners, "{shape}");
}

#[track_caller]
fn check_fault(shapes: &str, line: usize, fault: &DrawingFault) {
    let error = read(shapes).expect_err("a fault");
    assert_eq!((&error.fault, error.line), (fault, line), "{error}");
    assert!(error.to_string().starts_with(&format!("world.svg:{line}: ")), "{error}");
}

#[test]
fn every_shape_becomes_its_outline_with_y_up() {
    check(r#"<line x1="1" y1="2" x2="3" y2="4"/>"#, &[(1.0, -2.0), (3.0, -4.0)]);
    check(r#"<polyline points="0,0 1,0 1,1"/>"#, &[(0.0, 0.0), (1.0, 0.0), (1.0, -1.0)]);
    let triangle = [(0.0, 0.0), (1.0, 0.0), (1.0, -1.0), (0.0, 0.0)];
    check(r#"<polygon points="0 0 1 0 1 1"/>"#, &triangle);
    check(r#"<path d="M0 0 h1 V1 z"/>"#, &triangle);
    check(
        r#"<rect x="1" y="2" width="3" height="4"/>"#,
        &[(1.0, -2.0), (4.0, -2.0), (4.0, -6.0), (1.0, -6.0), (1.0, -2.0)],
    );
}

#[test]
fn a_circle_stays_within_half_a_millimetre() {
    for radius in [0.05, 0.3, 7.0] {
        let drawing = read(&format!(r#"<circle cx="2" cy="-3" r="{radius}"/>"#)).expect("a circle");
        for Segment { from_m: (x, y), to_m: (to_x, to_y) } in drawing.segments {
            assert!(((x - 2.0).hypot(y - 3.0) - radius).abs() < 1e-9);
            let middle = (x.midpoint(to_x) - 2.0).hypot(y.midpoint(to_y) - 3.0);
            assert!(radius - middle < 0.000_501, "{radius} {middle}");
        }
    }
}

#[test]
fn transforms_of_groups_and_shapes_compose() {
    check(
        r#"<g transform="translate(10 0)"><g transform="scale(2)">
           <line x1="1" y1="1" x2="2" y2="1" transform="translate(0,1)"/></g></g>"#,
        &[(12.0, -4.0), (14.0, -4.0)],
    );
}

#[test]
fn annotations_hidden_and_foreign_elements_are_not_solid() {
    let drawing = read(
        r#"<title>x</title><defs><ellipse/></defs><text>hall</text><sodipodi:view/>
        <g class="floor annotation"><ellipse/><rect width="oops"/></g>
        <image class="annotation"/><g style="stroke:red; display: none"><image/></g>
        <line x2="1"/><!-- wall --><g/>"#,
    );
    assert_eq!(drawing.expect("readable").segments.len(), 1);
}

#[test]
fn the_start_follows_its_transforms() {
    let start = |circle: &str| {
        let text = format!(r#"<svg><line x2="1"/>{circle}</svg>"#);
        WorldDrawing::parse("w", text.as_bytes(), &WorldStart::default()).expect("readable").start
    };
    let plain = start(r#"<circle id="start" cx="1" cy="2" data-heading="90"/>"#);
    assert_eq!((plain.x_m, plain.y_m), (1.0, -2.0));
    assert!((plain.yaw_rad.to_degrees() - 90.0).abs() < 1e-9);
    // SVG turns clockwise on the screen.
    let turned = start(
        r#"<g transform="translate(5 5) rotate(30)">
           <circle id="start" data-heading="90"/></g>"#,
    );
    assert_eq!((turned.x_m, turned.y_m), (5.0, -5.0));
    assert!((turned.yaw_rad.to_degrees() - 60.0).abs() < 1e-9);
}

#[test]
fn one_of_several_starts_is_taken_or_what_is_given_instead() {
    let text = r#"<svg><line x2="1"/><circle class="start" id="blue" cx="3" cy="4"/></svg>"#;
    let start = |id: &str, otherwise| {
        let start = WorldStart { id: id.to_owned(), otherwise };
        WorldDrawing::parse("w", text.as_bytes(), &start).map(|d| (d.start, d.start_line))
    };
    let given = Pose2::new(5.0, 6.0, 0.5);
    assert_eq!(start("blue", Some(given)), Ok((Pose2::new(3.0, -4.0, 0.0), Some(1))));
    assert_eq!(start("start", Some(given)), Ok((Pose2::new(5.0, -6.0, 0.5), None)));
    let no = |id: &str| DrawingFault::NoStart(id.to_owned());
    assert_eq!(start("start", None).expect_err("none").fault, no("start"));
    assert_eq!(start("red", Some(given)).expect_err("none").fault, no("red"));
}

#[test]
fn the_ways_of_people_are_not_solid() {
    let drawing = read(
        r#"<line x2="1"/><path class="person" d="M1 1 H3 V2" data-speed="0.7"/>
        <g transform="translate(1 1)"><polygon class="person" points="0,0 1,0 1,1"/></g>"#,
    );
    let drawing = drawing.expect("readable");
    assert_eq!(drawing.segments.len(), 1);
    let corners = vec![(1.0, -1.0), (3.0, -1.0), (3.0, -2.0)];
    let round = vec![(1.0, -1.0), (2.0, -1.0), (2.0, -2.0), (1.0, -1.0)];
    let expected = [
        WalkedRoute { points: corners, speed_mps: 0.7 },
        WalkedRoute { points: round, speed_mps: 1.0 },
    ];
    assert_eq!(drawing.routes, expected);
    for wrong in [
        r#"<circle class="person" r="1"/>"#,
        r#"<path class="person" d="M1 1"/>"#,
        r#"<path class="person" d="M1 1 h1 M3 3 h1"/>"#,
        r#"<line class="person" x2="1" data-speed="11"/>"#,
        r#"<line class="person" x2="1" data-speed="-1"/>"#,
    ] {
        assert!(matches!(read(wrong).expect_err(wrong).fault, DrawingFault::Route(_)), "{wrong}");
    }
}

#[test]
fn faults_name_their_line_and_what_is_wrong() {
    use DrawingFault as F;
    let bad = |attribute: &str, value: &str| F::BadNumber {
        attribute: attribute.to_owned(),
        value: value.to_owned(),
    };
    let unknown = |name: &str| F::UnknownElement(name.to_owned());
    let cases = [
        ("<line x2=\"1\"/>\n\n<ellipse/>", 4, unknown("ellipse")),
        ("<g>\n<use/></g>", 3, unknown("use")),
        ("<svg/>", 2, unknown("svg")),
        (r#"<line x1="3px"/>"#, 2, bad("x1", "3px")),
        (r#"<polyline points="1,2 3,oops"/>"#, 2, bad("points", "oops")),
        (r#"<polygon points="1 2 3"/>"#, 2, F::OddPoints(3)),
        (
            r#"<rect width="1"/>"#,
            2,
            F::MissingAttribute { element: "rect".to_owned(), attribute: "height" },
        ),
        (r#"<circle r="-1"/>"#, 2, F::NegativeSize { attribute: "r", value: -1.0 }),
        (r#"<rect width="1" height="1" rx="0.1"/>"#, 2, F::RoundedCorners("rx")),
        (r#"<path d="M0 0 Q1 1 2 2"/>"#, 2, F::PathCommand('Q')),
        ("\n<path d=\"M0 0 L1\"/>", 3, F::PathData("L1".to_owned())),
        (r#"<g transform="skewX(4)"/>"#, 2, F::Transform("skewX(4)".to_owned())),
        (r#"<g transform="scale(1e9)"><line x2="1"/></g>"#, 2, F::TooFar),
        (r#"<circle id="start"/>"#, 2, F::SecondStart("start".to_owned())),
    ];
    for (shapes, line, fault) in cases {
        check_fault(shapes, line, &fault);
    }
}

#[test]
fn files_that_are_no_world_are_refused() {
    use DrawingFault as F;
    let fault = |text: &[u8]| {
        WorldDrawing::parse("w", text, &WorldStart::default()).expect_err("a fault").fault
    };
    let wall = r#"<line x2="1"/>"#;
    assert_eq!(fault(b""), F::Empty);
    assert_eq!(fault(b"\xff<svg/>"), F::NotUtf8);
    assert_eq!(fault(b"<html/>"), F::NotSvg("html".to_owned()));
    assert_eq!(fault(b"<!DOCTYPE svg><svg/>"), F::Doctype);
    assert_eq!(fault(format!("<svg>{wall}</svg>").as_bytes()), F::NoStart("start".to_owned()));
    assert_eq!(fault(format!("<svg>{START}</svg>").as_bytes()), F::NoWalls);
    let text = format!(r#"<svg><rect id="start" width="1" height="1"/>{wall}</svg>"#);
    assert_eq!(fault(text.as_bytes()), F::StartNotCircle("rect".to_owned()));
    for broken in ["<svg>", "<svg></g></svg>", "<svg/><svg/>", "<svg a=\"1\" a=\"2\"/>", "<svg"] {
        assert!(matches!(fault(broken.as_bytes()), F::Xml(_)), "{broken}");
    }
    let missing = WorldDrawing::read(Path::new("no/such/world.svg"), &WorldStart::default())
        .expect_err("no such file");
    assert!(matches!(missing.fault, F::Unreadable(_)) && missing.file == "no/such/world.svg");
}

#[test]
fn limits_hold() {
    use DrawingFault as F;
    let fault = |text: &str| read(text).expect_err("a limit").fault;
    assert_eq!(fault(&"<g>".repeat(limits::DEPTH)), F::TooDeep);
    assert_eq!(fault(&"<g/>".repeat(limits::ELEMENTS)), F::TooManyElements);
    assert_eq!(fault(&" ".repeat(limits::BYTES)), F::TooLarge);
    let many: String = (0..=limits::ATTRIBUTES).map(|i| format!(" a{i}=\"\"")).collect();
    assert_eq!(fault(&format!("<g{many}/>")), F::TooManyAttributes("g".to_owned()));
    let points = "1 1 2 2 ".repeat(limits::SEGMENTS / 2 + 1);
    assert_eq!(fault(&format!("<polyline points=\"{points}\"/>")), F::TooManySegments);
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = WorldDrawing::parse("w", &bytes, &WorldStart::default());
    }

    #[test]
    fn any_mixture_of_svg_pieces_is_read_or_refused(
        pieces in proptest::collection::vec(0..PIECES.len(), 0..60),
        noise in "\\PC{0,12}",
    ) {
        let mut text = String::from("<svg>");
        for piece in pieces {
            text.push_str(if PIECES[piece].is_empty() { &noise } else { PIECES[piece] });
        }
        text.push_str("</svg>");
        if let Ok(drawing) = WorldDrawing::parse("w", text.as_bytes(), &WorldStart::default()) {
            for Segment { from_m, to_m } in drawing.segments {
                for coordinate in [from_m.0, from_m.1, to_m.0, to_m.1] {
                    prop_assert!(coordinate.abs() <= limits::COORDINATE_M);
                }
            }
        }
    }

    #[test]
    fn any_attribute_value_is_read_or_refused(value in "[-0-9.eEMmLlHhVvZz ,()a-z\u{e9}&;]{0,40}") {
        for shape in ["path d", "polyline points", "rect width", "g transform", "circle r"] {
            let text = format!("<svg>{START}<line x2=\"1\"/><{shape}=\"{value}\"/></svg>");
            let _ = WorldDrawing::parse("w", text.as_bytes(), &WorldStart::default());
        }
    }
}

/// Pieces that hostile drawings are put together from; the empty one stands for noise.
const PIECES: [&str; 18] = [
    "",
    START,
    "<g>",
    "</g>",
    "<g transform=\"scale(-1e3 1e-3) rotate(1e300)\">",
    "<g class=\"annotation\">",
    "<line x1=\"-1e3\" y2=\"1e3\"/>",
    "<path d=\"M1e3-1e3zl-1-1h1e9\"/>",
    "<path d=\"m.5.5.5.5z\"/>",
    "<circle r=\"1e-300\"/>",
    "<circle r=\"999\" cx=\"&#49;\"/>",
    "<rect width=\"0\" height=\"0\"/>",
    "<polygon points=\"1\"/>",
    "<polyline points=\"0 0 0 0\"/>",
    "<![CDATA[<line/>]]>",
    "<!-- -- -->",
    "&lol;",
    "<?xml version=\"1.0\"?>",
];
