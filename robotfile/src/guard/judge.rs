//! Whether the parts of a guard fit together: truths, numbers and texts, and the units of numbers.
//! An unknown type, such as that of data of a missing component, matches everything.

use armor_wire::quantity::Dimension;

use super::{bounds, exactness, implication};
use crate::code::Code;
use crate::guard::meaning::{GuardProblem, Meaning, Type};
use crate::guard::measure::{Measure, by, in_words, times};
use crate::guard::node::{Guard, GuardNode, GuardNodeKind, GuardOperator};
use crate::suggestion::list_choices;

/// All that is wrong with a guard whose names mean this.
pub(crate) fn judge(guard: &Guard, text: &str, meanings: &[Meaning]) -> Vec<GuardProblem> {
    let mut judge = GuardJudge { guard, text, meanings, problems: Vec::new() };
    let is = judge.type_of(&guard.root);
    judge.expect_truth(&guard.root, &is, "a guard");
    if judge.problems.is_empty() {
        judge.problems = bounds::constants(guard, text, meanings);
        judge.report_always_known(&guard.root);
        let is_new = |problem: &GuardProblem| judge.problems.iter().all(|it| it.at != problem.at);
        let inexact = exactness::inexact(guard, text, meanings).into_iter().filter(is_new);
        let inexact: Vec<_> = inexact.collect();
        judge.problems.extend(inexact);
        if judge.problems.is_empty() {
            judge.problems = implication::redundant(guard, text);
        }
    }
    judge.problems
}

struct GuardJudge<'a> {
    guard: &'a Guard,
    text: &'a str,
    meanings: &'a [Meaning],
    problems: Vec<GuardProblem>,
}

