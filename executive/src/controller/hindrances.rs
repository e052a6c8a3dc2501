//! Why a transition is not enabled, in words.

use super::context::Context;
use super::mission_dates::MissionDates;
use armor_petri::TransitionId;

/// Returns what keeps a transition from being enabled: tokens, its date, its report or its guard.
pub(super) fn firing_hindrance(cx: &Context, dates: &MissionDates, id: TransitionId) -> String {
    if let Some(why) = token_hindrance(cx, id).or_else(|| dates.date_hindrance(cx, id)) {
        return why;
    }
    match &cx.plan().transition(id).on {
        Some((component, report)) => {
            let component = &cx.plan().component(*component).name;
            format!("it waits for `{component}.{report}`")
        }
        None => "its condition does not hold".into(),
    }
}

/// Returns which place has too few tokens for a transition, or one too many.
pub(super) fn token_hindrance(cx: &Context, id: TransitionId) -> Option<String> {
    let (net, state) = (cx.plan().net(), cx.ledger().state());
    let transition = net.transition(id);
    let mut needs = transition.inputs.iter().chain(&transition.reads);
    if let Some((place, weight)) = needs.find(|arc| state.tokens(arc.0) < arc.1) {
        let (place, tokens) = (net.place(*place), state.tokens(*place));
        return Some(format!("`{place}` holds {tokens} of the {weight} tokens it needs"));
    }
    let inhibited = transition.inhibitors.iter().find(|arc| state.tokens(arc.0) >= arc.1);
    inhibited.map(|(place, _)| format!("a token in `{}` keeps it from firing", net.place(*place)))
}
