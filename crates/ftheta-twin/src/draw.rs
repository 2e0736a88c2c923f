//! The generator behind hidden heads: the same numbers from a seed as `numpy.random.default_rng`,
//! so that a head here is the reference's head of that seed.
//!
//! Source: M. E. O'Neill 2014, PCG XSL-RR 128/64, and her seed sequence (both as numpy documents
//! them).

/// Multiplier of the 128-bit generator.
const MULTIPLIER: u128 = 0x2360_ed05_1fc6_5da4_4385_df64_9fcc_f645;

/// Draws numbers from a seed.
pub struct Draw {
    state: u128,
    increment: u128,
}

impl Draw {
    /// Starts at a seed.
    pub fn new(seed: u64) -> Self {
        let [a, b, c, d] = seed_words(seed).map(u128::from);
        let increment = ((c << 64 | d) << 1) | 1;
        let mut draw = Self { state: 0, increment };
        draw.step();
        draw.state = draw.state.wrapping_add(a << 64 | b);
        draw.step();
        draw
    }

    /// A number from [-`half_width`, `half_width`).
    pub fn within(&mut self, half_width: f64) -> f64 {
        -half_width + 2.0 * half_width * self.unit()
    }

    /// A number from [0, 1).
    fn unit(&mut self) -> f64 {
        self.step();
        let folded = (self.state >> 64) as u64 ^ self.state as u64;
        let word = folded.rotate_right((self.state >> 122) as u32);
        (word >> 11) as f64 / (1u64 << 53) as f64
    }

    fn step(&mut self) {
        self.state = self.state.wrapping_mul(MULTIPLIER).wrapping_add(self.increment);
    }
}

/// Four words that depend on every bit of the seed.
fn seed_words(seed: u64) -> [u64; 4] {
    let mix = |x: u32, y: u32| {
        let mixed = 0xca01_f9ddu32.wrapping_mul(x).wrapping_sub(0x4973_f715u32.wrapping_mul(y));
        mixed ^ mixed >> 16
    };
    let mut hash = Hash { constant: 0x43b0_d7e5, multiplier: 0x931e_8875 };
    let mut pool = [seed as u32, (seed >> 32) as u32, 0, 0].map(|word| hash.mixed(word));
    for source in 0..4 {
        for target in (0..4).filter(|&target| target != source) {
            pool[target] = mix(pool[target], hash.mixed(pool[source]));
        }
    }
    let mut hash = Hash { constant: 0x8b51_f9dd, multiplier: 0x58f3_8ded };
    let halves: [u64; 8] = std::array::from_fn(|index| u64::from(hash.mixed(pool[index % 4])));
    std::array::from_fn(|index| halves[2 * index] | halves[2 * index + 1] << 32)
}

struct Hash {
    constant: u32,
    multiplier: u32,
}

impl Hash {
    fn mixed(&mut self, word: u32) -> u32 {
        let value = word ^ self.constant;
        self.constant = self.constant.wrapping_mul(self.multiplier);
        let value = value.wrapping_mul(self.constant);
        value ^ value >> 16
    }
}

#[cfg(test)]
mod tests {
    use super::Draw;

    /// `numpy.random.default_rng(seed).uniform(-1.7, 1.7, n)` of numpy 2.4.
    #[test]
    fn draws_are_numpys() {
        let first = [0.425_324_586_455_867_9, 1.350_526_923_296_556_7, 0.937_331_346_833_657_9];
        let second = [1.142_868_446_488_629_8, -0.623_206_212_997_746];
        for (seed, expected) in [(7, &first[..]), (12_345_678_901, &second)] {
            let mut draw = Draw::new(seed);
            expected.iter().for_each(|&number| assert_eq!(draw.within(1.7), number));
        }
    }
}
