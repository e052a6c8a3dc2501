//! The board as a component: messages of several writers in, those of the holder out.

use armor_sdk::prelude::*;

use crate::hold::{ElementHold, HoldPolicy};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct BoardParameters {
    /// priority: the first link in the file whose writer is not silent; newest: the newest stamp
    #[parameter(
        default = "priority",
        choices("priority" = HoldPolicy::Priority, "newest" = HoldPolicy::Newest),
        live
    )]
    policy: HoldPolicy,
    /// a writer that is silent for longer loses its hold
    #[parameter(unit = "s", default = "0.5s", range = 0.01..=3600.0, live)]
    timeout_s: f64,
}

/// The age of an element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
pub struct ElementAge {
    /// Time since the stamp of its value.
    #[message(unit = "s")]
    pub age: f64,
}

/// Passes on the messages of the writer that holds the element.
pub struct Board {
    armor: Armor,
    parameters: BoardParameters,
    /// The data that feed it, those with the highest priority first.
    writers: Vec<String>,
    hold: ElementHold,
    /// When it was activated.
    started_s: f64,
    /// The holder that was published last.
    published: Option<usize>,
    /// The holder at the last tick.
    reported: Option<usize>,
}

/// What it reports to the mission, at its next tick.
#[derive(Debug, Events)]
enum BoardEvent {
    /// another writer holds the element; the value is its place among the links, from 1
    Changed(u32),
    /// no writer holds the element any more
    Lost,
}

impl Board {
    fn publish_holder(&mut self) -> Result<(), Fault> {
        self.published = self.hold.holder();
        let data = self.published.map(|holder| self.writers[holder].clone()).unwrap_or_default();
        self.armor.send_data("holder", &Text { data })?;
        Ok(())
    }

    /// Begins without a holder.
    fn start(&mut self) -> Result<(), Fault> {
        let fed = self.armor.subscribed_data("writers").unwrap_or_default();
        self.writers = fed.split_whitespace().map(str::to_owned).collect();
        let parameters = &self.parameters;
        self.hold = ElementHold::new(self.writers.len(), parameters.policy, parameters.timeout_s);
        self.reported = None;
        self.publish_holder()
    }

    /// The change of the holder since the last tick.
    fn next_event(&mut self) -> Outcome {
        let holder = self.hold.holder();
        if std::mem::replace(&mut self.reported, holder) == holder {
            return Outcome::CarryOn;
        }
        match holder {
            Some(holder) => BoardEvent::Changed(holder as u32 + 1).into(),
            None => BoardEvent::Lost.into(),
        }
    }
}

