//! A guard as text again: one spelling for all that say the same, with no parenthesis too many.

use std::fmt::{self, Write};

use super::{Guard, Kind, Node, Operator};

const NOT: u8 = 3;
const SIGN: u8 = 7;

impl fmt::Display for Guard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.node(&self.root, 0, f)
    }
}

/// The text: places in a file do not count.
impl fmt::Debug for Guard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Guard({self})")
    }
}

impl Guard {
    /// Writes what must bind as tight as `rank`.
    fn node(&self, node: &Node, rank: u8, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let own = match &node.kind {
            Kind::Binary(operator, ..) => operator.rank(),
            Kind::Not(_) => NOT,
            Kind::Minus(_) => SIGN,
            _ => u8::MAX,
        };
        if own < rank {
            f.write_char('(')?;
            self.node(node, 0, f)?;
            return f.write_char(')');
        }
        match &node.kind {
            Kind::Number(value, unit) => {
                number(*value, f)?;
                f.write_str(unit.map_or("", |unit| unit.name))
            }
            Kind::Truth(truth) => write!(f, "{truth}"),
            Kind::Text(text) => write!(f, "'{text}'"),
            Kind::Name(index) => f.write_str(self.names[*index].as_str()),
            Kind::Known(index) => write!(f, "known({})", self.names[*index]),
            Kind::Not(inner) => {
                f.write_str("not ")?;
                self.node(inner, NOT, f)
            }
            Kind::Minus(inner) => {
                f.write_char('-')?;
                self.node(inner, SIGN, f)
            }
            Kind::Binary(operator, left, right) => {
                // A comparison has no comparison beside it; all else goes from left to right.
                self.node(left, own + u8::from(operator.is_comparison()), f)?;
                write!(f, " {} ", operator.as_str())?;
                self.node(right, own + 1, f)
            }
        }
    }
}

/// The shortest that reads back as the same number.
fn number(value: f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if value == 0.0 || (1e-4..1e15).contains(&value) {
        write!(f, "{value}")
    } else {
        write!(f, "{value:e}")
    }
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
