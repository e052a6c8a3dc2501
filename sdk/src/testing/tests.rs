use super::*;
use armor_wire::control::GivenParameter;

use crate::messages::{Count, Flag, Number};
use crate::prelude::{Data, Events, Header, Outcome, Parameters};
use crate::{DeclaredEvent, Parameter, Value};

mod refusals;

const TICK: Duration = Duration::from_millis(100);

#[derive(Parameters)]
struct CounterParameters {
    /// added at each tick
    #[parameter(default = 1, range = 1.0..=100.0, live)]
    step: u64,
    /// done from here on
    #[parameter(default = 1000)]
    end: u64,
}

/// Adds its step at each tick, sends the time, and does what `order` asks for.
struct Counter {
    armor: Armor,
    parameters: CounterParameters,
    count: u64,
}

impl Component for Counter {
    const KIND: &'static str = "counter";
    const SUMMARY: &'static str = "Counts.";
    const PARAMETERS: &'static [Parameter] = CounterParameters::DECLARED;
    const EVENTS: &'static [DeclaredEvent] = &[DeclaredEvent::new("ordered")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Number>("order")?;
        armor.provide::<Count>("count")?;
        armor.provide::<Number>("time")?;
        let parameters = CounterParameters::request(&armor)?;
        Ok(Self { armor, parameters, count: 0 })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        assert_eq!((header.data(), header.lost), ("test.order", 0));
        let Number { data: order } = data.decode()?;
        if order < 0.0 { Err("an order is not negative".into()) } else { Ok(()) }
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => self.count = 0,
            Call::Stopping => self.armor.send_data("count", &Count { count: 0 }).map(drop)?,
            Call::Data => return Ok(Outcome::event("ordered", 1.0)),
            Call::Tick => {
                self.count += self.parameters.step;
                self.armor.send_data("count", &Count { count: self.count })?;
                self.armor.send_data("time", &Number { data: self.armor.timestamp() })?;
                if self.count >= self.parameters.end {
                    return Ok(Outcome::Done);
                }
            }
        }
        Ok(Outcome::CarryOn)
    }
}

fn counter(parameters: &[(&str, &str)]) -> TestedComponent {
    TestedComponent::build::<Counter>(parameters).expect("it is built")
}

fn counts(component: &TestedComponent) -> Vec<u64> {
    let counts = component.outputs::<Count>("count").expect("an output of that type");
    counts.iter().map(|count| count.count).collect()
}

#[test]
fn calls_follow_the_test_and_time_passes_only_there() {
    let mut counter = counter(&[("step", "2"), ("end", "6")]);
    assert_eq!(counter.state(), RunState::Frozen);
    counter.start().unwrap();
    for _ in 0..3 {
        counter.tick_after(TICK).unwrap();
    }
    assert_eq!(counts(&counter), [2, 4, 6]);
    assert_eq!(counter.reports(), [ReportKind::Done]);
    let time = counter.last_output::<Number>("time").unwrap().data;
    assert_eq!((time, counter.timestamp()), (START_S + 0.3, START_S + 0.3));
    let error = counter.tick_after(TICK).unwrap_err().to_string();
    assert_eq!(error, "`counter` gets no calls: it has reported that it is done");
    counter.stop().unwrap();
    counter.start().unwrap();
    counter.tick_after(TICK).unwrap();
    assert_eq!(counts(&counter), [2, 4, 6, 0, 2], "it was stopped and started again");
}

#[test]
fn data_reach_the_component_and_a_fault_is_a_report() {
    let mut counter = counter(&[]);
    let order = Number { data: 1.0 };
    let error = counter.send("order", &order).unwrap_err().to_string();
    assert_eq!(error, "`counter` gets no calls: it is frozen; start it first");
    counter.start().unwrap();
    counter.send("order", &order).unwrap();
    assert_eq!(counter.reports(), []);
    counter.execute_on_data();
    counter.send("order", &order).unwrap();
    assert_eq!(counter.reports(), [ReportKind::Event { name: "ordered".into(), value: 1.0 }]);
    let error = counter.send("order", &Number { data: -1.0 }).unwrap_err();
    let expected = "`counter` has failed: an order is not negative";
    assert_eq!((error.to_string(), format!("{error:?}")), (expected.into(), expected.into()));
    assert_eq!(counter.state(), RunState::Failed);
    let reason = "an order is not negative".to_owned();
    assert_eq!(counter.reports().last(), Some(&ReportKind::Failed { reason }));
    let error = counter.last_output::<Count>("count").unwrap_err().to_string();
    let expected = "nothing has been published on output `count`: it has failed: an order is not \
                    negative";
    assert_eq!(error, expected);
    let error = counter.send("order", &order).unwrap_err().to_string();
    assert_eq!(error, "`counter` gets no calls: it has failed: an order is not negative");
}

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

