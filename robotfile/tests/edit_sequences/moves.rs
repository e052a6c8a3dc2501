//! One random edit, made in the document and in the model; which lines it may touch, and what
//! undoing it must give.

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, EditError, Item, Position};

use crate::edit_sequences::contents::item;
use crate::edit_sequences::model::{
    Model, Place, SORTS, Sort, Transition, random_component, random_value, written,
};
use crate::edit_sequences::random::Random;
use crate::edit_sequences::text;

/// Makes an edit and answers what it was.
pub fn make(document: &mut Document, model: &mut Model, random: &mut Random) -> String {
    match random.below(12) {
        0 | 1 => parameter(document, model, random),
        2 => attribute(document, model, random),
        3 => add_component_or_variable(document, model, random),
        4 => add_link(document, model, random),
        5 => add_place_or_transition(document, model, random),
        6 | 7 => rename(document, model, random),
        8 => remove(document, model, random),
        9 => remove_link(document, model, random),
        10 => place_parameter(document, model, random),
        _ => match random.below(2) {
            0 => positions(document, model, random),
            _ => reorder(document, model, random),
        },
    }
    .unwrap_or_default()
}

/// How many lines at most differ, of the old and of the new text, counted from the first that does
/// to the last.
fn touches(before: &Document, after: &Document, old_most: usize, new_most: usize, edit: &str) {
    let old: Vec<_> = text(before).split_inclusive('\n').collect();
    let new: Vec<_> = text(after).split_inclusive('\n').collect();
    let head = old.iter().zip(&new).take_while(|(old, new)| old == new).count();
    let rest = old[head..].iter().rev().zip(new[head..].iter().rev());
    let tail = rest.take_while(|(old, new)| old == new).count();
    let (old, new) = (old.len() - head - tail, new.len() - head - tail);
    assert!(
        old <= old_most && new <= new_most,
        "{edit}: {old} lines became {new}\n{}\n---\n{}",
        text(before),
        text(after)
    );
}

fn gives_back(
    before: &Document,
    after: &Document,
    edit: &str,
    undo: impl FnOnce(&mut Document) -> Result<(), EditError>,
) {
    let mut undone = after.clone();
    undo(&mut undone).unwrap();
    assert_eq!(text(&undone), text(before), "{edit}\n{}", text(after));
}

fn element<'a>(document: &'a Document, item: Item<'_>) -> &'a Element {
    document.tree().element(&document.find(item).unwrap()).unwrap()
}

/// Whether an element in which something is put and taken out again is as it was.
fn is_restored(document: &Document, element: &Element) -> bool {
    let written = &text(document)[element.span.start()..element.span.end()];
    element.elements().next().is_some() || written.ends_with("/>") && !written.ends_with(" />")
}

fn parameter(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    let n = random.below(model.components.len().max(1));
    let component = model.components.get_mut(n)?;
    let name = *random.pick(&["speed", "a", "world", "new"]);
    let value = random.percent(75).then(|| random_value(random));
    let edit = format!("parameter {}.{name} = {value:?}", component.name);
    let before = document.clone();
    document.set_parameter(&component.name, name, value.as_deref()).unwrap();
    let at = component.parameters.iter().position(|(known, _)| known == name);
    let back =
        |d: &mut Document, value: Option<&str>| d.set_parameter(&component.name, name, value);
    match (at, value) {
        (Some(n), Some(value)) => {
            touches(&before, document, 1, 1, &edit);
            let old = component.parameters[n].1.clone();
            gives_back(&before, document, &edit, |d| back(d, Some(&old)));
            component.parameters[n].1 = value;
        }
        (None, Some(value)) => {
            touches(&before, document, 1, 3, &edit);
            if is_restored(&before, element(&before, Item::Component(&component.name))) {
                gives_back(&before, document, &edit, |d| back(d, None));
            }
            component.parameters.push((name.to_owned(), value));
        }
        (Some(n), None) => {
            component.parameters.remove(n);
        }
        (None, None) => assert_eq!(text(document), text(&before)),
    }
    Some(edit)
}

fn attribute(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    let before = document.clone();
    let (edit, had) = match random.below(3) {
        0 => {
            let n = random.below(model.components.len().max(1));
            let component = model.components.get_mut(n)?;
            let rate = random.percent(60).then(|| "20Hz".to_owned());
            let item = Item::Component(&component.name);
            document.set_attribute(item, "rate", rate.as_deref()).unwrap();
            let edit = format!("{} rate {rate:?}", component.name);
            (edit, std::mem::replace(&mut component.rate, rate).is_some())
        }
        1 => {
            let n = random.below(model.transitions.len().max(1));
            let transition = model.transitions.get_mut(n)?;
            let priority = random.percent(60).then(|| "7".to_owned());
            let item = Item::Transition(&transition.name);
            document.set_attribute(item, "priority", priority.as_deref()).unwrap();
            let edit = format!("{} priority {priority:?}", transition.name);
            (edit, std::mem::replace(&mut transition.priority, priority).is_some())
        }
        _ => {
            let n = random.below(model.links.len().max(1));
            let link = model.links.get_mut(n)?;
            let keep = random.percent(60).then(|| "7".to_owned());
            let (from, to) = (dotted(&link.from), dotted(&link.to));
            let item = Item::Link { from: &from, to: &to };
            document.set_attribute(item, "keep", keep.as_deref()).unwrap();
            let edit = format!("{from} > {to} keep {keep:?}");
            (edit, std::mem::replace(&mut link.keep, keep).is_some())
        }
    };
    let (old, new) = if had { (2, 1) } else { (1, 2) };
    touches(&before, document, old, new, &edit);
    Some(edit)
}

