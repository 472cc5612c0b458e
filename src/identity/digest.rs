//! Hashes of numbers.

/// Bytes that are gathered before they are hashed: the hash is fastest on pieces of many of its blocks of 1024.
const BUFFER: usize = 1 << 16;

/// A hash (BLAKE3) of numbers as they come, without a text of them in memory.
#[derive(Debug)]
pub(super) struct Digest {
    hasher: blake3::Hasher,
    buffer: Vec<u8>,
}

impl Default for Digest {
    fn default() -> Self {
        Self { hasher: blake3::Hasher::new(), buffer: Vec::with_capacity(BUFFER) }
    }
}

impl Digest {
    /// Takes in bytes as they are.
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        if self.buffer.len() + bytes.len() > BUFFER {
            self.hasher.update(&self.buffer);
            self.buffer.clear();
        }
        if bytes.len() > BUFFER {
            self.hasher.update(bytes);
        } else {
            self.buffer.extend_from_slice(bytes);
        }
    }

    /// Takes in a number's bits.
    pub(super) fn number(&mut self, number: f64) {
        self.bytes(&number.to_le_bytes());
    }

    /// Takes in numbers, which are as many for all scenes.
    pub(super) fn numbers(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|&number| self.number(number));
    }

    /// Takes in a count, an index or a length; what follows a length cannot be taken for something else.
    pub(super) fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    /// Takes in a text and its length.
    pub(super) fn text(&mut self, text: &str) {
        self.count(text.len());
        self.bytes(text.as_bytes());
    }

    /// The first 128 bits, as 32 hexadecimal digits.
    pub(super) fn finish(mut self) -> String {
        self.hasher.update(&self.buffer);
        self.hasher.finalize().to_hex()[..32].to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_the_whole() {
        let bytes: Vec<u8> = (0..3 * BUFFER + 17).map(|i| (i / 3).to_le_bytes()[i % 3]).collect();
        let want = blake3::hash(&bytes).to_hex()[..32].to_owned();
        for piece in [7, 1000, BUFFER - 1, BUFFER, BUFFER + 1, bytes.len()] {
            let mut digest = Digest::default();
            bytes.chunks(piece).for_each(|piece| digest.bytes(piece));
            assert_eq!(digest.finish(), want, "{piece}");
        }
    }

    #[test]
    fn bits_lengths_and_order_count() {
        let hash = |take: &dyn Fn(&mut Digest)| {
            let mut digest = Digest::default();
            take(&mut digest);
            digest.finish()
        };
        let hashes = [
            hash(&|digest| digest.numbers(&[0.0, 1.0])),
            hash(&|digest| digest.numbers(&[1.0, 0.0])),
            hash(&|digest| digest.numbers(&[-0.0, 1.0])),
            hash(&|digest| digest.numbers(&[0.0, 1.0_f64.next_up()])),
            hash(&|digest| ["ab", "c"].iter().for_each(|text| digest.text(text))),
            hash(&|digest| ["a", "bc"].iter().for_each(|text| digest.text(text))),
        ];
        for (i, hash) in hashes.iter().enumerate() {
            assert!(hash.len() == 32 && !hashes[..i].contains(hash), "{i}");
        }
    }
}
