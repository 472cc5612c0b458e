//! Inputs that are almost right.

#![allow(unreachable_pub, reason = "tests see it, nobody else")]
#![allow(clippy::missing_panics_doc, reason = "a test fails by panicking")]

/// Numbers at random, the same for the same seed (`SplitMix64`: Steele, Lea, Flood 2014).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Uniform in `0..count`; 0 if that is empty.
    pub fn below(&mut self, count: usize) -> usize {
        usize::try_from(self.next() % count.max(1) as u64).expect("below a usize")
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn choose<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

/// What numbers are replaced by.
const NUMBERS: [&str; 22] = [
    "0",
    "-1",
    "1e-300",
    "1e300",
    "1e160",
    "1e22",
    "1e9",
    "4294967296",
    "-2147483648",
    "65536",
    "nan",
    "inf",
    "1e400",
    "0.5e-7",
    "-0.0",
    "12",
    "3",
    "1e-12",
    "99999999999999999999",
    "[1, 2]",
    "\"x\"",
    "1_0",
];

/// Text with numbers replaced, lines left out, repeated and exchanged, and bytes changed.
pub fn mutated_text(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..*random.choose(&[1, 1, 1, 2, 4, 12]) {
        if lines.is_empty() {
            break;
        }
        let (line, other) = (random.below(lines.len()), random.below(lines.len()));
        match random.below(12) {
            0..=6 => lines[line] = with_number(&lines[line], random),
            7 => drop(lines.remove(line)),
            8 => lines.insert(other, lines[line].clone()),
            9 => lines.swap(line, other),
            10 => lines[line] = format!("{} {}", lines[line], lines[other]),
            _ => {
                lines[line] =
                    String::from_utf8_lossy(&mutated_bytes(lines[line].as_bytes(), random)).into_owned()
            }
        }
    }
    lines.join("\n") + "\n"
}

/// A line with one of its numbers replaced.
fn with_number(line: &str, random: &mut Random) -> String {
    let is_digit = |byte: u8| byte.is_ascii_digit() || byte == b'.';
    let bytes = line.as_bytes();
    let mut starts: Vec<usize> = Vec::new();
    for at in 0..bytes.len() {
        if is_digit(bytes[at])
            && (at == 0 || !(is_digit(bytes[at - 1]) || bytes[at - 1].is_ascii_alphabetic()))
        {
            starts.push(at);
        }
    }
    if starts.is_empty() {
        return line.to_owned();
    }
    let start = *random.choose(&starts);
    let end = (start..bytes.len()).find(|&at| !is_digit(bytes[at])).unwrap_or(bytes.len());
    let number = match random.below(3) {
        0 => format!("{:e}", 10.0 * (random.unit() - 0.5)),
        _ => (*random.choose(&NUMBERS)).to_owned(),
    };
    format!("{}{number}{}", &line[..start], &line[end..])
}

/// Bytes with some changed, left out, inserted and repeated, or without their end.
pub fn mutated_bytes(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    // headers decide more than what follows them
    let reach = *random.choose(&[64, 400, usize::MAX]);
    for _ in 0..*random.choose(&[1, 1, 2, 4, 8, 30]) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len().min(reach));
        let end = bytes.len().min(at + *random.choose(&[1, 2, 10, 100]));
        match random.below(10) {
            0..=3 => bytes[at] = random.next().to_le_bytes()[0],
            4 => bytes[at] ^= 1 << random.below(8),
            5 => drop(bytes.drain(at..end)),
            6 => {
                let inserted: Vec<u8> = (at..end).map(|_| random.next().to_le_bytes()[0]).collect();
                bytes.splice(at..at, inserted);
            }
            7 => {
                let word = *random.choose(&[0xffff_ffff_u32, 0, 0x7fff_ffff, 0x8000_0000, 0x4000, 1]);
                for (byte, new) in bytes[at..].iter_mut().zip(word.to_le_bytes()) {
                    *byte = new;
                }
            }
            8 => {
                let repeated = bytes[at..end].to_vec();
                bytes.splice(at..at, repeated);
            }
            _ if random.below(3) == 0 => bytes.truncate(at + 1),
            _ => {}
        }
    }
    bytes
}