impl Component for Board {
    const KIND: &'static str = "board";
    const SUMMARY: &'static str =
        "Several writers of one element: passes on what its holder sends.";
    const REPORTS_DONE: bool = false;
    const PARAMETERS: &'static [Parameter] = BoardParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("writers", "the element, of one type; the order of the links is that of priority"),
        ("element", "each message of the holder, with its bytes and stamp unchanged"),
        ("latest", "the same for late subscribers: they get the last one immediately"),
        ("holder", "the data that hold the element, such as planner.velocity; empty: none"),
        ("age", "time since the stamp of the element, or since the activation while there is none"),
    ];

    const EVENTS: &'static [DeclaredEvent] = BoardEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Many<AnyMessage>>("writers")?;
        armor.provide::<AnyMessage>("element")?;
        armor.provide::<Latched<AnyMessage>>("latest")?;
        armor.provide::<Latched<Text>>("holder")?;
        armor.provide::<ElementAge>("age")?;
        let parameters = BoardParameters::request(&armor)?;
        let hold = ElementHold::new(0, parameters.policy, parameters.timeout_s);
        let writers = Vec::new();
        let (started_s, published, reported) = (0.0, None, None);
        Ok(Self { armor, parameters, writers, hold, started_s, published, reported })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        self.hold.set_rules(self.parameters.policy, self.parameters.timeout_s);
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let is_it = |writer: &String| writer == header.data();
        let Some(writer) = self.writers.iter().position(is_it) else { return Ok(()) };
        if !self.hold.receive(writer, header.stamp_s, self.armor.timestamp()) {
            return Ok(());
        }
        if self.published != self.hold.holder() {
            // Before the element, so that a reader of both knows whose value it gets.
            self.publish_holder()?;
        }
        let message = AnyMessage::received(header, data)?;
        self.armor.send_data("element", &message)?;
        self.armor.send_data("latest", &message)?;
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let now_s = self.armor.timestamp();
        match call {
            Call::Started => {
                self.started_s = now_s;
                self.start()?;
            }
            Call::Stopping => {
                self.armor.send_data("holder", &Text::default())?;
                return Ok(Outcome::CarryOn);
            }
            Call::Tick | Call::Data => {
                self.hold.release_silent(now_s);
                if self.published != self.hold.holder() {
                    self.publish_holder()?;
                }
                // Without a message so far there has been none for as long as it is active.
                let age = self.hold.age_s(now_s).unwrap_or(now_s - self.started_s);
                self.armor.send_data("age", &ElementAge { age })?;
            }
        }
        Ok(self.next_event())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_sdk::testing::{ReportKind, TestError, TestedComponent};

    use super::*;

    const TICK: Duration = Duration::from_millis(100);

    fn board(parameters: &[(&str, &str)]) -> Result<TestedComponent, TestError> {
        let mut board = TestedComponent::build::<Board>(parameters)?;
        board.link_from("writers", "joystick.velocity")?;
        board.link_from("writers", "planner.velocity")?;
        board.start()?;
        Ok(board)
    }

    fn speed(x: f64) -> Twist {
        Twist { linear: Vector3 { x, ..Vector3::default() }, ..Twist::default() }
    }

    fn holders(board: &TestedComponent) -> Result<Vec<String>, TestError> {
        Ok(board.outputs::<Text>("holder")?.into_iter().map(|text| text.data).collect())
    }

    fn event(name: &str, value: f64) -> ReportKind {
        ReportKind::Event { name: name.into(), value }
    }

    #[test]
    fn without_a_rate_data_are_passed_on_and_the_holder_changes() -> Result<(), TestError> {
        let mut board = board(&[("timeout", "150ms")])?;
        let (joystick, planner) = ("joystick.velocity", "planner.velocity");
        board.send_from("writers", joystick, &speed(0.1))?;
        for x in [0.2, 0.3] {
            board.pass_time(TICK);
            board.send_from("writers", planner, &speed(x))?;
        }
        assert_eq!(board.outputs::<Twist>("element")?, [0.1, 0.3].map(speed));
        assert_eq!(holders(&board)?, ["", joystick, planner]);
        assert!(!armor_sdk::manifest_of::<Board>().expect("a manifest").needs_rate);
        Ok(())
    }

    #[test]
    fn without_a_writer_the_age_grows_from_the_activation_on() -> Result<(), TestError> {
        let mut board = board(&[])?;
        for expected in [0.1, 0.2, 0.3] {
            board.tick_after(TICK)?;
            let age = board.last_output::<ElementAge>("age")?.age;
            assert!((age - expected).abs() < 1e-9, "{age}");
        }
        Ok(())
    }

    #[test]
    fn the_joystick_displaces_the_planner_until_it_is_silent() -> Result<(), TestError> {
        let mut board = board(&[("timeout", "250ms")])?;
        let (joystick, planner) = ("joystick.velocity", "planner.velocity");
        board.send_from("writers", planner, &speed(0.1))?;
        board.tick_after(TICK)?;
        board.send_from("writers", joystick, &speed(0.2))?;
        board.send_from("writers", planner, &speed(0.3))?;
        board.tick_after(TICK)?;
        assert_eq!(board.outputs::<Twist>("element")?, [speed(0.1), speed(0.2)]);
        for x in [0.4, 0.5] {
            board.tick_after(TICK)?;
            board.send_from("writers", planner, &speed(x))?;
        }
        assert_eq!(board.outputs::<Twist>("element")?, [0.1, 0.2, 0.5].map(speed));
        assert_eq!(board.outputs::<Twist>("latest")?, board.outputs::<Twist>("element")?);
        for _ in 0..3 {
            board.tick_after(TICK)?;
        }
        assert_eq!(holders(&board)?, ["", planner, joystick, planner, ""]);
        let events = [("changed", 2.0), ("changed", 1.0), ("changed", 2.0), ("lost", 1.0)];
        assert_eq!(board.reports(), events.map(|(name, value)| event(name, value)));
        let age = board.last_output::<ElementAge>("age")?.age;
        assert!((age - 0.3).abs() < 1e-9, "{age}");
        Ok(())
    }

    #[test]
    fn the_newest_message_is_the_element_and_its_writer_the_holder() -> Result<(), TestError> {
        let mut board = board(&[("policy", "newest")])?;
        for (writer, x) in [("planner", 0.1), ("joystick", 0.2), ("planner", 0.3)] {
            board.send_from("writers", &format!("{writer}.velocity"), &speed(x))?;
            board.pass_time(TICK);
        }
        assert_eq!(board.outputs::<Twist>("element")?, [0.1, 0.2, 0.3].map(speed));
        let (joystick, planner) = ("joystick.velocity", "planner.velocity");
        assert_eq!(holders(&board)?, ["", planner, joystick, planner]);
        board.tick_after(TICK)?;
        assert_eq!(board.reports(), [event("changed", 2.0)], "one for all changes within a tick");
        Ok(())
    }

    #[test]
    fn a_second_type_is_refused_with_both_names() -> Result<(), TestError> {
        let mut board = board(&[])?;
        let error = board.outputs::<Twist>("element").expect_err("no type yet").to_string();
        assert!(error.contains("output `element` is declared as Any"), "{error}");
        board.send_from("writers", "planner.velocity", &speed(0.1))?;
        let refused = board.send_from("writers", "joystick.velocity", &Number { data: 1.0 });
        let error = refused.expect_err("another type").to_string();
        let expected = "`joystick.velocity` is a Number, which input `writers` does not take: it takes \
                        what `planner.velocity` is, a Twist, which was linked first";
        assert!(error.starts_with(expected), "{error}");
        board.send_from("writers", "joystick.velocity", &speed(0.2))?;
        assert_eq!(board.last_output::<Twist>("element")?, speed(0.2));
        Ok(())
    }

    #[test]
    fn each_activation_begins_without_a_holder() -> Result<(), TestError> {
        let mut board = board(&[])?;
        board.send_from("writers", "joystick.velocity", &speed(0.1))?;
        board.stop()?;
        board.start()?;
        board.send_from("writers", "planner.velocity", &speed(0.2))?;
        let names = ["", "joystick.velocity", "", "", "planner.velocity"];
        assert_eq!(holders(&board)?, names);
        board.set_parameter("policy", "newest")?;
        board.send_from("writers", "joystick.velocity", &speed(0.3))?;
        board.send_from("writers", "planner.velocity", &speed(0.4))?;
        assert_eq!(board.outputs::<Twist>("element")?.len(), 4);
        Ok(())
    }
}
