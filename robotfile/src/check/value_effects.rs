//! Values of parameters that their ranges allow, and with which nothing works: a component that does
//! nothing, is never done, or is done only after its place was left. The manifests state which.

use std::time::Duration;

use armor_wire::manifest::{
    EffectKind, Manifest, ParameterManifest, ParameterType, ParameterValue, ValueEffect,
};
use armor_wire::text_format::TextFormat;

use crate::check::companions::accompanies;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::mission::{Autonomy, Mission, Place, Transition};
use crate::model::{Component, Configuration, Parameter, System};

/// Checks the values of all components, in the system and in the places of missions.
pub(super) fn check(configuration: &Configuration, manifests: &Manifests, findings: &mut Findings) {
    for component in &configuration.system.components {
        let Some(kind) = manifests.get(&component.kind.value) else { continue };
        for effect in &kind.value_effects {
            let given = GivenValue { component, kind, effect };
            match effect.effect {
                EffectKind::Idle => given.report_idle(configuration, findings),
                _ => given.report_late(configuration, findings),
            }
        }
    }
}

/// Leaves out a value that is too long for a timeout if the timeout is known to be too short, and makes
/// one finding of several that are too long for one timeout.
pub(super) fn merge_by_timeout(findings: &mut Findings) {
    let timeout = |finding: &Finding| match finding.code {
        Code::ValueTooLate => finding.related.first().map(|(at, _)| at.clone()),
        _ => None,
    };
    let short = findings.iter().filter(|finding| finding.code == Code::TimeTooShort);
    let short: Vec<_> = short.filter_map(|finding| finding.at.clone()).collect();
    findings.retain(|finding| {
        timeout(finding).is_none_or(|at| !short.iter().any(|short| short.is_at(&at)))
    });
    findings.merge_same(|first, other| {
        timeout(first).zip(timeout(other)).is_some_and(|(first, other)| first.is_at(&other))
    });
}

/// Whether the value that the component has in a place has this effect.
pub(super) fn has_effect_in(
    component: &Component,
    kind: &Manifest,
    effect: &ValueEffect,
    place: &Place,
) -> bool {
    let given = GivenValue { component, kind, effect };
    match given.find_in(place) {
        Some(value) => given.has_effect(value),
        None => {
            let declared = kind.parameters.iter().find(|it| it.name == effect.parameter);
            let default = declared.and_then(|it| it.default.as_deref());
            default.is_some_and(|text| {
                given.parse(text).is_some() && given.parse(text) == given.parse(&effect.value)
            })
        }
    }
}

/// A parameter of a component whose value may have an effect.
struct GivenValue<'a> {
    component: &'a Component,
    kind: &'a Manifest,
    effect: &'a ValueEffect,
}

impl<'a> GivenValue<'a> {
    fn name(&self) -> &str {
        &self.component.name.value
    }

    fn parse(&self, text: &str) -> Option<ParameterValue> {
        let declared = self.kind.parameters.iter().find(|it| it.name == self.effect.parameter)?;
        declared.parse(text).ok()
    }

    fn has_effect(&self, given: &Parameter) -> bool {
        let value = self.parse(&given.value.value);
        value.is_some() && value == self.parse(&self.effect.value)
    }