fn dotted(name: &(String, &str)) -> String {
    format!("{}.{}", name.0, name.1)
}

/// Adds an item, and checks the lines and the undoing.
fn add(document: &mut Document, item: Item<'_>, attributes: &[(&str, &str)], edit: &str) {
    let before = document.clone();
    document.add(item, attributes).unwrap();
    touches(&before, document, 1, 3, edit);
    let owner = if matches!(item, Item::Component(_) | Item::Link { .. }) {
        Item::System
    } else {
        Item::Mission
    };
    if is_restored(&before, element(&before, owner)) {
        gives_back(&before, document, edit, |d| d.remove(item));
    }
    // There is one of its name now.
    let after = text(document).to_owned();
    assert!(matches!(document.add(item, attributes), Err(EditError::Taken { .. })), "{edit}");
    assert_eq!(text(document), after);
}

fn add_component_or_variable(
    document: &mut Document,
    model: &mut Model,
    random: &mut Random,
) -> Option<String> {
    if random.percent(60) {
        let name = model.fresh(Sort::Component, random)?;
        let mut component = random_component(name.clone(), random);
        component.parameters.clear();
        let edit = format!("add component {name}");
        let mut attributes = vec![("kind", "kind")];
        attributes.extend(component.note.as_deref().map(|note| ("my:note", note)));
        attributes.extend(component.rate.as_deref().map(|rate| ("rate", rate)));
        add(document, Item::Component(&name), &attributes, &edit);
        model.components.push(component);
        return Some(edit);
    }
    let name = model.fresh(Sort::Variable, random)?;
    let source = model.dotted(random, "level");
    let edit = format!("add variable {name} of {source:?}");
    let data = source.as_ref().map(dotted);
    let attributes: Vec<_> = data.iter().map(|data| ("source", data.as_str())).collect();
    add(document, Item::Variable(&name), &attributes, &edit);
    model.variables.push((name, source));
    Some(edit)
}

fn add_link(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    let link = model.random_link(random)?;
    let (from, to) = (dotted(&link.from), dotted(&link.to));
    let edit = format!("add link {from} > {to}");
    let attributes: Vec<_> = link.keep.iter().map(|keep| ("keep", keep.as_str())).collect();
    add(document, Item::Link { from: &from, to: &to }, &attributes, &edit);
    model.links.push(link);
    Some(edit)
}

fn add_place_or_transition(
    document: &mut Document,
    model: &mut Model,
    random: &mut Random,
) -> Option<String> {
    if random.percent(50) {
        let name = model.fresh(Sort::Place, random)?;
        let place = Place { parameters: Vec::new(), ..model.random_place(name, random) };
        let edit = format!("add place {}", place.name);
        let components = place.components.join(" ");
        let mut attributes = Vec::new();
        if !components.is_empty() {
            attributes.push(("components", components.as_str()));
        }
        attributes.extend(place.on_failure.as_deref().map(|other| ("on-failure", other)));
        add(document, Item::Place(&place.name), &attributes, &edit);
        model.places.push(place);
        return Some(edit);
    }
    let name = model.fresh(Sort::Transition, random)?;
    let transition = Transition { arcs: Vec::new(), ..model.random_transition(name, random) };
    let edit = format!("add transition {}", transition.name);
    let (from, to) = (transition.from.join(" "), transition.to.join(" "));
    let (on, when) = (transition.on.as_ref().map(dotted), transition.when.as_ref().map(written));
    let mut attributes = vec![("from", from.as_str()), ("to", to.as_str())];
    attributes.retain(|(_, places)| !places.is_empty());
    attributes.extend(on.as_deref().map(|on| ("on", on)));
    attributes.extend(when.as_deref().map(|when| ("when", when)));
    attributes.extend(transition.overrun.as_deref().map(|place| ("overrun", place)));
    attributes.extend(transition.priority.as_deref().map(|priority| ("priority", priority)));
    add(document, Item::Transition(&transition.name), &attributes, &edit);
    model.transitions.push(transition);
    Some(edit)
}

