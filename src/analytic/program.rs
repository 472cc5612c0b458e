//! Expressions as lists of operations on a stack, for numbers and discs with derivatives.

use super::choice::Choose;
use super::expression::{Function, Node};
use super::jet::Jet;
use super::number::Number;

/// Greatest whole exponent that is taken by multiplications.
const MAX_WHOLE: f64 = 64.0;

/// What happens to the numbers on top of the stack.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operation {
    Number(f64),
    U,
    V,
    Scale(f64),
    Plus(f64),
    Add,
    Subtract,
    Multiply,
    Divide,
    WholePower(i32),
    Power(f64),
    /// By a number that is not constant.
    PowerOf,
    Call(Function),
}

/// The operations of an expression, in their order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Program {
    operations: Box<[Operation]>,
    /// Greatest height of the stack.
    height: usize,
}

impl Program {
    pub(super) fn of(root: &Node) -> Self {
        let mut operations = Vec::new();
        let height = append(root, &mut operations);
        Self { operations: operations.into(), height }
    }

    /// The value at (u, v).
    pub(super) fn run<T: Number, const N: usize>(
        &self,
        uv: &[Jet<T, N>; 2],
        choose: &mut impl Choose<T>,
    ) -> Jet<T, N> {
        let mut stack: Vec<Jet<T, N>> = Vec::with_capacity(self.height);
        for operation in &self.operations {
            let top = match *operation {
                Operation::Number(value) => Jet::of(T::of(value)),
                Operation::U => uv[0],
                Operation::V => uv[1],
                Operation::Scale(factor) => pop(&mut stack).scale(factor),
                Operation::Plus(value) => pop(&mut stack).plus(value),
                Operation::WholePower(exponent) => pop(&mut stack).whole_power(exponent),
                Operation::Power(exponent) => pop(&mut stack).power(exponent),
                Operation::Call(function) => call(function, &pop(&mut stack), choose),
                Operation::Add
                | Operation::Subtract
                | Operation::Multiply
                | Operation::Divide
                | Operation::PowerOf => {
                    let (b, a) = (pop(&mut stack), pop(&mut stack));
                    match operation {
                        Operation::Add => a.add(&b),
                        Operation::Subtract => a.subtract(&b),
                        Operation::Multiply => a.multiply(&b),
                        Operation::Divide => a.divide(&b),
                        _ => b.multiply(&a.ln()).exp(),
                    }
                }
            };
            stack.push(top);
        }
        pop(&mut stack)
    }
}

fn pop<T>(stack: &mut Vec<T>) -> T {
    stack.pop().expect("operations follow their operands")
}

/// Adds the operations of a tree; returns how high they raise the stack.
#[expect(clippy::cast_possible_truncation, reason = "a whole number of at most two digits")]
fn append(node: &Node, operations: &mut Vec<Operation>) -> usize {
    let (height, operation) = match node {
        Node::Number(value) => (1, Operation::Number(*value)),
        Node::U => (1, Operation::U),
        Node::V => (1, Operation::V),
        Node::Negate(a) => (append(a, operations), Operation::Scale(-1.0)),
        Node::Add(pair) => match &**pair {
            [a, Node::Number(value)] | [Node::Number(value), a] => {
                (append(a, operations), Operation::Plus(*value))
            }
            pair => (append_both(pair, operations), Operation::Add),
        },
        Node::Subtract(pair) => match &**pair {
            [a, Node::Number(value)] => (append(a, operations), Operation::Plus(-value)),
            pair => (append_both(pair, operations), Operation::Subtract),
        },
        Node::Multiply(pair) => match &**pair {
            [a, Node::Number(factor)] | [Node::Number(factor), a] => {
                (append(a, operations), Operation::Scale(*factor))
            }
            pair => (append_both(pair, operations), Operation::Multiply),
        },
        Node::Divide(pair) => (append_both(pair, operations), Operation::Divide),
        Node::Power(pair) => match &**pair {
            [a, Node::Number(exponent)] => {
                let whole = *exponent == exponent.trunc() && exponent.abs() <= MAX_WHOLE;
                let power =
                    if whole { Operation::WholePower(*exponent as i32) } else { Operation::Power(*exponent) };
                (append(a, operations), power)
            }
            pair => (append_both(pair, operations), Operation::PowerOf),
        },
        Node::Call(function, a) => (append(a, operations), Operation::Call(*function)),
    };
    operations.push(operation);
    height
}

fn append_both([a, b]: &[Node; 2], operations: &mut Vec<Operation>) -> usize {
    append(a, operations).max(1 + append(b, operations))
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
