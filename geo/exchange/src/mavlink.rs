//! Items as MAVLink commands, which `.plan` and `QGC WPL 110` share.

use std::collections::BTreeMap;

use crate::error::PlanReadError;
use crate::plan::{
    AltitudeReference, MavlinkCommand, PlanAltitude, PlanItem, PlanNote, PlanPosition, PlannedRoute,
};

const WAYPOINT: u16 = 16;
const LOITER_TIME: u16 = 19;
const RETURN: u16 = 20;
const LAND: u16 = 21;
const TAKE_OFF: u16 = 22;
const DELAY: u16 = 93;
const JUMP: u16 = 177;
const CHANGE_SPEED: u16 = 178;
const LOOK_AT: u16 = 195;
const LOOK_AHEAD: u16 = 197;
const REGION_OF_INTEREST: u16 = 201;
const TAKE_PICTURES: u16 = 2000;
const STOP_PICTURES: u16 = 2001;
/// Commands up to this number lead the vehicle to a position.
const LAST_NAVIGATION: u16 = 95;
/// The frame of commands without a position.
const FRAME_MISSION: u8 = 2;
/// The mode of a region of interest that is a position.
const MODE_LOCATION: f64 = 3.0;

/// A command of a file with its number there, which repetitions name.
pub(crate) struct NumberedCommand {
    pub number: i64,
    /// How messages name it.
    pub place: String,
    pub command: MavlinkCommand,
}

/// A command that became an item, and perhaps a note on it.
struct ReadItem {
    item: PlanItem,
    note: Option<String>,
}

/// Reads commands into a route; notes are added for what has no counterpart.
pub(crate) fn read_commands(
    commands: &[NumberedCommand],
    notes: &mut Vec<PlanNote>,
) -> Result<PlannedRoute, PlanReadError> {
    let mut indices = BTreeMap::new();
    for (index, command) in commands.iter().enumerate() {
        if indices.insert(command.number, index).is_some() {
            let reason = format!("another item has the number {}, too", command.number);
            return Err(PlanReadError::value(&command.place, reason));
        }
    }
    let mut route = PlannedRoute::default();
    for NumberedCommand { place, command, .. } in commands {
        let read = read_item(command, &indices)
            .map_err(|reason| PlanReadError::value(place.as_str(), reason))?;
        if let Some(text) = read.note {
            let item = Some(route.items.len());
            notes.push(PlanNote { place: place.clone(), text, item });
        }
        route.items.push(read.item);
    }
    Ok(route)
}

fn read_item(command: &MavlinkCommand, indices: &BTreeMap<i64, usize>) -> Result<ReadItem, String> {
    let parameter = |index: usize| command.parameters[index - 1];
    let positive = |index: usize, what: &str| match parameter(index) {
        None => Ok(0.0),
        Some(value) if value.is_finite() && (0.0..=1e9).contains(&value) => Ok(value),
        Some(value) => Err(format!("{what} {value} is not between 0 and a billion")),
    };
    let position = if leads_to_position(command.command) { position_of(command)? } else { None };
    let item = match command.command {
        WAYPOINT if position.is_some() => PlanItem::Go {
            position: position.ok_or("a waypoint without a position")?,
            stay_s: positive(1, "the time to stay")?,
            name: None,
        },
        TAKE_OFF => PlanItem::TakeOff { position, altitude: altitude_of(command)? },
        LAND => PlanItem::Land(position),
        LOITER_TIME => PlanItem::Loiter {
            position,
            time_s: positive(1, "the time to circle")?,
            radius_m: parameter(3).filter(|radius| radius.is_finite()).unwrap_or(0.0),
        },
        RETURN => PlanItem::Return,
        // A negative time means that a time of day is given instead.
        DELAY if parameter(1).is_some_and(|seconds| seconds >= 0.0) => {
            PlanItem::Delay(positive(1, "the delay")?)
        }
        JUMP => {
            let number = parameter(1).ok_or("a jump without the number of an item")?;
            let to = indices.get(&(number as i64)).filter(|_| number.fract() == 0.0);
            let to = *to.ok_or_else(|| format!("a jump to item {number}, which does not exist"))?;
            let times = parameter(2).unwrap_or(0.0);
            let times =
                if times < 0.0 { None } else { Some(positive(2, "the number of jumps")? as u32) };
            PlanItem::Repeat { to, times }
        }
        CHANGE_SPEED if parameter(2).is_some_and(|speed| speed >= 0.0) => {
            PlanItem::Speed(positive(2, "the speed")?)
        }
        LOOK_AT => PlanItem::LookAt(position.ok_or("no position to look at")?),
        REGION_OF_INTEREST if parameter(1) == Some(MODE_LOCATION) => {
            PlanItem::LookAt(position.ok_or("no position to look at")?)
        }
        REGION_OF_INTEREST if parameter(1).unwrap_or(0.0) == 0.0 => PlanItem::LookAhead,
        LOOK_AHEAD => PlanItem::LookAhead,
        TAKE_PICTURES => PlanItem::TakePictures {
            interval_s: positive(2, "the time between pictures")?,
            count: positive(3, "the number of pictures")? as u32,
        },
        STOP_PICTURES => PlanItem::StopPictures,
        number => {
            let text =
                format!("the MAVLink command {number} has no counterpart; it is kept as it is");
            return Ok(ReadItem { item: PlanItem::Other(*command), note: Some(text) });
        }
    };
    // What the item does not carry is named, so that it is not lost silently.
    let written = command_of(&item, |index| index as i64);
    let lost: Vec<String> = (0..4)
        .filter(|index| {
            let (ours, theirs) = (written.parameters[*index], command.parameters[*index]);
            let given = theirs.is_some_and(|value| value != 0.0 && value.is_finite());
            given && ours.unwrap_or(0.0) == 0.0
        })
        .map(|index| format!("{} = {}", index + 1, command.parameters[index].unwrap_or_default()))
        .collect();
    let note = (!lost.is_empty() && command.command != REGION_OF_INTEREST).then(|| {
        let parameters = lost.join(", ");
        format!(
            "parameters of the MAVLink command {} without counterpart: {parameters}",
            command.command
        )
    });
    Ok(ReadItem { item, note })
}