    /// The value in a place, or else that of the system.
    fn find_in(&self, place: &'a Place) -> Option<&'a Parameter> {
        self.find_parameter(place, &self.effect.parameter)
    }

    fn find_parameter(&self, place: &'a Place, parameter: &str) -> Option<&'a Parameter> {
        let is_it = |given: &&'a crate::mission::PlaceParameter| {
            given.component.value == self.name() && given.parameter.name.value == parameter
        };
        let in_place = place.parameters.iter().find(is_it).map(|given| &given.parameter);
        in_place.or_else(|| self.component.parameter(parameter))
    }

    fn report_idle(&self, configuration: &Configuration, findings: &mut Findings) {
        let parameter = self.effect.parameter.as_str();
        let own = self.component.parameter(parameter).into_iter();
        let places = configuration.missions().flat_map(|mission| &mission.places);
        let in_places = places.flat_map(|place| &place.parameters).filter(|given| {
            given.component.value == self.name() && given.parameter.name.value == parameter
        });
        let given = own.chain(in_places.map(|given| &given.parameter));
        for given in given.filter(|given| self.has_effect(given)) {
            let message =
                format!("{parameter}: with {} {} does nothing", given.value.value, self.name());
            let finding = Finding::new(Code::ValueIdle, &given.value.at, message);
            findings.push(finding.remedy(self.advise()));
        }
    }

    /// What to write instead.
    fn advise(&self) -> String {
        let declared = self.kind.parameters.iter().find(|it| it.name == self.effect.parameter);
        let default = declared.and_then(|it| it.default.as_deref()).filter(|it| {
            self.parse(it).is_some_and(|it| Some(it) != self.parse(&self.effect.value))
        });
        match default {
            Some(default) => {
                format!("write another value, or remove the parameter: its default is {default}")
            }
            None => "write another value".into(),
        }
    }

    /// The parameters of a delay, each with its share: first the time in seconds, then the numbers, or the
    /// numbers of entries, by which it is multiplied.
    fn find_shares(&self, place: &'a Place) -> Option<Vec<Share<'a>>> {
        let names = [&self.effect.parameter].into_iter().chain(&self.effect.times);
        let share = |name: &'a String| {
            let declared = self.kind.parameters.iter().find(|it| it.name == *name)?;
            let given = self.find_parameter(place, name);
            let text =
                given.map_or(declared.default.as_deref(), |it| Some(it.value.value.as_str()));
            Some(Share {
                name,
                given,
                number: read_number(declared, text?)?,
                is_count: declared.kind == ParameterType::Text,
                usual: declared
                    .default
                    .as_deref()
                    .filter(|text| !text.is_empty())
                    .and_then(|text| read_number(declared, text)),
            })
        };
        names.map(share).collect()
    }

    /// The parameter of a delay to look at: of those that the file gives, the one that is most above what
    /// is usual.
    fn find_longest(shares: &[Share<'a>]) -> Option<&'a Parameter> {
        let excess = |share: &&Share<'_>| {
            share.number / share.usual.filter(|usual| *usual > 0.0).unwrap_or(share.number.max(1.0))
        };
        let given = shares.iter().filter(|share| share.given.is_some());
        // Of equals the first.
        let longest = given.rev().max_by(|one, other| excess(one).total_cmp(&excess(other)));
        longest.and_then(|share| share.given)
    }

    fn report_late(&self, configuration: &'a Configuration, findings: &mut Findings) {
        let mut reported = Vec::new();
        for mission in configuration.missions() {
            for place in
                mission.places.iter().filter(|place| self.is_concerned(place, configuration))
            {
                let shares = match self.effect.effect {
                    EffectKind::DelaysDone => self.find_shares(place).unwrap_or_default(),
                    _ => Vec::new(),
                };
                let longest = Self::find_longest(&shares).or_else(|| self.find_in(place));
                let Some(given) = longest else { continue };
                // One value is one mistake, in however many places.
                if reported.contains(&&given.value.at.span) {
                    continue;
                }
                let found = match self.effect.effect {
                    EffectKind::NeverDone => self.find_never_done(mission, place, given),
                    _ => self.find_too_late(mission, place, given, &shares),
                };
                if let Some(finding) = found {
                    reported.push(&given.value.at.span);
                    findings.push(finding);
                }
            }
        }
    }

    /// Whether the place activates the component, or one that takes the output that it paces.
    fn is_concerned(&self, place: &Place, configuration: &Configuration) -> bool {
        match self.effect.effect {
            EffectKind::Paces => {
                let mut consumers = find_consumers(&configuration.system, self);
                consumers.any(|consumer| place.activates(consumer))
            }
            _ => place.activates(self.name()),
        }
    }

    fn find_never_done(
        &self,
        mission: &Mission,
        place: &Place,
        given: &Parameter,
    ) -> Option<Finding> {
        let waiting = self.find_waiting(mission, place).filter(|_| self.has_effect(given))?;
        let (name, on) = (&waiting.name.value, waiting.on.as_ref()?);
        let message = format!(
            "{}: with {} {} is never done, so {name} never fires",
            self.effect.parameter,
            given.value.value,
            self.name()
        );
        let finding = Finding::new(Code::ValueTooLate, &given.value.at, message);
        let finding = finding.related(&on.event.at, "this report is never sent");
        Some(finding.remedy(format!("{}; or wait for another report", self.advise())))
    }

    fn find_too_late(
        &self,
        mission: &Mission,
        place: &Place,
        given: &Parameter,
        shares: &[Share<'_>],
    ) -> Option<Finding> {
        let seconds = match (shares, self.parse(&given.value.value)) {
            ([], Some(ParameterValue::Number(seconds))) => seconds,
            ([], _) => return None,
            _ => shares.iter().map(|share| share.number).product(),
        };
        let needs_end = self.effect.effect == EffectKind::DelaysDone;
        if needs_end && self.find_waiting(mission, place).is_none() {
            return None;
        }
        let timeout = mission.transitions.iter().find(|it| {
            let latest = it.interval.as_ref().and_then(|interval| interval.value.latest);
            let is_sooner = |latest: Duration| !latest.is_zero() && latest.as_secs_f64() <= seconds;
            is_timeout_of(mission, it, place) && latest.is_some_and(is_sooner)
        })?;
        let interval = timeout.interval.as_ref()?;
        let (parameter, value) = (&given.name.value, &given.value.value);
        // Several parameters together make it long.
        let factors: Vec<_> = shares.iter().skip(1).filter_map(Share::describe_factor).collect();
        let value = match shares.first().filter(|_| !factors.is_empty()) {
            Some(time) => {
                let (name, time_s) = (time.name, time.number);
                format!("{seconds} s ({name} {time_s} s × {})", factors.join(" × "))
            }
            // 200 ms were meant, perhaps.
            None if value.trim().parse::<f64>().is_ok() => {
                format!("{seconds} s ({value} has no unit)")
            }
            None => value.clone(),
        };
        let (place, late) = (&place.name.value, &timeout.name.value);
        let (name, output) = (self.name(), &self.effect.output);
        let what = match self.effect.effect {
            EffectKind::Paces => format!("{name} sends {name}.{output} every {value}"),
            EffectKind::GivesUp => format!("{name} gives nothing up before {value}"),
            _ => format!("{name} is not done before {value}"),
        };
        let time = interval.at.text();
        let message = format!("{parameter}: {what}, and {late} leaves {place} after {time}");
        let finding = Finding::new(Code::ValueTooLate, &given.value.at, message);
        let finding = finding.related(&interval.at, "this time is not longer");
        Some(finding.remedy(format!("write a shorter time here, or a longer one for {late}")))
    }

    /// The transition that waits in the place until the component is done.
    fn find_waiting<'m>(&self, mission: &'m Mission, place: &Place) -> Option<&'m Transition> {
        mission.transitions.iter().find(|it| {
            it.inputs().any(|arc| arc.place.value == place.name.value)
                && it
                    .on
                    .as_ref()
                    .is_some_and(|on| on.component.value == self.name() && on.event.value == "done")
        })
    }
}

/// A parameter that makes a component take long.
struct Share<'a> {
    name: &'a str,
    /// Where the file gives it.
    given: Option<&'a Parameter>,
    number: f64,
    /// Whether it is the number of entries.
    is_count: bool,
    /// The number by default.
    usual: Option<f64>,
}

