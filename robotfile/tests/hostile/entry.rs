//! Everything that reads a file's bytes, one function each. Shared by the test in this folder and
//! by the fuzz targets in `fuzz/`; what must hold of any input is asserted here.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use armor_robotfile::tree::Element;
use armor_robotfile::{
    Colours, Document, EditError, Item, MAX_FINDINGS, Manifests, NewElement, Position, Reading,
    check, format, read,
};
use armor_wire::manifest::{
    MANIFEST_VERSION, Manifest, ParameterManifest, ParameterType, PortManifest,
};
use armor_wire::schema;

/// A name, and what it does with bytes.
pub type Entry = (&'static str, fn(&[u8]));

/// All of them.
pub const ENTRIES: [Entry; 3] = [("missions", proof), ("edits", edits), ("layout", layout)];

/// The files that inputs are made of.
pub const EXAMPLES: [&str; 4] = [
    include_str!("small.xml"),
    include_str!("../everything.xml"),
    include_str!("../../../missions/office.xml"),
    include_str!("../../../missions/map-from-log.xml"),
];

/// The number of findings that are rendered for one input; the others are rendered the same way.
const SHOWN: usize = 8;

/// Reads and checks: an answer, with spans inside the file, whatever the bytes.
pub fn proof(bytes: &[u8]) {
    spans_hold(&read_all(bytes));
}

/// Reads and checks, with a system file and sub-missions that hold the same bytes: the worst that
/// they could hold.
pub fn read_all(bytes: &[u8]) -> Reading {
    let reading = read(Path::new("a.xml"), &mut |path| {
        if path.ends_with("gone") {
            Err(std::io::ErrorKind::NotFound.into())
        } else {
            Ok(bytes.to_vec())
        }
    });
    let reading = check(reading, &[], Some(manifests()));
    assert!(reading.findings.iter().count() <= MAX_FINDINGS + 1);
    reading
}

/// Every location lies in its file and can be shown.
pub fn spans_hold(reading: &Reading) {
    for (n, finding) in reading.findings.iter().enumerate() {
        let related = finding.related.iter().map(|(at, _)| at);
        for at in finding.at.iter().chain(related) {
            let text = at.source.text();
            assert!(text.get(at.span.start()..at.span.end()).is_some(), "{at} of {finding}");
            let (line, column) = at.line_column();
            assert!(line >= 1 && column >= 1 && line <= text.len() + 1);
        }
        if n < SHOWN {
            assert!(finding.render(Colours::Yes).contains(finding.code.as_str()));
            serde_json::to_string(finding).expect("plain data");
        }
    }
}

/// The output of `armor fmt` has the same contents and does not change again.
pub fn layout(bytes: &[u8]) {
    let path = Path::new("a.xml");
    let Ok(once) = format(path, bytes) else { return };
    assert_eq!(format(path, &once).expect("what was laid out can be"), once, "laid out twice");
    let codes = |bytes: &[u8]| {
        let found = read_all(bytes).findings;
        let mut codes: Vec<_> = found.iter().map(|finding| finding.code).collect();
        codes.sort();
        codes
    };
    assert_eq!(codes(bytes), codes(&once), "what is wrong with it");
}

/// The first byte is the number of edits, three bytes each select one; the rest is the file. What
/// was made can be read again; what was not made has changed nothing.
pub fn edits(bytes: &[u8]) {
    const EACH: usize = 3;
    let Some((count, rest)) = bytes.split_first() else { return };
    let count = usize::from(*count % 8);
    let Some((orders, file)) = rest.split_at_checked(count * EACH) else { return };
    let path = Path::new("a.xml");
    let Ok(mut document) = Document::open(path, file) else { return };
    assert_eq!(document.bytes(), file, "nothing was changed");
    for order in orders.chunks_exact(EACH) {
        let before = document.bytes().to_vec();
        match edit(&mut document, [order[0], order[1], order[2]].map(usize::from)) {
            Ok(()) => {
                let again = Document::open(path, document.bytes());
                assert!(again.is_ok(), "{order:?} of {}", String::from_utf8_lossy(&before));
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                assert_eq!(document.bytes(), before, "{order:?}: {error}");
            }
        }
    }
}

/// Texts that an edit may write.
const TEXTS: [&str; 12] = [
    "",
    "a",
    "x-1",
    "explore",
    "laser",
    "a<b & \"c\" 'd'",
    "]]>",
    "\n\t",
    "ä\u{2028}",
    "\u{0}",
    "-->",
    "&amp;",
];

fn edit(document: &mut Document, [kind, a, b]: [usize; 3]) -> Result<(), EditError> {
    let all = elements(document);
    let (path, element, name) = all[a % all.len()].clone();
    let text = TEXTS[b % TEXTS.len()];
    let item = match element.as_str() {
        "component" => Item::Component(&name),
        "place" => Item::Place(&name),
        "transition" => Item::Transition(&name),
        "variable" => Item::Variable(&name),
        "mission" => Item::Mission,
        _ => Item::System,
    };
    match kind % 12 {
        0 => document.set_attribute_at(&path, TEXTS[a % TEXTS.len()], Some(text)),
        1 => document.set_attribute_at(&path, "name", Some(text)),
        2 => document.set_text_at(&path, text),
        3 => document.insert_element(&path, b % 4, &NewElement::new("x").attribute("n", text)),
        4 => document.remove_element(&path),
        5 => document.move_element(&path, b % 8),
        6 => document.set_parameter(&name, "speed", (b % 3 > 0).then_some(text)),
        7 => document.rename(item, text),
        8 => document.remove(item),
        9 => document.add(Item::Component(text), &[("kind", text)]),
        10 => document.set_attribute(item, "rate", (b % 3 > 0).then_some(text)),
        _ => {
            let position = Position { x: a as f64, y: b as f64 };
            document.set_positions(&[(item, (b % 5 > 0).then_some(position))])
        }
    }
}

/// The paths of all elements with their names and what they are called; of a long file the first.
fn elements(document: &Document) -> Vec<(Vec<usize>, String, String)> {
    fn add(element: &Element, path: &mut Vec<usize>, all: &mut Vec<(Vec<usize>, String, String)>) {
        if all.len() >= 256 {
            return;
        }
        let name = element.attribute("name").map(|name| name.value.clone()).unwrap_or_default();
        all.push((path.clone(), element.name.clone(), name));
        for (n, child) in element.elements().enumerate() {
            path.push(n);
            add(child, path, all);
            path.pop();
        }
    }
    let mut all = Vec::new();
    add(document.tree().root(), &mut Vec::new(), &mut all);
    all
}

/// Manifests of all kinds in the examples, with every port and parameter that is named there.
pub fn manifests() -> &'static Manifests {
    static MANIFESTS: OnceLock<Manifests> = OnceLock::new();
    MANIFESTS.get_or_init(|| {
        let mut kinds = BTreeMap::new();
        for example in EXAMPLES {
            describe(example, &mut kinds);
        }
        let (inputs, outputs) = (vec![port("in", 0)], vec![port("out", 0)]);
        kinds.insert("k".into(), Manifest { inputs, outputs, ..kind("k") });
        kinds
    })
}