impl MavlinkCommand {
    /// Where it leads the vehicle, if it is a command of navigation with a position.
    pub fn leads_to(&self) -> Option<PlanPosition> {
        position_of(self).ok().flatten().filter(|_| self.command <= LAST_NAVIGATION)
    }
}

fn leads_to_position(command: u16) -> bool {
    command <= LAST_NAVIGATION || matches!(command, LOOK_AT | REGION_OF_INTEREST)
}

/// The altitude of a command, if it has one.
fn altitude_of(command: &MavlinkCommand) -> Result<Option<PlanAltitude>, String> {
    let reference = match command.frame {
        0 | 5 => AltitudeReference::Sea,
        3 | 6 => AltitudeReference::Home,
        10 | 11 => AltitudeReference::Terrain,
        FRAME_MISSION => return Ok(None),
        frame => {
            return Err(format!(
                "its position is in the MAVLink frame {frame}; positions in degrees (frames 0, 3, 5, 6, 10, 11) are read"
            ));
        }
    };
    Ok(command.parameters[6].map(|m| PlanAltitude { m, reference }))
}

/// The position of a command, if it has one: zero for latitude and longitude means that the
/// vehicle stays where it is.
fn position_of(command: &MavlinkCommand) -> Result<Option<PlanPosition>, String> {
    let altitude = altitude_of(command)?;
    match (command.parameters[4], command.parameters[5]) {
        _ if command.frame == FRAME_MISSION => Ok(None),
        (Some(latitude), Some(longitude)) if latitude != 0.0 || longitude != 0.0 => {
            PlanPosition::checked(latitude, longitude, altitude).map(Some)
        }
        _ => Ok(None),
    }
}

fn frame_of(reference: AltitudeReference) -> u8 {
    match reference {
        AltitudeReference::Sea => 0,
        AltitudeReference::Home => 3,
        AltitudeReference::Terrain => 10,
    }
}

/// An item as a command; `number_of` gives the number of an item by its index.
pub(crate) fn command_of(item: &PlanItem, number_of: impl Fn(usize) -> i64) -> MavlinkCommand {
    let plain = |command: u16, first: &[(usize, f64)]| {
        let mut parameters = [Some(0.0); 7];
        for (index, value) in first {
            parameters[index - 1] = Some(*value);
        }
        MavlinkCommand { command, frame: FRAME_MISSION, parameters }
    };
    let placed = |command: u16, position: Option<PlanPosition>, first: &[(usize, f64)]| {
        let mut at = plain(command, first);
        // Without an altitude, that of the home position is kept.
        let home = PlanAltitude { m: 0.0, reference: AltitudeReference::Home };
        let altitude = position.and_then(|position| position.altitude).unwrap_or(home);
        at.frame = frame_of(altitude.reference);
        let coordinates = match position {
            Some(at) => [Some(at.latitude_deg), Some(at.longitude_deg), at.altitude.map(|of| of.m)],
            None => [None, None, None],
        };
        at.parameters[4..7].copy_from_slice(&coordinates);
        at
    };
    match item {
        PlanItem::Go { position, stay_s, .. } => placed(WAYPOINT, Some(*position), &[(1, *stay_s)]),
        PlanItem::TakeOff { position, altitude } => {
            let mut command = placed(TAKE_OFF, *position, &[]);
            if let (None, Some(altitude)) = (position, altitude) {
                command.frame = frame_of(altitude.reference);
                command.parameters[6] = Some(altitude.m);
            }
            command
        }
        PlanItem::Land(position) => placed(LAND, *position, &[]),
        PlanItem::Loiter { position, time_s, radius_m } => {
            placed(LOITER_TIME, *position, &[(1, *time_s), (3, *radius_m)])
        }
        PlanItem::Return => plain(RETURN, &[]),
        PlanItem::Delay(seconds) => plain(DELAY, &[(1, *seconds), (2, -1.0), (3, -1.0), (4, -1.0)]),
        PlanItem::Repeat { to, times } => {
            plain(JUMP, &[(1, number_of(*to) as f64), (2, times.map_or(-1.0, f64::from))])
        }
        // Type 1 is the speed over ground; throttle -1 leaves it.
        PlanItem::Speed(speed) => plain(CHANGE_SPEED, &[(1, 1.0), (2, *speed), (3, -1.0)]),
        PlanItem::LookAt(position) => placed(LOOK_AT, Some(*position), &[]),
        PlanItem::LookAhead => plain(LOOK_AHEAD, &[]),
        PlanItem::TakePictures { interval_s, count } => {
            plain(TAKE_PICTURES, &[(2, *interval_s), (3, f64::from(*count))])
        }
        PlanItem::StopPictures => plain(STOP_PICTURES, &[]),
        PlanItem::Other(command) => *command,
    }
}
