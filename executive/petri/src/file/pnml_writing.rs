//! Writes PNML. What the standard cannot express is written as TINA does (`<delay>`, arc types) or
//! in
//! `<toolspecific tool="armor">`, so that reading back gives the same net.

use super::numeral::write_seconds;
use super::pnml::TOOL;
use super::{NetFile, Note};
use crate::net::{FiringClass, FiringInterval, NetTransition, PlaceId};
use quick_xml::escape::escape;
use std::collections::HashSet;
use std::fmt::Write;

/// Returns the net as PNML text.
pub fn write(file: &NetFile) -> String {
    let mut ids = Ids::default();
    let places: Vec<_> = file.net.places().iter().map(|name| ids.assign(name, "p")).collect();
    let names = file.net.transitions().iter().map(|t| t.name.as_str());
    let transitions: Vec<_> = names.map(|name| ids.assign(name, "t")).collect();
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    out += "<pnml xmlns=\"http://www.pnml.org/version-2009/grammar/pnml\">\n";
    let net_id = ids.assign(&file.name, "net");
    let _ = writeln!(
        out,
        "  <net id=\"{net_id}\" type=\"http://www.pnml.org/version-2009/grammar/ptnet\">"
    );
    let _ = writeln!(out, "    <name><text>{}</text></name>", escape(&file.name));
    let _ = writeln!(out, "    <page id=\"{}\">", ids.assign("page", "page"));
    for (index, id) in places.iter().enumerate() {
        let name = &file.net.places()[index];
        let _ = writeln!(out, "      <place id=\"{id}\">");
        out += &note_elements(&file.places[index], name);
        let tokens = file.net.initial()[index];
        if tokens > 0 {
            let _ = writeln!(out, "        <initialMarking><text>{tokens}</text></initialMarking>");
        }
        let terms = match id == name {
            true => String::new(),
            false => format!("<terms name=\"{}\"/>", escape(name)),
        };
        out += &tool_element(&(terms + &word_elements(&file.places[index])));
        out += "      </place>\n";
    }
    for (index, id) in transitions.iter().enumerate() {
        let t = &file.net.transitions()[index];
        let _ = writeln!(out, "      <transition id=\"{id}\">");
        out += &note_elements(&file.transitions[index], &t.name);
        // Other tools have no gates: for them the transition may fire at any time after its
        // earliest.
        let latest = t.interval.latest.filter(|_| !t.gated);
        out += &delay_element(FiringInterval { latest, ..t.interval });
        out += &tool_element(
            &(terms_element(t, id, &places) + &word_elements(&file.transitions[index])),
        );
        out += "      </transition>\n";
    }
    for (t, id) in file.net.transitions().iter().zip(&transitions) {
        write_arcs(&mut out, t, id, &places, &mut ids);
    }
    out + "    </page>\n  </net>\n</pnml>\n"
}

fn note_elements(note: &Note, name: &str) -> String {
    let mut out = String::new();
    let label = if note.label.is_empty() { name } else { &note.label };
    let _ = writeln!(out, "        <name><text>{}</text></name>", escape(label));
    if let Some([x, y]) = note.position {
        let _ = writeln!(out, "        <graphics><position x=\"{x}\" y=\"{y}\"/></graphics>");
    }
    out
}

fn delay_element(interval: FiringInterval) -> String {
    if interval == FiringInterval::UNTIMED {
        return String::new();
    }
    let (closure, upper) = match interval.latest {
        Some(latest) => ("closed", format!("<cn>{}</cn>", write_seconds(latest))),
        None => ("closed-open", "<ci>infty</ci>".into()),
    };
    format!(
        "        <delay><interval xmlns=\"http://www.w3.org/1998/Math/MathML\" \
         closure=\"{closure}\"><cn>{}</cn>{upper}</interval></delay>\n",
        write_seconds(interval.earliest)
    )
}

fn tool_element(inner: &str) -> String {
    match inner {
        "" => String::new(),
        _ => {
            format!("        <toolspecific tool=\"{TOOL}\" version=\"1\">{inner}</toolspecific>\n")
        }
    }
}

fn terms_element(t: &NetTransition, id: &str, places: &[String]) -> String {
    let mut attributes = String::new();
    if id != t.name {
        let _ = write!(attributes, " name=\"{}\"", escape(&t.name));
    }
    if t.class == FiringClass::Safety {
        attributes += " class=\"safety\"";
    }
    if t.priority != 0 {
        let _ = write!(attributes, " priority=\"{}\"", t.priority);
    }
    if t.gated {
        attributes += " gated=\"true\"";
        if let Some(latest) = t.interval.latest {
            let _ = write!(attributes, " latest=\"{}\"", write_seconds(latest));
        }
    }
    let mut out = if attributes.is_empty() { attributes } else { format!("<terms{attributes}/>") };
    for place in &t.resets {
        let _ = write!(out, "<reset place=\"{}\"/>", places[place.index()]);
    }
    out
}

fn word_elements(note: &Note) -> String {
    let word = |(name, value): &(String, String)| {
        format!("<word name=\"{}\" value=\"{}\"/>", escape(name), escape(value))
    };
    note.words.iter().map(word).collect()
}

fn write_arcs(out: &mut String, t: &NetTransition, id: &str, places: &[String], ids: &mut Ids) {
    let mut arc = |source: &str, target: &str, kind: &str, weight: u32| {
        let arc_id = ids.next_arc();
        let _ = write!(out, "      <arc id=\"{arc_id}\" source=\"{source}\" target=\"{target}\"");
        if kind == "normal" && weight == 1 {
            *out += "/>\n";
            return;
        }
        let _ = write!(out, "><inscription><text>{weight}</text></inscription>");
        if kind != "normal" {
            let _ = write!(out, "<type value=\"{kind}\"/>");
        }
        *out += "</arc>\n";
    };
    let place = |id: PlaceId| places[id.index()].as_str();
    t.inputs.iter().for_each(|&(p, weight)| arc(place(p), id, "normal", weight));
    t.reads.iter().for_each(|&(p, weight)| arc(place(p), id, "test", weight));
    t.inhibitors.iter().for_each(|&(p, weight)| arc(place(p), id, "inhibitor", weight));
    t.outputs.iter().for_each(|&(p, weight)| arc(id, place(p), "normal", weight));
}

/// Unique identifiers of one document: the names where XML allows them, otherwise generated ones.
#[derive(Default)]
struct Ids {
    given: HashSet<String>,
    counter: usize,
}

impl Ids {
    fn assign(&mut self, name: &str, stem: &str) -> String {
        if is_xml_id(name) && self.given.insert(name.to_owned()) {
            return name.to_owned();
        }
        self.generate_id(stem)
    }

    fn next_arc(&mut self) -> String {
        self.generate_id("arc")
    }

    fn generate_id(&mut self, stem: &str) -> String {
        loop {
            self.counter += 1;
            let id = format!("{stem}-{}", self.counter);
            if self.given.insert(id.clone()) {
                return id;
            }
        }
    }
}

fn is_xml_id(name: &str) -> bool {
    let mut characters = name.chars();
    let first = characters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    first && characters.all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c))
}
