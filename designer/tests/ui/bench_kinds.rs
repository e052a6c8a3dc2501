//! Kinds for the tests: an eye, an arm, a lamp, a relay of any type, and one of everything.

use armor_designer::Kinds;
use armor_wire::manifest::{
    EventManifest, Manifest, ParameterManifest, ParameterType, PortManifest,
};

const IMAGE: &str = "Image{width:u32,height:u32}";
const POINT: &str = "Point{x:f64,y:f64}";
const OTHER_POINT: &str = "Point{x:f64,y:f64,z:f64}";

fn port(id: &str, type_name: &str, schema: &str, required: bool) -> PortManifest {
    // Any two numbers serve, as long as they are the schemas' own.
    let schema_hash = schema
        .bytes()
        .fold(7_u64, |hash: u64, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)));
    PortManifest {
        id: id.into(),
        type_name: type_name.into(),
        schema: schema.into(),
        schema_hash,
        doc: format!("the {id}"),
        required,
        many: false,
        latched: false,
        stale_after: String::new(),
    }
}

fn parameter(name: &str, kind: ParameterType, default: Option<&str>) -> ParameterManifest {
    ParameterManifest {
        name: name.into(),
        kind,
        unit: String::new(),
        default: default.map(Into::into),
        minimum: None,
        maximum: None,
        choices: Vec::new(),
        format: None,
        doc: format!("what {name} does"),
        live: false,
        written: false,
    }
}

fn kind(
    kind: &str,
    inputs: Vec<PortManifest>,
    outputs: Vec<PortManifest>,
    parameters: Vec<ParameterManifest>,
) -> Manifest {
    let summary = format!("The {kind} of the tests.");
    Manifest {
        armor_manifest: 1,
        kind: kind.into(),
        summary,
        inputs,
        outputs,
        parameters,
        events: None,
        controllable: true,
        protocol: None,
        reports_done: true,
        ends_by_itself: false,
        needs_rate: false,
        reads_all: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
    }
}

/// The manifests.
pub fn manifests() -> Vec<Manifest> {
    let distance = ParameterManifest {
        unit: "m".into(),
        minimum: Some(0.1),
        maximum: Some(20.0),
        ..parameter("distance", ParameterType::Number, Some("2m"))
    };
    let mode = ParameterManifest {
        choices: vec!["slow".into(), "fast".into()],
        ..parameter("mode", ParameterType::Choice, Some("slow"))
    };
    let packed = EventManifest {
        name: "packed".into(),
        doc: "a box is packed".into(),
        value: None,
        unit: String::new(),
        named_by: String::new(),
    };
    vec![
        kind(
            "eye",
            vec![],
            vec![port("image", "Image", IMAGE, false), port("target", "Point", POINT, false)],
            vec![parameter("device", ParameterType::Text, None), distance],
        ),
        Manifest {
            events: Some(vec![packed]),
            ..kind(
                "arm",
                vec![port("target", "Point", POINT, true), port("view", "Image", IMAGE, false)],
                vec![port("tip", "Point", POINT, false)],
                vec![mode, parameter("gentle", ParameterType::Flag, Some("false"))],
            )
        },
        kind("lamp", vec![port("place", "Point", OTHER_POINT, false)], vec![], vec![]),
        kind(
            "wall",
            vec![PortManifest { many: true, ..port("images", "Image", IMAGE, true) }],
            vec![],
            vec![],
        ),
        kind(
            "relay",
            vec![PortManifest { many: true, ..port("writers", "Any", "Any{}", false) }],
            vec![port("element", "Any", "Any{}", false)],
            vec![],
        ),
        Manifest { controllable: false, ..kind("view", vec![], vec![], view_parameters()) },
    ]
}

/// More parameters than are seen at a glance.
fn view_parameters() -> Vec<ParameterManifest> {
    let names = ["depth", "gain", "height", "margin", "width"];
    names.map(|name| parameter(name, ParameterType::Text, Some("1"))).to_vec()
}

/// A kind with so many parameters that they are grouped.
pub fn station() -> Manifest {
    let names = [
        "laser_sigma",
        "laser_range",
        "laser_rate",
        "gps_rate",
        "gps_sigma",
        "gps_wander",
        "seed",
        "start_x",
        "start_y",
        "mass",
        "width",
        "height",
    ];
    let parameters = names.map(|name| parameter(name, ParameterType::Text, Some("1"))).to_vec();
    kind("station", vec![], vec![], parameters)
}

/// The same as the designer knows them.
pub fn kinds() -> Kinds {
    Kinds::of(manifests(), "stock")
}

/// A kind that drives along a route, as the legs of a map need it.
pub fn way() -> Manifest {
    kind("way", vec![], vec![], vec![parameter("route", ParameterType::Text, Some("0,0"))])
}
