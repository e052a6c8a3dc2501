//! The values that an integer field can hold, as far as a file can write them.

use syn::{Error, Expr, Lit, Result, Type, parse_quote};

/// An integer type with its least and greatest value; a file writes none above `i64::MAX`.
pub(crate) struct IntegerType {
    name: String,
    low: i64,
    high: i64,
}

impl IntegerType {
    /// Returns the type that a field has; `None` if that is no integer.
    pub(crate) fn of(field: &Type) -> Option<Self> {
        let Type::Path(path) = field else { return None };
        let name = path.path.segments.last()?.ident.to_string();
        let (low, high) = match name.as_str() {
            "i8" => (i8::MIN.into(), i8::MAX.into()),
            "i16" => (i16::MIN.into(), i16::MAX.into()),
            "i32" => (i32::MIN.into(), i32::MAX.into()),
            "i64" | "isize" => (i64::MIN, i64::MAX),
            "u8" => (0, u8::MAX.into()),
            "u16" => (0, u16::MAX.into()),
            "u32" => (0, u32::MAX.into()),
            "u64" | "usize" => (0, i64::MAX),
            _ => return None,
        };
        Some(Self { name, low, high })
    }

    /// Refuses a default that the type cannot hold. One that is no whole number has another error.
    pub(crate) fn check_default(&self, default: &Lit) -> Result<()> {
        let text = match default {
            Lit::Str(text) => text.value(),
            Lit::Int(number) => number.base10_digits().to_owned(),
            _ => return Ok(()),
        };
        let Self { name, low, high } = self;
        match text.parse::<i64>() {
            Ok(number) if !(*low..=*high).contains(&number) => {
                let why = format!("`{text}` is out of range for {name}, {low} to {high}");
                Err(Error::new_spanned(default, why))
            }
            _ => Ok(()),
        }
    }

    /// Returns the range that a parameter without one has by its type; `None` for 64 bits, whose
    /// ends no file means.
    pub(crate) fn declared_range(&self) -> Option<(Expr, Expr)> {
        if self.high > u32::MAX.into() {
            return None;
        }
        let end = |number: i64| -> Expr {
            let magnitude = number.unsigned_abs() as f64;
            if number < 0 { parse_quote!(-#magnitude) } else { parse_quote!(#magnitude) }
        };
        Some((end(self.low), end(self.high)))
    }
}
