//! Words and signs → the tree of a guard, by recursive descent: one function for each rank.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::guard::name::Name;
use crate::guard::node::{Guard, GuardError, GuardNode, GuardNodeKind, GuardOperator};
use crate::guard::token::{GuardToken, find_misspelt, tokens};

/// The length limit of a guard in bytes: longer than a readable guard, and a bound for the depth of
/// a chain.
pub const MAX_LEN: usize = 1024;
/// Parentheses, `not` and signs in each other.
pub const MAX_DEPTH: usize = 32;

impl Guard {
    /// Reads a guard.
    ///
    /// # Errors
    /// [`GuardError`] at the first thing that does not belong there.
    pub fn parse(text: &str) -> Result<Self, GuardError> {
        let mut parser = GuardParser::of(text, "guard")?;
        let root = parser.parse_or()?;
        match parser.peek() {
            GuardToken::End => Ok(Self { root, names: parser.names }),
            GuardToken::Close => Err(parser.error("this parenthesis closes nothing", "remove it")),
            GuardToken::Operator(operator) if operator.is_comparison() => Err(parser.error(
                "comparisons cannot be chained",
                "write a < b and b < c; to compare booleans, put parentheses around each",
            )),
            _ => Err(parser.report_unexpected("an operator such as and, or, < or + is expected")),
        }
    }

    /// Parses a value: one side of a comparison.
    pub(super) fn parse_value(text: &str) -> Result<Self, GuardError> {
        let mut parser = GuardParser::of(text, "value")?;
        let root = parser.parse_sum()?;
        match parser.peek() {
            GuardToken::End => Ok(Self { root, names: parser.names }),
            _ => Err(parser.report_unexpected("an operator such as + or - is expected")),
        }
    }
}

struct GuardParser<'a> {
    text: &'a str,
    what: &'static str,
    tokens: Vec<(GuardToken, Range<usize>)>,
    next: usize,
    depth: usize,
    names: Vec<Name>,
    numbers: BTreeMap<String, usize>,
}

impl<'a> GuardParser<'a> {
    /// `what` is the name of the text in messages.
    fn of(text: &'a str, what: &'static str) -> Result<Self, GuardError> {
        if text.len() > MAX_LEN {
            return Err(GuardError {
                at: 0..text.len(),
                message: format!("this {what} has {} bytes", text.len()),
                remedy: format!("at most {MAX_LEN} are read; split it over several transitions"),
            });
        }
        let tokens = tokens(text, what)?;
        let (names, numbers) = (Vec::new(), BTreeMap::new());
        Ok(Self { text, what, tokens, next: 0, depth: 0, names, numbers })
    }

    /// The last token is always the end, which is never consumed.
    fn peek(&self) -> &GuardToken {
        &self.tokens[self.next].0
    }

    fn token_range(&self) -> Range<usize> {
        self.tokens[self.next].1.clone()
    }

    fn advance(&mut self) -> GuardToken {
        let token = self.tokens[self.next].0.clone();
        self.next += usize::from(token != GuardToken::End);
        token
    }

    fn parse_or(&mut self) -> Result<GuardNode, GuardError> {
        self.parse_chain(|op| op == GuardOperator::Or, Self::parse_and)
    }

    fn parse_and(&mut self) -> Result<GuardNode, GuardError> {
        self.parse_chain(|op| op == GuardOperator::And, Self::parse_not)
    }

    fn parse_not(&mut self) -> Result<GuardNode, GuardError> {
        if *self.peek() != GuardToken::Not {
            return self.parse_comparison();
        }
        self.parse_prefixed(GuardNodeKind::Not, Self::parse_not)
    }

    fn parse_comparison(&mut self) -> Result<GuardNode, GuardError> {
        let left = self.parse_sum()?;
        match *self.peek() {
            GuardToken::Operator(operator) if operator.is_comparison() => {
                self.advance();
                let right = self.parse_sum()?;
                Ok(join_nodes(operator, left, right))
            }
            _ => Ok(left),
        }
    }

