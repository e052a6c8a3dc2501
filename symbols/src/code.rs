//! The code of a symbol: 20 digits, or the older 15 letters, as one model.

use std::fmt;

/// What a symbol stands for, read from its code.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct SymbolCode {
    /// Reality, exercise or simulation.
    pub context: SymbolContext,
    /// Whose it is.
    pub identity: StandardIdentity,
    /// The dimension and kind of the entity.
    pub set: SymbolSet,
    /// Present, planned, or its operational condition.
    pub status: SymbolStatus,
    /// Headquarters, task force, feint or dummy.
    pub headquarters: Headquarters,
    /// Digits 9 and 10: echelon, mobility or towed array; 0 is none.
    pub amplifier: u8,
    /// Digits 11 to 16: entity, type and subtype.
    pub entity: u32,
    /// Digits 17 and 18: the modifier above the icon.
    pub upper_modifier: u8,
    /// Digits 19 and 20: the modifier below the icon.
    pub lower_modifier: u8,
    /// The function letters of an older code that no entity of this crate corresponds to.
    pub unknown_function: Option<String>,
}

/// Why a code cannot be read. Positions count from 1.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodeError {
    /// Neither 20 nor 15 characters.
    #[error(
        "a symbol code has 20 digits or 15 letters, but this one has {found} characters; check for missing or surplus ones"
    )]
    Length {
        /// How many there are.
        found: usize,
    },
    /// A character that cannot stand at its position.
    #[error("'{found}' at position {position} of the symbol code; {wanted} must stand there")]
    Character {
        /// Where it is.
        position: usize,
        /// The character.
        found: char,
        /// What may be there.
        wanted: &'static str,
    },
    /// A value that the standard does not define.
    #[error(
        "{field} {found} at position {position} of the symbol code is not defined; known are {known}"
    )]
    Value {
        /// Where it begins.
        position: usize,
        /// Its digits.
        found: String,
        /// What the digits are for.
        field: &'static str,
        /// The values that are defined.
        known: &'static str,
    },
}