#[test]
fn what_a_test_does_wrong_is_named() {
    let error = |parameters| {
        let built = TestedComponent::build::<Counter>(parameters);
        built.map(|_| ()).unwrap_err().to_string()
    };
    let unknown = error(&[("steps", "2")]);
    assert!(unknown.contains("`counter` cannot be built: parameter `steps`"), "{unknown}");
    assert!(unknown.ends_with("only: step, end"), "{unknown}");
    let wrong = error(&[("step", "many")]);
    assert!(wrong.contains("`many` is not a whole number (the test)"), "{wrong}");
    let twice = error(&[("step", "2"), ("step", "3")]);
    assert!(twice.ends_with("parameter `step`: the test gives it twice"), "{twice}");
    let mut counter = counter(&[]);
    counter.start().unwrap();
    let again = counter.start().unwrap_err().to_string();
    assert!(again.contains("it is active already"), "{again}");
    let flag = Flag { data: true };
    for (error, expected) in [
        (
            counter.send("orders", &flag).unwrap_err(),
            "`counter` has no input `orders`, only: order",
        ),
        (
            counter.send("order", &flag).unwrap_err(),
            "input `order` is declared as Number, but the test uses it as Flag",
        ),
        (
            counter.outputs::<Count>("counts").unwrap_err(),
            "`counter` has no output `counts`, only: count, time",
        ),
        (
            counter.outputs::<Flag>("count").unwrap_err(),
            "output `count` is declared as Count, but the test uses it as Flag",
        ),
        (
            counter.last_output::<Count>("count").unwrap_err(),
            "nothing has been published on output `count`",
        ),
    ] {
        assert_eq!(error.to_string(), expected);
    }
}

/// Declares a parameter that it does not request, and has no ports.
struct Unaware;

impl Component for Unaware {
    const KIND: &'static str = "unaware";
    const SUMMARY: &'static str = "Does not look at its parameter.";
    const PARAMETERS: &'static [Parameter] = &[Parameter::integer("step").default("1")];

    fn new(_: Armor) -> Result<Self, Fault> {
        Ok(Self)
    }
}

#[test]
fn a_parameter_that_a_test_gives_in_vain_is_named() {
    let built = TestedComponent::build::<Unaware>(&[("step", "2")]);
    let error = built.map(|_| ()).unwrap_err().to_string();
    let expected = "`unaware` cannot be built: parameter `step`: the test gives it, but the \
                    component does not request it; call get_parameter(\"step\") in `new`";
    assert_eq!(error, expected);
    let mut unaware = TestedComponent::build::<Unaware>(&[]).expect("its default is fine");
    unaware.start().unwrap();
    let error = unaware.send("order", &Flag { data: true }).unwrap_err().to_string();
    assert_eq!(error, "`unaware` has no input `order`; it has none");
}

/// Returns what it was built with from its last call.
struct Stopping<const N: usize>;

impl<const N: usize> Component for Stopping<N> {
    const KIND: &'static str = "stopping";
    const SUMMARY: &'static str = "Cannot brake.";
    const EVENTS: &'static [DeclaredEvent] = &[DeclaredEvent::new("slid")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        if N == 4 {
            armor.send_data("out", &Flag { data: true })?;
        }
        armor.provide::<Flag>("out")?;
        armor.set_non_controllable()?;
        Ok(Self)
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match (call, N) {
            (Call::Stopping, 0) => Ok(Outcome::Failed("could not brake".into())),
            (Call::Stopping, 1) => Err("could not brake".into()),
            (Call::Stopping, 2) => Ok(Outcome::event("slid", 0.5)),
            (Call::Stopping, 3) => Ok(Outcome::Done),
            _ => Ok(Outcome::CarryOn),
        }
    }
}

#[test]
fn what_the_last_call_returns_is_reported() {
    fn stop<const N: usize>() -> TestedComponent {
        let mut component = TestedComponent::build::<Stopping<N>>(&[]).expect("it is built");
        component.start().unwrap();
        let stopped = component.stop().map_err(|error| error.to_string());
        let fails = Err("`stopping` has failed: could not brake".to_owned());
        assert_eq!(stopped, if N < 2 { fails } else { Ok(()) });
        assert_eq!(component.state(), RunState::Frozen);
        component
    }
    let failed = [ReportKind::Failed { reason: "could not brake".into() }];
    for mut component in [stop::<0>(), stop::<1>()] {
        assert_eq!(component.reports(), failed);
        let error = |component: &TestedComponent| {
            component.participant.compose_status(None, 0.0).last_error
        };
        assert_eq!(error(&component), "could not brake", "as `armor ps` shows it");
        component.start().unwrap();
        assert_eq!(error(&component), "", "another activation begins");
    }
    assert_eq!(stop::<2>().reports(), [ReportKind::Event { name: "slid".into(), value: 0.5 }]);
    assert_eq!(stop::<3>().reports(), []);
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

/// Is done, although it declares that it never is.
struct Endless;

impl Component for Endless {
    const KIND: &'static str = "endless";
    const SUMMARY: &'static str = "Ends.";
    const REPORTS_DONE: bool = false;
    const STALE_AFTER: &'static [(&'static str, &'static str)] = &[("order", "0.5s")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<crate::Optional<Number>>("order")?;
        Ok(Self)
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        Ok(Outcome::Done)
    }
}

