//! The contents of a file as plain data, with an independent implementation of renaming and
//! removing.

use std::collections::BTreeMap;

use crate::edit_sequences::random::Random;

/// Names of all sorts of things, so that things of different sorts share them.
pub const NAMES: &[&str] =
    &["a", "b", "home", "go-on", "x_1", "t", "laser", "Map", "nav", "z9", "lt", "quot"];

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sort {
    Component,
    Place,
    Transition,
    Variable,
}

pub const SORTS: [Sort; 4] = [Sort::Component, Sort::Place, Sort::Transition, Sort::Variable];

/// A piece of an expression.
#[derive(Clone, Debug)]
pub enum Word {
    Plain(&'static str),
    Name(Sort, String),
}

pub type Expression = Vec<Word>;

pub fn written(expression: &Expression) -> String {
    let word = |word: &Word| match word {
        Word::Plain(text) => (*text).to_owned(),
        Word::Name(_, name) => name.clone(),
    };
    expression.iter().map(word).collect()
}

/// A name, with the name of something of it: `laser.scan`.
pub type Dotted = (String, &'static str);

#[derive(Clone, Debug, Default)]
pub struct Component {
    pub name: String,
    pub rate: Option<String>,
    pub note: Option<String>,
    pub parameters: Vec<(String, String)>,
}

#[derive(Clone, Debug)]
pub struct Link {
    pub from: Dotted,
    pub to: Dotted,
    pub keep: Option<String>,
}

#[derive(Clone, Debug, Default)]
pub struct Place {
    pub name: String,
    pub components: Vec<String>,
    pub on_failure: Option<String>,
    /// Component, parameter, value.
    pub parameters: Vec<(String, String, String)>,
}

#[derive(Clone, Debug, Default)]
pub struct Transition {
    pub name: String,
    pub from: Vec<String>,
    pub to: Vec<String>,
    /// The name of the element, and the place.
    pub arcs: Vec<(&'static str, String)>,
    pub on: Option<Dotted>,
    pub when: Option<Expression>,
    pub overrun: Option<String>,
    pub priority: Option<String>,
}

#[derive(Clone, Debug, Default)]
pub struct Model {
    pub clock: Option<Dotted>,
    pub components: Vec<Component>,
    pub links: Vec<Link>,
    pub goal: Option<String>,
    pub safe: Option<String>,
    pub variables: Vec<(String, Option<Dotted>)>,
    pub places: Vec<Place>,
    pub exclusives: Vec<Vec<String>>,
    pub transitions: Vec<Transition>,
    pub checks: Vec<Expression>,
    pub positions: BTreeMap<(Sort, String), (f64, f64)>,
}

impl Model {
    pub fn names(&self, sort: Sort) -> Vec<String> {
        match sort {
            Sort::Component => self.components.iter().map(|c| c.name.clone()).collect(),
            Sort::Place => self.places.iter().map(|p| p.name.clone()).collect(),
            Sort::Transition => self.transitions.iter().map(|t| t.name.clone()).collect(),
            Sort::Variable => self.variables.iter().map(|v| v.0.clone()).collect(),
        }
    }

    pub fn fresh(&self, sort: Sort, random: &mut Random) -> Option<String> {
        let taken = self.names(sort);
        let free: Vec<_> = NAMES.iter().filter(|n| !taken.iter().any(|t| t == *n)).collect();
        random.one(&free).map(|name| (*name).to_string())
    }

    pub fn random(random: &mut Random) -> Self {
        let mut model = Self::default();
        for _ in 0..random.below(4) {
            let name = model.fresh(Sort::Component, random).unwrap();
            model.components.push(random_component(name, random));
        }
        for _ in 0..random.below(4) {
            model.links.extend(model.random_link(random));
        }
        for _ in 0..random.below(3) {
            let name = model.fresh(Sort::Variable, random).unwrap();
            let source = model.dotted(random, "level");
            model.variables.push((name, source));
        }
        for _ in 0..random.below(4) {
            let name = model.fresh(Sort::Place, random).unwrap();
            let place = model.random_place(name, random);
            model.places.push(place);
        }
        for _ in 0..random.below(4) {
            let name = model.fresh(Sort::Transition, random).unwrap();
            let transition = model.random_transition(name, random);
            model.transitions.push(transition);
        }
        let places = model.names(Sort::Place);
        let components = model.names(Sort::Component);
        (model.goal, model.safe) = (random.one(&places), random.one(&places));
        if random.percent(30) {
            model.clock = model.dotted(random, "time");
        }
        let together = random.some(&components, 70);
        if together.len() > 1 {
            model.exclusives.push(together);
        }
        for _ in 0..random.below(3) {
            model.checks.extend(model.random_check(random));
        }
        model
    }

    pub fn dotted(&self, random: &mut Random, of: &'static str) -> Option<Dotted> {
        random.one(&self.names(Sort::Component)).map(|name| (name, of))
    }

    /// A link to an input that nothing feeds.
    pub fn random_link(&self, random: &mut Random) -> Option<Link> {
        let (output, input) =
            (*random.pick(&["scan", "map", "a"]), *random.pick(&["scan", "goal", "home"]));
        let (from, to) = (self.dotted(random, output)?, self.dotted(random, input)?);
        let keep = random.one(&[None, Some("all".to_owned()), Some("50".to_owned())])?;
        let fed = self.links.iter().any(|link| link.to == to);
        (!fed).then_some(Link { from, to, keep })
    }

    pub fn random_place(&self, name: String, random: &mut Random) -> Place {
        let components = random.some(&self.names(Sort::Component), 40);
        let mut parameters = Vec::new();
        if let Some(component) = random.one(&components) {
            parameters.push((component, "area".into(), random_value(random)));
        }
        let on_failure = random.one(&self.names(Sort::Place)).filter(|_| random.percent(30));
        Place { name, components, on_failure, parameters }
    }

    pub fn random_transition(&self, name: String, random: &mut Random) -> Transition {
        let places = self.names(Sort::Place);
        let arc = |kind, place: Option<String>| place.map(|place| (kind, place));
        let kind = *random.pick(&["read", "inhibitor", "reset"]);
        let variables = self.names(Sort::Variable);
        Transition {
            name,
            from: random.some(&places, 40),
            to: random.some(&places, 40),
            arcs: arc(kind, random.one(&places).filter(|_| random.percent(30)))
                .into_iter()
                .collect(),
            on: self.dotted(random, "done").filter(|_| random.percent(40)),
            when: random_guard(&variables, &self.names(Sort::Component), random),
            overrun: random.one(&places).filter(|_| random.percent(20)),
            priority: random.percent(20).then(|| "-3".to_owned()),
        }
    }

    fn random_check(&self, random: &mut Random) -> Option<Expression> {
        let place = random.one(&self.names(Sort::Place))?;
        let place = Word::Name(Sort::Place, place);
        let component = self.names(Sort::Component);
        Some(match random.one(&component).filter(|_| random.percent(40)) {
            None => vec![Word::Plain("always reachable("), place, Word::Plain(") & 1")],
            Some(name) => vec![
                Word::Plain("duration("),
                place,
                Word::Plain(") <= 20min or not active("),
                Word::Name(Sort::Component, name),
                Word::Plain(")"),
            ],
        })
    }

    /// Whether something names it that would mean another thing without it.
    pub fn needs(&self, sort: Sort, name: &str) -> bool {
        let dotted = |d: &Option<Dotted>| d.as_ref().is_some_and(|d| d.0 == name);
        let expressions = self.transitions.iter().filter_map(|t| t.when.as_ref());
        let in_words = expressions
            .chain(&self.checks)
            .flatten()
            .any(|word| matches!(word, Word::Name(s, n) if *s == sort && n == name));
        let is = |option: &Option<String>| option.as_deref() == Some(name);
        let of_sort = match sort {
            Sort::Component => {
                dotted(&self.clock)
                    || self.variables.iter().any(|v| dotted(&v.1))
                    || self.transitions.iter().any(|t| dotted(&t.on))
            }
            Sort::Place => {
                is(&self.goal)
                    || is(&self.safe)
                    || self.places.iter().any(|p| is(&p.on_failure) && p.name != name)
                    || self.transitions.iter().any(|t| {
                        is(&t.overrun)
                            || t.from.iter().chain(&t.to).any(|p| p == name)
                            || t.arcs.iter().any(|arc| arc.1 == name)
                    })
            }
            Sort::Transition | Sort::Variable => false,
        };
        of_sort || in_words
    }

    /// Removes what nothing needs.
    pub fn remove(&mut self, sort: Sort, name: &str) {
        self.positions.remove(&(sort, name.to_owned()));
        match sort {
            Sort::Place => self.places.retain(|p| p.name != name),
            Sort::Transition => self.transitions.retain(|t| t.name != name),
            Sort::Variable => self.variables.retain(|v| v.0 != name),
            Sort::Component => {
                self.components.retain(|c| c.name != name);
                self.links.retain(|l| l.from.0 != name && l.to.0 != name);
                for place in &mut self.places {
                    place.components.retain(|c| c != name);
                    place.parameters.retain(|p| p.0 != name);
                }
                for set in &mut self.exclusives {
                    set.retain(|c| c != name);
                }
                self.exclusives.retain(|set| set.len() > 1);
            }
        }
    }

    pub fn rename(&mut self, sort: Sort, old: &str, new: &str) {
        let put = |name: &mut String| {
            if name == old {
                *name = new.to_owned();
            }
        };
        let positions = std::mem::take(&mut self.positions);
        self.positions = positions
            .into_iter()
            .map(|((s, mut name), at)| {
                if s == sort {
                    put(&mut name);
                }
                ((s, name), at)
            })
            .collect();
        let whens = self.transitions.iter_mut().filter_map(|t| t.when.as_mut());
        for word in whens.chain(&mut self.checks).flatten() {
            match word {
                Word::Name(s, name) if *s == sort => put(name),
                _ => {}
            }
        }
        match sort {
            Sort::Variable => self.variables.iter_mut().for_each(|v| put(&mut v.0)),
            Sort::Transition => self.transitions.iter_mut().for_each(|t| put(&mut t.name)),
            Sort::Component => {
                self.components.iter_mut().for_each(|c| put(&mut c.name));
                self.links.iter_mut().for_each(|l| {
                    put(&mut l.from.0);
                    put(&mut l.to.0);
                });
                let sources = self.variables.iter_mut().filter_map(|v| v.1.as_mut());
                let events = self.transitions.iter_mut().filter_map(|t| t.on.as_mut());
                sources.chain(events).chain(&mut self.clock).for_each(|d| put(&mut d.0));
                for place in &mut self.places {
                    place.components.iter_mut().for_each(put);
                    place.parameters.iter_mut().for_each(|p| put(&mut p.0));
                }
                self.exclusives.iter_mut().flatten().for_each(put);
            }
            Sort::Place => {
                self.goal.iter_mut().chain(&mut self.safe).for_each(put);
                for place in &mut self.places {
                    put(&mut place.name);
                    place.on_failure.iter_mut().for_each(put);
                }
                for transition in &mut self.transitions {
                    transition.from.iter_mut().chain(&mut transition.to).for_each(put);
                    transition.arcs.iter_mut().for_each(|arc| put(&mut arc.1));
                    transition.overrun.iter_mut().for_each(put);
                }
            }
        }
    }
}

pub fn random_component(name: String, random: &mut Random) -> Component {
    let mut component = Component { name, ..Component::default() };
    component.rate = random.percent(40).then(|| "10Hz".to_owned());
    component.note = random.percent(30).then(|| random_value(random));
    for parameter in ["speed", "a", "world"] {
        if random.percent(30) {
            component.parameters.push((parameter.into(), random_value(random)));
        }
    }
    component
}

/// A value with whatever needs care.
pub fn random_value(random: &mut Random) -> String {
    const PIECES: &[&str] =
        &["1.5m", "<", ">", "&", "\"", "'", "ä", " ", "]]>", "&lt;", "\n", "\t", "a.xml", "--", ""];
    (0..random.below(5)).map(|_| *random.pick(PIECES)).collect()
}

fn random_guard(
    variables: &[String],
    components: &[String],
    random: &mut Random,
) -> Option<Expression> {
    let variable = |name| Word::Name(Sort::Variable, name);
    let (one, two) = (random.one(variables), random.one(components));
    match (random.below(3), one, two) {
        (0, Some(name), _) => Some(vec![variable(name), Word::Plain(" < 30")]),
        (1, Some(name), Some(component)) => Some(vec![
            Word::Plain("5 > "),
            variable(name),
            Word::Plain("&&"),
            Word::Name(Sort::Component, component),
            Word::Plain(".home<3s"),
        ]),
        _ => None,
    }
}
