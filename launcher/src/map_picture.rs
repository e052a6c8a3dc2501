//! `armor map info`: what a picture for a map is, and where it lies.

use std::path::Path;

use anyhow::Result;
use armor_tiles::Source;
use serde_json::{Value, json};

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line};

/// Prints the kind of a picture, its reference, its extent and its levels.
///
/// # Errors
/// If the picture cannot be opened.
pub(crate) fn print_picture(path: &Path, format: OutputFormat) -> Result<CommandEnding> {
    let source = Source::open(path)?;
    end_printing(match format {
        OutputFormat::Json => print_line(describe_as_json(&source)),
        _ => print_line(describe_picture(&source)),
    })?;
    Ok(CommandEnding::Fine)
}

/// South, west, north and east in degrees; nothing for metres of the map's frame.
fn extent_in_degrees(source: &Source) -> Option<[f64; 4]> {
    let corners = source.bounds().corners().map(|corner| {
        let position = source.reference().geo_from_plane(corner).ok()??;
        Some((position.latitude_deg(), position.longitude_deg()))
    });
    let mut extent = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for corner in corners {
        let (latitude_deg, longitude_deg) = corner?;
        extent[0] = extent[0].min(latitude_deg);
        extent[1] = extent[1].min(longitude_deg);
        extent[2] = extent[2].max(latitude_deg);
        extent[3] = extent[3].max(longitude_deg);
    }
    Some(extent)
}

fn describe_picture(source: &Source) -> String {
    let bounds = source.bounds();
    let mut lines = vec![
        format!("{}: {}", source.file(), source.kind()),
        format!("reference  {}", source.reference()),
    ];
    lines.push(match extent_in_degrees(source) {
        Some([south, west, north, east]) => {
            format!("extent     {south:.6} {west:.6} to {north:.6} {east:.6} (latitude, longitude)")
        }
        None => format!(
            "extent     {:.3} {:.3} to {:.3} {:.3} m",
            bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y
        ),
    });
    let unit = if source.reference().epsg() == Some(4326) { "°" } else { " m" };
    lines.push(format!("levels     {} to {}", source.levels().start(), source.levels().end()));
    lines.push(format!("pixel      {:.6}{unit}", source.units_per_pixel()));
    lines.extend(source.attribution().map(|authors| format!("authors    {authors}")));
    lines.join("\n")
}

fn describe_as_json(source: &Source) -> Value {
    let bounds = source.bounds();
    json!({
        "file": source.file(),
        "kind": source.kind().to_string(),
        "epsg": source.reference().epsg(),
        "bounds": [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y],
        "degrees": extent_in_degrees(source),
        "levels": [source.levels().start(), source.levels().end()],
        "units_per_pixel": source.units_per_pixel(),
        "attribution": source.attribution(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(name: &str, text: &str) -> Result<Source> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join(name);
        std::fs::write(&path, text)?;
        Ok(Source::open(&path)?)
    }

    #[test]
    fn a_plan_in_degrees_is_described_by_them() {
        let plan = r#"{"type":"LineString","coordinates":[[2.0,48.0],[2.1,48.1]]}"#;
        let source = open("plan.geojson", plan).expect("a plan");
        let text = describe_picture(&source);
        assert!(text.contains("GeoJSON\nreference  Web Mercator (EPSG 3857)\n"), "{text}");
        assert!(text.contains("(latitude, longitude)"), "{text}");
        let value = describe_as_json(&source);
        let south = value["degrees"][0].as_f64().expect("a latitude");
        assert!((south - 48.0).abs() < 0.01, "{value}");
        assert_eq!(value["epsg"], json!(3857));
    }

    #[test]
    fn a_drawn_world_is_in_metres_and_a_text_is_refused() {
        let world = r#"<svg><rect x="0" y="0" width="20" height="10"/></svg>"#;
        let text = describe_picture(&open("world.svg", world).expect("a world"));
        assert!(text.contains("extent     -0.250 -10.250 to 20.250 0.250 m"), "{text}");
        let error = open("a.txt", "a text").expect_err("no picture").to_string();
        assert!(error.contains("a.txt: it is none of the pictures"), "{error}");
    }
}
