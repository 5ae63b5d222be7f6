//! Parquet's hybrid encoding of run lengths and bit packing, from known runs.
//!
//! Format: <https://parquet.apache.org/docs/file-format/data-pages/encodings/#RLE>.

/// Encodes `runs` of values below `2^bit_width`, `1 <= bit_width <= 32`.
pub fn encode(runs: impl IntoIterator<Item = (u32, usize)>, bit_width: u8) -> Vec<u8> {
    let mut encoder = Encoder { bytes: Vec::new(), literals: Vec::new(), bit_width };
    for (value, mut length) in runs {
        // Bit-packed values come in groups of eight; the run completes the last group.
        let fill = length.min((8 - encoder.literals.len() % 8) % 8);
        encoder.literals.extend(std::iter::repeat_n(value, fill));
        length -= fill;
        if length >= 8 {
            encoder.flush();
            encoder.run(value, length);
        } else {
            encoder.literals.extend(std::iter::repeat_n(value, length));
        }
    }
    encoder.flush();
    encoder.bytes
}

/// Bits of `count` distinct values, at least 1.
pub fn bit_width(count: usize) -> u8 {
    (usize::BITS - count.saturating_sub(1).leading_zeros()).max(1) as u8
}

/// Appends an integer in groups of seven bits, the lowest first.
pub fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

struct Encoder {
    bytes: Vec<u8>,
    literals: Vec<u32>,
    bit_width: u8,
}

impl Encoder {
    fn run(&mut self, value: u32, length: usize) {
        varint(&mut self.bytes, (length as u64) << 1);
        let width = usize::from(self.bit_width.div_ceil(8));
        self.bytes.extend(&value.to_le_bytes()[..width]);
    }

    fn flush(&mut self) {
        if self.literals.is_empty() {
            return;
        }
        self.literals.resize(self.literals.len().next_multiple_of(8), 0);
        varint(&mut self.bytes, (self.literals.len() as u64 / 8) << 1 | 1);
        let (mut word, mut bits) = (0_u64, 0);
        for &value in &self.literals {
            word |= u64::from(value) << bits;
            bits += u32::from(self.bit_width);
            if bits >= 32 {
                self.bytes.extend((word as u32).to_le_bytes());
                word >>= 32;
                bits -= 32;
            }
        }
        self.bytes.extend(&word.to_le_bytes()[..bits.div_ceil(8) as usize]);
        self.literals.clear();
    }
}

#[cfg(test)]
mod tests {
    //! A straightforward decoder, written from the description of the format, recovers the input.

    use super::*;

    fn decode(bytes: &[u8], bit_width: u8, count: usize) -> Vec<u32> {
        let mut values = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let (mut header, mut shift) = (0_u64, 0);
            loop {
                header |= u64::from(bytes[at] & 0x7f) << shift;
                shift += 7;
                at += 1;
                if bytes[at - 1] < 0x80 {
                    break;
                }
            }
            if header & 1 == 0 {
                let width = usize::from(bit_width).div_ceil(8);
                let value: u32 = (0..width).map(|i| u32::from(bytes[at + i]) << (8 * i)).sum();
                values.extend(std::iter::repeat_n(value, (header >> 1) as usize));
                at += width;
            } else {
                let length = (header >> 1) as usize * 8;
                for i in 0..length {
                    let bit = |j: usize| {
                        u32::from(
                            bytes[at + (i * usize::from(bit_width) + j) / 8] >> ((i * usize::from(bit_width) + j) % 8)
                                & 1,
                        )
                    };
                    values.push((0..usize::from(bit_width)).map(|j| bit(j) << j).sum::<u32>());
                }
                at += length * usize::from(bit_width) / 8;
            }
        }
        assert_eq!(at, bytes.len());
        assert!(values.len() < count + 8 && values[count..].iter().all(|&padding| padding == 0));
        values.truncate(count);
        values
    }

    #[test]
    fn runs_and_literals_survive() {
        // Lengths from a fixed linear congruence, short and long mixed.
        for bit_width in [1, 2, 3, 7, 8, 9, 16, 17, 31, 32] {
            let mut state = 12345_u64;
            let mut next = || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 33) as u32
            };
            let mask = u32::MAX >> (32 - u32::from(bit_width));
            let runs: Vec<(u32, usize)> = (0..500)
                .map(|_| {
                    let length = next() % if next() % 3 == 0 { 300 } else { 12 };
                    ((next() ^ (next() << 8)) & mask, length as usize)
                })
                .collect();
            let expanded: Vec<u32> =
                runs.iter().flat_map(|&(value, length)| std::iter::repeat_n(value, length)).collect();
            assert_eq!(decode(&encode(runs, bit_width), bit_width, expanded.len()), expanded, "{bit_width}");
        }
    }

    #[test]
    fn known_bytes() {
        assert_eq!(encode([(1, 50)], 1), [100, 1]);
        assert_eq!(encode([(300, 64)], 9), [0x80, 0x01, 0x2c, 0x01]);
        assert_eq!(encode([], 1), [0_u8; 0]);
    }

    #[test]
    fn bit_widths() {
        assert_eq!([1, 2, 3, 4, 5, 401, 65536, 65537].map(bit_width), [1, 1, 2, 2, 3, 9, 16, 17]);
    }
}
