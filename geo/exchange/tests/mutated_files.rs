//! Files that are damaged at random: each is read or refused, without a panic, and what is read
//! is no larger than the file allows. `ARMOR_FULL=1` damages a million.

use armor_exchange::{PlanFormat, RoutePlan, read_plan, write_plan};

/// One good file of each format, with all that it has place for.
const FILES: [(PlanFormat, &str); 5] = [
    (
        PlanFormat::GroundControl,
        r#"{"fileType":"Plan","version":1,"mission":{"version":2,"plannedHomePosition":[48.1,2.1,35],"items":[
        {"type":"SimpleItem","command":22,"frame":3,"params":[0,0,0,null,48.1,2.1,20],"doJumpId":1},
        {"type":"ComplexItem","complexItemType":"survey","version":5,"TransectStyleComplexItem":{"version":1,"Items":[
        {"type":"SimpleItem","command":16,"frame":3,"params":[0,0,0,null,48.2,2.2,20],"doJumpId":2}]}},
        {"type":"SimpleItem","command":177,"frame":2,"params":[2,3,0,0,0,0,0],"doJumpId":3}]},
        "geoFence":{"version":2,"circles":[{"circle":{"center":[48.1,2.1],"radius":50},"inclusion":true}],
        "polygons":[{"polygon":[[48,2],[48,2.2],[48.2,2.2]],"inclusion":false}],"breachReturn":[48.1,2.1,20]},
        "rallyPoints":{"version":2,"points":[[48.1,2.1,10]]}}"#,
    ),
    (
        PlanFormat::WaypointList,
        "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t48.1\t2.1\t35\t1\n1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1\n2\t0\t3\t16\t5\t0\t0\t0\t48.2\t2.2\t20\t1\n3\t0\t2\t177\t2\t3\t0\t0\t0\t0\t0\t1\n",
    ),
    (
        PlanFormat::Gpx,
        r#"<?xml version="1.0"?><gpx version="1.1"><wpt lat="48.1" lon="2.1"><ele>35</ele><name>A &amp; B</name><type>rally</type></wpt>
        <rte><name>red</name><rtept lat="48.1" lon="2.1"/><rtept lat="48.2" lon="2.2"/></rte>
        <trk><trkseg><trkpt lat="48.3" lon="2.3"><time>2026-01-01T00:00:00Z</time></trkpt></trkseg></trk></gpx>"#,
    ),
    (
        PlanFormat::GeoJson,
        r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"name":"red","names":["A",null]},"geometry":{"type":"LineString","coordinates":[[2.1,48.1,35],[2.2,48.2]]}},
        {"type":"Feature","properties":{"kind":"no-go"},"geometry":{"type":"Polygon","coordinates":[[[2,48],[2.2,48],[2.2,48.2],[2,48]]]}},
        {"type":"Feature","properties":{"kind":"rally","radius_m":5},"geometry":{"type":"Point","coordinates":[2.1,48.1]}}]}"#,
    ),
    (
        PlanFormat::Kml,
        r##"<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document><Folder><Placemark><name>red</name><LineString><altitudeMode>absolute</altitudeMode><coordinates>2.1,48.1,35 2.2,48.2,36</coordinates></LineString></Placemark>
        <Placemark><styleUrl>#no-go</styleUrl><Polygon><outerBoundaryIs><LinearRing><coordinates>2,48 2.2,48 2.2,48.2 2,48</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></Folder></Document></kml>"##,
    ),
];

fn size_of(plan: &RoutePlan) -> usize {
    let items: usize = plan.routes.iter().map(|route| route.items.len() + 1).sum();
    items + plan.fences.len() + plan.rally_points.len() + plan.points.len() + plan.notes.len()
}

/// Changes a few bytes: replaced, removed, doubled, or pieces of the file copied elsewhere.
fn damage(bytes: &mut Vec<u8>, random: &mut fastrand::Rng) {
    const PIECES: [&[u8]; 12] = [
        b"null",
        b"-1",
        b"1e999",
        b"99999999999999999999",
        b"NaN",
        b"\"",
        b"<",
        b"&",
        b"]]>",
        b"{",
        b"[",
        b"\xff",
    ];
    for _ in 0..random.usize(1..5) {
        let at = random.usize(..=bytes.len());
        match random.u8(..5) {
            0 if at < bytes.len() => bytes[at] = random.u8(..),
            1 if at < bytes.len() => {
                let end = (at + random.usize(1..20)).min(bytes.len());
                bytes.drain(at..end);
            }
            2 if at < bytes.len() => {
                let end = (at + random.usize(1..200)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                let to = random.usize(..=bytes.len());
                bytes.splice(to..to, piece);
            }
            3 => {
                let piece = PIECES[random.usize(..PIECES.len())];
                bytes.splice(at..at, piece.iter().copied());
            }
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
}

#[test]
fn damaged_files_are_read_or_refused() {
    let count = if std::env::var_os("ARMOR_FULL").is_some() { 200_000 } else { 4_000 };
    for (format, text) in FILES {
        let plan =
            read_plan(text, format).unwrap_or_else(|error| panic!("{}: {error}", format.name()));
        assert!(size_of(&plan) >= 4, "{}: {plan:?}", format.name());
        let mut random = fastrand::Rng::with_seed(19);
        let (mut read, mut refused) = (0, 0);
        for _ in 0..count {
            let mut bytes = text.as_bytes().to_vec();
            damage(&mut bytes, &mut random);
            let damaged = String::from_utf8_lossy(&bytes);
            match read_plan(&damaged, format) {
                Ok(plan) => {
                    read += 1;
                    // Each item stands for some characters of the file.
                    assert!(size_of(&plan) <= damaged.len(), "{damaged}");
                    for to in PlanFormat::ALL {
                        // Several routes are the only reason not to write what was read.
                        if let Ok((written, _)) = write_plan(&plan, *to) {
                            assert!(written.len() < 64 * damaged.len() + 4096, "{damaged}");
                        }
                    }
                    if let Ok((written, _)) = write_plan(&plan, format) {
                        let again = read_plan(&written, format);
                        // A line without positions cannot be read again in KML.
                        let empty = plan.routes.iter().any(|route| route.items.is_empty());
                        assert!(again.is_ok() || empty, "{damaged}\n{written}\n{again:?}");
                    }
                }
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().len() < 1000, "{error}");
                }
            }
        }
        assert!(read > count / 100 && refused > count / 100, "{}: {read} {refused}", format.name());
    }
}

#[test]
fn nesting_and_size_are_limited() {
    let deep = format!("<kml>{}</kml>", "<Folder>".repeat(100_000));
    let error = read_plan(&deep, PlanFormat::Kml).expect_err("too deep").to_string();
    assert!(error.contains("within each other"), "{error}");
    let deep = "[".repeat(1_000_000);
    assert!(read_plan(&deep, PlanFormat::GeoJson).is_err());
    let large = " ".repeat(17 << 20);
    let error = read_plan(&large, PlanFormat::Gpx).expect_err("too large").to_string();
    assert!(error.contains("17825792 bytes"), "{error}");
    let many =
        format!("{{\"type\":\"LineString\",\"coordinates\":[{}[0,0]]}}", "[0,0],".repeat(100_001));
    let error = read_plan(&many, PlanFormat::GeoJson).expect_err("too many").to_string();
    assert!(error.contains("more than 100000"), "{error}");
}
