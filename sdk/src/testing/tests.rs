//! The calls that a test makes, the data that it sends and reads, and what it does wrong.

use super::*;

use crate::messages::{Count, Flag, Number};
use crate::prelude::{Data, Header, Outcome, Parameters};
use crate::{DeclaredEvent, Parameter, Value};

mod outcomes;
mod parameters;
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
