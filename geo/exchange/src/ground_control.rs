//! Reading the plans of QGroundControl: plan version 1, mission version 2.

use serde_json::Value;

use crate::error::{MOST_POSITIONS, PlanReadError};
use crate::mavlink::{NumberedCommand, read_commands};
use crate::plan::{
    AltitudeReference, Fence, FenceShape, MavlinkCommand, NamedPosition, PlanAltitude,
    PlanPosition, RoutePlan, rounded,
};

const FORMAT: &str = "plan of QGroundControl";
/// The version of a survey, and of the part with its items.
const SURVEY_VERSIONS: std::ops::RangeInclusive<i64> = 3..=5;
const ITEMS_VERSIONS: std::ops::RangeInclusive<i64> = 1..=2;

pub(crate) fn read(text: &str) -> Result<RoutePlan, PlanReadError> {
    let file: Value = serde_json::from_str(text)
        .map_err(|error| PlanReadError::Syntax { format: FORMAT, reason: error.to_string() })?;
    if !file.is_object() {
        let reason = "it does not begin with `{`".to_owned();
        return Err(PlanReadError::Syntax { format: FORMAT, reason });
    }
    if let Some(kind) = file["fileType"].as_str().filter(|kind| *kind != "Plan") {
        let reason = format!("its fileType is {kind}");
        return Err(PlanReadError::Syntax { format: FORMAT, reason });
    }
    check_version("the plan", &file["version"], 1..=1, "1")?;
    let mission = &file["mission"];
    if !mission.is_object() {
        return Err(PlanReadError::missing("the plan", "mission"));
    }
    check_version("the mission", &mission["version"], 2..=2, "2")?;
    let mut plan = RoutePlan::default();
    if let Some(home) = mission["plannedHomePosition"].as_array() {
        let home = position_of(home, "the home position", AltitudeReference::Sea)?;
        // Planners write zeros where no home is known.
        plan.home = (home.latitude_deg != 0.0 || home.longitude_deg != 0.0).then_some(home);
    }
    let mut commands = Vec::new();
    for (index, item) in list(&mission["items"], "the mission", "items")?.iter().enumerate() {
        read_item(item, &format!("item {}", index + 1), &mut commands)?;
    }
    let route = read_commands(&commands, &mut plan.notes)?;
    plan.routes.push(route);
    read_fences(&file["geoFence"], &mut plan)?;
    read_rally_points(&file["rallyPoints"], &mut plan)?;
    Ok(plan)
}

fn check_version(
    what: &str,
    version: &Value,
    known: std::ops::RangeInclusive<i64>,
    names: &'static str,
) -> Result<(), PlanReadError> {
    if version.as_i64().is_some_and(|version| known.contains(&version)) {
        return Ok(());
    }
    if version.is_null() {
        return Err(PlanReadError::missing(what, "version"));
    }
    let (what, found) = (what.to_owned(), shorten(&version.to_string()));
    Err(PlanReadError::Version { what, found, known: names })
}

/// The first characters of a text, for messages.
fn shorten(text: &str) -> String {
    text.chars().take(40).collect()
}

fn list<'a>(
    value: &'a Value,
    place: &str,
    what: &'static str,
) -> Result<&'a [Value], PlanReadError> {
    value.as_array().map(Vec::as_slice).ok_or_else(|| PlanReadError::missing(place, what))
}

/// A simple item, or the items within a complex one.
fn read_item(
    item: &Value,
    place: &str,
    commands: &mut Vec<NumberedCommand>,
) -> Result<(), PlanReadError> {
    match item["type"].as_str() {
        Some("SimpleItem") => {
            let command = read_command(item, place)?;
            // Older plans number their items by their order alone.
            let number = item["doJumpId"].as_i64().unwrap_or(commands.len() as i64 + 1);
            commands.push(NumberedCommand { number, place: place.to_owned(), command });
            if commands.len() > MOST_POSITIONS {
                return Err(PlanReadError::TooMany { most: MOST_POSITIONS });
            }
            Ok(())
        }
        Some("ComplexItem") => read_complex(item, place, commands),
        Some(other) => {
            let what = format!("{} item", shorten(other));
            Err(PlanReadError::Unsupported { place: place.to_owned(), what })
        }
        None => Err(PlanReadError::missing(place, "type")),
    }
}

fn read_complex(
    item: &Value,
    place: &str,
    commands: &mut Vec<NumberedCommand>,
) -> Result<(), PlanReadError> {
    let kind = item["complexItemType"].as_str().unwrap_or("complex item");
    let holder = &item["TransectStyleComplexItem"];
    if !matches!(kind, "survey" | "CorridorScan") {
        let what = shorten(kind);
        return Err(PlanReadError::Unsupported { place: place.to_owned(), what });
    }
    if kind == "survey" {
        check_version(
            &format!("{place} (survey)"),
            &item["version"],
            SURVEY_VERSIONS,
            "3, 4 or 5",
        )?;
    }
    let place = format!("{place} ({kind})");
    if !holder.is_object() {
        return Err(PlanReadError::missing(place, "TransectStyleComplexItem"));
    }
    check_version(&place, &holder["version"], ITEMS_VERSIONS, "1 or 2")?;
    for (index, inner) in list(&holder["Items"], &place, "Items")?.iter().enumerate() {
        // Only simple items stand there, so that nothing is nested deeper.
        if inner["type"].as_str() != Some("SimpleItem") {
            return Err(PlanReadError::missing(format!("{place}, {}", index + 1), "simple item"));
        }
        read_item(inner, &format!("{place}, {}", index + 1), commands)?;
    }
    Ok(())
}

