//! Words and signs → a claim, by recursive descent. The words and signs are those of guards.

use std::ops::Range;
use std::time::Duration;

use armor_wire::quantity::Dimension;

use super::{Claim, ClaimError, Formula, Name, Relation, Statement, Sum};
use crate::guard::{GuardOperator, GuardToken, MAX_DEPTH, MAX_LEN, find_misspelt, tokens};
use crate::suggestion::suggest_similar;

/// Words that are never names.
const RESERVED: [&str; 4] = ["always", "never", "eventually", "inf"];
/// Words that precede a parenthesis.
const CALLED: [&str; 6] = ["reachable", "duration", "fires", "dead", "bounded", "active"];
/// Words that join conditions, and words that begin one.
const OPERATORS: [&str; 4] = ["and", "or", "leads", "to"];
const PREFIXES: [&str; 10] = [
    "always",
    "never",
    "eventually",
    "not",
    "reachable",
    "duration",
    "fires",
    "dead",
    "bounded",
    "active",
];
/// The forms of a check.
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
        let mut parser = ClaimParser { text, tokens, next: 0, depth: 0 };
        let statement = parser.parse_statement()?;
        match parser.peek() {
            GuardToken::End => Ok(Self { statement }),
            GuardToken::Close => Err(parser.error("this parenthesis closes nothing", "remove it")),
            _ if matches!(statement, Statement::Always(_) | Statement::Never(_)) => {
                Err(parser.report_unexpected("and, or, or a comparison is expected"))
            }
            _ => Err(parser.find_misspelt().unwrap_or_else(|| {
                parser.error("the check is complete before this", "write a second <check>")
            })),
        }
    }
}

struct ClaimParser<'a> {
    text: &'a str,
    tokens: Vec<(GuardToken, Range<usize>)>,
    next: usize,
    depth: usize,
}

