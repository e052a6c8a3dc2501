//! The older code of 15 letters (APP-6A to C, MIL-STD-2525B and C), read into the same model.

use crate::code::{
    CodeError, Headquarters, StandardIdentity, SymbolCode, SymbolContext, SymbolSet, SymbolStatus,
};
use crate::{control, icons};

/// Reads 15 letters: scheme, identity, dimension, status, six letters of function, two of
/// amplifier, two of country and the order of battle.
pub(crate) fn read_letters(code: &str) -> Result<SymbolCode, CodeError> {
    let mut letters = ['-'; 15];
    for (index, (character, letter)) in code.chars().zip(&mut letters).enumerate() {
        *letter = match character.to_ascii_uppercase() {
            '*' | '-' => '-',
            upper if upper.is_ascii_alphanumeric() => upper,
            _ => return Err(wrong(index + 1, character, "a letter, '-' or '*'")),
        };
    }
    let (context, identity) = identity_of(letters[1])
        .ok_or_else(|| wrong(2, letters[1], "one of P U A F N S H G W M D L J K"))?;
    let status = status_of(letters[3]).ok_or_else(|| wrong(4, letters[3], "one of A P C D X F"))?;
    let function: String = letters[4..10].iter().collect();
    let (set, entity) = if letters[0] == 'G' {
        (SymbolSet::ControlMeasure, control::entity_of_letters(letters[2], &function))
    } else {
        entity_of(letters[0], letters[2], &function)?
    };
    let (headquarters, amplifier) = amplifier_of(letters[10], letters[11])?;
    let unspecified = function == "------";
    Ok(SymbolCode {
        context,
        identity,
        set,
        status,
        headquarters,
        amplifier,
        entity: entity.unwrap_or(0),
        upper_modifier: 0,
        lower_modifier: 0,
        unknown_function: (entity.is_none() && !unspecified).then_some(function),
    })
}

fn wrong(position: usize, found: char, wanted: &'static str) -> CodeError {
    CodeError::Character { position, found, wanted }
}

fn identity_of(letter: char) -> Option<(SymbolContext, StandardIdentity)> {
    use StandardIdentity as Identity;
    let (exercise, identity) = match letter {
        'P' => (false, Identity::Pending),
        'U' | '-' => (false, Identity::Unknown),
        'A' => (false, Identity::AssumedFriend),
        'F' => (false, Identity::Friend),
        'N' => (false, Identity::Neutral),
        'S' => (false, Identity::Suspect),
        'H' => (false, Identity::Hostile),
        'G' => (true, Identity::Pending),
        'W' => (true, Identity::Unknown),
        'M' => (true, Identity::AssumedFriend),
        'D' => (true, Identity::Friend),
        'L' => (true, Identity::Neutral),
        'J' => (true, Identity::Suspect),
        'K' => (true, Identity::Hostile),
        _ => return None,
    };
    Some((if exercise { SymbolContext::Exercise } else { SymbolContext::Reality }, identity))
}

fn status_of(letter: char) -> Option<SymbolStatus> {
    Some(match letter {
        'P' | '-' => SymbolStatus::Present,
        'A' => SymbolStatus::Planned,
        'C' => SymbolStatus::FullyCapable,
        'D' => SymbolStatus::Damaged,
        'X' => SymbolStatus::Destroyed,
        'F' => SymbolStatus::FullToCapacity,
        _ => return None,
    })
}

/// The symbol set of a scheme and dimension, and the entity of the function if it is known.
fn entity_of(
    scheme: char,
    dimension: char,
    function: &str,
) -> Result<(SymbolSet, Option<u32>), CodeError> {
    if !matches!(scheme, 'S' | 'O' | 'E' | 'I') {
        return Err(wrong(1, scheme, "one of S G O E I"));
    }
    if let Some((set, entity)) = icons::entity_of_letters(scheme, dimension, function) {
        return Ok((set, Some(entity)));
    }
    let set = match (scheme, dimension) {
        ('O' | 'E', _) => SymbolSet::Activity,
        (_, 'P') => SymbolSet::Space,
        (_, 'A') => SymbolSet::Air,
        (_, 'G' | 'F') => match function.as_bytes().first() {
            Some(b'E') => SymbolSet::LandEquipment,
            Some(b'I') => SymbolSet::LandInstallation,
            _ => SymbolSet::LandUnit,
        },
        (_, 'S') => SymbolSet::SeaSurface,
        (_, 'U') => SymbolSet::SeaSubsurface,
        (_, 'X' | 'Z' | '-') => SymbolSet::Unknown,
        _ => return Err(wrong(3, dimension, "one of P A G S U F X Z")),
    };
    Ok((set, None))
}

