use super::*;

fn statement(text: &str) -> Statement {
    Claim::parse(text).unwrap_or_else(|error| panic!("{text}: {error}")).statement
}

#[test]
fn every_statement_is_read() {
    let name = |text: &str, start: usize| Name { text: text.into(), at: start..start + text.len() };
    let marked = |text: &str, start| Formula::Marked(name(text, start));
    let minutes = Duration::from_secs(1200);
    for (text, expected) in [
        ("always a", Statement::Always(marked("a", 7))),
        ("never a.b-c", Statement::Never(marked("a.b-c", 6))),
        ("eventually a", Statement::Eventually(marked("a", 11))),
        ("reachable (a)", Statement::Reachable(marked("a", 11))),
        ("always reachable(a)", Statement::AlwaysReachable(marked("a", 17))),
        ("a leads to b", Statement::LeadsTo(marked("a", 0), marked("b", 11))),
        (
            "duration(a) <= 20min",
            Statement::Duration {
                until: marked("a", 9),
                relation: Relation::LessOrEqual,
                limit: minutes,
            },
        ),
        ("fires(t)", Statement::Fires(name("t", 6))),
        ("dead(t)", Statement::Dead(name("t", 5))),
        ("bounded(a)", Statement::Bounded(name("a", 8), None)),
        ("bounded(a) <= 3", Statement::Bounded(name("a", 8), Some(3))),
        ("bounded(a) < 3", Statement::Bounded(name("a", 8), Some(2))),
    ] {
        assert_eq!(statement(text), expected, "{text}");
    }
}

#[test]
fn formulas_bind_as_in_guards_and_words_can_be_names() {
    let shown = |text: &str| match statement(text) {
        Statement::Always(formula) | Statement::Never(formula) => show_formula(&formula),
        Statement::LeadsTo(from, to) => format!("{} ~> {}", show_formula(&from), show_formula(&to)),
        other => panic!("{other:?}"),
    };
    for (text, expected) in [
        ("always a + 1 >= b and not c or active(d)", "((a+1 >= b+0 and not c) or active d)"),
        ("always not (a or b) and true", "(not (a or b) and true)"),
        ("never a+b+b > 1 + 2", "a+b+b+0 > 3"),
        ("leads leads to to", "leads ~> to"),
        ("dead leads to known", "dead ~> known"),
        ("always reachable", "reachable"),
        ("never a-b != 0", "a-b+0 != 0"),
    ] {
        assert_eq!(shown(text), expected, "{text}");
    }
}

fn show_formula(formula: &Formula) -> String {
    let sum = |sum: &Sum| {
        let names = sum.places.iter().map(ToString::to_string);
        names.chain([sum.number.to_string()]).collect::<Vec<_>>().join("+")
    };
    match formula {
        Formula::Truth(truth) => truth.to_string(),
        Formula::Marked(name) => name.to_string(),
        Formula::Active(name) => format!("active {name}"),
        Formula::Compare(left, relation, right) => {
            format!("{} {} {}", sum(left), relation.as_str(), sum(right))
        }
        Formula::Not(inner) => format!("not {}", show_formula(inner)),
        Formula::And(left, right) => {
            format!("({} and {})", show_formula(left), show_formula(right))
        }
        Formula::Or(left, right) => format!("({} or {})", show_formula(left), show_formula(right)),
    }
}

#[test]
fn errors_point_at_the_wrong_piece() {
    for (text, message) in [
        ("[[home]]", "does not specify when"),
        ("[[a and b]]", "does not specify when"),
        ("always [[]]", "ends here"),
        ("always a [[b]]", "not expected"),
        ("reachable(a) [[and]] b", "complete before this"),
        ("reachable[[(]]a", "not closed"),
        ("always a[[)]]", "closes nothing"),
        ("[[active(a)]]", "does not specify when"),
        ("always [[foo]](a)", "nothing called foo"),
        ("never [[reachable]](a)", "not expected here"),
        ("never [[always]] a", "not expected here"),
        ("duration(a) [[==]] 3s", "not expected"),
        ("duration(a) <= [[3]]", "not a time"),
        ("duration(a) <= [[3m]]", "not a time"),
        ("bounded(a) <= [[1.5]]", "not a count"),
        ("bounded(a) < [[0]]", "so many"),
        ("always a < [[1min]]", "not a count"),
        ("always a < b [[<]] c", "chained"),
        ("always 1[[]]", "ends here"),
        ("a leads [[b]]", "not expected"),
        ("always a [[=]] b", "no meaning in a check"),
        ("never [[a..b]]", "not a name"),
        ("never a [['text']]", "not expected"),
    ] {
        let start = text.find("[[").expect("marked");
        let plain = text.replace("[[", "").replace("]]", "");
        let piece = text[start + 2..].split("]]").next().expect("marked");
        let error = Claim::parse(&plain).expect_err(text);
        assert!(error.message.contains(message), "{text}: {error}");
        assert_eq!(&plain[error.at.clone()], piece, "{text}: {error}");
        assert!(!error.remedy.is_empty(), "{text}");
    }
}
