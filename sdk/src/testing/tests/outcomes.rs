//! What a component returns from its calls, and how a failure of it is reported.

use super::*;
use crate::prelude::Events;

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