fn amplifier_of(first: char, second: char) -> Result<(Headquarters, u8), CodeError> {
    let mobility = |pairs: &[(char, u8)]| {
        pairs
            .iter()
            .find(|(letter, _)| *letter == second)
            .map(|(_, amplifier)| (Headquarters::None, *amplifier))
            .ok_or_else(|| wrong(12, second, "a letter of mobility (O to Y) or towed array (S, L)"))
    };
    let headquarters = match first {
        '-' => Headquarters::None,
        'A' => Headquarters::Headquarters,
        'B' => Headquarters::TaskForceHeadquarters,
        'C' => Headquarters::DummyHeadquarters,
        'D' => Headquarters::DummyTaskForceHeadquarters,
        'E' => Headquarters::TaskForce,
        'F' => Headquarters::Dummy,
        'G' => Headquarters::DummyTaskForce,
        // An installation; its second letter only marks a dummy.
        'H' => {
            let dummy = if second == 'B' { Headquarters::Dummy } else { Headquarters::None };
            return Ok((dummy, 0));
        }
        'M' => {
            return mobility(&[
                ('O', 31),
                ('P', 32),
                ('Q', 33),
                ('R', 34),
                ('S', 35),
                ('T', 36),
                ('U', 41),
                ('V', 42),
                ('W', 37),
                ('X', 51),
                ('Y', 52),
            ]);
        }
        'N' => return mobility(&[('S', 61), ('L', 62)]),
        _ => return Err(wrong(11, first, "one of - A to H M N")),
    };
    let amplifier = match second {
        '-' => 0,
        'A'..='H' => 11 + (second as u8 - b'A'),
        'I'..='N' => 21 + (second as u8 - b'I'),
        _ => return Err(wrong(12, second, "'-' or a letter of echelon from A to N")),
    };
    Ok((headquarters, amplifier))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_become_the_same_code_as_digits() {
        for (letters, digits) in [
            ("SFGPUCI----D---", "10031000141211000000"),
            ("SHGAUCFM---E---", "10061010151308000000"),
            ("SNAPMFQ--------", "10040100001103000000"),
            ("SFGPEVU---MP---", "10031500321401000000"),
            ("SKGXUCI---EF---", "10161044161211000000"),
            ("SFGPIXH---H----", "10032000001207020000"),
            ("GFGPOLL--------", "10032500001409000000"),
            ("SUUPSU---------", "10013500001104000000"),
        ] {
            let read = SymbolCode::parse(letters).expect(letters);
            assert_eq!(read.to_string(), digits, "{letters}");
            assert_eq!(read.unknown_function, None, "{letters}");
        }
    }

    #[test]
    fn a_letter_at_a_wrong_position_is_named() {
        for (code, part) in [
            ("XFGPUCI--------", "'X' at position 1"),
            ("SXGPUCI--------", "'X' at position 2"),
            ("SFQPUCI--------", "'Q' at position 3"),
            ("SFGQUCI--------", "'Q' at position 4"),
            ("SFGPUCI---Q----", "'Q' at position 11"),
            ("SFGPUCI----Z---", "'Z' at position 12"),
            ("SFGPUCI---MA---", "'A' at position 12"),
            ("SFGPUC!--------", "'!' at position 7"),
        ] {
            let error = SymbolCode::parse(code).expect_err(code).to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn an_unknown_function_keeps_its_letters() {
        let code = SymbolCode::parse("SFGPUQQQQQ-----").expect("its shape is valid");
        assert_eq!(code.unknown_function.as_deref(), Some("UQQQQQ"));
        assert_eq!((code.set, code.entity), (SymbolSet::LandUnit, 0));
    }
}
