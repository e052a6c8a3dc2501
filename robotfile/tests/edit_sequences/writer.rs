//! A model as a file of a random form: any indentation, line ends, quotes, spaces, comments.

use crate::edit_sequences::model::{Component, Model, Place, Transition, written};
use crate::edit_sequences::random::Random;

/// An element to be written: name, attributes, elements in it, text.
#[derive(Default)]
struct Piece {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Piece>,
    text: String,
}

struct Form<'a> {
    random: &'a mut Random,
    unit: &'static str,
    line_break: &'static str,
    /// Probability of a comment, a blank line or odd spaces, in percent.
    oddity: usize,
    comments: usize,
    out: String,
}

pub fn write(model: &Model, random: &mut Random) -> String {
    let mut parts = vec![system(model, random), mission(model, random)];
    if random.percent(50) {
        parts.reverse();
    }
    let note = ("xmlns:my", "urn:example:my".to_owned());
    let root = Piece {
        name: "armor",
        attributes: vec![("version", "1".into()), note],
        children: parts,
        ..Piece::default()
    };
    let unit = *random.pick(&["\t", "  ", "    ", " "]);
    let line_break = *random.pick(&["\n", "\n", "\r\n", ""]);
    let oddity = *random.pick(&[0, 10, 40]);
    let mut form = Form { random, unit, line_break, oddity, comments: 0, out: String::new() };
    if form.random.percent(20) {
        form.out.push('\u{feff}');
    }
    if form.random.percent(50) {
        form.out += "<?xml version='1.0' encoding=\"UTF-8\"?>";
        form.out += line_break;
    }
    form.comment(0);
    form.element(&root, 0);
    form.out += line_break;
    form.out
}

impl Form<'_> {
    fn is_odd(&mut self) -> bool {
        self.oddity > 0 && self.random.percent(self.oddity)
    }

    fn indent(&mut self, depth: usize) {
        if !self.line_break.is_empty() {
            self.out += &self.unit.repeat(depth);
        }
    }

    /// Perhaps a comment on a line of its own, perhaps a blank line.
    fn comment(&mut self, depth: usize) {
        if self.is_odd() {
            self.comments += 1;
            let inner = if self.is_odd() { self.line_break } else { " " };
            self.out += &format!("<!-- {}:{inner}<home a.b & laser> -->", self.comments);
            self.out += self.line_break;
            if self.is_odd() {
                self.out += self.line_break;
            }
            self.indent(depth);
        }
    }

    fn element(&mut self, piece: &Piece, depth: usize) {
        self.out += &format!("<{}", piece.name);
        for (n, (name, value)) in piece.attributes.iter().enumerate() {
            if n > 0 && self.is_odd() && self.is_odd() {
                self.out += self.line_break;
                self.indent(depth + 3);
            } else if self.is_odd() {
                self.out.push('\t');
            }
            let quote = if self.is_odd() { '\'' } else { '"' };
            let equals = if self.is_odd() { " = " } else { "=" };
            self.out += &format!(" {name}{equals}{quote}{}{quote}", escaped(value, quote));
        }
        if piece.children.is_empty() && piece.text.is_empty() {
            match self.random.below(4) {
                0 if self.is_odd() => self.out += " />",
                1 if self.is_odd() => self.out += &format!("></{}>", piece.name),
                _ => self.out += "/>",
            }
            return;
        }
        self.out.push('>');
        self.out += &escaped(&piece.text, ' ');
        for child in &piece.children {
            self.out += self.line_break;
            if self.is_odd() {
                self.out += self.line_break;
            }
            self.indent(depth + 1);
            self.comment(depth + 1);
            self.element(child, depth + 1);
            if self.is_odd() {
                self.comments += 1;
                self.out += &format!(" <!-- {} -->", self.comments);
            }
        }
        if !piece.children.is_empty() {
            self.out += self.line_break;
            self.indent(depth);
        }
        self.out += &format!("</{}>", piece.name);
    }
}

fn escaped(value: &str, quote: char) -> String {
    let value = value.replace('&', "&amp;").replace('<', "&lt;");
    let value = value.replace('\n', "&#10;").replace('\t', "&#9;");
    match quote {
        '"' => value.replace('"', "&quot;"),
        '\'' => value.replace('\'', "&apos;"),
        _ => value,
    }
}

