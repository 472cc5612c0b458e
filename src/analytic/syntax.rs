//! How expressions of u and v are written, and the trees that they are read as.

use std::f64::consts;
use std::ops::Range;

use thiserror::Error;
use winnow::Parser;
use winnow::ascii::{digit0, digit1};
use winnow::combinator::{Infix, Prefix, alt, empty, expression, fail, opt, terminated};
use winnow::error::ParserError;
use winnow::stream::Stateful;
use winnow::token::{any, one_of, take_while};

/// Most characters of an expression. They bound the depth of the tree, which is walked and dropped by recursion: a
/// sum adds a level for every term.
pub(super) const MAX_CHARACTERS: usize = 4000;

/// Most levels of parentheses, signs and powers, for which the parser calls itself.
pub(super) const MAX_NESTING: usize = 100;

/// Most characters that a message repeats of the text.
const MAX_QUOTED: usize = 40;

// how tightly operators bind
const SUM: i64 = 10;
const PRODUCT: i64 = 20;
const SIGN: i64 = 30;
const POWER: i64 = 40;

/// A function of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    /// Sine of an angle in radians.
    Sin,
    /// Cosine of an angle in radians.
    Cos,
    /// Tangent of an angle in radians.
    Tan,
    /// Inverse of the sine.
    Asin,
    /// Inverse of the cosine.
    Acos,
    /// Inverse of the tangent.
    Atan,
    /// Power of e.
    Exp,
    /// Natural logarithm.
    Ln,
    /// Square root.
    Sqrt,
    /// Absolute value.
    Abs,
}

type NamedFunction = (&'static str, Function, fn(f64) -> f64);

const FUNCTIONS: [NamedFunction; 10] = [
    ("sin", Function::Sin, libm::sin),
    ("cos", Function::Cos, libm::cos),
    ("tan", Function::Tan, libm::tan),
    ("asin", Function::Asin, libm::asin),
    ("acos", Function::Acos, libm::acos),
    ("atan", Function::Atan, libm::atan),
    ("exp", Function::Exp, libm::exp),
    ("ln", Function::Ln, libm::log),
    ("sqrt", Function::Sqrt, libm::sqrt),
    ("abs", Function::Abs, libm::fabs),
];

/// A part of an expression. Parts without u and v are numbers.
#[derive(Debug, PartialEq)]
pub(super) enum Node {
    /// A finite number.
    Number(f64),
    /// The first parameter.
    U,
    /// The second parameter.
    V,
    /// −a.
    Negate(Box<Self>),
    /// a + b.
    Add(Box<[Self; 2]>),
    /// a − b.
    Subtract(Box<[Self; 2]>),
    /// a · b.
    Multiply(Box<[Self; 2]>),
    /// a / b.
    Divide(Box<[Self; 2]>),
    /// a to the power of b.
    Power(Box<[Self; 2]>),
    /// A function of a.
    Call(Function, Box<Self>),
}

/// The tree of the expression that a text stands for.
///
/// # Errors
/// If the text is no expression, is too long or too deeply nested, or has a constant part that is not finite.
pub(super) fn tree(text: &str) -> Result<Node, ExpressionError> {
    let count = text.chars().count();
    if count > MAX_CHARACTERS {
        let message = format!("the expression has {count} characters; {MAX_CHARACTERS} are the most");
        return Err(ExpressionError { column: MAX_CHARACTERS + 1, message });
    }
    let content = text.trim_end();
    if content.is_empty() {
        return Err(ExpressionError { column: 1, message: "the expression is empty".to_owned() });
    }
    let state = State { text: content, nesting: 0, operand: 0..0 };
    let mut input = Input { input: content.trim_start(), state };
    let root = formula(&mut input)?.node;
    if !input.is_empty() {
        return Err(fault(&input, position(&input), "this ) closes nothing"));
    }
    Ok(root)
}

/// Why a text is not an expression. `column` counts characters from 1.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("column {column}: {message}")]
pub struct ExpressionError {
    /// Where the fault is: after the last character if something is missing there.
    pub column: usize,
    /// What the fault is.
    pub message: String,
}

/// While parsing, column 0 stands for no fault yet: another parser may take the input.
impl<'t> ParserError<Input<'t>> for ExpressionError {
    type Inner = Self;

    fn from_input(_: &Input<'t>) -> Self {
        Self { column: 0, message: String::new() }
    }

    fn is_backtrack(&self) -> bool {
        self.column == 0
    }

    fn into_inner(self) -> Result<Self, Self> {
        Ok(self)
    }
}

type Input<'t> = Stateful<&'t str, State<'t>>;
type Parsed<T> = Result<T, ExpressionError>;

#[derive(Debug)]
struct State<'t> {
    /// The whole text, of which the input is what is left.
    text: &'t str,
    /// Open parentheses, signs and powers.
    nesting: usize,
    /// Where the last complete operand is.
    operand: Range<usize>,
}

