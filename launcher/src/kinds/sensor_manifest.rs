//! A manifest for tests.

use armor_wire::manifest::Manifest;

/// A sensor whose output `out` has messages `Reading` of this schema.
pub fn sensor_manifest(kind: &str, schema: &str) -> Manifest {
    let hash = armor_wire::schema::hash_text(schema);
    let port = format!(
        r#"{{"id":"out","type":"Reading","schema":"{schema}","schema_hash":"{hash:016x}"}}"#
    );
    let text = format!(
        r#"{{"armor_manifest":1,"kind":"{kind}","summary":"a sensor","inputs":[],"parameters":[],
            "outputs":[{port}]}}"#
    );
    serde_json::from_str(&text).expect("a manifest")
}
