use super::*;
use crate::messages::{Count, Flag, Number};
use crate::prelude::{Data, Header, Outcome, Parameters};
use crate::{Parameter, Value};

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

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Number>("order")?;
        armor.provide::<Count>("count")?;
        armor.provide::<Number>("time")?;
        let parameters = CounterParameters::request(&armor)?;
        armor.synchronize()?;
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
    counter.send("order", &Number { data: -1.0 }).unwrap();
    assert_eq!(counter.state(), RunState::Failed);
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
