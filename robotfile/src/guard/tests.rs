use proptest::prelude::*;

use super::node::{GuardNode, GuardNodeKind};
use super::*;

fn guard(text: &str) -> Guard {
    Guard::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// Whether it holds when `a` is 1, `b` is 2, `yes` is true, `mode` is 'On', and `none` not known.
fn check(text: &str, expected: Option<bool>) {
    let guard = guard(text);
    let value = |name: &Name| match name.as_str() {
        "a" | "p.out.a" => Some(Scalar::Number(1.0)),
        "b" => Some(Scalar::Number(2.0)),
        "nan" => Some(Scalar::Number(f64::NAN)),
        "huge" => Some(Scalar::Number(f64::INFINITY)),
        "yes" => Some(Scalar::Flag(true)),
        "mode" => Some(Scalar::Text("On".into())),
        _ => None,
    };
    let values: Vec<_> = guard.names().iter().map(value).collect();
    assert_eq!(guard.holds(&values), expected, "{text}");
}

#[test]
fn tighter_operators_are_evaluated_first() {
    // Each pair is the same tree; the second text has explicit parentheses.
    for (text, same) in [
        ("a < 1 or b < 2 and yes", "(a < 1) or ((b < 2) and yes)"),
        ("not a < 1 and yes", "(not (a < 1)) and yes"),
        ("not not yes", "not (not yes)"),
        ("a + b * a < b", "(a + (b * a)) < b"),
        ("a - b - a == b", "((a - b) - a) == b"),
        ("a / b * a == b", "((a / b) * a) == b"),
        ("-a + b < -b * a", "((-a) + b) < ((-b) * a)"),
        ("- - a < b", "(-(-a)) < b"),
        ("a - -b < 1", "(a - (-b)) < 1"),
        ("yes or yes or yes", "(yes or yes) or yes"),
        ("6m / s < 1", "((6m) / (s)) < 1"),
        ("(yes == (a < b)) == true", "((yes) == (a < b)) == true"),
    ] {
        assert_eq!(guard(text), guard(same), "{text}");
    }
    assert_ne!(guard("a - (b - a) == b"), guard("a - b - a == b"));
    assert_ne!(guard("not (a < 1 and yes)"), guard("not a < 1 and yes"));
}

#[test]
fn numbers_are_in_si_whatever_their_unit() {
    for text in [
        "10min == 600s",
        "50% == 0.5",
        "180deg > 3.14rad",
        "36km/h == 10m/s",
        "2e3mm == 2m",
        "1E-2 < 0.02",
        "30%<0.31",
        "(1 + 2) * 3 == 9",
        "1 / 4 == 0.25",
        "-2 < -1",
    ] {
        check(text, Some(true));
    }
}

#[test]
fn three_values() {
    for (text, expected) in [
        ("a < b", Some(true)),
        ("a >= b", Some(false)),
        ("p.out.a == a", Some(true)),
        ("mode == 'On' and mode != 'Off'", Some(true)),
        ("yes == true", Some(true)),
        ("none < 1", None),
        ("not (none < 1)", None),
        ("none < 1 and a > b", Some(false)),
        ("a > b and none < 1", Some(false)),
        ("none < 1 and a < b", None),
        ("none < 1 or a < b", Some(true)),
        ("a < b or none < 1", Some(true)),
        ("none < 1 or a > b", None),
        ("known(none)", Some(false)),
        ("known(a) and not known(none)", Some(true)),
        // NaN is an unknown value, and so is a result that cannot be computed.
        ("nan < 1 or known(nan)", None),
        ("a / 0 > 1", None),
        ("huge - huge < 1", None),
        ("huge > 1", Some(true)),
        // Types that do not fit: unknown here; the check reports them before anything runs.
        ("mode < 1", None),
        ("a", None),
        ("yes == 1", None),
    ] {
        check(text, expected);
    }
}

#[test]
fn errors_point_at_the_piece_and_name_the_expected() {
    for (text, piece, remedy) in [
        ("", "", "is expected"),
        ("a <", "", "a number with its unit"),
        ("a < 1 b", "b", "an operator"),
        ("a && b", "&&", "write and"),
        ("!a", "!", "write not"),
        ("a = 1", "=", "=="),
        ("a < b < c", "<", "a < b and b < c"),
        ("(a < 1", "(", "write )"),
        ("a < 1)", ")", "remove"),
        ("a < 5 parsec", "parsec", "an operator"),
        ("a < 5parsec", "parsec", "known are"),
        ("a < 5mim", "mim", "did you mean min?"),
        ("a < 1e999", "1e999", "smaller"),
        ("a < .5", ".", "a digit before the point"),
        ("mode == 'On", "'On", "single quote"),
        ("mode == \"On\"", "\"", "single quotes"),
        ("power. < 1", "power.", "component.output"),
        ("power..level < 1", "power..level", "component.output"),
        ("known a", "a", "known(battery)"),
        ("a and", "", "is expected"),
        ("a + not b", "not", "parentheses"),
        ("a < ½", "½", "remove"),
    ] {
        let error = Guard::parse(text).expect_err(text);
        assert_eq!(&text[error.at.clone()], piece, "{text}: {error}");
        assert!(error.remedy.contains(remedy), "{text}: {error}");
    }
}

#[test]
fn depth_and_length_have_limits() {
    let nested = |depth: usize| format!("{}yes{}", "(".repeat(depth), ")".repeat(depth));
    assert!(Guard::parse(&nested(MAX_DEPTH)).is_ok());
    assert!(Guard::parse(&nested(MAX_DEPTH + 1)).is_err());
    assert!(Guard::parse(&"not ".repeat(MAX_DEPTH + 1)).is_err());
    assert!(Guard::parse(&"-".repeat(MAX_LEN)).is_err());
    let chain = |len: usize| format!("0{} < 1", "+1".repeat(len));
    assert_eq!(guard(&chain(500)).holds(&[]), Some(false), "the longest chain is no danger");
    assert!(Guard::parse(&chain(MAX_LEN)).is_err());
}

#[test]
fn names_are_listed_once_with_their_parts() {
    let guard = guard("battery-2 < 1 and power.state.cell.level > battery-2 or power.state");
    let names: Vec<_> = guard.names().iter().map(Name::as_str).collect();
    assert_eq!(names, ["battery-2", "power.state.cell.level", "power.state"]);
    let [variable, field, whole] = guard.names() else { panic!("three") };
    assert_eq!(variable.data(), None);
    assert_eq!((field.data(), field.fields()), (Some("power.state"), vec!["cell", "level"]));
    assert_eq!((whole.data(), whole.fields()), (Some("power.state"), vec![]));
    assert_eq!((field.part_at(1), field.part_at(3)), (24..29, 35..40));
}

fn tree() -> impl Strategy<Value = String> {
    let unit = prop::sample::select(vec!["", "s", "min", "%", "m/s", "deg"]);
    let number = (0_u32..2000, -8_i32..9, unit)
        .prop_map(|(value, power, unit)| format!("{value}e{power}{unit}"));
    let name = prop::sample::select(vec!["a", "battery-2", "p.out", "p.out.x", "known(a)", "'t'"]);
    let leaf = prop_oneof![number, name.prop_map(str::to_owned), Just("true".to_owned())];
    let operator = prop::sample::select(vec![
        "or", "and", "<", "<=", ">", ">=", "==", "!=", "+", "-", "*", "/",
    ]);
    leaf.prop_recursive(5, 24, 2, move |inner| {
        prop_oneof![
            inner.clone().prop_map(|inner| format!("(not {inner})")),
            inner.clone().prop_map(|inner| format!("(- {inner})")),
            (inner.clone(), operator.clone(), inner)
                .prop_map(|(left, operator, right)| format!("({left} {operator} {right})")),
        ]
    })
}

proptest! {
    #[test]
    fn printed_guards_read_back_equal(text in tree()) {
        let read = guard(&text);
        let printed = read.to_string();
        let parentheses = |text: &str| text.matches('(').count();
        prop_assert!(parentheses(&printed) <= parentheses(&text), "{printed}");
        let again = guard(&printed);
        prop_assert_eq!(again.to_string(), printed);
        // Not only the text: each part of the tree is where it was.
        prop_assert_eq!(shape(&again.root), shape(&read.root), "{}", text);
    }

    #[test]
    fn no_text_brings_a_panic(text in "\\PC{0,60}") {
        judged(&text);
    }

    #[test]
    fn no_row_of_our_own_words_does(words in prop::collection::vec(
        prop::sample::select(vec!["(", ")", "not", "and", "or", "<", "==", "-", "+", "/", "a",
            "p.o", "1", "5m", "30%", "'t'", "true", "known", "0"]), 0..40)) {
        judged(&words.join(" "));
    }
}

/// Reads it and looks at it in every way there is.
fn judged(text: &str) {
    match Guard::parse(text) {
        Ok(guard) => {
            let is = |index: usize| match index % 4 {
                0 => Type::Any,
                1 => Type::Truth,
                2 => Type::Text(Some(vec!["On".into()])),
                _ => Type::Number(Measure::Bare),
            };
            let meanings: Vec<_> = (0..guard.names().len())
                .map(|index| Meaning {
                    is: is(index),
                    within: (0.0, 1.0),
                    domain: "0 to 1".into(),
                    is_measured: true,
                })
                .collect();
            for problem in judge(&guard, text, &meanings) {
                assert!(text.get(problem.at).is_some(), "{text}");
            }
            guard.holds(&vec![Some(Scalar::Number(1.0)); guard.names().len()]);
            guard.holds(&[]);
        }
        Err(error) => assert!(text.get(error.at).is_some(), "{text}"),
    }
}

/// The tree with all its parentheses.
fn shape(node: &GuardNode) -> String {
    match &node.kind {
        GuardNodeKind::Number(value, unit) => {
            format!("{value:?}{}", unit.map_or("", |unit| unit.name))
        }
        GuardNodeKind::Truth(truth) => truth.to_string(),
        GuardNodeKind::Text(text) => format!("'{text}'"),
        GuardNodeKind::Name(index) => format!("n{index}"),
        GuardNodeKind::Known(index) => format!("k{index}"),
        GuardNodeKind::Not(inner) => format!("(not {})", shape(inner)),
        GuardNodeKind::Minus(inner) => format!("(-{})", shape(inner)),
        GuardNodeKind::Binary(operator, left, right) => {
            format!("({} {operator} {})", shape(left), shape(right))
        }
    }
}
