//! How instances are searched and judged.

use crate::alignment::{PointToSurfaceSettings, RivalSettings, ScaleLimits};

/// What an expert may change; nothing has to be set. Lengths in voxels are in those of the scene's surface.
/// `benchmarks/sweep_settings.py` shows what other values give on simulated scenes.
///
/// ```
/// let settings = surfsig::FindSettings { min_score: 0.3, ..Default::default() };
/// assert_eq!(settings.proposals, 1000);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FindSettings {
    /// Probability that an instance is right, at least: it is rather right than wrong.
    pub min_score: f64,
    /// Instances of all models that are given at most, the most probable ones.
    pub at_most: usize,
    /// Places of the model that are matched with each place of the scene.
    pub similar: usize,
    /// Points of the model by which all transforms that matches propose are judged, without alignment, where the scene's
    /// viewpoint is known.
    pub few_points: usize,
    /// Voxels of that judgement in the model's extent: what a match's transform is off.
    pub rough_voxel: f64,
    /// Of these transforms, without those that nothing speaks for, how many are judged by more points: those that most others
    /// agree with. Of those that agree only one is taken: with 100 that are half as far from each other 74 of 120 half hidden
    /// brackets and frusta (`benchmarks/finding.py`) were found, with 300 of these 81, with 150 as far as they agree 85.
    pub agreed: usize,
    /// Of the model's extent, and radians, within which two of them agree. With 0.7 times as much 63 of 87 objects in clutter
    /// (`benchmarks/clutter.py`, seeds 720 to 727 and 730 to 733) were found in place of 64.
    pub agreed_within: [f64; 2],
    /// Of these, how many are aligned, by votes and support together. Of the same half hidden copies 81 are found with 60, 83
    /// with 100 or 120.
    pub aligned: usize,
    /// Share of the model that, where it is confirmed, counts as much as e times the votes. Of 166 objects in clutter (the same
    /// seeds and 1000 to 1010) 143 to 145 have a right transform among the first 20 with 0.2 to 0.5, 135 by votes alone.
    pub support_per_vote: f64,
    /// Proposed transforms that are aligned where the scene's viewpoint is not known. With 600, 80 points each and 150 kept,
    /// 15 of the 30 half hidden figures and frusta of seeds 1 to 3 of `benchmarks/finding.py` are found, in place of 22; with
    /// 1500 and 450 kept no more.
    pub proposals: usize,
    /// Points of the model in their alignment and judgement.
    pub first_points: usize,
    /// Voxels between correspondences in the steps of the first alignment: from, to, how many.
    pub first_distances: (f64, f64, usize),
    /// Of these, how many are judged by more points.
    pub kept: usize,
    /// Points of the model by which few transforms are aligned and judged, wherever they come from.
    pub coarse_points: usize,
    /// Voxels between correspondences in the steps of that alignment. Where the viewpoint is known, those of the first one are
    /// before them: without, 124 of the 166 objects are found in place of 125 (60 aligned).
    pub coarse_distances: (f64, f64, usize),
    /// Voxels of both judgements, in those of the last.
    pub coarse_voxels: f64,
    /// Transforms that are aligned and judged by most points. Of one instance the right one is among the first 9 wherever it
    /// is among 60; of five half hidden copies of two models 43 of 80 are found with 20, 48 with 60. Where the viewpoint is
    /// known, those with too small odds by the coarse alignment are tried only if another one is good enough, as its rivals:
    /// of the 166 objects 138 have a right one among 12,737 that are tried, and none of them is among the two thirds with
    /// odds below -2.
    pub tried: usize,
    /// In the brief search that tells whether one of several models may be there: of the transforms that matches of its largest
    /// patches propose, how many are aligned. Of 125 objects that are found in clutter (`benchmarks/clutter.py`, the same seeds)
    /// it keeps 122, and of those that are not there a fifth; 123 with 30, and 5 tried.
    pub brief_aligned: usize,
    /// Of these, how many are aligned again and judged.
    pub brief_tried: usize,
    /// By that many points. With 3000 it keeps no more, and takes a tenth longer.
    pub brief_points: usize,
    /// By how much the logarithm of the odds of the best of them may be below that of what is given up. With 0 it keeps 119 of
    /// the 125, and an eighth of those that are not there.
    pub brief_deficit: f64,
    /// How many of several models are searched after it, at most: those with the largest odds. Of 21 objects found in scenes of
    /// a library of 200 (`benchmarks/clutter.py`, seeds 720 to 723) 16 are among its first 24, 19 among its first 80.
    pub searched: usize,
    /// Points of the model in their alignment.
    pub aligned_points: usize,
    /// Voxels between correspondences in its steps.
    pub fine_distances: (f64, f64, usize),
    /// Points of the model in their judgement: shares of 3000 have a standard error of 0.01 at most.
    pub fine_points: usize,
    /// Distance between the points of the scene's surface, in its point spacings at least: steep surfaces have fewer
    /// points.
    pub spacings_per_voxel: f64,
    /// The same in the scene's noise, so that equal surfaces are well within a voxel.
    pub noises_per_voxel: f64,
    /// Patch radii, and radians, within which two proposed transforms agree.
    pub agreement: [f64; 2],
    /// Of these distances, between two proposals of which the less agreed one is left out.
    pub merged_share: f64,
    /// Patch radii, and radians, within which two aligned transforms are the same.
    pub same: [f64; 2],
    /// Points of the scene that an instance is fitted to at last.
    pub max_fitted: usize,
    /// How it is fitted to them: until the start does not matter, as instances are few.
    pub point_to_surface: PointToSurfaceSettings,
    /// Voxels from an instance's surface within which the scene's points are its own.
    pub own_distance: f64,
    /// What a point that the sensor saw through counts, in confirmed ones: of true poses hardly any is seen through.
    pub contradicted_weight: f64,
    /// The same of one where the sensor saw nothing: sensors miss dark and shiny surfaces.
    pub missing_weight: f64,
    /// What a confirmed point counts where nobody knows what the sensor saw through, and clutter reaches more.
    pub unknown_free_space_weight: f64,
    /// Spread of confirmed normals (1 less the largest eigenvalue of their second moments) from which on they are more
    /// than a plane, which anything has.
    pub round_spread: f64,
    /// Voxels from the scene's next point within which a point of the model lies on the scene.
    pub touching_distance: f64,
    /// Mean agreement in residual and normal, of 1, that another shape reaches where it touches by chance (0.4 to 0.6),
    /// and that equal surfaces reach (0.76 to 0.97, on simulated and real scans).
    pub agreement_by_chance: [f64; 2],
    /// When another transform explains as much of an instance's points.
    pub rivals: RivalSettings,
    /// Distance from the model, in radii of a patch, from which rivals are fitted: as in registration.
    pub rival_distance: f64,
    /// By how much the logarithm of the odds grows with the share of the model that is confirmed, where nobody knows what
    /// the sensor saw through.
    pub log_odds_per_share: f64,
    /// That share at which right and wrong are as probable then.
    pub share_of_even_odds: f64,
    /// Share of the support that a rival may lack: halves of a symmetric model differ by that in noise.
    pub rival_deficit: f64,
    /// The logarithm of a scale from which on it is doubted, as in registration.
    pub doubted_scale: f64,
    /// The same in its standard errors.
    pub scale_deviations: f64,
    /// Number of threads; all cores where it is `None`. The result is the same, bit for bit.
    pub threads: Option<usize>,
}

