//! The probability that a transform of a model is right, from all that was measured together.
//!
//! The log-likelihood ratio of right against wrong transforms is a logistic model of the measures. Its coefficients were
//! learnt on simulated scenes alone, by `scripts/learn_find_score.py`.

use super::FindSettings;

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
    /// Share of the model's rim where the scene goes on beyond it.
    pub going_on: f64,
    /// Spread of the normals that lie on the scene: 1 less the largest eigenvalue of their second moments.
    pub roundness: f64,
    /// Extent of the model in voxels of the scene.
    pub resolution: f64,
}

/// Terms of the logistic model, the first of which is constant.
const TERMS: usize = 8;
/// Their coefficients, from 414 instances in 17 simulated scenes (11 cluttered, 6 of half hidden copies), of which 79 are
/// right. Left out scene by scene, all 32 instances with a probability above 0.9 were right, and 62 of 79 above 0.5; in scenes
/// that were never looked at, 7 of 9 above 0.9.
const COEFFICIENTS: [f64; TERMS] = [-2.87, 2.04, 1.86, -32.29, -8.12, 1.17, -25.52, 4.4];
/// Spread of normals from which on they are more than a plane: it counts no more.
const ROUND: f64 = 0.1;

impl Measures {
    /// Each with its name.
    ///
    /// ```
    /// let measures = surfsig::Measures { support: 0.5, ..Default::default() };
    /// assert_eq!(measures.named()[0], ("support", 0.5));
    /// ```
    pub fn named(&self) -> [(&'static str, f64); 10] {
        [
            ("support", self.support),
            ("confirmed", self.confirmed),
            ("visible", self.visible),
            ("contradicted", self.contradicted),
            ("mismatched", self.mismatched),
            ("missing", self.missing),
            ("agreement", self.agreement),
            ("going_on", self.going_on),
            ("roundness", self.roundness),
            ("resolution", self.resolution),
        ]
    }

    fn terms(&self) -> [f64; TERMS] {
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
        self.terms().iter().zip(&COEFFICIENTS).map(|(term, coefficient)| term * coefficient).sum()
    }

    /// The same where nobody knows what the sensor saw through: by how much more of the model is confirmed than clutter
    /// reaches. `too_much` of a rim must not go on.
    pub(super) fn log_odds_without_free_space(&self, too_much: f64, settings: &FindSettings) -> f64 {
        let [chance, same] = settings.agreement_by_chance;
        let factor = (self.roundness / settings.round_spread).min(1.0)
            * (1.0 - self.going_on / too_much).max(0.0)
            * ((self.agreement - chance) / (same - chance)).clamp(0.0, 1.0);
        settings.log_odds_per_share * (self.support * factor - settings.share_of_even_odds)
    }
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
            ..Default::default()
        };
        let odds = |measures: Measures| measures.log_odds();
        assert!(odds(good) > 0.0);
        assert!(odds(Measures { confirmed: 0.2, visible: 0.3, ..good }) < odds(good));
        assert!(odds(Measures { agreement: 0.5, ..good }) < odds(good));
        assert!(odds(Measures { contradicted: 0.1, ..good }) < odds(good));
        assert!(odds(Measures::default()).is_finite());
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
        assert_eq!(even.log_odds_without_free_space(0.4, &settings), 0.0);
        let on_larger = Measures { going_on: 0.4, ..even };
        assert!(on_larger.log_odds_without_free_space(0.4, &settings) < -4.0);
    }
}
