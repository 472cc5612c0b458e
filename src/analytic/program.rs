//! Expressions as lists of operations on a stack, for numbers and discs with derivatives.

use super::branch::SelectBranch;
use super::jet::Jet;
use super::number::Number;
use super::syntax::{Function, Node};

/// Greatest whole exponent that is taken by multiplications, a few for each of its digits.
const MAX_WHOLE: f64 = 1e9;

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
    /// How many absolute values there are.
    sign_queries: usize,
}

/// Height up to which the stack is not allocated.
const SMALL: usize = 8;

impl Program {
    pub(super) fn from_tree(root: &Node) -> Self {
        let mut operations = Vec::new();
        let height = append(root, &mut operations);
        let is_sign_query = |operation: &&Operation| **operation == Operation::Call(Function::Abs);
        let sign_queries = operations.iter().filter(is_sign_query).count();
        Self { operations: operations.into(), height, sign_queries }
    }

    /// How many signs it asks for.
    pub(super) const fn sign_queries(&self) -> usize {
        self.sign_queries
    }

    /// The value at (u, v).
    pub(super) fn run<T: Number, const N: usize>(
        &self,
        uv: &[Jet<T, N>; 2],
        choose: &mut dyn SelectBranch<T>,
    ) -> Jet<T, N> {
        let nothing = Jet::constant(T::constant(0.0));
        if self.height <= SMALL {
            self.run_on(&mut [nothing; SMALL], uv, choose)
        } else {
            self.run_on(&mut vec![nothing; self.height], uv, choose)
        }
    }

    fn run_on<T: Number, const N: usize>(
        &self,
        stack: &mut [Jet<T, N>],
        uv: &[Jet<T, N>; 2],
        choose: &mut dyn SelectBranch<T>,
    ) -> Jet<T, N> {
        let mut height = 0;
        for operation in &self.operations {
            let (operands, made) = match *operation {
                Operation::Number(value) => (0, Jet::constant(T::constant(value))),
                Operation::U => (0, uv[0]),
                Operation::V => (0, uv[1]),
                Operation::Scale(factor) => (1, stack[height - 1].scale(factor)),
                Operation::Plus(value) => (1, stack[height - 1].plus(value)),
                Operation::WholePower(exponent) => (1, stack[height - 1].whole_power(exponent)),
                Operation::Power(exponent) => (1, stack[height - 1].power(exponent)),
                Operation::Call(function) => (1, call(function, &stack[height - 1], choose)),
                Operation::Add => (2, stack[height - 2].add(&stack[height - 1])),
                Operation::Subtract => (2, stack[height - 2].subtract(&stack[height - 1])),
                Operation::Multiply => (2, stack[height - 2].multiply(&stack[height - 1])),
                Operation::Divide => (2, stack[height - 2].divide(&stack[height - 1])),
                Operation::PowerOf => (2, stack[height - 1].multiply(&stack[height - 2].ln()).exp()),
            };
            height -= operands;
            stack[height] = made;
            height += 1;
        }
        stack[0]
    }
}

/// Adds the operations of a tree; returns how high they raise the stack.
#[expect(clippy::cast_possible_truncation, reason = "a whole number of at most ten digits")]
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
    choose: &mut dyn SelectBranch<T>,
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
            if choose.is_positive(x.to_linear()) {
                *x
            } else {
                x.scale(-1.0)
            }
        }
    }
}
