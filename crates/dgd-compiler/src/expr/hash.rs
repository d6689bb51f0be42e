//! Hash tables of expressions: keys are a few small numbers, for which hashing dominates in the standard library's
//! tables.

use std::hash::{BuildHasherDefault, Hasher};

/// A table with expressions, nodes or symbols as keys.
pub type HashMap<K, V> = std::collections::HashMap<K, V, BuildHasherDefault<Mixer>>;
/// A set of expressions, nodes or symbols.
pub type HashSet<K> = std::collections::HashSet<K, BuildHasherDefault<Mixer>>;

/// An odd number whose multiples have well-distributed bits: 2⁶⁴ over the golden ratio (Knuth, The Art of Computer
/// Programming 3, §6.4).
const SPREADING: u64 = 0x9E37_79B9_7F4A_7C15;

/// Multiplies and adds the words written to it. Tables use the lowest and the highest bits: multiplication fills the
/// highest, and `finish` folds the upper half down once.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mixer(u64);

impl Mixer {
    fn mix(&mut self, word: u64) {
        self.0 = self.0.wrapping_add(word).wrapping_mul(SPREADING);
    }
}

impl Hasher for Mixer {
    fn finish(&self) -> u64 {
        (self.0 ^ (self.0 >> 32)).wrapping_mul(SPREADING)
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.mix(u64::from(*byte));
        }
    }

    fn write_u8(&mut self, word: u8) {
        self.mix(u64::from(word));
    }

    fn write_u32(&mut self, word: u32) {
        self.mix(u64::from(word));
    }

    fn write_u64(&mut self, word: u64) {
        self.mix(word);
    }

    fn write_usize(&mut self, word: usize) {
        self.mix(word as u64);
    }

    fn write_isize(&mut self, word: isize) {
        self.mix(word.cast_unsigned() as u64);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::hash::{BuildHasher, BuildHasherDefault};

    use super::Mixer;
    use crate::expr::{ExprGraph, Node, Symbol};

    /// Nodes that differ slightly are spread over a table about as evenly as random numbers, which leave 1/e of the
    /// places empty.
    #[test]
    fn neighbouring_nodes_are_spread() {
        let mut graph = ExprGraph::default();
        let symbols: Vec<_> = (0..64).map(|i| graph.symbol(Symbol::Unknown(i))).collect();
        let pairs =
            symbols.iter().flat_map(|a| symbols.iter().map(move |b| Node::Multiply(*a, *b)));
        let hasher = BuildHasherDefault::<Mixer>::default();
        let places: BTreeSet<u64> = pairs.map(|node| hasher.hash_one(node) % 4096).collect();
        assert!(places.len() > 2300, "{}", places.len());
        let tags: BTreeSet<u64> =
            symbols.iter().map(|symbol| hasher.hash_one(symbol) >> 57).collect();
        assert!(tags.len() > 40, "{}", tags.len());
    }
}
