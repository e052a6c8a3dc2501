//! Reads TINA's `.net`: `net`, `tr`, `pl`, `lb`, `pr` and `nt` declarations, which add up to the
//! net. The grammar is on the page "formats" of TINA's manual (LAAS-CNRS). One unit of time is a
//! second.

use super::draft::{DraftPlace, DraftTransition, NetArcKind, NetDraft};
use super::numeral::{parse_scaled_tokens, parse_seconds};
use super::tina_tokens::{TinaToken, TinaWord, split_into_tokens};
use super::{FileError, NetFault, NetFile, Note, fault_at};
use crate::net::FiringInterval;
use petgraph::Incoming;
use petgraph::algo::{kosaraju_scc, toposort};
use petgraph::graph::DiGraph;
use std::collections::HashMap;

pub use super::tina_writing::{Inexpressible, write};

/// Reads a `.net` text.
///
/// # Errors
/// The first fault, with line and column.
pub fn read(text: &str) -> Result<NetFile, FileError> {
    let mut reading =
        TinaReader { tokens: split_into_tokens(text)?, end: text.len(), ..TinaReader::default() };
    let read = reading.read_declarations().and_then(|()| reading.apply_priorities());
    read.map_err(|(at, fault)| fault_at(text, at, fault))?;
    reading.draft.build(text)
}

type TinaResult<T> = Result<T, (usize, NetFault)>;

/// Most pairs of transitions that `pr` declarations may order.
const MAX_PRECEDENCE: usize = 4_000_000;

const KEYWORDS: &[&str] = &["net", "tr", "pl", "lb", "pr", "nt"];

#[derive(Default)]
struct TinaReader {
    tokens: Vec<TinaToken>,
    next: usize,
    end: usize,
    draft: NetDraft,
    places: HashMap<String, u32>,
    transitions: HashMap<String, usize>,
    /// Priorities: first fires before second; and the offset of the declaration.
    precedence: Vec<(usize, usize, usize)>,
}

impl TinaReader {
    fn read_declarations(&mut self) -> TinaResult<()> {
        while let Some(token) = self.tokens.get(self.next).cloned() {
            self.next += 1;
            let keyword = match &token.word {
                TinaWord::Plain(word) => word.as_str(),
                _ => "",
            };
            match keyword {
                "net" => self.draft.name = self.read_name("a name of the net")?.0,
                "tr" => self.read_transition()?,
                "pl" => self.read_place()?,
                "lb" => self.read_label()?,
                "pr" => self.read_priority(token.at)?,
                "nt" => {
                    for wanted in ["a note's name", "0 or 1", "a note"] {
                        self.read_name(wanted)?;
                    }
                }
                _ => {
                    let wanted = "one of net, tr, pl, lb, pr, nt";
                    return Err((token.at, NetFault::Wanted { wanted, found: token.word.shown() }));
                }
            }
        }
        Ok(())
    }

    fn read_transition(&mut self) -> TinaResult<()> {
        let (name, at) = self.read_name("a transition")?;
        let index = self.transition_called(name, at);
        if let Some(label) = self.read_optional_label()? {
            self.draft.transitions[index].note.label = label;
        }
        if self.peek_sign("[") || self.peek_sign("]") {
            self.draft.transitions[index].interval = self.read_interval()?;
        }
        for (name, kind, weight, _) in self.read_arcs()? {
            let place = self.place_called(name);
            self.draft.transitions[index].arcs.push((kind, place, weight));
        }
        let token = self.tokens.get(self.next).filter(|token| token.word == TinaWord::Arrow);
        if token.is_none() {
            return match self.draft.transitions[index].arcs.is_empty() || self.at_declaration() {
                true => Ok(()),
                false => Err(self.expected("-> and output places")),
            };
        }
        self.next += 1;
        for (name, kind, weight, at) in self.read_arcs()? {
            if kind != NetArcKind::Input {
                return Err((at, NetFault::Unsupported("a test on the output side".into())));
            }
            let place = self.place_called(name);
            self.draft.transitions[index].arcs.push((NetArcKind::Output, place, weight));
        }
        Ok(())
    }

