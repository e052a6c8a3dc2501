//! Routes written out as the places and transitions that are derived from them.

use std::collections::BTreeSet;

use crate::claim::Sort;
use crate::edit::adding::number_for;
use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::{Item, check_name};
use crate::edit::layout::Position;
use crate::edit::new_element::NewElement;
use crate::edit::words::{ListForm, occurrences, replaced};
use crate::mission::{ArcKind, Autonomy, LostLink, Mission, Place, Transition};

impl Document {
    /// Replaces the routes of the mission by their places and transitions, for an author who
    /// continues without the drawing. `mission` is what was read from this file. A dot in a name
    /// becomes a hyphen: `red.l1` is `red-l1`. The map stays. Returns the number of routes.
    ///
    /// # Errors
    /// If a name becomes too long, or is that of another place or transition.
    pub fn expand_routes(&mut self, mission: &Mission) -> Result<usize, EditError> {
        let is_derived = |name: &str| name.contains('.');
        let places: Vec<_> =
            mission.places.iter().filter(|place| is_derived(&place.name.value)).collect();
        let transitions: Vec<_> =
            mission.transitions.iter().filter(|it| is_derived(&it.name.value)).collect();
        for place in &places {
            let name = plain_name(&place.name.value);
            check_name(&name)?;
            self.refuse_taken(Item::Place(&name))?;
        }
        let mut known = BTreeSet::new();
        for transition in &transitions {
            let name = plain_name(&transition.name.value);
            check_name(&name)?;
            self.refuse_taken(Item::Transition(&name))?;
            if !known.insert(name.clone()) {
                return Err(EditError::BadName { name });
            }
        }
        let mut changed = self.clone();
        changed.rename_in_checks(&places, &transitions)?;
        let shown = places.iter().map(|place| Item::Place(&place.name.value));
        let shown = shown.chain(transitions.iter().map(|it| Item::Transition(&it.name.value)));
        let shown: Vec<_> = shown.filter_map(|item| Some((item, self.position(item)?))).collect();
        // While the routes are in the file their items can be named.
        let hidden: Vec<_> = shown.iter().map(|(item, _)| (*item, None)).collect();
        changed.set_positions(&hidden)?;
        for new in places.iter().map(|place| write_place(place)) {
            changed.insert_last("place", &new)?;
        }
        for new in transitions.iter().map(|transition| write_transition(transition)) {
            changed.insert_last("transition", &new)?;
        }
        for route in &mission.routes {
            let path = changed.path_of(Item::Route(&route.name.value))?;
            changed.remove_element(&path)?;
        }
        changed.show_under_plain_names(&shown)?;
        changed.revision = self.revision + 1;
        *self = changed;
        Ok(mission.routes.len())
    }

    /// Shows what was written out where it was shown under its derived name.
    fn show_under_plain_names(&mut self, shown: &[(Item<'_>, Position)]) -> Result<(), EditError> {
        for (item, position) in shown {
            let plain = plain_name(item.name().unwrap_or_default());
            let Some(item) = item.renamed(&plain) else { continue };
            self.set_positions(&[(item, Some(*position))])?;
        }
        Ok(())
    }

    fn insert_last(&mut self, sort: &str, new: &NewElement) -> Result<(), EditError> {
        let parent = self.path_of(Item::Mission)?;
        let index = number_for(self.element(&parent)?, sort);
        self.insert_element(&parent, index, new)
    }

    /// Checks name derived places and transitions as those of a sub-mission.
    fn rename_in_checks(
        &mut self,
        places: &[&Place],
        transitions: &[&Transition],
    ) -> Result<(), EditError> {
        let parent = self.path_of(Item::Mission)?;
        let elements = self.element(&parent)?.elements().enumerate();
        let checks = elements.filter(|(_, element)| element.name == "check");
        let checks: Vec<_> = checks.map(|(index, check)| (index, check.text().0)).collect();
        let places = places.iter().map(|place| (Sort::Place, &place.name.value));
        let transitions = transitions.iter().map(|it| (Sort::Transition, &it.name.value));
        let names: Vec<_> = places.chain(transitions).collect();
        for (index, text) in checks {
            let renamed = names.iter().fold(text.clone(), |text, (sort, name)| {
                let at = occurrences(ListForm::Claimed(*sort), &text, name);
                replaced(&text, &at, &plain_name(name))
            });
            if renamed != text {
                let mut path = parent.clone();
                path.push(index);
                self.set_text_at(&path, &renamed)?;
            }
        }
        Ok(())
    }
}

fn plain_name(name: &str) -> String {
    name.replace('.', "-")
}

fn write_place(place: &Place) -> NewElement {
    let mut new = NewElement::new("place").attribute("name", plain_name(&place.name.value));
    if place.initial > 0 {
        new = new.attribute("initial", "true");
    }
    if !place.components.is_empty() {
        let names: Vec<_> = place.components.iter().map(|name| name.value.as_str()).collect();
        new = new.attribute("components", names.join(" "));
    }
    if let Some(on_failure) = &place.on_failure {
        new = new.attribute("on-failure", on_failure.value.clone());
    }
    place.parameters.iter().fold(new, |new, given| {
        let parameter = NewElement::new("parameter")
            .attribute("component", given.component.value.clone())
            .attribute("name", given.parameter.name.value.clone())
            .attribute("value", given.parameter.value.value.clone());
        new.child(parameter)
    })
}

fn write_transition(transition: &Transition) -> NewElement {
    let list = |kind: ArcKind| {
        let arcs = transition.arcs.iter().filter(|arc| arc.kind == kind);
        arcs.map(|arc| plain_name(&arc.place.value)).collect::<Vec<_>>().join(" ")
    };
    let mut attributes = vec![
        ("name", plain_name(&transition.name.value)),
        ("from", list(ArcKind::Take)),
        ("to", list(ArcKind::Put)),
    ];
    if let Some(on) = &transition.on {
        attributes.push(("on", format!("{}.{}", on.component.value, on.event.value)));
    }
    if let Some(time) = &transition.interval {
        // As it is written at the leg: the text of a duration.
        attributes.push(("timeout", time.at.text().to_owned()));
    }
    attributes.extend(transition.when.as_ref().map(|when| ("when", when.value.clone())));
    if transition.priority != 0 {
        attributes.push(("priority", transition.priority.to_string()));
    }
    if transition.autonomy == Autonomy::Operator {
        attributes.push(("operator", "true".into()));
    }
    if transition.lost_link.as_ref().is_some_and(|lost| lost.value == LostLink::Fire) {
        attributes.push(("lost-link", "fire".into()));
    }
    if let Some(date) = &transition.not_before {
        attributes.push(("not-before", date.at.text().to_owned()));
    }
    let new = NewElement::new("transition");
    attributes.into_iter().fold(new, |new, (name, value)| new.attribute(name, value))
}
