//! The model that all formats are read into.

use std::fmt;

/// What an altitude is measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AltitudeReference {
    /// Mean sea level.
    Sea,
    /// The home position.
    Home,
    /// The ground below.
    Terrain,
}

/// An altitude in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanAltitude {
    /// Its value.
    pub m: f64,
    /// What it is measured from.
    pub reference: AltitudeReference,
}

/// A position on the Earth (WGS 84).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanPosition {
    /// Degrees north, from -90 to 90.
    pub latitude_deg: f64,
    /// Degrees east, from -180 to 180.
    pub longitude_deg: f64,
    /// The altitude, if the file has one.
    pub altitude: Option<PlanAltitude>,
}

impl PlanPosition {
    /// A position, or the reason why it is none.
    pub(crate) fn checked(
        latitude_deg: f64,
        longitude_deg: f64,
        altitude: Option<PlanAltitude>,
    ) -> Result<Self, String> {
        if !(-90.0..=90.0).contains(&latitude_deg) {
            return Err(format!("latitude {latitude_deg} is not between -90 and 90 degrees"));
        }
        if !(-180.0..=180.0).contains(&longitude_deg) {
            return Err(format!("longitude {longitude_deg} is not between -180 and 180 degrees"));
        }
        if let Some(PlanAltitude { m, .. }) = altitude
            && !(m.is_finite() && m.abs() <= 1e6)
        {
            return Err(format!("altitude {m} m is not within 1000 km"));
        }
        let altitude = altitude.map(|altitude| PlanAltitude { m: rounded(altitude.m), ..altitude });
        let (latitude_deg, longitude_deg) = (rounded(latitude_deg), rounded(longitude_deg));
        Ok(Self { latitude_deg, longitude_deg, altitude })
    }
}

/// A number with ten decimals, which is 0.01 mm in degrees: so that it is read as it was written,
/// although readers of JSON may be off by the last bit.
pub(crate) fn rounded(value: f64) -> f64 {
    const DECIMALS: f64 = 1e10;
    // Above, a double has no ten decimals.
    if value.abs() < 1e5 { (value * DECIMALS).round() / DECIMALS } else { value }
}

/// A MAVLink command that the model has no counterpart for, as it was in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MavlinkCommand {
    /// Its number.
    pub command: u16,
    /// The frame of its position.
    pub frame: u8,
    /// Its seven parameters; nothing stands for "not a number".
    pub parameters: [Option<f64>; 7],
}

/// One item of a route, in the order in which they are carried out.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanItem {
    /// Go to a position, and stay there for some time.
    Go {
        /// Where to.
        position: PlanPosition,
        /// How long to stay, in seconds.
        stay_s: f64,
        /// Its name, if it has one.
        name: Option<String>,
    },
    /// Take off.
    TakeOff {
        /// Where to, if it is not only upwards.
        position: Option<PlanPosition>,
        /// How high.
        altitude: Option<PlanAltitude>,
    },
    /// Land, at a position if one is given.
    Land(Option<PlanPosition>),
    /// Circle around a position.
    Loiter {
        /// The middle; where the vehicle is, if none is given.
        position: Option<PlanPosition>,
        /// How long, in seconds.
        time_s: f64,
        /// The radius in metres; negative is counterclockwise, zero the vehicle's default.
        radius_m: f64,
    },
    /// Return to the home position.
    Return,
    /// Wait, in seconds.
    Delay(f64),
    /// Continue at an earlier or later item of the same route, a number of times.
    Repeat {
        /// The index of that item.
        to: usize,
        /// How many times; nothing is without end.
        times: Option<u32>,
    },
    /// Move at this speed from here on, in metres per second.
    Speed(f64),
    /// Point the camera at a position.
    LookAt(PlanPosition),
    /// Point the camera ahead again.
    LookAhead,
    /// Take pictures.
    TakePictures {
        /// The time from one to the next, in seconds.
        interval_s: f64,
        /// How many; zero is until they are stopped.
        count: u32,
    },
    /// Stop taking pictures.
    StopPictures,
    /// A command without counterpart.
    Other(MavlinkCommand),
}