/// Declares an enumeration whose values have digits in the code.
macro_rules! digits {
    ($(#[$doc:meta])* $name:ident: $field:literal, $known:literal; $($(#[$of:meta])* $value:ident = $digits:literal,)*) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$of])* $value,)* }

        impl $name {
            /// All values.
            pub const ALL: &[Self] = &[$(Self::$value),*];

            /// The number in the code of 20 digits.
            pub fn digits(self) -> u8 {
                match self { $(Self::$value => $digits,)* }
            }

            fn of_digits(digits: u8, position: usize, width: usize) -> Result<Self, CodeError> {
                match digits {
                    $($digits => Ok(Self::$value),)*
                    _ => Err(CodeError::Value {
                        position,
                        found: format!("{digits:0width$}"),
                        field: $field,
                        known: $known,
                    }),
                }
            }
        }
    };
}

digits! {
    /// Whether the thing exists, is played in an exercise, or is simulated.
    SymbolContext: "context", "0 reality, 1 exercise, 2 simulation";
    /// It exists.
    Reality = 0,
    /// It is part of an exercise.
    Exercise = 1,
    /// It is simulated.
    Simulation = 2,
}

digits! {
    /// Whose something is.
    StandardIdentity: "identity",
    "0 pending, 1 unknown, 2 assumed friend, 3 friend, 4 neutral, 5 suspect, 6 hostile";
    /// Not yet assessed.
    Pending = 0,
    /// Assessed, but not known.
    Unknown = 1,
    /// Probably a friend.
    AssumedFriend = 2,
    /// A friend.
    Friend = 3,
    /// Neither friend nor enemy.
    Neutral = 4,
    /// Probably hostile; in an exercise a joker.
    Suspect = 5,
    /// Hostile; in an exercise a faker.
    Hostile = 6,
}

digits! {
    /// The dimension and kind of what a symbol stands for.
    SymbolSet: "symbol set",
    "00, 01, 02, 05, 06, 10, 11, 15, 20, 25, 27, 30, 35, 36, 40, 45, 46, 47, 50 to 54 and 60";
    /// Not known.
    Unknown = 0,
    /// Aircraft.
    Air = 1,
    /// Missiles in the air.
    AirMissile = 2,
    /// Spacecraft.
    Space = 5,
    /// Missiles in space.
    SpaceMissile = 6,
    /// Units on land.
    LandUnit = 10,
    /// Civilian units and organisations on land.
    LandCivilian = 11,
    /// Vehicles, weapons and other equipment on land.
    LandEquipment = 15,
    /// Installations on land.
    LandInstallation = 20,
    /// Points, lines and areas that are drawn on the map.
    ControlMeasure = 25,
    /// Single persons.
    DismountedIndividual = 27,
    /// Ships and boats.
    SeaSurface = 30,
    /// Submarines and underwater vehicles.
    SeaSubsurface = 35,
    /// Mines in the sea.
    MineWarfare = 36,
    /// Events and activities.
    Activity = 40,
    /// Weather.
    Atmospheric = 45,
    /// The sea.
    Oceanographic = 46,
    /// Weather in space.
    MeteorologicalSpace = 47,
    /// Signals from space.
    SignalsSpace = 50,
    /// Signals from the air.
    SignalsAir = 51,
    /// Signals from land.
    SignalsLand = 52,
    /// Signals from the sea.
    SignalsSurface = 53,
    /// Signals from under the sea.
    SignalsSubsurface = 54,
    /// Cyberspace.
    Cyberspace = 60,
}

digits! {
    /// Present, planned, or the condition of something present.
    SymbolStatus: "status",
    "0 present, 1 planned, 2 fully capable, 3 damaged, 4 destroyed, 5 full to capacity";
    /// It exists there now.
    Present = 0,
    /// It is planned, anticipated or suspected.
    Planned = 1,
    /// There and fully capable.
    FullyCapable = 2,
    /// There and damaged.
    Damaged = 3,
    /// There and destroyed.
    Destroyed = 4,
    /// There and full.
    FullToCapacity = 5,
}

digits! {
    /// Headquarters, task force, feint or dummy.
    Headquarters: "headquarters, task force or dummy", "0 to 7";
    /// None of these.
    None = 0,
    /// A feint or dummy.
    Dummy = 1,
    /// A headquarters.
    Headquarters = 2,
    /// The headquarters of a feint.
    DummyHeadquarters = 3,
    /// A task force.
    TaskForce = 4,
    /// The feint of a task force.
    DummyTaskForce = 5,
    /// The headquarters of a task force.
    TaskForceHeadquarters = 6,
    /// The feint of a task force's headquarters.
    DummyTaskForceHeadquarters = 7,
}

impl Headquarters {
    /// Whether it is a feint or dummy.
    pub fn is_dummy(self) -> bool {
        self.digits() & 1 != 0
    }

    /// Whether it is a headquarters.
    pub fn is_headquarters(self) -> bool {
        self.digits() & 2 != 0
    }

    /// Whether it is a task force.
    pub fn is_task_force(self) -> bool {
        self.digits() & 4 != 0
    }
}

/// The amplifiers of digits 9 and 10.
const AMPLIFIERS: &[(u8, &str)] = &[
    (11, "team or crew"),
    (12, "squad"),
    (13, "section"),
    (14, "platoon or detachment"),
    (15, "company, battery or troop"),
    (16, "battalion or squadron"),
    (17, "regiment or group"),
    (18, "brigade"),
    (21, "division"),
    (22, "corps"),
    (23, "army"),
    (24, "army group or front"),
    (25, "region or theatre"),
    (26, "command"),
    (31, "wheeled, limited cross country"),
    (32, "wheeled, cross country"),
    (33, "tracked"),
    (34, "wheeled and tracked"),
    (35, "towed"),
    (36, "railway"),
    (37, "pack animals"),
    (41, "over snow"),
    (42, "sled"),
    (51, "barge"),
    (52, "amphibious"),
    (61, "short towed array"),
    (62, "long towed array"),
];

impl SymbolCode {
    /// Reads a code of 20 digits.
    pub(crate) fn of_digits(code: &str) -> Result<Self, CodeError> {
        let mut digits = [0_u8; 20];
        for (index, (character, digit)) in code.chars().zip(&mut digits).enumerate() {
            *digit = character.to_digit(10).ok_or(CodeError::Character {
                position: index + 1,
                found: character,
                wanted: "a digit",
            })? as u8;
        }
        let pair = |first: usize| digits[first - 1] * 10 + digits[first];
        let amplifier = pair(9);
        if amplifier != 0 && !AMPLIFIERS.iter().any(|(known, _)| *known == amplifier) {
            return Err(CodeError::Value {
                position: 9,
                found: format!("{amplifier:02}"),
                field: "echelon or mobility",
                known: "00, 11 to 18, 21 to 26, 31 to 37, 41, 42, 51, 52, 61 and 62",
            });
        }
        Ok(Self {
            context: SymbolContext::of_digits(digits[2], 3, 1)?,
            identity: StandardIdentity::of_digits(digits[3], 4, 1)?,
            set: SymbolSet::of_digits(pair(5), 5, 2)?,
            status: SymbolStatus::of_digits(digits[6], 7, 1)?,
            headquarters: Headquarters::of_digits(digits[7], 8, 1)?,
            amplifier,
            entity: digits[10..16].iter().fold(0, |sum, digit| sum * 10 + u32::from(*digit)),
            upper_modifier: pair(17),
            lower_modifier: pair(19),
            unknown_function: None,
        })
    }

    /// The name of the echelon or mobility, if the code has one.
    pub fn amplifier_name(&self) -> Option<&'static str> {
        AMPLIFIERS.iter().find(|(code, _)| *code == self.amplifier).map(|(_, name)| *name)
    }

    /// Whether it is civilian, which colours the frame unless it is hostile.
    pub fn is_civilian(&self) -> bool {
        let entity = self.entity / 10_000;
        match self.set {
            SymbolSet::LandCivilian => true,
            SymbolSet::Air | SymbolSet::SeaSubsurface => entity == 12,
            SymbolSet::LandEquipment => entity == 16,
            SymbolSet::SeaSurface => entity == 14,
            _ => false,
        }
    }
}

