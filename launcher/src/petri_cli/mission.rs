//! A mission file as a net: what the executive plays, with the attributes of places and transitions
//! as text.

use std::path::Path;

use anyhow::{Result, anyhow};
use armor_petri::file::NetFile;
use armor_plan::Plan;
use armor_robotfile::mission::{
    Autonomy, LostLink, Mission, Place, PlaceParameter, SetVariable, Transition, Variable,
};
use armor_robotfile::{Date, Spanned};

use crate::findings_error::refuse_file;

/// Returns whether a text is one of our files and not PNML, by its first element.
pub fn is_mission(text: &str) -> bool {
    let mut rest = text.trim_start();
    loop {
        let end = match rest {
            _ if rest.starts_with("<!--") => "-->",
            _ if rest.starts_with("<?") => "?>",
            _ => break,
        };
        let Some((_, after)) = rest.split_once(end) else { return false };
        rest = after.trim_start();
    }
    let after = rest.strip_prefix("<armor");
    after.is_some_and(|after| after.starts_with(|c: char| c.is_whitespace() || "/>".contains(c)))
}

/// The net of the mission in a file, with its sub-missions put in.
///
/// # Errors
/// Returns the faults of the file, or that it contains no mission.
pub fn read_mission_net(path: &Path) -> Result<NetFile> {
    let reading = armor_robotfile::check(armor_robotfile::load(path), &[], None);
    let Some(configuration) = reading.configuration.as_ref().filter(|_| reading.is_valid()) else {
        return Err(refuse_file(path, &reading.findings));
    };
    let plan = Plan::of(configuration).map_err(|findings| refuse_file(path, &findings))?;
    let mission = configuration.flattened().map_err(|findings| refuse_file(path, &findings))?;
    let (Some(plan), Some(mission)) = (plan, mission) else {
        return Err(anyhow!("{} has no mission, only a system", path.display()));
    };
    let mut file = NetFile::new(plan.mission(), plan.net().as_ref().clone());
    for (note, name) in file.places.iter_mut().zip(file.net.places()) {
        let place = mission.places.iter().find(|place| place.name.value == *name);
        note.words = place.map(|place| of_place(&mission, place)).unwrap_or_default();
    }
    for (note, t) in file.transitions.iter_mut().zip(file.net.transitions()) {
        let written = mission.transitions.iter().find(|written| written.name.value == t.name);
        note.words = written.map(|written| of_transition(&mission, written)).unwrap_or_default();
    }
    Ok(file)
}

fn of_place(mission: &Mission, place: &Place) -> Vec<(String, String)> {
    let is = |end: &Option<Spanned<String>>| {
        end.as_ref().filter(|end| end.value == place.name.value).map(|_| "true".to_owned())
    };
    let components: Vec<_> = place.components.iter().map(|name| name.value.as_str()).collect();
    list_attributes([
        ("components", Some(components.join(" ")).filter(|names| !names.is_empty())),
        ("goal", is(&mission.goal)),
        ("safe", is(&mission.safe)),
        ("on-failure", text(&place.on_failure)),
        ("parameters", listed(place.parameters.iter().map(given))),
    ])
}

/// `explorer.area=north`.
fn given(given: &PlaceParameter) -> String {
    let PlaceParameter { component, parameter } = given;
    format!("{}.{}={}", component.value, parameter.name.value, parameter.value.value)
}

/// `round = round + 1, in 0..3 from 0`.
fn set(mission: &Mission, set: &SetVariable) -> String {
    let variable = mission.variables.iter().find(|it| it.name.value == set.variable.value);
    let counts = variable.and_then(Variable::counts).map(|counts| {
        format!(", in {}..{} from {}", counts.minimum, counts.maximum, counts.initial)
    });
    format!("{} = {}{}", set.variable.value, set.value.value, counts.unwrap_or_default())
}

fn listed(texts: impl Iterator<Item = String>) -> Option<String> {
    let texts: Vec<_> = texts.collect();
    (!texts.is_empty()).then(|| texts.join("; "))
}

fn of_transition(mission: &Mission, t: &Transition) -> Vec<(String, String)> {
    let on = t.on.as_ref().map(|on| format!("{}.{}", on.component.value, on.event.value));
    let autonomy = match t.autonomy {
        Autonomy::Auto => None,
        Autonomy::Confirm { .. } => Some("confirm".to_owned()),
        Autonomy::Operator => Some("operator".to_owned()),
    };
    let lost_link = t.lost_link.as_deref().map(|lost_link| match lost_link {
        LostLink::Fire => "fire".to_owned(),
        LostLink::Wait => "wait".to_owned(),
    });
    list_attributes([
        ("on", on),
        ("when", text(&t.when)),
        ("sets", listed(t.sets.iter().map(|it| set(mission, it)))),
        ("autonomy", autonomy),
        ("lost-link", lost_link),
        ("not-before", format_date(&t.not_before)),
        ("not-after", format_date(&t.not_after)),
        ("on-stop-fail", text(&t.on_stop_fail)),
        ("on-start-fail", text(&t.on_start_fail)),
        ("overrun", text(&t.overrun)),
    ])
}

fn format_date(value: &Option<Spanned<Date>>) -> Option<String> {
    value.as_ref().map(|date| date.value.to_string())
}

fn text(value: &Option<Spanned<String>>) -> Option<String> {
    value.as_ref().map(|value| value.value.clone())
}

fn list_attributes<const N: usize>(words: [(&str, Option<String>); N]) -> Vec<(String, String)> {
    words.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_petri::file::pnml;

    #[test]
    fn a_mission_is_known_by_its_first_element() {
        let ours = ["<armor version='1'>", " <?xml?>\n<!-- <pnml> -->\n<armor/>", "<armor\n>"];
        assert_eq!(ours.map(is_mission), [true; 3]);
        let others = ["", "<pnml>", "<!-- <armor> --><pnml>", "<armory/>", "<!--", "net armor"];
        assert_eq!(others.map(is_mission), [false; 6]);
    }

    #[test]
    fn what_a_mission_contains_passes_through_pnml() {
        let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
        let mut seen = 0;
        for entry in std::fs::read_dir(missions).expect("missions") {
            let path = entry.expect("a file").path();
            if path.extension().is_none_or(|extension| extension != "xml") {
                continue;
            }
            let file = read_mission_net(&path)
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let again = pnml::read(&pnml::write(&file)).expect("PNML");
            assert_eq!((&again.name, &again.places), (&file.name, &file.places));
            assert_eq!(again.transitions, file.transitions);
            assert_eq!(again.net.places(), file.net.places());
            assert_eq!(again.net.initial(), file.net.initial());
            assert_eq!(again.net.transitions(), file.net.transitions());
            seen += 1;
        }
        assert!(seen >= 5, "{seen} missions");
    }
}
