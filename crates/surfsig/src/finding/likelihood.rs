//! The probability that a transform of a model is right, from all that was measured together.
//!
//! The log-likelihood ratio of right against wrong transforms is a logistic model of the measures. Its coefficients were
//! learnt on simulated scenes alone; `scripts/learn_find_score.py` learns them from instances.

use super::FindSettings;
use super::rim::TOO_MUCH;

/// What is measured of a transform of a model in a scene. Shares of a model's samples are over the most of the model that
/// can be seen at once.
///
/// ```
/// assert_eq!(surfsig::Measures::default().confirmed, 0.0);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measures {
    /// Confirmed less wrong samples.
    pub support: f64,
    /// On the scene's surface, facing alike.
    pub confirmed: f64,
    /// Share of what faces the sensor that is confirmed.
    pub visible: f64,
    /// Where the sensor saw through.
    pub contradicted: f64,
    /// Just beneath the scene's surface or before it, or at another angle.
    pub mismatched: f64,
    /// Facing the sensor, where it measured nothing.
    pub missing: f64,
    /// Mean agreement in residual and normal of what lies on the scene, 0 to 1.
    pub agreement: f64,
    /// Standard deviation of the residuals that neighbours on the scene share, as noise does not, over the model's extent.
    pub misfit: f64,
    /// Share of the model's rim where the scene goes on beyond it; of a view half of that share, as it also ends where
    /// something was before it.
    pub going_on: f64,
    /// Spread of the normals that lie on the scene: 1 less the largest eigenvalue of their second moments.
    pub roundness: f64,
    /// Extent of the model in voxels of the scene.
    pub resolution: f64,
    /// Of what faces the sensor and the model itself does not hide, the share that is confirmed.
    pub front_confirmed: f64,
    /// The share that lies well behind the scene's surface.
    pub front_hidden: f64,
    /// Of what is not hidden, the share on or just beneath the scene's surface that is not alike.
    pub front_mismatched: f64,
    /// The share of that where the sensor saw through.
    pub front_contradicted: f64,
    /// The share of that where it measured nothing.
    pub front_missing: f64,
    /// Pixels, a voxel of the scene wide, in which the model is confirmed.
    pub pixels: f64,
    /// Share of the ways out over the model's outline, from what is confirmed beside it, on which the scene steps back or
    /// was not measured.
    pub outline_ends: f64,
    /// The share on which the scene goes on smoothly.
    pub outline_goes_on: f64,
    /// Ways from confirmed to hidden places next to them on which the scene has no step towards the sensor, so that
    /// nothing can hide them, over the confirmed pixels.
    pub uncovered: f64,
    /// How well what lies on the scene determines the transform: of all small motions the least mean square by which one
    /// changes the distances there, over the mean square by which it moves the model; 0 where a motion changes none.
    pub constraint: f64,
    /// Logarithm of the odds that the transform is right, by all of the above.
    pub own_log_odds: f64,
    /// By how much it is above that of the best other transform that explains the same part of the scene, symmetries of the
    /// model left out.
    pub margin_over_rivals: f64,
}

/// Terms of the logistic model of all measures, the first of which is constant.
const TERMS: usize = 10;
/// Their coefficients, from 2392 transforms in 15 cluttered scenes and 12 of half hidden copies, of which 143 are right: all
/// that were fitted to the scene's own points, wrong ones at one place counting as one; then constant and slope were fitted
/// to the best of each place. Left out scene by scene, 56 of 59 of these with a probability above 0.9 were right, 25 of 27
/// from 0.7 on.
const COEFFICIENTS: [f64; TERMS] = [-2.41, 1.50, -3.46, -64.7, -11.3, 1.35, 0.72, 6.70, -37.7, -0.53];
/// Terms of the one of few samples, whose front and outline are not known.
const TERMS_OF_SAMPLES: usize = 8;
/// Their coefficients, from 414 instances in 17 simulated scenes (11 cluttered, 6 of half hidden copies), of which 79 are
/// right. They choose which transforms are judged by all measures.
const COEFFICIENTS_OF_SAMPLES: [f64; TERMS_OF_SAMPLES] =
    [-2.87, 2.04, 1.86, -32.29, -8.12, 1.17, -25.52, 4.4];
/// Terms of the one by which instances are accepted at last, after their fit and among rivals.
const TERMS_AMONG_RIVALS: usize = 9;
/// Their coefficients, from 838 instances in 27 cluttered scenes, where the library of 20 was looked for at once and objects
/// alone, and in 54 of half hidden copies; objects of nearly the same shape were looked for, too; 517 are right. Left out
/// scene by scene, 318 of 330 with a probability above 0.9 were right, 111 of 135 from 0.7 on, 44 of 67 from 0.5 on
/// (`scripts/learn_find_score.py`).
const COEFFICIENTS_AMONG_RIVALS: [f64; TERMS_AMONG_RIVALS] =
    [-14.22, 0.44, -544.60, -794.71, -32.97, -2.74, 7.71, 0.65, 0.25];
