//! Places with their field signatures, as they are matched.

use super::{FIELD_SIGNATURE, FieldPatches, FieldPhases, FieldSignature};
use crate::Status;

/// Places that have a field signature: one struct of arrays.
///
/// ```
/// let places = surfsig::FieldPlaces::new(0.5);
/// assert!(places.is_empty());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FieldPlaces {
    /// Of the patches, in the cloud's unit.
    pub radius: f64,
    /// Numbers of the cloud's points.
    pub indices: Vec<u32>,
    /// Where they are.
    pub points: Vec<[f64; 3]>,
    /// Signatures, of length 1.
    pub vectors: Vec<[f32; FIELD_SIGNATURE]>,
    /// Large-scale unit normals.
    pub axes: Vec<[f32; 3]>,
    /// Unit vectors square to the axes, from which angles are counted by the right-hand rule.
    pub tangents: Vec<[f32; 3]>,
    /// Coefficients with their phases.
    pub phases: Vec<FieldPhases>,
    /// Points of the support in each patch.
    pub count: Vec<u32>,
}

impl FieldPlaces {
    /// No places yet, of patches of a radius.
    pub fn new(radius: f64) -> Self {
        Self {
            radius,
            indices: Vec::new(),
            points: Vec::new(),
            vectors: Vec::new(),
            axes: Vec::new(),
            tangents: Vec::new(),
            phases: Vec::new(),
            count: Vec::new(),
        }
    }

    /// Those places of a cloud whose signature is known.
    pub(crate) fn known(
        radius: f64,
        indices: &[u32],
        points: &[[f64; 3]],
        patches: &FieldPatches<FieldSignature>,
    ) -> Self {
        let mut known = Self::new(radius);
        for place in (0..points.len()).filter(|&place| patches.status[place] == Status::Ok) {
            known.indices.push(indices[place]);
            known.points.push(points[place]);
            known.vectors.push(*patches.values[place].vector);
            known.phases.push(*patches.values[place].phases);
            known.axes.push(patches.axes[place]);
            known.tangents.push(patches.tangents[place]);
            known.count.push(patches.count[place]);
        }
        known
    }

    /// Number of places.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Some of them, in the order of the numbers given.
    ///
    /// # Panics
    /// If a number is outside.
    ///
    /// ```
    /// assert_eq!(surfsig::FieldPlaces::new(0.5).take(&[]).len(), 0);
    /// ```
    #[must_use]
    pub fn take(&self, places: &[usize]) -> Self {
        fn chosen<T: Copy>(values: &[T], places: &[usize]) -> Vec<T> {
            places.iter().map(|&place| values[place]).collect()
        }
        Self {
            radius: self.radius,
            indices: chosen(&self.indices, places),
            points: chosen(&self.points, places),
            vectors: chosen(&self.vectors, places),
            axes: chosen(&self.axes, places),
            tangents: chosen(&self.tangents, places),
            phases: chosen(&self.phases, places),
            count: chosen(&self.count, places),
        }
    }
}