impl Default for FindSettings {
    fn default() -> Self {
        Self {
            min_score: 0.5,
            at_most: usize::MAX,
            similar: 5,
            few_points: 25,
            rough_voxel: 0.08,
            agreed: 150,
            agreed_within: [0.16, 0.33],
            aligned: 100,
            support_per_vote: 0.5,
            proposals: 1000,
            first_points: 100,
            first_distances: (4.0, 2.5, 4),
            kept: 300,
            coarse_points: 300,
            coarse_distances: (2.5, 1.5, 4),
            coarse_voxels: 2.0,
            tried: 60,
            brief_aligned: 20,
            brief_tried: 3,
            brief_points: 1000,
            brief_deficit: 1.0,
            searched: 100,
            aligned_points: 1000,
            fine_distances: (2.5, 1.5, 5),
            fine_points: 3000,
            spacings_per_voxel: 1.5,
            noises_per_voxel: 2.5,
            agreement: [0.5, 0.35],
            merged_share: 0.5,
            same: [0.25, 0.2],
            max_fitted: 3000,
            point_to_surface: PointToSurfaceSettings {
                epsilon: 1e-5,
                max_iterations: 15,
                ..Default::default()
            },
            own_distance: 1.5,
            contradicted_weight: 5.0,
            missing_weight: 1.0,
            unknown_free_space_weight: 0.6,
            round_spread: 0.1,
            touching_distance: 1.0,
            agreement_by_chance: [0.5, 0.75],
            rivals: RivalSettings::default(),
            rival_distance: 0.55,
            log_odds_per_share: 20.0,
            share_of_even_odds: 0.25,
            rival_deficit: 0.15,
            doubted_scale: ScaleLimits::DEFAULT.doubted,
            scale_deviations: ScaleLimits::DEFAULT.deviations,
            threads: None,
        }
    }
}
