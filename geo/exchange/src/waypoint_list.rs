//! `QGC WPL 110`: a line for each item, twelve fields separated by tabs; the first is home.

use std::fmt::Write;

use crate::error::{MOST_POSITIONS, PlanReadError, PlanWriteError};
use crate::mavlink::{NumberedCommand, command_of, read_commands};
use crate::plan::{
    AltitudeReference, MavlinkCommand, Omissions, PlanAltitude, PlanItem, PlanNote, PlanPosition,
    PlannedRoute, RoutePlan,
};

const FORMAT: &str = "QGC WPL 110";
/// How many fields a line has.
const FIELDS: usize = 12;

pub(crate) fn read(text: &str) -> Result<RoutePlan, PlanReadError> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let first = lines.next().map_or("", |(_, line)| line.trim());
    match first.strip_prefix("QGC WPL ") {
        Some("110") => {}
        Some(version) => {
            let found = version.chars().take(20).collect();
            return Err(PlanReadError::Version {
                what: "the list".to_owned(),
                found,
                known: "110",
            });
        }
        None => {
            let reason = "its first line is not `QGC WPL 110`".to_owned();
            return Err(PlanReadError::Syntax { format: FORMAT, reason });
        }
    }
    let mut commands = Vec::new();
    for (index, line) in lines {
        commands.push(read_line(line, &format!("line {}", index + 1))?);
        if commands.len() > MOST_POSITIONS {
            return Err(PlanReadError::TooMany { most: MOST_POSITIONS });
        }
    }
    let mut plan = RoutePlan::default();
    if commands.first().is_some_and(|command| command.number == 0) {
        plan.home = home_of(&commands.remove(0))?;
    }
    let route = read_commands(&commands, &mut plan.notes)?;
    plan.routes.push(route);
    Ok(plan)
}

fn read_line(line: &str, place: &str) -> Result<NumberedCommand, PlanReadError> {
    let fields: Vec<&str> = line.split_whitespace().collect();
    if fields.len() != FIELDS {
        let reason = format!("it has {} fields, not {FIELDS}", fields.len());
        return Err(PlanReadError::value(place, reason));
    }
    let number = |index: usize| {
        let field = fields[index];
        field.parse::<f64>().map_err(|_| {
            let field: String = field.chars().take(40).collect();
            PlanReadError::value(place, format!("`{field}` is no number"))
        })
    };
    let whole = |index: usize, most: f64| {
        let value = number(index)?;
        if value.fract() == 0.0 && (0.0..=most).contains(&value) {
            Ok(value)
        } else {
            let reason =
                format!("field {} is {value}, and a number up to {most} is read", index + 1);
            Err(PlanReadError::value(place, reason))
        }
    };
    let mut parameters = [None; 7];
    for (index, parameter) in parameters.iter_mut().enumerate() {
        let value = number(index + 4)?;
        *parameter = value.is_finite().then_some(value);
    }
    let (frame, command) = (whole(2, 255.0)? as u8, whole(3, 65535.0)? as u16);
    let command = MavlinkCommand { command, frame, parameters };
    Ok(NumberedCommand { number: whole(0, 1e6)? as i64, place: place.to_owned(), command })
}

/// The home position; nothing if the line has only zeros, as planners write without one.
fn home_of(line: &NumberedCommand) -> Result<Option<PlanPosition>, PlanReadError> {
    let [latitude, longitude, altitude] = [4, 5, 6].map(|index| line.command.parameters[index]);
    let (latitude, longitude) = (latitude.unwrap_or(0.0), longitude.unwrap_or(0.0));
    if latitude == 0.0 && longitude == 0.0 {
        return Ok(None);
    }
    let altitude = altitude.map(|m| PlanAltitude { m, reference: AltitudeReference::Sea });
    PlanPosition::checked(latitude, longitude, altitude)
        .map(Some)
        .map_err(|reason| PlanReadError::value(line.place.as_str(), reason))
}

pub(crate) fn write(plan: &RoutePlan) -> Result<(String, Vec<PlanNote>), PlanWriteError> {
    let found = plan.routes.len();
    if found > 1 {
        return Err(PlanWriteError::SeveralRoutes { format: FORMAT, found });
    }
    let empty = PlannedRoute::default();
    let route = plan.routes.first().unwrap_or(&empty);
    let mut omissions = Omissions::default();
    omissions.add("fence", plan.fences.len());
    omissions.add("breach return", usize::from(plan.breach_return.is_some()));
    omissions.add("rally point", plan.rally_points.len());
    omissions.add("point", plan.points.len());
    omissions.add("name of the route", usize::from(route.name.is_some()));
    let is_named = |item: &&PlanItem| matches!(item, PlanItem::Go { name: Some(_), .. });
    omissions.add("name of a waypoint", route.items.iter().filter(is_named).count());
    let mut text = "QGC WPL 110\n".to_owned();
    let home = plan.home.map(|home| {
        [
            Some(home.latitude_deg),
            Some(home.longitude_deg),
            home.altitude.map(|altitude| altitude.m),
        ]
    });
    let [latitude, longitude, altitude] = home.unwrap_or([Some(0.0); 3]);
    let zero = Some(0.0);
    let home = [zero, zero, zero, zero, latitude, longitude, altitude.or(zero)];
    write_line(&mut text, 0, &MavlinkCommand { command: 16, frame: 0, parameters: home });
    for (index, item) in route.items.iter().enumerate() {
        let command = command_of(item, |index| index as i64 + 1);
        write_line(&mut text, index + 1, &command);
    }
    Ok((text, omissions.into_notes(FORMAT)))
}

fn write_line(text: &mut String, number: usize, command: &MavlinkCommand) {
    let current = u8::from(number == 0);
    // Writing to a string cannot fail.
    let _ = write!(text, "{number}\t{current}\t{}\t{}", command.frame, command.command);
    for parameter in command.parameters {
        let _ = match parameter {
            Some(value) => write!(text, "\t{value}"),
            None => write!(text, "\tnan"),
        };
    }
    text.push_str("\t1\n");
}
