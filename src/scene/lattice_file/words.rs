//! The words of a text, with their places.

use std::fmt;
use std::str::SplitWhitespace;

use crate::suggestion::quoted;

/// What is wrong, and where: as it follows a file's path and a colon.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TextFault {
    /// From 1; 0 stands for the end, or the whole.
    pub(super) line: usize,
    pub(super) message: String,
}

impl fmt::Display for TextFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, " {}", self.message),
            line => write!(f, "{line}: {}", self.message),
        }
    }
}

/// A fault at a line.
pub(super) fn fault(line: usize, message: impl Into<String>) -> TextFault {
    TextFault { line, message: message.into() }
}

/// Words separated by white space, over lines.
pub(super) struct Words<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    words: SplitWhitespace<'a>,
    line: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { lines: text.lines().enumerate(), words: "".split_whitespace(), line: 0 }
    }

    /// The next word and its line.
    pub(super) fn next(&mut self) -> Option<(usize, &'a str)> {
        loop {
            if let Some(word) = self.words.next() {
                return Some((self.line, word));
            }
            let (index, line) = self.lines.next()?;
            (self.words, self.line) = (line.split_whitespace(), index + 1);
        }
    }

    /// The next word as a number of a kind.
    pub(super) fn number<T: Number>(&mut self, what: impl Fn() -> String) -> Result<T, TextFault> {
        match self.next() {
            Some((line, word)) => number(word).ok_or_else(|| {
                fault(line, format!("{} is not {}; {} is needed", quoted(word), T::NAME, what()))
            }),
            None => Err(fault(0, format!("ends where {} is needed", what()))),
        }
    }
}

/// Kinds of numbers.
pub(super) trait Number: std::str::FromStr {
    /// With its article.
    const NAME: &'static str;

    /// Whether it may stand in a file.
    fn is_valid(&self) -> bool;
}

impl Number for f64 {
    const NAME: &'static str = "a finite number";

    fn is_valid(&self) -> bool {
        self.is_finite()
    }
}

impl Number for usize {
    const NAME: &'static str = "a whole number";

    fn is_valid(&self) -> bool {
        true
    }
}

/// A word as a number.
pub(super) fn number<T: Number>(word: &str) -> Option<T> {
    word.parse().ok().filter(T::is_valid)
}
