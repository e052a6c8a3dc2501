//! Reads PNML (ISO/IEC 15909-2): place/transition nets with pages and reference nodes, arc types of
//! TINA, GreatSPN and PIPE (`<type value="inhibitor"/>`, `test`, `reset`), TINA's `<delay>`, and
//! Armor's own data in `<toolspecific tool="armor">`. Of drawings only positions are read.

use super::draft::{DraftPlace, DraftTransition, NetArcKind, NetDraft};
use super::numeral::{parse_seconds, parse_tokens, parse_weight, shorten};
use super::xml::{XmlElement, parse};
use super::{FileError, NetFault, NetFile, Note, fault_at};
use crate::net::{FiringClass, FiringInterval};
use std::collections::HashMap;

pub use super::pnml_writing::write;

/// The tool name of Armor's own data in a PNML file.
pub(super) const TOOL: &str = "armor";
/// TAPAAL's inscription of an arc that accepts tokens of any age.
const ANY_AGE: &str = "[0,inf)";
/// Elements about the look of a drawing, other than positions.
const LOOKS: &[&str] = &["offset", "line", "fill", "font", "dimension"];

/// Reads the one net of a PNML text.
///
/// # Errors
/// The first thing that is wrong, with its line and column.
pub fn read(text: &str) -> Result<NetFile, FileError> {
    let root = parse(text, |element| {
        let name = element.name.as_str();
        (name == "toolspecific" && element.attribute("tool") != Some(TOOL)) || LOOKS.contains(&name)
    })?;
    let fail = |at, fault| fault_at(text, at, fault);
    if root.name != "pnml" {
        let found = format!("<{}>", shorten(&root.name));
        return Err(fail(root.at, NetFault::Wanted { wanted: "<pnml>", found }));
    }
    let mut nets = root.children.iter().filter(|child| child.name == "net");
    let Some(net) = nets.next() else {
        return Err(fail(root.at, NetFault::Wanted { wanted: "a <net>", found: "none".into() }));
    };
    if let Some(second) = nets.next() {
        return Err(fail(
            second.at,
            NetFault::Limit("a file with several nets; give each its own"),
        ));
    }
    refuse_other_kinds(net).map_err(|fault| fail(net.at, fault))?;
    let mut reading = PnmlReader::default();
    reading.draft.name = match net.child("name").map(XmlElement::label) {
        Some(name) if !name.is_empty() => name.to_owned(),
        _ => net.attribute("id").unwrap_or_default().to_owned(),
    };
    reading
        .read_nodes(net)
        .and_then(|()| reading.read_arcs())
        .map_err(|(at, fault)| fail(at, fault))?;
    reading.draft.build(text)
}

fn refuse_other_kinds(net: &XmlElement) -> Result<(), NetFault> {
    let kind = net.attribute("type").unwrap_or_default();
    let lower = kind.to_ascii_lowercase();
    let coloured = ["symmetric", "highlevel", "hlpn", "pt-hlpng", "timedarc"];
    match coloured.iter().any(|word| lower.contains(word)) {
        true => Err(NetFault::Unsupported(format!("a net of type `{}`", shorten(kind)))),
        false => Ok(()),
    }
}

type PnmlResult<T> = Result<T, (usize, NetFault)>;

/// What an id stands for.
#[derive(Clone, Debug)]
enum PnmlNode {
    Place(u32),
    Transition(usize),
    Reference(String),
}

#[derive(Debug, Default)]
struct PnmlReader<'a> {
    draft: NetDraft,
    nodes: HashMap<&'a str, PnmlNode>,
    arcs: Vec<&'a XmlElement>,
    /// Reset arcs: transition, id of the place, offset.
    resets: Vec<(usize, &'a str, usize)>,
}

impl<'a> PnmlReader<'a> {
    fn read_nodes(&mut self, page: &'a XmlElement) -> PnmlResult<()> {
        for element in &page.children {
            match element.name.as_str() {
                "page" => self.read_nodes(element)?,
                "place" => self.read_place(element)?,
                "transition" => self.read_transition(element)?,
                "referencePlace" | "referenceTransition" => {
                    let target = required_attribute(element, "ref", "a ref attribute")?;
                    self.insert_node(element, PnmlNode::Reference(target.to_owned()))?;
                }
                "arc" => self.arcs.push(element),
                _ => {}
            }
        }
        Ok(())
    }