/// A part of the expression with its place in the text, to where the next token begins.
struct Operand {
    node: Node,
    range: Range<usize>,
}

fn position(input: &Input<'_>) -> usize {
    input.state.text.len() - input.len()
}

fn fault(input: &Input<'_>, at: usize, message: impl Into<String>) -> ExpressionError {
    ExpressionError { column: input.state.text[..at].chars().count() + 1, message: message.into() }
}

fn quoted(text: &str) -> String {
    let text = text.trim_end();
    match text.char_indices().nth(MAX_QUOTED) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

fn finite(input: &Input<'_>, value: f64, range: Range<usize>, at: usize) -> Parsed<Node> {
    if value.is_finite() {
        return Ok(Node::Number(value));
    }
    Err(fault(input, at, format!("{} is not a finite number", quoted(&input.state.text[range]))))
}

fn token<'t, T>(
    parser: impl Parser<Input<'t>, T, ExpressionError>,
) -> impl Parser<Input<'t>, T, ExpressionError> {
    terminated(parser, take_while(0.., char::is_whitespace))
}

fn numeral<'t>(input: &mut Input<'t>) -> Parsed<&'t str> {
    let digits = alt(((digit1, opt(('.', digit0))).void(), ('.', digit1).void()));
    let exponent = (one_of(['e', 'E']), opt(one_of(['+', '-'])), digit1);
    (digits, opt(exponent)).take().parse_next(input)
}

fn word<'t>(input: &mut Input<'t>) -> Parsed<&'t str> {
    let more = |c: char| c.is_alphabetic() || c.is_ascii_digit() || c == '_';
    (one_of(char::is_alphabetic), take_while(0.., more)).take().parse_next(input)
}

fn formula(input: &mut Input<'_>) -> Parsed<Operand> {
    expression(operand).prefix(sign).infix(operator).parse_next(input)
}

fn operand(input: &mut Input<'_>) -> Parsed<Operand> {
    let start = position(input);
    let node = match input.chars().next() {
        Some('+' | '-') => return fail.parse_next(input),
        Some('(') => parenthesised(input)?,
        Some('0'..='9' | '.') => number(input)?,
        Some(c) if c.is_alphabetic() => name(input)?,
        _ => return Err(no_operand(input)),
    };
    let range = start..position(input);
    input.state.operand = range.clone();
    Ok(Operand { node, range })
}

fn parenthesised(input: &mut Input<'_>) -> Parsed<Node> {
    let start = position(input);
    nest(input)?;
    token('(').parse_next(input)?;
    let inner = formula(input)?;
    if opt(token(')')).parse_next(input)?.is_none() {
        return Err(fault(input, start, "this ( is never closed"));
    }
    input.state.nesting -= 1;
    Ok(inner.node)
}

fn nest(input: &mut Input<'_>) -> Parsed<()> {
    if input.state.nesting == MAX_NESTING {
        let message = format!("parentheses, signs and powers are nested deeper than {MAX_NESTING} levels");
        return Err(fault(input, position(input), message));
    }
    input.state.nesting += 1;
    Ok(())
}

fn number(input: &mut Input<'_>) -> Parsed<Node> {
    let start = position(input);
    let Some(digits) = opt(numeral).parse_next(input)? else { return Err(unexpected(input)) };
    if input.starts_with('.') {
        let message = format!("unexpected . after the number {}", quoted(digits));
        return Err(fault(input, position(input), message));
    }
    token(empty).parse_next(input)?;
    let value = digits.parse().unwrap_or(f64::INFINITY);
    if value == f64::INFINITY {
        return Err(fault(input, start, format!("the number {} is too large", quoted(digits))));
    }
    Ok(Node::Number(value))
}

fn name(input: &mut Input<'_>) -> Parsed<Node> {
    let start = position(input);
    let name = token(word).parse_next(input)?;
    match name {
        "u" => return Ok(Node::U),
        "v" => return Ok(Node::V),
        "pi" => return Ok(Node::Number(consts::PI)),
        "e" => return Ok(Node::Number(consts::E)),
        _ => {}
    }
    let Some((_, function, value)) = FUNCTIONS.into_iter().find(|(known, ..)| *known == name) else {
        return Err(fault(input, start, unknown(name)));
    };
    if !input.starts_with('(') {
        let message = format!("{name} needs its argument in parentheses: {name}(…)");
        return Err(fault(input, start, message));
    }
    match parenthesised(input)? {
        Node::Number(argument) => finite(input, value(argument), start..position(input), start),
        argument => Ok(Node::Call(function, Box::new(argument))),
    }
}

fn sign<'t>(input: &mut Input<'t>) -> Parsed<Prefix<Input<'t>, Operand, ExpressionError>> {
    nest(input)?;
    Ok(match token(one_of(['+', '-'])).parse_next(input)? {
        '+' => Prefix(SIGN, |input, a| Ok(signed(input, a, |node| node))),
        _ => Prefix(SIGN, |input, a| {
            Ok(signed(input, a, |node| match node {
                Node::Number(value) => Node::Number(-value),
                node => Node::Negate(Box::new(node)),
            }))
        }),
    })
}

