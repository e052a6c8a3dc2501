//! Words and signs → a claim, by recursive descent. The words and signs are those of guards.

use std::ops::Range;
use std::time::Duration;

use armor_wire::quantity::Dimension;

use super::{Claim, ClaimError, Formula, Name, Relation, Statement, Sum};
use crate::guard::{MAX_DEPTH, MAX_LEN, Operator, Token, tokens};

/// Words that are no names wherever they stand.
const RESERVED: [&str; 4] = ["always", "never", "eventually", "inf"];
/// What stands before a parenthesis.
const CALLED: [&str; 6] = ["reachable", "duration", "fires", "dead", "bounded", "active"];
/// What a check can begin with.
const STATEMENTS: &str = "write always …, never …, eventually …, reachable(…), always \
    reachable(…), … leads to …, duration(…) <= 20min, fires(…), dead(…) or bounded(…) <= 3";

impl Claim {
    /// Reads a claim.
    ///
    /// # Errors
    /// [`ClaimError`] at the first thing that does not belong there.
    pub fn parse(text: &str) -> Result<Self, ClaimError> {
        if text.len() > MAX_LEN {
            return Err(ClaimError {
                at: 0..text.len(),
                message: format!("this check has {} bytes", text.len()),
                remedy: format!("at most {MAX_LEN} are read; write several checks"),
            });
        }
        let tokens = tokens(text, "check").map_err(|error| ClaimError {
            at: error.at,
            message: error.message,
            remedy: error.remedy,
        })?;
        let mut parser = Parser { text, tokens, next: 0, depth: 0 };
        let statement = parser.statement()?;
        match parser.peek() {
            Token::End => Ok(Self { statement }),
            Token::Close => Err(parser.error("this parenthesis closes nothing", "remove it")),
            _ if matches!(statement, Statement::Always(_) | Statement::Never(_)) => {
                Err(parser.unexpected("and, or, or a comparison is expected"))
            }
            _ => Err(parser.error("the check is complete before this", "write a second <check>")),
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<(Token, Range<usize>)>,
    next: usize,
    depth: usize,
}

impl Parser<'_> {
    /// There is always an end left, which nobody takes.
    fn peek(&self) -> &Token {
        &self.tokens[self.next].0
    }

    fn after_next(&self) -> &Token {
        self.tokens.get(self.next + 1).map_or(&Token::End, |token| &token.0)
    }

    fn at(&self) -> Range<usize> {
        self.tokens[self.next].1.clone()
    }

    fn advance(&mut self) {
        self.next += usize::from(*self.peek() != Token::End);
    }

    /// The word that is next; `known` means nothing here.
    fn word(&self) -> Option<&str> {
        let (token, at) = &self.tokens[self.next];
        matches!(token, Token::Name(_) | Token::Known).then(|| &self.text[at.clone()])
    }

    fn is_called(&self, word: &str) -> bool {
        self.word() == Some(word) && *self.after_next() == Token::Open
    }

    fn takes(&mut self, word: &str) -> bool {
        let is_next = self.word() == Some(word);
        self.next += usize::from(is_next);
        is_next
    }

    fn statement(&mut self) -> Result<Statement, ClaimError> {
        if self.takes("always") {
            return Ok(match self.is_called("reachable") {
                true => Statement::AlwaysReachable(self.called(Self::or)?),
                false => Statement::Always(self.or()?),
            });
        }
        if self.takes("never") {
            return Ok(Statement::Never(self.or()?));
        }
        if self.takes("eventually") {
            return Ok(Statement::Eventually(self.or()?));
        }
        if self.is_called("reachable") {
            return Ok(Statement::Reachable(self.called(Self::or)?));
        }
        if self.is_called("fires") {
            return Ok(Statement::Fires(self.called(Self::name)?));
        }
        if self.is_called("dead") {
            return Ok(Statement::Dead(self.called(Self::name)?));
        }
        if self.is_called("duration") {
            return self.duration();
        }
        if self.is_called("bounded") {
            return self.bounded();
        }
        self.leads_to()
    }

    fn leads_to(&mut self) -> Result<Statement, ClaimError> {
        let start = self.at().start;
        if *self.peek() == Token::End {
            return Err(self.error("this check says nothing", STATEMENTS));
        }
        let from = self.or()?;
        let end = self.tokens[self.next.saturating_sub(1)].1.end;
        if self.word() == Some("leads") {
            self.advance();
            if !self.takes("to") {
                return Err(self.unexpected("write … leads to …"));
            }
            return Ok(Statement::LeadsTo(from, self.or()?));
        }
        if *self.peek() == Token::End {
            return Err(ClaimError {
                at: start..end,
                message: "this does not say when it is to hold".into(),
                remedy: "write always or never before it, or … leads to …".into(),
            });
        }
        Err(self.unexpected("and, or, a comparison or leads to is expected"))
    }

    fn duration(&mut self) -> Result<Statement, ClaimError> {
        let until = self.called(Self::or)?;
        let wanted = "write duration(home) <= 20min: <, <=, > or >= and a time";
        let relation = match self.relation() {
            Some(Relation::Equal | Relation::Unequal) | None => {
                return Err(self.unexpected(wanted));
            }
            Some(relation) => relation,
        };
        self.advance();
        let Token::Number(number, unit) = *self.peek() else {
            return Err(self.unexpected(wanted));
        };
        let Some(unit) = unit.filter(|unit| unit.dimension == Dimension::Time) else {
            return Err(self.error("this is not a time", "write its unit: 90s, 20min or 1.5h"));
        };
        let limit = Duration::try_from_secs_f64(number * unit.to_si);
        let limit = limit.map_err(|_| self.error("this is too long", "write a shorter time"))?;
        self.advance();
        Ok(Statement::Duration { until, relation, limit })
    }

    fn bounded(&mut self) -> Result<Statement, ClaimError> {
        let place = self.called(Self::name)?;
        let Some(relation) = self.relation() else { return Ok(Statement::Bounded(place, None)) };
        let wanted = "write bounded(place) <= 3, or bounded(place) alone";
        let is_strict = match relation {
            Relation::LessOrEqual => false,
            Relation::Less => true,
            _ => return Err(self.unexpected(wanted)),
        };
        self.advance();
        let Token::Number(..) = self.peek() else { return Err(self.unexpected(wanted)) };
        let limit = self.tokens_of_number()?;
        let most = u32::try_from(limit).ok().and_then(|n| n.checked_sub(u32::from(is_strict)));
        let most = most
            .ok_or_else(|| self.error("no place holds so many tokens", "write a whole number"))?;
        self.advance();
        Ok(Statement::Bounded(place, Some(most)))
    }

    /// `word ( inner )`.
    fn called<T>(
        &mut self,
        inner: fn(&mut Self) -> Result<T, ClaimError>,
    ) -> Result<T, ClaimError> {
        self.advance();
        self.parenthesis(inner)
    }

    fn parenthesis<T>(
        &mut self,
        inner: fn(&mut Self) -> Result<T, ClaimError>,
    ) -> Result<T, ClaimError> {
        let open = self.at();
        self.deeper()?;
        self.advance();
        let inner = inner(self)?;
        match self.peek() {
            Token::Close => self.advance(),
            Token::End => {
                return Err(ClaimError {
                    at: open,
                    message: "this parenthesis is not closed".into(),
                    remedy: "write ) where it ends".into(),
                });
            }
            _ => return Err(self.unexpected("an operator or ) is expected")),
        }
        self.depth -= 1;
        Ok(inner)
    }

    fn or(&mut self) -> Result<Formula, ClaimError> {
        let mut left = self.and()?;
        while *self.peek() == Token::Operator(Operator::Or) {
            self.advance();
            left = Formula::Or(Box::new(left), Box::new(self.and()?));
        }
        Ok(left)
    }

    fn and(&mut self) -> Result<Formula, ClaimError> {
        let mut left = self.not()?;
        while *self.peek() == Token::Operator(Operator::And) {
            self.advance();
            left = Formula::And(Box::new(left), Box::new(self.not()?));
        }
        Ok(left)
    }

    fn not(&mut self) -> Result<Formula, ClaimError> {
        match self.peek() {
            Token::Not => {
                self.deeper()?;
                self.advance();
                let inner = self.not()?;
                self.depth -= 1;
                Ok(Formula::Not(Box::new(inner)))
            }
            Token::Open => self.parenthesis(Self::or),
            Token::True | Token::False => {
                let truth = *self.peek() == Token::True;
                self.advance();
                Ok(Formula::Truth(truth))
            }
            _ if self.is_called("active") => Ok(Formula::Active(self.called(Self::name)?)),
            _ => self.comparison(),
        }
    }

    fn comparison(&mut self) -> Result<Formula, ClaimError> {
        let mut left = self.sum()?;
        let Some(relation) = self.relation() else {
            if left.number == 0 && left.places.len() == 1 {
                return Ok(Formula::Marked(left.places.remove(0)));
            }
            return Err(self.unexpected("a comparison is expected: a + b <= 1"));
        };
        self.advance();
        let right = self.sum()?;
        if self.relation().is_some() {
            let remedy = "write a < b and b < c";
            return Err(self.error("comparisons cannot be chained", remedy));
        }
        Ok(Formula::Compare(left, relation, right))
    }

    fn sum(&mut self) -> Result<Sum, ClaimError> {
        let mut sum = Sum::default();
        loop {
            match self.peek() {
                Token::Number(..) => {
                    // As many numbers as fit a text of bounded length do not overflow.
                    sum.number += self.tokens_of_number()?;
                    self.advance();
                }
                _ => sum.places.push(self.name()?),
            }
            if *self.peek() != Token::Operator(Operator::Plus) {
                return Ok(sum);
            }
            self.advance();
        }
    }

    /// The number that is next, as a count of tokens.
    fn tokens_of_number(&self) -> Result<u64, ClaimError> {
        let text = &self.text[self.at()];
        let count = text.parse::<u32>().map(u64::from);
        count.map_err(|_| self.error("this is not a count of tokens", "write a whole number"))
    }

    fn relation(&self) -> Option<Relation> {
        Some(match self.peek() {
            Token::Operator(Operator::Less) => Relation::Less,
            Token::Operator(Operator::LessOrEqual) => Relation::LessOrEqual,
            Token::Operator(Operator::Greater) => Relation::Greater,
            Token::Operator(Operator::GreaterOrEqual) => Relation::GreaterOrEqual,
            Token::Operator(Operator::Equal) => Relation::Equal,
            Token::Operator(Operator::Unequal) => Relation::Unequal,
            _ => return None,
        })
    }

    fn name(&mut self) -> Result<Name, ClaimError> {
        let Some(word) = self.word() else {
            return Err(self.unexpected("the name of a place is expected, or a number of tokens"));
        };
        let (word, at) = (word.to_owned(), self.at());
        if RESERVED.contains(&word.as_str()) {
            let remedy = match self.next {
                0 => "write what is to hold after it".to_owned(),
                _ => "the words always, never and eventually begin a check; give a place of that \
                      name another one"
                    .into(),
            };
            return Err(self.error(&format!("{word} is not expected here"), &remedy));
        }
        if *self.after_next() == Token::Open {
            let message = match CALLED.contains(&word.as_str()) {
                true => format!("{word}(…) is not expected here"),
                false => format!("there is nothing called {word}(…)"),
            };
            let remedy = match word.as_str() {
                "active" => "name a transition or place here",
                _ if CALLED.contains(&word.as_str()) => "a check makes one such statement",
                _ => STATEMENTS,
            };
            return Err(self.error(&message, remedy));
        }
        if word.split('.').any(str::is_empty) {
            let remedy = "write the name of a place, behind sub-mission and dot for one of its own";
            return Err(self.error(&format!("`{word}` is not a name"), remedy));
        }
        self.advance();
        Ok(Name { text: word, at })
    }

    fn deeper(&mut self) -> Result<(), ClaimError> {
        self.depth += 1;
        if self.depth <= MAX_DEPTH {
            return Ok(());
        }
        let remedy = format!("at most {MAX_DEPTH} parentheses and nots stand in each other");
        Err(self.error("this goes too deep", &remedy))
    }

    fn unexpected(&self, wanted: &str) -> ClaimError {
        let message = match self.peek() {
            Token::End => "the check ends here".to_owned(),
            _ => format!("{} is not expected here", &self.text[self.at()]),
        };
        self.error(&message, wanted)
    }

    fn error(&self, message: &str, remedy: &str) -> ClaimError {
        ClaimError { at: self.at(), message: message.into(), remedy: remedy.into() }
    }
}