    fn insert_node(&mut self, element: &'a XmlElement, node: PnmlNode) -> PnmlResult<&'a str> {
        let id = required_attribute(element, "id", "an id attribute")?;
        match self.nodes.insert(id, node) {
            None => Ok(id),
            Some(_) => Err((element.at, NetFault::Duplicate(shorten(id)))),
        }
    }

    fn read_place(&mut self, element: &'a XmlElement) -> PnmlResult<()> {
        let here = |fault| (element.at, fault);
        let id = self.insert_node(element, PnmlNode::Place(self.draft.places.len() as u32))?;
        if element.child("hlinitialMarking").is_some() {
            return Err(here(NetFault::Unsupported("a place of coloured tokens".into())));
        }
        let written = element.child("initialMarking").map(|child| (child.label(), child.at));
        let (marking, at) = written
            .or_else(|| Some((element.attribute("initialMarking")?, element.at)))
            .unwrap_or(("0", element.at));
        let marking = strip_colour(marking, "0");
        let tokens = parse_tokens(marking).map_err(|fault| (at, fault))?;
        let capacity =
            element.child("capacity").map_or("0", |child| strip_colour(child.label(), "0"));
        if capacity.parse() != Ok(0u32) {
            return Err(here(NetFault::Unsupported(format!("a place of capacity {capacity}"))));
        }
        if element.attribute("invariant").is_some_and(|most| most.trim() != "< inf") {
            return Err(here(NetFault::Unsupported("a place whose tokens have an age".into())));
        }
        let name = armor_name(element).unwrap_or(id).to_owned();
        let note = read_note(element, &name);
        self.draft.places.push(DraftPlace { name, tokens, note });
        Ok(())
    }

    fn read_transition(&mut self, element: &'a XmlElement) -> PnmlResult<()> {
        let index = self.draft.transitions.len();
        let id = self.insert_node(element, PnmlNode::Transition(index))?;
        let name = armor_name(element).unwrap_or(id).to_owned();
        let mut draft = DraftTransition::new(name, element.at);
        draft.note = read_note(element, &draft.name);
        if let Some(delay) = element.child("delay").and_then(|delay| delay.child("interval")) {
            draft.interval = read_interval(delay).map_err(|fault| (delay.at, fault))?;
        }
        if let Some(own) = element.child("toolspecific") {
            if let Some(terms) = own.child("terms") {
                read_terms(&mut draft, terms).map_err(|fault| (terms.at, fault))?;
            }
            for reset in own.children.iter().filter(|child| child.name == "reset") {
                self.resets.push((
                    index,
                    required_attribute(reset, "place", "a place attribute")?,
                    reset.at,
                ));
            }
        }
        self.draft.transitions.push(draft);
        Ok(())
    }

    fn read_arcs(&mut self) -> PnmlResult<()> {
        for arc in std::mem::take(&mut self.arcs) {
            let fault = |fault| (arc.at, fault);
            let source =
                self.resolve_reference(required_attribute(arc, "source", "a source attribute")?);
            let target =
                self.resolve_reference(required_attribute(arc, "target", "a target attribute")?);
            let ends = (source.map_err(fault)?, target.map_err(fault)?);
            let kind = arc_kind(arc).map_err(fault)?;
            let (transition, place, kind) = match (ends, kind) {
                ((PnmlNode::Place(p), PnmlNode::Transition(t)), kind) => (t, p, kind),
                ((PnmlNode::Transition(t), PnmlNode::Place(p)), NetArcKind::Input) => {
                    (t, p, NetArcKind::Output)
                }
                _ => return Err(fault(NetFault::ArcEnds)),
            };
            if arc.child("hlinscription").is_some() {
                return Err(fault(NetFault::Unsupported("an arc of coloured tokens".into())));
            }
            let inscription = arc.child("inscription");
            let text = inscription.map(|child| strip_colour(child.label(), "1"));
            // TAPAAL writes the weight as an attribute; another one has the ages of tokens.
            let text = text.or_else(|| arc.attribute("weight")).unwrap_or("1");
            let at = inscription.map_or(arc.at, |child| child.at);
            let weight = parse_weight(text).map_err(|fault| (at, fault))?;
            self.draft.transitions[transition].arcs.push((kind, place, weight));
        }
        for (transition, id, at) in std::mem::take(&mut self.resets) {
            match self.resolve_reference(id).map_err(|fault| (at, fault))? {
                PnmlNode::Place(p) => {
                    self.draft.transitions[transition].arcs.push((NetArcKind::Reset, p, 1));
                }
                _ => return Err((at, NetFault::ArcEnds)),
            }
        }
        Ok(())
    }

    /// Returns the place or transition with this id, following references.
    fn resolve_reference(&self, id: &str) -> Result<PnmlNode, NetFault> {
        let mut current = id;
        for _ in 0..=self.nodes.len() {
            match self.nodes.get(current) {
                None => return Err(NetFault::Unknown(shorten(current))),
                Some(PnmlNode::Reference(next)) => current = next,
                Some(node) => return Ok(node.clone()),
            }
        }
        Err(NetFault::Circle(shorten(id)))
    }
}

fn required_attribute<'a>(
    element: &'a XmlElement,
    name: &str,
    wanted: &'static str,
) -> PnmlResult<&'a str> {
    let found = || format!("<{}> without it", shorten(&element.name));
    element.attribute(name).ok_or_else(|| (element.at, NetFault::Wanted { wanted, found: found() }))
}