impl PlanItem {
    /// Where the item leads the vehicle, if it names a position.
    pub fn position(&self) -> Option<PlanPosition> {
        match self {
            Self::Go { position, .. } => Some(*position),
            Self::TakeOff { position, .. }
            | Self::Land(position)
            | Self::Loiter { position, .. } => *position,
            _ => None,
        }
    }
}

/// A route: its items in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlannedRoute {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// What is done.
    pub items: Vec<PlanItem>,
}

/// The outline of a fence.
#[derive(Debug, Clone, PartialEq)]
pub enum FenceShape {
    /// A circle.
    Circle {
        /// Its middle.
        centre: PlanPosition,
        /// Its radius in metres.
        radius_m: f64,
    },
    /// A polygon of three corners or more; the last is joined to the first.
    Polygon(Vec<PlanPosition>),
}

/// An area that is not to be left, or not to be entered.
#[derive(Debug, Clone, PartialEq)]
pub struct Fence {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Whether the vehicle must stay inside; else outside.
    pub stay_in: bool,
    /// Its outline.
    pub shape: FenceShape,
}

/// A position with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPosition {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Where it is.
    pub position: PlanPosition,
}

/// Something that has no counterpart: where it stands and what it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanNote {
    /// Where it stands, such as `item 3`.
    pub place: String,
    /// What it is, and what was done with it.
    pub text: String,
    /// The index of the item of the plan's only route that it is about, if it is about one.
    pub item: Option<usize>,
}

impl fmt::Display for PlanNote {
    fn fmt(&self, text: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(text, "{}: {}", self.place, self.text)
    }
}

/// All that a file of plans contains.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RoutePlan {
    /// The home position.
    pub home: Option<PlanPosition>,
    /// The routes.
    pub routes: Vec<PlannedRoute>,
    /// Areas that limit the vehicle.
    pub fences: Vec<Fence>,
    /// Where the vehicle goes when it breaches a fence.
    pub breach_return: Option<PlanPosition>,
    /// Where the vehicle may go when something fails.
    pub rally_points: Vec<NamedPosition>,
    /// Other positions.
    pub points: Vec<NamedPosition>,
    /// What was read and has no counterpart.
    pub notes: Vec<PlanNote>,
}

impl RoutePlan {
    pub(crate) fn note(&mut self, place: impl Into<String>, text: impl Into<String>) {
        self.notes.push(PlanNote { place: place.into(), text: text.into(), item: None });
    }
}

/// Collects notes of what a format has no place for, each kind once with its number.
#[derive(Default)]
pub(crate) struct Omissions(Vec<(&'static str, usize)>);

impl Omissions {
    pub(crate) fn add(&mut self, kind: &'static str, count: usize) {
        if count == 0 {
            return;
        }
        match self.0.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, sum)) => *sum += count,
            None => self.0.push((kind, count)),
        }
    }

    /// Counts what is no position in a format of positions only.
    pub(crate) fn add_actions(&mut self, route: &PlannedRoute) {
        for item in &route.items {
            let kind = match item {
                PlanItem::Go { stay_s, .. } if *stay_s > 0.0 => "stay at a position",
                PlanItem::Go { .. } => continue,
                PlanItem::TakeOff { .. } => "take-off",
                PlanItem::Land(_) => "landing",
                PlanItem::Loiter { .. } => "circling",
                PlanItem::Return => "return",
                PlanItem::Delay(_) => "delay",
                PlanItem::Repeat { .. } => "repetition",
                PlanItem::Speed(_) => "speed",
                PlanItem::LookAt(_) | PlanItem::LookAhead => "direction of the camera",
                PlanItem::TakePictures { .. } | PlanItem::StopPictures => "command to the camera",
                PlanItem::Other(_) => "MAVLink command",
            };
            self.add(kind, 1);
        }
    }

    pub(crate) fn into_notes(self, format: &str) -> Vec<PlanNote> {
        let note = |(kind, count): (&str, usize)| PlanNote {
            place: format.to_owned(),
            text: format!("has no place for: {kind} ({count})"),
            item: None,
        };
        self.0.into_iter().map(note).collect()
    }
}
