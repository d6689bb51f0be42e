//! The numbers that verdicts are decided by.

/// Limits of what is believed. Squares of errors are over the variance of the sensors' noise; Σ is over samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Thresholds {
    /// A structure explains the training data up to this mean square of the errors of each output. What it
    /// leaves is a few per cent of the sensors' noise, more than rounding and less than any effect.
    pub explained: f64,
    /// The same of validation data: 1.2 times the noise, as start values are known from a minute only there, and
    /// parameters no better than the training data tells.
    pub explained_held_out: f64,
    /// The same where a structure with more effects explains the data and is hardly more likely: 1.5 times the
    /// noise, which wrong estimates of the simpler one may add.
    pub nearly_explained_held_out: f64,
    /// Residuals are nothing but noise where no test of them has a p-value below this, over the number of
    /// outputs: one false alarm in ten thousand models.
    pub false_alarm: f64,
    /// A further effect is worth its place where it leaves at most this share of Σ(ε² − 1): half of what is
    /// there beyond noise.
    pub worth_its_place: f64,
    /// And where the Bayesian information criterion falls by this: three times what is called very strong
    /// evidence (Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 773), since it is the best of a library.
    pub least_gain: f64,
    /// Templates whose criteria differ by less say the same: not worth more than a bare mention (Kass & Raftery).
    pub even: f64,
    /// Effects that leave at most this share of what the base model leaves beyond noise are named although
    /// they leave more than noise …
    pub nearly_all: f64,
    /// … if it is at most this share on validation recordings, where parameters are no better than what is
    /// left over lets them be …
    pub nearly_all_held_out: f64,
    /// … without any one of them so many times as much is left …
    pub essential: f64,
    /// … and all other names leave so many times as much, on one or the other of the recordings.
    pub unrivalled: f64,
    /// Templates that leave at most this share of the base model's mean square, on validation recordings too, are what
    /// the recordings look like.
    pub mostly: f64,
    /// A third effect is looked for where two have left less than this share of Σ(ε² − 1) of the base model.
    pub promising: f64,
    /// The largest p-value of an effect that is named.
    pub significant: f64,
    /// The least share of resamples whose best structure has a named effect or what the data cannot tell from
    /// it: more often than not.
    pub included: f64,
    /// Readings on either side of an onset: as many as the shortest mean that tells a misfit from noise has.
    pub aside: usize,
    /// An effect takes another back where they leave less than this share of it, root mean square: the chance
    /// that two sizes that know nothing of each other are so near.
    pub taken_back: f64,
    /// A structure is an alternative where its validation error, root mean square, is at most so many times that
    /// of the best: less than estimates change from one recording to the next.
    pub alternative: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Thresholds {
            explained: 1.1,
            explained_held_out: 1.44,
            nearly_explained_held_out: 2.25,
            false_alarm: 1e-4,
            worth_its_place: 0.5,
            least_gain: 30.0,
            even: 2.0,
            nearly_all: 0.02,
            nearly_all_held_out: 0.1,
            essential: 3.0,
            unrivalled: 1.5,
            mostly: 0.4,
            promising: 0.1,
            significant: 0.01,
            included: 0.5,
            aside: 8,
            taken_back: 0.2,
            alternative: 1.05,
        }
    }
}