/// Returns the number in a label, which PIPE writes as `Default,3`; `missing` if there is none.
fn strip_colour<'a>(label: &'a str, missing: &'a str) -> &'a str {
    let number = label.strip_prefix("Default,").unwrap_or(label).trim();
    if number.is_empty() { missing } else { number }
}

fn armor_name(element: &XmlElement) -> Option<&str> {
    element.child("toolspecific")?.child("terms")?.attribute("name")
}

fn read_note(element: &XmlElement, name: &str) -> Note {
    let label = element.child("name").map(XmlElement::label);
    let label = label.or_else(|| element.attribute("name")).filter(|label| *label != name);
    let position = element.child("graphics").and_then(|graphics| graphics.child("position"));
    let coordinate =
        |at: &XmlElement, name| at.attribute(name)?.parse().ok().filter(|x: &f64| x.is_finite());
    let position = position.and_then(|at| Some([coordinate(at, "x")?, coordinate(at, "y")?]));
    let pair = |word: &XmlElement| {
        Some((word.attribute("name")?.to_owned(), word.attribute("value")?.to_owned()))
    };
    let own = element.child("toolspecific").map_or(&[][..], |own| &own.children);
    let words = own.iter().filter(|child| child.name == "word").filter_map(pair).collect();
    Note { label: label.unwrap_or_default().to_owned(), position, words }
}

fn arc_kind(arc: &XmlElement) -> Result<NetArcKind, NetFault> {
    let child = arc.child("type").map(|kind| kind.attribute("value").unwrap_or(kind.label()));
    let child = child.or_else(|| arc.child("arctype").map(XmlElement::label));
    let name = child.or_else(|| arc.attribute("type")).unwrap_or("normal");
    match name.to_ascii_lowercase().as_str() {
        "" | "normal" | "ordinary" | "arc" => Ok(NetArcKind::Input),
        "inhibitor" | "inhibitorarc" | "tapninhibitor" => Ok(NetArcKind::Inhibitor),
        "timed" if arc.attribute("inscription") == Some(ANY_AGE) => Ok(NetArcKind::Input),
        "test" | "read" => Ok(NetArcKind::Read),
        "reset" => Ok(NetArcKind::Reset),
        _ => Err(NetFault::Unsupported(format!("an arc of type `{}`", shorten(name)))),
    }
}

fn read_interval(element: &XmlElement) -> Result<FiringInterval, NetFault> {
    let closure = element.attribute("closure").unwrap_or("closed");
    let [lower, upper] = element.children.as_slice() else {
        return Err(NetFault::Wanted {
            wanted: "an interval of two bounds",
            found: "another".into(),
        });
    };
    let earliest = parse_seconds(lower.text.trim())?;
    let latest = match upper.name.as_str() {
        "ci" => None,
        _ => Some(parse_seconds(upper.text.trim())?),
    };
    let (opens, closes) = match closure {
        "closed" => (false, false),
        "closed-open" => (false, true),
        "open-closed" => (true, false),
        _ => (true, true),
    };
    if opens || (closes && latest.is_some()) {
        return Err(NetFault::OpenInterval);
    }
    match latest {
        Some(latest) if latest < earliest => Err(NetFault::EmptyInterval),
        _ => Ok(FiringInterval { earliest, latest }),
    }
}

fn read_terms(draft: &mut DraftTransition, terms: &XmlElement) -> Result<(), NetFault> {
    let unknown = |value: &str| NetFault::Unknown(shorten(value));
    match terms.attribute("class") {
        None | Some("ordinary") => {}
        Some("safety") => draft.class = FiringClass::Safety,
        Some(other) => return Err(unknown(other)),
    }
    if let Some(priority) = terms.attribute("priority") {
        draft.priority = priority.parse().map_err(|_| unknown(priority))?;
    }
    draft.gated = terms.attribute("gated") == Some("true");
    if let Some(latest) = terms.attribute("latest") {
        let latest = parse_seconds(latest)?;
        if latest < draft.interval.earliest {
            return Err(NetFault::EmptyInterval);
        }
        draft.interval.latest = Some(latest);
    }
    Ok(())
}