    fn parse_sum(&mut self) -> Result<GuardNode, GuardError> {
        self.parse_chain(
            |op| matches!(op, GuardOperator::Plus | GuardOperator::Minus),
            Self::parse_product,
        )
    }

    fn parse_product(&mut self) -> Result<GuardNode, GuardError> {
        self.parse_chain(
            |op| matches!(op, GuardOperator::Times | GuardOperator::By),
            Self::parse_factor,
        )
    }

    /// `part op part op part`, from left to right.
    fn parse_chain(
        &mut self,
        is_ours: impl Fn(GuardOperator) -> bool,
        part: fn(&mut Self) -> Result<GuardNode, GuardError>,
    ) -> Result<GuardNode, GuardError> {
        let mut left = part(self)?;
        while let GuardToken::Operator(operator) = *self.peek()
            && is_ours(operator)
        {
            self.advance();
            let right = part(self)?;
            left = join_nodes(operator, left, right);
        }
        Ok(left)
    }

    fn parse_factor(&mut self) -> Result<GuardNode, GuardError> {
        let at = self.token_range();
        let kind = match self.peek().clone() {
            GuardToken::Operator(GuardOperator::Minus) => {
                return self.parse_prefixed(GuardNodeKind::Minus, Self::parse_factor);
            }
            GuardToken::Open => return self.parse_parenthesis(),
            GuardToken::Number(value, unit) => GuardNodeKind::Number(value, unit),
            GuardToken::True => GuardNodeKind::Truth(true),
            GuardToken::False => GuardNodeKind::Truth(false),
            GuardToken::Text(text) => GuardNodeKind::Text(text),
            GuardToken::Name(name) => GuardNodeKind::Name(self.add_name(&name, at.clone())?),
            GuardToken::Known => return self.parse_known(),
            GuardToken::Not => {
                let remedy = "put parentheses around it: (not …)";
                return Err(self.error("not is not expected here", remedy));
            }
            GuardToken::Operator(GuardOperator::Plus) => {
                return Err(self.error("+ is not expected here", &self.advise_plus()));
            }
            _ if self.what == "value" => {
                let wanted = "a whole number or a variable that transitions set is expected";
                return Err(self.report_unexpected(wanted));
            }
            _ => {
                let wanted = "a number with its unit, a variable, a field of data, true or false is expected";
                return Err(self.report_unexpected(wanted));
            }
        };
        self.advance();
        Ok(GuardNode { kind, at })
    }

    /// What to write instead of a `+` that has nothing before it.
    fn advise_plus(&self) -> String {
        let before = |steps: usize| self.next.checked_sub(steps).map(|at| &self.tokens[at].0);
        match (before(2), before(1)) {
            (Some(GuardToken::Name(name)), Some(GuardToken::Operator(GuardOperator::Plus))) => {
                format!("write {name} + 1 to count up by one")
            }
            (_, None) if self.what == "value" => {
                "write the number without +, or the variable before it to count up: round + 1"
                    .into()
            }
            _ => "write a value before it, or remove it".into(),
        }
    }

    fn parse_known(&mut self) -> Result<GuardNode, GuardError> {
        let start = self.token_range().start;
        self.advance();
        let wanted = "write known(battery): whether it has a value";
        self.expect_token(&GuardToken::Open, wanted)?;
        let GuardToken::Name(name) = self.peek().clone() else {
            return Err(self.report_unexpected(wanted));
        };
        let index = self.add_name(&name, self.token_range())?;
        self.advance();
        let end = self.token_range().end;
        self.expect_token(&GuardToken::Close, wanted)?;
        Ok(GuardNode { kind: GuardNodeKind::Known(index), at: start..end })
    }

