//! The thresholds for verdicts.

/// Thresholds for verdicts. Squares of errors are relative to the variance of the sensors' noise; Σ is over samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Thresholds {
    /// Maximum mean square of each output's errors with which a structure explains the training data. The margin is a
    /// few per cent of the sensors' noise, more than rounding and less than any effect.
    pub explained: f64,
    /// The maximum for validation data: 1.2 times the noise, since start values are estimated from only a minute there,
    /// and parameters only from the training data.
    pub explained_held_out: f64,
    /// The maximum for validation data if a structure with more effects explains the data and is hardly more likely:
    /// 1.5 times the noise, to allow for wrong estimates in the simpler one.
    pub nearly_explained_held_out: f64,
    /// Residuals count as noise if no test has a p-value below this divided by the number of outputs: one false alarm
    /// in ten thousand models.
    pub false_alarm: f64,
    /// A further effect is worth including if it leaves at most this fraction of Σ(ε² − 1): half of the excess over
    /// noise.
    pub worth_its_place: f64,
    /// And if the Bayesian information criterion falls by this: three times "very strong" evidence (Kass & Raftery, J.
    /// Am. Stat. Assoc. 90 (1995) 773), since it is the best of a library.
    pub least_gain: f64,
    /// Templates whose criteria differ by less count as equal: "not worth more than a bare mention" (Kass & Raftery).
    pub even: f64,
    /// Effects that leave at most this fraction of the base model's excess over noise are named although they leave
    /// more than noise …
    pub nearly_all: f64,
    /// … if it is at most this fraction on validation recordings, where parameters suffer from the remaining
    /// discrepancy …
    pub nearly_all_held_out: f64,
    /// … if without any one of them the rest is larger by this factor …
    pub essential: f64,
    /// … and if all other names leave this many times as much, on training or validation recordings.
    pub unrivalled: f64,
    /// Templates that leave at most this fraction of the base model's mean square, on validation recordings too,
    /// describe the recordings.
    pub mostly: f64,
    /// A third effect is sought if two leave less than this fraction of the base model's Σ(ε² − 1).
    pub promising: f64,
    /// Maximum p-value of a named effect.
    pub significant: f64,
    /// Minimum fraction of resamples whose best structure has a named effect or one that the data cannot distinguish
    /// from it: more often than not.
    pub included: f64,
    /// Minimum number of readings on either side of an onset: the length of the shortest average in misfit detection.
    pub aside: usize,
    /// An effect cancels another if together they leave less than this fraction of it, root mean square: the
    /// probability that two unrelated sizes are so close.
    pub taken_back: f64,
    /// A structure is an alternative if its root-mean-square validation error is at most this multiple of the best:
    /// less than the change of estimates from one recording to the next.
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
