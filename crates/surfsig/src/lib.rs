//! surfsig tells what a scanned surface is: curvature and surface signatures of point clouds.
//!
//! Around each point a paraboloid is fitted, its principal curvatures are read off, and, where
//! wanted, the fields of its Gaussian and mean curvature are expressed in a frame. Equal surfaces get
//! equal signatures.
//!
//! ```
//! use surfsig::{extract, ExtractOptions, Frame, PointCloud, Radius, similarity, Status};
//!
//! // Two bumps, each a cap of a sphere of radius 0.1, on different sides of the sensor.
//! let cap = |x0: f32, i: usize| {
//!     let (x, y) = ((i % 40) as f32 * 0.001 - 0.02, (i / 40) as f32 * 0.001 - 0.02);
//!     [x0 + x, y, (0.01 - x * x - y * y).sqrt()]
//! };
//! let points: Vec<[f32; 3]> = [0.0, 1.0].iter().flat_map(|x0| (0..1600).map(move |i| cap(*x0, i))).collect();
//!
//! let radius = Radius::new(0.01)?;
//! let found = extract(&PointCloud::new(&points), radius, &ExtractOptions::default())?;
//! let [a, b] = [20 * 40 + 20, 1600 + 20 * 40 + 20];
//! assert_eq!(found.status[a], Status::Ok);
//! assert!((found.k1[a] - 10.0).abs() < 0.1 && (found.k2[b] - 10.0).abs() < 0.1);
//!
//! let [wa, wb] = [a, b].map(|i| Frame::shared().signature(&found.paraboloid(i)).unwrap());
//! assert!(similarity(&wa, &wb) > 0.999);
//! # Ok::<(), surfsig::Error>(())
//! ```
//!
//! The way of the data, room by room: [`PointCloud`] -> [`CellIndex`] -> [`Moments`] -> paraboloid
//! ([`FitAxes`]) -> curvature ([`Paraboloid`]) -> [`Frame`] -> [`similarity`]; [`extract()`] walks it.
//! [`fit_sphere`], [`fit_cylinder`] and [`fit_quadric`] read other surfaces off the same moments, [`fit_primitive`]
//! fits one by orthogonal distance, and [`find_surfaces`] finds all of a scan.

mod alignment;
mod ball;
mod block_sums;
mod cell_index;
mod curvature;
mod depth_image;
mod error;
mod extract;
mod extremes;
mod field;
mod finding;
mod fit;
mod frame;
mod fused_map;
mod geometry;
mod hierarchy;
mod kd_tree;
mod lattice;
mod members;
mod moments;
mod monitor;
mod multiply_add;
mod neighbor_distances;
mod odometry;
mod orientation;
mod point_cloud;
mod primitive;
mod random;
mod recurrences;
mod registration;
mod resolution;
mod scan;
mod shells;
mod simd;
mod similarity;
mod spacing;
mod statistics;
mod status;
mod surfaces;
mod tensor;
mod threads;
mod visibility;
mod voxels;

pub use alignment::{
    Alternative, ConsensusSettings, Doubt, FreeDirection, GicpCloud, GicpResult, GicpSettings,
    PointToSurfaceSettings, RivalSettings, free_directions, gicp,
};
pub use cell_index::CellIndex;
pub use curvature::{ALPHA, GRID, MeanCurvatureFormula, Paraboloid};
pub use depth_image::{DepthImage, Judgement, SurfacePlace};
pub use error::Error;
pub use extract::{
    Column, ExtractOptions, Extraction, FEWEST_AUTO_POINTS, NearestDistances, Neighborhood, PartSize,
    Queries, WholeCloud, different_places, distance_to_nearest, extract, extract_auto_radius,
    extract_monitored, extract_part, extract_radii, sampled_numbers, voxel_representatives,
};
pub use field::{
    FIELD_PHASES, FIELD_SIGNATURE, FieldMatch, FieldOptions, FieldPatches, FieldPhases, FieldPlaces,
    FieldSignature, KeypointOptions, field_distinctiveness, field_pools, field_signatures, find_keypoints,
    match_fields,
};
pub use finding::{
    FIND_STEPS_PER_MODEL, FindSettings, Instance, MODEL_STEPS, Measures, Model, ModelSource, find_instances,
    find_instances_of,
};
pub use fit::{
    Cylinder, FitAxes, FitKind, FitUsed, Quadric, Sphere, SurfacePoint, fit_cylinder, fit_quadric, fit_sphere,
};
pub use frame::{FLAT_ATOM_NOISES, Frame, FrameParameters, Levels, SIGNATURE, VOCABULARY_END};
pub use fused_map::FusedMap;
pub use geometry::{RigidTransform, TransformError};
pub use kd_tree::KdTree;
pub use moments::{EXPONENTS, MOMENTS, Moments, Scalar, slot};
pub use monitor::Monitor;
pub use neighbor_distances::mean_neighbor_distances;
pub use odometry::{
    ExpectationSettings, LoopClosure, MapSettings, Odometry, OdometrySettings, PredictionSettings,
    RelocalisationSettings, ScaleSettings, ScanAlignmentSettings, ScanPose, ScanStatus, SegmentSettings,
    deskew, spin_times, time_range,
};
pub use orientation::consistent_directions;
pub use point_cloud::{Offsets, PointCloud, Radius};
pub use primitive::{
    Primitive, PrimitiveFitOptions, PrimitiveUncertainty, SurfaceKind, fit_primitive, fit_primitive_with,
};
pub use recurrences::{
    ExaminedPose, OrientedScan, PieceAlignment, PieceSituation, PieceView, PoseEvidence, PosesOfPair,
    RecurrenceSettings, align_pieces, examine_poses, judge_poses, refine_poses,
};
pub use registration::{
    FaceSettings, FreeSpaceSettings, REGISTRATION_STEPS, Registration, RegistrationSettings,
    free_space_share, register,
};
pub use resolution::{COARSEST_STEP, RESOLUTION_SAMPLES, Resolution};
pub use scan::Scan;
pub use simd::InstructionSet;
pub use similarity::{GOOD, OPTIMAL, SimilarityClass, similarity};
pub use spacing::point_spacing;
pub use status::Status;
pub use surfaces::{
    FEWEST_SURFACE_POINTS, FoundSurface, FoundSurfaces, JoinedPieces, PiecePair, SurfaceOptions,
    SurfacePiece, SurfaceSums, find_surfaces, join_surface_pieces,
};
pub use threads::with_threads;
pub use visibility::{
    RangeImageSettings, SphericalRangeImage, Visibility, all_seen_from, estimated_viewpoint, hidden_from,
    measured_from_origin,
};
pub use voxels::voxel_means;