fn read_command(item: &Value, place: &str) -> Result<MavlinkCommand, PlanReadError> {
    let number = |what: &'static str| {
        let found = item[what].as_u64().ok_or_else(|| PlanReadError::missing(place, what))?;
        u16::try_from(found)
            .map_err(|_| PlanReadError::value(place, format!("{what} {found} is not defined")))
    };
    let (command, frame) = (number("command")?, number("frame")?);
    let frame = u8::try_from(frame)
        .map_err(|_| PlanReadError::value(place, format!("frame {frame} is not defined")))?;
    let mut parameters = [None; 7];
    let given = list(&item["params"], place, "params")?;
    if given.len() != parameters.len() {
        let reason = format!("it has {} params, not 7", given.len());
        return Err(PlanReadError::value(place, reason));
    }
    for (parameter, value) in parameters.iter_mut().zip(given) {
        if !value.is_number() && !value.is_null() {
            let reason = format!("{} among its params is no number", shorten(&value.to_string()));
            return Err(PlanReadError::value(place, reason));
        }
        *parameter = value.as_f64().map(rounded);
    }
    Ok(MavlinkCommand { command, frame, parameters })
}

fn position_of(
    values: &[Value],
    place: &str,
    reference: AltitudeReference,
) -> Result<PlanPosition, PlanReadError> {
    let [latitude, longitude, rest @ ..] = values else {
        return Err(PlanReadError::missing(place, "latitude and longitude"));
    };
    let (Some(latitude), Some(longitude)) = (latitude.as_f64(), longitude.as_f64()) else {
        return Err(PlanReadError::value(place, "latitude and longitude must be numbers"));
    };
    let altitude = rest.first().and_then(Value::as_f64).map(|m| PlanAltitude { m, reference });
    PlanPosition::checked(latitude, longitude, altitude)
        .map_err(|reason| PlanReadError::value(place, reason))
}

fn read_fences(fence: &Value, plan: &mut RoutePlan) -> Result<(), PlanReadError> {
    if fence.is_null() {
        return Ok(());
    }
    check_version("the fence", &fence["version"], 1..=2, "1 or 2")?;
    // Version 1 has one polygon that is not to be left.
    let mut polygons = Vec::new();
    if let Some(corners) = fence["polygon"].as_array().filter(|corners| !corners.is_empty()) {
        polygons.push((corners, true));
    }
    for (index, polygon) in fence["polygons"].as_array().into_iter().flatten().enumerate() {
        let place = format!("polygon {} of the fence", index + 1);
        let corners = polygon["polygon"]
            .as_array()
            .ok_or_else(|| PlanReadError::missing(&place, "polygon"))?;
        polygons.push((corners, polygon["inclusion"].as_bool().unwrap_or(true)));
    }
    for (index, (corners, stay_in)) in polygons.into_iter().enumerate() {
        let place = format!("polygon {} of the fence", index + 1);
        let positions: Result<Vec<PlanPosition>, _> = corners
            .iter()
            .map(|corner| {
                let values = list(corner, &place, "corner")?;
                position_of(values, &place, AltitudeReference::Sea)
            })
            .collect();
        let positions = positions?;
        if positions.len() < 3 {
            let reason = format!("it has {} corners, and an area needs three", positions.len());
            return Err(PlanReadError::value(place, reason));
        }
        plan.fences.push(Fence { name: None, stay_in, shape: FenceShape::Polygon(positions) });
    }
    for (index, circle) in fence["circles"].as_array().into_iter().flatten().enumerate() {
        let place = format!("circle {} of the fence", index + 1);
        let centre = list(&circle["circle"]["center"], &place, "center")?;
        let centre = position_of(centre, &place, AltitudeReference::Sea)?;
        let radius_m = circle["circle"]["radius"]
            .as_f64()
            .map(rounded)
            .ok_or_else(|| PlanReadError::missing(&place, "radius"))?;
        if !(radius_m.is_finite() && radius_m > 0.0) {
            return Err(PlanReadError::value(place, format!("radius {radius_m} is not above 0")));
        }
        let stay_in = circle["inclusion"].as_bool().unwrap_or(true);
        plan.fences.push(Fence {
            name: None,
            stay_in,
            shape: FenceShape::Circle { centre, radius_m },
        });
    }
    if let Some(values) = fence["breachReturn"].as_array() {
        plan.breach_return =
            Some(position_of(values, "the breach return", AltitudeReference::Home)?);
    }
    Ok(())
}

fn read_rally_points(rally: &Value, plan: &mut RoutePlan) -> Result<(), PlanReadError> {
    if rally.is_null() {
        return Ok(());
    }
    check_version("the list of rally points", &rally["version"], 1..=2, "1 or 2")?;
    for (index, point) in rally["points"].as_array().into_iter().flatten().enumerate() {
        let place = format!("rally point {}", index + 1);
        let values = list(point, &place, "position")?;
        let position = position_of(values, &place, AltitudeReference::Home)?;
        plan.rally_points.push(NamedPosition { name: None, position });
    }
    Ok(())
}
