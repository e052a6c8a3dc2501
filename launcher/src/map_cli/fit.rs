//! `armor map fit`: where a map is in the world, from points whose latitude and longitude are known.

use anyhow::{Result, anyhow};
use armor_geo::{FittedMap, GeoPosition, MapPoint, ScaleChoice, fit_map};
use armor_wire::quantity::{self, Dimension};
use clap::Args;
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{Table, end_printing, print_line, print_notice, print_text};

/// How far the distances in the world may differ from those on the map before that is noted.
const MAX_SCALE_ERROR: f64 = 0.01;

/// Find the origin and the heading of a map by two points or more whose latitude and longitude are
/// known, with the residual of each.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor map fit \"0 0 = 48.8583N 2.2945E\" \"60 22 = 48.8585N 2.2953E\"
  armor map fit --height 35m \"0 0 = 48.8583 2.2945\" \"60 22 = 48.8585 2.2953\" \"9 4 = 48.8583 2.2946\"")]
pub struct FitArguments {
    /// Metres x and y on the map, and the latitude and longitude of the same point.
    #[arg(required = true, value_name = "X Y = LATITUDE LONGITUDE", value_parser = parse_pair)]
    #[arg(allow_hyphen_values = true)]
    pub pairs: Vec<PointPair>,
    /// The height of the map above the ellipsoid.
    #[arg(long, value_name = "LENGTH", default_value = "0m", value_parser = parse_height)]
    pub height: f64,
}

/// A point of the map and its place in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPair {
    point: MapPoint,
    latitude_deg: f64,
    longitude_deg: f64,
}

fn parse_height(text: &str) -> Result<f64, String> {
    let length = quantity::parse_in(text, Dimension::Length, "a length such as 35m");
    length.map_err(|error| error.to_string())
}

fn parse_pair(text: &str) -> Result<PointPair, String> {
    if text.starts_with("--") {
        return Err("options are written before the points".into());
    }
    let expected = || "write 12.5 4 = 48.8583N 2.2945E".to_owned();
    let (map, world) = text.split_once('=').ok_or_else(expected)?;
    let two = |text: &str| {
        let words: Vec<_> = text.split([' ', ',']).filter(|word| !word.is_empty()).collect();
        match words[..] {
            [first, second] => Ok((first.to_owned(), second.to_owned())),
            _ => Err(expected()),
        }
    };
    let ((x, y), (latitude, longitude)) = (two(map)?, two(world)?);
    let number = |word: &str| {
        word.parse::<f64>().map_err(|_| format!("`{word}` is no number: {}", expected()))
    };
    let degrees = |word: &str, [positive, negative]: [char; 2]| {
        if let Some(word) = word.strip_suffix(negative) {
            return number(word).map(|degrees| -degrees);
        }
        number(word.strip_suffix(positive).unwrap_or(word))
    };
    let point = MapPoint::new(number(&x)?, number(&y)?).map_err(|error| error.to_string())?;
    let latitude_deg = degrees(&latitude, ['N', 'S'])?;
    let longitude_deg = degrees(&longitude, ['E', 'W'])?;
    GeoPosition::new(latitude_deg, longitude_deg, 0.0).map_err(|error| error.to_string())?;
    Ok(PointPair { point, latitude_deg, longitude_deg })
}

/// Prints the attributes of `<map>` and the residuals.
///
/// # Errors
/// If the pairs determine no map.
pub fn print_fit(arguments: &FitArguments, format: OutputFormat) -> Result<CommandEnding> {
    let pairs = arguments
        .pairs
        .iter()
        .map(|pair| {
            let position =
                GeoPosition::new(pair.latitude_deg, pair.longitude_deg, arguments.height)?;
            Ok((pair.point, position))
        })
        .collect::<Result<Vec<_>>>()?;
    let fit = |scale| fit_map(&pairs, scale).map_err(|error| anyhow!(error));
    let fitted = fit(ScaleChoice::Metres)?;
    let scale = fit(ScaleChoice::Fitted)?.placement.scale();
    let [origin, heading] = write_attributes(&fitted);
    end_printing(match format {
        OutputFormat::Json => print_line(json!({
            "origin": origin,
            "heading": heading,
            "residuals_m": fitted.residuals_m,
            "rms_m": fitted.rms_m(),
            "scale": scale,
        })),
        _ => {
            let rows =
                pairs.iter().zip(&fitted.residuals_m).map(|((point, position), residual)| {
                    vec![
                        format!("{} {}", point.x_m(), point.y_m()),
                        format!("{} {}", position.latitude_deg(), position.longitude_deg()),
                        format!("{residual:.3} m"),
                    ]
                });
            let table = Table::new(&["map", "world", "residual"], rows.collect()).format(None);
            let rms_m = fitted.rms_m();
            print_text(format_args!(
                "origin=\"{origin}\" heading=\"{heading}\"\n{table}rms {rms_m:.3} m\n"
            ))
        }
    })?;
    if (scale - 1.0).abs() > MAX_SCALE_ERROR {
        let by = (scale - 1.0) * 100.0;
        print_notice(format!(
            "the points are {:.1} % {} apart in the world than on the map: check them, or the \
             scale of the map",
            by.abs(),
            if by > 0.0 { "farther" } else { "nearer" }
        ));
    }
    Ok(CommandEnding::Fine)
}

/// `origin` and `heading` as `<map>` has them: to a millimetre and a thousandth of a degree.
fn write_attributes(fitted: &FittedMap) -> [String; 2] {
    let (origin, heading_rad) = (fitted.placement.origin(), fitted.placement.heading_rad());
    // Rounding may give -0, which is 0.
    let rounded = |value: f64, factor: f64| (value * factor).round() / factor + 0.0;
    let height_m = rounded(origin.height_m(), 1e3);
    [
        format!("{:.8} {:.8} {height_m}m", origin.latitude_deg(), origin.longitude_deg()),
        format!("{}deg", rounded(heading_rad.to_degrees(), 1e3)),
    ]
}

#[cfg(test)]
mod tests {
    use armor_geo::MapPlacement;

    use super::*;

    #[test]
    fn a_pair_is_metres_and_degrees() {
        let pair = parse_pair("12.5 -4 = 48.8583N 2.2945W").expect("a pair");
        assert_eq!((pair.point.x_m(), pair.point.y_m()), (12.5, -4.0));
        assert_eq!((pair.latitude_deg, pair.longitude_deg), (48.8583, -2.2945));
        assert_eq!(parse_pair("12.5,-4=48.8583,-2.2945"), Ok(pair));
        for (text, part) in [
            ("12.5 4", "write 12.5 4 = "),
            ("1 2 3 = 4 5", "write 12.5 4 = "),
            ("1 x = 4 5", "`x` is no number"),
            ("1 2 = 94 5", "94"),
            ("--height", "before the points"),
        ] {
            let error = parse_pair(text).expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn what_a_map_was_placed_by_is_found() {
        let origin = GeoPosition::new(48.8583, 2.2945, 35.0).expect("a position");
        let placement = MapPlacement::new(origin, 12_f64.to_radians(), 1.0).expect("a map");
        let pairs = [[0.0, 0.0], [60.0, 22.0], [-9.0, 4.0]].map(|[x, y]| {
            let point = MapPoint::new(x, y).expect("a point");
            (point, placement.geo_from_map(point).expect("a position"))
        });
        let fitted = fit_map(&pairs, ScaleChoice::Metres).expect("a map");
        assert_eq!(write_attributes(&fitted), ["48.85830000 2.29450000 35m", "12deg"]);
        assert!(fitted.rms_m() < 1e-6);
    }
}
