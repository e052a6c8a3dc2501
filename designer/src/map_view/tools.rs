//! What a click on the map does.

use armor_robotfile::site_map::{LineKind, ZoneKind};

use crate::map_view::scene::word_of;

/// A tool of the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Selects and moves.
    #[default]
    Select,
    /// Draws a point.
    Point,
    /// Draws a rally point.
    Rally,
    /// Adds a leg to a route.
    Leg,
    /// Adds a stay behind a leg.
    Stay,
    /// Lets two routes meet.
    Meeting,
    /// Draws a zone, corner by corner.
    Zone(ZoneKind),
    /// Draws a line, point by point.
    Line(LineKind),
    /// Draws a military symbol.
    Symbol,
    /// Measures the length of a path.
    Measure,
}

impl Tool {
    /// All of them, in the order of the palette.
    pub const ALL: [Self; 15] = [
        Self::Select,
        Self::Point,
        Self::Rally,
        Self::Leg,
        Self::Stay,
        Self::Meeting,
        Self::Zone(ZoneKind::NoGo),
        Self::Zone(ZoneKind::StayIn),
        Self::Zone(ZoneKind::Speed),
        Self::Zone(ZoneKind::Observe),
        Self::Line(LineKind::Phase),
        Self::Line(LineKind::Boundary),
        Self::Line(LineKind::Limit),
        Self::Symbol,
        Self::Measure,
    ];

    /// What the palette calls it.
    pub fn name(self) -> String {
        match self {
            Self::Select => "Select".into(),
            Self::Point => "Point".into(),
            Self::Rally => "Rally point".into(),
            Self::Leg => "Leg".into(),
            Self::Stay => "Stay".into(),
            Self::Meeting => "Meeting".into(),
            Self::Zone(kind) => format!("Zone: {}", word_of(&ZoneKind::NAMED, kind)),
            Self::Line(kind) => format!("Line: {}", word_of(&LineKind::NAMED, kind)),
            Self::Symbol => "Symbol".into(),
            Self::Measure => "Measure".into(),
        }
    }

    /// What it does.
    pub fn doc(self) -> &'static str {
        match self {
            Self::Select => "Click selects, drag moves.",
            Self::Point => "Click draws a point that routes can lead to.",
            Self::Rally => "Click draws a point where robots go when something fails.",
            Self::Leg => "Click adds a leg to the route: to a point, or to a new one.",
            Self::Stay => "Click a leg, or its point: the robot stays there for a time.",
            Self::Meeting => {
                "Click a leg of one route, then one of another, or a point that both lead to: the \
                 robots wait there for each other."
            }
            Self::Zone(_) => "Click draws corners; Enter or a double-click ends the zone.",
            Self::Line(_) => "Click draws points; Enter or a double-click ends the line.",
            Self::Symbol => "Click draws a military symbol.",
            Self::Measure => "Click by click, the length of a path; Escape begins again.",
        }
    }

    /// How many points it takes before it can be ended; none if each click is whole.
    pub fn least_points(self) -> Option<usize> {
        match self {
            Self::Zone(_) => Some(3),
            Self::Line(_) => Some(2),
            _ => None,
        }
    }
}
