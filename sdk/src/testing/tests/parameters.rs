//! Parameters: which values a component receives, and those that are refused.

use armor_wire::control::GivenParameter;

use super::*;

#[test]
fn live_parameters_change_and_all_others_are_refused() {
    let mut counter = counter(&[]);
    counter.start().unwrap();
    counter.tick_after(TICK).unwrap();
    counter.set_parameter("step", "10").unwrap();
    counter.tick_after(TICK).unwrap();
    assert_eq!(counts(&counter), [1, 11]);
    for (name, text, why) in [
        ("step", "0", "parameter `step`: `0` is out of range, 1 to 100"),
        ("end", "7", "parameter `end`: it is not live"),
        ("start", "7", "parameter `start`: `counter` declares no such parameter"),
    ] {
        let error = counter.set_parameter(name, text).unwrap_err().to_string();
        assert!(error.starts_with(why), "{error}");
    }
}

/// Requests its parameters and forgets to receive them.
struct Deaf;

impl Component for Deaf {
    const KIND: &'static str = "deaf";
    const SUMMARY: &'static str = "Ignores its file.";
    const PARAMETERS: &'static [Parameter] = CounterParameters::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        CounterParameters::request(&armor)?;
        Ok(Self)
    }
}

#[test]
fn parameters_that_nothing_receives_are_a_failure() {
    let deaf = TestedComponent::build::<Deaf>(&[]).expect("it is built");
    assert_eq!(deaf.state(), RunState::Failed);
    let expected = "parameter `step`: its value has arrived, but `deaf` does not implement \
                    `parameter_received`; implement it, with";
    let is_named = |report: &ReportKind| matches!(report, ReportKind::Failed { reason } if reason.starts_with(expected));
    assert!(deaf.reports().iter().any(is_named), "{:?}", deaf.reports());
}

#[derive(Parameters)]
struct NarrowParameters {
    /// its range is wider than its type
    #[parameter(default = 1, range = 0.0..=300.0)]
    width: u8,
}

struct Narrow(NarrowParameters);

impl Component for Narrow {
    const KIND: &'static str = "narrow";
    const SUMMARY: &'static str = "Has a small type.";
    const PARAMETERS: &'static [Parameter] = NarrowParameters::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        Ok(Self(NarrowParameters::request(&armor)?))
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.0.set(name, value)?)
    }
}

#[test]
fn a_value_that_its_type_cannot_hold_is_named_once() {
    let narrow = TestedComponent::build::<Narrow>(&[("width", "256")]).expect("it is built");
    let reason = "parameter `width`: `256` is out of range for u8, 0 to 255".to_owned();
    assert_eq!(narrow.reports(), [ReportKind::Failed { reason }]);
}

/// Computes with its parameters in its constructor.
struct Prepared {
    armor: Armor,
    parameters: CounterParameters,
    sum: u64,
}

impl Component for Prepared {
    const KIND: &'static str = "prepared";
    const SUMMARY: &'static str = "Adds its parameters.";
    const PARAMETERS: &'static [Parameter] = CounterParameters::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Count>("sum")?;
        let parameters = CounterParameters::request(&armor)?;
        let sum = parameters.step + parameters.end;
        Ok(Self { armor, parameters, sum })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.armor.send_data("sum", &Count { count: self.sum })?;
        Ok(Outcome::CarryOn)
    }
}

#[test]
fn the_constructor_has_the_values_of_its_parameters() {
    for (given, sum) in [(vec![("step", "7"), ("end", "90")], 97), (vec![("step", "2")], 1002)] {
        let mut component = TestedComponent::build::<Prepared>(&given).expect("it is built");
        component.start().unwrap();
        assert_eq!(component.last_output::<Count>("sum").unwrap(), Count { count: sum });
    }
    assert!(crate::manifest_of::<Prepared>().is_ok(), "with the defaults");
}

/// Refuses to be fast.
struct Careful(CarefulParameters);

#[derive(Parameters)]
struct CarefulParameters {
    /// how fast
    #[parameter(unit = "m/s", default = "1m/s", range = 0.0..=2.0, live)]
    speed_mps: f64,
}

impl Component for Careful {
    const KIND: &'static str = "careful";
    const SUMMARY: &'static str = "Refuses to be fast.";
    const PARAMETERS: &'static [Parameter] = CarefulParameters::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        Ok(Self(CarefulParameters::request(&armor)?))
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        if value.number()? > 1.5 {
            return Err("the motor cannot go so fast".into());
        }
        Ok(self.0.set(name, value)?)
    }
}

#[test]
fn an_activation_with_a_refused_value_names_it() {
    let why = "parameter `speed`: the motor cannot go so fast (its value: `1.8m/s`)";
    let mut careful = TestedComponent::build::<Careful>(&[("speed", "1.8m/s")]).expect("built");
    let failed = ReportKind::Failed { reason: why.into() };
    assert_eq!(careful.reports(), std::slice::from_ref(&failed));
    let error = careful.start().unwrap_err().to_string();
    assert_eq!(error, format!("`careful` has failed: {why}"));
    assert_eq!(careful.state(), RunState::Failed);
    assert_eq!(careful.reports(), [failed.clone(), failed.clone()]);

    let mut careful = TestedComponent::build::<Careful>(&[]).expect("built");
    let given = |text: &str| GivenParameter {
        name: "speed".into(),
        assigned: Assigned { text: text.into(), base: String::new(), origin: ORIGIN.into() },
    };
    let mut activate = |parameters| {
        careful.activations += 1;
        let activation = careful.activations;
        let order = ActivationOrder { activation, parameters };
        let activated = careful.give_order(LifecycleOrder::Activate(order));
        assert_eq!(activated.is_err(), !careful.component.is_active());
        careful.give_order(LifecycleOrder::Freeze(activation)).expect("it freezes");
        (careful.reports.clone(), careful.participant.compose_status(None, 0.0).last_error)
    };
    let (reports, error) = activate(vec![given("1.8m/s")]);
    assert_eq!(reports, [failed]);
    assert_eq!(error, format!("{why}; {why}; its last good value stays in force"));
    assert_eq!(activate(Vec::new()).1, "", "a good value has arrived");
}

#[test]
fn a_refused_live_value_is_a_problem_until_a_good_one_arrives() {
    let mut careful = TestedComponent::build::<Careful>(&[]).expect("built");
    careful.start().unwrap();
    let refused = careful.set_parameter("speed", "1.6m/s").unwrap_err().to_string();
    let later = std::time::Instant::now() + Duration::from_secs(60);
    let error = |careful: &TestedComponent| careful.participant.reports.current_error(true, later);
    let expected = "parameter `speed`: the motor cannot go so fast (its value: `1.6m/s`); its last \
                    good value stays in force";
    assert_eq!((error(&careful).as_str(), refused.as_str()), (expected, expected));
    assert_eq!(careful.state(), RunState::Active);
    careful.set_parameter("speed", "1.2m/s").unwrap();
    assert_eq!(error(&careful), "");
}