fn rename(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    let sort = *random.pick(&SORTS);
    let old = random.one(&model.names(sort))?;
    let new = model.fresh(sort, random)?;
    let edit = format!("rename {sort:?} {old} to {new}");
    let before = document.clone();
    document.rename(item(sort, &old), &new).unwrap();
    let (was, is): (Vec<_>, Vec<_>) =
        (text(&before).lines().collect(), text(document).lines().collect());
    assert_eq!(was.len(), is.len(), "{edit}");
    for (was, is) in was.iter().zip(&is).filter(|(was, is)| was != is) {
        assert!(was.contains(&old) && is.contains(&new), "{edit}: {was} -> {is}");
    }
    gives_back(&before, document, &edit, |d| d.rename(item(sort, &new), &old));
    // It has the name of another.
    if let Some(other) = model.names(sort).iter().find(|name| **name != old) {
        let after = text(document).to_owned();
        let refused = document.rename(item(sort, &new), other);
        assert!(matches!(refused, Err(EditError::Taken { .. })), "{edit}");
        assert_eq!(text(document), after);
    }
    model.rename(sort, &old, &new);
    Some(edit)
}

fn remove(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    let sort = *random.pick(&SORTS);
    let name = random.one(&model.names(sort))?;
    let edit = format!("remove {sort:?} {name}");
    let before = text(document).to_owned();
    let result = document.remove(item(sort, &name));
    if model.needs(sort, &name) {
        let refused = matches!(&result, Err(EditError::StillNamed { at, .. }) if !at.is_empty());
        assert!(refused, "{edit}: {result:?}\n{before}");
        assert_eq!(text(document), before);
    } else {
        result.unwrap_or_else(|error| panic!("{edit}: {error}\n{before}"));
        assert!(document.mentions(item(sort, &name)).is_empty(), "{edit}\n{}", text(document));
        model.remove(sort, &name);
    }
    Some(edit)
}

fn remove_link(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    let n = random.below(model.links.len().max(1));
    let link = model.links.get(n)?;
    let (from, to) = (dotted(&link.from), dotted(&link.to));
    let edit = format!("remove link {from} > {to}");
    let before = document.clone();
    let item = Item::Link { from: &from, to: &to };
    document.remove(item).unwrap();
    let lines =
        |element: &Element| text(&before)[element.span.start()..element.span.end()].lines().count();
    let owner = element(&before, Item::System);
    let old =
        if owner.elements().count() == 1 { lines(owner) } else { lines(element(&before, item)) };
    touches(&before, document, old, 1, &edit);
    model.links.remove(n);
    Some(edit)
}

fn place_parameter(
    document: &mut Document,
    model: &mut Model,
    random: &mut Random,
) -> Option<String> {
    let component = random.one(&model.names(Sort::Component))?;
    let n = random.below(model.places.len().max(1));
    let place = model.places.get_mut(n)?;
    let value = random.percent(70).then(|| random_value(random));
    let edit = format!("{} gives {component}.area {value:?}", place.name);
    document.set_place_parameter(&place.name, &component, "area", value.as_deref()).unwrap();
    match (place.parameters.iter_mut().find(|p| p.0 == component), value) {
        (Some(given), Some(value)) => given.2 = value,
        (None, Some(value)) => place.parameters.push((component, "area".into(), value)),
        (_, None) => place.parameters.retain(|p| p.0 != component),
    }
    Some(edit)
}

fn positions(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    let shown = [Sort::Component, Sort::Place, Sort::Transition];
    let all = shown.map(|sort| model.names(sort).into_iter().map(move |name| (sort, name)));
    let all: Vec<_> = all.into_iter().flatten().collect();
    let chosen = random.some(&all, 30);
    let moved: Vec<_> = chosen
        .into_iter()
        .map(|key| {
            let at = (random.below(2000) as f64 / 4.0 - 100.0, random.below(500) as f64);
            (key, random.percent(70).then_some(at))
        })
        .collect();
    let edit = format!("positions {moved:?}");
    let asked: Vec<_> = moved
        .iter()
        .map(|((sort, name), at)| (item(*sort, name), at.map(|(x, y)| Position { x, y })))
        .collect();
    let before = document.clone();
    document.set_positions(&asked).unwrap();
    // A block that is there and is moved is one line.
    if let [((sort, name), Some(_))] = &moved[..]
        && model.positions.contains_key(&(*sort, name.clone()))
    {
        touches(&before, document, 1, 1, &edit);
    }
    for (key, at) in moved {
        match at {
            Some(at) => model.positions.insert(key, at),
            None => model.positions.remove(&key),
        };
    }
    Some(edit)
}

/// Moves an item to where another of its sort is.
fn reorder(document: &mut Document, model: &mut Model, random: &mut Random) -> Option<String> {
    fn moved<T>(list: &mut Vec<T>, from: usize, to: usize) {
        let moved = list.remove(from);
        list.insert(to, moved);
    }
    let sort = *random.pick(&SORTS);
    let names = model.names(sort);
    let (from, to) = (random.below(names.len().max(1)), random.below(names.len().max(1)));
    let path = document.find(item(sort, names.get(from)?))?;
    let target = document.find(item(sort, &names[to]))?;
    let edit = format!("{sort:?} {} to the place of {}", names[from], names[to]);
    document.move_element(&path, *target.last()?).unwrap();
    match sort {
        Sort::Component => moved(&mut model.components, from, to),
        Sort::Place => moved(&mut model.places, from, to),
        Sort::Transition => moved(&mut model.transitions, from, to),
        Sort::Variable => moved(&mut model.variables, from, to),
    }
    Some(edit)
}