    fn parse_parenthesis(&mut self) -> Result<GuardNode, GuardError> {
        let open = self.token_range();
        self.enter_nested()?;
        self.advance();
        let inner = self.parse_or()?;
        let end = self.token_range().end;
        if *self.peek() == GuardToken::End {
            return Err(GuardError {
                at: open,
                message: "this parenthesis is not closed".into(),
                remedy: "write ) where it ends".into(),
            });
        }
        self.expect_token(&GuardToken::Close, "an operator or ) is expected")?;
        self.depth -= 1;
        Ok(GuardNode { kind: inner.kind, at: open.start..end })
    }

    fn parse_prefixed(
        &mut self,
        kind: fn(Box<GuardNode>) -> GuardNodeKind,
        part: fn(&mut Self) -> Result<GuardNode, GuardError>,
    ) -> Result<GuardNode, GuardError> {
        let start = self.token_range().start;
        self.enter_nested()?;
        self.advance();
        let inner = part(self)?;
        self.depth -= 1;
        let at = start..inner.at.end;
        Ok(GuardNode { kind: kind(Box::new(inner)), at })
    }

    fn enter_nested(&mut self) -> Result<(), GuardError> {
        self.depth += 1;
        if self.depth <= MAX_DEPTH {
            return Ok(());
        }
        let remedy = format!("at most {MAX_DEPTH} parentheses, nots and signs may be nested");
        Err(self.error("this is nested too deeply", &remedy))
    }

    fn expect_token(&mut self, token: &GuardToken, wanted: &str) -> Result<(), GuardError> {
        if self.peek() != token {
            return Err(self.report_unexpected(wanted));
        }
        self.advance();
        Ok(())
    }

    fn add_name(&mut self, text: &str, at: Range<usize>) -> Result<usize, GuardError> {
        if text.contains('.') && Name::of_data(text).is_none() {
            return Err(GuardError {
                at,
                message: format!("`{text}` is not a field of data"),
                remedy: "write component.output, and .field for each field".into(),
            });
        }
        if let Some(number) = self.numbers.get(text) {
            return Ok(*number);
        }
        let number = self.names.len();
        self.names.push(Name::new(text, at));
        self.numbers.insert(text.into(), number);
        Ok(number)
    }

    fn report_unexpected(&self, wanted: &str) -> GuardError {
        let misspelt = find_misspelt(&self.tokens, self.next, &["and", "or"], &["not", "known"]);
        if let Some((at, remedy)) = misspelt {
            let word = &self.text[at.clone()];
            let message = format!("`{word}` is not a word of the guard language");
            return GuardError { at, message, remedy };
        }
        let before = self.next.checked_sub(1).map(|index| &self.tokens[index]);
        if let (GuardToken::Open, Some((GuardToken::Name(name), at))) = (self.peek(), before) {
            return GuardError {
                at: at.clone(),
                message: format!("there is nothing called {name}(…)"),
                remedy: "the only one is known(…)".into(),
            };
        }
        let message = match self.peek() {
            GuardToken::End if self.next == 0 => format!("this {} is empty", self.what),
            GuardToken::End => format!("the {} ends here", self.what),
            GuardToken::Number(..) => "a number is not expected here".to_owned(),
            GuardToken::Text(_) => "a text is not expected here".into(),
            GuardToken::Name(name) => format!("`{name}` is not expected here"),
            GuardToken::True => "true is not expected here".into(),
            GuardToken::False => "false is not expected here".into(),
            GuardToken::Not => "not is not expected here".into(),
            GuardToken::Known => "known is not expected here".into(),
            GuardToken::Operator(operator) => {
                format!("{} is not expected here", operator.as_str())
            }
            GuardToken::Open => "( is not expected here".into(),
            GuardToken::Close => ") is not expected here".into(),
        };
        self.error(&message, wanted)
    }

    fn error(&self, message: &str, remedy: &str) -> GuardError {
        GuardError { at: self.token_range(), message: message.into(), remedy: remedy.into() }
    }
}

fn join_nodes(operator: GuardOperator, left: GuardNode, right: GuardNode) -> GuardNode {
    let at = left.at.start..right.at.end;
    GuardNode { kind: GuardNodeKind::Binary(operator, Box::new(left), Box::new(right)), at }
}
