//! Values and derivatives of expressions.

use super::choice::Choose;
use super::expression::{Expression, Function, Node};
use super::jet::Jet;
use super::number::Number;

/// Greatest whole exponent that is taken by multiplications.
const MAX_WHOLE: f64 = 64.0;

/// The expression at (u, v).
pub(super) fn evaluate<T: Number, const N: usize>(
    expression: &Expression,
    uv: &[Jet<T, N>; 2],
    choose: &mut impl Choose<T>,
) -> Jet<T, N> {
    node(expression.root(), uv, choose)
}

fn node<T: Number, const N: usize>(
    root: &Node,
    uv: &[Jet<T, N>; 2],
    choose: &mut impl Choose<T>,
) -> Jet<T, N> {
    match root {
        Node::Number(value) => Jet::of(T::of(*value)),
        Node::U => uv[0],
        Node::V => uv[1],
        Node::Negate(inner) => node(inner, uv, choose).scale(-1.0),
        Node::Add(pair) => {
            let [a, b] = both(pair, uv, choose);
            a.add(&b)
        }
        Node::Subtract(pair) => {
            let [a, b] = both(pair, uv, choose);
            a.subtract(&b)
        }
        Node::Multiply(pair) => match &**pair {
            [Node::Number(factor), other] | [other, Node::Number(factor)] => {
                node(other, uv, choose).scale(*factor)
            }
            _ => {
                let [a, b] = both(pair, uv, choose);
                a.multiply(&b)
            }
        },
        Node::Divide(pair) => match &**pair {
            [dividend, Node::Number(divisor)] => node(dividend, uv, choose).scale(1.0 / divisor),
            _ => {
                let [a, b] = both(pair, uv, choose);
                a.divide(&b)
            }
        },
        Node::Power(pair) => power(pair, uv, choose),
        Node::Call(function, inner) => {
            let inner = node(inner, uv, choose);
            call(*function, &inner, choose)
        }
    }
}

fn both<T: Number, const N: usize>(
    [a, b]: &[Node; 2],
    uv: &[Jet<T, N>; 2],
    choose: &mut impl Choose<T>,
) -> [Jet<T, N>; 2] {
    [node(a, uv, choose), node(b, uv, choose)]
}

#[expect(clippy::cast_possible_truncation, reason = "a whole number of at most two digits")]
fn power<T: Number, const N: usize>(
    [base, exponent]: &[Node; 2],
    uv: &[Jet<T, N>; 2],
    choose: &mut impl Choose<T>,
) -> Jet<T, N> {
    let base = node(base, uv, choose);
    match exponent {
        Node::Number(exponent) if *exponent == exponent.trunc() && exponent.abs() <= MAX_WHOLE => {
            base.whole_power(*exponent as i32)
        }
        Node::Number(exponent) => base.power(*exponent),
        exponent => node(exponent, uv, choose).multiply(&base.ln()).exp(),
    }
}

fn call<T: Number, const N: usize>(
    function: Function,
    x: &Jet<T, N>,
    choose: &mut impl Choose<T>,
) -> Jet<T, N> {
    match function {
        Function::Sin => x.sin(),
        Function::Cos => x.cos(),
        Function::Tan => x.tan(),
        Function::Asin => x.asin(),
        Function::Acos => x.asin().scale(-1.0).plus(std::f64::consts::FRAC_PI_2),
        Function::Atan => x.atan(),
        Function::Exp => x.exp(),
        Function::Ln => x.ln(),
        Function::Sqrt => x.power(0.5),
        Function::Abs => {
            if choose.is_positive(x) {
                *x
            } else {
                x.scale(-1.0)
            }
        }
    }
}
