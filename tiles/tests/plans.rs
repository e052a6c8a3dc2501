//! Grid maps, drawn worlds and GeoJSON.

use armor_tiles::{MapReference, OpenFault, PlaneBounds, PlanePoint, Source, SourceKind, TileId};
use tempfile::tempdir;

use crate::written::{pixel, png_bytes, write};

const FIRST: TileId = TileId { level: 0, column: 0, row: 0 };

fn yaml(image: &str, yaw: f64, negate: u8) -> String {
    format!(
        "image: {image}\nresolution: 0.05\norigin: [-1.0, 2.0, {yaw}]\nnegate: {negate}\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
}

#[test]
fn a_grid_map_lies_on_its_origin() {
    let folder = tempdir().unwrap();
    write(folder.path(), "map.pgm", b"P5\n4 2\n200\n\x00\x64\xc8\xc8\xc8\xc8\xc8\x00");
    let path = write(folder.path(), "map.yaml", yaml("map.pgm", 0.0, 0));
    let source = Source::open(&path).unwrap();
    assert_eq!((source.kind(), source.reference()), (SourceKind::MapServer, MapReference::Local));
    let bounds = source.bounds();
    assert!((bounds.min.x + 1.0).abs() < 1e-9 && (bounds.min.y - 2.0).abs() < 1e-9);
    assert!((bounds.max.x + 0.8).abs() < 1e-9 && (bounds.max.y - 2.1).abs() < 1e-9);
    let image = source.decode(FIRST).unwrap().unwrap();
    assert_eq!(
        [pixel(&image, 0, 0)[0], pixel(&image, 1, 0)[0], pixel(&image, 2, 0)[0]],
        [0, 127, 255]
    );

    // A quarter turn about the lower left corner: the columns point up.
    let path = write(folder.path(), "map.yaml", yaml("map.pgm", std::f64::consts::FRAC_PI_2, 1));
    let source = Source::open(&path).unwrap();
    let image = source.decode(FIRST).unwrap().unwrap();
    assert_eq!(pixel(&image, 0, 0), [255; 3]);
    let [top_left, top_right, ..] = image.corners;
    let is_at = |at: PlanePoint, x: f64, y: f64| (at.x - x).abs() < 1e-9 && (at.y - y).abs() < 1e-9;
    assert!(is_at(top_left, -1.1, 2.0) && is_at(top_right, -1.1, 2.2), "{:?}", image.corners);

    write(folder.path(), "map.png", png_bytes(3, 3, |column, _| [column as u8 * 100; 3]));
    let source = Source::open(&write(folder.path(), "map.yaml", yaml("map.png", 0.0, 0))).unwrap();
    assert_eq!(pixel(&source.decode(FIRST).unwrap().unwrap(), 2, 0), [200; 3]);
}

#[test]
fn a_fault_of_a_grid_map_names_file_and_line() {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), "map.yaml", yaml("map.pgm", 0.0, 0).replace("0.05", "5cm"));
    let error = Source::open(&path).unwrap_err();
    assert!(error.to_string().contains("map.yaml, line 2: `5cm`"), "{error}");
    let error = Source::open(&write(folder.path(), "map.yaml", yaml("map.pgm", 0.0, 0)));
    let error = error.unwrap_err();
    assert!(error.file.ends_with("map.pgm") && matches!(error.fault, OpenFault::Unreadable(_)));
}