impl Share<'_> {
    /// "2 laps", "3 in route"; none of one.
    fn describe_factor(&self) -> Option<String> {
        let link = if self.is_count { " in" } else { "" };
        (self.number != 1.0).then(|| format!("{}{link} {}", self.number, self.name))
    }
}

/// The number that a parameter is, or that of its entries.
fn read_number(declared: &ParameterManifest, text: &str) -> Option<f64> {
    match (declared.parse(text).ok()?, declared.format) {
        (ParameterValue::Number(number), _) => Some(number),
        (ParameterValue::Integer(number), _) => Some(number as f64),
        (
            ParameterValue::Text(text),
            Some(TextFormat::Points | TextFormat::Numbers | TextFormat::Names),
        ) => Some(text.split_whitespace().count().max(1) as f64),
        _ => None,
    }
}

fn find_consumers<'a>(
    system: &'a System,
    given: &'a GivenValue<'_>,
) -> impl Iterator<Item = &'a str> {
    let is_from = |from: &crate::model::Port| {
        from.component.value == given.name() && from.port.value == given.effect.output
    };
    let links = system.links.iter().filter(move |link| is_from(&link.from));
    links.map(|link| link.to.component.value.as_str())
}

/// Whether the transition takes the token from the place after a time, whatever happens.
fn is_timeout_of(mission: &Mission, transition: &Transition, place: &Place) -> bool {
    let place = place.name.value.as_str();
    let mut inputs = transition.inputs();
    let is_of_place = inputs.any(|arc| arc.place.value == place);
    let mut others = transition.inputs().filter(|arc| arc.place.value != place);
    let is_plain = transition.on.is_none()
        && transition.when.is_none()
        && transition.not_before.is_none()
        && transition.autonomy == Autonomy::Auto;
    // Of a join, only if the other tokens are there as long as this one. The search for that comes
    // last: it takes a pass over the whole mission.
    is_plain && is_of_place && others.all(|arc| accompanies(mission, place, &arc.place.value))
}