/// Terms of the one where nobody knows what the sensor saw through.
const TERMS_WITHOUT_FREE_SPACE: usize = 6;
/// Their coefficients, from 304 instances in 18 cluttered scenes and 18 of half hidden copies that were thinned and moved; 90
/// are right. Left out scene by scene, all 36 with a probability above 0.9 were right, 30 of 34 from 0.7 on.
const COEFFICIENTS_WITHOUT_FREE_SPACE: [f64; TERMS_WITHOUT_FREE_SPACE] =
    [-22.05, 0.29, -61.22, 0.72, -4.66, 0.99];
/// Logarithm of the odds by a transform's own evidence below which nothing was learnt there: a probability of 0.3.
pub(super) const LEAST_WITHOUT_FREE_SPACE: f64 = -0.85;
/// Where a rival explains the same part of the scene, the odds are at most those against it: this margin is that of even ones.
/// In 30 scenes 15 of 61 instances with a margin from -1 to 1 are right. Chosen by the likelihood of these scenes' instances.
const EVEN_MARGIN: f64 = 0.5;
/// A margin beyond which more says no more.
const LARGE_MARGIN: f64 = 8.0;
/// Spread of normals from which on they are more than a plane: it counts no more.
const ROUND: f64 = 0.1;
/// The same beyond which more says no more, where rivals count, too.
const VERY_ROUND: f64 = 0.3;
/// Share of the samples that was seen through, beyond which more says no more: few right transforms have as much.
const MUCH_CONTRADICTED: f64 = 0.1;
/// Logarithm of the odds by a transform's own evidence below which less says no more.
const LEAST_OWN: f64 = -5.0;
/// What is added to a constraint before its logarithm is taken: less is next to none.
const NO_CONSTRAINT: f64 = 0.003;
/// The same of a misfit: noise leaves as much.
const NO_MISFIT: f64 = 0.005;
/// The same of what nothing hides.
const FEW_UNCOVERED: f64 = 0.02;
/// Share of the front that was seen through, or of the outline on which the scene goes on, beyond which more says no more:
/// real sensors and models err in more ways than simulated ones.
const ENOUGH: f64 = 0.003;
/// What is added to a number of pixels before its logarithm is taken: fewer are next to nothing.
const FEW_PIXELS: f64 = 10.0;
/// Pixels beyond which more count no more: as many as were learnt from.
const MANY_PIXELS: f64 = 2500.0;

