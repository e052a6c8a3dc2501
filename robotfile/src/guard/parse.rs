//! Words and signs → the tree of a guard, by recursive descent: one function for each rank.

use std::collections::BTreeMap;
use std::ops::Range;

use super::token::{Token, tokens};
use super::{Guard, GuardError, Kind, Name, Node, Operator};

/// Longest guard in bytes: more than anybody reads, and what bounds the depth of a chain.
pub const MAX_LEN: usize = 1024;
/// Parentheses, `not` and signs in each other.
pub const MAX_DEPTH: usize = 32;

impl Guard {
    /// Reads a guard.
    ///
    /// # Errors
    /// [`GuardError`] at the first thing that does not belong there.
    pub fn parse(text: &str) -> Result<Self, GuardError> {
        let mut parser = Parser::of(text, "guard")?;
        let root = parser.or()?;
        match parser.peek() {
            Token::End => Ok(Self { root, names: parser.names }),
            Token::Close => Err(parser.error("this parenthesis closes nothing", "remove it")),
            Token::Operator(operator) if operator.is_comparison() => Err(parser.error(
                "comparisons cannot be chained",
                "write a < b and b < c; to compare truths, put parentheses around each",
            )),
            _ => Err(parser.unexpected("an operator such as and, or, < or + is expected")),
        }
    }

    /// Reads a value: what may stand on one side of a comparison.
    pub(super) fn parse_value(text: &str) -> Result<Self, GuardError> {
        let mut parser = Parser::of(text, "value")?;
        let root = parser.sum()?;
        match parser.peek() {
            Token::End => Ok(Self { root, names: parser.names }),
            _ => Err(parser.unexpected("an operator such as + or - is expected")),
        }
    }
}

struct Parser {
    what: &'static str,
    tokens: Vec<(Token, Range<usize>)>,
    next: usize,
    depth: usize,
    names: Vec<Name>,
    numbers: BTreeMap<String, usize>,
}

impl Parser {
    /// `what` is what the text is called in messages.
    fn of(text: &str, what: &'static str) -> Result<Self, GuardError> {
        if text.len() > MAX_LEN {
            return Err(GuardError {
                at: 0..text.len(),
                message: format!("this {what} has {} bytes", text.len()),
                remedy: format!("at most {MAX_LEN} are read; split it over several transitions"),
            });
        }
        let tokens = tokens(text, what)?;
        let (names, numbers) = (Vec::new(), BTreeMap::new());
        Ok(Self { what, tokens, next: 0, depth: 0, names, numbers })
    }

    /// There is always an end left, which nobody takes.
    fn peek(&self) -> &Token {
        &self.tokens[self.next].0
    }

    fn at(&self) -> Range<usize> {
        self.tokens[self.next].1.clone()
    }

    fn advance(&mut self) -> Token {
        let token = self.tokens[self.next].0.clone();
        self.next += usize::from(token != Token::End);
        token
    }

    fn or(&mut self) -> Result<Node, GuardError> {
        self.chain(|op| op == Operator::Or, Self::and)
    }

    fn and(&mut self) -> Result<Node, GuardError> {
        self.chain(|op| op == Operator::And, Self::not)
    }

    fn not(&mut self) -> Result<Node, GuardError> {
        if *self.peek() != Token::Not {
            return self.comparison();
        }
        self.prefixed(Kind::Not, Self::not)
    }

    fn comparison(&mut self) -> Result<Node, GuardError> {
        let left = self.sum()?;
        match *self.peek() {
            Token::Operator(operator) if operator.is_comparison() => {
                self.advance();
                let right = self.sum()?;
                Ok(joined(operator, left, right))
            }
            _ => Ok(left),
        }
    }

    fn sum(&mut self) -> Result<Node, GuardError> {
        self.chain(|op| matches!(op, Operator::Plus | Operator::Minus), Self::product)
    }

    fn product(&mut self) -> Result<Node, GuardError> {
        self.chain(|op| matches!(op, Operator::Times | Operator::By), Self::factor)
    }

    /// `part op part op part`, from left to right.
    fn chain(
        &mut self,
        is_ours: impl Fn(Operator) -> bool,
        part: fn(&mut Self) -> Result<Node, GuardError>,
    ) -> Result<Node, GuardError> {
        let mut left = part(self)?;
        while let Token::Operator(operator) = *self.peek()
            && is_ours(operator)
        {
            self.advance();
            let right = part(self)?;
            left = joined(operator, left, right);
        }
        Ok(left)
    }

