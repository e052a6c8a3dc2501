//! What the file allows a component of its host: processor and memory.

use std::collections::BTreeSet;

use crate::source::Spanned;

/// Highest number of a processor that a file may name.
const MAX_CPU: usize = 1023;
/// Units of an amount of memory, in bytes.
const MEMORY_UNITS: [(&str, u64); 6] = [
    ("KiB", 1 << 10),
    ("MiB", 1 << 20),
    ("GiB", 1 << 30),
    ("kB", 1_000),
    ("MB", 1_000_000),
    ("GB", 1_000_000_000),
];

/// What a component's process may use of its host; what is not given is not limited.
#[derive(Clone, Debug, Default)]
pub struct ResourceLimits {
    /// Its niceness, -20 to 19: the higher, the more it leaves to others.
    pub nice: Option<Spanned<i32>>,
    /// Its priority among processes in real time (`SCHED_FIFO`), 1 to 99: each goes before all that
    /// have a lower one or none.
    pub realtime: Option<Spanned<u8>>,
    /// The processors on which it may run, from 0.
    pub cpus: Option<Spanned<BTreeSet<usize>>>,
    /// Its share of the processors' time.
    pub cpu: Option<Spanned<CpuShare>>,
    /// The memory that it may allocate, in bytes.
    pub memory: Option<Spanned<u64>>,
}

/// A share of the processors' time, in thousandths of one processor: 1500 is one and a half.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CpuShare {
    /// Thousandths of one processor.
    pub permille: u32,
}

/// Reads a niceness, such as `5`.
///
/// # Errors
/// What is expected.
pub fn parse_nice(text: &str) -> Result<i32, String> {
    let number = text.parse().ok().filter(|number| (-20..=19).contains(number));
    number.filter(|_| !text.starts_with('+')).ok_or_else(|| {
        "a whole number from -20 (goes before others) to 19 (leaves to others) is expected".into()
    })
}

/// Reads a priority in real time, such as `10`.
///
/// # Errors
/// What is expected.
pub fn parse_realtime(text: &str) -> Result<u8, String> {
    let is_number = text.bytes().all(|byte| byte.is_ascii_digit());
    let number = text.parse().ok().filter(|number| is_number && (1..=99).contains(number));
    number.ok_or_else(|| {
        "a priority from 1 to 99 is expected; a higher one goes before a lower one".into()
    })
}

/// Reads numbers and ranges of processors, such as `0 2-3`.
///
/// # Errors
/// What is expected.
pub fn parse_cpus(text: &str) -> Result<BTreeSet<usize>, String> {
    let number = |text: &str| {
        let number = text.parse::<usize>().ok().filter(|number| *number <= MAX_CPU);
        number.filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()))
    };
    let mut cpus = BTreeSet::new();
    for part in text.split_whitespace() {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        match (number(first), number(last)) {
            (Some(first), Some(last)) if first <= last => cpus.extend(first..=last),
            _ => return Err(expected_cpus()),
        }
    }
    if cpus.is_empty() { Err(expected_cpus()) } else { Ok(cpus) }
}

fn expected_cpus() -> String {
    format!("numbers and ranges of processors from 0 to {MAX_CPU} are expected, such as \"0 2-3\"")
}

/// Reads a share of one processor, such as `50%` or, of two, `150%`.
///
/// # Errors
/// What is expected.
pub fn parse_cpu(text: &str) -> Result<CpuShare, String> {
    let expected =
        || "a share of one processor is expected, such as 50%, or 150% of two".to_owned();
    let number = text.strip_suffix('%').ok_or_else(expected)?;
    let (whole, tenth) = number.split_once('.').unwrap_or((number, "0"));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !is_number(whole) || !is_number(tenth) || tenth.len() > 1 {
        return Err(expected());
    }
    let read = |text: &str| text.parse::<u32>().ok();
    let permille = read(whole).and_then(|whole| whole.checked_mul(10)?.checked_add(read(tenth)?));
    let permille = permille.filter(|permille| *permille <= MAX_CPU_PERMILLE);
    let permille = permille.ok_or("this is more than a computer has")?;
    if permille < LEAST_CPU_PERMILLE {
        return Err("the kernel limits a process to 1% or more".into());
    }
    Ok(CpuShare { permille })
}

/// All processors that a file may name.
const MAX_CPU_PERMILLE: u32 = (MAX_CPU as u32 + 1) * 1000;
/// The kernel accepts no quota below a millisecond of its period of 100 ms.
const LEAST_CPU_PERMILLE: u32 = 10;

/// Reads an amount of memory in bytes, such as `512MiB`.
///
/// # Errors
/// What is expected.
pub fn parse_memory(text: &str) -> Result<u64, String> {
    let expected = || "an amount such as 512MiB or 2GB is expected".to_owned();
    let units = || MEMORY_UNITS.iter();
    let (number, factor) = units()
        .find_map(|(unit, factor)| Some((text.strip_suffix(unit)?, *factor)))
        .ok_or_else(expected)?;
    let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    let number: u64 = number.parse().ok().filter(|_| is_number).ok_or_else(expected)?;
    let bytes = number.checked_mul(factor).ok_or("this is more than a computer has")?;
    if bytes < LEAST_MEMORY {
        return Err("a process needs at least 16MiB".into());
    }
    Ok(bytes)
}

/// Below this no component starts: each of its threads needs 2 MiB.
const LEAST_MEMORY: u64 = 16 << 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_component_may_use_is_read() {
        assert_eq!((parse_nice("-20"), parse_nice("19")), (Ok(-20), Ok(19)));
        assert_eq!((parse_realtime("1"), parse_realtime("99")), (Ok(1), Ok(99)));
        for wrong in ["0", "100", "+5", "-1", "fifo", ""] {
            assert!(parse_realtime(wrong).is_err(), "{wrong}");
        }
        assert_eq!(parse_cpus("3 0-1"), Ok(BTreeSet::from([0, 1, 3])));
        assert_eq!(parse_memory("512MiB"), Ok(512 << 20));
        assert_eq!(parse_memory("2GB"), Ok(2_000_000_000));
        for (text, permille) in
            [("50%", 500), ("12.5%", 125), ("1%", 10), ("250%", 2500), ("102400%", 1_024_000)]
        {
            assert_eq!(parse_cpu(text), Ok(CpuShare { permille }), "{text}");
        }
        for wrong in
            ["", "%", "50", "0.5", "0%", "0.9%", "-5%", "+5%", "12.55%", "5.%", "102401%", "0 2-3"]
        {
            assert!(parse_cpu(wrong).is_err(), "{wrong}");
        }
        for wrong in ["20", "-21", "+5", "1.5", "", "low"] {
            assert!(parse_nice(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "-1", "1-", "3-1", "0,1", "1024", "a", "+1"] {
            assert!(parse_cpus(wrong).is_err(), "{wrong}");
        }
        for wrong in
            ["", "512", "MiB", "1.5GB", "1 MiB", "15MiB", "99999999999GiB", "-1GB", "512mb"]
        {
            assert!(parse_memory(wrong).is_err(), "{wrong}");
        }
    }
}