impl Measures {
    /// Each with its name.
    ///
    /// ```
    /// let measures = surfsig::Measures { support: 0.5, ..Default::default() };
    /// assert_eq!(measures.named()[0], ("support", 0.5));
    /// ```
    pub fn named(&self) -> [(&'static str, f64); 23] {
        [
            ("support", self.support),
            ("confirmed", self.confirmed),
            ("visible", self.visible),
            ("contradicted", self.contradicted),
            ("mismatched", self.mismatched),
            ("missing", self.missing),
            ("agreement", self.agreement),
            ("misfit", self.misfit),
            ("going_on", self.going_on),
            ("roundness", self.roundness),
            ("resolution", self.resolution),
            ("front_confirmed", self.front_confirmed),
            ("front_hidden", self.front_hidden),
            ("front_mismatched", self.front_mismatched),
            ("front_contradicted", self.front_contradicted),
            ("front_missing", self.front_missing),
            ("pixels", self.pixels),
            ("outline_ends", self.outline_ends),
            ("outline_goes_on", self.outline_goes_on),
            ("uncovered", self.uncovered),
            ("constraint", self.constraint),
            ("own_log_odds", self.own_log_odds),
            ("margin_over_rivals", self.margin_over_rivals),
        ]
    }

    /// Terms whose sum, weighted by coefficients, is the logarithm of the odds.
    fn terms(&self) -> [f64; TERMS] {
        [
            1.0,
            self.visible,
            self.front_mismatched,
            self.front_contradicted,
            self.going_on,
            (self.constraint + NO_CONSTRAINT).ln(),
            (self.pixels.min(MANY_PIXELS) + FEW_PIXELS).ln(),
            self.outline_ends,
            self.outline_goes_on,
            (self.uncovered + FEW_UNCOVERED).ln(),
        ]
    }

    fn terms_of_samples(&self) -> [f64; TERMS_OF_SAMPLES] {
        let of = |part: f64| part / (self.confirmed + part).max(1e-9);
        [
            1.0,
            // Above 1 where a scene is denser than what was learnt from: of two transforms that are both all but sure, the
            // one of which more is confirmed goes first.
            self.confirmed.max(1e-3).ln(),
            self.visible,
            of(self.contradicted),
            of(self.missing),
            self.agreement,
            self.going_on,
            (self.roundness / ROUND).min(1.0),
        ]
    }

    /// Logarithm of the odds that the transform is right, where it is known from where the scene was seen.
    pub(super) fn log_odds(&self) -> f64 {
        sum_of_products(&self.terms(), &COEFFICIENTS)
    }

    fn terms_among_rivals(&self) -> [f64; TERMS_AMONG_RIVALS] {
        [
            1.0,
            (self.constraint + NO_CONSTRAINT).ln(),
            self.outline_goes_on.min(ENOUGH),
            self.front_contradicted.min(ENOUGH),
            self.contradicted.min(MUCH_CONTRADICTED),
            (self.misfit + NO_MISFIT).ln(),
            self.roundness.min(VERY_ROUND),
            self.own_log_odds.max(LEAST_OWN),
            self.margin_over_rivals,
        ]
    }

    fn terms_without_free_space(&self) -> [f64; TERMS_WITHOUT_FREE_SPACE] {
        [
            1.0,
            self.own_log_odds,
            self.going_on,
            (self.constraint + NO_CONSTRAINT).ln(),
            (self.misfit + NO_MISFIT).ln(),
            self.margin_over_rivals,
        ]
    }

    /// The same measures with the margin over rivals, the best of which has some odds, and the logarithm of the odds that the
    /// transform is right by all; `own` is that by its own evidence.
    pub(super) fn among_rivals(&self, own: f64, rival: f64, is_free_space_known: bool) -> (Self, f64) {
        let margin_over_rivals = (own - rival).clamp(-LARGE_MARGIN, LARGE_MARGIN);
        let all = Self { own_log_odds: own, margin_over_rivals, ..*self };
        let log_odds = if is_free_space_known {
            let log_odds = sum_of_products(&all.terms_among_rivals(), &COEFFICIENTS_AMONG_RIVALS);
            log_odds.min(margin_over_rivals - EVEN_MARGIN)
        } else {
            sum_of_products(&all.terms_without_free_space(), &COEFFICIENTS_WITHOUT_FREE_SPACE)
        };
        (all, log_odds)
    }

    /// The same without the front and the outline, of which few samples give no picture.
    pub(super) fn log_odds_of_samples(&self) -> f64 {
        sum_of_products(&self.terms_of_samples(), &COEFFICIENTS_OF_SAMPLES)
    }

    /// The same where nobody knows what the sensor saw through: by how much more of the model is confirmed than clutter
    /// reaches. A rim must not go on.
    pub(super) fn log_odds_without_free_space(&self, settings: &FindSettings) -> f64 {
        let [chance, same] = settings.agreement_by_chance;
        let factor = (self.roundness / settings.round_spread).min(1.0)
            * (1.0 - self.going_on / TOO_MUCH).max(0.0)
            * ((self.agreement - chance) / (same - chance)).clamp(0.0, 1.0);
        settings.log_odds_per_share * (self.support * factor - settings.share_of_even_odds)
    }
}

fn sum_of_products(terms: &[f64], coefficients: &[f64]) -> f64 {
    terms.iter().zip(coefficients).map(|(term, coefficient)| term * coefficient).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odds_grow_with_what_is_confirmed_and_fall_with_what_contradicts() {
        let good = Measures {
            support: 0.7,
            confirmed: 0.7,
            visible: 0.8,
            agreement: 0.8,
            roundness: 0.3,
            resolution: 60.0,
            front_confirmed: 0.7,
            front_mismatched: 0.2,
            pixels: 500.0,
            outline_ends: 0.15,
            constraint: 0.02,
            ..Default::default()
        };
        let odds = |measures: Measures| measures.log_odds();
        assert!(odds(good) > 0.0);
        assert!(odds(Measures { visible: 0.3, ..good }) < odds(good));
        assert!(odds(Measures { front_mismatched: 0.5, ..good }) < odds(good));
        assert!(odds(Measures { front_contradicted: 0.1, ..good }) < odds(good));
        assert!(odds(Measures { going_on: 0.3, ..good }) < odds(good));
        assert!(odds(Measures { constraint: 0.0005, ..good }) < odds(good));
        assert!(odds(Measures { pixels: 50.0, ..good }) < odds(good));
        assert!(odds(Measures { outline_ends: 0.01, ..good }) < odds(good));
        assert!(odds(Measures { outline_goes_on: 0.1, ..good }) < odds(good));
        assert!(odds(Measures { uncovered: 0.3, ..good }) < odds(good));
        assert!(odds(Measures::default()).is_finite());
        let of_samples = |measures: Measures| measures.log_odds_of_samples();
        assert!(of_samples(good) > 0.0);
        assert!(of_samples(Measures { confirmed: 0.2, visible: 0.3, ..good }) < of_samples(good));
        assert!(of_samples(Measures { agreement: 0.5, ..good }) < of_samples(good));
        assert!(of_samples(Measures { contradicted: 0.1, ..good }) < of_samples(good));
        assert!(of_samples(Measures::default()).is_finite());
    }

    #[test]
    fn without_free_space_the_odds_are_even_at_the_share_that_clutter_reaches() {
        let settings = FindSettings::default();
        let even = Measures {
            support: settings.share_of_even_odds,
            agreement: settings.agreement_by_chance[1],
            roundness: 1.0,
            ..Default::default()
        };
        assert_eq!(even.log_odds_without_free_space(&settings), 0.0);
        let on_larger = Measures { going_on: 0.4, ..even };
        assert!(on_larger.log_odds_without_free_space(&settings) < -4.0);
    }
}
