//! Which blocks of the file are taken: a bit for each, and the first run of free ones that is long enough.

/// Bits in a word.
const BITS: usize = 64;

/// Blocks, taken or free.
#[derive(Debug)]
pub(crate) struct Blocks {
    words: Vec<u64>,
    len: usize,
    /// No block before this one is free.
    first: usize,
    /// All blocks from this one on are free.
    end: usize,
}

impl Blocks {
    /// So many, all free.
    pub(crate) fn free(len: usize) -> Self {
        Blocks { words: vec![0; len.div_ceil(BITS)], len, first: 0, end: 0 }
    }

    /// The number of blocks in front of which all lie that are taken.
    pub(crate) fn end(&self) -> usize {
        self.end
    }

    /// Takes so many blocks in a row; where they begin.
    pub(crate) fn take(&mut self, n: usize) -> Option<usize> {
        let at = self.run(n)?;
        self.mark(at, n, true);
        if at == self.first {
            self.first = at + n;
        }
        self.end = self.end.max(at + n);
        Some(at)
    }

    /// Takes the blocks up to `more` behind `n` that are taken already, where these are free.
    pub(crate) fn grow(&mut self, at: usize, n: usize, more: usize) -> bool {
        let is_free = at + more <= self.len && (at + n..at + more).all(|k| !self.is_taken(k));
        if is_free {
            self.mark(at + n, more - n, true);
            self.end = self.end.max(at + more);
        }
        is_free
    }

    /// Frees so many blocks from there on.
    pub(crate) fn give_back(&mut self, at: usize, n: usize) {
        self.mark(at, n, false);
        self.first = self.first.min(at);
        if at + n == self.end {
            self.end = at;
            while self.end > 0 && !self.is_taken(self.end - 1) {
                self.end -= 1;
            }
        }
    }

    fn is_taken(&self, k: usize) -> bool {
        self.words[k / BITS] >> (k % BITS) & 1 == 1
    }

    /// The first run of so many free blocks.
    fn run(&self, n: usize) -> Option<usize> {
        let mut begin = self.first;
        let mut k = begin;
        while k < self.end && k - begin < n {
            let word = self.words[k / BITS];
            if k.is_multiple_of(BITS) && word == 0 {
                k += BITS;
            } else if k.is_multiple_of(BITS) && word == u64::MAX {
                k += BITS;
                begin = k;
            } else {
                k += 1;
                if self.is_taken(k - 1) {
                    begin = k;
                }
            }
        }
        (begin.checked_add(n)? <= self.len).then_some(begin)
    }

    fn mark(&mut self, at: usize, n: usize, taken: bool) {
        for k in at..at + n {
            let bit = 1 << (k % BITS);
            let word = &mut self.words[k / BITS];
            *word = if taken { *word | bit } else { *word & !bit };
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::Rng;

    use super::*;

    /// What the bits should be, by the definition.
    fn first_run(taken: &[bool], n: usize) -> Option<usize> {
        (0..(taken.len() + 1).checked_sub(n)?).find(|at| taken[*at..at + n].iter().all(|t| !t))
    }

    #[test]
    fn the_first_run_that_is_long_enough_is_taken() {
        let mut random = Pcg64Mcg::new(7);
        let mut below = |n: usize| (random.next_u64() % n as u64) as usize;
        for len in [1, 63, 64, 65, 700] {
            let (mut blocks, mut taken) = (Blocks::free(len), vec![false; len]);
            let mut held: Vec<(usize, usize)> = Vec::new();
            for _ in 0..3000 {
                match below(5) {
                    0 | 1 => {
                        let most = if below(4) == 0 { 150 } else { 9 };
                        let n = 1 + below(most);
                        let expected = first_run(&taken, n);
                        assert_eq!(blocks.take(n), expected, "{n} of {len}");
                        if let Some(at) = expected {
                            taken[at..at + n].fill(true);
                            held.push((at, n));
                        }
                    }
                    2 if !held.is_empty() => {
                        let k = below(held.len());
                        let (at, n) = held[k];
                        let more = n + below(70);
                        let fits = at + more <= len && taken[at + n..at + more].iter().all(|t| !t);
                        assert_eq!(blocks.grow(at, n, more), fits);
                        if fits {
                            taken[at..at + more].fill(true);
                            held[k] = (at, more);
                        }
                    }
                    _ if !held.is_empty() => {
                        let (at, n) = held.swap_remove(below(held.len()));
                        blocks.give_back(at, n);
                        taken[at..at + n].fill(false);
                    }
                    _ => {}
                }
                let end = taken.iter().rposition(|t| *t).map_or(0, |last| last + 1);
                assert_eq!(blocks.end(), end);
            }
        }
    }
}
