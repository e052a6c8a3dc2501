//! The journal in words, for people.

use crate::record::JournalEntry;
use crate::terms::{MissionOutcome, Tokens};
use armor_plan::DatePhase;
use std::fmt;

impl fmt::Display for JournalEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Snapshot(it) => {
                let (records, marked) = (it.records, in_words(&it.marking));
                write!(f, "{records} records before this one are not kept; marked: {marked}")
            }
            Self::Began { mission, .. } => write!(f, "mission {mission} begins"),
            Self::Changed { version, changes, restarts, .. } => {
                write!(f, "version {} of the file is played", version.number)?;
                changes.iter().try_for_each(|change| write!(f, "; {change}"))?;
                restarts
                    .iter()
                    .try_for_each(|name| write!(f, "; {name} is started again with other values"))
            }
            Self::Refused { version, why } => {
                write!(f, "version {version} of the file is refused: {why}")
            }
            Self::Took { firing, cause, from, to, late_s, sets, .. } => {
                write!(f, "firing {firing}, {cause}: {} -> {}", in_words(from), in_words(to))?;
                if *late_s > 0.0 {
                    write!(f, ", {late_s:.3} s late")?;
                }
                sets.iter().try_for_each(|set| write!(f, "; {} is {}", set.variable, set.value))
            }
            Self::Stopped { firing } => write!(f, "firing {firing}: all that had to stop has"),
            Self::Activating { component, activation, values } => {
                write!(f, "{component} is activated, number {activation}")?;
                let mut before = " with ";
                values.iter().try_for_each(|value| {
                    write!(f, "{}{value}", std::mem::replace(&mut before, ", "))
                })
            }
            Self::Redirected { firing, to, why } => {
                write!(f, "firing {firing} goes to {} instead: {why}", in_words(to))
            }
            Self::Put { firing } => write!(f, "firing {firing}: complete"),
            Self::Heard { component, report, .. } => write!(f, "{component}: {report}"),
            Self::Ordered(judged) => {
                let verdict = if judged.accepted { "accepted" } else { "refused" };
                let take = if judged.take { " (takes the command over)" } else { "" };
                let (author, order, text) = (&judged.by.author, &judged.order, &judged.text);
                write!(f, "{author} orders: {order}{take}; {verdict}: {text}")
            }
            Self::Asked { transition } => write!(f, "asks whether {transition} may fire"),
            Self::Unanswered { transition, fires: true } => {
                write!(f, "no answer about {transition}: it fires")
            }
            Self::Unanswered { transition, fires: false } => {
                write!(f, "no answer about {transition}: it does not fire")
            }
            Self::LinkLost { author } => write!(f, "the link to {author}, who commanded, is lost"),
            Self::Held { why } => write!(f, "holds: {why}"),
            Self::Guard { transition, holds, because } => {
                let verb = if *holds { "holds" } else { "does not hold" };
                write!(f, "the guard of {transition} {verb}: {because}")
            }
            Self::Dated { transition, phase, used, utc } => match phase {
                DatePhase::Open => write!(f, "the date of {transition} has come, at {utc}"),
                DatePhase::Early => {
                    write!(f, "the date of {transition} is to come again: the clock shows {utc}")
                }
                DatePhase::Past => {
                    let how = if *used { "" } else { " unused" };
                    write!(f, "the date of {transition} has passed{how}, at {utc}")
                }
            },
            Self::Retreated { why } => write!(f, "retreats: {why}"),
            Self::GaveUp { why } => write!(f, "gives up: {why}"),
            Self::Ended { outcome } => write!(f, "the end: {outcome}"),
        }
    }
}

impl fmt::Display for MissionOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Goal => "at its goal",
            Self::Safe => "in its safe place",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        })
    }
}

fn in_words(tokens: &[Tokens]) -> String {
    let one = |it: &Tokens| match it.tokens {
        1 => it.place.clone(),
        tokens => format!("{tokens} {}", it.place),
    };
    let all: Vec<_> = tokens.iter().map(one).collect();
    if all.is_empty() { "nowhere".to_owned() } else { all.join(" ") }
}