fn describe(example: &str, kinds: &mut Manifests) {
    let reading = read(Path::new("a.xml"), &mut |_| Ok(example.as_bytes().to_vec()));
    let Some(configuration) = reading.configuration else { return };
    let system = configuration.system;
    for component in &system.components {
        let name = &component.kind.value;
        let manifest = kinds.entry(name.clone()).or_insert_with(|| kind(name));
        for given in &component.parameters {
            let parameter = parameter(&given.name.value, &given.value.value);
            if manifest.parameters.iter().all(|known| known.name != parameter.name) {
                manifest.parameters.push(parameter);
            }
        }
    }
    for link in &system.links {
        for (end, is_input) in [(&link.from, false), (&link.to, true)] {
            let Some(component) = system.component(&end.component.value) else { continue };
            let Some(manifest) = kinds.get_mut(&component.kind.value) else { continue };
            let ports = if is_input { &mut manifest.inputs } else { &mut manifest.outputs };
            // Of the output's name, so that the example's own links fit mostly.
            let new = port(&end.port.value, link.from.port.value.len());
            if ports.iter().all(|known| known.id != new.id) {
                ports.push(new);
            }
        }
    }
}

fn kind(name: &str) -> Manifest {
    Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind: name.into(),
        summary: String::new(),
        controllable: true,
        protocol: None,
        reports_done: true,
        ends_by_itself: false,
        needs_rate: false,
        reads_all: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        parameters: Vec::new(),
        events: None,
    }
}

fn port(id: &str, of: usize) -> PortManifest {
    let schema = format!("Type{of}{{value:f64}}");
    PortManifest {
        id: id.into(),
        type_name: format!("Type{of}"),
        schema_hash: schema::hash_text(&schema),
        schema,
        doc: String::new(),
        required: of.is_multiple_of(2),
        many: false,
        latched: false,
        stale_after: String::new(),
    }
}

fn parameter(name: &str, value: &str) -> ParameterManifest {
    let unit = value.trim_start_matches(|c: char| c.is_ascii_digit() || ".-+".contains(c));
    let number = unit.len() < value.len();
    ParameterManifest {
        name: name.into(),
        kind: if number { ParameterType::Number } else { ParameterType::Path },
        unit: if number { unit.into() } else { String::new() },
        default: None,
        minimum: number.then_some(-1e3),
        maximum: number.then_some(1e3),
        choices: Vec::new(),
        format: None,
        doc: String::new(),
        live: false,
        written: false,
    }
}
