//! Tests of inputs with several sources.

use super::*;
use crate::DataError;
use crate::messages::Number;
use crate::prelude::{Data, Header, Many, Outcome};

/// Publishes the sum of the last number of each source, and knows the histories.
struct Adder {
    armor: Armor,
    last: BTreeMap<String, f64>,
}

impl Component for Adder {
    const KIND: &'static str = "adder";
    const SUMMARY: &'static str = "Adds numbers.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Many<Number>>("parts")?;
        armor.subscribe::<Number>("factor")?;
        armor.provide::<Number>("sum")?;
        armor.provide::<Number>("before")?;
        Ok(Self { armor, last: BTreeMap::new() })
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        if header.id() == "factor" {
            let error = data.history("parts").expect_err("which one?");
            assert!(matches!(error, DataError::SeveralSources { .. }), "{error}");
            assert!(data.history_from("parts", "c.out").is_err());
            let before = data.history_from("parts", "b.out")?;
            let values = before.iter().map(|past| past.data.decode::<Number>());
            for value in values.collect::<Vec<_>>() {
                self.armor.send_data("before", &value?)?;
            }
            return Ok(());
        }
        let Number { data: value } = data.decode()?;
        let own = data.history("parts")?;
        assert!(own.iter().all(|past| past.header.data() == header.data()), "of one source");
        assert_eq!(own.len() as u64, header.sequence + 1);
        self.last.insert(header.data().into(), value);
        let sum = Number { data: self.last.values().sum() };
        self.armor.send_data("sum", &sum)?;
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.last.clear();
            let fed = self.armor.subscribed_data("parts").unwrap_or_default();
            self.last.extend(fed.split(' ').map(|source| (source.into(), 0.0)));
        }
        Ok(Outcome::CarryOn)
    }
}

fn number(data: f64) -> Number {
    Number { data }
}

#[test]
fn the_sources_of_an_input_are_distinguished_by_their_names() {
    let mut adder = TestedComponent::build::<Adder>(&[]).expect("it is built");
    adder.link_from("parts", "a.out").unwrap();
    adder.link_from("parts", "b.out").unwrap();
    adder.link_from("parts", "b.out").unwrap();
    adder.start().unwrap();
    for (source, value) in [("a.out", 1.0), ("b.out", 10.0), ("b.out", 20.0), ("a.out", 2.0)] {
        adder.send_from("parts", source, &number(value)).unwrap();
    }
    assert_eq!(adder.outputs::<Number>("sum").unwrap(), [1.0, 11.0, 21.0, 22.0].map(number));
    adder.send("factor", &number(1.0)).unwrap();
    assert_eq!(adder.outputs::<Number>("before").unwrap(), [20.0, 10.0].map(number));
    let fed = adder.participant.ports.inputs();
    let fed: Vec<_> = fed.iter().filter_map(|port| port.data()).collect();
    assert_eq!(fed, ["a.out", "b.out", "test.factor"]);
}

#[test]
fn a_test_that_names_a_source_that_is_none_is_refused() {
    let mut adder = TestedComponent::build::<Adder>(&[]).expect("it is built");
    adder.start().unwrap();
    adder.send("parts", &number(1.0)).unwrap();
    let refused = |result: Result<(), TestError>| result.expect_err("refused").to_string();
    let error = refused(adder.send_from("parts", "a.out", &number(1.0)));
    assert_eq!(error, "`a.out` does not feed input `parts`; add it with `link_from`");
    let error = refused(adder.link_from("factor", "a.out"));
    let expected = "input `factor` of `adder` takes one source; for several, declare it as `Many<…>` (in Python with many=True, in C and C++ with ARMOR_MANY)";
    assert_eq!(error, expected);
    assert!(refused(adder.link_from("whole", "a.out")).contains("no input `whole`"));
}