    fn read_place(&mut self) -> TinaResult<()> {
        let (name, _) = self.read_name("a place")?;
        let place = self.place_called(name);
        if let Some(label) = self.read_optional_label()? {
            self.draft.places[place as usize].note.label = label;
        }
        if self.peek_sign("(") {
            self.next += 1;
            self.draft.places[place as usize].tokens = self.read_number()?;
            self.expect_sign(')', "a closing parenthesis")?;
        }
        for (name, kind, weight, at) in self.read_arcs()? {
            if kind != NetArcKind::Input {
                return Err((at, NetFault::Unsupported("a test on the output side".into())));
            }
            let index = self.transition_called(name, at);
            self.draft.transitions[index].arcs.push((NetArcKind::Output, place, weight));
        }
        if self.tokens.get(self.next).is_some_and(|token| token.word == TinaWord::Arrow) {
            self.next += 1;
            for (name, kind, weight, at) in self.read_arcs()? {
                let index = self.transition_called(name, at);
                self.draft.transitions[index].arcs.push((kind, place, weight));
            }
        }
        Ok(())
    }

    fn read_label(&mut self) -> TinaResult<()> {
        let (name, at) = self.read_name("a place or transition")?;
        let (label, _) = self.read_name("a label")?;
        if let Some(place) = self.places.get(&name) {
            self.draft.places[*place as usize].note.label = label;
        } else if let Some(index) = self.transitions.get(&name) {
            self.draft.transitions[*index].note.label = label;
        } else {
            return Err((at, NetFault::Unknown(name)));
        }
        Ok(())
    }

    fn read_priority(&mut self, at: usize) -> TinaResult<()> {
        let left = self.read_transitions()?;
        let greater = self.peek_sign(">");
        if !greater && !self.peek_sign("<") {
            return Err(self.expected("< or >"));
        }
        self.next += 1;
        let right = self.read_transitions()?;
        let (first, second) = if greater { (left, right) } else { (right, left) };
        if first.len().saturating_mul(second.len()) > MAX_PRECEDENCE - self.precedence.len() {
            return Err((
                at,
                NetFault::Limit("more than 4,000,000 pairs of transitions are ordered"),
            ));
        }
        for before in &first {
            self.precedence.extend(second.iter().map(|after| (*before, *after, at)));
        }
        Ok(())
    }

    fn read_transitions(&mut self) -> TinaResult<Vec<usize>> {
        let mut indices = Vec::new();
        while self.at_name() {
            let (name, at) = self.read_name("a transition")?;
            indices.push(self.transition_called(name, at));
        }
        match indices.is_empty() {
            true => Err(self.expected("a transition")),
            false => Ok(indices),
        }
    }

    /// Turns the declared order into numbers: the priority of a transition is the length of the
    /// longest chain of transitions below it.
    fn apply_priorities(&mut self) -> TinaResult<()> {
        let pairs =
            self.precedence.iter().map(|(first, second, _)| (*first as u32, *second as u32));
        let precedence = DiGraph::<(), ()>::from_edges(pairs);
        let order = toposort(&precedence, None).map_err(|_| self.circle_fault(&precedence))?;
        for second in order.into_iter().rev() {
            let priority = self.draft.transitions[second.index()].priority + 1;
            for first in precedence.neighbors_directed(second, Incoming) {
                let first = &mut self.draft.transitions[first.index()];
                first.priority = first.priority.max(priority);
            }
        }
        Ok(())
    }

    /// Returns the fault of the first declared pair that is part of a circle.
    fn circle_fault(&self, precedence: &DiGraph<(), ()>) -> (usize, NetFault) {
        let mut component_of = vec![0; precedence.node_count()];
        for (number, component) in kosaraju_scc(precedence).iter().enumerate() {
            component.iter().for_each(|member| component_of[member.index()] = number);
        }
        let in_circle =
            |pair: &&(usize, usize, usize)| component_of[pair.0] == component_of[pair.1];
        let (first, _, at) = self.precedence.iter().find(in_circle).expect("there is a circle");
        (*at, NetFault::Circle(self.draft.transitions[*first].name.clone()))
    }

    /// Parses arcs, names with a kind and a weight, up to an arrow or the next declaration.
    fn read_arcs(&mut self) -> TinaResult<Vec<(String, NetArcKind, u32, usize)>> {
        let mut arcs = Vec::new();
        while self.at_name() {
            let (name, at) = self.read_name("a name")?;
            let sign = match self.tokens.get(self.next).map(|token| &token.word) {
                Some(TinaWord::Sign(sign)) => *sign,
                _ => ' ',
            };
            let kind = match sign {
                '*' => NetArcKind::Input,
                '?' => NetArcKind::Read,
                'i' => NetArcKind::Inhibitor,
                '!' | 'j' => return Err((at, NetFault::Unsupported("a stopwatch arc".into()))),
                _ => {
                    arcs.push((name, NetArcKind::Input, 1, at));
                    continue;
                }
            };
            self.next += 1;
            match self.read_number()? {
                0 => return Err((at, NetFault::ZeroWeight)),
                weight => arcs.push((name, kind, weight, at)),
            }
        }
        Ok(arcs)
    }

