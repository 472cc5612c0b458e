//! An OBJ file's statements: lines, with those that go on in the next one joined, as words.

/// Where a physical line starts in the text, and its number from 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineAt {
    /// Byte offset.
    pub(super) start: usize,
    pub(super) number: usize,
}

/// A word of a statement, and where it stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Token<'a> {
    pub(super) text: &'a str,
    /// Byte offset of the word in the file.
    pub(super) at: usize,
    pub(super) line: LineAt,
}

/// The words of a name, which may hold spaces.
pub(super) fn joined(values: &[Token<'_>]) -> String {
    values.iter().map(|token| token.text).collect::<Vec<_>>().join(" ")
}

/// The physical lines of a text, each with where it starts and without its end: LF, CR LF, or CR alone.
struct Lines<'a> {
    text: &'a str,
    at: Option<LineAt>,
}

impl<'a> Iterator for Lines<'a> {
    type Item = (&'a str, LineAt);

    fn next(&mut self) -> Option<Self::Item> {
        let at = self.at?;
        let rest = &self.text[at.start..];
        let end = rest.bytes().position(|byte| matches!(byte, b'\n' | b'\r'));
        let line = &rest[..end.unwrap_or(rest.len())];
        self.at = end.map(|end| {
            let length = if rest[end..].starts_with("\r\n") { 2 } else { 1 };
            LineAt { start: at.start + end + length, number: at.number + 1 }
        });
        Some((line, at))
    }
}

/// Calls `take` with each statement of a file, as words without comments.
pub(super) fn for_each_statement<'a>(text: &'a str, mut take: impl FnMut(&[Token<'a>])) {
    let mut statement = Vec::new();
    let mut lines = Lines { text, at: Some(LineAt { start: 0, number: 1 }) };
    while let Some((line, line_at)) = lines.next() {
        statement.clear();
        let mut continued = add_tokens(line, line_at, &mut statement);
        while continued && let Some((line, line_at)) = lines.next() {
            continued = add_tokens(line, line_at, &mut statement);
        }
        take(&statement);
    }
}

/// Splits a physical line into words, to the comment if there is one; true if the statement goes on in the next line.
fn add_tokens<'a>(line: &'a str, line_at: LineAt, statement: &mut Vec<Token<'a>>) -> bool {
    let trimmed = line.trim_end();
    let before = statement.len();
    let (body, continued) = match trimmed.strip_suffix('\\') {
        Some(body) => (body, true),
        None => (trimmed, false),
    };
    for word in body.split_whitespace() {
        let names = matches!(statement.first(), Some(first) if matches!(first.text, "o" | "g"));
        let text = if names { word } else { before_comment(word) };
        if !text.is_empty() {
            let offset = text.as_ptr() as usize - line.as_ptr() as usize;
            statement.push(Token { text, at: line_at.start + offset, line: line_at });
        }
        if text.len() < word.len() {
            // a comment takes the rest of its line, its own backslash included
            return false;
        }
    }
    // a lone backslash on a line by itself goes on only if there is something to go on with
    continued && (statement.len() > before || before > 0)
}

/// A word to the `#` of a comment right behind it; what old C libraries print for numbers that are none is a word of its own.
fn before_comment(word: &str) -> &str {
    match word.find('#') {
        Some(_) if is_no_number(word) => word,
        Some(end) => &word[..end],
        None => word,
    }
}

/// Whether a word is what Microsoft's C library used to print for NaN and infinity: `1.#IND`, `-1.#QNAN0`, `1.#INF`.
pub(super) fn is_no_number(word: &str) -> bool {
    let Some((digits, kind)) = word.split_once(".#") else {
        return false;
    };
    let known = |name: &str| kind.get(..name.len()).is_some_and(|start| start.eq_ignore_ascii_case(name));
    digits.trim_start_matches(['+', '-']) == "1" && ["IND", "QNAN", "SNAN", "INF"].into_iter().any(known)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(text: &str) -> Vec<Vec<&str>> {
        let mut found = Vec::new();
        for_each_statement(text, |words| found.push(words.iter().map(|word| word.text).collect::<Vec<_>>()));
        found.retain(|words| !words.is_empty());
        found
    }

    #[test]
    fn lines_end_with_lf_cr_lf_or_cr() {
        let want = [vec!["v", "1"], vec!["v", "2", "3"], vec!["v", "4"]];
        for end in ["\n", "\r\n", "\r"] {
            let text = ["v 1", "v 2 \\", "3", "", "v 4"].join(end);
            assert_eq!(statements(&text), want, "{end:?}");
        }
        let mut numbers = Vec::new();
        for_each_statement("a\rb\r\nc\n\rd", |words| {
            numbers.extend(words.iter().map(|word| (word.line.number, word.at)));
        });
        assert_eq!(numbers, [(1, 0), (2, 2), (3, 5), (5, 8)]);
    }

    #[test]
    fn comments_begin_anywhere_but_in_names() {
        assert_eq!(
            statements("v 1 2 3#three 4\nf 1#\n#f 1\ng a#1 #2\n"),
            [vec!["v", "1", "2", "3"], vec!["f", "1"], vec!["g", "a#1", "#2"]]
        );
        assert_eq!(
            statements("vt -1.#IND 1.#QNAN0 1.#inf 2.#IND"),
            [vec!["vt", "-1.#IND", "1.#QNAN0", "1.#inf", "2."]]
        );
    }
}