#[test]
fn a_component_that_declares_that_it_is_never_done_fails_if_it_is() {
    let mut component = TestedComponent::build::<Endless>(&[]).expect("it is built");
    let why = component.start().expect_err("it is done").to_string();
    assert!(why.contains("declares `REPORTS_DONE` as false; remove that constant"), "{why}");
    assert_eq!(component.state(), RunState::Failed);
    let manifest = crate::manifest_of::<Endless>().expect("a manifest");
    assert!(!manifest.reports_done);
    assert_eq!(manifest.common_reports(), ["failed"]);
    assert_eq!(manifest.stale_after_s(&manifest.inputs[0], |_| None), Some(0.5));
}

/// Reports an event of an enum, and has forgotten its `EVENTS`.
struct Forgetful;

#[derive(Events)]
enum ForgetfulEvent {
    Lap,
}

impl Component for Forgetful {
    const KIND: &'static str = "forgetful";
    const SUMMARY: &'static str = "Declares nothing.";

    fn new(_: Armor) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        Ok(ForgetfulEvent::Lap.into())
    }
}

#[test]
fn an_event_without_the_constant_fails_and_names_the_constant() {
    let manifest = crate::manifest_of::<Forgetful>().unwrap();
    assert_eq!(manifest.events, Some(Vec::new()), "it reports none");
    let mut component = TestedComponent::build::<Forgetful>(&[]).expect("it is built");
    component.start().expect_err("it fails");
    let reports = component.reports();
    let [ReportKind::Failed { reason }] = reports else { panic!("{reports:?}") };
    for part in ["the event `lap` is not declared", "add `const EVENTS"] {
        assert!(reason.contains(part), "{reason}");
    }
}

#[test]
fn the_manifest_says_that_no_mission_may_freeze_it() {
    assert!(crate::manifest_of::<Counter>().unwrap().controllable);
    assert!(!crate::manifest_of::<Stopping<0>>().unwrap().controllable);
}

#[test]
fn what_is_sent_in_the_constructor_must_be_declared_before() {
    let Err(error) = TestedComponent::build::<Stopping<4>>(&[]) else { panic!("it is built") };
    let expected = "`out` is not declared yet: in `new`, call `provide` for it before `send_data`";
    assert!(error.to_string().ends_with(expected), "{error}");
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

/// Starts a thread of its own, which panics on demand.
struct Threaded(std::sync::mpsc::Sender<()>, Option<std::thread::JoinHandle<()>>);

impl Component for Threaded {
    const KIND: &'static str = "threaded";
    const SUMMARY: &'static str = "Reads a sensor on a thread.";

    fn new(_: Armor) -> Result<Self, Fault> {
        let (sender, orders) = std::sync::mpsc::channel();
        let reader = std::thread::Builder::new().name("reader".into());
        let reader = reader.spawn(move || {
            if orders.recv().is_ok() {
                panic!("the sensor is silent");
            }
        })?;
        Ok(Self(sender, Some(reader)))
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Tick {
            self.0.send(())?;
            let ended = self.1.take().map(std::thread::JoinHandle::join);
            assert!(ended.is_some_and(|ended| ended.is_err()), "it panics");
        }
        Ok(Outcome::CarryOn)
    }
}

#[test]
fn a_panic_of_a_thread_is_a_failure_of_the_component_that_has_started_it() {
    let build = || TestedComponent::build::<Threaded>(&[]).expect("it is built");
    let (mut one, mut other) = (build(), build());
    one.start().unwrap();
    other.start().unwrap();
    let error = one.tick_after(TICK).unwrap_err().to_string();
    let expected = "`threaded` has failed: the thread `reader` panicked at ";
    assert!(error.starts_with(expected) && error.ends_with(": the sensor is silent"), "{error}");
    assert_eq!(one.state(), RunState::Failed);
    assert_eq!(one.reports().len(), 1, "{:?}", one.reports());
    let error = one.tick_after(TICK).unwrap_err().to_string();
    assert!(error.contains("gets no calls: it has failed: the thread `reader`"), "{error}");
    // A thread of the test itself is none of the component's.
    let own = std::thread::spawn(|| panic!("of the test"));
    assert!(own.join().is_err());
    other.stop().unwrap();
    assert_eq!(other.reports(), [], "its own thread works");
}