    fn read_interval(&mut self) -> TinaResult<FiringInterval> {
        let at = self.offset_here();
        let opens = self.peek_sign("]");
        self.next += 1;
        let earliest = self.read_time()?.ok_or((at, NetFault::Time("w".into())))?;
        self.expect_sign(',', "a comma")?;
        let latest = self.read_time()?;
        let closes = self.peek_sign("[");
        if !closes {
            self.expect_sign(']', "the end of the interval")?;
        } else {
            self.next += 1;
        }
        if opens || (closes && latest.is_some()) {
            return Err((at, NetFault::OpenInterval));
        }
        match latest {
            Some(latest) if latest < earliest => Err((at, NetFault::EmptyInterval)),
            _ => Ok(FiringInterval { earliest, latest }),
        }
    }

    /// Parses a time; `None` for `w`.
    fn read_time(&mut self) -> TinaResult<Option<std::time::Duration>> {
        let (text, at) = self.read_name("a time")?;
        if text == "w" {
            return Ok(None);
        }
        parse_seconds(&text).map(Some).map_err(|fault| (at, fault))
    }

    fn read_number(&mut self) -> TinaResult<u32> {
        let (text, at) = self.read_name("a number")?;
        let scales = [('K', 3), ('M', 6), ('G', 9), ('T', 12), ('P', 15), ('E', 18)];
        let scale = scales.iter().find(|(letter, _)| text.ends_with(*letter));
        let digits = &text[..text.len() - usize::from(scale.is_some())];
        let factor = scale.map_or(1, |(_, zeros)| 10u64.pow(*zeros));
        parse_scaled_tokens(digits, factor).map_err(|fault| (at, fault))
    }

    fn read_optional_label(&mut self) -> TinaResult<Option<String>> {
        if !self.peek_sign(":") {
            return Ok(None);
        }
        self.next += 1;
        Ok(Some(self.read_name("a label")?.0))
    }

    fn place_called(&mut self, name: String) -> u32 {
        let count = self.draft.places.len() as u32;
        *self.places.entry(name).or_insert_with_key(|name| {
            let place = DraftPlace { name: name.clone(), tokens: 0, note: Note::default() };
            self.draft.places.push(place);
            count
        })
    }

    fn transition_called(&mut self, name: String, at: usize) -> usize {
        let count = self.draft.transitions.len();
        *self.transitions.entry(name).or_insert_with_key(|name| {
            self.draft.transitions.push(DraftTransition::new(name.clone(), at));
            count
        })
    }

    fn read_name(&mut self, wanted: &'static str) -> TinaResult<(String, usize)> {
        match self.tokens.get(self.next).cloned() {
            Some(TinaToken { word: TinaWord::Plain(name) | TinaWord::Braced(name), at }) => {
                self.next += 1;
                Ok((name, at))
            }
            _ => Err(self.expected(wanted)),
        }
    }

    fn expect_sign(&mut self, sign: char, wanted: &'static str) -> TinaResult<()> {
        match self.tokens.get(self.next).map(|token| &token.word) == Some(&TinaWord::Sign(sign)) {
            true => {
                self.next += 1;
                Ok(())
            }
            false => Err(self.expected(wanted)),
        }
    }

    fn peek_sign(&self, sign: &str) -> bool {
        let word = self.tokens.get(self.next).map(|token| &token.word);
        matches!(word, Some(TinaWord::Sign(found)) if sign.starts_with(*found))
    }

    fn at_name(&self) -> bool {
        let named = matches!(
            self.tokens.get(self.next).map(|token| &token.word),
            Some(TinaWord::Plain(_) | TinaWord::Braced(_))
        );
        named && !self.at_declaration()
    }

    fn at_declaration(&self) -> bool {
        match self.tokens.get(self.next).map(|token| &token.word) {
            Some(TinaWord::Plain(word)) => KEYWORDS.contains(&word.as_str()),
            Some(_) => false,
            None => true,
        }
    }

    fn offset_here(&self) -> usize {
        self.tokens.get(self.next).map_or(self.end, |token| token.at)
    }

    fn expected(&self, wanted: &'static str) -> (usize, NetFault) {
        let found = self.tokens.get(self.next).map(|token| token.word.shown());
        let found = found.unwrap_or_else(|| "the end of the file".into());
        (self.offset_here(), NetFault::Wanted { wanted, found })
    }
}
