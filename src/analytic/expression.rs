//! Expressions of u and v, as scene files give them.

use super::branch::SelectBranch;
use super::jet::Jet;
use super::number::Number;
use super::program::Program;
use super::syntax::{ExpressionError, tree};

/// An expression of u and v.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    text: String,
    program: Program,
}

impl Expression {
    /// The expression that a text stands for.
    ///
    /// # Errors
    /// If the text is no expression, is too long or too deeply nested, or has a constant part that is not finite.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        Ok(Self { text: text.to_owned(), program: Program::from_tree(&tree(text)?) })
    }

    /// The text as it was given.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// How often it asks for the sign of something.
    pub(super) fn sign_queries(&self) -> usize {
        self.program.sign_queries()
    }

    /// The value at (u, v).
    pub(super) fn at<T: Number, const N: usize>(
        &self,
        uv: &[Jet<T, N>; 2],
        choose: &mut dyn SelectBranch<T>,
    ) -> Jet<T, N> {
        self.program.run(uv, choose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::branch::ByValue;
    use std::f64::consts;

    use crate::analytic::syntax::{MAX_CHARACTERS, MAX_NESTING, Node};

    fn value(text: &str, u: f64, v: f64) -> f64 {
        parse(text).at(&[u, v].map(Jet::<f64, 1>::constant), &mut ByValue).value()
    }

    fn parse(text: &str) -> Expression {
        Expression::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    fn fault(text: &str) -> String {
        Expression::parse(text).expect_err(text).to_string()
    }

    #[test]
    fn closed_forms() {
        let (u, v) = (0.3_f64, 1.7_f64);
        let cases = [
            (" 2 * u + .5\t* v\n", 2.0 * u + 0.5 * v),
            ("1e-3*u + 2.*v - 2.E+1*u", 1e-3 * u + 2.0 * v - 20.0 * u),
            ("sin(u)^2 + cos (u)^2", 1.0),
            ("tan(u) - sin(u)/cos(u)", 0.0),
            ("asin(u) + acos(u) - pi/2", 0.0),
            ("atan(v)", v.atan()),
            ("ln(exp(v)) - sqrt(v^2)", 0.0),
            ("e^u - exp(u)", 0.0),
            ("abs(-v)", v),
            ("u-v-1", u - v - 1.0),
            ("u/v/2", u / v / 2.0),
            ("u-v*2", u - v * 2.0),
            ("v^u^2", v.powf(u * u)),
            ("(v^u)^2", v.powf(2.0 * u)),
            ("-v^2", -(v * v)),
            ("(-v)^2", v * v),
            ("2^-u^2*3", 2.0_f64.powf(-u * u) * 3.0),
            ("+u*-v--u", u - u * v),
        ];
        for (text, expected) in cases {
            let found = value(text, u, v);
            assert!((found - expected).abs() < 1e-14, "{text}: {found}, not {expected}");
        }
    }

    #[test]
    fn trees() {
        let product = Node::Multiply(Box::new([Node::Number(consts::TAU), Node::U]));
        assert_eq!(tree("2*pi*u").unwrap(), product);
        let square = Node::Power(Box::new([Node::U, Node::Number(2.0)]));
        assert_eq!(tree("-u^2").unwrap(), Node::Negate(Box::new(square)));
        for (text, value) in
            [("-2^2", -4.0), ("2^3^2", 512.0), ("ln(e)", 1.0), ("8/4/2", 1.0), ("1e-999", 0.0)]
        {
            assert_eq!(tree(text).unwrap(), Node::Number(value), "{text}");
        }
        assert_eq!(parse(" u ").text(), " u ");
    }

    #[test]
    fn faults() {
        let known = " (known: u, v, pi, e, sin, cos, tan, asin, acos, atan, exp, ln, sqrt, abs)";
        assert_eq!(fault("w"), format!("column 1: unknown name \"w\"{known}"));
        let cases = [
            (" \n", "1: the expression is empty"),
            ("2* ", "3: an operand is missing after *"),
            ("2 * / u", "5: an operand is missing after *"),
            ("sin( )", "6: an operand is missing after ("),
            ("*u", "1: an operand is missing before *"),
            (")", "1: an operand is missing before )"),
            ("2u", "2: an operator is missing before u; write 2*u"),
            ("2e", "2: an operator is missing before e; write 2*e"),
            ("u v", "3: an operator is missing before v; write u*v"),
            ("v + (u) (v)", "9: an operator is missing before (; write (u)*(…)"),
            ("2sin(u)", "2: an operator is missing before sin; write 2*sin(…)"),
            ("u 1e-3", "3: an operator is missing before 1e-3; write u*1e-3"),
            ("1+(u", "3: this ( is never closed"),
            ("sin(u", "4: this ( is never closed"),
            ("(u))*2", "4: this ) closes nothing"),
            ("1 + sin u", "5: sin needs its argument in parentheses: sin(…)"),
            ("u**2", "2: a power is written a^b, not a**b"),
            (
                "1,5",
                "2: unexpected character ','; decimals are written with a point, and functions take one argument",
            ),
            ("1.2.3", "4: unexpected . after the number 1.2"),
            ("u + .", "5: unexpected character '.'"),
            ("u × v", "3: unexpected character '×'; did you mean *?"),
            ("u²", "2: unexpected character '²'; did you mean ^2?"),
            ("1_000", "2: unexpected character '_'"),
            ("2*1e999", "3: the number 1e999 is too large"),
            ("u + 1/(2-2) ", "6: 1/(2-2) is not a finite number"),
            ("u*sqrt( -1 )", "3: sqrt( -1 ) is not a finite number"),
            ("-10^400", "4: 10^400 is not a finite number"),
            ("u + - 1/0", "8: - 1/0 is not a finite number"),
            ("ü×", "1: unknown name \"ü\""),
            ("inf", "1: unknown name \"inf\""),
            ("u+U", "3: unknown name \"U\"; did you mean u?"),
            ("PI", "1: unknown name \"PI\"; did you mean pi?"),
            ("log(u)", "1: unknown name \"log\"; did you mean ln?"),
            ("arctan(u)", "1: unknown name \"arctan\"; did you mean atan?"),
            ("pow(u, 2)", "1: unknown name \"pow\"; did you mean a^b?"),
        ];
        for (text, message) in cases {
            assert_eq!(fault(text).replace(known, ""), format!("column {message}"), "{text}");
        }
    }

    #[test]
    fn long_and_deep_texts_fit_the_stack() {
        let check = || {
            for text in ["u+".repeat(1999) + " u", "u*".repeat(1999) + " u", " ".repeat(3999) + "u"] {
                let parsed = parse(&text);
                assert_eq!(parsed.clone(), parsed);
            }
            let refused = format!("nested deeper than {MAX_NESTING} levels");
            for [open, close] in [["-", ""], ["(", ")"], ["u^", ""], ["abs(", ")"], ["u+u*abs(", ")"]] {
                let nested = |levels| open.repeat(levels) + "u" + &close.repeat(levels);
                parse(&[nested(MAX_NESTING), nested(MAX_NESTING)].join("+"));
                for levels in [MAX_NESTING + 1, MAX_CHARACTERS / (open.len() + close.len()) - 1] {
                    assert!(fault(&nested(levels)).ends_with(&refused), "{levels} {open}");
                }
            }
        };
        std::thread::Builder::new().stack_size(2 << 20).spawn(check).unwrap().join().unwrap();
        let message = "column 4001: the expression has 4001 characters; 4000 are the most";
        assert_eq!(fault(&("u+".repeat(2000) + "u")), message);
    }

    #[test]
    fn token_soup_never_panics() {
        let tokens =
            "u v pi e 2 .5 1e3 1e . , + - * / ^ ( ) ( ) sin( ln( sqrt ** w é − ² _ \u{a0} \0 1e308 U ";
        let tokens: Vec<_> = tokens.split(' ').collect();
        let mut state = 1_u64;
        let mut below = |end: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            usize::try_from(state >> 33).unwrap() % end
        };
        let mut good = 0;
        for _ in 0..50_000 {
            let text: String = (0..below(12)).map(|_| tokens[below(tokens.len())]).collect();
            match Expression::parse(&text) {
                Ok(parsed) => {
                    good += 1;
                    assert_eq!(parse(&format!(" ({text}) ")).program, parsed.program, "{text}");
                }
                Err(error) => {
                    assert!((1..=text.chars().count() + 1).contains(&error.column), "{text}: {error}")
                }
            }
        }
        assert!(good > 1000, "{good} of the texts are expressions");
    }
}
