//! Writes TINA's `.net`, for nets that the format can express.

use super::numeral::write_seconds;
use super::{NetFile, Note};
use crate::net::{FiringClass, FiringInterval, NetTransition, PlaceId};
use std::fmt::Write;

/// Why a net cannot be written as `.net`: the format lacks a feature of it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("transition `{transition}` {what}, which .net cannot express; write .pnml")]
pub struct Inexpressible {
    /// The transition.
    pub transition: String,
    /// What it does, in words that follow its name.
    pub what: &'static str,
}

/// Returns the net as `.net` text. Class and priority become an order of transitions (`pr`).
///
/// # Errors
/// If a transition has a reset arc, or is gated.
pub fn write(file: &NetFile) -> Result<String, Inexpressible> {
    let mut out = format!("net {}\n", quote_name(&file.name));
    for (t, note) in file.net.transitions().iter().zip(&file.transitions) {
        let refused = |what| Inexpressible { transition: t.name.clone(), what };
        if !t.resets.is_empty() {
            return Err(refused("empties a place (`<reset>`)"));
        }
        if t.gated {
            return Err(refused(
                "waits for more than tokens and time (a report, a guard or a date)",
            ));
        }
        out += &transition_line(file, t, note);
    }
    for ((place, note), tokens) in
        file.net.places().iter().zip(&file.places).zip(file.net.initial())
    {
        let _ = writeln!(out, "pl {}{} ({tokens})", quote_name(place), label_suffix(note));
    }
    Ok(out + &priority_lines(file))
}

fn transition_line(file: &NetFile, t: &NetTransition, note: &Note) -> String {
    let mut out = format!("tr {}{}", quote_name(&t.name), label_suffix(note));
    if t.interval != FiringInterval::UNTIMED {
        let _ = write!(out, " [{},", write_seconds(t.interval.earliest));
        match t.interval.latest {
            Some(latest) => {
                let _ = write!(out, "{}]", write_seconds(latest));
            }
            None => out += "w[",
        }
    }
    let mut arcs = |arcs: &[(PlaceId, u32)], sign: &str| {
        for &(place, weight) in arcs {
            let _ = write!(out, " {}", quote_name(file.net.place(place)));
            if sign != "*" || weight != 1 {
                let _ = write!(out, "{sign}{weight}");
            }
        }
    };
    arcs(&t.inputs, "*");
    arcs(&t.reads, "?");
    arcs(&t.inhibitors, "?-");
    out += " ->";
    let mut outputs = String::new();
    for &(place, weight) in &t.outputs {
        let _ = write!(outputs, " {}", quote_name(file.net.place(place)));
        if weight != 1 {
            let _ = write!(outputs, "*{weight}");
        }
    }
    out + &outputs + "\n"
}

/// Returns `pr` declarations: each level of class and priority before the next lower one.
fn priority_lines(file: &NetFile) -> String {
    let standing = |t: &&NetTransition| (t.class == FiringClass::Safety, t.priority);
    let mut transitions: Vec<_> = file.net.transitions().iter().collect();
    transitions.sort_by_key(|t| std::cmp::Reverse(standing(t)));
    let levels: Vec<_> = transitions.chunk_by(|a, b| standing(a) == standing(b)).collect();
    let names = |level: &[&NetTransition]| {
        level.iter().map(|t| quote_name(&t.name)).collect::<Vec<_>>().join(" ")
    };
    let mut out = String::new();
    for pair in levels.windows(2) {
        let _ = writeln!(out, "pr {} > {}", names(pair[0]), names(pair[1]));
    }
    out
}

fn label_suffix(note: &Note) -> String {
    if note.label.is_empty() { String::new() } else { format!(" : {}", quote_name(&note.label)) }
}

/// Returns a name as it is, or in braces if the format needs them or it equals a keyword.
fn quote_name(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '\'';
    let keyword = ["net", "tr", "pl", "lb", "pr", "nt"].contains(&name);
    if !name.is_empty() && !keyword && name.chars().all(plain) {
        return name.to_owned();
    }
    let mut out = String::from("{");
    for c in name.chars() {
        if matches!(c, '{' | '}' | '\\') {
            out.push('\\');
        }
        out.push(c);
    }
    out + "}"
}
