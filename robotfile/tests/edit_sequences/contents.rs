//! The contents of a file and of a model, in the same words.

use std::path::Path;

use armor_robotfile::mission::ArcKind;
use armor_robotfile::{Configuration, Document, Item, Position, Spanned, read};

use crate::edit_sequences::model::{Model, SORTS, Sort, written};

#[derive(Debug, PartialEq)]
pub struct Contents(Vec<String>);

fn word(option: Option<impl std::fmt::Display>) -> String {
    option.map_or_else(|| "-".into(), |value| value.to_string())
}

fn value(option: &Option<Spanned<String>>) -> String {
    word(option.as_ref().map(|value| value.value.as_str()))
}

fn list(names: &[Spanned<String>]) -> String {
    names.iter().map(|name| name.value.as_str()).collect::<Vec<_>>().join(" ")
}

pub fn item(sort: Sort, name: &str) -> Item<'_> {
    match sort {
        Sort::Component => Item::Component(name),
        Sort::Place => Item::Place(name),
        Sort::Transition => Item::Transition(name),
        Sort::Variable => Item::Variable(name),
    }
}

impl Contents {
    /// Of the file, as the reader of the format reads it.
    pub fn by_file(document: &Document) -> Self {
        let reading = read(Path::new("a.xml"), &mut |_| Ok(document.bytes().to_vec()));
        let configuration = reading.configuration.unwrap();
        let mut contents = Vec::new();
        system(&configuration, document, &mut contents);
        mission(&configuration, &mut contents);
        for sort in SORTS {
            let names = names(&configuration, sort);
            contents.extend(names.iter().filter_map(|name| {
                let Position { x, y } = document.position(item(sort, name))?;
                Some(format!("{sort:?} {name} at {x} {y}"))
            }));
        }
        Self(contents)
    }

    /// Of a model.
    pub fn by(model: &Model) -> Self {
        let mut contents = vec![format!("clock {}", word(model.clock.as_ref().map(dotted)))];
        for c in &model.components {
            let rate = c.rate.as_ref().map(|rate| rate.trim_end_matches("Hz"));
            contents.push(format!("component {} {} {:?}", c.name, word(rate), c.note));
            contents.extend(c.parameters.iter().map(|(name, value)| format!("{name}={value:?}")));
        }
        contents.extend(model.links.iter().map(|link| {
            let keep = link.keep.as_deref().unwrap_or("latest");
            format!("{} > {} {keep}", dotted(&link.from), dotted(&link.to))
        }));
        contents.push(format!(
            "goal {} safe {}",
            word(model.goal.as_ref()),
            word(model.safe.as_ref())
        ));
        contents.extend(
            model
                .variables
                .iter()
                .map(|v| format!("{} of {}", v.0, word(v.1.as_ref().map(dotted)))),
        );
        for p in &model.places {
            let components = p.components.join(" ");
            contents.push(format!(
                "place {} [{components}] {}",
                p.name,
                word(p.on_failure.as_ref())
            ));
            contents.extend(p.parameters.iter().map(|p| format!("{}.{}={:?}", p.0, p.1, p.2)));
        }
        contents.extend(model.exclusives.iter().map(|set| format!("exclusive {}", set.join(" "))));
        for t in &model.transitions {
            contents.push(format!(
                "transition {} on {} when {} overrun {} priority {}",
                t.name,
                word(t.on.as_ref().map(dotted)),
                word(t.when.as_ref().map(written)),
                word(t.overrun.as_ref()),
                t.priority.as_deref().unwrap_or("0"),
            ));
            let short = |kind, places: &[String]| {
                places.iter().map(|place| format!("{kind} {place}")).collect::<Vec<_>>()
            };
            contents.extend(short("take", &t.from));
            contents.extend(short("put", &t.to));
            contents.extend(t.arcs.iter().map(|(kind, place)| format!("{kind} {place}")));
        }
        contents.extend(model.checks.iter().map(|check| format!("check {}", written(check))));
        for sort in SORTS {
            contents.extend(model.names(sort).iter().filter_map(|name| {
                let (x, y) = model.positions.get(&(sort, name.clone()))?;
                Some(format!("{sort:?} {name} at {x} {y}"))
            }));
        }
        Self(contents)
    }
}

fn dotted((name, of): &(String, &str)) -> String {
    format!("{name}.{of}")
}

fn names(configuration: &Configuration, sort: Sort) -> Vec<String> {
    let mission = configuration.mission.as_ref().unwrap();
    match sort {
        Sort::Component => {
            configuration.system.components.iter().map(|c| c.name.value.clone()).collect()
        }
        Sort::Place => mission.places.iter().map(|p| p.name.value.clone()).collect(),
        Sort::Transition => mission.transitions.iter().map(|t| t.name.value.clone()).collect(),
        Sort::Variable => mission.variables.iter().map(|v| v.name.value.clone()).collect(),
    }
}

fn system(configuration: &Configuration, document: &Document, contents: &mut Vec<String>) {
    let system = &configuration.system;
    contents
        .push(format!("clock {}", word(system.clock.as_ref().map(|clock| clock.source.data()))));
    for c in &system.components {
        let path = document.find(Item::Component(&c.name)).unwrap();
        let element = document.tree().element(&path).unwrap();
        let note = element.attribute("my:note").map(|note| note.value.clone());
        let rate = c.rate_hz.as_ref().map(|rate| rate.value);
        contents.push(format!("component {} {} {note:?}", c.name.value, word(rate)));
        let parameters = c.parameters.iter();
        contents.extend(parameters.map(|p| format!("{}={:?}", p.name.value, p.value.value)));
    }
    contents.extend(
        system.links.iter().map(|l| format!("{} > {} {}", l.from.data(), l.to.data(), l.keep)),
    );
}

fn mission(configuration: &Configuration, contents: &mut Vec<String>) {
    let mission = configuration.mission.as_ref().unwrap();
    contents.push(format!("goal {} safe {}", value(&mission.goal), value(&mission.safe)));
    let variables = mission.variables.iter();
    contents.extend(variables.map(|v| format!("{} of {}", v.name.value, value(&v.source))));
    for p in &mission.places {
        let components = list(&p.components);
        contents.push(format!("place {} [{components}] {}", p.name.value, value(&p.on_failure)));
        contents.extend(p.parameters.iter().map(|given| {
            let (name, value) = (&given.parameter.name.value, &given.parameter.value.value);
            format!("{}.{name}={value:?}", given.component.value)
        }));
    }
    let sets = mission.exclusives.iter();
    contents.extend(sets.map(|set| format!("exclusive {}", list(&set.components))));
    for t in &mission.transitions {
        let on = t.on.as_ref().map(|on| format!("{}.{}", on.component.value, on.event.value));
        contents.push(format!(
            "transition {} on {} when {} overrun {} priority {}",
            t.name.value,
            word(on),
            value(&t.when),
            value(&t.overrun),
            t.priority
        ));
        contents.extend(t.arcs.iter().map(|arc| {
            let kind = match arc.kind {
                ArcKind::Take => "take",
                ArcKind::Put => "put",
                ArcKind::Read => "read",
                ArcKind::Inhibitor => "inhibitor",
                ArcKind::Reset => "reset",
            };
            format!("{kind} {}", arc.place.value)
        }));
    }
    contents.extend(mission.checks.iter().map(|check| format!("check {}", check.value)));
}