impl GuardJudge<'_> {
    fn report_problem(
        &mut self,
        code: Code,
        node: &GuardNode,
        message: String,
        remedy: impl Into<String>,
    ) {
        // The same mistake about a name that is written twice is shown once.
        if self.problems.iter().any(|it| it.code == code && it.message == message) {
            return;
        }
        let problem = GuardProblem { code, at: node.at.clone(), message, remedy: remedy.into() };
        self.problems.push(problem);
    }

    /// A variable that transitions set has a value from the start.
    fn report_always_known(&mut self, node: &GuardNode) {
        match &node.kind {
            GuardNodeKind::Known(index) => {
                if self.meanings.get(*index).is_none_or(|meaning| meaning.is_measured) {
                    return;
                }
                let text = self.text_of(node);
                let name = &self.guard.names()[*index];
                let message = format!(
                    "`{text}` is always true: {name} follows no data, so it has a value from the start"
                );
                let remedy = "name a variable that follows data, or a field of data; or remove it";
                self.report_problem(Code::GuardConstant, node, message, remedy);
            }
            GuardNodeKind::Not(inner) | GuardNodeKind::Minus(inner) => {
                self.report_always_known(inner);
            }
            GuardNodeKind::Binary(_, left, right) => {
                self.report_always_known(left);
                self.report_always_known(right);
            }
            _ => {}
        }
    }

    fn text_of(&self, node: &GuardNode) -> &str {
        self.text.get(node.at.clone()).unwrap_or_default()
    }

    fn type_of(&mut self, node: &GuardNode) -> Type {
        match &node.kind {
            GuardNodeKind::Number(_, None) => Type::Number(Measure::Bare),
            GuardNodeKind::Number(_, Some(unit)) => {
                Type::Number(Measure::Of { dimension: unit.dimension, unit: None })
            }
            GuardNodeKind::Truth(_) | GuardNodeKind::Known(_) => Type::Truth,
            GuardNodeKind::Text(_) => Type::Text(None),
            GuardNodeKind::Name(index) => {
                self.meanings.get(*index).map_or(Type::Any, |m| m.is.clone())
            }
            GuardNodeKind::Not(inner) => {
                let is = self.type_of(inner);
                self.expect_truth(inner, &is, "what follows not");
                Type::Truth
            }
            GuardNodeKind::Minus(inner) => {
                let is = self.type_of(inner);
                Type::Number(self.expect_number(inner, &is))
            }
            GuardNodeKind::Binary(operator, left, right) => {
                self.judge_operator(*operator, node, left, right)
            }
        }
    }

    fn judge_operator(
        &mut self,
        operator: GuardOperator,
        node: &GuardNode,
        left: &GuardNode,
        right: &GuardNode,
    ) -> Type {
        let (is_left, is_right) = (self.type_of(left), self.type_of(right));
        match operator {
            GuardOperator::And | GuardOperator::Or => {
                let what = format!("each side of {operator}");
                self.expect_truth(left, &is_left, &what);
                self.expect_truth(right, &is_right, &what);
                Type::Truth
            }
            GuardOperator::Equal | GuardOperator::Unequal => {
                self.expect_same_type(node, (left, &is_left), (right, &is_right));
                Type::Truth
            }
            _ => {
                let measures =
                    [self.expect_number(left, &is_left), self.expect_number(right, &is_right)];
                let [of_left, of_right] = &measures;
                match operator {
                    GuardOperator::Times => Type::Number(times(of_left, of_right)),
                    GuardOperator::By => Type::Number(by(of_left, of_right)),
                    _ => {
                        let measure = self.fit_units((left, of_left), (right, of_right));
                        let is_sum = matches!(operator, GuardOperator::Plus | GuardOperator::Minus);
                        if is_sum { Type::Number(measure) } else { Type::Truth }
                    }
                }
            }
        }
    }

    fn expect_truth(&mut self, node: &GuardNode, is: &Type, what: &str) {
        let (noun, remedy) = match is {
            Type::Any | Type::Truth => return,
            Type::Number(_) => ("a number", "compare it, as in battery < 30%"),
            Type::Text(_) => ("a text", "compare it, as in power.state == 'Charging'"),
        };
        let message = format!("{what} is true or false, but `{}` is {noun}", self.text_of(node));
        self.report_problem(Code::GuardType, node, message, remedy);
    }

    fn expect_number(&mut self, node: &GuardNode, is: &Type) -> Measure {
        let noun = match is {
            Type::Any => return Measure::Any,
            Type::Number(measure) => return measure.clone(),
            Type::Truth => "true or false",
            Type::Text(_) => "a text",
        };
        let message = format!("a number is expected, but `{}` is {noun}", self.text_of(node));
        let bare = self.text_of(node).trim_matches(['\'', '"']).trim();
        let remedy = match is {
            Type::Text(_) if armor_wire::quantity::parse(bare).is_ok() => {
                format!("write {bare} without quotation marks")
            }
            _ => "numbers are compared with < <= > >=, the others with == and !=".to_owned(),
        };
        self.report_problem(Code::GuardType, node, message, &remedy);
        Measure::Any
    }

    /// `==` and `!=` take two numbers, two truths or two texts.
    fn expect_same_type(
        &mut self,
        node: &GuardNode,
        left: (&GuardNode, &Type),
        right: (&GuardNode, &Type),
    ) {
        match (left.1, right.1) {
            (Type::Any, _) | (_, Type::Any) | (Type::Truth, Type::Truth) => {}
            (Type::Number(of_left), Type::Number(of_right)) => {
                self.fit_units((left.0, of_left), (right.0, of_right));
            }
            (Type::Text(choices), Type::Text(others)) => {
                self.expect_choice(right.0, choices.as_deref());
                self.expect_choice(left.0, others.as_deref());
            }
            _ => {
                let message = format!(
                    "`{}` and `{}` are of different types: {} and {}",
                    self.text_of(left.0),
                    self.text_of(right.0),
                    type_noun(left.1),
                    type_noun(right.1)
                );
                let remedy = "compare numbers with numbers, texts with texts in single quotes";
                self.report_problem(Code::GuardType, node, message, remedy);
            }
        }
    }

    fn expect_choice(&mut self, node: &GuardNode, choices: Option<&[String]>) {
        let (GuardNodeKind::Text(text), Some(choices)) = (&node.kind, choices) else { return };
        if choices.contains(text) {
            return;
        }
        let message = format!("it is never '{text}'");
        let remedy = list_choices(text, choices.iter().map(String::as_str));
        self.report_problem(Code::GuardType, node, message, remedy);
    }

    /// Two numbers that are compared or added: of one measure.
    fn fit_units(
        &mut self,
        left: (&GuardNode, &Measure),
        right: (&GuardNode, &Measure),
    ) -> Measure {
        match (left.1, right.1) {
            (Measure::Any, other) | (other, Measure::Any) => other.clone(),
            (Measure::Bare, Measure::Bare) => Measure::Bare,
            (Measure::Bare, measured) => self.fit_bare_number(left.0, (right.0, measured)),
            (measured, Measure::Bare) => self.fit_bare_number(right.0, (left.0, measured)),
            (Measure::Of { dimension, unit }, Measure::Of { dimension: other, unit: with })
                if dimension == other =>
            {
                Measure::Of { dimension: *dimension, unit: unit.or(*with) }
            }
            (Measure::Other(unit), Measure::Other(other)) if unit == other => left.1.clone(),
            _ => {
                let message = format!(
                    "`{}` is {} and `{}` {}",
                    self.text_of(left.0),
                    in_words(left.1),
                    self.text_of(right.0),
                    in_words(right.1)
                );
                self.report_problem(
                    Code::GuardUnit,
                    right.0,
                    message,
                    "compare values of the same quantity",
                );
                Measure::Any
            }
        }
    }

    /// Combines a number without unit with one that has a unit: it may be 0, a number with an SI
    /// unit, or a fraction with percent.
    fn fit_bare_number(
        &mut self,
        bare: &GuardNode,
        (node, measure): (&GuardNode, &Measure),
    ) -> Measure {
        let is_written = is_constant(bare);
        let of_field = match measure {
            Measure::Of { unit, .. } => *unit,
            _ => None,
        };
        let is_ratio = matches!(measure, Measure::Of { dimension: Dimension::Ratio, .. });
        let is_zero = matches!(bare.kind, GuardNodeKind::Number(value, _) if value == 0.0);
        if is_zero || (is_written && of_field.is_none() && !is_constant(node)) {
            return measure.clone();
        }
        let text = self.text_of(bare).to_owned();
        if let (true, Some(unit)) = (is_written, of_field) {
            let message =
                format!("`{text}` has no unit, but `{}` is in {unit}", self.text_of(node));
            let remedy = match bare.kind {
                GuardNodeKind::Number(..) => format!("write {text}{unit}"),
                _ => format!("write the numbers with their unit, such as 1{unit}"),
            };
            self.report_problem(Code::GuardUnit, bare, message, remedy);
            return measure.clone();
        }
        if !is_ratio {
            let message = format!(
                "`{text}` has no unit, and `{}` is {}",
                self.text_of(node),
                in_words(measure)
            );
            let (at, remedy) = match is_written {
                true => (bare, "write it with its unit"),
                false => (node, "compare it with a number without unit, or give its field a unit"),
            };
            self.report_problem(Code::GuardUnit, at, message, remedy);
            return Measure::Any;
        }
        let too_wide = |index: usize| {
            let meaning = self.meanings.get(index)?;
            (meaning.within.1.is_finite() && meaning.within.1 > 1.0).then(|| {
                let name = &self.guard.names[index];
                format!(
                    "`{}` is a fraction of one, but {name} is {}",
                    self.text_of(node),
                    meaning.domain
                )
            })
        };
        if let GuardNodeKind::Name(index) = bare.kind
            && let Some(message) = too_wide(index)
        {
            let remedy = "write a number without %, or a domain in percent: max=\"100%\"";
            self.report_problem(Code::GuardUnit, node, message, remedy);
        }
        measure.clone()
    }
}

/// Whether it consists of written numbers alone.
fn is_constant(node: &GuardNode) -> bool {
    match &node.kind {
        GuardNodeKind::Name(_) | GuardNodeKind::Known(_) => false,
        GuardNodeKind::Number(..) | GuardNodeKind::Truth(_) | GuardNodeKind::Text(_) => true,
        GuardNodeKind::Not(inner) | GuardNodeKind::Minus(inner) => is_constant(inner),
        GuardNodeKind::Binary(_, left, right) => is_constant(left) && is_constant(right),
    }
}

fn type_noun(is: &Type) -> &'static str {
    match is {
        Type::Any => "a value",
        Type::Truth => "true or false",
        Type::Text(_) => "a text",
        Type::Number(_) => "a number",
    }
}