/// Several lists as one, each in its own order.
fn shuffled(mut lists: Vec<Vec<Piece>>, random: &mut Random) -> Vec<Piece> {
    let mixed = random.percent(50);
    let mut all = Vec::new();
    lists.iter_mut().for_each(|list| list.reverse());
    while !lists.iter().all(Vec::is_empty) {
        let from = if mixed { random.below(lists.len()) } else { 0 };
        match lists[from].pop() {
            Some(piece) => all.push(piece),
            None => drop(lists.remove(from)),
        }
    }
    all
}

fn piece(name: &'static str, attributes: Vec<(&'static str, Option<String>)>) -> Piece {
    let attributes = attributes.into_iter().filter_map(|(name, value)| Some((name, value?)));
    Piece { name, attributes: attributes.collect(), ..Piece::default() }
}

fn dotted(name: &(String, &str)) -> Option<String> {
    Some(format!("{}.{}", name.0, name.1))
}

fn joined(names: &[String]) -> Option<String> {
    (!names.is_empty()).then(|| names.join(" "))
}

fn system(model: &Model, random: &mut Random) -> Piece {
    let clock = model.clock.iter().map(|clock| piece("clock", vec![("source", dotted(clock))]));
    let components = model.components.iter().map(component).collect();
    let links = model.links.iter().map(|link| {
        let ends = vec![("from", dotted(&link.from)), ("to", dotted(&link.to))];
        piece("link", [ends, vec![("keep", link.keep.clone())]].concat())
    });
    let children = shuffled(vec![clock.collect(), components, links.collect()], random);
    Piece { name: "system", children, ..Piece::default() }
}

fn component(component: &Component) -> Piece {
    let attributes = vec![
        ("name", Some(component.name.clone())),
        ("my:note", component.note.clone()),
        ("kind", Some("kind".into())),
        ("rate", component.rate.clone()),
    ];
    let parameters = component.parameters.iter().map(|(name, value)| {
        piece("parameter", vec![("name", Some(name.clone())), ("value", Some(value.clone()))])
    });
    Piece { children: parameters.collect(), ..piece("component", attributes) }
}

fn mission(model: &Model, random: &mut Random) -> Piece {
    let variables = model.variables.iter().map(|(name, source)| {
        let source = source.as_ref().and_then(dotted);
        piece("variable", vec![("name", Some(name.clone())), ("source", source)])
    });
    let sets = model.exclusives.iter();
    let sets = sets.map(|set| piece("exclusive", vec![("components", joined(set))]));
    let checks = model.checks.iter();
    let checks = checks.map(|check| Piece { text: written(check), ..piece("check", Vec::new()) });
    let lists = vec![
        variables.collect(),
        model.places.iter().map(place).collect(),
        sets.collect(),
        model.transitions.iter().map(transition).collect(),
        checks.collect(),
    ];
    let attributes = vec![("goal", model.goal.clone()), ("safe", model.safe.clone())];
    Piece { children: shuffled(lists, random), ..piece("mission", attributes) }
}

fn place(place: &Place) -> Piece {
    let attributes = vec![
        ("name", Some(place.name.clone())),
        ("components", joined(&place.components)),
        ("on-failure", place.on_failure.clone()),
    ];
    let parameters = place.parameters.iter().map(|(component, name, value)| {
        let attributes = [("component", component), ("name", name), ("value", value)];
        piece("parameter", attributes.map(|(name, value)| (name, Some(value.clone()))).to_vec())
    });
    Piece { children: parameters.collect(), ..piece("place", attributes) }
}

fn transition(transition: &Transition) -> Piece {
    let attributes = vec![
        ("name", Some(transition.name.clone())),
        ("from", joined(&transition.from)),
        ("to", joined(&transition.to)),
        ("on", transition.on.as_ref().and_then(dotted)),
        ("when", transition.when.as_ref().map(written)),
        ("overrun", transition.overrun.clone()),
        ("priority", transition.priority.clone()),
    ];
    let arcs = transition.arcs.iter();
    let arcs = arcs.map(|(kind, name)| piece(kind, vec![("place", Some(name.clone()))]));
    Piece { children: arcs.collect(), ..piece("transition", attributes) }
}