fn signed(input: &mut Input<'_>, operand: Operand, apply: fn(Node) -> Node) -> Operand {
    input.state.nesting -= 1;
    let Range { start, end } = operand.range;
    let start = input.state.text[..start].rfind(['+', '-']).unwrap_or(start);
    Operand { node: apply(operand.node), range: start..end }
}

fn operator<'t>(input: &mut Input<'t>) -> Parsed<Infix<Input<'t>, Operand, ExpressionError>> {
    if input.starts_with("**") {
        return Err(fault(input, position(input), "a power is written a^b, not a**b"));
    }
    let infix = match input.chars().next() {
        Some('+') => Infix::Left(SUM, |input, a, b| binary(input, [a, b], |a, b| a + b, Node::Add)),
        Some('-') => Infix::Left(SUM, |input, a, b| binary(input, [a, b], |a, b| a - b, Node::Subtract)),
        Some('*') => Infix::Left(PRODUCT, |input, a, b| binary(input, [a, b], |a, b| a * b, Node::Multiply)),
        Some('/') => Infix::Left(PRODUCT, |input, a, b| binary(input, [a, b], |a, b| a / b, Node::Divide)),
        Some('^') => {
            // nothing binds tighter, so this ^ is not given back to be read again
            nest(input)?;
            Infix::Right(POWER, |input: &mut Input<'t>, a, b| {
                input.state.nesting -= 1;
                binary(input, [a, b], libm::pow, Node::Power)
            })
        }
        Some(')') | None => return fail.parse_next(input),
        Some(_) => return Err(no_operator(input)),
    };
    token(any).parse_next(input)?;
    Ok(infix)
}

fn binary(
    input: &Input<'_>,
    [a, b]: [Operand; 2],
    value: fn(f64, f64) -> f64,
    node: fn(Box<[Node; 2]>) -> Node,
) -> Parsed<Operand> {
    let range = a.range.start..b.range.end;
    let node = match (a.node, b.node) {
        (Node::Number(left), Node::Number(right)) => {
            finite(input, value(left, right), range.clone(), a.range.end)?
        }
        (left, right) => node(Box::new([left, right])),
    };
    Ok(Operand { node, range })
}

/// The fault where an operand should begin and none does.
fn no_operand(input: &Input<'_>) -> ExpressionError {
    let at = position(input);
    let before = input.state.text[..at].trim_end().chars().next_back();
    let message = match (before, input.chars().next()) {
        (Some(before), None | Some('*' | '/' | '^' | ')')) => format!("an operand is missing after {before}"),
        (None, Some(next @ ('*' | '/' | '^' | ')'))) => format!("an operand is missing before {next}"),
        _ => return unexpected(input),
    };
    fault(input, at, message)
}

/// The fault after an operand that neither an operator nor a closing parenthesis follows.
fn no_operator(input: &mut Input<'_>) -> ExpressionError {
    let at = position(input);
    let Ok(next) = token(alt((numeral, word, "("))).parse_next(input) else { return unexpected(input) };
    let next = quoted(next);
    let left = quoted(&input.state.text[input.state.operand.clone()]);
    let right = match next.as_str() {
        "(" => "(…)",
        _ if input.starts_with('(') => &format!("{next}(…)"),
        next => next,
    };
    fault(input, at, format!("an operator is missing before {next}; write {left}*{right}"))
}

fn unexpected(input: &Input<'_>) -> ExpressionError {
    let found = input.chars().next().unwrap_or_default();
    let hint = match found {
        ',' => "; decimals are written with a point, and functions take one argument",
        '−' | '–' => "; did you mean -?",
        '×' | '·' | '⋅' => "; did you mean *?",
        '÷' | ':' => "; did you mean /?",
        '²' => "; did you mean ^2?",
        '³' => "; did you mean ^3?",
        '[' | '{' => "; did you mean (?",
        ']' | '}' => "; did you mean )?",
        _ => "",
    };
    fault(input, position(input), format!("unexpected character {found:?}{hint}"))
}

fn unknown(name: &str) -> String {
    let known: Vec<_> = ["u", "v", "pi", "e"].into_iter().chain(FUNCTIONS.map(|(name, ..)| name)).collect();
    let lower = name.to_lowercase();
    let meant = match lower.as_str() {
        "log" => Some("ln"),
        "arcsin" => Some("asin"),
        "arccos" => Some("acos"),
        "arctan" => Some("atan"),
        "π" => Some("pi"),
        "pow" | "power" => Some("a^b"),
        "uv" => Some("u*v"),
        other => known.iter().copied().find(|known| *known == other),
    };
    let hint = meant.map(|meant| format!("; did you mean {meant}?")).unwrap_or_default();
    format!("unknown name {:?} (known: {}){hint}", quoted(name), known.join(", "))
}