impl ClaimParser<'_> {
    /// The last token is always the end, which is never consumed.
    fn peek(&self) -> &GuardToken {
        &self.tokens[self.next].0
    }

    fn after_next(&self) -> &GuardToken {
        self.tokens.get(self.next + 1).map_or(&GuardToken::End, |token| &token.0)
    }

    fn token_range(&self) -> Range<usize> {
        self.tokens[self.next].1.clone()
    }

    fn advance(&mut self) {
        self.next += usize::from(*self.peek() != GuardToken::End);
    }

    /// The word that is next; `known` means nothing here.
    fn peek_word(&self) -> Option<&str> {
        let (token, at) = &self.tokens[self.next];
        matches!(token, GuardToken::Name(_) | GuardToken::Known).then(|| &self.text[at.clone()])
    }

    fn is_called(&self, word: &str) -> bool {
        self.peek_word() == Some(word) && *self.after_next() == GuardToken::Open
    }

    fn take_word(&mut self, word: &str) -> bool {
        let is_next = self.peek_word() == Some(word);
        self.next += usize::from(is_next);
        is_next
    }

    fn parse_statement(&mut self) -> Result<Statement, ClaimError> {
        if self.take_word("always") {
            return Ok(match self.is_called("reachable") {
                true => Statement::AlwaysReachable(self.parse_call(Self::parse_or)?),
                false => Statement::Always(self.parse_or()?),
            });
        }
        if self.take_word("never") {
            return Ok(Statement::Never(self.parse_or()?));
        }
        if self.take_word("eventually") {
            return Ok(Statement::Eventually(self.parse_or()?));
        }
        if self.is_called("reachable") {
            return Ok(Statement::Reachable(self.parse_call(Self::parse_or)?));
        }
        if self.is_called("fires") {
            return Ok(Statement::Fires(self.parse_call(Self::parse_name)?));
        }
        if self.is_called("dead") {
            return Ok(Statement::Dead(self.parse_call(Self::parse_name)?));
        }
        if self.is_called("duration") {
            return self.parse_duration();
        }
        if self.is_called("bounded") {
            return self.parse_bounded();
        }
        self.leads_to()
    }

    fn leads_to(&mut self) -> Result<Statement, ClaimError> {
        let start = self.token_range().start;
        if *self.peek() == GuardToken::End {
            return Err(self.error("this check is empty", STATEMENTS));
        }
        let from = self.parse_or()?;
        let end = self.tokens[self.next.saturating_sub(1)].1.end;
        if self.peek_word() == Some("leads") {
            self.advance();
            if !self.take_word("to") {
                return Err(self.report_unexpected("write … leads to …"));
            }
            return Ok(Statement::LeadsTo(from, self.parse_or()?));
        }
        if *self.peek() == GuardToken::End {
            return Err(ClaimError {
                at: start..end,
                message: "this does not specify when it must be true".into(),
                remedy: "write always or never before it, or … leads to …".into(),
            });
        }
        Err(self.report_unexpected("and, or, a comparison or leads to is expected"))
    }

    fn parse_duration(&mut self) -> Result<Statement, ClaimError> {
        let until = self.parse_call(Self::parse_or)?;
        let wanted = "write duration(home) <= 20min: <, <=, > or >= and a time";
        let relation = match self.parse_relation() {
            Some(Relation::Equal | Relation::Unequal) | None => {
                return Err(self.report_unexpected(wanted));
            }
            Some(relation) => relation,
        };
        self.advance();
        let GuardToken::Number(number, unit) = *self.peek() else {
            return Err(self.report_unexpected(wanted));
        };
        let Some(unit) = unit.filter(|unit| unit.dimension == Dimension::Time) else {
            let remedy = match unit {
                Some(unit) if unit.name == "m" => format!("did you mean {number}min?"),
                _ => "write it with a unit of time: 90s, 20min or 1.5h".into(),
            };
            return Err(self.error("this is not a time", &remedy));
        };
        let limit = Duration::try_from_secs_f64(number * unit.to_si);
        let limit = limit.map_err(|_| self.error("this is too long", "write a shorter time"))?;
        self.advance();
        Ok(Statement::Duration { until, relation, limit })
    }

    fn parse_bounded(&mut self) -> Result<Statement, ClaimError> {
        let place = self.parse_call(Self::parse_name)?;
        let Some(relation) = self.parse_relation() else {
            return Ok(Statement::Bounded(place, None));
        };
        let wanted = "write bounded(place) <= 3, or bounded(place) alone";
        let is_strict = match relation {
            Relation::LessOrEqual => false,
            Relation::Less => true,
            _ => return Err(self.report_unexpected(wanted)),
        };
        self.advance();
        let GuardToken::Number(..) = self.peek() else {
            return Err(self.report_unexpected(wanted));
        };
        let limit = self.tokens_of_number()?;
        let most = u32::try_from(limit).ok().and_then(|n| n.checked_sub(u32::from(is_strict)));
        let most = most.ok_or_else(|| {
            self.error("no place can have so many tokens", "write a whole number")
        })?;
        self.advance();
        Ok(Statement::Bounded(place, Some(most)))
    }

    /// `word ( inner )`.
    fn parse_call<T>(
        &mut self,
        inner: fn(&mut Self) -> Result<T, ClaimError>,
    ) -> Result<T, ClaimError> {
        self.advance();
        self.parse_parenthesis(inner)
    }

    fn parse_parenthesis<T>(
        &mut self,
        inner: fn(&mut Self) -> Result<T, ClaimError>,
    ) -> Result<T, ClaimError> {
        let open = self.token_range();
        self.enter_nested()?;
        self.advance();
        let inner = inner(self)?;
        match self.peek() {
            GuardToken::Close => self.advance(),
            GuardToken::End => {
                return Err(ClaimError {
                    at: open,
                    message: "this parenthesis is not closed".into(),
                    remedy: "write ) where it ends".into(),
                });
            }
            _ => return Err(self.report_unexpected("an operator or ) is expected")),
        }
        self.depth -= 1;
        Ok(inner)
    }

    fn parse_or(&mut self) -> Result<Formula, ClaimError> {
        let mut left = self.parse_and()?;
        while *self.peek() == GuardToken::Operator(GuardOperator::Or) {
            self.advance();
            left = Formula::Or(Box::new(left), Box::new(self.parse_and()?));
        }
        Ok(left)
    }

    fn parse_and(&mut self) -> Result<Formula, ClaimError> {
        let mut left = self.parse_not()?;
        while *self.peek() == GuardToken::Operator(GuardOperator::And) {
            self.advance();
            left = Formula::And(Box::new(left), Box::new(self.parse_not()?));
        }
        Ok(left)
    }

    fn parse_not(&mut self) -> Result<Formula, ClaimError> {
        match self.peek() {
            GuardToken::Not => {
                self.enter_nested()?;
                self.advance();
                let inner = self.parse_not()?;
                self.depth -= 1;
                Ok(Formula::Not(Box::new(inner)))
            }
            GuardToken::Open => self.parse_parenthesis(Self::parse_or),
            GuardToken::True | GuardToken::False => {
                let truth = *self.peek() == GuardToken::True;
                self.advance();
                Ok(Formula::Truth(truth))
            }
            _ if self.is_called("active") => {
                Ok(Formula::Active(self.parse_call(Self::parse_name)?))
            }
            _ => self.parse_comparison(),
        }
    }

    fn parse_comparison(&mut self) -> Result<Formula, ClaimError> {
        let mut left = self.parse_sum()?;
        let Some(relation) = self.parse_relation() else {
            if left.number == 0 && left.places.len() == 1 {
                return Ok(Formula::Marked(left.places.remove(0)));
            }
            return Err(self.report_unexpected("a comparison is expected: a + b <= 1"));
        };
        self.advance();
        let right = self.parse_sum()?;
        if self.parse_relation().is_some() {
            let remedy = "write a < b and b < c";
            return Err(self.error("comparisons cannot be chained", remedy));
        }
        Ok(Formula::Compare(left, relation, right))
    }

    fn parse_sum(&mut self) -> Result<Sum, ClaimError> {
        let mut sum = Sum::default();
        loop {
            match self.peek() {
                GuardToken::Number(..) => {
                    // As many numbers as fit a text of bounded length do not overflow.
                    sum.number += self.tokens_of_number()?;
                    self.advance();
                }
                _ => sum.places.push(self.parse_name()?),
            }
            if *self.peek() != GuardToken::Operator(GuardOperator::Plus) {
                return Ok(sum);
            }
            self.advance();
        }
    }

    /// The number that is next, as a count of tokens.
    fn tokens_of_number(&self) -> Result<u64, ClaimError> {
        let text = &self.text[self.token_range()];
        let count = text.parse::<u32>().map(u64::from);
        count.map_err(|_| self.error("this is not a count of tokens", "write a whole number"))
    }

    fn parse_relation(&self) -> Option<Relation> {
        Some(match self.peek() {
            GuardToken::Operator(GuardOperator::Less) => Relation::Less,
            GuardToken::Operator(GuardOperator::LessOrEqual) => Relation::LessOrEqual,
            GuardToken::Operator(GuardOperator::Greater) => Relation::Greater,
            GuardToken::Operator(GuardOperator::GreaterOrEqual) => Relation::GreaterOrEqual,
            GuardToken::Operator(GuardOperator::Equal) => Relation::Equal,
            GuardToken::Operator(GuardOperator::Unequal) => Relation::Unequal,
            _ => return None,
        })
    }

    fn parse_name(&mut self) -> Result<Name, ClaimError> {
        let Some(word) = self.peek_word() else {
            return Err(
                self.report_unexpected("the name of a place is expected, or a number of tokens")
            );
        };
        let (word, at) = (word.to_owned(), self.token_range());
        if RESERVED.contains(&word.as_str()) {
            let remedy = match self.next {
                0 => "write the condition after it".to_owned(),
                _ => "the words always, never and eventually begin a check; rename a place of \
                      that name"
                    .into(),
            };
            return Err(self.error(&format!("{word} is not expected here"), &remedy));
        }
        if *self.after_next() == GuardToken::Open {
            let message = match CALLED.contains(&word.as_str()) {
                true => format!("{word}(…) is not expected here"),
                false => format!("there is nothing called {word}(…)"),
            };
            let remedy = match word.as_str() {
                "active" => "name a transition or place here".into(),
                _ if CALLED.contains(&word.as_str()) => "a check has one such statement".into(),
                word => suggest_similar(word, PREFIXES.into_iter())
                    .unwrap_or_else(|| STATEMENTS.to_owned()),
            };
            return Err(self.error(&message, &remedy));
        }
        if word.split('.').any(str::is_empty) {
            let remedy =
                "write the name of a place; one of a sub-mission is written sub-mission.place";
            return Err(self.error(&format!("`{word}` is not a name"), remedy));
        }
        self.advance();
        Ok(Name { text: word, at })
    }

    fn enter_nested(&mut self) -> Result<(), ClaimError> {
        self.depth += 1;
        if self.depth <= MAX_DEPTH {
            return Ok(());
        }
        let remedy = format!("at most {MAX_DEPTH} parentheses and nots may be nested");
        Err(self.error("this is nested too deeply", &remedy))
    }

    fn find_misspelt(&self) -> Option<ClaimError> {
        let (at, remedy) = find_misspelt(&self.tokens, self.next, &OPERATORS, &PREFIXES)?;
        let message = format!("`{}` is not a word of checks", &self.text[at.clone()]);
        Some(ClaimError { at, message, remedy })
    }

    /// `leads_to` written as one word.
    fn find_joined_leads_to(&self) -> Option<ClaimError> {
        let word = self.peek_word()?;
        let letters = word.chars().filter(|letter| letter.is_alphanumeric());
        let is_meant = letters.collect::<String>().eq_ignore_ascii_case("leadsto");
        let message = format!("`{word}` is not a word of checks");
        is_meant.then(|| self.error(&message, "did you mean leads to?"))
    }

    fn report_unexpected(&self, wanted: &str) -> ClaimError {
        if let Some(joined) = self.find_joined_leads_to() {
            return joined;
        }
        if let Some(misspelt) = self.find_misspelt() {
            return misspelt;
        }
        let message = match self.peek() {
            GuardToken::End => "the check ends here".to_owned(),
            _ => format!("{} is not expected here", &self.text[self.token_range()]),
        };
        let before = self.next.checked_sub(1).map(|index| &self.text[self.tokens[index].1.clone()]);
        if let Some(word) = before.filter(|word| CALLED.contains(word))
            && self.peek_word().is_some()
        {
            return self.error(
                &message,
                &format!("put parentheses around what {word} is about: {word}(…)"),
            );
        }
        self.error(&message, wanted)
    }

    fn error(&self, message: &str, remedy: &str) -> ClaimError {
        ClaimError { at: self.token_range(), message: message.into(), remedy: remedy.into() }
    }
}
