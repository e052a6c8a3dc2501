//! The cost of a large file: one of 1,000 components and 3,000 links, read from the disk and
//! checked against the manifests of its kinds, as `armor check` and configd do.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use armor_robotfile::{Colours, Manifests, check, load};
use armor_wire::manifest::{
    MANIFEST_VERSION, Manifest, ParameterManifest, ParameterType, PortManifest,
};
use armor_wire::schema;

const COMPONENTS: usize = 1000;
/// Every input is fed once: three links for each component.
const INPUTS: usize = 3;
const KINDS: usize = 20;

/// The file: components with a rate and two parameters, each fed by three others.
pub fn write_large_file() -> String {
    let mut text = String::from("<armor version=\"1\">\n  <system name=\"large\">\n");
    for n in 0..COMPONENTS {
        let kind = n % KINDS;
        let _ = write!(
            text,
            "    <component name=\"component-{n}\" kind=\"kind-{kind}\" rate=\"10Hz\">\n      \
             <parameter name=\"speed\" value=\"0.5m/s\"/>\n      \
             <parameter name=\"turn\" value=\"30deg\"/>\n    </component>\n"
        );
    }
    for n in 0..COMPONENTS {
        for input in 0..INPUTS {
            let from = (n * 7 + input * 13 + 1) % COMPONENTS;
            let _ = writeln!(
                text,
                "    <link from=\"component-{from}.out-{input}\" to=\"component-{n}.in-{input}\" keep=\"10\"/>"
            );
        }
    }
    text + "  </system>\n</armor>\n"
}

fn make_manifests() -> Manifests {
    let kinds = (0..KINDS).map(|n| format!("kind-{n}"));
    kinds.map(|kind| (kind.clone(), make_manifest(kind))).collect()
}

fn make_manifest(kind: String) -> Manifest {
    let port = |side: &str, n: usize| {
        let schema = format!("Data{n}{{stamp:f64(s),values:[f32](m)}}");
        PortManifest {
            id: format!("{side}-{n}"),
            type_name: format!("Data{n}"),
            schema_hash: schema::hash_text(&schema),
            schema,
            doc: String::new(),
            required: true,
            many: false,
            latched: false,
            stale_after: String::new(),
        }
    };
    let parameter = |name: &str, unit: &str| ParameterManifest {
        name: name.into(),
        kind: ParameterType::Number,
        unit: unit.into(),
        default: None,
        minimum: Some(0.0),
        maximum: Some(10.0),
        choices: Vec::new(),
        format: None,
        doc: String::new(),
        live: false,
        written: false,
    };
    Manifest {
        armor_manifest: MANIFEST_VERSION,
        kind,
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
        inputs: (0..INPUTS).map(|n| port("in", n)).collect(),
        outputs: (0..INPUTS).map(|n| port("out", n)).collect(),
        parameters: vec![parameter("speed", "m/s"), parameter("turn", "deg")],
        events: None,
    }
}

/// The role: reads and checks the file for `window`. It prints
/// `checked first_ms=… p50_ms=… peak_kib=…`, where the memory is the most that the first check took
/// in addition to the manifests.
pub fn measure_checks(file: &Path, window: Duration) -> Result<()> {
    let manifests = make_manifests();
    // Resets the peak so far (VmHWM).
    std::fs::write("/proc/self/clear_refs", "5").context("the peak cannot be reset")?;
    let before_kib = read_status_kib("VmRSS")?;
    let mut times_ms = Vec::new();
    let mut peak_kib = 0.0;
    let started = Instant::now();
    while times_ms.is_empty() || started.elapsed() < window {
        let start = Instant::now();
        let reading = check(load(file), &[], Some(&manifests));
        times_ms.push(start.elapsed().as_secs_f64() * 1e3);
        ensure!(reading.is_valid(), "{}", reading.findings.render(Colours::No));
        if times_ms.len() == 1 {
            peak_kib = read_status_kib("VmHWM")? - before_kib;
            let system = reading.configuration.as_ref().map(|all| &all.system);
            let names: BTreeSet<_> =
                system.iter().flat_map(|s| &s.components).map(|c| &c.name.value).collect();
            ensure!(names.len() == COMPONENTS, "{} components", names.len());
        }
    }
    let first_ms = times_ms[0];
    times_ms.sort_by(f64::total_cmp);
    let p50_ms = times_ms[times_ms.len() / 2];
    println!("checked first_ms={first_ms:.3} p50_ms={p50_ms:.3} peak_kib={peak_kib}");
    Ok(())
}

fn read_status_kib(key: &str) -> Result<f64> {
    let text = std::fs::read_to_string("/proc/self/status")?;
    let line = text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    let number = line.and_then(|line| line.split_whitespace().next()).context("no such line")?;
    Ok(number.parse()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_valid() {
        let reading =
            armor_robotfile::read(Path::new("a.xml"), &mut |_| Ok(write_large_file().into_bytes()));
        let reading = check(reading, &[], Some(&make_manifests()));
        assert!(reading.is_valid(), "{}", reading.findings.render(Colours::No));
        let system = reading.configuration.expect("a configuration").system;
        assert_eq!((system.components.len(), system.links.len()), (COMPONENTS, 3000));
    }
}
