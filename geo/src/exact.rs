//! Exact sums and products of floating point numbers, as expansions (J. R. Shewchuk, *Adaptive
//! Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates*, Discrete &
//! Computational Geometry 18, 1997). They decide what rounded arithmetic leaves open.

use std::cmp::Ordering;

/// An exact number: the sum of its components, which do not overlap and grow in magnitude.
#[derive(Clone, Debug, Default)]
pub(crate) struct Expansion(Vec<f64>);

impl Expansion {
    pub(crate) fn of(value: f64) -> Self {
        if value == 0.0 { Self::default() } else { Self(vec![value]) }
    }

    /// `a - b`, exactly.
    pub(crate) fn difference(a: f64, b: f64) -> Self {
        Self::of(a).plus_float(-b)
    }

    /// Shewchuk's GROW-EXPANSION, without the zeros.
    fn plus_float(&self, value: f64) -> Self {
        let mut components = Vec::with_capacity(self.0.len() + 1);
        let mut carried = value;
        for &component in &self.0 {
            let (sum, error) = two_sum(carried, component);
            push_nonzero(&mut components, error);
            carried = sum;
        }
        push_nonzero(&mut components, carried);
        Self(components)
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        other.0.iter().fold(self.clone(), |sum, component| sum.plus_float(*component))
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        other.0.iter().fold(self.clone(), |sum, component| sum.plus_float(-component))
    }

    /// Shewchuk's SCALE-EXPANSION, without the zeros.
    fn times_float(&self, factor: f64) -> Self {
        let mut components = Vec::with_capacity(2 * self.0.len());
        let mut carried = 0.0;
        for &component in &self.0 {
            let (product, product_error) = two_product(component, factor);
            let (sum, sum_error) = two_sum(carried, product_error);
            push_nonzero(&mut components, sum_error);
            let (high, high_error) = two_sum(product, sum);
            push_nonzero(&mut components, high_error);
            carried = high;
        }
        push_nonzero(&mut components, carried);
        Self(components)
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        other
            .0
            .iter()
            .fold(Self::default(), |sum, component| sum.plus(&self.times_float(*component)))
    }

    pub(crate) fn squared(&self) -> Self {
        self.times(self)
    }

    /// Against zero. The last component exceeds the sum of the others.
    pub(crate) fn sign(&self) -> Ordering {
        self.0.last().map_or(Ordering::Equal, |last| last.total_cmp(&0.0))
    }
}

fn push_nonzero(components: &mut Vec<f64>, value: f64) {
    if value != 0.0 {
        components.push(value);
    }
}

/// Knuth's sum and its rounding error.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// A product and its rounding error.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

#[cfg(test)]
mod tests {
    use num_bigint::BigInt;
    use num_rational::BigRational;

    use super::*;

    fn rational(value: f64) -> BigRational {
        BigRational::from_float(value).unwrap()
    }

    fn sum_of(expansion: &Expansion) -> BigRational {
        let zero = BigRational::from_integer(BigInt::from(0));
        expansion.0.iter().fold(zero, |sum, component| sum + rational(*component))
    }

    #[test]
    fn sums_products_and_signs_are_those_of_rationals() {
        let mut random = fastrand::Rng::with_seed(19);
        let mut float = || {
            let exponent = random.i32(-40..27);
            (random.f64() - 0.5) * 2_f64.powi(exponent)
        };
        for _ in 0..2_000 {
            let [a, b, c, d] = [float(), float(), float(), float()];
            let left = Expansion::difference(a, b);
            let right = Expansion::difference(c, d).plus(&Expansion::of(a));
            let product = left.times(&right).squared().minus(&left);
            let exact_left = rational(a) - rational(b);
            let exact_right = rational(c) - rational(d) + rational(a);
            let root = &exact_left * &exact_right;
            let expected = &root * &root - &exact_left;
            assert_eq!(sum_of(&product), expected, "{a} {b} {c} {d}");
            let zero = BigRational::from_integer(BigInt::from(0));
            assert_eq!(product.sign(), expected.cmp(&zero), "{a} {b} {c} {d}");
        }
    }

    #[test]
    fn what_cancels_is_zero() {
        let expansion = Expansion::difference(0.1, 0.3).squared();
        assert_eq!(expansion.minus(&expansion).sign(), Ordering::Equal);
    }
}