    fn factor(&mut self) -> Result<Node, GuardError> {
        let at = self.at();
        let kind = match self.peek().clone() {
            Token::Operator(Operator::Minus) => return self.prefixed(Kind::Minus, Self::factor),
            Token::Open => return self.parenthesis(),
            Token::Number(value, unit) => Kind::Number(value, unit),
            Token::True => Kind::Truth(true),
            Token::False => Kind::Truth(false),
            Token::Text(text) => Kind::Text(text),
            Token::Name(name) => Kind::Name(self.name(&name, at.clone())?),
            Token::Known => return self.known(),
            Token::Not => {
                let remedy = "put parentheses around it: (not …)";
                return Err(self.error("not is not expected here", remedy));
            }
            _ => {
                let wanted = "a number with its unit, a variable, a field of data, true or false is expected";
                return Err(self.unexpected(wanted));
            }
        };
        self.advance();
        Ok(Node { kind, at })
    }

    fn known(&mut self) -> Result<Node, GuardError> {
        let start = self.at().start;
        self.advance();
        let wanted = "write known(battery): whether a value is there";
        self.expect(&Token::Open, wanted)?;
        let Token::Name(name) = self.peek().clone() else { return Err(self.unexpected(wanted)) };
        let index = self.name(&name, self.at())?;
        self.advance();
        let end = self.at().end;
        self.expect(&Token::Close, wanted)?;
        Ok(Node { kind: Kind::Known(index), at: start..end })
    }

    fn parenthesis(&mut self) -> Result<Node, GuardError> {
        let open = self.at();
        self.deeper()?;
        self.advance();
        let inner = self.or()?;
        let end = self.at().end;
        if *self.peek() == Token::End {
            return Err(GuardError {
                at: open,
                message: "this parenthesis is not closed".into(),
                remedy: "write ) where it ends".into(),
            });
        }
        self.expect(&Token::Close, "an operator or ) is expected")?;
        self.depth -= 1;
        Ok(Node { kind: inner.kind, at: open.start..end })
    }

    fn prefixed(
        &mut self,
        kind: fn(Box<Node>) -> Kind,
        part: fn(&mut Self) -> Result<Node, GuardError>,
    ) -> Result<Node, GuardError> {
        let start = self.at().start;
        self.deeper()?;
        self.advance();
        let inner = part(self)?;
        self.depth -= 1;
        let at = start..inner.at.end;
        Ok(Node { kind: kind(Box::new(inner)), at })
    }

    fn deeper(&mut self) -> Result<(), GuardError> {
        self.depth += 1;
        if self.depth <= MAX_DEPTH {
            return Ok(());
        }
        let remedy = format!("at most {MAX_DEPTH} parentheses, nots and signs stand in each other");
        Err(self.error("this goes too deep", &remedy))
    }

    fn expect(&mut self, token: &Token, wanted: &str) -> Result<(), GuardError> {
        if self.peek() != token {
            return Err(self.unexpected(wanted));
        }
        self.advance();
        Ok(())
    }

    fn name(&mut self, text: &str, at: Range<usize>) -> Result<usize, GuardError> {
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

    fn unexpected(&self, wanted: &str) -> GuardError {
        let message = match self.peek() {
            Token::End if self.next == 0 => format!("this {} says nothing", self.what),
            Token::End => format!("the {} ends here", self.what),
            Token::Number(..) => "a number is not expected here".to_owned(),
            Token::Text(_) => "a text is not expected here".into(),
            Token::Name(name) => format!("`{name}` is not expected here"),
            Token::True => "true is not expected here".into(),
            Token::False => "false is not expected here".into(),
            Token::Not => "not is not expected here".into(),
            Token::Known => "known is not expected here".into(),
            Token::Operator(operator) => format!("{} is not expected here", operator.as_str()),
            Token::Open => "( is not expected here".into(),
            Token::Close => ") is not expected here".into(),
        };
        self.error(&message, wanted)
    }

    fn error(&self, message: &str, remedy: &str) -> GuardError {
        GuardError { at: self.at(), message: message.into(), remedy: remedy.into() }
    }
}

fn joined(operator: Operator, left: Node, right: Node) -> Node {
    let at = left.at.start..right.at.end;
    Node { kind: Kind::Binary(operator, Box::new(left), Box::new(right)), at }
}