impl fmt::Display for SymbolCode {
    /// The code of 20 digits, in the version of the standard's edition D.
    fn fmt(&self, text: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            text,
            "10{}{}{:02}{}{}{:02}{:06}{:02}{:02}",
            self.context.digits(),
            self.identity.digits(),
            self.set.digits(),
            self.status.digits(),
            self.headquarters.digits(),
            self.amplifier,
            self.entity,
            self.upper_modifier,
            self.lower_modifier
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_is_read_from_its_position_and_written_back() {
        let code = SymbolCode::parse("10161044181211030102").expect("it is valid");
        assert_eq!(code.context, SymbolContext::Exercise);
        assert_eq!(code.identity, StandardIdentity::Hostile);
        assert_eq!(code.set, SymbolSet::LandUnit);
        assert_eq!(code.status, SymbolStatus::Destroyed);
        assert!(code.headquarters.is_task_force() && !code.headquarters.is_headquarters());
        assert_eq!(code.amplifier_name(), Some("brigade"));
        assert_eq!((code.entity, code.upper_modifier, code.lower_modifier), (121_103, 1, 2));
        assert_eq!(code.to_string(), "10161044181211030102");
    }

    #[test]
    fn an_error_names_the_position() {
        let check = |code: &str, part: &str| {
            let error = SymbolCode::parse(code).expect_err(code).to_string();
            assert!(error.contains(part), "{error}");
        };
        check("1003", "4 characters");
        check("1003100014121100000x", "'x' at position 20");
        check("10091000141211000000", "identity 9 at position 4");
        check("10039900141211000000", "symbol set 99 at position 5");
        check("10031000191211000000", "echelon or mobility 19 at position 9");
        check("10031090141211000000", "status 9 at position 7");
        check("äöüäöüäöüäöüäöüäöüäö", "'ä' at position 1");
    }
}
