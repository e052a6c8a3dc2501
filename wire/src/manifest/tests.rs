use super::parameter::tests::parameter;
use super::*;

#[test]
fn the_json_form_comes_back_as_it_was() {
    let schema_hash = 0x00ab_cdef_0123_4567;
    let port = PortManifest {
        id: "scan".into(),
        type_name: "LaserScan".into(),
        schema: "LaserScan{}".into(),
        schema_hash,
        doc: String::new(),
        required: true,
        many: false,
        latched: false,
        stale_after: String::new(),
    };
    let manifest = Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind: "mapper".into(),
        summary: "Draws.".into(),
        controllable: true,
        reads_all: false,
        protocol: None,
        reports_done: true,
        ends_by_itself: false,
        needs_rate: false,
        needs_one_of: Vec::new(),
        value_effects: Vec::new(),
        frames: Vec::new(),
        inputs: vec![port],
        outputs: vec![],
        parameters: vec![parameter(ParameterType::Number, "m")],
        events: None,
    };
    let text = serde_json::to_string(&manifest).expect("plain data");
    assert!(text.contains("\"schema_hash\":\"00abcdef01234567\""), "{text}");
    assert_eq!(serde_json::from_str::<Manifest>(&text).expect("as written"), manifest);
    assert!(!text.contains("events"), "{text}");
    let none = Manifest { events: Some(Vec::new()), ..manifest };
    let without_events = serde_json::to_string(&none).expect("plain data");
    assert!(without_events.contains("\"events\":[]"), "{without_events}");
    assert_eq!(serde_json::from_str::<Manifest>(&without_events).expect("as written"), none);
    let extra = text.replacen('{', "{\"extra\":1,", 1);
    assert!(serde_json::from_str::<Manifest>(&extra).is_err());
}