#[test]
fn a_drawn_world_lies_on_its_start() {
    let folder = tempdir().unwrap();
    let world = r#"<svg><rect x="0" y="0" width="20" height="10"/>
        <circle id="start" cx="5" cy="4" r="0.2" data-heading="90"/></svg>"#;
    let source = Source::open(&write(folder.path(), "world.svg", world)).unwrap();
    assert_eq!((source.kind(), source.reference()), (SourceKind::SvgWorld, MapReference::Local));
    // Seen from the start, up on the sheet is ahead: x −6 to 4, y −15 to 5, and a border of 0.25 m.
    let bounds = source.bounds();
    let expected = PlaneBounds::new(-6.25, -15.25, 4.25, 5.25);
    let corners = bounds.corners().into_iter().zip(expected.corners());
    assert!(corners.into_iter().all(|(a, b)| (a.x - b.x).hypot(a.y - b.y) < 1e-9), "{bounds:?}");
    // The wall on the left of the robot is at y = 5.
    let image = source.decode(FIRST).unwrap().unwrap();
    let scale = 512.0 / 20.5;
    let opacity = |x: f64, y: f64| {
        let (column, row) = ((x - bounds.min.x) * scale, (bounds.max.y - y) * scale);
        image.rgba[(row as usize * 512 + column as usize) * 4 + 3]
    };
    assert!(opacity(0.0, 5.0) > 128 && opacity(4.0, 0.0) > 128);
    assert_eq!(opacity(0.0, 0.0), 0);
    let near = source.wanted(PlaneBounds::new(-1.0, -1.0, 1.0, 1.0), 200.0);
    assert!(near.len() <= 4 && near[0].level == 3, "{near:?}");
    assert_eq!(source.decode(near[0]).unwrap(), None, "nothing is drawn there");

    // Without a start: as it is drawn, y up.
    let world = "<svg><line x1=\"0\" y1=\"0\" x2=\"10\" y2=\"-5\"/></svg>";
    let source = Source::open(&write(folder.path(), "world.svg", world)).unwrap();
    assert_eq!(source.bounds(), PlaneBounds::new(-0.25, -0.25, 10.25, 5.25));
    let error = Source::open(&write(folder.path(), "world.svg", "<svg>\n<blob/></svg>"));
    let error = error.unwrap_err();
    assert!(error.to_string().contains("world.svg, line 2: <blob>"), "{error}");
}

#[test]
fn a_floor_plan_is_in_degrees_or_in_what_it_states() {
    let folder = tempdir().unwrap();
    let plan = |crs: &str, geometry: &str| {
        let text = format!(
            r#"{{"type":"FeatureCollection",{crs}"features":[{{"type":"Feature","properties":{{}},"geometry":{geometry}}}]}}"#
        );
        Source::open(&write(folder.path(), "plan.geojson", text))
    };
    let local = r#""crs":{"type":"name","properties":{"name":"local"}},"#;
    let ring = r#"{"type":"Polygon","coordinates":[[[0,0],[40,0],[40,20],[0,20],[0,0]],[[10,5],[30,5],[30,15],[10,15],[10,5]]]}"#;
    let source = plan(local, ring).unwrap();
    assert_eq!((source.kind(), source.reference()), (SourceKind::GeoJson, MapReference::Local));
    let bounds = source.bounds();
    assert_eq!(bounds, PlaneBounds::new(-0.4, -0.4, 40.4, 20.4));
    let image = source.decode(FIRST).unwrap().unwrap();
    let scale = 512.0 / 40.8;
    let opacity = |x: f64, y: f64| {
        let (column, row) = ((x - bounds.min.x) * scale, (bounds.max.y - y) * scale);
        image.rgba[(row as usize * 512 + column as usize) * 4 + 3]
    };
    assert_eq!((opacity(5.0, 10.0), opacity(20.0, 10.0)), (115, 0));

    let line = r#"{"type":"LineString","coordinates":[[2.0,48.0,35],[3.0,49.0]]}"#;
    let source = plan("", line).unwrap();
    assert_eq!(source.reference(), MapReference::WebMercator);
    assert!((source.bounds().min.x - 222_638.98 + 1_680.07).abs() < 1.0, "{source:?}");
    let utm = r#""crs":{"type":"name","properties":{"name":"urn:ogc:def:crs:EPSG::32631"}},"#;
    assert_eq!(plan(utm, line).unwrap().reference().epsg(), Some(32_631));

    let refused = |crs: &str, geometry: &str| plan(crs, geometry).unwrap_err();
    let other = r#""crs":{"type":"name","properties":{"name":"EPSG:25832"}},"#;
    assert_eq!(refused(other, line).fault, OpenFault::Reference("EPSG 25832".to_owned()));
    let error = refused("", r#"{"type":"LineString","coordinates":[[2.0,98.0],[3.0,49.0]]}"#);
    assert!(error.to_string().contains("feature 1: latitude 98"), "{error}");
    assert_eq!(refused("", r#"{"type":"Point","coordinates":[1,2]}"#).fault, OpenFault::NoShapes);
    let error = refused("", r#"{"type":"Blob"}"#);
    assert!(error.to_string().contains("`Blob`"), "{error}");
    let error = Source::open(&write(folder.path(), "plan.json", "{\n\"type\": }")).unwrap_err();
    assert_eq!(error.place, "line 2");
}
